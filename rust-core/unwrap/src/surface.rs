//! The input in a unit box and single precision, which the crate that flattens it reads.

use glam::DVec3;

use base::error::{Error, Result};
use base::magnitude;
use mesh::TriMesh;
use mesh::measure;

/// Most triangles that are unwrapped.
pub const MOST: usize = 50_000_000;

/// The triangles in the unit box.
pub struct Surface {
    /// Vertices, the longest side of their box being 1.
    pub positions: Vec<DVec3>,
    /// Three vertices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Length of 1 in the unit of the mesh.
    pub unit: f64,
}

impl Surface {
    /// Moves the mesh into the unit box.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh without triangles, with too many, of no size, or that is not valid.
    pub fn new(mesh: &TriMesh) -> Result<Self> {
        mesh.validate()?;
        magnitude::points("vertex", &mesh.positions)?;
        if mesh.triangles.is_empty() {
            return Err(Error::input("the mesh has no triangles, but unwrapping needs some"));
        }
        if mesh.triangles.len() > MOST {
            let count = mesh.triangles.len();
            return Err(Error::input(format!("{count} triangles are more than can be unwrapped: {MOST} at most")));
        }
        let used: Vec<DVec3> = mesh.triangles.iter().flatten().map(|&v| mesh.positions[v as usize]).collect();
        let (lo, hi) = measure::bounds(&used).unwrap_or_default();
        let unit = (hi - lo).max_element();
        if !(unit > 0.0) {
            return Err(Error::input("all triangles of the mesh lie at one point, but unwrapping needs a surface"));
        }
        // Vertices that no triangle uses may lie anywhere.
        let within = |p: &DVec3| ((*p - lo) / unit).clamp(DVec3::ZERO, DVec3::ONE);
        let positions: Vec<DVec3> = mesh.positions.iter().map(within).collect();
        Ok(Surface { positions, triangles: mesh.triangles.clone(), unit })
    }

    /// A triangle in the unit box.
    #[inline]
    pub fn corners(&self, t: usize) -> [DVec3; 3] {
        self.triangles[t].map(|v| self.positions[v as usize])
    }
}
