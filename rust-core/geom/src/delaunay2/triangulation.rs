//! The triangles of a plane, and their neighbours.

/// Opposite to a corner: nothing.
pub(super) const OUTSIDE: u32 = u32::MAX;

/// The Delaunay triangulation of points in one plane: no point is inside of the circle around any triangle. It fills their
/// convex hull, every point is a vertex, and no triangle is without area.
///
/// If more than three points lie on a circle, the order of the points decides.
///
/// Source: \[Law77\] for turning edges. The sign for circles is our own, see `flip`.
#[derive(Clone, Debug, Default)]
pub struct Delaunay2 {
    pub(super) triangles: Vec<[u32; 3]>,
    /// Opposite to each corner.
    pub(super) neighbours: Vec<[u32; 3]>,
}

impl Delaunay2 {
    /// All triangles, which are kept alone. They turn counter-clockwise seen from above. In a vertical plane they do seen from large y, in
    /// one along y seen from large x.
    pub fn into_triangles(self) -> Vec<[u32; 3]> {
        self.triangles
    }

    pub(super) fn turn_over(&mut self) {
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        self.neighbours.iter_mut().for_each(|neighbours| neighbours.swap(1, 2));
    }
}
