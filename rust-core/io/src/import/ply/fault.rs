//! Faults of one value. Their words are in `words`.

use super::header::ScalarType;

/// Faults of reading one value. Small, since it comes out of the innermost loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// The file ends.
    End,
    /// The line ends at this byte though the element doesn't.
    LineEnd(usize),
    /// At this byte there is no number.
    NoNumber(usize),
    /// At this byte there is no whole number.
    NoWhole(usize),
    /// The line goes on at this byte after the element.
    LineGoesOn(usize),
    /// The value doesn't fit its type.
    Range(i64, ScalarType),
}
