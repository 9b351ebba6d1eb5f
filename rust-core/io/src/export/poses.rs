//! Lists that place files: VRIP's `.conf`, MeshLab's projects and alignments, TUM's trajectories.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use glam::{DAffine3, DMat4, DQuat};

use super::atomic::stage;
use super::conf::{PlacedFile, check_placed, write_conf};
use base::error::{Error, Result, known_as};
use base::progress::Progress;

/// Writes the poses of files, by the ending of the name: `.conf`, `.mlp`, `.aln`, or `.tum`, which has no names. That has a line per file,
/// in the order of the times if all names are times, else numbered from 0.
///
/// # Errors
/// Another ending. A name that the format can't hold. A pose that isn't rigid. [`Error::Io`]. No file is left then.
pub fn write_poses(path: &Path, placed: &[PlacedFile]) -> Result<()> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let text = match ending.as_deref() {
        Some("conf") => return write_conf(path, placed),
        Some("mlp") => project,
        Some("aln") => alignment,
        Some("tum") => trajectory,
        _ => {
            let endings = ".conf (VRIP), .mlp or .aln (MeshLab) or .tum (TUM)";
            return Err(Error::input(format!("{}: the name of a list of poses must end in {endings}", known_as(path))));
        }
    };
    placed.iter().try_for_each(check_placed)?;
    let text = text(placed);
    stage(path, &Progress::none(), |file| file.write_all(text.as_bytes()).map_err(|e| Error::io(path, e)))?.keep()
}

/// Rows of a pose, a line each.
fn rows(pose: &DAffine3) -> String {
    let rows = DMat4::from(*pose).transpose().to_cols_array_2d();
    rows.iter().fold(String::new(), |mut text, [x, y, z, w]| {
        // Nothing can fail: it is written to memory.
        let _ = writeln!(text, "{x} {y} {z} {w}");
        text
    })
}

fn project(placed: &[PlacedFile]) -> String {
    let mut text = "<!DOCTYPE MeshLabDocument>\n<MeshLabProject>\n <MeshGroup>\n".to_owned();
    for PlacedFile { file, world_from_file } in placed {
        let name = escaped(file);
        let label = name.rsplit('/').next().unwrap_or(&name);
        let _ = write!(
            text,
            "  <MLMesh label=\"{label}\" filename=\"{name}\">\n   <MLMatrix44>\n{}</MLMatrix44>\n  </MLMesh>\n",
            rows(world_from_file)
        );
    }
    text + " </MeshGroup>\n</MeshLabProject>\n"
}

fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn alignment(placed: &[PlacedFile]) -> String {
    let mut text = format!("{}\n", placed.len());
    for PlacedFile { file, world_from_file } in placed {
        let _ = write!(text, "{file}\n#\n{}", rows(world_from_file));
    }
    text + "0\n"
}

fn trajectory(placed: &[PlacedFile]) -> String {
    let mut text = "# timestamp tx ty tz qx qy qz qw\n".to_owned();
    for (time, pose) in times(placed) {
        let (t, q) = (pose.translation, DQuat::from_mat3(&pose.matrix3).normalize());
        let _ = writeln!(text, "{time} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    text
}

/// The poses in the order of the times that names are, as these are written. Numbered where a name is none, or two are the same.
fn times(placed: &[PlacedFile]) -> Vec<(String, DAffine3)> {
    let number = |PlacedFile { file, world_from_file }: &PlacedFile| {
        let name = file.rsplit('/').next().unwrap_or(file);
        let stem = [name, name.rsplit_once('.').map_or(name, |(stem, _)| stem)];
        let time = |text: &&str| text.parse::<f64>().is_ok_and(f64::is_finite);
        let text = stem.into_iter().find(time)?;
        Some((text.parse::<f64>().ok()?, text.to_owned(), *world_from_file))
    };
    let mut timed: Vec<(f64, String, DAffine3)> = placed.iter().map_while(number).collect();
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    if timed.len() == placed.len() && timed.windows(2).all(|two| two[0].0 < two[1].0) {
        return timed.into_iter().map(|(_, text, pose)| (text, pose)).collect();
    }
    placed.iter().enumerate().map(|(number, file)| (number.to_string(), file.world_from_file)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import;
    use glam::DVec3;

    #[test]
    fn what_is_written_opens_with_the_same_poses() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["a.ply", "b & c.ply"];
        let poses = [
            DAffine3::from_rotation_translation(
                DQuat::from_axis_angle(DVec3::ONE.normalize(), 1.2),
                DVec3::new(0.1, -2.0, 1e4),
            ),
            DAffine3::from_rotation_translation(DQuat::from_rotation_z(3.0), DVec3::ZERO),
        ];
        for name in names {
            let text = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n";
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let placed: Vec<PlacedFile> = names
            .iter()
            .zip(poses)
            .map(|(name, world_from_file)| PlacedFile { file: (*name).to_owned(), world_from_file })
            .collect();
        for list in ["set.mlp", "set.aln"] {
            let path = folder.path().join(list);
            write_poses(&path, &placed).unwrap();
            let set = import::open(&path).unwrap();
            assert_eq!(set.scans.len(), 2, "{list}");
            for (scan, pose) in set.scans.iter().zip(poses) {
                assert!(scan.world_from_sensor.abs_diff_eq(pose, 1e-12), "{list}: {:?}", scan.world_from_sensor);
            }
        }
        let text = trajectory(&placed);
        let begins: Vec<&str> = text.lines().map(|line| line.split(' ').next().unwrap()).collect();
        assert_eq!(begins, ["#", "0", "1"]);
        // Names that are times, as the depth images of a recording have: in their order, digit by digit.
        let timed = |name: &str, at: usize| PlacedFile { file: name.to_owned(), world_from_file: poses[at] };
        let text = trajectory(&[timed("depth/1305031453.404816.png", 0), timed("1305031453.374112", 1)]);
        let begins: Vec<&str> = text.lines().map(|line| line.split(' ').next().unwrap()).collect();
        assert_eq!(begins, ["#", "1305031453.374112", "1305031453.404816"]);
        let refused = write_poses(&folder.path().join("set.txt"), &placed).unwrap_err().to_string();
        assert!(refused.contains(".conf") && !folder.path().join("set.txt").exists(), "{refused}");
        let scaled = PlacedFile { file: "a.ply".to_owned(), world_from_file: DAffine3::from_scale(DVec3::splat(2.0)) };
        assert!(write_poses(&folder.path().join("scaled.aln"), &[scaled]).is_err());
        assert!(!folder.path().join("scaled.aln").exists());
    }
}
