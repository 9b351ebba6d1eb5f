//! Reading and writing files, on disks and in memory.

#![cfg_attr(test, allow(clippy::print_stdout, clippy::print_stderr))]

pub mod export;
pub mod import;
pub mod memory_folder;
mod unit;
