//! Boxes, planes and masks that samples are kept or removed by. Also the dominant plane, true size and ground.

use std::sync::Arc;

use glam::DVec3;
use surfrecon::plane::{PlaneParams, dominant};
use surfrecon::select::{Mask, OrientedBox, Plane, Region, Similarity};

use crate::align::srf_aligner;
use crate::array::{Borrowed, srf_array};
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::params::plane::srf_plane_params;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::status::{Failure, srf_status, srf_status::*};
use crate::{params, pointer, sized, sources};

/// The region that samples are kept or removed by: a box, a plane or a mask. Released with srf_region_free().
#[allow(non_camel_case_types)]
pub struct srf_region {
    _opaque: [u8; 0],
}

handle!(srf_region, Region);

/// A plane in the world. Starts with its size. Prepared by srf_plane_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_plane {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 1 if srf_dominant_plane() found it, else 0.
    pub is_found: u32,
    /// On the plane.
    pub point: [f64; 3],
    /// Of any length but 0. It points above.
    pub normal: [f64; 3],
    /// Points that lie at most so far above the plane are removed with it.
    pub margin: f64,
    /// Of one that was found: the share of the samples that lie on it.
    pub share: f64,
    /// Of one that was found: how far these scatter about it, root mean square, in the unit of the scans.
    pub spread: f64,
}

impl srf_plane {
    fn level() -> Self {
        srf_plane { struct_size: size_of::<Self>() as u32, normal: [0.0, 0.0, 1.0], ..bytemuck::Zeroable::zeroed() }
    }

    fn of(plane: &Plane) -> Self {
        srf_plane {
            point: plane.point().to_array(),
            normal: plane.normal().to_array(),
            margin: plane.margin(),
            ..srf_plane::level()
        }
    }
}

/// Prepares a struct: the plane z = 0, above is +z, no margin. Call srf_plane_init(plane), which adds the size that this header knows.
/// plane    not NULL
/// size     sizeof(srf_plane): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_plane_init_sized(plane: *mut srf_plane, size: usize) -> srf_status {
    guard(|| sized::init("plane", plane, size, srf_plane::level()))
}

fn plane_of(plane: *const srf_plane) -> Result<Plane, Failure> {
    if plane.is_null() {
        return Err(Failure::new(SRF_ERR_NULL, "plane must not be NULL"));
    }
    let given = sized::read("plane", plane, srf_plane::level())?;
    Ok(Plane::new(given.point.into(), given.normal.into(), given.margin)?)
}

/// A place or a direction behind a pointer.
pub fn place(name: &str, numbers: *const f64) -> Result<DVec3, Failure> {
    if numbers.is_null() {
        return Err(Failure::new(SRF_ERR_NULL, format!("{name} must not be NULL")));
    }
    let numbers = pointer::numbers(name, numbers, 3)?;
    Ok(DVec3::new(numbers[0], numbers[1], numbers[2]))
}

/// The plane through three points, without a margin.
/// points     nine numbers: x, y, z of each. Not NULL
/// above      x, y, z of a place that lies above, such as the eye. NULL: above is where the points turn counter-clockwise
/// out_plane  prepared by srf_plane_init(). Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT for points on one line or a place on the plane, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_plane_through(
    points: *const f64,
    above: *const f64,
    out_plane: *mut srf_plane,
) -> srf_status {
    guard(|| {
        sized::writable("out_plane", out_plane)?;
        if points.is_null() {
            return Err(Failure::new(SRF_ERR_NULL, "points must not be NULL"));
        }
        let numbers = pointer::numbers("points", points, 9)?;
        let point = |k: usize| DVec3::new(numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]);
        let mut plane = Plane::through([point(0), point(1), point(2)])?;
        if !above.is_null() {
            plane = plane.facing(place("above", above)?)?;
        }
        sized::write("out_plane", out_plane, srf_plane::of(&plane))
    })
}

/// Finds the plane that most samples lie on: a table, a turntable, the ground. Above is the side that its samples were seen from. If that
/// is not known, it is the side that most of the others lie on. The same for any order of the scans and any number of threads.
/// aligner    one that scans were added to, one at least. They lie where they were when they were added. Clouds need no normals. Not NULL
/// params     NULL for the defaults
/// progress   NULL for none
/// out_plane  prepared by srf_plane_init(). Its margin takes along what its samples scatter by. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT where no plane stands out, with the remedy, SRF_ERR_PARAMETER, SRF_ERR_IO, SRF_ERR_FORMAT,
///            SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_dominant_plane(
    aligner: *const srf_aligner,
    params: *const srf_plane_params,
    progress: *const srf_progress,
    out_plane: *mut srf_plane,
) -> srf_status {
    guard(|| {
        let aligner = handle::get("aligner", aligner)?;
        sized::writable("out_plane", out_plane)?;
        let params: PlaneParams = params::read("params", params)?;
        watched(progress, |progress| {
            let found = dominant(&sources::borrowed(aligner.sources()), &params, progress)?;
            let plane =
                srf_plane { is_found: 1, share: found.share, spread: found.spread, ..srf_plane::of(&found.plane) };
            sized::write("out_plane", out_plane, plane)
        })
    })
}

/// A region of what lies in a box or on its sides.
/// world_from_box  the box is what the cube from -1 to 1 along each axis becomes. Skewed and mirrored ones are fine. NULL for the identity
/// out_region      receives a new handle on SRF_OK only. Not NULL
/// returns         SRF_OK, SRF_ERR_INPUT for a flat box, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_region_box(
    world_from_box: *const srf_pose,
    out_region: *mut *mut srf_region,
) -> srf_status {
    guard(|| {
        let region = OrientedBox::new(pose::read("world_from_box", world_from_box)?)?;
        handle::give("out_region", out_region, Region::Box(region))
    })
}

/// A region of what lies below a plane, on it, or at most its margin above.
/// plane       prepared by srf_plane_init(), srf_plane_through() or srf_dominant_plane(). Not NULL
/// out_region  receives a new handle on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT for a normal of length 0, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_region_below(plane: *const srf_plane, out_region: *mut *mut srf_region) -> srf_status {
    guard(|| handle::give("out_region", out_region, Region::Below(plane_of(plane)?)))
}

/// A region of the marked samples of one scan.
/// marks       one SRF_TYPE_U8 per sample, 0 for those that are not marked: pixels of an image row after row, vertices, or points. Not NULL
/// rows, cols  size of the image. 0 and 0 for meshes and clouds
/// out_region  receives a new handle on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for another number of marks than pixels, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY.
///             Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_region_mask(
    marks: *const srf_array,
    rows: usize,
    cols: usize,
    out_region: *mut *mut srf_region,
) -> srf_status {
    guard(|| {
        pointer::writable("out_region", out_region)?;
        let marks = Borrowed::new("marks", marks, 1)?.marks()?;
        let mask = if rows == 0 && cols == 0 { Mask::of_list(&marks) } else { Mask::of_image(rows, cols, &marks)? };
        handle::give("out_region", out_region, Region::Mask(Arc::new(mask)))
    })
}

/// Releases a region.
/// region     NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_region_free(region: *mut srf_region) -> srf_status {
    guard(|| handle::free("region", region))
}

/// The scale about the origin that makes two picked places lie as far apart as they truly do.
/// a, b            x, y, z of each, in the world. Not NULL
/// distance        how far apart they are, > 0, in the unit that the scans are to have
/// out_similarity  for srf_scans_transform() and the like. Not NULL
/// returns         SRF_OK, SRF_ERR_INPUT for places that are the same, SRF_ERR_PARAMETER for a distance not above 0, SRF_ERR_NULL.
///                 Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_true_size(
    a: *const f64,
    b: *const f64,
    distance: f64,
    out_similarity: *mut srf_pose,
) -> srf_status {
    guard(|| {
        let (a, b) = (place("a", a)?, place("b", b)?);
        if !(distance > 0.0 && distance.is_finite()) {
            let text = format!("distance must be a finite number > 0, got {distance}");
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        }
        let size = Similarity::true_size(a, b, distance)?;
        pointer::write("out_similarity", out_similarity, pose::pose(size.to_affine()))
    })
}

/// The least turn, and shift along `up`, that lay a plane to height 0, with what is above it above.
/// plane           as for srf_region_below(). Not NULL
/// up              x, y, z of a direction. NULL for z
/// out_similarity  for srf_scans_transform() and the like. Not NULL
/// returns         SRF_OK, SRF_ERR_INPUT for a direction or normal of length 0, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_ground(
    plane: *const srf_plane,
    up: *const f64,
    out_similarity: *mut srf_pose,
) -> srf_status {
    guard(|| {
        let up = if up.is_null() { DVec3::Z } else { place("up", up)? };
        let ground = Similarity::ground(&plane_of(plane)?, up)?;
        pointer::write("out_similarity", out_similarity, pose::pose(ground.to_affine()))
    })
}

/// The similarity behind a pointer.
pub fn similarity(name: &str, given: *const srf_pose) -> Result<Similarity, Failure> {
    if given.is_null() {
        return Err(Failure::new(SRF_ERR_NULL, format!("{name} must not be NULL")));
    }
    Ok(Similarity::from_affine(pose::read(name, given)?)?)
}
