//! The parameters of sculpting.

use base::error::Result;
use base::params::{angle, count, flag, length, ratio};
use image::triangulate::TriangulateParams;

base::alternatives! {
    /// How far the mesh may lie from the samples, along their rays.
    pub enum Tolerance of "sculpt" {
        /// Largest distance between a sample and the mesh along the sample's ray. Larger values give fewer triangles.
        Absolute(f64) = tolerance: length("Tolerance")
            .from_data("the relative tolerance times the depth extent of the covered samples")
            .off("every sample is reproduced"),
        /// The tolerance as a share of the depth extent, the difference between the farthest and the nearest range of the covered samples.
        /// Used where no tolerance is given.
        OfDepthExtent(f64) = relative_tolerance: ratio("Relative tolerance").default(0.001),
    }
}

impl Tolerance {
    /// In world units.
    ///
    /// # Errors
    /// [`base::Error::Parameter`] if negative or not finite.
    pub(super) fn in_world(self, depth_extent: f64) -> Result<f64> {
        self.validate()?;
        Ok(match self {
            Tolerance::Absolute(tolerance) => tolerance,
            // A sum of two finite numbers may be too large; no distance is larger than this.
            Tolerance::OfDepthExtent(share) => (share * depth_extent).min(f64::MAX),
        })
    }
}

base::params! {
    /// How a range image is sculpted to few triangles.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SculptParams of "sculpt" with threads {
        /// How far the mesh may lie from the samples.
        tolerance: Tolerance,
        /// Work spent on fewer triangles at the same tolerance: 0 digs only, 1 also removes vertices, for about twice the time, 2 searches
        /// for fewer yet, for about ten times the time.
        effort: u32 = count("Effort").default(1.0).at_most(2.0),
        /// Every vertex is a sample.
        interpolate: bool = flag("Interpolate").on()
            .off("vertices may leave their samples along the ray within the tolerance, for about a sixth fewer triangles than effort 2 and a little more time. With effort 0, which moves nothing, it has no effect"),
        /// Smallest angle, as seen from the sensor, of triangles made to replace others. Those of the digging keep theirs. 10 degrees cost
        /// up to 12 % more triangles.
        min_angle: f64 = angle("Min angle").at_most(std::f64::consts::FRAC_PI_6),
        /// Smooths open borders, too, for fewer triangles: the mesh reaches at most half a pixel beyond them, covers all that it did, and
        /// no other pixel. Needs an effort of at least 1.
        simplify_borders: bool = flag("Simplify borders")
            .off("borders stay as they are in the image but for vertices on straight lines"),
        /// The surface that the mesh may cover: jumps are left out.
        triangulation: TriangulateParams,
    }
}
