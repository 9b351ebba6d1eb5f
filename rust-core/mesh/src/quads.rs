//! Meshes of quads.

use glam::DVec3;

use super::{Attribute, Crs, TriMesh};
use base::error::{Error, Result};

/// A mesh of quads. They turn counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QuadMesh {
    /// Coordinates of the vertices.
    pub positions: Vec<DVec3>,
    /// Texture coordinates, one per vertex, or none at all.
    pub uvs: Vec<[f32; 2]>,
    /// Four vertices per quad.
    pub quads: Vec<[u32; 4]>,
    /// One entry per vertex each.
    pub vertex_attributes: Vec<Attribute>,
    /// One entry per quad each.
    pub face_attributes: Vec<Attribute>,
    /// The system that the coordinates are in, as of [`TriMesh`].
    pub crs: Option<Crs>,
}

impl QuadMesh {
    /// Checks what other code relies on: finite coordinates, indices in range, lists of the right length.
    ///
    /// # Errors
    /// [`Error::Input`] naming the first element that is wrong.
    pub fn validate(&self) -> Result<()> {
        let count = self.positions.len();
        if let Some(v) = self.positions.iter().position(|p| !p.is_finite()) {
            return Err(Error::input(format!("vertex {v} has a coordinate that is not finite: {}", self.positions[v])));
        }
        let bad = self
            .quads
            .iter()
            .enumerate()
            .find_map(|(q, corners)| corners.iter().find(|&&v| v as usize >= count).map(|v| (q, v)));
        if let Some((q, v)) = bad {
            return Err(Error::input(format!("quad {q} names vertex {v}, but there are only {count} vertices")));
        }
        if !self.uvs.is_empty() && self.uvs.len() != count {
            return Err(Error::input(format!(
                "{} texture coordinates for {count} vertices: give one per vertex",
                self.uvs.len()
            )));
        }
        for (attributes, elements, what) in
            [(&self.vertex_attributes, count, "vertices"), (&self.face_attributes, self.quads.len(), "quads")]
        {
            if let Some(a) = attributes.iter().find(|a| a.data.len() != elements) {
                let (name, length) = (&a.name, a.data.len());
                return Err(Error::input(format!(
                    "attribute {name} has {length} entries for {elements} {what}: give one each"
                )));
            }
        }
        Ok(())
    }

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
            rounding_room: None,
            crs: self.crs.clone(),
        }
    }
}
