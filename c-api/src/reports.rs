//! Structs of figures, a file a report. Written by `make generate`.

pub mod align;
pub mod check;
pub mod check_print;
pub mod close;
pub mod cluster;
pub mod distance;
pub mod left_out;
pub mod merge;
pub mod prepare_print;
pub mod quads;
pub mod reconstruct;
pub mod sculpt;
pub mod snap;
pub mod texture;
pub mod unwrap;
