//! Photos whose cameras are known.

use std::ffi::c_char;
use std::sync::Arc;

use surfrecon::frame::Camera;
use surfrecon::photo::{self, Depths, PhotoInMemory, Pixels};
use surfrecon::range_image::{DepthKind, Projection};

use crate::array::{Borrowed, Rows, srf_array};
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::image::srf_projection;
use crate::pointer;
use crate::pose::{self, srf_pose};
use crate::status::{Failure, srf_status, srf_status::*};

/// A photo, wherever its pixels lie.
pub type AnyPhoto = Arc<dyn photo::Photo + Send + Sync>;

/// A photo whose camera is known. Released with srf_photo_free().
#[allow(non_camel_case_types)]
pub struct srf_photo {
    _opaque: [u8; 0],
}

handle!(srf_photo, AnyPhoto);

/// Makes a photo of pixels in memory, which are copied.
/// rows, cols         size of the photo
/// projection         its camera, without distortion, of SRF_PROJECTION_PINHOLE_DEPTH: see srf_projection_pinhole(). Not NULL
/// pixels             3 or 4 SRF_TYPE_U8 a pixel, sRGB, row after row from the upper left. Of 4 the last is passed over. Not NULL
/// world_from_camera  places the camera, which looks along z, with x to the right and y down: a rotation and a translation. NULL for the
///                    identity
/// name               for reports, UTF-8. Photos that are used together have different names. Not NULL
/// depth_rows         rows of the depths. 0 without depths
/// depth_cols         their columns. 0 without depths
/// depths             one SRF_TYPE_F32 or SRF_TYPE_F64 a pixel of an image of the same view: what the camera measured along z, in the unit of
///                    the mesh. 0 or NaN where nothing was measured. NULL for none
/// out_photo          receives a new handle on SRF_OK only. Not NULL
/// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_photo_create(
    rows: usize,
    cols: usize,
    projection: *const srf_projection,
    pixels: *const srf_array,
    world_from_camera: *const srf_pose,
    name: *const c_char,
    depth_rows: usize,
    depth_cols: usize,
    depths: *const srf_array,
    out_photo: *mut *mut srf_photo,
) -> srf_status {
    guard(|| {
        pointer::writable("out_photo", out_photo)?;
        let photo = PhotoInMemory {
            name: pointer::text("name", name)?.to_owned(),
            camera: camera(rows, cols, projection)?,
            world_from_camera: pose::read_rigid("world_from_camera", world_from_camera)?,
            pixels: Pixels {
                size: [cols, rows],
                colours: Borrowed::opaque_image("pixels", pixels, Rows { rows, cols, stride: 0 })?,
            },
            depths: measured(depth_rows, depth_cols, depths)?,
        };
        photo::check(&photo)?;
        photo::depths(&photo)?;
        handle::give("out_photo", out_photo, Arc::new(photo))
    })
}

/// Releases a photo. A call that works with it on another thread goes on.
/// photo      NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_photo_free(photo: *mut srf_photo) -> srf_status {
    guard(|| handle::free("photo", photo))
}

fn camera(rows: usize, cols: usize, projection: *const srf_projection) -> Result<Camera, Failure> {
    match pointer::read("projection", projection)?.to_core()? {
        Projection::Pinhole { focal, centre, depth: DepthKind::Planar } => {
            Ok(Camera::sized(focal, centre, [cols, rows]))
        }
        _ => {
            let text = "projection.kind must be SRF_PROJECTION_PINHOLE_DEPTH (2) for a photo: fill it by srf_projection_pinhole()";
            Err(Failure::new(SRF_ERR_PARAMETER, text))
        }
    }
}

fn measured(rows: usize, cols: usize, depths: *const srf_array) -> Result<Option<Depths>, Failure> {
    if depths.is_null() {
        return Ok(None);
    }
    let values = Borrowed::image("depths", depths, 1, Rows { rows, cols, stride: 0 })?.values_f32()?;
    Ok(Some(Depths { size: [cols, rows], values }))
}
