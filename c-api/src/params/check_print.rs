//! Parameters of check_print. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// Direction away from the plate that is printed on.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_print_up {
    /// Along z.
    SRF_PRINT_UP_Z = 1,
    /// Along y.
    SRF_PRINT_UP_Y = 2,
    /// Along x.
    SRF_PRINT_UP_X = 3,
    /// Against z.
    SRF_PRINT_UP_MINUS_Z = 4,
    /// Against y.
    SRF_PRINT_UP_MINUS_Y = 5,
    /// Against x.
    SRF_PRINT_UP_MINUS_X = 6,
}

/// How a mesh is checked before it is printed. Lengths are in its unit. Starts with its size. Set to the defaults by
/// srf_check_print_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_check_print_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Thinnest wall that the printer makes: 0.8 mm for most. > 0. SRF_FROM_DATA, the default: none, walls are measured
    /// only.
    pub min_wall: f64,
    /// Walls are measured up to this thickness, and at least up to the thinnest wall that the printer makes. Thicker ones
    /// count as so thick. > 0. SRF_FROM_DATA, the default: a tenth of the diagonal of the mesh's box.
    pub max_wall: f64,
    /// Faces that look down and lean from the vertical by more than this need supports. Radians, 0 to pi/2, default pi/4.
    pub overhang: f64,
    /// Direction away from the plate that is printed on. A value of srf_print_up, default SRF_PRINT_UP_Z.
    pub print_up: u64,
    /// Width of the space that the printer fills. > 0. SRF_FROM_DATA, the default: any.
    pub printer_width: f64,
    /// Depth of the space that the printer fills. The print may also be turned by a quarter. > 0. SRF_FROM_DATA, the
    /// default: any.
    pub printer_depth: f64,
    /// Height of the space that the printer fills. > 0. SRF_FROM_DATA, the default: any.
    pub printer_height: f64,
    /// Weight of a unit of volume: 0.00124 for PLA, in grams and millimetres. > 0. SRF_FROM_DATA, the default: none, no
    /// weight is computed.
    pub density: f64,
}

impl Fields for srf_check_print_params {
    fn defaults() -> Self {
        srf_check_print_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            min_wall: SRF_FROM_DATA,
            max_wall: SRF_FROM_DATA,
            overhang: std::f64::consts::FRAC_PI_4,
            print_up: 1,
            printer_width: SRF_FROM_DATA,
            printer_depth: SRF_FROM_DATA,
            printer_height: SRF_FROM_DATA,
            density: SRF_FROM_DATA,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("min_wall", Given::Double(self.min_wall)),
            ("max_wall", Given::Double(self.max_wall)),
            ("overhang", Given::Double(self.overhang)),
            ("print_up", Given::Whole(self.print_up)),
            ("printer_width", Given::Double(self.printer_width)),
            ("printer_depth", Given::Double(self.printer_depth)),
            ("printer_height", Given::Double(self.printer_height)),
            ("density", Given::Double(self.density)),
        ]
    }
}

/// Sets the defaults. Call srf_check_print_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_check_print_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_check_print_params_init_sized(
    params: *mut srf_check_print_params,
    size: usize,
) -> srf_status {
    guard(|| sized::init("params", params, size, srf_check_print_params::defaults()))
}
