//! Figures of distance. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// Distances of points, or of a surface, from another surface. All figures but `bias` are of absolute values. Starts with
/// its size. Prepared by srf_distance_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_distance_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Distances that were measured: of the points, or of the surface's vertices.
    pub count: u64,
    /// Their mean. In the unit of the scans.
    pub mean: f64,
    /// Root of their mean square. In the unit of the scans.
    pub rms: f64,
    /// The smallest value that at least 95 % of them do not exceed. In the unit of the scans.
    pub p95: f64,
    /// The largest of them. In the unit of the scans.
    pub max: f64,
    /// Their mean with signs. Without signs it is the mean. In the unit of the scans.
    pub bias: f64,
    /// Index of the largest, the first of several. There is none where nothing was measured. Then it is UINT64_MAX.
    pub worst: u64,
    /// Largest distance that was found on a surface, between its vertices too. There is none for points. Then it is
    /// SRF_FROM_DATA. In the unit of the scans.
    pub reached: f64,
    /// No point of the surface is farther. It is within 1 % of `reached`, or above it by a millionth of the extent of the
    /// other surface, unless that takes more than 8 measurements for each vertex and 100,000. There is none for points.
    /// Then it is SRF_FROM_DATA. In the unit of the scans.
    pub bound: f64,
}

/// Prepares a struct of figures. Call srf_distance_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_distance_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_distance_report_init_sized(report: *mut srf_distance_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_distance_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
