//! # Closed surfaces
//!
//! The openings of a surface are closed smoothly, and never where a scan saw that nothing is.
//!
//! ```c
//! /* The surface of a merger's scans without openings, with a flat foot; prints what stays open. */
//! static srf_status watertight(const srf_mesh *surface, const srf_merger *merger, srf_mesh **out_mesh)
//! {
//!     srf_close_params params;
//!     srf_close_report report;
//!     srf_status status;
//!     srf_close_params_init(&params);
//!     srf_close_report_init(&report);
//!     params.flat_base = 1;
//!     status = srf_mesh_close(surface, merger, &params, NULL, out_mesh, &report);
//!     if (status == SRF_OK && !report.is_closed) printf("%u edges are open\n", (unsigned)report.open_edges);
//!     return status;
//! }
//! ```

use surfrecon::close;
use surfrecon::reports::Report as _;

use crate::guard::guard;
use crate::handle;
use crate::merger::srf_merger;
use crate::mesh::srf_mesh;
use crate::params::close::srf_close_params;
use crate::progress::{srf_progress, watched};
use crate::reports::close::srf_close_report;
use crate::status::srf_status;
use crate::{params, pointer, report, sized, sources};

/// Closes the openings of a surface with a smooth fill. Nothing is filled where a scan saw that nothing is. Vertices and triangles of the
/// surface come first in the result, to the bit. The vertex attribute interpolated and the face attribute hole_fill mark the fill.
/// mesh        an oriented manifold. Not NULL
/// merger      holds the scans that the surface was merged of. NULL for a surface without scans, which is closed by its shape alone
/// params      NULL for the defaults
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only. Not NULL
/// out_report  initialized by srf_close_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh that is no oriented manifold or scans of another world,
///             SRF_ERR_IO, SRF_ERR_FORMAT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_close(
    mesh: *const srf_mesh,
    merger: *const srf_merger,
    params: *const srf_close_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_close_report,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let params = params::read("params", params)?;
        let mesh = handle::get("mesh", mesh)?;
        let merger = if merger.is_null() { None } else { Some(handle::get("merger", merger)?) };
        let scans = merger.as_ref().map(|merger| sources::borrowed(merger.sources())).unwrap_or_default();
        let closed = watched(progress, |progress| Ok(close::close(&mesh.mesh, &scans, &params, progress)?))?;
        if !out_report.is_null() {
            report::write("out_report", out_report, closed.report.values())?;
        }
        handle::give("out_mesh", out_mesh, closed.mesh.into())
    })
}
