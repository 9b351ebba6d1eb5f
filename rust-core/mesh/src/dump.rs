//! The stages of an operation, to look at: with `SURFRECON_DUMP=folder` in the environment each leaves a PLY file there, which Blender,
//! MeshLab and others open. For those who work on the algorithms. Nothing else in this library looks at the environment for what to do.
//!
//! Files are `NAME.ply`, numbered if a stage comes again (`NAME.1.ply`, ...). They have single precision, a colour per vertex by its value,
//! and the value itself as the property `value`. A file of another run is replaced, once the new one is whole. Whatever is no regular file,
//! as a pipe, is left alone.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use glam::DVec3;

use base::error::{Error, Result};

/// The variable that names the folder.
pub const VARIABLE: &str = "SURFRECON_DUMP";

/// Something of a stage: points or a surface.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    /// Coordinates.
    pub positions: Vec<DVec3>,
    /// The value that each vertex is told by: the number of its scan, patch or part, or a label. Empty for nothing.
    pub values: Vec<i32>,
    /// Faces. None for points.
    pub triangles: Vec<[u32; 3]>,
}

/// Writes what `make` makes as the stage `name`, if that is asked for. Else it isn't made.
///
/// # Errors
/// [`Error::Input`] naming the file that can't be written. Nothing of it is left then.
pub fn stage(name: &str, make: impl FnOnce() -> Stage) -> Result<()> {
    let Some(folder) = std::env::var_os(VARIABLE).filter(|folder| !folder.is_empty()) else { return Ok(()) };
    let path = next(Path::new(&folder), name);
    whole(&path, |file| write(file, &make())).map_err(|error| {
        Error::input(format!(
            "{VARIABLE}: {} can't be written ({error}): name a folder that is there and has room",
            path.display()
        ))
    })
}

/// The file of a stage: those of one run are numbered.
fn next(folder: &Path, name: &str) -> PathBuf {
    static WRITTEN: Mutex<Option<HashMap<PathBuf, u32>>> = Mutex::new(None);
    let mut written = WRITTEN.lock().unwrap_or_else(PoisonError::into_inner);
    let count = written.get_or_insert_default().entry(folder.join(name)).or_default();
    *count += 1;
    folder.join(if *count == 1 { format!("{name}.ply") } else { format!("{name}.{}.ply", *count - 1) })
}

/// Has a file written under another name, which it has until it is whole.
fn whole(path: &Path, write: impl FnOnce(File) -> std::io::Result<()>) -> std::io::Result<()> {
    // Opened, a pipe would be waited for; renamed over, it would be gone.
    if std::fs::metadata(path).is_ok_and(|known| !known.is_file()) {
        return Err(std::io::Error::other("this is no regular file and is left alone"));
    }
    let mut part = path.as_os_str().to_owned();
    part.push(format!(".{}.part", std::process::id()));
    // A file of that name was left by a dead process of this number.
    let _ = std::fs::remove_file(&part);
    let written = File::create_new(&part).and_then(write).and_then(|()| std::fs::rename(&part, path));
    if written.is_err() {
        let _ = std::fs::remove_file(&part);
    }
    written
}

fn write(file: File, stage: &Stage) -> std::io::Result<()> {
    let mut file = BufWriter::new(file);
    let (vertices, faces) = (stage.positions.len(), stage.triangles.len());
    write!(
        file,
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty int value\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )?;
    for (i, position) in stage.positions.iter().enumerate() {
        let value = stage.values.get(i).copied().unwrap_or(0);
        position.as_vec3().to_array().iter().try_for_each(|x| file.write_all(&x.to_le_bytes()))?;
        file.write_all(&colour(value))?;
        file.write_all(&value.to_le_bytes())?;
    }
    for triangle in &stage.triangles {
        file.write_all(&[3])?;
        triangle.iter().try_for_each(|v| file.write_all(&v.to_le_bytes()))?;
    }
    file.flush()
}

/// A colour that tells a value from its neighbours. Grey for 0.
fn colour(value: i32) -> [u8; 3] {
    if value == 0 {
        return [160; 3];
    }
    let mixed = (value as u32).wrapping_mul(0x9E37_79B9);
    [24, 16, 8].map(|shift| 64 + ((mixed >> shift) as u8 >> 1) + ((mixed >> shift) as u8 >> 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_surface_is_written_as_ply_has_it() {
        let folder = std::env::temp_dir().join(format!("surfrecon-dump-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [first, second] = [0, 1].map(|_| next(&folder, "patches"));
        assert!(first.ends_with("patches.ply") && second.ends_with("patches.1.ply"));
        let stage = Stage {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(0.0, 2.5, 0.0)],
            values: vec![0, 7, -1],
            triangles: vec![[0, 1, 2]],
        };
        whole(&first, |file| write(file, &stage)).unwrap();
        let bytes = std::fs::read(&first).unwrap();
        let header = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let body = &bytes[header..];
        assert_eq!(body.len(), 3 * (3 * 4 + 3 + 4) + 1 + 3 * 4);
        assert_eq!(body[19 + 12 + 3..19 + 12 + 7], 7_i32.to_le_bytes());
        assert_eq!(body[38 + 4..38 + 8], 2.5_f32.to_le_bytes());
        assert_eq!(body[57..62], [3, 0, 0, 0, 0]);
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_full_disk_leaves_what_was_there_and_nothing_else() {
        let folder = std::env::temp_dir().join(format!("surfrecon-dump-full-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("labels.ply");
        for before in [None, Some("before")] {
            before.iter().for_each(|text| std::fs::write(&path, text).unwrap());
            let full = |mut file: File| {
                file.write_all(b"ply\nformat")?;
                Err(std::io::ErrorKind::StorageFull.into())
            };
            assert_eq!(whole(&path, full).unwrap_err().kind(), std::io::ErrorKind::StorageFull);
            assert_eq!(std::fs::read_to_string(&path).ok().as_deref(), before);
            assert_eq!(std::fs::read_dir(&folder).unwrap().count(), usize::from(before.is_some()));
        }
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
