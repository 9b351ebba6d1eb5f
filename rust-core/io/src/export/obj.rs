//! Wavefront OBJ: polygons in text, read by everything.

use std::io::{BufWriter, Write};
use std::path::Path;

use glam::DVec3;

use super::Provenance;
use super::atomic::{Staged, stage};
use super::provenance::comments;
use base::error::{Error, Result};
use base::progress::Progress;
use mesh::{AttributeData, Crs, TriMesh, texture};

/// Elements that are written between two looks at the progress.
const CHUNK: usize = 1 << 14;

/// Content of [`write_obj_polygons`]: any of the lists of faces may be empty.
#[derive(Clone, Copy, Debug)]
pub struct Polygons<'a> {
    /// Coordinates of the vertices.
    pub positions: &'a [DVec3],
    /// Colours of the vertices, sRGB.
    pub colour: Option<&'a [[u8; 4]]>,
    /// Faces of four vertices, counter-clockwise seen from outside.
    pub quads: &'a [[u32; 4]],
    /// Faces of three.
    pub triangles: &'a [[u32; 3]],
    /// Provenance that the file tells, as comments.
    pub provenance: Option<&'a Provenance>,
    /// The system that the coordinates are in, likewise.
    pub crs: Option<&'a Crs>,
}

/// Writes a mesh. Of its attributes `colour`, as three more numbers per vertex, which most programs read, and texture coordinates
/// ([`texture`]), one per vertex. Its coordinate reference system is a comment.
///
/// # Errors
/// As [`write_obj_polygons`].
pub fn write_obj(path: &Path, mesh: &TriMesh, provenance: Option<&Provenance>, progress: &Progress<'_>) -> Result<()> {
    mesh.validate()?;
    let colour = match mesh.vertex_attribute("colour") {
        Some(AttributeData::Colour(colours)) => Some(colours.as_slice()),
        _ => None,
    };
    let (positions, triangles, crs) = (&mesh.positions, &mesh.triangles, mesh.crs.as_ref());
    let polygons = Polygons { positions, colour, quads: &[], triangles, provenance, crs };
    let texture = texture::coordinates(mesh);
    for (name, along) in [texture::S, texture::T].into_iter().zip(texture.into_iter().flatten()) {
        if let Some(v) = along.iter().position(|x| !x.is_finite()) {
            return Err(Error::input(format!("attribute {name} of vertex {v} is {}, but must be finite", along[v])));
        }
    }
    write(path, &polygons, &Besides { texture, ..Besides::default() }, progress)
}

/// Writes polygons: vertices with the fewest digits that read back as the same number, then quads, then triangles.
/// Without any, the file is an object without a vertex.
///
/// # Errors
/// A coordinate that isn't finite, an index out of range, colours of another number than vertices. [`Error::Io`]. [`Error::Cancelled`].
/// Then no file is left, and one that was there is untouched.
pub fn write_obj_polygons(path: &Path, polygons: &Polygons<'_>, progress: &Progress<'_>) -> Result<()> {
    write(path, polygons, &Besides::default(), progress)
}

/// Content beside [`Polygons`]. Any of it may be missing.
#[derive(Default)]
pub(super) struct Besides<'a> {
    /// Texture coordinates of the vertices.
    pub texture: Option<[&'a [f32]; 2]>,
    /// Normals of the vertices.
    pub normals: Option<&'a [DVec3]>,
    /// Name of the file with the materials.
    pub library: Option<&'a str>,
    /// Names of the materials with their triangles: all that there are. Without a material triangles come in their order.
    pub materials: &'a [(String, Vec<usize>)],
}

fn write(path: &Path, polygons: &Polygons<'_>, besides: &Besides<'_>, progress: &Progress<'_>) -> Result<()> {
    progress.plan(&[("writing", 1.0)]);
    progress.stage(0, elements(polygons));
    staged(path, polygons, besides, progress)?.keep()
}

/// Number of elements that [`staged`] counts.
pub(super) fn elements(polygons: &Polygons<'_>) -> u64 {
    (polygons.positions.len() + polygons.quads.len() + polygons.triangles.len()) as u64
}

/// As [`write_obj_polygons`], up to the file's name.
pub(super) fn staged(
    path: &Path,
    polygons: &Polygons<'_>,
    besides: &Besides<'_>,
    progress: &Progress<'_>,
) -> Result<Staged> {
    let count = polygons.positions.len();
    if let Some(v) = polygons.positions.iter().position(|p| !p.is_finite()) {
        return Err(Error::input(format!("vertex {v} has a coordinate that is not finite: {}", polygons.positions[v])));
    }
    if let Some(colours) = polygons.colour.filter(|colours| colours.len() != count) {
        return Err(Error::input(format!("{count} vertices need {count} colours, got {}", colours.len())));
    }
    let corners = polygons.quads.as_flattened().iter().chain(polygons.triangles.as_flattened());
    if let Some(v) = corners.copied().find(|&v| v as usize >= count) {
        return Err(Error::input(format!("a face names vertex {v}, but there are only {count} vertices")));
    }
    let said = comments("#", polygons.provenance, polygons.crs)?;
    stage(path, progress, |file| {
        let mut out = BufWriter::with_capacity(1 << 18, file);
        let io = |e| Error::io(path, e);
        out.write_all(said.as_bytes()).map_err(io)?;
        if let Some(library) = besides.library {
            writeln!(out, "mtllib {library}").map_err(io)?;
        }
        if polygons.positions.is_empty() {
            // A file without any statement would look like one that was cut off.
            out.write_all(b"o empty\n").map_err(io)?;
        }
        for (k, positions) in polygons.positions.chunks(CHUNK).enumerate() {
            for (i, p) in positions.iter().enumerate() {
                write!(out, "v {} {} {}", p.x, p.y, p.z).map_err(io)?;
                if let Some(colours) = polygons.colour {
                    let [r, g, b, _] = colours[k * CHUNK + i].map(|c| f64::from(c) / 255.0);
                    write!(out, " {r:.4} {g:.4} {b:.4}").map_err(io)?;
                }
                out.write_all(b"\n").map_err(io)?;
            }
            progress.advance(positions.len() as u64)?;
        }
        let [s, t] = besides.texture.unwrap_or_default();
        for (s, t) in s.chunks(CHUNK).zip(t.chunks(CHUNK)) {
            for (s, t) in s.iter().zip(t) {
                writeln!(out, "vt {s} {t}").map_err(io)?;
            }
            progress.check()?;
        }
        for normals in besides.normals.unwrap_or_default().chunks(CHUNK) {
            for n in normals {
                writeln!(out, "vn {:.5} {:.5} {:.5}", n.x, n.y, n.z).map_err(io)?;
            }
            progress.check()?;
        }
        // Text after each vertex' number, before that number anew.
        let again: &[&str] = match (besides.texture.is_some(), besides.normals.is_some()) {
            (false, false) => &[],
            (true, false) => &["/"],
            (false, true) => &["//"],
            (true, true) => &["/", "/"],
        };
        let mut faces = Faces { out, path, again, progress };
        faces.write(polygons.quads.iter())?;
        if besides.materials.is_empty() {
            faces.write(polygons.triangles.iter())?;
        }
        for (name, triangles) in besides.materials {
            writeln!(faces.out, "usemtl {name}").map_err(io)?;
            faces.write(triangles.iter().map(|&t| &polygons.triangles[t]))?;
        }
        faces.out.flush().map_err(io)
    })
}

/// Writes faces. Their corners name the coordinates and normals of their vertices.
struct Faces<'a, 'p, W> {
    out: W,
    path: &'a Path,
    again: &'a [&'a str],
    progress: &'a Progress<'p>,
}

impl<W: Write> Faces<'_, '_, W> {
    fn write<'f, const N: usize>(&mut self, mut faces: impl ExactSizeIterator<Item = &'f [u32; N]>) -> Result<()> {
        while faces.len() > 0 {
            let count = faces.len().min(CHUNK);
            faces.by_ref().take(count).try_for_each(|face| self.put(face)).map_err(|e| Error::io(self.path, e))?;
            self.progress.advance(count as u64)?;
        }
        Ok(())
    }

    fn put(&mut self, face: &[u32]) -> std::io::Result<()> {
        self.out.write_all(b"f")?;
        for vertex in face.iter().map(|&v| u64::from(v) + 1) {
            write!(self.out, " {vertex}")?;
            for before in self.again {
                write!(self.out, "{before}{vertex}")?;
            }
        }
        self.out.write_all(b"\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::{self, Content};
    use mesh::Attribute;

    #[test]
    fn written_read_written_is_the_same() {
        let folder = tempfile::tempdir().unwrap();
        let [first, second] = ["a.obj", "b.obj"].map(|name| folder.path().join(name));
        let positions =
            vec![DVec3::new(4e6 + 0.125, -0.0, 1e-300), DVec3::X, DVec3::Y, DVec3::new(0.1, 1.0 / 3.0, 1e300)];
        let mut mesh = TriMesh::new(positions, vec![[0, 1, 2], [3, 2, 1]]);
        mesh.vertex_attributes.push(Attribute::colour("colour", (0..4).map(|i| [i * 85, 1, 254, 255]).collect()));
        write_obj(&first, &mesh, None, &Progress::none()).unwrap();
        let Content::Mesh(read) = import::open(&first).unwrap().scans[0].read().unwrap() else { panic!("no mesh") };
        assert_eq!(read, mesh);
        write_obj(&second, &read, None, &Progress::none()).unwrap();
        assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());
    }

    #[test]
    fn texture_coordinates_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let mut mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z], vec![[0, 2, 1]]);
        mesh.vertex_attributes.push(Attribute::f32(texture::S, vec![0.0, 1.0, 0.1, 3.0]));
        mesh.vertex_attributes.push(Attribute::f32(texture::T, vec![1.0 / 3.0, f32::MIN_POSITIVE, 1.0, 2.5]));
        write_obj(&path, &mesh, None, &Progress::none()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("\nvt 0.1 1\nvt 3 2.5\nf 1/1 3/3 2/2\n"), "{text}");
        let Content::Mesh(read) = import::open(&path).unwrap().scans[0].read().unwrap() else { panic!("no mesh") };
        assert_eq!(read, mesh);
        mesh.vertex_attributes[1] = Attribute::f32(texture::T, vec![0.0, 0.0, f32::NAN, 0.0]);
        let error = write_obj(&path, &mesh, None, &Progress::none()).unwrap_err().to_string();
        assert_eq!(error, "attribute t of vertex 2 is NaN, but must be finite");
    }

    #[test]
    fn quads_stay_quads_and_errors_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let polygons = Polygons {
            positions: &positions,
            colour: None,
            quads: &[[0, 1, 2, 3]],
            triangles: &[[0, 1, 2]],
            provenance: None,
            crs: None,
        };
        write_obj_polygons(&path, &polygons, &Progress::none()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf 1 2 3\n");
        let bad = Polygons { quads: &[[0, 1, 2, 4]], ..polygons };
        let error = write_obj_polygons(&path, &bad, &Progress::none()).unwrap_err().to_string();
        assert_eq!(error, "a face names vertex 4, but there are only 4 vertices");
        let bad = Polygons { positions: &[DVec3::NAN], quads: &[], triangles: &[], ..polygons };
        assert!(write_obj_polygons(&path, &bad, &Progress::none()).is_err());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
}
