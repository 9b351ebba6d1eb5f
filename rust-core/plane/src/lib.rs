//! The dominant plane of scans: the one that most samples lie on, a table or the ground.
//!
//! | file | what |
//! |---|---|
//! | `params` | the settings |
//! | `report` | the plane that was found |
//! | `pool` | some samples of each scan, in an order of their own |
//! | `fit` | planes through three samples \[FB81\], the best of them by least squares |
//! | `driver` | these in their order |
//!
//! Random samples are drawn from the pool with fixed seeds, so that neither the order of the scans nor the number of threads counts.

mod operation;
mod params;
mod report;

mod fit;
mod pool;

mod driver;

pub use driver::dominant;
pub use operation::OPERATION;
pub use params::{PlaneParams, SCHEMA};
pub use report::DominantPlane;

#[cfg(test)]
mod tests;
