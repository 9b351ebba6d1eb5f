//! The surface that stages 1 to 5 find, and its order.

use base::error::Result;
use base::progress::Progress;

/// The surface that was found.
pub struct Found {
    pub triangles: Vec<[u32; 3]>,
    /// Of each sample, whether the surface is around it.
    pub enclosed: Vec<bool>,
    /// Whether triangles look where they should without normals or sensors.
    pub is_outward: bool,
}

/// Each triangle from its lowest vertex, and all in order: the same for any numbers of the cells.
pub fn canonical(triangles: &mut [[u32; 3]], progress: &Progress<'_>) -> Result<()> {
    for range in progress.ranges(triangles.len()) {
        for triangle in &mut triangles[range?] {
            let lowest = (0..3).min_by_key(|&i| triangle[i]).expect("three vertices");
            triangle.rotate_left(lowest);
        }
    }
    progress.sort(triangles, &Ord::cmp)
}
