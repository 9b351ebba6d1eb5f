//! Ways to run the steps: what stages leave for each other is in memory, in memory for the next merge too, or in files.

pub mod incremental;
pub mod memory;
pub mod out_of_core;
