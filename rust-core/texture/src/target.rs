//! The mesh to texture: its coordinates checked.

use glam::DVec2;

use base::error::{Error, Result};
use mesh::{TriMesh, images};

/// A mesh with texture coordinates, one per vertex: those of UDIM tiles, v up.
#[derive(Clone, Copy, Debug)]
pub struct TextureTarget<'a> {
    /// The mesh. Its vertices are split at seams.
    pub mesh: &'a TriMesh,
    /// Texture coordinates, one per vertex.
    pub uv: &'a [DVec2],
}

impl TextureTarget<'_> {
    /// Number of tiles: one more than the highest that a triangle lies in.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh that is not valid, for coordinates that are missing, not finite or in no tile, and for a
    /// triangle in several tiles.
    pub fn tiles(&self) -> Result<u32> {
        self.mesh.validate()?;
        let (count, vertices) = (self.uv.len(), self.mesh.positions.len());
        if count != vertices {
            return Err(Error::input(format!(
                "{count} texture coordinates for {vertices} vertices: give one per vertex"
            )));
        }
        let mut tiles = 1;
        for t in 0..self.mesh.triangles.len() {
            let tile = images::tile_of(t, self.triangle(t))?;
            tiles = tiles.max(tile + 1);
        }
        Ok(tiles)
    }

    /// Tile of a triangle.
    pub fn tile(&self, t: usize) -> u32 {
        images::tile(self.triangle(t))
    }

    /// A triangle in the plane.
    pub fn triangle(&self, t: usize) -> [DVec2; 3] {
        self.mesh.triangles[t].map(|v| self.uv[v as usize])
    }
}
