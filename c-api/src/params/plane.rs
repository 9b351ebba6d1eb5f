//! Parameters of plane. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// How the dominant plane is found. Lengths are in the unit of the scans. Starts with its size. Set to the defaults by
/// srf_plane_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_plane_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Samples that lie further off do not count for the plane. > 0. SRF_FROM_DATA, the default: three times the scatter of
    /// its samples, at most a hundredth of the extent of the scans.
    pub tolerance: f64,
    /// A plane on which a smaller share of the samples lies is refused. 0 to 1, default 0.05.
    pub min_share: f64,
    /// Points that lie at most so far above the plane are removed with it. >= 0. SRF_FROM_DATA, the default: four times the
    /// scatter of its samples.
    pub margin: f64,
}

impl Fields for srf_plane_params {
    fn defaults() -> Self {
        srf_plane_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            tolerance: SRF_FROM_DATA,
            min_share: 0.05,
            margin: SRF_FROM_DATA,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("tolerance", Given::Double(self.tolerance)),
            ("min_share", Given::Double(self.min_share)),
            ("margin", Given::Double(self.margin)),
        ]
    }
}

/// Sets the defaults. Call srf_plane_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_plane_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_plane_params_init_sized(params: *mut srf_plane_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_plane_params::defaults()))
}
