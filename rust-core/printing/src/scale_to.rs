//! Scaling: a side becomes as long as asked.

use base::error::Result;
use base::magnitude;
use mesh::TriMesh;

use super::params::{PrepareParams, ScaleSide};
use super::report::PrepareReport;
use super::section::axis_of;

/// Scales all coordinates, and with them all sides, by one factor. Their frame is another one then.
///
/// # Errors
/// [`base::Error::Input`] if coordinates become too large.
pub fn scale_to(mesh: &mut TriMesh, length: f64, params: &PrepareParams, report: &mut PrepareReport) -> Result<()> {
    let (lo, hi) = mesh::measure::bounds(&mesh.positions).unwrap_or_default();
    let side = match params.scale_side {
        ScaleSide::Longest => (hi - lo).max_element(),
        ScaleSide::Height => (hi - lo)[axis_of(params.print_up).0],
    };
    report.scale = magnitude::divisor("the factor that scales the mesh", length / side)?;
    if report.scale == 1.0 {
        return Ok(());
    }
    mesh.positions.iter_mut().for_each(|place| *place *= report.scale);
    (mesh.crs, mesh.rounding_room) = (None, None);
    magnitude::points("vertex", &mesh.positions)
}
