//! The parameters of a merge.

use base::params::{flag, length, ratio};
use image::triangulate::TriangulateParams;

base::params! {
    /// How registered scans are merged into one surface. Lengths are in the unit of the scans.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MergeParams of "merge" with threads {
        /// Size of a cell of the grid. Smaller keeps more detail and costs time and memory with its inverse square.
        voxel: Option<f64> = length("Voxel")
            .from_data("1.5 times the mean distance of neighbouring samples, or more if noise, the distance between overlapping scans or little memory ask for it").above(0.0),
        /// Surfaces of different scans closer than this, facing the same way, become one. At least a voxel. Choose it above the residual of
        /// the registration and below the thinnest wall.
        merge_distance: Option<f64> = length("Merge distance")
            .from_data("from the voxel and the measured distance between overlapping scans"),
        /// Holes whose boundary is at most this long are closed.
        max_hole_length: Option<f64> = length("Max hole length")
            .from_data("100 voxels, but at most a fifth of the diagonal of the connected part the hole is in")
            .off("all are left open"),
        /// Connected parts with fewer triangles than this share of the largest part's are dropped. Parts that no scan saw, between layers
        /// of badly placed scans or out of their noise, are dropped in any case.
        min_component_share: f64 = ratio("Smallest part (share)").default(0.0).at_most(1.0).off("all are kept that scans are evidence of"),
        /// Colours of scans that overlap are made equally bright before they are averaged: exposure and white balance differ from scan to
        /// scan. By up to a factor of eight: what differs more is of different things.
        match_exposure: bool = flag("Match exposure").on().off("colours are averaged as they are").since("0.2"),
        /// How range images are triangulated.
        triangulation: TriangulateParams,
    }
}
