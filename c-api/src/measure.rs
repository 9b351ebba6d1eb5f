//! Measuring.

use surfrecon::mesh::certify::certify;
use surfrecon::mesh::measure::{self, Side};
use surfrecon::reports::Report;

use crate::array::{Borrowed, srf_array};
use crate::guard::guard;
use crate::handle;
use crate::mesh::srf_mesh;
use crate::progress::{srf_progress, watched};
use crate::reports::distance::srf_distance_report;
use crate::status::{Failure, flag, srf_status};
use crate::{pointer, report, sized};

/// Exact distances of points to the nearest point of a mesh. Time O((n + m) log m) for n points and m triangles. The same for
/// any number of threads.
/// mesh           with at least one triangle. Not NULL
/// points         3 SRF_TYPE_F64 or SRF_TYPE_F32 a point, finite. Not NULL
/// is_signed      1: distances behind the surface are negative. 0: all are positive
/// threads        at most 1024. 0 for the number of srf_set_threads()
/// progress       NULL for none
/// out_distances  room for a double a point. NULL if only the figures are wanted
/// out_figures    initialized by srf_distance_report_init(). NULL if not wanted
/// returns        SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
///                Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_distances(
    mesh: *const srf_mesh,
    points: *const srf_array,
    is_signed: u32,
    threads: u32,
    progress: *const srf_progress,
    out_distances: *mut f64,
    out_figures: *mut srf_distance_report,
) -> srf_status {
    guard(|| {
        let side = side("is_signed", is_signed)?;
        if !out_figures.is_null() {
            sized::writable("out_figures", out_figures)?;
        }
        let mesh = handle::get("mesh", mesh)?;
        let points = Borrowed::new("points", points, 3)?.points()?;
        watched(progress, |progress| {
            let deviation = measure::deviation(&points, &mesh.mesh, side, threads as usize, progress)?;
            if !out_figures.is_null() {
                report::write("out_figures", out_figures, deviation.summary.values())?;
            }
            if out_distances.is_null() {
                return Ok(());
            }
            pointer::copy_out("out_distances", out_distances, &deviation.distances)
        })
    })
}

/// How far one surface lies from another: exact at its vertices, with a bound that holds for every point between them.
/// mesh           the surface. Not NULL
/// reference      with at least one triangle. Not NULL
/// is_signed      1: distances behind the reference are negative. 0: all are positive
/// threads        at most 1024. 0 for the number of srf_set_threads()
/// progress       NULL for none
/// out_distances  room for a double a vertex of mesh. NULL if only the figures are wanted
/// out_figures    of the vertices, and how far the surface reaches between them. Initialized by srf_distance_report_init(). NULL if not wanted
/// returns        SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
///                Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_surface_distance(
    mesh: *const srf_mesh,
    reference: *const srf_mesh,
    is_signed: u32,
    threads: u32,
    progress: *const srf_progress,
    out_distances: *mut f64,
    out_figures: *mut srf_distance_report,
) -> srf_status {
    guard(|| {
        let side = side("is_signed", is_signed)?;
        if !out_figures.is_null() {
            sized::writable("out_figures", out_figures)?;
        }
        let (mesh, reference) = (handle::get("mesh", mesh)?, handle::get("reference", reference)?);
        watched(progress, |progress| {
            let found = certify(&mesh.mesh, &reference.mesh, side, threads as usize, progress)?;
            if !out_figures.is_null() {
                report::write("out_figures", out_figures, found.report().values())?;
            }
            if out_distances.is_null() {
                return Ok(());
            }
            pointer::copy_out("out_distances", out_distances, &found.vertices.distances)
        })
    })
}

fn side(name: &str, is_signed: u32) -> Result<Side, Failure> {
    Ok(if flag(name, is_signed)? { Side::Signed } else { Side::Ignored })
}
