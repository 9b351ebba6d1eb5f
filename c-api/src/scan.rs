//! The virtual range scanner.

use surfrecon::geom::bvh::Bvh;
use surfrecon::scan::{self, ScanParams, VirtualCamera};

use crate::guard::guard;
use crate::handle;
use crate::image::{srf_image, srf_projection};
use crate::mesh::srf_mesh;
use crate::params::scan::srf_scan_params;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::status::srf_status;
use crate::{params, pointer};

/// Scans a mesh: a value for every pixel whose ray meets it. The same image for any number of threads. If the mesh has the vertex attribute
/// colour, the image has colours.
/// mesh               not NULL
/// rows, cols         size of the image
/// projection         how pixels see, no grid. Not NULL
/// world_from_sensor  where the sensor stands: a rotation and a translation. NULL for the identity
/// params             NULL for the defaults
/// progress           NULL for none
/// out_image          receives a new handle on SRF_OK only. Not NULL
/// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///                    SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scan_mesh(
    mesh: *const srf_mesh,
    rows: usize,
    cols: usize,
    projection: *const srf_projection,
    world_from_sensor: *const srf_pose,
    params: *const srf_scan_params,
    progress: *const srf_progress,
    out_image: *mut *mut srf_image,
) -> srf_status {
    guard(|| {
        pointer::writable("out_image", out_image)?;
        let mesh = handle::get("mesh", mesh)?;
        let params = params::read::<ScanParams, _>("params", params)?;
        let projection = pointer::read("projection", projection)?.to_core()?;
        let world_from_sensor = pose::read_rigid("world_from_sensor", world_from_sensor)?;
        let camera = VirtualCamera { rows, cols, projection, world_from_sensor };
        watched(progress, |progress| {
            let bvh = Bvh::build_with(&mesh.mesh.positions, &mesh.mesh.triangles, params.threads, progress)?;
            let image = scan::scan(&mesh.mesh, &bvh, &camera, &params, progress)?;
            handle::give("out_image", out_image, image.into())
        })
    })
}
