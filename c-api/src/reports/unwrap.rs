//! Figures of unwrap. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of unwrapping. Starts with its size. Prepared by srf_unwrap_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_unwrap_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Charts. Since 0.2.
    pub charts: u64,
    /// Charts before small ones were joined to their neighbours. Since 0.2.
    pub charts_before: u64,
    /// Tiles. Since 0.2.
    pub tiles: u64,
    /// Share of the tiles that triangles cover. Since 0.2.
    pub used: f64,
    /// Texels per unit of length: the root of the texels that triangles cover over their area on the surface. Since 0.2.
    pub texels_per_unit: f64,
    /// Mean stretch over the surface. The stretch of a triangle is the larger of its longest stretched length and the
    /// inverse of its shortest one, as a multiple of the texels per unit. 1 is none. Since 0.2.
    pub stretch: f64,
    /// Nineteen twentieths of the surface are stretched less. Since 0.2.
    pub stretch_p95: f64,
    /// Triangles that have no area in the texture: degenerate ones, and those too thin for single precision. Since 0.2.
    pub collapsed: u64,
    /// Their share of the surface. Since 0.2.
    pub collapsed_area: f64,
    /// Vertices that were moved as single precision turned one of their triangles. Since 0.2.
    pub moved: u64,
}

/// Prepares a struct of figures. Call srf_unwrap_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_unwrap_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_unwrap_report_init_sized(report: *mut srf_unwrap_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_unwrap_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
