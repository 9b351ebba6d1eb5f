//! Parameters of merge. Written by `make generate` from their declaration in the core: change that.

use crate::given::{Fields, Given};
use crate::guard::guard;
use crate::settings::SRF_FROM_DATA;
use crate::sized;
use crate::status::srf_status;

/// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a cell. All and those inside the scans are closed by a smooth fill, with the whole surface in memory.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_close {
    /// Everything that seen space allows: the result is closed.
    SRF_CLOSE_ALL = 1,
    /// Openings that seen space or the surface surrounds: what lies before them is a pocket that nobody saw. A bowl's rim,
    /// a relief's border and the foot of a statue stay open.
    SRF_CLOSE_SEEN = 2,
    /// Openings whose boundaries are at most as long as the longest hole.
    SRF_CLOSE_HOLES = 3,
    /// None: the surface stays as it is, and the report says what is open.
    SRF_CLOSE_NONE = 4,
}

/// How registered scans are merged into one surface. Lengths are in the unit of the scans. Starts with its size. Set to the
/// defaults by srf_merge_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_merge_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any
    /// number.
    pub threads: u32,
    /// Size of a cell of the grid. Smaller keeps more detail and costs time and memory with its inverse square. > 0.
    /// SRF_FROM_DATA, the default: 1.5 times the mean distance of neighbouring samples, or more if noise, the distance
    /// between overlapping scans or little memory ask for it.
    pub voxel: f64,
    /// Surfaces of different scans closer than this, facing the same way, become one. At least a voxel. Choose it above the
    /// residual of the registration and below the thinnest wall. >= 0. SRF_FROM_DATA, the default: from the voxel and the
    /// measured distance between overlapping scans.
    pub merge_distance: f64,
    /// Holes whose boundary is at most this long are closed, if holes alone are closed. 0: all are left open. >= 0.
    /// SRF_FROM_DATA, the default: 100 voxels, but at most a fifth of the diagonal of the connected part the hole is in.
    pub max_hole_length: f64,
    /// Connected parts with fewer triangles than this share of the largest part's are dropped. Parts that no scan saw,
    /// between layers of badly placed scans or out of their noise, are dropped in any case. 0: all are kept that scans are
    /// evidence of. 0 to 1, default 0.
    pub min_component_share: f64,
    /// Longest edge between neighbouring samples. Larger values bridge jumps, smaller ones open holes. > 0. SRF_FROM_DATA,
    /// the default: 3.4 times the median distance of neighbouring samples of each scan, in rows and columns apart where
    /// pixels are not square.
    pub edge_limit: f64,
    /// Largest angle between a triangle's normal and the direction to the sensor. Smaller values drop surfaces seen at a
    /// grazing angle. Radians, > 0, at most pi/2, default pi/2.
    pub grazing_limit: f64,
    /// Colours of scans that overlap are made equally bright before they are averaged: exposure and white balance differ
    /// from scan to scan. By up to a factor of eight: what differs more is of different things. Off: colours are averaged
    /// as they are. 1 or 0, default 1.
    pub match_exposure: u64,
    /// Openings that are closed. Nothing is filled where a scan saw through by more than the merge distance and half a
    /// cell. All and those inside the scans are closed by a smooth fill, with the whole surface in memory. A value of
    /// srf_close, default SRF_CLOSE_HOLES.
    pub close: u64,
    /// Nothing is filled below the lowest measured point, so that what stood on the ground gets a flat foot instead of a
    /// round one. It is for more than holes. Off: parts that nobody saw from below continue as their sides bend. 1 or 0,
    /// default 0.
    pub flat_base: u64,
    /// Direction away from the ground, where there is a flat base. A value of srf_base_up, default SRF_BASE_UP_Z.
    pub base_up: u64,
}

impl Fields for srf_merge_params {
    fn defaults() -> Self {
        srf_merge_params {
            struct_size: size_of::<Self>() as u32,
            threads: 0,
            voxel: SRF_FROM_DATA,
            merge_distance: SRF_FROM_DATA,
            max_hole_length: SRF_FROM_DATA,
            min_component_share: 0.0,
            edge_limit: SRF_FROM_DATA,
            grazing_limit: std::f64::consts::FRAC_PI_2,
            match_exposure: 1,
            close: 3,
            flat_base: 0,
            base_up: 1,
        }
    }

    fn given(&self) -> Vec<(&'static str, Given)> {
        vec![
            ("threads", Given::Threads(self.threads)),
            ("voxel", Given::Double(self.voxel)),
            ("merge_distance", Given::Double(self.merge_distance)),
            ("max_hole_length", Given::Double(self.max_hole_length)),
            ("min_component_share", Given::Double(self.min_component_share)),
            ("edge_limit", Given::Double(self.edge_limit)),
            ("grazing_limit", Given::Double(self.grazing_limit)),
            ("match_exposure", Given::Whole(self.match_exposure)),
            ("close", Given::Whole(self.close)),
            ("flat_base", Given::Whole(self.flat_base)),
            ("base_up", Given::Whole(self.base_up)),
        ]
    }
}

/// Sets the defaults. Call srf_merge_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_merge_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merge_params_init_sized(params: *mut srf_merge_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_merge_params::defaults()))
}
