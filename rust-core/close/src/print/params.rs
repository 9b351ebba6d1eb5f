//! The parameters of the checks for printing.

use base::params::{angle, choice, length, ratio};

use crate::params::UpAxis;

base::params! {
    /// How a mesh is checked before it is printed. Lengths are in its unit.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PrintParams of "check_print" with threads {
        /// Weight of a unit of volume: 0.00124 for PLA, in grams and millimetres.
        density: Option<f64> = ratio("Density").from_data("none, no weight is computed").above(0.0).since("0.2"),
        /// Thinnest wall that the printer makes: 0.8 mm for most.
        min_wall: Option<f64> = length("Min wall").from_data("none, walls are measured only").above(0.0).since("0.2"),
        /// Faces that look down and lean from the vertical by more than this need supports.
        overhang: f64 = angle("Overhang").default(std::f64::consts::FRAC_PI_4).at_most(std::f64::consts::FRAC_PI_2).since("0.2"),
        /// Direction away from the ground.
        up: UpAxis = choice("Up", UpAxis::CHOICES).since("0.2"),
    }
}
