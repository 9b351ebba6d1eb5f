//! Figures of sculpt. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of sculpting. Starts with its size. Prepared by srf_sculpt_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_sculpt_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Tolerance that was used. In the unit of the scans.
    pub tolerance: f64,
    /// Difference between the farthest and the nearest range of the covered samples. In the unit of the scans.
    pub depth_extent: f64,
    /// Triangles of the mesh that has every covered sample.
    pub full_triangles: u64,
    /// Triangles left out because they hide behind others, as seen along the rays. The tolerance does not hold for samples
    /// that have only such triangles. These samples count as isolated.
    pub hidden_triangles: u64,
    /// Triangles before vertices were removed.
    pub dug_triangles: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Valid pixels that no mesh covers, for want of neighbours or because they are hidden behind others. The tolerance
    /// does not hold for them.
    pub isolated_pixels: u64,
    /// Largest distance between a sample and the mesh along the sample's ray. In the unit of the scans.
    pub max_error: f64,
    /// Largest distance once coordinates are rounded to single precision, as STL, GLB and many programs keep them, at most.
    /// In the unit of the scans.
    pub max_error_single: f64,
    /// Root of the mean square of the distances. In the unit of the scans.
    pub rms_error: f64,
    /// 95 % of the samples lie at most this far from the mesh. In the unit of the scans.
    pub p95_error: f64,
    /// Row of the sample farthest from the mesh, the first one of several. There is none for an empty mesh. Then it is
    /// UINT64_MAX.
    pub worst_row: u64,
    /// Its column. There is none for an empty mesh. Then it is UINT64_MAX.
    pub worst_col: u64,
    /// Samples that the mesh covers: their rays meet it.
    pub covered_pixels: u64,
}

/// Prepares a struct of figures. Call srf_sculpt_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_sculpt_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculpt_report_init_sized(report: *mut srf_sculpt_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_sculpt_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
