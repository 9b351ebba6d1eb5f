//! # Preparing a print
//!
//! A closed mesh is made ready for printing in 3D, by the steps that are asked for: its size, a flat base, thicker walls, a cavity with a
//! drain, parts that the printer holds. Each result is closed, and no faces cross.
//!
//! ```c
//! /* A statue of 120 mm that stands flat, hollow with walls of 2 mm, in parts for a printer of 100 mm. Prints how many there are. */
//! static srf_status for_printer(const srf_mesh *mesh, srf_mesh **out_mesh)
//! {
//!     srf_prepare_print_params params;
//!     srf_prepare_print_report report;
//!     srf_status status;
//!     srf_prepare_print_params_init(&params);
//!     srf_prepare_print_report_init(&report);
//!     params.scale_to = 120.0;
//!     params.flat_base = 1;
//!     params.hollow = 2.0;
//!     params.printer_height = 100.0;
//!     status = srf_mesh_prepare_print(mesh, &params, NULL, out_mesh, &report);
//!     if (status == SRF_OK) printf("parts: %u\n", (unsigned)report.parts);
//!     return status;
//! }
//!
//! /* The first part of it, by itself. */
//! static srf_status first_part(const srf_mesh *prepared, srf_mesh **out_mesh)
//! {
//!     return srf_mesh_part(prepared, 0, out_mesh);
//! }
//! ```

use surfrecon::printing;
use surfrecon::reports::Report as _;

use crate::guard::guard;
use crate::handle;
use crate::mesh::srf_mesh;
use crate::params::prepare_print::srf_prepare_print_params;
use crate::progress::{srf_progress, watched};
use crate::reports::prepare_print::srf_prepare_print_report;
use crate::status::{Failure, srf_status};
use crate::{params, pointer, report, sized};

/// Makes a closed mesh ready for printing, by the steps whose parameters are given. The attribute added of the triangles marks those that
/// were made up. If the mesh was cut into parts, the attribute part has the number of the part of each triangle, counted from 0.
/// mesh        closed, an oriented manifold, without crossings. Not NULL
/// params      NULL for the defaults, which change nothing
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only. Not NULL
/// out_report  initialized by srf_prepare_print_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for a mesh that is not closed, crosses itself or is inside out,
///             SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_prepare_print(
    mesh: *const srf_mesh,
    params: *const srf_prepare_print_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_prepare_print_report,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let params = params::read("params", params)?;
        let mesh = handle::get("mesh", mesh)?;
        let made = watched(progress, |progress| Ok(printing::prepare_print(&mesh.mesh, &params, progress)?))?;
        if !out_report.is_null() {
            report::write("out_report", out_report, made.report.values())?;
        }
        handle::give("out_mesh", out_mesh, made.mesh.into())
    })
}

/// The triangles of a mesh whose attribute part has a number, as a mesh with all attributes: a part that a printer holds.
/// mesh      made by srf_mesh_prepare_print(). Not NULL
/// number    of the part, counted from 0. The report has their count
/// out_mesh  receives a new handle on SRF_OK only. Not NULL
/// returns   SRF_OK, SRF_ERR_INPUT for a mesh that has no such part, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_part(
    mesh: *const srf_mesh,
    number: usize,
    out_mesh: *mut *mut srf_mesh,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        let mesh = handle::get("mesh", mesh)?;
        let Some(part) = printing::part(&mesh.mesh, number) else {
            return Err(Failure::new(
                srf_status::SRF_ERR_INPUT,
                format!(
                    "number is {number}, but the mesh has no such part: parts are made by srf_mesh_prepare_print(), if the printer's size is given"
                ),
            ));
        };
        handle::give("out_mesh", out_mesh, part.into())
    })
}
