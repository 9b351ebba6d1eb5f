//! Preparing a print: a closed mesh -> one that a printer makes, in steps that may each be left out.
//!
//! | step | file | in -> out |
//! |---|---|---|
//! | 1 | `scale_to` | mesh -> one of the size that is asked for |
//! | 2 | `flat_base` | mesh -> one that stands on a flat face |
//! | 3 | `hollow` | mesh -> one with a cavity |
//! | 4 | `drain` | cavity, base -> a hole that joins them |
//! | 5 | `split_parts` | mesh -> parts that the printer holds |
//! | | `section`, `cut`, `cap`, `slice` | mesh, plane -> the closed part on a side of it |
//! | | `made` | sources of vertices and faces -> their attributes |
//!
//! Cuts know no epsilon. Vertices in a plane are beyond it, and the cap is a constrained Delaunay triangulation of all that the edges in the
//! plane enclose, with holes and islands. Crossings are looked for exactly after each cut, as rounding moves vertices on edges. If there are
//! any, the plane moves by a hair, and the report says where it lies.

mod params;
mod report;

// a surface and its sources
mod made;

// cut along planes
mod cap;
mod cut;
mod section;
mod slice;

// 1. its size
mod scale_to;

// 2. its base
mod flat_base;

// 3. its cavity
mod hollow;

// 4. a hole in its base
mod drain;

// 5. its parts
mod split_parts;

// the steps in their order
mod driver;

pub use driver::prepare_print;
pub use params::{PrepareParams, SCHEMA, ScaleSide};
pub use report::{PrepareNote, PrepareProblem, PrepareReport, PreparedPrint};

#[cfg(test)]
mod tests;
