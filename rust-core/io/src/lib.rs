//! Reading and writing files.

#![cfg_attr(test, allow(clippy::print_stdout, clippy::print_stderr))]

pub mod export;
pub mod import;
