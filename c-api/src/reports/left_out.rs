//! Figures of left_out. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// Samples that were left out of a frame, or of several, each counted for the first reason that it has. Starts with its
/// size. Prepared by srf_left_out_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_left_out_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Samples that were measured.
    pub of: u64,
    /// Those of too low a confidence.
    pub low_confidence: u64,
    /// Those beyond the reach of the sensor.
    pub out_of_reach: u64,
    /// Those seen through the black rim of the colour image.
    pub black_rim: u64,
    /// Those far beyond all others of their frame, which stand for no measurement.
    pub far: u64,
}

/// Prepares a struct of figures. Call srf_left_out_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_left_out_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_left_out_report_init_sized(report: *mut srf_left_out_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_left_out_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
