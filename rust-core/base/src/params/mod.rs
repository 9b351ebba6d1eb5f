//! Parameters, and the declaration of those of an operation.
//!
//! [`params!`](crate::params!) takes one row per parameter. It makes of them the struct the operation is called with, its defaults and the
//! operation's table [`ParamSpec`]. It also makes the check of every value, and setting and getting by name. [`choices!`](crate::choices!)
//! declares what a parameter may be one of, [`alternatives!`](crate::alternatives!) parameters of which one is given. Every language and
//! every host is made from these rows.

mod declare;
mod field;
mod spec;

pub use declare::{ParamSchema, Params, joined, named, rows_of};
pub use field::ParamField;
pub use spec::{Choice, Default, ParamKind, ParamSpec, Value, angle, choice, count, flag, length, ratio, threads};
