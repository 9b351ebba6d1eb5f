//! Surfaces from range scans.
//!
//! ```text
//!  files, host objects        one grid, one cloud, one mesh      verbs
//!  import ────────────────►   range_image ──► triangulate ──►    merge ──►  mesh ──► export
//!  scan (virtual scanner) ►   point_cloud ──► scattered ─────►              check, measure
//!  beneath all: geom, params, magnitude, progress, threads, memory, error
//! ```

#![cfg_attr(test, allow(clippy::print_stdout, clippy::print_stderr))]

pub mod cluster;
pub mod error;
pub mod export;
pub mod geom;
pub mod import;
pub mod magnitude;
pub mod memory;
pub mod merge;
pub mod mesh;
pub mod params;
pub mod point_cloud;
pub mod progress;
pub mod quads;
pub mod range_image;
pub mod scan;
pub mod scattered;
pub mod sculpt;
pub mod threads;
pub mod triangulate;
mod work;

pub use error::{Error, Result};
pub use mesh::TriMesh;
pub use point_cloud::PointCloud;
pub use progress::{Progress, Tick};
pub use range_image::RangeImage;
