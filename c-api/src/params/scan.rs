//! Parameters of scan. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// Errors that a virtual scanner adds to the truth. The defaults add nothing. Starts with its size. Set to the defaults by
/// srf_scan_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_scan_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Standard deviation of the Gaussian noise along each ray. >= 0, default 0.
    pub noise: f64,
    /// Growth of the noise where the surface is seen at a grazing angle: it is multiplied by 1 + growth * (1 / cos - 1),
    /// with the cosine between ray and normal, at least 0.05. 0 to 100, default 0.
    pub noise_grazing: f64,
    /// Values are rounded to multiples of this step. 0: they stay as they are. >= 0, default 0.
    pub quantum: f64,
    /// Share of the pixels that give no value, whatever they see. 0 to 1, default 0.
    pub dropout: f64,
    /// Share of further pixels that give no value where the ray grazes the surface. It falls with (1 - cos)^4 to 0 where
    /// the ray is perpendicular to the surface. 0 to 1, default 0.
    pub dropout_grazing: f64,
    /// Largest distance from the sensor at which a surface is seen. Orthographic sensors are infinitely far away and take
    /// none. > 0. SRF_FROM_DATA, the default: none, everything in sight is seen.
    pub max_range: f64,
    /// Triangles seen from behind give values too. Off: they hide what is behind them and give none. 1 or 0, default 0.
    pub backfaces: u64,
    /// Standard deviation, along each axis, of the error of the reported position: how badly the scans are registered. >=
    /// 0, default 0.
    pub pose_shift: f64,
    /// Standard deviation of the angle of the error of the reported orientation, about the centre of what was seen.
    /// Radians, 0 to pi, default 0.
    pub pose_turn: f64,
    /// Number all randomness follows from. Give each scan its own. 0 to 9007199254740992, default 0.
    pub seed: u64,
}

impl Fields for srf_scan_params {
    fn defaults() -> Self {
        srf_scan_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            noise: 0.0,
            noise_grazing: 0.0,
            quantum: 0.0,
            dropout: 0.0,
            dropout_grazing: 0.0,
            max_range: SRF_FROM_DATA,
            backfaces: 0,
            pose_shift: 0.0,
            pose_turn: 0.0,
            seed: 0,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("noise", Given::Double(self.noise)),
            ("noise_grazing", Given::Double(self.noise_grazing)),
            ("quantum", Given::Double(self.quantum)),
            ("dropout", Given::Double(self.dropout)),
            ("dropout_grazing", Given::Double(self.dropout_grazing)),
            ("max_range", Given::Double(self.max_range)),
            ("backfaces", Given::Whole(self.backfaces)),
            ("pose_shift", Given::Double(self.pose_shift)),
            ("pose_turn", Given::Double(self.pose_turn)),
            ("seed", Given::Whole(self.seed)),
        ]
    }
}

/// Sets the defaults. Call srf_scan_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_scan_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_scan_params_init_sized(params: *mut srf_scan_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_scan_params::defaults()))
}
