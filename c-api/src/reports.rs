//! Structs of figures, a file an operation. Written by `make generate`.

pub mod check;
pub mod cluster;
pub mod merge;
pub mod quads;
pub mod reconstruct;
pub mod sculpt;
