//! Reports: the figures of a call, and their declaration.
//!
//! [`report!`](crate::report!) takes one row per figure. It makes the struct that the operation returns and the table of its
//! figures ([`Figure`]), and gives the value of each by name ([`Report::values`]). The C structs, Python's classes, the
//! values that MeshLab returns, Blender's lines and the pages are made from these rows.

mod declare;
mod figure;
mod found;
pub mod rows;

pub use declare::Report;
pub use figure::{Figure, FigureKind, FigureShape, ReportSchema};
pub use found::{FigureValue, Found, Plain, Remark, Values};
