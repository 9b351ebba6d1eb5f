//! Projections by what they mean.

use surfrecon::range_image::{DepthKind, Projection, Viewing};

use crate::guard::guard;
use crate::image::srf_projection;
use crate::pointer;
use crate::region;
use crate::status::{Failure, flag, of_number, srf_status};

fn give(out_projection: *mut srf_projection, projection: Projection) -> Result<(), Failure> {
    pointer::writable("out_projection", out_projection)?;
    projection.validate().map_err(of_number)?;
    pointer::write("out_projection", out_projection, srf_projection::from_core(&projection))
}

/// Says how a depth camera sees, which looks along z with x to the right and y down.
/// fx, fy          focal lengths in pixels, across and down. Not 0
/// cx, cy          column and row of the principal point. Pixel centres lie at whole numbers
/// along_ray       0 if the values of an image are depths along z, 1 if they are distances along the rays
/// out_projection  receives it on SRF_OK only. Not NULL
/// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_projection_pinhole(
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    along_ray: u32,
    out_projection: *mut srf_projection,
) -> srf_status {
    guard(|| {
        let depth = if flag("along_ray", along_ray)? { DepthKind::Ray } else { DepthKind::Planar };
        give(out_projection, Projection::Pinhole { focal: [fx, fy], centre: [cx, cy], depth })
    })
}

/// Says that an image is a height map: rays along -z, its values are z.
/// first_x, first_y  place of pixel (0, 0)
/// step_x            x from column to column. Not 0
/// step_y            y from row to row. Below 0 where row 0 is at the top. Not 0
/// out_projection    receives it on SRF_OK only. Not NULL
/// returns           SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_projection_orthographic(
    first_x: f64,
    first_y: f64,
    step_x: f64,
    step_y: f64,
    out_projection: *mut srf_projection,
) -> srf_status {
    guard(|| give(out_projection, Projection::Orthographic { first: [first_x, first_y], step: [step_x, step_y] }))
}

/// Says how a terrestrial scanner sees: its values are distances along the rays. Angles are in radians. Azimuths turn from +x toward +y,
/// elevations from the horizon toward +z.
/// azimuth         of column 0
/// elevation       of row 0
/// azimuth_step    from column to column. Not 0
/// elevation_step  from row to row. Below 0 where row 0 is the highest. Not 0
/// out_projection  receives it on SRF_OK only. Not NULL
/// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_projection_spherical(
    azimuth: f64,
    elevation: f64,
    azimuth_step: f64,
    elevation_step: f64,
    out_projection: *mut srf_projection,
) -> srf_status {
    let projection = Projection::Spherical { first: [azimuth, elevation], step: [azimuth_step, elevation_step] };
    guard(|| give(out_projection, projection))
}

/// Says that an image has a point per pixel, seen along parallel rays.
/// direction       3 numbers of any length but 0: where the rays lead, toward the scene, in the sensor's frame. Not NULL
/// out_projection  receives it on SRF_OK only. Not NULL
/// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_projection_grid_parallel(
    direction: *const f64,
    out_projection: *mut srf_projection,
) -> srf_status {
    guard(|| {
        let direction = region::place("direction", direction)?;
        give(out_projection, Projection::PointGrid(Viewing::Parallel(direction)))
    })
}

/// Says that an image has a point per pixel, seen from one place.
/// origin          3 numbers: the place in the sensor's frame. Not NULL
/// out_projection  receives it on SRF_OK only. Not NULL
/// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_projection_grid_from(
    origin: *const f64,
    out_projection: *mut srf_projection,
) -> srf_status {
    guard(|| give(out_projection, Projection::PointGrid(Viewing::From(region::place("origin", origin)?))))
}
