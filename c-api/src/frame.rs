//! Frames of depth cameras in memory: depths with the colours and confidences that were recorded beside them, to a range image.

use std::ffi::c_char;

use bytemuck::Zeroable as _;
use glam::DAffine3;
use surfrecon::RangeImage;
use surfrecon::frame::{Camera, ColourImage, ConfidenceImage, Frame, LeftOutReport, TURNED};
use surfrecon::log::{self, Level};
use surfrecon::range_image::DepthKind;
use surfrecon::reports::Report;

use crate::array::{Borrowed, Rows, srf_array};
use crate::guard::guard;
use crate::handle;
use crate::image::{srf_image, srf_projection_kind::*};
use crate::pose::{self, srf_pose};
use crate::progress::{srf_progress, watched};
use crate::reports::left_out::srf_left_out_report;
use crate::status::{Failure, flag, srf_status, srf_status::*};
use crate::{pointer, report, sized};

/// How the images of a frame were taken and how they lie in memory. One serves all frames of a recording. Cameras look along z, with
/// x to the right and y down. Pixel centres lie at whole numbers, that of the first pixel at 0, 0. Starts with its size. Prepared by
/// srf_frame_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_frame {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// The kind of the depths: SRF_PROJECTION_PINHOLE_DEPTH, along z, the default, or SRF_PROJECTION_PINHOLE_RANGE, along the ray.
    pub kind: u32,
    /// Rows of the depth image.
    pub rows: u64,
    /// Its columns.
    pub cols: u64,
    /// Bytes from one of its rows to the next. 0 for rows without gaps.
    pub row_stride: u64,
    /// Its camera: fx, fy, cx, cy in pixels.
    pub intrinsics: [f64; 4],
    /// The factor of stored depths, > 0: 0.001 makes millimetres metres. 1 by default.
    pub scale: f64,
    /// Samples further away along z are the sensor's guesses and are left out, in the unit of the scaled depths. 0, the default, for none.
    pub reach: f64,
    /// Rows of the colour image. 0, as its columns, for the size of the depth image.
    pub colour_rows: u64,
    /// Its columns.
    pub colour_cols: u64,
    /// Bytes from one of its rows to the next. 0 for rows without gaps.
    pub colour_row_stride: u64,
    /// Its camera: fx, fy, cx, cy in its pixels. All 0, the default, for that of the depth image, scaled to its size.
    pub colour_intrinsics: [f64; 4],
    /// Takes points of the depth camera's frame into that of the colour camera: a rotation and a translation, the identity by default.
    pub colour_from_depth: srf_pose,
    /// 1: undistorting left the colour image a black rim. Samples seen through it are left out. 0 by default.
    pub has_black_rim: u32,
    /// 1: poses and colour_from_depth are of cameras with y up that look along -z, as ARKit's and OpenGL's. 0 by default.
    pub looks_along_minus_z: u32,
    /// Rows of the confidence image. 0, as its columns, for the size of the depth image.
    pub confidence_rows: u64,
    /// Its columns.
    pub confidence_cols: u64,
    /// Bytes from one of its rows to the next. 0 for rows without gaps.
    pub confidence_row_stride: u64,
    /// Samples of a lower level are left out, 0 to 255. 1 by default.
    pub least_confidence: u64,
}

impl srf_frame {
    fn unset() -> Self {
        srf_frame {
            struct_size: size_of::<Self>() as u32,
            kind: SRF_PROJECTION_PINHOLE_DEPTH as u32,
            scale: 1.0,
            colour_from_depth: pose::pose(DAffine3::IDENTITY),
            least_confidence: 1,
            ..srf_frame::zeroed()
        }
    }
}

/// Prepares a struct for srf_image_from_frame(). Call srf_frame_init(frame), which adds the size that this header knows.
/// frame    not NULL
/// size     sizeof(srf_frame): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_frame_init_sized(frame: *mut srf_frame, size: usize) -> srf_status {
    guard(|| sized::init("frame", frame, size, srf_frame::unset()))
}

/// Makes a range image of a frame, with what of it can be trusted. Depth is never resampled: each sample takes its colour through
/// its point, with alpha 0 where the colour camera does not see it, since it lies outside of its image or behind a nearer sample.
/// Nothing was measured where a depth is 0, negative or not finite, nor where one of SRF_TYPE_U16 is 65535. O(pixels).
/// frame              how the images were taken, initialized by srf_frame_init(). Not NULL
/// depths             one SRF_TYPE_U16, SRF_TYPE_F32 or SRF_TYPE_F64 a pixel of the depth image, row after row. Not NULL
/// colours            3 or 4 SRF_TYPE_U8 a pixel of the colour image, sRGB, of 4 the last is passed over. NULL for none
/// confidences        one SRF_TYPE_U8 a pixel of the confidence image, in the sensor's own levels. NULL for none
/// world_from_sensor  places the depth camera, a rotation and a translation. NULL for the identity
/// name               for messages and as what ties are broken by when merging, UTF-8. NULL for none
/// progress           NULL for none
/// out_image          receives a new handle on SRF_OK only. Not NULL
/// out_left_out       initialized by srf_left_out_report_init(). NULL if not wanted
/// returns            SRF_OK, SRF_ERR_PARAMETER naming the field, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
///                    SRF_ERR_STRUCT_SIZE, SRF_ERR_OUT_OF_MEMORY. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_image_from_frame(
    frame: *const srf_frame,
    depths: *const srf_array,
    colours: *const srf_array,
    confidences: *const srf_array,
    world_from_sensor: *const srf_pose,
    name: *const c_char,
    progress: *const srf_progress,
    out_image: *mut *mut srf_image,
    out_left_out: *mut srf_left_out_report,
) -> srf_status {
    guard(|| {
        if frame.is_null() {
            return Err(Failure::new(SRF_ERR_NULL, "frame must not be NULL"));
        }
        pointer::writable("out_image", out_image)?;
        if !out_left_out.is_null() {
            sized::writable("out_left_out", out_left_out)?;
        }
        let form = Form::read(&sized::read("frame", frame, srf_frame::unset())?)?;
        let mut depth = form.depth(depths)?;
        depth.world_from_sensor = form.forward(pose::read_rigid("world_from_sensor", world_from_sensor)?);
        if !name.is_null() {
            depth.name = pointer::text("name", name)?.to_owned();
        }
        let taken = Frame {
            colour: form.colour(colours)?,
            confidence: form.confidence(confidences)?,
            reach: form.reach,
            ..Frame::new(depth)
        };
        watched(progress, |progress| {
            let (image, left_out) = progress.watch(|| taken.into_range_image(progress))?;
            // The struct counts the rest.
            let others = LeftOutReport { low_confidence: 0, out_of_reach: 0, black_rim: 0, far: 0, ..left_out };
            if let Some(words) = others.in_words() {
                log::tell(Level::Warning, &format!("{}: {words}", image.called()));
            }
            if !out_left_out.is_null() {
                report::write("out_left_out", out_left_out, left_out.values())?;
            }
            handle::give("out_image", out_image, image.into())
        })
    })
}

/// A frame's description, checked.
struct Form {
    kind: DepthKind,
    depths: Rows,
    camera: Camera,
    scale: f64,
    reach: Option<f64>,
    colours: Rows,
    colour_camera: Camera,
    colour_from_depth: DAffine3,
    has_black_rim: bool,
    looks_along_minus_z: bool,
    confidences: Rows,
    least_confidence: u8,
}

fn refused<T>(text: String) -> Result<T, Failure> {
    Err(Failure::new(SRF_ERR_PARAMETER, text))
}

/// A size in memory, which is that of the depth image where none is given.
fn rows(name: &str, [rows, cols, stride]: [u64; 3], depths: Option<&Rows>) -> Result<Rows, Failure> {
    let given = match ([rows, cols], depths) {
        ([0, 0], Some(depths)) => Rows { stride: 0, ..*depths },
        _ if rows > 0 && cols > 0 => Rows { rows: rows as usize, cols: cols as usize, stride: 0 },
        _ => return refused(format!("frame: the {name} image has {rows} rows and {cols} columns")),
    };
    Ok(Rows { stride: stride as usize, ..given })
}

fn camera(name: &str, [fx, fy, cx, cy]: [f64; 4], size: Rows) -> Result<Camera, Failure> {
    let camera = Camera::sized([fx, fy], [cx, cy], [size.cols, size.rows]);
    camera.validate().or_else(|error| refused(format!("frame.{name}: {error}")))?;
    Ok(camera)
}

impl Form {
    fn read(given: &srf_frame) -> Result<Self, Failure> {
        let kind = match given.kind {
            k if k == SRF_PROJECTION_PINHOLE_DEPTH as u32 => DepthKind::Planar,
            k if k == SRF_PROJECTION_PINHOLE_RANGE as u32 => DepthKind::Ray,
            other => {
                let text = format!(
                    "frame.kind must be SRF_PROJECTION_PINHOLE_DEPTH (2) or SRF_PROJECTION_PINHOLE_RANGE (3), got {other}"
                );
                return refused(text);
            }
        };
        if !(given.scale.is_finite() && given.scale > 0.0) {
            return refused(format!("frame.scale must be a finite number > 0, got {}", given.scale));
        }
        if !(given.reach >= 0.0) {
            return refused(format!("frame.reach must be >= 0, 0 for none, got {}", given.reach));
        }
        let Ok(least_confidence) = u8::try_from(given.least_confidence) else {
            return refused(format!("frame.least_confidence must be 0 to 255, got {}", given.least_confidence));
        };
        let depths = rows("depth", [given.rows, given.cols, given.row_stride], None)?;
        let colours = rows("colour", [given.colour_rows, given.colour_cols, given.colour_row_stride], Some(&depths))?;
        let confidences = [given.confidence_rows, given.confidence_cols, given.confidence_row_stride];
        let depth_camera = camera("intrinsics", given.intrinsics, depths)?;
        let mut form = Form {
            kind,
            depths,
            camera: depth_camera,
            scale: given.scale,
            reach: (given.reach > 0.0).then_some(given.reach),
            colours,
            colour_camera: match given.colour_intrinsics {
                [0.0, 0.0, 0.0, 0.0] => depth_camera.scaled_to([colours.cols, colours.rows]),
                numbers => camera("colour_intrinsics", numbers, colours)?,
            },
            colour_from_depth: pose::read_rigid("frame.colour_from_depth", &given.colour_from_depth)?,
            has_black_rim: flag("frame.has_black_rim", given.has_black_rim)?,
            looks_along_minus_z: flag("frame.looks_along_minus_z", given.looks_along_minus_z)?,
            confidences: rows("confidence", confidences, Some(&depths))?,
            least_confidence,
        };
        if form.looks_along_minus_z {
            form.colour_from_depth = TURNED * form.colour_from_depth * TURNED;
        }
        Ok(form)
    }

    /// A pose of the caller's cameras as one of cameras that look along z.
    fn forward(&self, pose: DAffine3) -> DAffine3 {
        if self.looks_along_minus_z { pose * TURNED } else { pose }
    }

    fn depth(&self, depths: *const srf_array) -> Result<RangeImage, Failure> {
        let mut values = Borrowed::image("depths", depths, 1, self.depths)?.depths()?;
        for depth in &mut values {
            let scaled = *depth * self.scale;
            if depth.is_finite() && !scaled.is_finite() {
                let text =
                    format!("depths: {depth:e} times frame.scale, {:e}, is more than a number can hold", self.scale);
                return Err(Failure::new(SRF_ERR_INPUT, text));
            }
            *depth = scaled;
        }
        let Rows { rows, cols, .. } = self.depths;
        Ok(RangeImage::from_values(rows, cols, values, self.camera.projection(self.kind))?)
    }

    fn colour(&self, colours: *const srf_array) -> Result<Option<ColourImage>, Failure> {
        if colours.is_null() {
            return Ok(None);
        }
        let pixels = Borrowed::opaque_image("colours", colours, self.colours)?;
        Ok(Some(ColourImage {
            camera: self.colour_camera,
            pixels,
            colour_from_depth: self.colour_from_depth,
            black_rim: self.has_black_rim,
        }))
    }

    fn confidence(&self, confidences: *const srf_array) -> Result<Option<ConfidenceImage>, Failure> {
        if confidences.is_null() {
            return Ok(None);
        }
        let levels = Borrowed::image("confidences", confidences, 1, self.confidences)?.levels()?;
        let size = [self.confidences.cols, self.confidences.rows];
        Ok(Some(ConfidenceImage { size, levels, least: self.least_confidence }))
    }
}
