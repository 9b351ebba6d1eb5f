//! The settings of the search.

use base::params::{length, ratio};

base::params! {
    /// How the dominant plane is found. Lengths are in the unit of the scans.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PlaneParams of "plane" with threads {
        /// Samples that lie further off do not count for the plane.
        tolerance: Option<f64> = length("Tolerance")
            .from_data("three times the scatter of its samples, at most a hundredth of the extent of the scans").above(0.0),
        /// A plane on which a smaller share of the samples lies is refused.
        min_share: f64 = ratio("Min share").default(0.05).at_most(1.0),
        /// Points that lie at most so far above the plane are removed with it.
        margin: Option<f64> = length("Margin")
            .from_data("four times the scatter of its samples"),
    }
}
