//! # Checks before printing
//!
//! A mesh is judged before it is printed in 3D: closed, manifold, no crossing faces, walls, overhangs, size. Nothing is repaired.
//!
//! ```c
//! /* Whether a mesh in millimetres can be printed: 1 or 0. Prints what is in the way. */
//! static int is_printable(const srf_mesh *mesh)
//! {
//!     srf_check_print_params params;
//!     srf_check_print_report report;
//!     srf_check_print_params_init(&params);
//!     srf_check_print_report_init(&report);
//!     params.min_wall = 0.8;
//!     if (srf_mesh_check_print(mesh, &params, NULL, NULL, &report) != SRF_OK) return 0;
//!     if (!report.is_closed) printf("openings: %u\n", (unsigned)report.openings);
//!     if (report.crossing_pairs > 0) printf("pairs of faces that cross: %u\n", (unsigned)report.crossing_pairs);
//!     if (report.thin_faces > 0) printf("a wall is %g mm thick\n", report.thinnest_wall);
//!     return report.is_closed && report.crossing_pairs == 0 && report.thin_faces == 0;
//! }
//! ```

use surfrecon::close::print;
use surfrecon::reports::Report as _;

use crate::guard::guard;
use crate::handle;
use crate::mesh::srf_mesh;
use crate::params::check_print::srf_check_print_params;
use crate::progress::{srf_progress, watched};
use crate::reports::check_print::srf_check_print_report;
use crate::status::srf_status;
use crate::{params, pointer, report, sized};

/// Checks whether a mesh can be printed. The mesh that is given back is the same with three more attributes of its triangles: wall, the
/// thickness behind the triangle, crossing, whether it crosses another, and overhang, whether it hangs over. Where a wall is
/// thicker than is measured, or nothing lies behind a triangle, wall is wall_limit of the report.
/// mesh        any mesh. Not NULL
/// params      NULL for the defaults
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only. NULL if not wanted
/// out_report  initialized by srf_check_print_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a vertex that is not finite, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///             SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_check_print(
    mesh: *const srf_mesh,
    params: *const srf_check_print_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_check_print_report,
) -> srf_status {
    guard(|| {
        if !out_mesh.is_null() {
            pointer::writable("out_mesh", out_mesh)?;
        }
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let params = params::read("params", params)?;
        let mesh = handle::get("mesh", mesh)?;
        let checked = watched(progress, |progress| Ok(print::check_print(&mesh.mesh, &params, progress)?))?;
        if !out_report.is_null() {
            report::write("out_report", out_report, checked.report.values())?;
        }
        if out_mesh.is_null() { Ok(()) } else { handle::give("out_mesh", out_mesh, checked.mesh.into()) }
    })
}
