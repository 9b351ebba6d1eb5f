//! Range images.

use std::ffi::{CString, c_char};

use glam::DVec3;
use surfrecon::range_image::{DepthKind, Projection, RangeImage, Samples, Viewing};
use surfrecon::triangulate;

use crate::array::{self, Borrowed, srf_array};
use crate::cloud::srf_cloud;
use crate::guard::guard;
use crate::handle::{self, handle};
use crate::mesh::srf_mesh;
use crate::params::triangulate::srf_triangulate_params;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::status::{Failure, of_number, srf_status, srf_status::*};
use crate::text::c_text;
use crate::{params, pointer};

/// A range image of the library with its name as C wants it.
#[derive(Clone)]
pub struct Image {
    pub image: RangeImage,
    name: CString,
}

impl From<RangeImage> for Image {
    fn from(image: RangeImage) -> Self {
        Image { name: c_text(&image.name), image }
    }
}

/// A range image: rows x cols pixels, row after row, each valid or not, each with a viewing ray, placed in the world.
/// Released with srf_image_free().
#[allow(non_camel_case_types)]
pub struct srf_image {
    _opaque: [u8; 0],
}

handle!(srf_image, Image);

/// Kinds of projection: how pixels see.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_projection_kind {
    /// Rays along -z. The value is z. numbers: x and y of pixel (0, 0), x from column to column, y from row to row.
    SRF_PROJECTION_ORTHOGRAPHIC = 1,
    /// Rays from the origin through ((col - cx) / fx, (row - cy) / fy, 1). The value is z. numbers: fx, fy, cx, cy in pixels.
    SRF_PROJECTION_PINHOLE_DEPTH = 2,
    /// The same, the value is the distance along the ray.
    SRF_PROJECTION_PINHOLE_RANGE = 3,
    /// Rays from the origin. The value is the distance along the ray. numbers: azimuth (from +x toward +y) and elevation (from the horizon
    /// toward +z) of pixel (0, 0), azimuth from column to column, elevation from row to row, in radians.
    SRF_PROJECTION_SPHERICAL = 4,
    /// A point a pixel, seen along parallel rays. numbers: x, y, z of their direction, toward the scene.
    SRF_PROJECTION_GRID_PARALLEL = 5,
    /// A point a pixel, seen from one place. numbers: x, y, z of it.
    SRF_PROJECTION_GRID_FROM = 6,
}

use srf_projection_kind::*;

/// Projection of an image: how its pixels see, in the sensor's frame.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_projection {
    /// A value of srf_projection_kind.
    pub kind: u32,
    /// 0.
    pub reserved: u32,
    /// Their meaning is said with the kind. Those it does not name are 0. srf_projection_pinhole() and the functions beside it fill them.
    pub numbers: [f64; 4],
}

impl srf_projection {
    pub fn to_core(self) -> Result<Projection, Failure> {
        let [a, b, c, d] = self.numbers;
        let projection = match self.kind {
            k if k == SRF_PROJECTION_ORTHOGRAPHIC as u32 => Projection::Orthographic { first: [a, b], step: [c, d] },
            k if k == SRF_PROJECTION_PINHOLE_DEPTH as u32 => {
                Projection::Pinhole { focal: [a, b], centre: [c, d], depth: DepthKind::Planar }
            }
            k if k == SRF_PROJECTION_PINHOLE_RANGE as u32 => {
                Projection::Pinhole { focal: [a, b], centre: [c, d], depth: DepthKind::Ray }
            }
            k if k == SRF_PROJECTION_SPHERICAL as u32 => Projection::Spherical { first: [a, b], step: [c, d] },
            k if k == SRF_PROJECTION_GRID_PARALLEL as u32 => {
                Projection::PointGrid(Viewing::Parallel(DVec3::new(a, b, c)))
            }
            k if k == SRF_PROJECTION_GRID_FROM as u32 => Projection::PointGrid(Viewing::From(DVec3::new(a, b, c))),
            other => {
                let text = format!("projection.kind must be a value of srf_projection_kind, 1 to 6, got {other}");
                return Err(Failure::new(SRF_ERR_PARAMETER, text));
            }
        };
        projection.validate().map_err(of_number)?;
        Ok(projection)
    }

    pub fn from_core(projection: &Projection) -> Self {
        let (kind, numbers) = match *projection {
            Projection::Orthographic { first: [a, b], step: [c, d] } => (SRF_PROJECTION_ORTHOGRAPHIC, [a, b, c, d]),
            Projection::Pinhole { focal: [a, b], centre: [c, d], depth } => (
                if depth == DepthKind::Ray { SRF_PROJECTION_PINHOLE_RANGE } else { SRF_PROJECTION_PINHOLE_DEPTH },
                [a, b, c, d],
            ),
            Projection::Spherical { first: [a, b], step: [c, d] } => (SRF_PROJECTION_SPHERICAL, [a, b, c, d]),
            Projection::PointGrid(Viewing::Parallel(v)) => (SRF_PROJECTION_GRID_PARALLEL, [v.x, v.y, v.z, 0.0]),
            Projection::PointGrid(Viewing::From(v)) => (SRF_PROJECTION_GRID_FROM, [v.x, v.y, v.z, 0.0]),
        };
        srf_projection { kind: kind as u32, reserved: 0, numbers }
    }
}

/// Makes a range image.
/// rows, cols         size of the image
/// projection         how pixels see. Not NULL
/// samples            rows * cols elements, row after row: for a grid 3 SRF_TYPE_F32 or SRF_TYPE_F64 (kept in single precision), for the
///                    other kinds one SRF_TYPE_F64 or SRF_TYPE_F32. A number that is not finite makes its pixel invalid. Not NULL
/// world_from_sensor  a rotation and a translation. NULL for the identity
/// name               for messages and as what ties are broken by when merging, UTF-8. NULL for none
/// out_image          receives a new handle on SRF_OK only. Not NULL
/// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_create(
    rows: usize,
    cols: usize,
    projection: *const srf_projection,
    samples: *const srf_array,
    world_from_sensor: *const srf_pose,
    name: *const c_char,
    out_image: *mut *mut srf_image,
) -> srf_status {
    guard(|| {
        pointer::writable("out_image", out_image)?;
        let projection = pointer::read("projection", projection)?.to_core()?;
        let mut image = match projection {
            Projection::PointGrid(viewing) => {
                RangeImage::from_points(rows, cols, Borrowed::new("samples", samples, 3)?.points_f32()?, viewing)
            }
            _ => RangeImage::from_values(rows, cols, Borrowed::new("samples", samples, 1)?.values()?, projection),
        }?;
        image.world_from_sensor = pose::read_rigid("world_from_sensor", world_from_sensor)?;
        if !name.is_null() {
            image.name = pointer::text("name", name)?.to_owned();
        }
        image.leave_out_what_is_no_measurement();
        handle::give("out_image", out_image, image.into())
    })
}

/// Releases an image. Views of it are gone.
/// image      NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_free(image: *mut srf_image) -> srf_status {
    guard(|| handle::free("image", image))
}

/// Size of an image.
/// image      not NULL
/// out_rows   NULL if not wanted
/// out_cols   NULL if not wanted
/// out_valid  receives the number of valid pixels. NULL if not wanted
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_size(
    image: *const srf_image,
    out_rows: *mut usize,
    out_cols: *mut usize,
    out_valid: *mut usize,
) -> srf_status {
    guard(|| {
        let image = &handle::get("image", image)?.image;
        let give = |name, out: *mut usize, value| if out.is_null() { Ok(()) } else { pointer::write(name, out, value) };
        give("out_rows", out_rows, image.rows())?;
        give("out_cols", out_cols, image.cols())?;
        give("out_valid", out_valid, if out_valid.is_null() { 0 } else { image.valid_count() })
    })
}

/// Name of an image.
/// image      not NULL
/// out_name   receives a text that stays until the image is freed or changed, on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_name(image: *const srf_image, out_name: *mut *const c_char) -> srf_status {
    guard(|| pointer::write("out_name", out_name, handle::get("image", image)?.name.as_ptr()))
}

/// Projection of an image's pixels, and the place of its sensor.
/// image           not NULL
/// out_projection  NULL if not wanted
/// out_pose        receives world_from_sensor. NULL if not wanted
/// returns         SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_camera(
    image: *const srf_image,
    out_projection: *mut srf_projection,
    out_pose: *mut srf_pose,
) -> srf_status {
    guard(|| {
        let image = &handle::get("image", image)?.image;
        if !out_projection.is_null() {
            pointer::write("out_projection", out_projection, srf_projection::from_core(image.projection()))?;
        }
        if out_pose.is_null() {
            Ok(())
        } else {
            pointer::write("out_pose", out_pose, pose::pose(image.world_from_sensor))
        }
    })
}

/// A view of the samples, row after row: 3 SRF_TYPE_F32 per pixel for a grid, else one SRF_TYPE_F64. NaN: an invalid pixel.
/// image        not NULL
/// out_samples  receives the view on SRF_OK only. Not NULL
/// returns      SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_samples(image: *const srf_image, out_samples: *mut srf_array) -> srf_status {
    guard(|| {
        let view = match handle::get("image", image)?.image.samples() {
            Samples::Values(values) => array::values(values),
            Samples::Points(points) => array::points_f32(points),
        };
        pointer::write("out_samples", out_samples, view)
    })
}

/// Copies the measured points in the world, 3 doubles per pixel, row after row. NaN for an invalid pixel.
/// image        not NULL
/// out_points   room for 3 * rows * cols doubles. Not NULL
/// capacity     that room, in doubles
/// progress     NULL for none
/// returns      SRF_OK, SRF_ERR_PARAMETER if there is too little room, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_world_points(
    image: *const srf_image,
    out_points: *mut f64,
    capacity: usize,
    progress: *const srf_progress,
) -> srf_status {
    guard(|| {
        let image = &handle::get("image", image)?.image;
        if capacity < 3 * image.len() {
            let text = format!("capacity must be >= {}, got {capacity} (in doubles)", 3 * image.len());
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        }
        watched(progress, |progress| {
            let points = progress.watch(|| {
                let mut points: Vec<[f64; 3]> = Vec::with_capacity(image.len());
                for range in progress.ranges(image.len()) {
                    points.extend(range?.map(|i| image.point_in_world(i).to_array()));
                }
                Ok(points)
            })?;
            pointer::copy_out("out_points", out_points, bytemuck::cast_slice::<[f64; 3], f64>(&points))
        })
    })
}

/// The viewing ray of a pixel in the sensor's frame: a point on it and its unit direction toward the scene. NaN for an invalid pixel of a
/// grid.
/// image          not NULL
/// row, col       a pixel of the image
/// out_origin     room for 3 doubles. Not NULL
/// out_direction  room for 3 doubles. Not NULL
/// returns        SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_ray(
    image: *const srf_image,
    row: usize,
    col: usize,
    out_origin: *mut f64,
    out_direction: *mut f64,
) -> srf_status {
    guard(|| {
        let image = &handle::get("image", image)?.image;
        if row >= image.rows() || col >= image.cols() {
            let (rows, cols) = (image.rows(), image.cols());
            let text = format!("row must be < {rows} and col < {cols}, got ({row}, {col})");
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        }
        pointer::writable("out_direction", out_direction)?;
        let (origin, direction) = image.ray_in_sensor(row * image.cols() + col);
        pointer::copy_out("out_origin", out_origin, &origin.to_array())?;
        pointer::copy_out("out_direction", out_direction, &direction.to_array())
    })
}

/// Places the sensor in the world. Views of the image are gone.
/// image              not NULL
/// world_from_sensor  a rotation and a translation. NULL for the identity
/// returns            SRF_OK, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_set_pose(image: *mut srf_image, world_from_sensor: *const srf_pose) -> srf_status {
    guard(|| {
        let world_from_sensor = pose::read_rigid("world_from_sensor", world_from_sensor)?;
        handle::change("image", image.cast_const(), |image| {
            image.image.world_from_sensor = world_from_sensor;
            Ok(())
        })
    })
}

/// Names an image: for messages, as what ties are broken by when merging, and for the files of srf_images_write_conf().
/// Views of the image are gone.
/// image      not NULL
/// name       UTF-8. NULL for none
/// returns    SRF_OK, SRF_ERR_INPUT for text that is not UTF-8, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_set_name(image: *mut srf_image, name: *const c_char) -> srf_status {
    guard(|| {
        let name = if name.is_null() { String::new() } else { pointer::text("name", name)?.to_owned() };
        handle::change("image", image.cast_const(), |image| {
            image.name = CString::new(name.as_str()).unwrap_or_default();
            image.image.name = name;
            Ok(())
        })
    })
}

/// Sets what pixels have besides their samples, in place of what was there. NULL removes it. Views of the image are gone.
/// image        not NULL
/// colours      4 SRF_TYPE_U8 per pixel, sRGB with straight alpha
/// intensities  one SRF_TYPE_F32 or SRF_TYPE_F64 per pixel, in the sensor's own unit
/// confidences  one SRF_TYPE_F32 or SRF_TYPE_F64 per pixel, >= 0. Without them they follow from the geometry
/// returns      SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT naming the pixel, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_set_attributes(
    image: *mut srf_image,
    colours: *const srf_array,
    intensities: *const srf_array,
    confidences: *const srf_array,
) -> srf_status {
    guard(|| {
        let colour = Borrowed::optional("colours", colours, 4)?.map(|a| a.colours()).transpose()?;
        let intensity = Borrowed::optional("intensities", intensities, 1)?.map(|a| a.values_f32()).transpose()?;
        let confidence = Borrowed::optional("confidences", confidences, 1)?.map(|a| a.values_f32()).transpose()?;
        handle::change("image", image.cast_const(), |image| {
            let before = &mut image.image;
            let old = (before.colour.take(), before.intensity.take(), before.confidence.take());
            (before.colour, before.intensity, before.confidence) = (colour, intensity, confidence);
            before.validate().inspect_err(|_| {
                (before.colour, before.intensity, before.confidence) = old;
            })?;
            Ok(())
        })
    })
}

/// Views of attributes of pixels besides their samples. Those that an image does not have are empty.
/// image            not NULL
/// out_colours      4 SRF_TYPE_U8 per pixel. NULL if not wanted
/// out_intensities  one SRF_TYPE_F32 per pixel. NULL if not wanted
/// out_confidences  one SRF_TYPE_F32 per pixel. NULL if not wanted
/// returns          SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_attributes(
    image: *const srf_image,
    out_colours: *mut srf_array,
    out_intensities: *mut srf_array,
    out_confidences: *mut srf_array,
) -> srf_status {
    guard(|| {
        let image = handle::get("image", image)?;
        let image = &image.image;
        let give =
            |name, out: *mut srf_array, view| if out.is_null() { Ok(()) } else { pointer::write(name, out, view) };
        give("out_colours", out_colours, array::colours(image.colour.as_deref().unwrap_or_default()))?;
        give("out_intensities", out_intensities, array::values_f32(image.intensity.as_deref().unwrap_or_default()))?;
        give("out_confidences", out_confidences, array::values_f32(image.confidence.as_deref().unwrap_or_default()))
    })
}

/// Triangulates the pixels of an image, leaving out jumps, in the sensor's frame. The mesh has the vertex attributes
/// range_row, range_col, colour and intensity where the image has them, and confidence. SRF_ERR_INPUT where it would have no
/// triangle. O(pixels).
/// image      not NULL
/// params     NULL for the defaults
/// progress   NULL for none
/// out_mesh   receives a new handle on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE.
///            Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_triangulate(
    image: *const srf_image,
    params: *const srf_triangulate_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        let params = params::read("params", params)?;
        let image = handle::get("image", image)?;
        let image = &image.image;
        watched(progress, |progress| {
            let mesh = triangulate::triangulate(image, &params, progress)?.into_mesh(image, progress)?;
            handle::give("out_mesh", out_mesh, mesh.into())
        })
    })
}

/// The place in the world where the rays of an image start.
/// image       not NULL
/// out_sensor  room for 3 doubles: the place, or three NaN where rays are parallel. Not NULL
/// returns     SRF_OK, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_sensor(image: *const srf_image, out_sensor: *mut f64) -> srf_status {
    guard(|| {
        let sensor = handle::get("image", image)?.image.sensor().unwrap_or(DVec3::NAN);
        pointer::copy_out("out_sensor", out_sensor, &sensor.to_array())
    })
}

/// The valid pixels of an image as points, with normals, the image's colours and place in the world, and where its rays start. O(pixels).
/// image      not NULL
/// progress   NULL for none
/// out_cloud  receives a new handle on SRF_OK only. Not NULL
/// returns    SRF_OK, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_to_cloud(
    image: *const srf_image,
    progress: *const srf_progress,
    out_cloud: *mut *mut srf_cloud,
) -> srf_status {
    guard(|| {
        pointer::writable("out_cloud", out_cloud)?;
        watched(progress, |progress| {
            let cloud = handle::get("image", image)?.image.to_point_cloud(progress)?;
            handle::give("out_cloud", out_cloud, cloud)
        })
    })
}
