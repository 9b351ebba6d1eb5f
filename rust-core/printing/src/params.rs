//! The parameters of preparing a print.

use base::error::{Error, Result, Shown};
use base::params::{choice, count, flag, length};
use close::UpAxis;

/// Fewest cells in the thickness of a wall. With them no face of a cavity reaches the surface.
pub const LEAST_CELLS: f64 = 3.0;

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
        /// Length of the side of the result: 0.1 for a print of 10 cm, if the unit is a metre. All sides are scaled alike.
        scale_to: Option<f64> = length("Scale to").from_data("the size stays").above(0.0).at_most(1e30).since("0.2"),
        /// The side that gets this length.
        scale_side: ScaleSide = choice("Scaled side", ScaleSide::CHOICES).since("0.2"),
        /// Stands the mesh on a flat face: the part below the height of the base is cut off.
        flat_base: bool = flag("Flat base").off("nothing is cut off").since("0.2"),
        /// Height of the base above the lowest point.
        base_height: Option<f64> = length("Height of the base").from_data("0 if the mesh stands on a face, else at most a 50th of its height").above(0.0).since("0.2"),
        /// Thinnest wall that the printer makes. Thinner ones are made as thick, where there is room.
        min_wall: Option<f64> = length("Min wall").from_data("no wall is moved").above(0.0).since("0.2"),
        /// Thickness of the walls around a cavity. Larger ones make smaller cavities.
        hollow: Option<f64> = length("Hollow").from_data("nothing is hollowed out").above(0.0).since("0.2"),
        /// Size of the cells in which the cavity is made, at most a third of the walls. Smaller ones take more memory and time.
        hollow_cell: Option<f64> = length("Cell of the cavity").from_data("a 256th of the longest side, but from a quarter to a third of the walls").above(0.0).since("0.2"),
        /// Diameter of a hole that leads from the base into the cavity, so that resin or powder runs out. It needs a base and a cavity.
        drain: Option<f64> = length("Drain").from_data("the cavity stays shut").above(0.0).since("0.2"),
        /// Sides of the hole, which is a prism.
        drain_sides: u32 = count("Sides of the drain").default(32.0).at_least(3.0).at_most(1024.0).since("0.2"),
        /// Size across up of the space that the printer fills: along x, or along y if up is along x. Larger meshes are cut into parts.
        printer_width: Option<f64> = length("Printer width").from_data("any").above(0.0).since("0.2"),
        /// Size across up of the space that the printer fills: along y, or along z if up is not along z.
        printer_depth: Option<f64> = length("Printer depth").from_data("any").above(0.0).since("0.2"),
        /// Size along up of the space that the printer fills.
        printer_height: Option<f64> = length("Printer height").from_data("any").above(0.0).since("0.2"),
        /// Direction away from the plate that is printed on.
        print_up: UpAxis = choice("Up of the print", UpAxis::CHOICES).since("0.2"),
    }
}

impl PrepareParams {
    /// Refuses parameters that have no use without others: a drain leads from a base into a cavity, and cells are smaller than walls.
    ///
    /// # Errors
    /// [`Error::Input`] says which parameter to give, too.
    pub(super) fn go_together(&self) -> Result<()> {
        if self.scale_side != ScaleSide::Longest && self.scale_to.is_none() {
            return Err(Error::input("scale_side is given without scale_to, but has no use then: give scale_to, too"));
        }
        if self.drain_sides != Self::default().drain_sides && self.drain.is_none() {
            return Err(Error::input("drain_sides is given without drain, but has no use then: give drain, too"));
        }
        if self.base_height.is_some() && !self.flat_base {
            return Err(Error::input(
                "base_height is given without flat_base, but has no use then: give flat_base, too",
            ));
        }
        if self.drain.is_some() && (!self.flat_base || self.hollow.is_none()) {
            let missing = if self.hollow.is_none() { "hollow" } else { "flat_base" };
            return Err(Error::input(format!(
                "drain is given without {missing}, but leads from a flat base into a cavity: give {missing}, too"
            )));
        }
        match (self.hollow, self.hollow_cell) {
            (None, Some(_)) => {
                Err(Error::input("hollow_cell is given without hollow, but has no use then: give hollow, too"))
            }
            (Some(wall), Some(cell)) if !(cell <= wall / LEAST_CELLS) => Err(Error::input(format!(
                "hollow_cell is {}, but must be at most a third of hollow, which is {}",
                Shown(cell),
                Shown(wall)
            ))),
            _ => Ok(()),
        }
    }

    /// Whether a size of the printer is given.
    pub(super) const fn has_printer(&self) -> bool {
        self.printer_width.is_some() || self.printer_depth.is_some() || self.printer_height.is_some()
    }
}
