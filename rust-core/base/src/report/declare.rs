//! The declaration.

use super::figure::{Figure, FigureKind, FigureShape, ReportSchema};
use super::found::{Found, Values};

/// A report that [`report!`](crate::report!) declares.
pub trait Report {
    /// Its declaration.
    const SCHEMA: ReportSchema;

    /// The values of its figures, in the order of the rows.
    fn values(&self) -> Values<'_>;
}

impl Figure {
    /// Whether a value is of the kind and the shape that the row declares.
    pub fn allows(&self, found: &Found<'_>) -> bool {
        let all = |values: &[Found<'_>]| values.iter().all(|value| self.allows_one(value));
        match (self.shape, found) {
            (FigureShape::One, value) => self.allows_one(value),
            (FigureShape::Optional, value) => *value == Found::Absent || self.allows_one(value),
            (FigureShape::OptionalArray(_), Found::Absent) => true,
            (FigureShape::Array(size) | FigureShape::OptionalArray(size), Found::Array(values)) => {
                values.len() == size && all(values)
            }
            (FigureShape::List(0), Found::List(values)) => all(values),
            (FigureShape::UpTo(most), Found::List(values)) => values.len() <= most && all(values),
            (FigureShape::ListOfOptional, Found::List(values)) => {
                values.iter().all(|value| *value == Found::Absent || self.allows_one(value))
            }
            (FigureShape::Lists, Found::List(lists)) => {
                lists.iter().all(|list| matches!(list, Found::List(values) if all(values)))
            }
            (FigureShape::List(size), Found::List(arrays)) => arrays.iter().all(|array| match array {
                Found::Array(values) => values.len() == size && all(values),
                _ => false,
            }),
            _ => false,
        }
    }

    fn allows_one(&self, value: &Found<'_>) -> bool {
        match (self.kind, value) {
            (FigureKind::Flag, Found::Flag(_))
            | (FigureKind::Count | FigureKind::Bytes, Found::Count(_))
            | (FigureKind::Integer, Found::Integer(_))
            | (FigureKind::Length | FigureKind::Angle | FigureKind::Ratio | FigureKind::Number, Found::Number(_))
            | (FigureKind::Vector, Found::Vector(_))
            | (FigureKind::Pose, Found::Pose(_))
            | (FigureKind::Text, Found::Text(_)) => true,
            (FigureKind::Matrix(size), Found::Array(rows)) => {
                let is_row = |row: &Found<'_>| match row {
                    Found::Array(values) => {
                        values.len() == size && values.iter().all(|value| matches!(value, Found::Number(_)))
                    }
                    _ => false,
                };
                rows.len() == size && rows.iter().all(is_row)
            }
            (FigureKind::Choice(choices), Found::Choice(name)) => choices.iter().any(|choice| choice.name == *name),
            (FigureKind::Warning(kinds), Found::Array(pair)) => match pair.as_slice() {
                [Found::Choice(kind), Found::Text(_)] => kinds.iter().any(|choice| choice.name == *kind),
                _ => false,
            },
            (FigureKind::Stage, Found::Array(pair)) => matches!(pair.as_slice(), [Found::Text(_), Found::Number(_)]),
            (FigureKind::Nested(schema), Found::Nested(values)) => {
                values.len() == schema.figures.len()
                    && values
                        .iter()
                        .zip(schema.figures)
                        .all(|((row, value), figure)| *row == figure && figure.allows(value))
            }
            _ => false,
        }
    }
}

/// Declares a report: the struct, and the table of its figures.
///
/// A field's comment is the figure's text, for people in every language, so that it names no item of Rust. `besides` are
/// fields that are in no table. `derived` are figures that a method of the same name gives.
#[macro_export]
macro_rules! report {
    (
        $(#[doc = $about:expr])*
        $(#[derive($($derived:ident),*)])?
        pub struct $Struct:ident {
            $( $(#[doc = $text:expr])* $field:ident : $type:ty = $row:expr ),* $(,)?
        }
        $(besides { $( $(#[doc = $note:expr])* $other:ident : $other_type:ty ),* $(,)? })?
        $(derived { $( $(#[doc = $derived_text:expr])* $method:ident = $derived_row:expr ),* $(,)? })?
    ) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq $($(, $derived)*)?)]
        pub struct $Struct {
            $( $(#[doc = $text])* pub $field: $type, )*
            $($( $(#[doc = $note])* pub $other: $other_type, )*)?
        }

        impl $Struct {
            /// The rows of its figures.
            pub const FIGURES: &'static [$crate::report::Figure] = {
                #[allow(unused_imports, reason = "no report has rows of all kinds")]
                use $crate::report::rows::*;
                &[
                    $( $row.of(stringify!($field), concat!($($text),*)), )*
                    $($( $derived_row.of(stringify!($method), concat!($($derived_text),*)), )*)?
                ]
            };
        }

        impl $crate::report::Report for $Struct {
            const SCHEMA: $crate::report::ReportSchema = $crate::report::ReportSchema {
                name: stringify!($Struct),
                text: concat!($($about),*).trim_ascii(),
                figures: Self::FIGURES,
            };

            fn values(&self) -> $crate::report::Values<'_> {
                let found = [
                    $( $crate::report::FigureValue::found(&self.$field), )*
                    $($( $crate::report!(@owned self.$method()), )*)?
                ];
                Self::FIGURES.iter().zip(found).collect()
            }
        }

        impl $crate::report::FigureValue for $Struct {
            fn found(&self) -> $crate::report::Found<'_> {
                $crate::report::Found::Nested($crate::report::Report::values(self))
            }
        }
    };
    // Methods give plain numbers and flags, whose value borrows nothing.
    (@owned $value:expr) => {
        $crate::report::Plain::plain($value)
    };
}
