//! Parameters of triangulate. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// How range images become surfaces: limits of the step-discontinuity triangulation. Starts with its size. Set to the
/// defaults by srf_triangulate_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_triangulate_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Longest edge between neighbouring samples. Larger values bridge jumps, smaller ones open holes. > 0. SRF_FROM_DATA,
    /// the default: 3.4 times the median distance of neighbouring samples of each scan, in rows and columns apart where
    /// pixels are not square.
    pub edge_limit: f64,
    /// Largest angle between a triangle's normal and the direction to the sensor. Smaller values drop surfaces seen at a
    /// grazing angle. Radians, > 0, at most pi/2, default pi/2.
    pub grazing_limit: f64,
}

impl Fields for srf_triangulate_params {
    fn defaults() -> Self {
        srf_triangulate_params {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            edge_limit: SRF_FROM_DATA,
            grazing_limit: std::f64::consts::FRAC_PI_2,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("reserved", Given::Reserved(self.reserved)),
            ("edge_limit", Given::Double(self.edge_limit)),
            ("grazing_limit", Given::Double(self.grazing_limit)),
        ]
    }
}

/// Sets the defaults. Call srf_triangulate_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_triangulate_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_triangulate_params_init_sized(
    params: *mut srf_triangulate_params,
    size: usize,
) -> srf_status {
    guard(|| sized::init("params", params, size, srf_triangulate_params::defaults()))
}
