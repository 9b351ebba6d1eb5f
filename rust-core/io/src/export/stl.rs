//! Binary STL: triangles for printing and machining.

use std::io::{BufWriter, Write};
use std::path::Path;

use glam::DVec3;

use super::atomic::write_atomically;
use base::error::{Error, Result};
use base::progress::Progress;
use mesh::TriMesh;

/// Triangles that are written between two looks at the progress.
const CHUNK: usize = 1 << 13;
/// Coordinates farther from the origin than this many times the mesh's size would keep less than 2^-20 of it.
const FAR: f64 = 8.0;

/// Writes the triangles with their normals, in single precision. Attributes have no place in the format.
///
/// # Errors
/// The mesh isn't valid ([`TriMesh::validate`]), lies so far from the origin that single precision would lose its detail, or has more than
/// 2^32 - 1 triangles. [`Error::Io`]. [`Error::Cancelled`]. Then no file is left, and one that was there is untouched.
pub fn write_stl(path: &Path, mesh: &TriMesh, progress: &Progress<'_>) -> Result<()> {
    mesh.validate()?;
    let Ok(count) = u32::try_from(mesh.triangles.len()) else {
        return Err(Error::input("more than 2^32 - 1 triangles are more than an STL file holds"));
    };
    let low = mesh.positions.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
    let high = mesh.positions.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
    let largest = if mesh.positions.is_empty() { 0.0 } else { low.abs().max(high.abs()).max_element() };
    let single = |p: &DVec3| p.as_vec3().as_dvec3() == *p;
    if largest > FAR * (high - low).max_element() && !mesh.positions.iter().all(single) || largest > f64::from(f32::MAX)
    {
        return Err(Error::input(format!(
            "the mesh lies {largest:e} from the origin, where STL's single precision would lose its detail: move it closer or write PLY"
        )));
    }
    progress.plan(&[("writing", 1.0)]);
    progress.stage(0, count.into());
    write_atomically(path, progress, |file| {
        let io = |e| Error::io(path, e);
        let mut out = BufWriter::with_capacity(1 << 18, file);
        // Not "solid": that would make it look like text.
        let mut header = [0; 84];
        header[..18].copy_from_slice(b"binary STL, mesh  ");
        header[80..].copy_from_slice(&count.to_le_bytes());
        out.write_all(&header).map_err(io)?;
        for (k, triangles) in mesh.triangles.chunks(CHUNK).enumerate() {
            for t in 0..triangles.len() {
                let [a, b, c] = mesh.corners(k * CHUNK + t);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let mut record = [0; 50];
                let numbers = [normal, a, b, c].map(|v| v.as_vec3().to_array());
                for (bytes, number) in record.chunks_exact_mut(4).zip(numbers.as_flattened()) {
                    bytes.copy_from_slice(&number.to_le_bytes());
                }
                out.write_all(&record).map_err(io)?;
            }
            progress.advance(triangles.len() as u64)?;
        }
        out.flush().map_err(io)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{self, Content};

    #[test]
    fn written_read_written_is_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second] = ["a.stl", "b.stl"].map(|name| folder.path().join(name));
        let positions = vec![DVec3::ZERO, DVec3::new(0.1, 0.0, 0.0), DVec3::Y, DVec3::Z];
        let mesh = TriMesh::new(positions, vec![[0, 2, 1], [0, 1, 3], [1, 1, 2]]);
        write_stl(&first, &mesh, &Progress::none()).unwrap();
        assert_eq!(std::fs::metadata(&first).unwrap().len(), 84 + 3 * 50);
        let Content::Mesh(read) = import::open(&first).unwrap().scans[0].read().unwrap() else { panic!("no mesh") };
        assert_eq!((read.positions.len(), read.triangles[0]), (4, [0, 1, 2]));
        write_stl(&second, &read, &Progress::none()).unwrap();
        assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());
    }

    #[test]
    fn what_single_precision_would_lose_is_refused() {
        let far = |x: f64| {
            TriMesh::new(vec![DVec3::splat(x), DVec3::new(x + 0.1, x, x), DVec3::new(x, x + 0.1, x)], vec![[0, 1, 2]])
        };
        let path = std::env::temp_dir().join("never.stl");
        let error = write_stl(&path, &far(4e6), &Progress::none()).unwrap_err().to_string();
        assert!(error.starts_with("the mesh lies 4.0000001e6 from the origin"), "{error}");
        assert!(write_stl(&path, &far(1e300), &Progress::none()).is_err() && !path.exists());
    }
}
