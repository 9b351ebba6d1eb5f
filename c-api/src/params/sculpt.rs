//! Parameters of sculpt. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// How a range image is sculpted to few triangles. Starts with its size. Set to the defaults by srf_sculpt_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_sculpt_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Largest distance between a sample and the mesh along the sample's ray. Larger values give fewer triangles. 0: every
    /// sample is reproduced. >= 0. SRF_FROM_DATA, the default: the relative tolerance times the depth extent of the covered
    /// samples.
    pub tolerance: f64,
    /// The tolerance as a share of the depth extent, the difference between the farthest and the nearest range of the
    /// covered samples. Used where no tolerance is given. >= 0, default 0.001.
    pub relative_tolerance: f64,
    /// Work spent on fewer triangles at the same tolerance: 0 digs only, 1 also removes vertices, for about twice the time,
    /// 2 searches for fewer yet, for about ten times the time. 0 to 2, default 1.
    pub effort: u64,
    /// Every vertex is a sample. Off: vertices may leave their samples along the ray within the tolerance, for about a
    /// sixth fewer triangles than effort 2 and a little more time. With effort 0, which moves nothing, it has no effect. 1
    /// or 0, default 1.
    pub interpolate: u64,
    /// Smallest angle, as seen from the sensor, of triangles made to replace others. Those of the digging keep theirs. 10
    /// degrees cost up to 12 % more triangles. Radians, 0 to pi/6, default 0.
    pub min_angle: f64,
    /// Smooths open borders, too, for fewer triangles: the mesh reaches at most half a pixel beyond them, covers all that
    /// it did, and no other pixel. Needs an effort of at least 1. Off: borders stay as they are in the image but for
    /// vertices on straight lines. 1 or 0, default 0.
    pub simplify_borders: u64,
    /// Longest edge between neighbouring samples. Larger values bridge jumps, smaller ones open holes. > 0. SRF_FROM_DATA,
    /// the default: 3.4 times the median distance of neighbouring samples of each scan, in rows and columns apart where
    /// pixels are not square.
    pub edge_limit: f64,
    /// Largest angle between a triangle's normal and the direction to the sensor. Smaller values drop surfaces seen at a
    /// grazing angle. Radians, > 0, at most pi/2, default pi/2.
    pub grazing_limit: f64,
}

impl Fields for srf_sculpt_params {
    fn defaults() -> Self {
        srf_sculpt_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            tolerance: SRF_FROM_DATA,
            relative_tolerance: 0.001,
            effort: 1,
            interpolate: 1,
            min_angle: 0.0,
            simplify_borders: 0,
            edge_limit: SRF_FROM_DATA,
            grazing_limit: std::f64::consts::FRAC_PI_2,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("tolerance", Given::Double(self.tolerance)),
            ("relative_tolerance", Given::Double(self.relative_tolerance)),
            ("effort", Given::Whole(self.effort)),
            ("interpolate", Given::Whole(self.interpolate)),
            ("min_angle", Given::Double(self.min_angle)),
            ("simplify_borders", Given::Whole(self.simplify_borders)),
            ("edge_limit", Given::Double(self.edge_limit)),
            ("grazing_limit", Given::Double(self.grazing_limit)),
        ]
    }
}

/// Sets the defaults. Call srf_sculpt_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_sculpt_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculpt_params_init_sized(params: *mut srf_sculpt_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_sculpt_params::defaults()))
}
