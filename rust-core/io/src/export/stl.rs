//! Binary STL: triangles for printing and machining.

use std::io::{BufWriter, Write};
use std::path::Path;

use glam::DVec3;

use super::atomic::write_atomically;
use crate::unit::{self, STL_TEXT};
use base::error::{Error, Result};
use base::progress::Progress;
use mesh::TriMesh;

/// Triangles that are written between two looks at the progress.
const CHUNK: usize = 1 << 13;
/// Coordinates farther from the origin than this many times the mesh's size would keep less than 2^-20 of it.
const FAR: f64 = 8.0;

/// Writes the triangles with their normals, in single precision. Attributes have no place in the format.
///
/// Coordinates stay in the mesh's unit. The header says it, as `UNITS=mm` for example, unless it is the metre. So a file that says no unit is
/// read as it was written. `import` reads the others in metres. The format itself has no unit: most programs take it for millimetres, and
/// pass the header over.
///
/// # Errors
/// `metres_per_unit` is not from 1e-30 to 1e30. The mesh isn't valid ([`TriMesh::validate`]), lies so far from the origin that single precision would lose its detail, or has more than
/// 2^32 - 1 triangles. [`Error::Io`]. [`Error::Cancelled`]. Then no file is left, and one that was there is untouched.
pub fn write_stl(path: &Path, mesh: &TriMesh, metres_per_unit: f64, progress: &Progress<'_>) -> Result<()> {
    mesh.validate()?;
    unit::check(metres_per_unit, "STL")?;
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
        let mut header = [0; STL_TEXT + 4];
        header[..STL_TEXT].copy_from_slice(&unit::stl_header(metres_per_unit));
        header[STL_TEXT..].copy_from_slice(&count.to_le_bytes());
        out.write_all(&header).map_err(io)?;
        for (k, triangles) in mesh.triangles.chunks(CHUNK).enumerate() {
            for t in 0..triangles.len() {
                // The normal is that of the corners as the file has them: of a sliver it is another than the mesh's.
                let [a, b, c] = mesh.corners(k * CHUNK + t).map(|corner| corner.as_vec3().as_dvec3());
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
    use super::super::three_mf::size_tests::{coloured, sheet};
    use super::*;
    use crate::import::{self, Content};

    #[test]
    fn written_read_written_is_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second] = ["a.stl", "b.stl"].map(|name| folder.path().join(name));
        let positions = vec![DVec3::ZERO, DVec3::new(0.1, 0.0, 0.0), DVec3::Y, DVec3::Z];
        let mesh = TriMesh::new(positions, vec![[0, 2, 1], [0, 1, 3], [1, 1, 2]]);
        write_stl(&first, &mesh, 1.0, &Progress::none()).unwrap();
        assert_eq!(std::fs::metadata(&first).unwrap().len(), 84 + 3 * 50);
        let Content::Mesh(read) = import::open(&first).unwrap().scans[0].read().unwrap() else { panic!("no mesh") };
        assert_eq!((read.positions.len(), read.triangles[0]), (4, [0, 1, 2]));
        write_stl(&second, &read, 1.0, &Progress::none()).unwrap();
        assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());
    }

    fn read(path: &Path) -> (TriMesh, Vec<String>) {
        let set = import::open(path).unwrap();
        let Content::Mesh(mesh) = set.scans[0].read().unwrap() else { panic!("no mesh") };
        (mesh, set.notes)
    }

    /// Theorem: a unit changes the header alone, and what is read is in metres.
    #[test]
    fn units_are_said_and_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        let positions = vec![DVec3::ZERO, DVec3::new(-0.125, 0.0, 0.0), DVec3::Y * 3.0, DVec3::Z];
        let mesh = TriMesh::new(positions, vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]);
        write_stl(&path, &mesh, 1.0, &Progress::none()).unwrap();
        let plain = std::fs::read(&path).unwrap();
        assert_eq!(plain[..STL_TEXT].trim_ascii_end()[..18], *b"binary STL, mesh  ");
        for (metres, words) in [(1e-3, "millimetres"), (0.0254, "inches"), (0.2, "units of 0.2 m")] {
            write_stl(&path, &mesh, metres, &Progress::none()).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            assert!(bytes[..STL_TEXT] != plain[..STL_TEXT] && bytes[STL_TEXT..] == plain[STL_TEXT..]);
            let (found, notes) = read(&path);
            assert_eq!(notes, [format!("a.stl: its header says {words}: it is read in metres")]);
            let place = |of: &TriMesh, t: usize, k: usize| of.positions[of.triangles[t][k] as usize];
            for (t, k) in (0..12).map(|i| (i / 3, i % 3)) {
                assert_eq!(place(&found, t, k), place(&mesh, t, k) * metres);
            }
            // A header of another form says nothing.
            std::fs::write(&path, [b"made by others, UNITS=mm", &bytes[24..]].concat()).unwrap();
            let (found, notes) = read(&path);
            assert!(notes.is_empty() && place(&found, 0, 2) == place(&mesh, 0, 2));
        }
        write_stl(&path, &mesh, 1.0, &Progress::none()).unwrap();
        assert!(read(&path).1.is_empty());
        let error = write_stl(&path, &mesh, 0.0, &Progress::none()).unwrap_err().to_string();
        assert_eq!(error, "metres_per_unit must be from 1e-30 to 1e30 for STL, got 0e0");
        assert_eq!(std::fs::read(&path).unwrap(), plain);
    }

    /// Theorem: triangles of any number, size and place come back in their order, and corners as single precision has them.
    #[test]
    fn huge_and_tiny_meshes_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        for mesh in [coloured(sheet(709, 200.0)), sheet(5, 1e-9), sheet(5, 1e30), coloured(sheet(2, 1.0))] {
            write_stl(&path, &mesh, 1.0, &Progress::none()).unwrap();
            let (found, _) = read(&path);
            assert!(found.triangles.len() == mesh.triangles.len() && found.vertex_attributes.is_empty());
            for (found_corners, corners) in found.triangles.iter().zip(&mesh.triangles) {
                for (&v, &w) in found_corners.iter().zip(corners) {
                    assert_eq!(found.positions[v as usize].as_vec3(), mesh.positions[w as usize].as_vec3());
                }
            }
        }
    }

    /// Theorem: normals are those of the triangles in the file, also where rounding turned them.
    #[test]
    fn normals_are_those_of_the_rounded_corners() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        // In double precision it faces z. Its third corner is rounded to y = 1, so in the file it faces y.
        let positions = vec![DVec3::new(0.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 1e-9), DVec3::new(0.5, 1.0 + 1e-8, 0.0)];
        let mesh = TriMesh::new(positions, vec![[0, 1, 2]]);
        write_stl(&path, &mesh, 1.0, &Progress::none()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let normal = bytes[84..96].as_chunks().0.iter().map(|number| f32::from_le_bytes(*number));
        assert_eq!(normal.collect::<Vec<_>>(), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn what_single_precision_would_lose_is_refused() {
        let far = |x: f64| {
            TriMesh::new(vec![DVec3::splat(x), DVec3::new(x + 0.1, x, x), DVec3::new(x, x + 0.1, x)], vec![[0, 1, 2]])
        };
        let path = std::env::temp_dir().join("never.stl");
        let error = write_stl(&path, &far(4e6), 1.0, &Progress::none()).unwrap_err().to_string();
        assert!(error.starts_with("the mesh lies 4.0000001e6 from the origin"), "{error}");
        assert!(write_stl(&path, &far(1e300), 1.0, &Progress::none()).is_err() && !path.exists());
    }
}
