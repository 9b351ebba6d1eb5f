//! The parameters of closing.

use glam::DVec3;

use base::error::{Error, Result};
use base::params::{choice, flag, length};

/// Cells of the merge in a cell of the fill.
pub const FILL_CELLS: f64 = 2.0;
/// Cells of a fill between a surface that looks up and its base.
pub const OVER_BASE: f64 = 2.5;

base::choices! {
    /// Openings that are closed.
    pub enum Openings {
        /// Everything that seen space allows: the result is closed.
        All = "all" "All",
        /// Openings that seen space or the surface surrounds: what lies before them is a pocket that nobody saw. A bowl's rim, a relief's
        /// border and the foot of a statue stay open.
        Seen = "seen" "Inside the scans",
        /// Openings whose boundaries are at most as long as the longest hole.
        Holes = "holes" "Holes",
        /// None: the surface stays as it is, and the report says what is open.
        None = "none" "None",
    }
}

base::choices! {
    /// Directions away from the ground.
    pub enum UpAxis {
        /// Along z.
        Z = "z" "Z",
        /// Along y.
        Y = "y" "Y",
        /// Along x.
        X = "x" "X",
        /// Against z.
        MinusZ = "minus_z" "-Z",
        /// Against y.
        MinusY = "minus_y" "-Y",
        /// Against x.
        MinusX = "minus_x" "-X",
    }
}

impl UpAxis {
    /// It as a vector of length 1.
    pub const fn direction(self) -> DVec3 {
        match self {
            UpAxis::Z => DVec3::Z,
            UpAxis::Y => DVec3::Y,
            UpAxis::X => DVec3::X,
            UpAxis::MinusZ => DVec3::NEG_Z,
            UpAxis::MinusY => DVec3::NEG_Y,
            UpAxis::MinusX => DVec3::NEG_X,
        }
    }
}

base::params! {
    /// How the openings of a surface are closed. Lengths are in its unit.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct CloseParams of "close" with threads {
        /// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a cell.
        openings: Openings = choice("Openings", Openings::CHOICES).since("0.2"),
        /// Longest boundary of an opening that is closed, if holes alone are closed.
        max_hole_length: Option<f64> = length("Max hole length").from_data("100 cells").since("0.2"),
        /// Size of a cell of the merge that the surface is of. The fill has twice that size.
        cell: Option<f64> = length("Cell").from_data("1.3 times the median edge of the surface").above(0.0).since("0.2"),
        /// How far the surface and the poses of its scans may be off: the merge distance.
        merge_distance: Option<f64> = length("Merge distance").from_data("a cell").above(0.0).since("0.2"),
        /// Nothing is filled below a plane under the surface, so that what stood on the ground gets a flat foot instead of a round one.
        flat_base: bool = flag("Flat base").off("parts that nobody saw from below continue as their sides bend").since("0.2"),
        /// Closes too where scans saw through. These faces are marked in the attribute forced.
        force: bool = flag("Force").off("openings in seen space stay open, and the report says where").since("0.2"),
        /// Direction away from the ground, where there is a flat base.
        base_up: UpAxis = choice("Up of the base", UpAxis::CHOICES).since("0.2"),
        /// How far below the lowest measured point the flat base lies, if there is one.
        base_depth: f64 = length("Depth of the base").since("0.2"),
    }
}

impl CloseParams {
    /// Refuses parameters that have no use with the others.
    ///
    /// # Errors
    /// [`Error::Input`] says which parameter to give, too.
    pub(super) fn go_together(&self) -> Result<()> {
        let problem = if self.openings == Openings::None && (self.flat_base || self.force) {
            "flat_base and force have no use unless openings are closed: choose all, seen or holes, or leave them out"
        } else if self.max_hole_length.is_some() && self.openings != Openings::Holes {
            "max_hole_length is given, but has no use unless openings are holes: choose holes, or leave it out"
        } else if self.base_up != UpAxis::Z && !self.flat_base {
            "base_up is given without flat_base, but has no use then: give flat_base, too"
        } else if self.base_depth != 0.0 && !self.flat_base {
            "base_depth is given without flat_base, but has no use then: give flat_base, too"
        } else {
            return Ok(());
        };
        Err(Error::input(problem))
    }
}
