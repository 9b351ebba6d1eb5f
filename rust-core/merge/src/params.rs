//! The parameters of a merge.

use base::error::{Error, Result};
use base::params::{choice, flag, length, ratio};
use close::{Openings, UpAxis};
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
        /// Holes whose boundary is at most this long are closed, if holes alone are closed.
        max_hole_length: Option<f64> = length("Max hole length")
            .from_data("100 voxels, but at most a fifth of the diagonal of the connected part the hole is in")
            .off("all are left open"),
        /// Connected parts with fewer triangles than this share of the largest part's are dropped. Parts that no scan saw, between layers
        /// of badly placed scans or out of their noise, are dropped in any case.
        min_component_share: f64 = ratio("Smallest part (share)").default(0.0).at_most(1.0).off("all are kept that scans are evidence of"),
        /// Colours of scans that overlap are made equally bright before they are averaged: exposure and white balance differ from scan to
        /// scan. By up to a factor of eight: what differs more is of different things.
        match_exposure: bool = flag("Match exposure").on().off("colours are averaged as they are").since("0.2"),
        /// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a cell. All and
        /// those inside the scans are closed by a smooth fill, with the whole surface in memory.
        close: Openings = choice("Close", Openings::CHOICES).default(2.0).since("0.2"),
        /// Nothing is filled below the lowest measured point, so that what stood on the ground gets a flat foot instead of a round one.
        /// It is for more than holes.
        flat_base: bool = flag("Flat base").off("parts that nobody saw from below continue as their sides bend").since("0.2"),
        /// Direction away from the ground, where there is a flat base.
        base_up: UpAxis = choice("Up of the base", UpAxis::CHOICES).since("0.2"),
        /// How range images are triangulated.
        triangulation: TriangulateParams,
    }
}

impl MergeParams {
    /// Refuses options that have no use with the others.
    ///
    /// # Errors
    /// [`Error::Input`] says which option to give, too.
    pub fn go_together(&self) -> Result<()> {
        let problem = if self.flat_base && !matches!(self.close, Openings::All | Openings::Seen) {
            "flat_base is given, but has no use unless more than holes is closed: give close = all or seen, too"
        } else if self.base_up != UpAxis::Z && !self.flat_base {
            "base_up is given without flat_base, but has no use then: give flat_base, too"
        } else {
            return Ok(());
        };
        Err(Error::input(problem))
    }
}
