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
mod sculptor;

pub use certify::{Certificate, certify};
pub use operation::OPERATION;
pub use params::{SCHEMA, SculptParams, Tolerance};
pub use sculptor::Sculptor;

use base::error::Result;
use base::progress::{Progress, Seconds};
use image::range_image::RangeImage;
use mesh::TriMesh;

base::report! {
    /// The figures of sculpting.
    #[derive(Default)]
    pub struct SculptReport {
        /// Tolerance that was used.
        tolerance: f64 = length("Tolerance"),
        /// Difference between the farthest and the nearest range of the covered samples.
        depth_extent: f64 = length("Depth extent"),
        /// Triangles of the mesh that has every covered sample.
        full_triangles: usize = count("Triangles with every sample"),
        /// Triangles left out because they hide behind others, as seen along the rays. The tolerance does not hold for samples that have
        /// only such triangles. These samples count as isolated.
        hidden_triangles: usize = count("Hidden triangles"),
        /// Triangles before vertices were removed.
        dug_triangles: usize = count("Triangles before the polish"),
        /// Triangles of the mesh.
        triangles: usize = count("Triangles"),
        /// Valid pixels that no mesh covers, for want of neighbours or because they are hidden behind others. The tolerance does not hold
        /// for them.
        isolated_pixels: usize = count("Samples not covered"),
        /// Wall-clock seconds by the name of the stage.
        seconds: Seconds = stages(),
    }
}

/// Result of sculpting.
///
/// The mesh is in the sensor's frame. Vertex attributes: `range_row`, `range_col` (i32, the pixel), `error` (f32, the largest of the
/// vertex's faces), and `colour`, `intensity`, `confidence` if the image has them. Face attribute: `error` (f32): the largest distance,
/// along their rays, of the samples seen in the face. World units.
#[derive(Clone, Debug, PartialEq)]
pub struct Sculpted {
    /// The surface, in the sensor's frame.
    pub mesh: TriMesh,
    /// Its distances from the samples, measured on the result.
    pub certificate: Certificate,
    /// Figures of the run.
    pub report: SculptReport,
}

/// Sculpts an image: [`Sculptor::new`] and [`Sculptor::refine`] in one call.
///
/// # Guarantees
/// * The ray of every sample that has a triangle in the step-discontinuity triangulation meets the mesh once, within the tolerance. The
///   certificate measures it, and is compared with the tolerance before anything is returned. No error in the result is above the number
///   that was asked for, by rounding either. Triangles that hide behind others, because a point grid folds as seen along its rays or a scan
///   goes around more than once, count as jumps. The report counts them.
/// * Seen from the sensor the mesh covers exactly those triangles' area, once. With `simplify_borders` it covers at most half a pixel more
///   along rows and columns, none of it a pixel that was not covered. All triangles face the sensor and have an area there. The mesh is a
///   manifold with boundary. Its vertices are samples, unless `interpolate` is off.
/// * The same image gives the same mesh for any number of threads, and in any unit that is a power of two times another.
///
/// # Cost
/// n pixels: O(n log n) expected time. From 128 x 128 to 4096 x 4096 pixels of made terrain, at 0.041 % of its depth extent, the CPU time
/// falls from 1.7 to 0.4 microseconds per pixel, as the share of them that the mesh needs falls. Memory stays near 100 bytes per pixel
/// beside the image.
///
/// # Errors
/// An image that gives no triangle. Parameters out of range, attributes of the wrong length, more than 2^32 - 2 pixels, a coordinate too
/// large, a world in degrees. [`base::Error::Cancelled`].
///
/// Source: \[SG07\], with the differences listed at the module.
pub fn run(image: &RangeImage, params: &SculptParams, progress: &Progress<'_>) -> Result<Sculpted> {
    params.validate()?;
    if let Tolerance::Absolute(tolerance) = params.tolerance {
        sculptor::foresee(image, params, tolerance, sculptor::BYTES_OF_DOMAIN)?;
    }
    progress.plan(&[("triangulating", 1.0)]);
    Sculptor::prepare_for(false, image, params, progress)?.refine(params.tolerance, progress)
}

#[cfg(test)]
mod tests;
