//! Figures of snap. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::pose::srf_pose;
use crate::reports::align::srf_freedom;
use crate::sized;
use crate::status::srf_status;

/// The place that a scan was drawn to by hand, and how well it lies there. Starts with its size. Prepared by
/// srf_snap_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_snap_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// The pose that the scan was drawn to. It is the pose that the scan had if it touches nothing.
    pub world_from_scan: srf_pose,
    /// Whether it fits there, and if not, why: one of `fits`, `misfit`, `slides`, `seen_through` and `nothing`. A value of
    /// srf_pair_state, such as SRF_PAIR_STATE_NOTHING.
    pub state: u64,
    /// Number of touches. Numbers of the scans that it touches, the nearest first.
    pub touches_count: u64,
    /// Share of its surface that lies on the scan that shares most with it.
    pub overlap: f64,
    /// Root mean square distance to the surfaces of the others, along normals. In the unit of the scans.
    pub residual: f64,
    /// How well it is held against turning and sliding: 1 at best, 0 where it may turn or slide.
    pub balance: f64,
    /// Of what the sensors can tell, the share that speaks against it.
    pub seen_through: f64,
    /// How far its points moved, at most. In the unit of the scans.
    pub moved: f64,
    /// Number of freedoms. Ways that it may turn or slide.
    pub freedoms_count: u64,
    /// Ways that it may turn or slide. Those behind them are 0.
    pub freedoms: [srf_freedom; 6],
}

/// Prepares a struct of figures. Call srf_snap_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_snap_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_snap_report_init_sized(report: *mut srf_snap_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_snap_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
