//! Meshes that are handed over piece by piece, straight into their places: of binary rows all have the same size, so that each has its
//! place in the file before any is there.

use std::io::{Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::path::Path;

use glam::DVec3;

use super::columns::{column_data, element, faces, is_double, position_column};
use super::layout::{Layout, Rows, cant_write};
use super::options::{PlyEncoding, PlyOptions};
use super::parts::Whole;
use super::rows::{CHUNK, Column, Element};
use crate::export::atomic::{Output, Staged, stage_back_and_forth};
use base::error::{Error, Result, known_as};
use base::progress::Progress;
use mesh::sink::{MeshOutline, MeshSink};
use mesh::{Attribute, AttributeData, Extent};

/// Writes a mesh that `make` hands over piece by piece, as it comes: the bytes are those of [`super::write_ply`] for the same mesh.
/// Returns what `make` returns.
///
/// Cost: memory for a quarter of a megabyte beside the pieces. The room for all is taken from the disk before the first piece is, where the
/// system can do that. A mesh in parts ([`PlyOptions::part_triangles`]) takes the room of the surface twice, and 12 bytes for each triangle
/// of a part.
///
/// # Errors
/// [`PlyEncoding::Ascii`], whose rows have no places of their own. The pieces are not those of the outline. Else as [`super::write_ply`],
/// and those of `make`. Then no file is left, and one that was there is untouched.
pub fn write_ply_in_pieces<R: Send>(
    path: &Path,
    options: impl Into<PlyOptions>,
    make: impl FnOnce(&mut dyn MeshSink) -> Result<R> + Send,
    progress: &Progress<'_>,
) -> Result<R> {
    let options = options.into();
    if options.encoding == PlyEncoding::Ascii {
        let path = known_as(path);
        return Err(Error::input(format!("{path}: what is written piece by piece must be binary, not text")));
    }
    let mut made = None;
    let mut parts = Vec::new();
    // The maker of the mesh has a progress, and is watched by it.
    let whole = stage_back_and_forth(path, &Progress::none(), |file| {
        let mut pieces = Pieces { file, path, options: &options, begun: None };
        made = Some(make(&mut pieces)?);
        pieces.check_whole()?;
        let Pieces { begun: Some(Begun { outline, layout, .. }), file, .. } = pieces else { return Ok(()) };
        if options.is_split(outline.triangles) {
            let mut whole = Whole { file, path, options: &options, outline: &outline, layout: &layout };
            parts = whole.split(progress)?;
        }
        Ok(())
    })?;
    if parts.is_empty() {
        whole.keep()?;
    }
    // The one with the mesh's own name last: where it is all are.
    parts.into_iter().rev().try_for_each(Staged::keep)?;
    Ok(made.expect("it was made, or there is an error"))
}

struct Pieces<'a, 'f> {
    file: &'a mut Output<'f>,
    path: &'a Path,
    options: &'a PlyOptions,
    begun: Option<Begun>,
}

/// A file whose header is written.
struct Begun {
    outline: MeshOutline,
    layout: Layout,
    /// Numbers of vertices and triangles that were handed over.
    written: [u64; 2],
    /// Of the vertices so far.
    extent: Extent,
}

fn wrong(problem: &str) -> Error {
    Error::input(format!("a mesh in pieces: {problem}"))
}

impl Pieces<'_, '_> {
    fn begun(&mut self) -> Result<&mut Begun> {
        self.begun.as_mut().ok_or_else(|| wrong("its outline must come first"))
    }

    fn check_whole(&mut self) -> Result<()> {
        let Begun { outline, written, extent, .. } = self.begun()?;
        if *written != [outline.vertices, outline.triangles] {
            let [vertices, triangles] = written;
            return Err(wrong(&format!(
                "its outline says {} vertices and {} triangles, but {vertices} and {triangles} were handed over",
                outline.vertices, outline.triangles
            )));
        }
        if *extent != outline.extent {
            return Err(wrong("its vertices must lie where its outline says"));
        }
        Ok(())
    }

    /// Writes rows of an element from its row `first` on.
    fn write(&mut self, element: &Element<'_>, rows: Rows, first: u64) -> Result<()> {
        let begin = rows.begin + rows.size * first;
        let whole = self.begun()?.layout.faces.end();
        let failed = |error| cant_write(self.path, whole, error);
        self.file.seek(SeekFrom::Start(begin)).map_err(failed)?;
        let each = (CHUNK / element.row_size().max(1)).max(1);
        let mut buffer = Vec::new();
        for first in (0..element.count).step_by(each) {
            let rows: Range<usize> = first..(first + each).min(element.count);
            buffer.clear();
            element.encode(rows, self.options.encoding, &mut buffer);
            self.file.write_all(&buffer).map_err(failed)?;
        }
        Ok(())
    }
}

/// Checks a piece of some rows and takes it into account.
fn take(
    rows: Rows,
    written: &mut u64,
    what: &str,
    (first, count): (u64, usize),
    own: &[Attribute],
    given: &[AttributeData],
) -> Result<()> {
    let count = count as u64;
    if first.checked_add(count).is_none_or(|end| end > rows.count) {
        return Err(wrong(&format!("there are only {} {what}, and no {count} from {first} on", rows.count)));
    }
    let same_kind = |(own, given): (&Attribute, &AttributeData)| {
        std::mem::discriminant(&own.data) == std::mem::discriminant(given) && given.len() as u64 == count
    };
    if own.len() != given.len() || !own.iter().zip(given).all(same_kind) {
        return Err(wrong(&format!("the attributes of its {what} must be those of its outline")));
    }
    *written += count;
    Ok(())
}

/// An element with columns of attributes.
fn with_attributes<'a>(mut element: Element<'a>, attributes: &'a [AttributeData]) -> Element<'a> {
    let column = |data| Column { declaration: String::new(), data: column_data(data) };
    element.columns.extend(attributes.iter().map(column));
    element
}

impl MeshSink for Pieces<'_, '_> {
    fn begin(&mut self, outline: &MeshOutline) -> Result<()> {
        if u32::try_from(outline.vertices).is_err() {
            return Err(Error::input(format!(
                "{}: {} vertices are more than PLY files have numbers for, in parts as well: make the surface coarser",
                known_as(self.path),
                outline.vertices
            )));
        }
        let is_double = is_double(&outline.extent, self.options.positions)?;
        let layout = if self.options.is_split(outline.triangles) {
            // Nobody will read its header, which may hold no such numbers.
            let none = MeshOutline { vertices: 0, triangles: 0, ..outline.clone() };
            Layout::of(&none, self.options, is_double)?.of_so_many(outline.vertices, outline.triangles)
        } else {
            Layout::of(outline, self.options, is_double)?
        };
        let failed = |error| cant_write(self.path, layout.faces.end(), error);
        self.file.reserve(layout.faces.end()).map_err(failed)?;
        self.file.write_all(layout.header.as_bytes()).map_err(failed)?;
        self.begun = Some(Begun { outline: outline.clone(), layout, written: [0; 2], extent: Extent::default() });
        Ok(())
    }

    fn vertices(&mut self, first: u64, positions: &[DVec3], attributes: &[AttributeData]) -> Result<()> {
        let begun = self.begun()?;
        let (rows, own) = (begun.layout.vertices, &begun.outline.vertex_attributes);
        take(rows, &mut begun.written[0], "vertices", (first, positions.len()), own, attributes)?;
        for (v, position) in (first..).zip(positions) {
            if !position.is_finite() {
                return Err(Error::input(format!("vertex {v} has a coordinate that is not finite: {position}")));
            }
            begun.extent.add(*position);
        }
        let mut vertices = element("vertex", positions.len());
        vertices.columns.push(position_column(positions, begun.layout.is_double));
        self.write(&with_attributes(vertices, attributes), rows, first)
    }

    fn triangles(&mut self, first: u64, triangles: &[[u64; 3]], attributes: &[AttributeData]) -> Result<()> {
        let begun = self.begun()?;
        let (rows, own) = (begun.layout.faces, &begun.outline.face_attributes);
        take(rows, &mut begun.written[1], "triangles", (first, triangles.len()), own, attributes)?;
        let count = begun.outline.vertices;
        for (t, triangle) in (first..).zip(triangles) {
            if let Some(v) = triangle.iter().find(|&&v| v >= count) {
                return Err(Error::input(format!(
                    "triangle {t} names vertex {v}, but there are only {count} vertices"
                )));
            }
        }
        // No more than there are vertices, of which there are not more than files have numbers for.
        let corners: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(|v| v as u32)).collect();
        self.write(&with_attributes(faces(&corners, corners.len()), attributes), rows, first)
    }
}

#[cfg(test)]
mod tests;
