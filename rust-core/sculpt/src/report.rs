//! The result of sculpting, and its figures.

use crate::certify::Certificate;
use base::progress::Seconds;
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
