//! Normals of triangles and of vertices.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::{TriMesh, measure};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Normals of the vertices, weighted by angles. Vertices at the same place have the same, so that seams do not show.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn smooth(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Vec<DVec3>> {
    let mut at_place: FxHashMap<[u64; 3], DVec3> = FxHashMap::default();
    let key = |p: DVec3| (p + 0.0).to_array().map(f64::to_bits);
    let mut pace = Pace::new(progress);
    for t in 0..mesh.triangles.len() {
        pace.after(16)?;
        let corners = mesh.corners(t);
        let normal = of_triangle(corners);
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
pub fn of_triangle([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seams_do_not_show_and_angles_weigh() {
        // A corner of a cube: three squares, one of them cut into two triangles there. Its seam splits the corner.
        let positions = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1]];
        let positions = positions.map(|p| glam::IVec3::from(p).as_dvec3()).to_vec();
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 2, 3], [4, 3, 5], [4, 5, 1]]);
        let normals = smooth(&mesh, &Progress::none()).unwrap();
        assert!(normals[0].distance(DVec3::ONE.normalize()) < 1e-12, "{}", normals[0]);
        assert_eq!(normals[0], normals[4]);
        // A vertex without a triangle has none.
        assert_eq!((normals[2], normals[6]), (DVec3::Z, DVec3::ZERO));
    }
}
