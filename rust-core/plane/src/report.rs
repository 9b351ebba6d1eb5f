//! The plane that was found, and its figures.

use image::select::Plane;

/// The plane that most samples lie on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DominantPlane {
    /// Above is the side that its samples were seen from. If that is not known, it is the side on which most of the others lie. Its margin
    /// takes in the scatter of its samples: removing what the plane holds removes the table or the ground.
    pub plane: Plane,
    /// The share of the samples that lie on it.
    pub share: f64,
    /// Scatter of these about it: the root mean square of their heights, in the unit of the scans.
    pub spread: f64,
}
