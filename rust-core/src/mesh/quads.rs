//! Meshes of quads.

use glam::DVec3;

use super::{Attribute, TriMesh};

/// A mesh of quads; they turn counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QuadMesh {
    /// Coordinates of the vertices.
    pub positions: Vec<DVec3>,
    /// Texture coordinates, one a vertex, or none at all.
    pub uvs: Vec<[f32; 2]>,
    /// Four vertices a quad.
    pub quads: Vec<[u32; 4]>,
    /// One entry a vertex each.
    pub vertex_attributes: Vec<Attribute>,
    /// One entry a quad each.
    pub face_attributes: Vec<Attribute>,
}

impl QuadMesh {
    /// The quad mesh as triangles: quad q is cut from its second corner to its fourth if `is_odd(q)`, else from its first to
    /// its third. Triangles keep the quad's direction and take its attributes.
    pub fn triangulated(&self, is_odd: impl Fn(usize) -> bool) -> TriMesh {
        let triangles = self
            .quads
            .iter()
            .enumerate()
            .flat_map(|(q, &[a, b, c, d])| if is_odd(q) { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] });
        let twice: Vec<usize> = (0..2 * self.quads.len()).map(|t| t / 2).collect();
        TriMesh {
            positions: self.positions.clone(),
            triangles: triangles.collect(),
            vertex_attributes: self.vertex_attributes.clone(),
            face_attributes: self.face_attributes.iter().map(|a| a.gather(&twice)).collect(),
        }
    }
}
