//! The values of figures, one type for all of them.

use glam::{DAffine3, DVec3};

use super::Values;

/// The value of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Found<'a> {
    /// None: the figure does not apply.
    Absent,
    /// Yes or no.
    Flag(bool),
    /// A whole number, at least 0.
    Count(u64),
    /// A whole number of any sign.
    Integer(i64),
    /// A number.
    Number(f64),
    /// The name of a choice.
    Choice(&'static str),
    /// Words.
    Text(&'a str),
    /// Three numbers.
    Vector(DVec3),
    /// A pose.
    Pose(DAffine3),
    /// A fixed number of values.
    Array(Vec<Found<'a>>),
    /// Any number of values.
    List(Vec<Found<'a>>),
    /// A report of its own.
    Nested(Values<'a>),
}

/// A type that a figure's value may have.
pub trait Measured {
    /// The value.
    fn found(&self) -> Found<'_>;
}

impl Measured for bool {
    fn found(&self) -> Found<'_> {
        Found::Flag(*self)
    }
}

impl Measured for u64 {
    fn found(&self) -> Found<'_> {
        Found::Count(*self)
    }
}

impl Measured for usize {
    fn found(&self) -> Found<'_> {
        Found::Count(*self as u64)
    }
}

impl Measured for i64 {
    fn found(&self) -> Found<'_> {
        Found::Integer(*self)
    }
}

impl Measured for f64 {
    fn found(&self) -> Found<'_> {
        Found::Number(*self)
    }
}

impl Measured for String {
    fn found(&self) -> Found<'_> {
        Found::Text(self)
    }
}

impl Measured for &'static str {
    fn found(&self) -> Found<'_> {
        Found::Text(self)
    }
}

impl Measured for DVec3 {
    fn found(&self) -> Found<'_> {
        Found::Vector(*self)
    }
}

impl Measured for DAffine3 {
    fn found(&self) -> Found<'_> {
        Found::Pose(*self)
    }
}

impl<T: Measured> Measured for Option<T> {
    fn found(&self) -> Found<'_> {
        self.as_ref().map_or(Found::Absent, Measured::found)
    }
}

impl<T: Measured, const SIZE: usize> Measured for [T; SIZE] {
    fn found(&self) -> Found<'_> {
        Found::Array(self.iter().map(Measured::found).collect())
    }
}

impl<T: Measured, U: Measured> Measured for (T, U) {
    fn found(&self) -> Found<'_> {
        Found::Array(vec![self.0.found(), self.1.found()])
    }
}

impl<T: Measured> Measured for Vec<T> {
    fn found(&self) -> Found<'_> {
        Found::List(self.iter().map(Measured::found).collect())
    }
}

/// A value that borrows nothing, as methods of reports return it.
pub trait Plain {
    /// The value.
    fn plain(self) -> Found<'static>;
}

impl Plain for bool {
    fn plain(self) -> Found<'static> {
        Found::Flag(self)
    }
}

impl Plain for usize {
    fn plain(self) -> Found<'static> {
        Found::Count(self as u64)
    }
}

impl Plain for i64 {
    fn plain(self) -> Found<'static> {
        Found::Integer(self)
    }
}

impl Plain for f64 {
    fn plain(self) -> Found<'static> {
        Found::Number(self)
    }
}

impl<T: Plain> Plain for Option<T> {
    fn plain(self) -> Found<'static> {
        self.map_or(Found::Absent, Plain::plain)
    }
}
