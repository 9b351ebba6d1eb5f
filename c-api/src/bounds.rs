//! Extent of content: its amount, where it lies, and its places in single precision.

use glam::DVec3;
use surfrecon::Progress;

use crate::cloud::srf_cloud;
use crate::guard::guard;
use crate::image::srf_image;
use crate::mesh::srf_mesh;
use crate::progress::{srf_progress, watched};
use crate::status::{Failure, srf_status, srf_status::*};
use crate::{handle, pointer};

/// The corners of the box around `count` points. Those that are not finite are passed over.
fn around(
    count: usize,
    point: impl Fn(usize) -> DVec3 + Sync,
    progress: &Progress<'_>,
) -> surfrecon::Result<Option<[DVec3; 2]>> {
    progress.watch(|| {
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for range in progress.ranges(count) {
            for point in range?.map(&point).filter(|point| point.is_finite()) {
                (least, most) = (least.min(point), most.max(point));
            }
        }
        Ok((least.x <= most.x).then_some([least, most]))
    })
}

fn give(found: Option<[DVec3; 2]>, out: [*mut f64; 2], nothing: &str) -> Result<(), Failure> {
    let [least, most] = found.ok_or_else(|| Failure::new(SRF_ERR_INPUT, nothing))?;
    pointer::copy_out("out_min", out[0], &least.to_array())?;
    pointer::copy_out("out_max", out[1], &most.to_array())
}

/// Numbers of vertices and triangles of a mesh.
/// mesh           not NULL
/// out_vertices   NULL if not wanted
/// out_triangles  NULL if not wanted
/// returns        SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_size(
    mesh: *const srf_mesh,
    out_vertices: *mut usize,
    out_triangles: *mut usize,
) -> srf_status {
    guard(|| {
        let mesh = &handle::get("mesh", mesh)?.mesh;
        let give = |name, out: *mut usize, value| if out.is_null() { Ok(()) } else { pointer::write(name, out, value) };
        give("out_vertices", out_vertices, mesh.positions.len())?;
        give("out_triangles", out_triangles, mesh.triangles.len())
    })
}

/// Number of points of a cloud.
/// cloud        not NULL
/// out_points   receives the number on SRF_OK only. Not NULL
/// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_size(cloud: *const srf_cloud, out_points: *mut usize) -> srf_status {
    guard(|| pointer::write("out_points", out_points, handle::get("cloud", cloud)?.positions.len()))
}

/// The box around the vertices of a mesh, whether a triangle uses them or not. O(vertices).
/// mesh       not NULL
/// progress   NULL for none
/// out_min    room for 3 doubles, the smallest coordinates. Not NULL
/// out_max    room for 3 doubles, the largest ones. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT if there is no vertex, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_bounds(
    mesh: *const srf_mesh,
    progress: *const srf_progress,
    out_min: *mut f64,
    out_max: *mut f64,
) -> srf_status {
    guard(|| {
        let positions = &handle::get("mesh", mesh)?.mesh.positions;
        pointer::writable("out_min", out_min)?;
        pointer::writable("out_max", out_max)?;
        watched(progress, |progress| {
            let found = around(positions.len(), |i| positions[i], progress)?;
            give(found, [out_min, out_max], "the mesh has no vertex")
        })
    })
}

/// The box around the points of a cloud in the world. Those that are not finite are passed over. O(points).
/// cloud      not NULL
/// progress   NULL for none
/// out_min    room for 3 doubles, the smallest coordinates. Not NULL
/// out_max    room for 3 doubles, the largest ones. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT if there is no point, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_bounds(
    cloud: *const srf_cloud,
    progress: *const srf_progress,
    out_min: *mut f64,
    out_max: *mut f64,
) -> srf_status {
    guard(|| {
        let cloud = handle::get("cloud", cloud)?;
        pointer::writable("out_min", out_min)?;
        pointer::writable("out_max", out_max)?;
        let in_world = |i: usize| cloud.world_from_cloud.transform_point3(cloud.positions[i]);
        watched(progress, |progress| {
            let found = around(cloud.positions.len(), in_world, progress)?;
            give(found, [out_min, out_max], "the cloud has no point whose coordinates are finite")
        })
    })
}

/// The box around the samples of an image in the world. O(pixels).
/// image      not NULL
/// progress   NULL for none
/// out_min    room for 3 doubles, the smallest coordinates. Not NULL
/// out_max    room for 3 doubles, the largest ones. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT if no pixel is valid, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_bounds(
    image: *const srf_image,
    progress: *const srf_progress,
    out_min: *mut f64,
    out_max: *mut f64,
) -> srf_status {
    guard(|| {
        let image = &handle::get("image", image)?.image;
        pointer::writable("out_min", out_min)?;
        pointer::writable("out_max", out_max)?;
        watched(progress, |progress| {
            let found = around(image.len(), |i| image.point_in_world(i), progress)?;
            give(found, [out_min, out_max], "the image has no valid pixel")
        })
    })
}

/// Copies positions without `origin`, in single precision.
fn near(
    positions: &[DVec3],
    origin: *const f64,
    out: *mut f32,
    capacity: usize,
    progress: *const srf_progress,
    what: &str,
) -> Result<(), Failure> {
    if capacity < 3 * positions.len() {
        let text = format!("capacity must be >= {}, got {capacity} (in floats)", 3 * positions.len());
        return Err(Failure::new(SRF_ERR_PARAMETER, text));
    }
    let origin = match origin.is_null() {
        true => DVec3::ZERO,
        false => DVec3::from_array(pointer::read("origin", origin.cast::<[f64; 3]>())?),
    };
    if !origin.is_finite() {
        return Err(Failure::new(SRF_ERR_PARAMETER, "origin must be finite"));
    }
    watched(progress, |progress| {
        let near = progress.watch(|| {
            let mut near: Vec<[f32; 3]> = Vec::with_capacity(positions.len());
            for range in progress.ranges(positions.len()) {
                for i in range? {
                    let point = (positions[i] - origin).as_vec3();
                    if !point.is_finite() && positions[i].is_finite() {
                        let text = format!("{what} {i} is farther from origin than single precision can hold");
                        return Err(surfrecon::Error::input(text));
                    }
                    near.push(point.to_array());
                }
            }
            Ok(near)
        })?;
        pointer::copy_out("out_positions", out, bytemuck::cast_slice::<[f32; 3], f32>(&near))
    })
}

/// Copies the positions of a mesh in single precision, as vertices of graphics have them: 3 floats per vertex, relative to an origin. So
/// coordinates far from 0 keep their digits.
/// mesh           not NULL
/// origin         3 doubles that are taken off before rounding, for example the middle of srf_mesh_bounds(). NULL for 0 0 0
/// out_positions  room for 3 floats per vertex. Not NULL
/// capacity       that room, in floats
/// progress       NULL for none
/// returns        SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_INPUT naming a vertex that lies too far off,
///                SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_mesh_positions_f32(
    mesh: *const srf_mesh,
    origin: *const f64,
    out_positions: *mut f32,
    capacity: usize,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let mesh = handle::get("mesh", mesh)?;
        near(&mesh.mesh.positions, origin, out_positions, capacity, progress, "vertex")
    })
}

/// srf_mesh_positions_f32() for the points of a cloud, in its own frame. Those that are not finite stay so.
/// cloud          not NULL
/// origin         3 doubles that are taken off before rounding. NULL for 0 0 0
/// out_positions  room for 3 floats per point. Not NULL
/// capacity       that room, in floats
/// progress       NULL for none
/// returns        SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_INPUT naming a point that lies too far off,
///                SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cloud_positions_f32(
    cloud: *const srf_cloud,
    origin: *const f64,
    out_positions: *mut f32,
    capacity: usize,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let cloud = handle::get("cloud", cloud)?;
        near(&cloud.positions, origin, out_positions, capacity, progress, "point")
    })
}
