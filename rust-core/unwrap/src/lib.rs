//! Unwrapping: a triangle mesh -> charts in the unit squares of textures, without flips and without overlaps.
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 1 | `surface` | mesh -> its triangles in a unit box, single precision |
//! | 2 | `flatten` | triangles -> charts by normal cones, each flattened: crate `uvunwrap` |
//! | 3 | `join` | charts -> fewer: small ones are laid beside their neighbours |
//! | 4 | `pack` | charts -> their places in one tile or several: crate `uvunwrap` |
//! | 5 | `mend` | rounded coordinates -> the same without flips and overlaps |
//! | 6 | `finish` | coordinates -> mesh with vertices split at seams, and its figures |
//! | | `check` | any coordinates -> what is wrong with them, by exact signs |
//!
//! Coordinates are those of UDIM tiles: tile `t` is the unit square whose lower left corner is `(t % 10, t / 10)`, number
//! 1001 + t in file names. Its image has the first row at the top, where v is largest.

mod operation;
mod params;
mod report;

// The coordinates of all corners, and which chart they belong to
mod charts;

// 1. triangles in a unit box
mod surface;

// 2. charts
mod flatten;

// 3. fewer charts
mod join;

// 4. places
mod pack;

// 5. exactly valid
mod mend;

// 6. the mesh
mod finish;

// The stages in their order
mod driver;

pub mod check;

#[doc(hidden)]
pub use driver::PLAN;
pub use driver::unwrap;
pub use operation::OPERATION;
pub use params::{ChartScale, SCHEMA, UnwrapParams};
pub use report::{UnwrapReport, Unwrapped};

#[cfg(test)]
mod tests;
