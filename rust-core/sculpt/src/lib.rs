//! Sculpting: one range image -> the smallest mesh within a tolerance. \[SG07\]
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 1 | `domain`, `folds` | step-discontinuity triangles that don't hide behind others -> where the mesh may be |
//! | 2 | `seams` | domain -> pixels that must be vertices |
//! | 3 | `ladder`, `greedy_insertion`, `delaunay` | tiles and their required pixels -> a mesh within the tolerance |
//! | 4 | `polish`, `patch`, `borders`, `star`, `sides`, `search` | mesh -> mesh of fewer triangles within the tolerance |
//! | 5 | `finish` | triangles over pixels -> mesh with attributes |
//! | 6 | `certify`, `mend` | mesh and image -> distances, measured anew; what breaks the bound is split |
//!
//! `reference` is the paper's own pipeline, for comparison.
//!
//! Differences from the paper: (1) The digging is lazy. The paper digs a tetrahedralization of all pixels in curvature space from outside.
//! Here a planar Delaunay triangulation of what the sensor sees gets the pixel that is farthest from it, tile by tile. So it is a height
//! field at every moment, a pixel costs time only when the digging reaches it, and nothing is left to clean up. (2) The polish stage, which
//! the paper has not, leaves about 0.6 times the triangles. (3) The error is measured along each pixel's own ray, whatever the projection.
//! (4) The mesh covers exactly the triangles of the step-discontinuity triangulation, but those that hide behind others where a point grid
//! folds. Nothing covers an invalid pixel or bridges a jump, and each ray meets the mesh once. Borders are simplified on request, by half a
//! pixel at most.

mod operation;
mod params;
mod report;

// Pixels as the digging sees them, whatever the projection
mod view;

mod rays;

// 1. where the mesh may be
mod domain;
mod windows;

mod folds;

// 2. pixels that must be vertices
mod seams;

// 3. digging
mod delaunay;
mod greedy_insertion;
mod ladder;

// between the stages
mod pieces;

// 4. fewer triangles
mod borders;
mod patch;
mod polish;
mod search;
mod sides;
mod star;

// 5. the mesh
mod finish;

// 6. the certificate
mod certify;
mod mend;

// The paper's own pipeline
#[cfg(any(test, feature = "reference"))]
pub mod reference;

// Built once, dug to any tolerance
mod driver;

pub use certify::{Certificate, certify};
pub use driver::{Sculptor, run};
pub use operation::OPERATION;
pub use params::{SCHEMA, SculptParams, Tolerance};
pub use report::{SculptReport, Sculpted};

#[cfg(test)]
mod tests;
