//! Places of the bytes of a binary file of a mesh.

use std::io::ErrorKind;
use std::path::Path;

use super::columns::{attributes, element, faces, header, position_column};
use super::options::PlyOptions;
use super::rows::Element;
use base::error::{Error, Result};
use base::memory::size;
use mesh::sink::MeshOutline;

/// The bytes of a file of a mesh, and their places.
pub struct Layout {
    pub header: String,
    pub is_double: bool,
    pub vertices: Rows,
    pub faces: Rows,
}

/// Places of the rows of an element.
#[derive(Clone, Copy)]
pub struct Rows {
    pub begin: u64,
    pub size: u64,
    pub count: u64,
}

impl Rows {
    /// The beginning of what follows them.
    pub fn end(&self) -> u64 {
        self.begin + self.size * self.count
    }
}

impl Layout {
    pub fn of(outline: &MeshOutline, options: &PlyOptions, is_double: bool) -> Result<Self> {
        let many = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
        let mut vertices = element("vertex", many(outline.vertices));
        vertices.columns.push(position_column(&[], is_double));
        attributes(&mut vertices, &outline.vertex_attributes)?;
        let mut faces = faces(&[], many(outline.triangles));
        attributes(&mut faces, &outline.face_attributes)?;
        let elements = [vertices, faces];
        let header = header("", &elements, options, outline.crs.as_ref())?;
        let rows =
            |begin, element: &Element<'_>| Rows { begin, size: element.row_size() as u64, count: element.count as u64 };
        let vertices = rows(header.len() as u64, &elements[0]);
        let faces = rows(vertices.end(), &elements[1]);
        Ok(Layout { header, is_double, vertices, faces })
    }

    /// The layout of so many more, under the same header.
    pub fn of_so_many(mut self, vertices: u64, faces: u64) -> Self {
        self.vertices.count = vertices;
        self.faces = Rows { begin: self.vertices.end(), count: faces, ..self.faces };
        self
    }
}

/// The error of a write that failed: if a disk is full, with the bytes of the whole file.
pub fn cant_write(path: &Path, bytes: u64, error: std::io::Error) -> Error {
    if error.kind() != ErrorKind::StorageFull {
        return Error::io(path, error);
    }
    let text =
        format!("the disk has no room for the {} of this file: free some, or choose another", size(bytes as f64));
    Error::io(path, std::io::Error::new(ErrorKind::StorageFull, text))
}
