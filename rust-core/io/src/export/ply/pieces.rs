//! Meshes that are handed over piece by piece, straight into their places: of binary rows all have the same size, so that each has its
//! place in the file before any is there.

use std::io::{ErrorKind, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::path::Path;

use glam::DVec3;

use super::rows::{CHUNK, Column, Element};
use super::{PlyEncoding, PlyOptions, attributes, column_data, element, faces, header, is_double, position_column};
use crate::export::atomic::{Output, write_atomically_back_and_forth};
use base::error::{Error, Result, known_as};
use base::memory::size;
use base::progress::Progress;
use mesh::sink::{MeshOutline, MeshSink};
use mesh::{Attribute, AttributeData, Extent};

/// Writes a mesh that `make` hands over piece by piece, as it comes: the bytes are those of [`super::write_ply`] for the same mesh.
/// Returns what `make` returns.
///
/// Cost: memory for a quarter of a megabyte beside the pieces. The room for all is taken from the disk before the first piece is, where
/// the system can do that.
///
/// # Errors
/// [`PlyEncoding::Ascii`], whose rows have no places of their own; the pieces are not those of the outline; else as
/// [`super::write_ply`], and those of `make`. Then no file is left, and one that was there is untouched.
pub fn write_ply_in_pieces<R: Send>(
    path: &Path,
    options: impl Into<PlyOptions>,
    make: impl FnOnce(&mut dyn MeshSink) -> Result<R> + Send,
) -> Result<R> {
    let options = options.into();
    if options.encoding == PlyEncoding::Ascii {
        let path = known_as(path);
        return Err(Error::input(format!("{path}: what is written piece by piece must be binary, not text")));
    }
    let mut made = None;
    // Who makes the mesh has a progress, and is watched by it.
    write_atomically_back_and_forth(path, &Progress::none(), |file| {
        let mut pieces = Pieces { file, path, options: &options, begun: None };
        made = Some(make(&mut pieces)?);
        pieces.check_whole()
    })?;
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
    double: bool,
    vertices: Rows,
    faces: Rows,
    /// Of the vertices so far.
    extent: Extent,
}

/// Where the rows of an element are.
#[derive(Clone, Copy)]
struct Rows {
    begin: u64,
    size: u64,
    count: u64,
    /// How many were handed over.
    written: u64,
}

impl Rows {
    fn end(&self) -> u64 {
        self.begin + self.size * self.count
    }
}

fn wrong(what: &str) -> Error {
    Error::input(format!("a mesh in pieces: {what}"))
}

impl Pieces<'_, '_> {
    fn begun(&mut self) -> Result<&mut Begun> {
        self.begun.as_mut().ok_or_else(|| wrong("its outline must come first"))
    }

    fn check_whole(&mut self) -> Result<()> {
        let Begun { outline, vertices, faces, extent, .. } = self.begun()?;
        if vertices.written != vertices.count || faces.written != faces.count {
            return Err(wrong(&format!(
                "{} vertices and {} triangles were handed over, of {} and {}",
                vertices.written, faces.written, vertices.count, faces.count
            )));
        }
        if *extent != outline.extent {
            return Err(wrong("its vertices lie elsewhere than its outline says"));
        }
        Ok(())
    }

    /// Writes rows of an element from its row `first` on.
    fn write(&mut self, element: &Element<'_>, rows: Rows, first: u64) -> Result<()> {
        let begin = rows.begin + rows.size * first;
        let whole = self.begun()?.faces.end();
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
    rows: &mut Rows,
    what: &str,
    first: u64,
    count: usize,
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
        return Err(wrong(&format!("the attributes of its {what} are not those of its outline")));
    }
    rows.written += count;
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
        let double = is_double(&outline.extent, self.options.positions)?;
        let many = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
        let mut vertices = element("vertex", many(outline.vertices));
        vertices.columns.push(position_column(&[], double));
        attributes(&mut vertices, &outline.vertex_attributes)?;
        let mut faces = faces(&[], many(outline.triangles));
        attributes(&mut faces, &outline.face_attributes)?;
        let elements = [vertices, faces];
        let header = header("", &elements, self.options, outline.crs.as_ref())?;
        let rows = |begin, element: &Element<'_>| Rows {
            begin,
            size: element.row_size() as u64,
            count: element.count as u64,
            written: 0,
        };
        let vertices = rows(header.len() as u64, &elements[0]);
        let faces = rows(vertices.end(), &elements[1]);
        let failed = |error| cant_write(self.path, faces.end(), error);
        self.file.reserve(faces.end()).map_err(failed)?;
        self.file.write_all(header.as_bytes()).map_err(failed)?;
        self.begun = Some(Begun { outline: outline.clone(), double, vertices, faces, extent: Extent::default() });
        Ok(())
    }

    fn vertices(&mut self, first: u64, positions: &[DVec3], attributes: &[AttributeData]) -> Result<()> {
        let begun = self.begun()?;
        let own = &begun.outline.vertex_attributes;
        take(&mut begun.vertices, "vertices", first, positions.len(), own, attributes)?;
        for (v, position) in (first..).zip(positions) {
            if !position.is_finite() {
                return Err(Error::input(format!("vertex {v} has a coordinate that is not finite: {position}")));
            }
            begun.extent.add(*position);
        }
        let rows = begun.vertices;
        let mut vertices = element("vertex", positions.len());
        vertices.columns.push(position_column(positions, begun.double));
        self.write(&with_attributes(vertices, attributes), rows, first)
    }

    fn triangles(&mut self, first: u64, triangles: &[[u32; 3]], attributes: &[AttributeData]) -> Result<()> {
        let begun = self.begun()?;
        take(&mut begun.faces, "triangles", first, triangles.len(), &begun.outline.face_attributes, attributes)?;
        let count = begun.vertices.count;
        for (t, triangle) in (first..).zip(triangles) {
            if let Some(v) = triangle.iter().find(|&&v| u64::from(v) >= count) {
                return Err(Error::input(format!(
                    "triangle {t} names vertex {v}, but there are only {count} vertices"
                )));
            }
        }
        let rows = begun.faces;
        self.write(&with_attributes(faces(triangles, triangles.len()), attributes), rows, first)
    }
}

/// What a write that failed is told as: where a disk is full with the bytes of the whole file.
fn cant_write(path: &Path, bytes: u64, error: std::io::Error) -> Error {
    if error.kind() != ErrorKind::StorageFull {
        return Error::io(path, error);
    }
    let text =
        format!("the disk has no room for the {} of this file: free some, or choose another", size(bytes as f64));
    Error::io(path, std::io::Error::new(ErrorKind::StorageFull, text))
}

#[cfg(test)]
mod tests;
