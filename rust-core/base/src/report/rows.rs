//! The words that the rows of [`report!`](crate::report!) begin with. The macro has them in scope.

use super::{Figure, Kind, Schema, Shape};
use crate::params::Choice;

/// A row that [`report!`](crate::report!) completes.
const fn row(label: &'static str, kind: Kind) -> Figure {
    Figure {
        name: "",
        label,
        kind,
        shape: Shape::One,
        parts: &[],
        choices_name: "",
        is_counted: false,
        text: "",
        since: "0.1",
    }
}

/// Yes or no.
pub const fn flag(label: &'static str) -> Figure {
    row(label, Kind::Flag)
}

/// A whole number, at least 0.
pub const fn count(label: &'static str) -> Figure {
    row(label, Kind::Count)
}

/// A whole number of any sign.
pub const fn integer(label: &'static str) -> Figure {
    row(label, Kind::Integer)
}

/// A number of bytes.
pub const fn bytes(label: &'static str) -> Figure {
    row(label, Kind::Bytes)
}

/// A length in the unit of the scans.
pub const fn length(label: &'static str) -> Figure {
    row(label, Kind::Length)
}

/// An angle in radians.
pub const fn angle(label: &'static str) -> Figure {
    row(label, Kind::Angle)
}

/// A share of a whole.
pub const fn ratio(label: &'static str) -> Figure {
    row(label, Kind::Ratio)
}

/// Any other number.
pub const fn number(label: &'static str) -> Figure {
    row(label, Kind::Number)
}

/// Three numbers along x, y and z.
pub const fn vector(label: &'static str) -> Figure {
    row(label, Kind::Vector)
}

/// Places a frame in another.
pub const fn pose(label: &'static str) -> Figure {
    row(label, Kind::Pose)
}

/// A square matrix of so many rows.
pub const fn matrix(label: &'static str, rows: usize) -> Figure {
    row(label, Kind::Matrix(rows))
}

/// One of the choices that [`choices!`](crate::choices!) declares.
pub const fn choice(label: &'static str, choices: &'static [Choice]) -> Figure {
    row(label, Kind::Choice(choices))
}

/// Words that the data gave.
pub const fn text(label: &'static str) -> Figure {
    row(label, Kind::Text)
}

/// A list of warnings, each of one of these kinds.
pub const fn warning(label: &'static str, kinds: &'static [Choice]) -> Figure {
    row(label, Kind::Warning(kinds)).list()
}

/// The stages with their wall-clock seconds.
pub const fn stages() -> Figure {
    row("Time", Kind::Stage).list()
}

/// A report of its own.
pub const fn nested(label: &'static str, schema: &'static Schema) -> Figure {
    row(label, Kind::Nested(schema))
}
