//! Preparing a print: a closed mesh -> one that a printer makes, in steps that may each be left out.
//!
//! | step | file | in -> out |
//! |---|---|---|
//! | 1 | `scale_to` | mesh -> one of the size that is asked for |
//! | 2 | `flat_base` | mesh -> one that stands on a flat face |
//! | 3 | `thicken` | mesh -> one without thin walls |
//! | 4 | `hollow` | mesh -> one with a cavity |
//! | 5 | `drain` | cavity, base -> a hole that joins them |
//! | 6 | `split_parts` | mesh -> parts that the printer holds |
//! | | `section`, `cut`, `cap`, `slice` | mesh, plane -> the closed part on a side of it |
//! | | `made` | sources of vertices and faces -> their attributes |
//!
//! Cuts know no epsilon. Vertices in a plane are beyond it, and the cap is a constrained Delaunay triangulation of all that the edges in the
//! plane enclose, with holes and islands. Crossings are looked for exactly after each cut, as rounding moves vertices on edges. If there are
//! any, the plane moves by a hair, and the report says where it lies.
//!
//! A cavity has cells of at most a third of its walls. A cell of its surface has a corner one wall deep, so that no face of it comes near the
//! surface of the mesh. A cavity that is to be drained is made as if the base were not there, and cut flat one wall above it. Its floor
//! and the base are then flat, and a hole in each is one more loop of their triangulations.
//!
//! The sides of a thin wall move apart along the normals of its faces alone. Faces around them follow. Whatever would cross stays back.

mod operation;
mod params;
mod report;

// a surface and its sources
mod made;

// cut along planes
mod cap;
mod cut;
mod section;
mod single;
mod slice;

// 1. its size
mod scale_to;

// 2. its base
mod flat_base;

// 3. its walls
mod thicken;

// 4. its cavity
mod hollow;

// 5. a hole in its base
mod drain;

// 6. its parts
mod split_parts;

// the steps in their order
mod driver;

pub use driver::prepare_print;
pub use operation::OPERATION;
pub use params::{PrepareParams, SCHEMA, ScaleSide};
pub use report::{PrepareNote, PrepareProblem, PrepareReport, PreparedPrint, part};

#[cfg(test)]
mod tests;
