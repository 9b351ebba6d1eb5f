//! Delaunay triangulation of points that lie in one plane of space.
//!
//! | step | file |
//! |---|---|
//! | along which axis the plane is seen, exactly | `view` |
//! | triangulation of what is seen there, by the crate `spade` | `insert` |
//! | edges turned until circles are empty in the plane itself | `flip` |
//! | the inside of a polygon alone | `polygon` |
//! | the inside of several loops of a coordinate plane | `region` |
//!
//! Seen along an axis the plane is sheared, so a triangulation that is Delaunay there is not Delaunay in the plane. But the same points
//! turn counter-clockwise, without any rounding. Turning the plane into an axis' would round, and tear apart points on a line or a circle.

mod flip;
mod insert;
mod polygon;
mod region;
#[cfg(test)]
mod tests;
mod triangulation;
mod view;

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use view::View;

pub use polygon::polygon;
pub use region::region;
pub use triangulation::Delaunay2;

impl Delaunay2 {
    /// Triangulates `points`, which are all different and lie in the plane of those at the three places `corners`
    /// ([`crate::span::of`]), on the calling thread. Fastest if neighbours in the list are neighbours in the plane.
    ///
    /// Cost: O(n log n) in practice, 200 bytes per point.
    ///
    /// # Errors
    /// [`base::error::Error::Input`] for coordinates that differ so much in size that no product of them can be had in doubles.
    /// [`base::error::Error::Cancelled`].
    pub fn new(points: &[DVec3], corners: [usize; 3], progress: &Progress<'_>) -> Result<Self> {
        let view = View::of(points, corners)?;
        let mut made = insert::triangulate(points, &view, progress)?;
        if view.is_sheared {
            flip::make_delaunay(&mut made, points, &view, progress)?;
        }
        if view.is_from_behind {
            made.turn_over();
        }
        Ok(made)
    }
}
