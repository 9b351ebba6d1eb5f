//! The parameters of preparing a print.

use base::params::{choice, length};
use close::UpAxis;

base::choices! {
    /// Sides that a size is given for.
    pub enum ScaleSide {
        /// The longest of the sides along x, y and z.
        Longest = "longest" "Longest side",
        /// The side along up.
        Height = "height" "Height",
    }
}

base::params! {
    /// How a closed mesh is made ready for printing. Each step is left out unless its parameter is given. Lengths are in the unit of the
    /// result: if the mesh is scaled, in that of the scaled one. Meshes of scans are in metres.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PrepareParams of "prepare_print" with threads {
        /// Length of the side after scaling: 0.1 for a print of 10 cm, if the unit is a metre. All sides are scaled alike.
        scale_to: Option<f64> = length("Scale to").from_data("the size stays").above(0.0).since("0.2"),
        /// The side that gets this length.
        scale_side: ScaleSide = choice("Scaled side", ScaleSide::CHOICES).since("0.2"),
        /// Height above the lowest point at which the mesh is cut off, so that it stands on a flat face. 0 cuts nothing off.
        flat_base: Option<f64> = length("Flat base").from_data("nothing is cut off").since("0.2"),
        /// Direction away from the plate that is printed on.
        print_up: UpAxis = choice("Up of the print", UpAxis::CHOICES).since("0.2"),
    }
}
