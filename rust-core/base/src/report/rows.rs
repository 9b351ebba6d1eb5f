//! The words that the rows of [`report!`](crate::report!) begin with. The macro has them in scope.

use super::figure::{Figure, FigureKind, FigureShape, ReportSchema};
use crate::params::Choice;

/// A row that [`report!`](crate::report!) completes.
const fn row(label: &'static str, kind: FigureKind) -> Figure {
    Figure {
        name: "",
        label,
        kind,
        shape: FigureShape::One,
        parts: &[],
        choices_name: "",
        is_counted: false,
        text: "",
        since: "0.1",
    }
}

/// Yes or no.
pub const fn flag(label: &'static str) -> Figure {
    row(label, FigureKind::Flag)
}

/// A whole number, at least 0.
pub const fn count(label: &'static str) -> Figure {
    row(label, FigureKind::Count)
}

/// A whole number of any sign.
pub const fn integer(label: &'static str) -> Figure {
    row(label, FigureKind::Integer)
}

/// A number of bytes.
pub const fn bytes(label: &'static str) -> Figure {
    row(label, FigureKind::Bytes)
}

/// A length in the unit of the scans.
pub const fn length(label: &'static str) -> Figure {
    row(label, FigureKind::Length)
}

/// An angle in radians.
pub const fn angle(label: &'static str) -> Figure {
    row(label, FigureKind::Angle)
}

/// A share of a whole.
pub const fn ratio(label: &'static str) -> Figure {
    row(label, FigureKind::Ratio)
}

/// Any other number.
pub const fn number(label: &'static str) -> Figure {
    row(label, FigureKind::Number)
}

/// Three numbers along x, y and z.
pub const fn vector(label: &'static str) -> Figure {
    row(label, FigureKind::Vector)
}

/// Places a frame in another.
pub const fn pose(label: &'static str) -> Figure {
    row(label, FigureKind::Pose)
}

/// A square matrix of so many rows.
pub const fn matrix(label: &'static str, rows: usize) -> Figure {
    row(label, FigureKind::Matrix(rows))
}

/// One of the choices that [`choices!`](crate::choices!) declares.
pub const fn choice(label: &'static str, choices: &'static [Choice]) -> Figure {
    row(label, FigureKind::Choice(choices))
}

/// Words that the data gave.
pub const fn text(label: &'static str) -> Figure {
    row(label, FigureKind::Text)
}

/// A list of warnings, each of one of these kinds.
pub const fn warning(label: &'static str, kinds: &'static [Choice]) -> Figure {
    row(label, FigureKind::Warning(kinds)).list()
}

/// The stages with their wall-clock seconds.
pub const fn stages() -> Figure {
    row("Time", FigureKind::Stage).list()
}

/// A report of its own.
pub const fn nested(label: &'static str, schema: &'static ReportSchema) -> Figure {
    row(label, FigureKind::Nested(schema))
}
