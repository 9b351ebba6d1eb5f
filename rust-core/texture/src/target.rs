//! The mesh to texture: its coordinates checked, its normals.

use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;

use base::error::{Error, Result};
use base::progress::{Pace, Progress};
use mesh::TriMesh;
use mesh::measure;

/// Tiles in a row.
pub const ROW: u32 = 10;

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
            let tile = self.tile(t);
            let low = DVec2::new(f64::from(tile % ROW), f64::from(tile / ROW));
            let is_inside = |at: DVec2| (at - low).cmpge(DVec2::ZERO).all() && (at - low).cmple(DVec2::ONE).all();
            if !self.triangle(t).into_iter().all(is_inside) {
                return Err(Error::input(format!(
                    "the texture coordinates of triangle {t} lie in no one tile. Each triangle must lie in one unit \
                        square of 10 x 10, u and v from 0 to 10."
                )));
            }
            tiles = tiles.max(tile + 1);
        }
        Ok(tiles)
    }

    /// Tile of a triangle.
    pub fn tile(&self, t: usize) -> u32 {
        let [a, b, c] = self.triangle(t);
        let middle = ((a + b + c) / 3.0).clamp(DVec2::ZERO, DVec2::splat(9.5));
        middle.y as u32 * ROW + middle.x as u32
    }

    /// A triangle in the plane.
    pub fn triangle(&self, t: usize) -> [DVec2; 3] {
        self.mesh.triangles[t].map(|v| self.uv[v as usize])
    }
}

/// Normals of the vertices, weighted by angles. Vertices at the same place have the same, so that seams do not show.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn normals(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Vec<DVec3>> {
    let mut at_place: FxHashMap<[u64; 3], DVec3> = FxHashMap::default();
    let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
    let mut pace = Pace::new(progress);
    for t in 0..mesh.triangles.len() {
        pace.after(16)?;
        let corners = mesh.corners(t);
        let normal = face_normal(corners);
        for (corner, angle) in corners.into_iter().zip(measure::angles(corners)) {
            *at_place.entry(key(corner)).or_default() += normal * if angle.is_finite() { angle } else { 0.0 };
        }
    }
    let of = |p: &DVec3| at_place.get(&key(*p)).copied().unwrap_or_default().normalize_or_zero();
    let mut normals = Vec::with_capacity(mesh.positions.len());
    for block in progress.blocks(&mesh.positions) {
        normals.extend(block?.iter().map(of));
    }
    Ok(normals)
}

/// Normal of a triangle. Zero for one without area.
pub fn face_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}
