//! Texture coordinates of the vertices of a mesh: two attributes, which have the names of PLY files.

use crate::{AttributeData, TriMesh};

/// Attribute of vertices: the coordinate to the right.
pub const S: &str = "s";
/// Attribute of vertices: the coordinate upwards.
pub const T: &str = "t";

/// The coordinates of the vertices of a mesh, to the right and upwards. The image of a tile fills a unit square, with its first row at
/// the top. `None` unless both attributes are there, as floats.
pub fn coordinates(mesh: &TriMesh) -> Option<[&[f32]; 2]> {
    match (mesh.vertex_attribute(S)?, mesh.vertex_attribute(T)?) {
        (AttributeData::F32(s), AttributeData::F32(t)) => Some([s, t]),
        _ => None,
    }
}

/// Whether an attribute of vertices is one of the coordinates.
pub fn has_name(name: &str) -> bool {
    name == S || name == T
}
