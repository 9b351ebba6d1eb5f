//! The values of figures, one type for all of them.

use glam::{DAffine3, DVec3};

use super::figure::Figure;

/// The values of a report, each with its row.
pub type Values<'a> = Vec<(&'static Figure, Found<'a>)>;

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
pub trait FigureValue {
    /// The value.
    fn found(&self) -> Found<'_>;
}

/// A finding for a person.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remark<K> {
    /// Its kind.
    pub kind: K,
    /// The finding with its figures, and the remedy.
    pub text: String,
}

impl<K: FigureValue> FigureValue for Remark<K> {
    fn found(&self) -> Found<'_> {
        Found::Array(vec![self.kind.found(), self.text.found()])
    }
}

impl FigureValue for bool {
    fn found(&self) -> Found<'_> {
        Found::Flag(*self)
    }
}

impl FigureValue for u64 {
    fn found(&self) -> Found<'_> {
        Found::Count(*self)
    }
}

impl FigureValue for usize {
    fn found(&self) -> Found<'_> {
        Found::Count(*self as u64)
    }
}

impl FigureValue for i64 {
    fn found(&self) -> Found<'_> {
        Found::Integer(*self)
    }
}

impl FigureValue for f64 {
    fn found(&self) -> Found<'_> {
        Found::Number(*self)
    }
}

impl FigureValue for String {
    fn found(&self) -> Found<'_> {
        Found::Text(self)
    }
}

impl FigureValue for &'static str {
    fn found(&self) -> Found<'_> {
        Found::Text(self)
    }
}

impl FigureValue for DVec3 {
    fn found(&self) -> Found<'_> {
        Found::Vector(*self)
    }
}

impl FigureValue for DAffine3 {
    fn found(&self) -> Found<'_> {
        Found::Pose(*self)
    }
}

impl<T: FigureValue> FigureValue for Option<T> {
    fn found(&self) -> Found<'_> {
        self.as_ref().map_or(Found::Absent, FigureValue::found)
    }
}

impl<T: FigureValue, const SIZE: usize> FigureValue for [T; SIZE] {
    fn found(&self) -> Found<'_> {
        Found::Array(self.iter().map(FigureValue::found).collect())
    }
}

impl<T: FigureValue, U: FigureValue> FigureValue for (T, U) {
    fn found(&self) -> Found<'_> {
        Found::Array(vec![self.0.found(), self.1.found()])
    }
}

impl<T: FigureValue> FigureValue for Vec<T> {
    fn found(&self) -> Found<'_> {
        Found::List(self.iter().map(FigureValue::found).collect())
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
