//! What a parameter is, and the declaration of an operation's parameters.
//!
//! [`params!`](crate::params!) takes one row a parameter and makes of them the struct the operation is called with, its
//! defaults, the operation's table [`ParamSpec`], the check of every value, and setting and getting by name.
//! [`choices!`](crate::choices!) declares what a parameter may be one of, [`alternatives!`](crate::alternatives!) parameters of
//! which one is given. Every language and every host is made from these rows.

mod declare;
mod field;
mod spec;

pub use declare::{Params, Schema, joined, named, rows_of};
pub use field::Field;
pub use spec::{Choice, Default, Kind, ParamSpec, Value, angle, choice, count, flag, length, ratio, threads};
