//! Parameters of close. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a cell.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_openings {
    /// Everything that seen space allows: the result is closed.
    SRF_OPENINGS_ALL = 1,
    /// Openings that seen space or the surface surrounds: what lies before them is a pocket that nobody saw. A bowl's rim,
    /// a relief's border and the foot of a statue stay open.
    SRF_OPENINGS_SEEN = 2,
    /// Openings whose boundaries are at most as long as the longest hole.
    SRF_OPENINGS_HOLES = 3,
    /// None: the surface stays as it is, and the report says what is open.
    SRF_OPENINGS_NONE = 4,
}

/// Direction away from the ground, where there is a flat base.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_base_up {
    /// Along z.
    SRF_BASE_UP_Z = 1,
    /// Along y.
    SRF_BASE_UP_Y = 2,
    /// Along x.
    SRF_BASE_UP_X = 3,
    /// Against z.
    SRF_BASE_UP_MINUS_Z = 4,
    /// Against y.
    SRF_BASE_UP_MINUS_Y = 5,
    /// Against x.
    SRF_BASE_UP_MINUS_X = 6,
}

/// How the openings of a surface are closed. Lengths are in its unit. Starts with its size. Set to the defaults by
/// srf_close_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_close_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a
    /// cell. A value of srf_openings, default SRF_OPENINGS_ALL.
    pub openings: u64,
    /// Longest boundary of an opening that is closed, if holes alone are closed. >= 0. SRF_FROM_DATA, the default: 100
    /// cells.
    pub max_hole_length: f64,
    /// Size of a cell of the merge that the surface is of. The fill has twice that size. > 0. SRF_FROM_DATA, the default:
    /// 1.3 times the median edge of the surface.
    pub cell: f64,
    /// How far the surface and the poses of its scans may be off: the merge distance. > 0. SRF_FROM_DATA, the default: a
    /// cell.
    pub merge_distance: f64,
    /// Nothing is filled below a plane under the surface, so that what stood on the ground gets a flat foot instead of a
    /// round one. Off: parts that nobody saw from below continue as their sides bend. 1 or 0, default 0.
    pub flat_base: u64,
    /// Closes too where scans saw through. These faces are marked in the attribute forced. Off: openings in seen space stay
    /// open, and the report says where. 1 or 0, default 0.
    pub force: u64,
    /// Direction away from the ground, where there is a flat base. A value of srf_base_up, default SRF_BASE_UP_Z.
    pub base_up: u64,
    /// How far below the lowest measured point the flat base lies, if there is one. >= 0, default 0.
    pub base_depth: f64,
}

impl Fields for srf_close_params {
    fn defaults() -> Self {
        srf_close_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            openings: 1,
            max_hole_length: SRF_FROM_DATA,
            cell: SRF_FROM_DATA,
            merge_distance: SRF_FROM_DATA,
            flat_base: 0,
            force: 0,
            base_up: 1,
            base_depth: 0.0,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("openings", Given::Whole(self.openings)),
            ("max_hole_length", Given::Double(self.max_hole_length)),
            ("cell", Given::Double(self.cell)),
            ("merge_distance", Given::Double(self.merge_distance)),
            ("flat_base", Given::Whole(self.flat_base)),
            ("force", Given::Whole(self.force)),
            ("base_up", Given::Whole(self.base_up)),
            ("base_depth", Given::Double(self.base_depth)),
        ]
    }
}

/// Sets the defaults. Call srf_close_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_close_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_close_params_init_sized(params: *mut srf_close_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_close_params::defaults()))
}
