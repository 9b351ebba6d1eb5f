//! The mesh to texture: its coordinates checked.

use glam::DVec2;

use base::error::{Error, Result};
use mesh::{TriMesh, images, texture};

/// A mesh with texture coordinates, one per vertex: those of UDIM tiles, v up.
pub struct TextureTarget<'a> {
    /// The mesh. Its vertices are split at seams.
    pub mesh: &'a TriMesh,
    /// Texture coordinates, one per vertex.
    pub uv: Vec<DVec2>,
}

impl<'a> TextureTarget<'a> {
    /// A mesh with the coordinates of its attributes.
    ///
    /// # Errors
    /// [`Error::Input`] for a mesh that is not valid, or has no texture coordinates.
    pub fn new(mesh: &'a TriMesh) -> Result<Self> {
        mesh.validate()?;
        let Some([s, t]) = texture::coordinates(mesh) else {
            return Err(Error::input("the mesh has no texture coordinates, but texturing needs some: unwrap it first"));
        };
        let uv = s.iter().zip(t).map(|(&s, &t)| DVec2::new(s.into(), t.into())).collect();
        Ok(TextureTarget { mesh, uv })
    }

    /// Number of tiles: one more than the highest that a triangle lies in.
    ///
    /// # Errors
    /// [`Error::Input`] for coordinates that are not finite or in no tile, and for a triangle in several tiles.
    pub fn tiles(&self) -> Result<u32> {
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
