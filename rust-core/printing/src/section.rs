//! Planes across the axes, which cut.

use std::cmp::Ordering;

use glam::{DVec2, DVec3};

use close::UpAxis;

use super::single::Precision;

/// A plane across an axis, and its side that is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Whether places of larger coordinates are kept. Those of smaller ones are kept otherwise.
    pub is_upward: bool,
    /// Coordinate of the plane.
    pub at: f64,
}

impl Section {
    /// The side of a place, by its coordinate as it is: positive where it is kept.
    pub fn side(&self, place: DVec3) -> Ordering {
        let side = place[self.axis].total_cmp(&self.at);
        // -0 is 0.
        let side = if place[self.axis] == self.at { Ordering::Equal } else { side };
        if self.is_upward { side } else { side.reverse() }
    }

    /// The place in the plane as it is seen from the kept side.
    pub fn seen(&self, place: DVec3) -> DVec2 {
        let (u, v) = (place[(self.axis + 1) % 3], place[(self.axis + 2) % 3]);
        // Adding zero makes -0 and 0 one.
        DVec2::new(u, v).map(|x| x + 0.0) * DVec2::ONE.with_x(if self.is_upward { 1.0 } else { -1.0 })
    }

    /// The same plane with the other side kept.
    pub fn reversed(self) -> Self {
        Section { is_upward: !self.is_upward, ..self }
    }

    /// The same a little further along its axis.
    pub fn moved(self, by: f64) -> Self {
        Section { at: self.at + by, ..self }
    }

    /// The nearest plane in a precision.
    pub fn rounded(self, precision: Precision) -> Self {
        Section { at: precision.number(self.at), ..self }
    }
}

/// The axis that an object stands along, and whether its coordinates rise upward.
pub fn axis_of(up: UpAxis) -> (usize, bool) {
    match up {
        UpAxis::X => (0, true),
        UpAxis::Y => (1, true),
        UpAxis::Z => (2, true),
        UpAxis::MinusX => (0, false),
        UpAxis::MinusY => (1, false),
        UpAxis::MinusZ => (2, false),
    }
}
