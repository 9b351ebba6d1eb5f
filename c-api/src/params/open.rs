//! Parameters of open. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// Quantity that the pixels of depth images measure.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_depth {
    /// Distance from the image plane through the centre of projection (z).
    SRF_DEPTH_PLANAR = 1,
    /// Distance along the pixel's ray.
    SRF_DEPTH_RAY = 2,
}

/// How images store numbers.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_pixels {
    /// Numbers if the image is grey. Terrain RGB if it is coloured and every pixel then lies between -500 and 9000 m.
    SRF_PIXELS_AUTO = 1,
    /// A number per pixel.
    SRF_PIXELS_NUMBER = 2,
    /// Mapbox: -10000 + (65536 R + 256 G + B) / 10.
    SRF_PIXELS_TERRAIN_RGB = 3,
    /// Mapzen: 256 R + G + B / 256 - 32768.
    SRF_PIXELS_TERRARIUM = 4,
}

/// Direction of the poses of a recording or of a list of poses.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_poses {
    /// As the layout has them, unless the frames lie on each other only in the other sense.
    SRF_POSES_AUTO = 1,
    /// From the camera to the world.
    SRF_POSES_CAMERA_TO_WORLD = 2,
    /// From the world to the camera.
    SRF_POSES_WORLD_TO_CAMERA = 3,
}

/// Axes of the cameras that the poses of a recording or of a list of poses place.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_axes {
    /// As the layout has them, unless the frames lie on each other only with the other axes.
    SRF_AXES_AUTO = 1,
    /// y down, looking along z, as OpenCV and Open3D have them.
    SRF_AXES_Y_DOWN = 2,
    /// y up, looking along -z, as OpenGL, Blender and ARKit have them.
    SRF_AXES_Y_UP = 3,
}

/// Facts that files do not say themselves. Starts with its size. Set to the defaults by srf_read_options_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_read_options {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// fx, fy, cx, cy in pixels, pixel centres at whole numbers: images are depth images of that camera. All 0, the
    /// default: they are height maps, unless a file of a camera is opened with them.
    pub intrinsics: [f64; 4],
    /// Of the camera of these intrinsics: columns and rows of its images. Others are refused. 0 and 0, the default: any.
    pub camera_size: [u64; 2],
    /// Factor by which the numbers of an image are multiplied. Larger values make heights and depths larger. > 0.
    /// SRF_FROM_DATA, the default: 0.001 for whole numbers seen by a camera (millimetres), else 1.
    pub scale: f64,
    /// Number that is added to the numbers of an image afterwards. Default 0.
    pub offset: f64,
    /// Distance of neighbouring pixels of a height map. Larger values make it wider. > 0. SRF_FROM_DATA, the default: the
    /// size in the file, else 1.
    pub step: f64,
    /// The number of an image, before scaling, that means no sample. It counts besides those that the format itself
    /// defines. NaN, the default: none.
    pub invalid: f64,
    /// Quantity that the pixels of depth images measure. A value of srf_depth, default SRF_DEPTH_PLANAR.
    pub depth: u64,
    /// How images store numbers. A value of srf_pixels, default SRF_PIXELS_AUTO.
    pub pixels: u64,
    /// Largest size of what one compressed file unpacks to, in GiB. Larger values let larger files be read. Small ones
    /// refuse files that unpack to more than they should. > 0, at most 1000000, default 4.
    pub max_decoded_gib: f64,
    /// Lists may name files outside their own folder. Off: such lists are refused. 1 or 0, default 0.
    pub allow_outside: u64,
    /// Direction of the poses of a recording or of a list of poses. A value of srf_poses, default SRF_POSES_AUTO.
    pub poses: u64,
    /// Axes of the cameras that the poses of a recording or of a list of poses place. A value of srf_axes, default
    /// SRF_AXES_AUTO.
    pub axes: u64,
}

impl Fields for srf_read_options {
    fn defaults() -> Self {
        srf_read_options {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            intrinsics: [0.0; 4],
            camera_size: [0; 2],
            scale: SRF_FROM_DATA,
            offset: 0.0,
            step: SRF_FROM_DATA,
            invalid: f64::NAN,
            depth: 1,
            pixels: 1,
            max_decoded_gib: 4.0,
            allow_outside: 0,
            poses: 1,
            axes: 1,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("reserved", Given::Reserved(self.reserved)),
            ("scale", Given::Double(self.scale)),
            ("offset", Given::Double(self.offset)),
            ("step", Given::Double(self.step)),
            ("invalid", Given::Double(self.invalid)),
            ("depth", Given::Whole(self.depth)),
            ("pixels", Given::Whole(self.pixels)),
            ("max_decoded_gib", Given::Double(self.max_decoded_gib)),
            ("allow_outside", Given::Whole(self.allow_outside)),
            ("poses", Given::Whole(self.poses)),
            ("axes", Given::Whole(self.axes)),
        ]
    }
}

/// Sets the defaults. Call srf_read_options_init(options), which adds the size that this header knows.
/// options  not NULL
/// size     sizeof(srf_read_options): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_read_options_init_sized(options: *mut srf_read_options, size: usize) -> srf_status {
    guard(|| sized::init("options", options, size, srf_read_options::defaults()))
}
