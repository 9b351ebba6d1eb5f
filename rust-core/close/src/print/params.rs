//! The parameters of the checks for printing.

use base::params::{angle, choice, length, ratio};

use crate::params::UpAxis;

/// Walls are measured up to this share of the diagonal of the mesh's box. Noise turns the faces of a thick round body: then larger balls
/// take time that grows with the square of the number of faces.
const LIMIT: f64 = 0.1;

base::params! {
    /// How a mesh is checked before it is printed. Lengths are in its unit.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PrintParams of "check_print" with threads {
        /// Thinnest wall that the printer makes: 0.8 mm for most.
        min_wall: Option<f64> = length("Min wall").from_data("none, walls are measured only").above(0.0).since("0.2"),
        /// Walls are measured up to this thickness, and at least up to the thinnest wall that the printer makes. Thicker ones count as so
        /// thick.
        max_wall: Option<f64> = length("Max wall").from_data("a tenth of the diagonal of the mesh's box").above(0.0).since("0.2"),
        /// Faces that look down and lean from the vertical by more than this need supports.
        overhang: f64 = angle("Overhang").default(std::f64::consts::FRAC_PI_4).at_most(std::f64::consts::FRAC_PI_2).since("0.2"),
        /// Direction away from the plate that is printed on.
        print_up: UpAxis = choice("Up of the print", UpAxis::CHOICES).since("0.2"),
        /// Width of the space that the printer fills.
        printer_width: Option<f64> = length("Printer width").from_data("any").above(0.0).since("0.2"),
        /// Depth of the space that the printer fills. The print may also be turned by a quarter.
        printer_depth: Option<f64> = length("Printer depth").from_data("any").above(0.0).since("0.2"),
        /// Height of the space that the printer fills.
        printer_height: Option<f64> = length("Printer height").from_data("any").above(0.0).since("0.2"),
        /// Weight of a unit of volume: 0.00124 for PLA, in grams and millimetres.
        density: Option<f64> = ratio("Density").from_data("none, no weight is computed").above(0.0).since("0.2"),
    }
}

impl PrintParams {
    /// Thickness up to which the walls are measured of a mesh whose box has that diagonal.
    pub(super) fn wall_limit(&self, diagonal: f64) -> f64 {
        self.max_wall.unwrap_or(LIMIT * diagonal).max(self.min_wall.unwrap_or(0.0))
    }

    /// Lengths of the printer that a box of that size exceeds, as it is and turned by a quarter about the vertical.
    pub(super) fn too_short(&self, size: [f64; 3]) -> Vec<TooShort> {
        let [x, y, z] = size;
        let [a, b, tall] = match self.print_up {
            UpAxis::Z | UpAxis::MinusZ => [x, y, z],
            UpAxis::Y | UpAxis::MinusY => [x, z, y],
            UpAxis::X | UpAxis::MinusX => [y, z, x],
        };
        let base = match (self.printer_width, self.printer_depth) {
            (Some(width), Some(depth)) => {
                let fits = a <= width && b <= depth || b <= width && a <= depth;
                (!fits).then_some(TooShort::Base { width, depth })
            }
            (Some(width), None) => (a.min(b) > width).then_some(TooShort::Width(width)),
            (None, Some(depth)) => (a.min(b) > depth).then_some(TooShort::Depth(depth)),
            (None, None) => None,
        };
        let height = self.printer_height.filter(|height| tall > *height).map(TooShort::Height);
        base.into_iter().chain(height).collect()
    }
}

/// Lengths of a printer that are too short for a mesh.
pub(super) enum TooShort {
    Base { width: f64, depth: f64 },
    Width(f64),
    Depth(f64),
    Height(f64),
}
