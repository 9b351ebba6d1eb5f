//! # Texture coordinates
//!
//! A mesh gets texture coordinates: charts that are packed into one tile or several. No triangle is flipped and no two overlap.
//!
//! ```c
//! /* A mesh with texture coordinates for images of 4096 texels. Prints how well they fill the image, and the first of them. */
//! static srf_status unwrapped(const srf_mesh *mesh, srf_mesh **out_mesh)
//! {
//!     srf_unwrap_params params;
//!     srf_unwrap_report report;
//!     srf_array s, t;
//!     srf_status status;
//!     srf_unwrap_params_init(&params);
//!     srf_unwrap_report_init(&report);
//!     params.size = 4096;
//!     status = srf_mesh_unwrap(mesh, &params, NULL, out_mesh, &report);
//!     if (status != SRF_OK) return status;
//!     printf("%u charts fill %.0f %% of the image\n", (unsigned)report.charts, 100 * report.used);
//!     status = srf_mesh_attribute(*out_mesh, SRF_DOMAIN_VERTICES, "s", &s);
//!     if (status == SRF_OK) status = srf_mesh_attribute(*out_mesh, SRF_DOMAIN_VERTICES, "t", &t);
//!     if (status == SRF_OK) printf("the first vertex lies at (%g, %g)\n", *(const float *)s.data, *(const float *)t.data);
//!     return status;
//! }
//! ```

use surfrecon::reports::Report as _;
use surfrecon::unwrap;

use crate::guard::guard;
use crate::handle;
use crate::mesh::srf_mesh;
use crate::params::unwrap::srf_unwrap_params;
use crate::progress::{srf_progress, watched};
use crate::reports::unwrap::srf_unwrap_report;
use crate::status::srf_status;
use crate::{params, pointer, report, sized};

/// Gives a mesh texture coordinates. The result has the same triangles in the same order. Vertices on seams come once per chart. Attributes
/// ride along. The attributes s and t of the vertices are the coordinates, to the right and upwards: the image of a tile fills a unit
/// square, with its first row at the top. Tile k begins at (k % 10, k / 10). The attribute source_vertex is the vertex of the input that
/// each vertex was. The attribute chart is the chart of each triangle, -1 for one without area in the texture.
/// mesh        any mesh. Not NULL
/// params      NULL for the defaults
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only. Not NULL
/// out_report  initialized by srf_unwrap_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh without triangles or charts that do not fit the tiles,
///             SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_unwrap(
    mesh: *const srf_mesh,
    params: *const srf_unwrap_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_unwrap_report,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let params = params::read("params", params)?;
        let mesh = handle::get("mesh", mesh)?;
        let unwrapped = watched(progress, |progress| Ok(unwrap::unwrap(&mesh.mesh, &params, progress)?))?;
        if !out_report.is_null() {
            report::write("out_report", out_report, unwrapped.report.values())?;
        }
        handle::give("out_mesh", out_mesh, unwrapped.mesh.into())
    })
}
