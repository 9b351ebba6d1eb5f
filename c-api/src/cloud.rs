//! Points without connectivity.

use glam::DVec3;
use surfrecon::PointCloud;

use crate::array::{self, Borrowed, srf_array};
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::pointer;
use crate::pose::{self, srf_pose};
use crate::status::{Failure, srf_status, srf_status::*};

/// Scattered points with optional normals and colours, and a place in the world. Released with srf_cloud_free().
#[allow(non_camel_case_types)]
pub struct srf_cloud {
    _opaque: [u8; 0],
}

handle!(srf_cloud, PointCloud);

fn one_a_point(name: &str, count: usize, points: usize) -> Result<(), Failure> {
    if count == points {
        return Ok(());
    }
    Err(Failure::new(SRF_ERR_INPUT, format!("{name} has {count} entries for {points} points: give one each")))
}

/// Makes a cloud.
/// positions         3 SRF_TYPE_F64 or SRF_TYPE_F32 per point. Those that are not finite are left out of surfaces and counted. Not NULL
/// normals           3 SRF_TYPE_F32 or SRF_TYPE_F64 per point, of unit length. NULL for none
/// colours           4 SRF_TYPE_U8 per point, sRGB with straight alpha. NULL for none
/// intensities       one SRF_TYPE_F32 or SRF_TYPE_F64 per point, in the sensor's own unit. NULL for none
/// world_from_cloud  NULL for the identity
/// out_cloud         receives a new handle on SRF_OK only. Not NULL
/// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT naming the element, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_create(
    positions: *const srf_array,
    normals: *const srf_array,
    colours: *const srf_array,
    intensities: *const srf_array,
    world_from_cloud: *const srf_pose,
    out_cloud: *mut *mut srf_cloud,
) -> srf_status {
    guard(|| {
        pointer::writable("out_cloud", out_cloud)?;
        let positions = Borrowed::new("positions", positions, 3)?.points()?;
        let normals = Borrowed::optional("normals", normals, 3)?.map(|n| n.points_f32()).transpose()?;
        let colour = Borrowed::optional("colours", colours, 4)?.map(|c| c.colours()).transpose()?;
        let intensity = Borrowed::optional("intensities", intensities, 1)?.map(|i| i.values_f32()).transpose()?;
        let counts = [
            ("normals", normals.as_ref().map(Vec::len)),
            ("colours", colour.as_ref().map(Vec::len)),
            ("intensities", intensity.as_ref().map(Vec::len)),
        ];
        for (name, count) in counts {
            one_a_point(name, count.unwrap_or(positions.len()), positions.len())?;
        }
        let world_from_cloud = pose::read("world_from_cloud", world_from_cloud)?;
        let cloud = PointCloud { positions, normals, colour, intensity, sensor: None, world_from_cloud, crs: None };
        handle::give("out_cloud", out_cloud, cloud)
    })
}

/// Releases a cloud. Views of it are gone.
/// cloud      NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_free(cloud: *mut srf_cloud) -> srf_status {
    guard(|| handle::free("cloud", cloud))
}

/// Views of a cloud's arrays. Those it does not have are empty.
/// cloud            not NULL
/// out_positions    3 SRF_TYPE_F64 per point. NULL if not wanted
/// out_normals      3 SRF_TYPE_F32 per point. NULL if not wanted
/// out_colours      4 SRF_TYPE_U8 per point. NULL if not wanted
/// out_intensities  one SRF_TYPE_F32 per point. NULL if not wanted
/// returns          SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_arrays(
    cloud: *const srf_cloud,
    out_positions: *mut srf_array,
    out_normals: *mut srf_array,
    out_colours: *mut srf_array,
    out_intensities: *mut srf_array,
) -> srf_status {
    guard(|| {
        let cloud = handle::get("cloud", cloud)?;
        let give =
            |name, out: *mut srf_array, view| if out.is_null() { Ok(()) } else { pointer::write(name, out, view) };
        give("out_positions", out_positions, array::points(&cloud.positions))?;
        give("out_normals", out_normals, array::points_f32(cloud.normals.as_deref().unwrap_or_default()))?;
        give("out_colours", out_colours, array::colours(cloud.colour.as_deref().unwrap_or_default()))?;
        give("out_intensities", out_intensities, array::values_f32(cloud.intensity.as_deref().unwrap_or_default()))
    })
}

/// The place that all points of a cloud were seen from, in its own frame. It is known of clouds of range images whose rays start at one
/// place, and from files that say it. A VIEWPOINT of a PCD file at the origin says nothing, since it stands there if nobody set it.
/// srf_reconstructor_create() heeds it.
/// cloud       not NULL
/// out_sensor  room for 3 doubles: the place, or three NaN where it is not known. Not NULL
/// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_sensor(cloud: *const srf_cloud, out_sensor: *mut f64) -> srf_status {
    guard(|| {
        let sensor = handle::get("cloud", cloud)?.sensor.unwrap_or(DVec3::NAN);
        pointer::copy_out("out_sensor", out_sensor, &sensor.to_array())
    })
}

/// The pose of a cloud in the world.
/// cloud      not NULL
/// out_pose   receives world_from_cloud on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_pose(cloud: *const srf_cloud, out_pose: *mut srf_pose) -> srf_status {
    guard(|| pointer::write("out_pose", out_pose, pose::pose(handle::get("cloud", cloud)?.world_from_cloud)))
}
