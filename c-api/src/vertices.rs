//! Range images as hosts keep them: a mesh of a vertex a valid pixel, whatever its user does with it.

use std::ffi::c_char;

use bytemuck::Zeroable;
use glam::DVec3;
use surfrecon::vertices::{self, Anchor, GridCamera, MOST_ANCHORS, Vertices};

use crate::array::{Borrowed, srf_array};
use crate::guard::guard;
use crate::handle;
use crate::image::{srf_image, srf_projection, srf_projection_kind::SRF_PROJECTION_ORTHOGRAPHIC};
use crate::mesh::srf_mesh;
use crate::pointer;
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::sized;
use crate::status::{Failure, flag, of_number, srf_status, srf_status::*};

/// Place where a vertex of a range image was: by it a motion of all vertices is recognized.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_anchor {
    /// Its pixel's row.
    pub row: u64,
    /// Its pixel's column.
    pub col: u64,
    /// The point in the sensor's frame.
    pub point: [f64; 3],
}

/// The camera that a host keeps of a range image beside its vertices: how the pixels see, and where some of the vertices were. Numbers
/// only: it may be stored as it is. Starts with its size. Prepared by srf_grid_camera_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_grid_camera {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Number of the anchors, up to 256. With 0, the default, vertices are taken to lie in the sensor's frame.
    pub anchor_count: u32,
    /// Projection of the pixels.
    pub projection: srf_projection,
    /// Vertices far from each other.
    pub anchors: [srf_anchor; 256],
    /// Rows of the grid.
    pub rows: u64,
    /// Its columns.
    pub cols: u64,
}

// cbindgen and what reads headers know numbers only.
const _: () = assert!(MOST_ANCHORS == 256);

impl srf_grid_camera {
    fn unset() -> Self {
        let projection =
            srf_projection { kind: SRF_PROJECTION_ORTHOGRAPHIC as u32, reserved: 0, numbers: [0.0, 0.0, 1.0, -1.0] };
        srf_grid_camera { struct_size: size_of::<Self>() as u32, projection, ..srf_grid_camera::zeroed() }
    }

    fn from_core(camera: &GridCamera) -> Self {
        let mut given = srf_grid_camera {
            anchor_count: camera.anchors.len() as u32,
            rows: camera.rows as u64,
            cols: camera.cols as u64,
            projection: srf_projection::from_core(&camera.projection),
            ..Self::unset()
        };
        for (anchor, of) in given.anchors.iter_mut().zip(&camera.anchors) {
            *anchor = srf_anchor { row: of.row as u64, col: of.col as u64, point: of.point.to_array() };
        }
        given
    }

    fn to_core(self) -> Result<GridCamera, Failure> {
        let Some(anchors) = self.anchors.get(..self.anchor_count as usize) else {
            let text = format!("camera.anchor_count must be at most {MOST_ANCHORS}, got {}", self.anchor_count);
            return Err(Failure::new(SRF_ERR_PARAMETER, text));
        };
        // On machines of 32 bits what is larger is no grid either.
        let number = |number: u64| usize::try_from(number).unwrap_or(usize::MAX);
        let anchor =
            |a: &srf_anchor| Anchor { row: number(a.row), col: number(a.col), point: DVec3::from_array(a.point) };
        let camera = GridCamera {
            rows: number(self.rows),
            cols: number(self.cols),
            projection: self.projection.to_core()?,
            anchors: anchors.iter().map(anchor).collect(),
        };
        camera.validate()?;
        Ok(camera)
    }
}

fn read(camera: *const srf_grid_camera) -> Result<GridCamera, Failure> {
    pointer::read::<u32>("camera", camera.cast())?;
    sized::read("camera", camera, srf_grid_camera::unset())?.to_core()
}

/// Prepares a struct for srf_image_grid_camera(), or to be filled in. Call srf_grid_camera_init(camera), which adds the size that
/// this header knows.
/// camera   not NULL
/// size     sizeof(srf_grid_camera): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_grid_camera_init_sized(camera: *mut srf_grid_camera, size: usize) -> srf_status {
    guard(|| sized::init("camera", camera, size, srf_grid_camera::unset()))
}

/// The camera that a host keeps beside the vertices of srf_image_to_mesh(). O(pixels).
/// image       not NULL
/// progress    NULL for none
/// out_camera  initialized by srf_grid_camera_init(), filled on SRF_OK only. Not NULL
/// returns     SRF_OK, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_grid_camera(
    image: *const srf_image,
    progress: *const srf_progress,
    out_camera: *mut srf_grid_camera,
) -> srf_status {
    guard(|| {
        sized::writable("out_camera", out_camera)?;
        watched(progress, |progress| {
            let camera = GridCamera::of(&handle::get("image", image)?.image, progress)?;
            sized::write("out_camera", out_camera, srf_grid_camera::from_core(&camera))
        })
    })
}

/// For vertices whose coordinates are multiplied, where the host's unit of length is another.
/// camera   what is changed, on SRF_OK only. Not NULL
/// scale    what coordinates are multiplied with, > 0
/// returns  SRF_OK, SRF_ERR_INPUT, SRF_ERR_PARAMETER, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_grid_camera_scale(camera: *mut srf_grid_camera, scale: f64) -> srf_status {
    guard(|| {
        let scaled = read(camera.cast_const())?.scaled(scale).map_err(of_number)?;
        sized::write("camera", camera, srf_grid_camera::from_core(&scaled))
    })
}

/// The valid pixels of an image as the vertices of a mesh, row after row, in the sensor's frame: how a host keeps a range image. With
/// the vertex attributes range_row, range_col and, where the image has them, colour, intensity and confidence. O(pixels).
/// image     not NULL
/// faces     1: also the triangles that srf_image_triangulate() makes with its defaults, over the same vertices. 0: none
/// progress  NULL for none
/// out_mesh  receives a new handle on SRF_OK only. Not NULL
/// returns   SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_OUT_OF_MEMORY.
///           Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_to_mesh(
    image: *const srf_image,
    faces: u32,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        let image = handle::get("image", image)?;
        let faces = flag("faces", faces)?;
        watched(progress, |progress| {
            let mesh = vertices::to_mesh(&image.image, faces, progress)?;
            handle::give("out_mesh", out_mesh, mesh.into())
        })
    })
}

/// The range image that a host's vertices are, however its user moved them. Pixels without a vertex are invalid. If all were moved, turned,
/// scaled and mirrored alike, within single precision, and each lies on its pixel's ray, the projection stays of its kind, with numbers
/// scaled and mirrored. If they were stretched, or edited one by one, it becomes a grid of points, seen from where it was. Samples lie in
/// the world where the vertices do. O(pixels).
/// camera           what srf_image_grid_camera() filled. Not NULL
/// row              one SRF_TYPE_I32 or SRF_TYPE_U32 per vertex, its pixel's row. Not NULL
/// col              one SRF_TYPE_I32 or SRF_TYPE_U32 per vertex, its pixel's column. Not NULL
/// positions        3 SRF_TYPE_F64 or SRF_TYPE_F32 per vertex, in the host's frame. Not NULL
/// colours          4 SRF_TYPE_U8 per vertex, sRGB with straight alpha. NULL for none
/// intensities      one SRF_TYPE_F32 or SRF_TYPE_F64 per vertex. NULL for none
/// confidences      one SRF_TYPE_F32 or SRF_TYPE_F64 per vertex, >= 0. NULL for none
/// world_from_host  any affine matrix that does not flatten. NULL for the identity
/// name             as of srf_image_create(). NULL for none
/// progress         NULL for none
/// out_image        receives a new handle on SRF_OK only. Not NULL
/// returns          SRF_OK, SRF_ERR_INPUT for a pixel outside of the grid or there twice, positions that are not finite, arrays of
///                  different lengths, vertices scaled by 0, or a grid far too large for its vertices. SRF_ERR_PARAMETER,
///                  SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_from_vertices(
    camera: *const srf_grid_camera,
    row: *const srf_array,
    col: *const srf_array,
    positions: *const srf_array,
    colours: *const srf_array,
    intensities: *const srf_array,
    confidences: *const srf_array,
    world_from_host: *const srf_pose,
    name: *const c_char,
    progress: *const srf_progress,
    out_image: *mut *mut srf_image,
) -> srf_status {
    guard(|| {
        pointer::writable("out_image", out_image)?;
        let camera = read(camera)?;
        let name = if name.is_null() { String::new() } else { pointer::text("name", name)?.to_owned() };
        let world_from_host = pose::read("world_from_host", world_from_host)?;
        let (row, col) = (Borrowed::new("row", row, 1)?, Borrowed::new("col", col, 1)?);
        let positions = Borrowed::new("positions", positions, 3)?;
        // Before any of them is read: a wrong count reads what is not there.
        vertices::of_one_length(positions.count(), &[("rows", row.count()), ("columns", col.count())])?;
        let (row, col, positions) = (row.places()?, col.places()?, positions.points()?);
        let colour = Borrowed::optional("colours", colours, 4)?.map(|a| a.colours()).transpose()?;
        let intensity = Borrowed::optional("intensities", intensities, 1)?.map(|a| a.values_f32()).transpose()?;
        let confidence = Borrowed::optional("confidences", confidences, 1)?.map(|a| a.values_f32()).transpose()?;
        let vertices = Vertices {
            row: &row,
            col: &col,
            positions: &positions,
            colour: colour.as_deref(),
            intensity: intensity.as_deref(),
            confidence: confidence.as_deref(),
        };
        watched(progress, |progress| {
            let mut image = vertices::from_vertices(&camera, &vertices, world_from_host, progress)?;
            image.name = name;
            handle::give("out_image", out_image, image.into())
        })
    })
}
