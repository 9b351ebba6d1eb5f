//! Figures of quads. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of a quad grid. Errors are distances along the samples' rays to the planes of the triangles of the pixels'
/// quads, over all valid pixels of the image but those missed, with each quad cut along its better diagonal. On the
/// background the grid continues the surface. Starts with its size. Prepared by srf_quads_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_quads_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Tiles from top to bottom.
    pub tiles_down: u64,
    /// Tiles from left to right.
    pub tiles_across: u64,
    /// Difference between the farthest and the nearest range of the valid pixels. In the unit of the scans.
    pub depth_extent: f64,
    /// Mean error as a share of the depth extent, the paper's relative error. 0 where all ranges are equal.
    pub relative_error: f64,
    /// Relative error of the uniform grid of the same size.
    pub uniform_relative_error: f64,
    /// Root of the mean square error. In the unit of the scans.
    pub rms_error: f64,
    /// Root of the mean square error of the uniform grid. In the unit of the scans.
    pub uniform_rms_error: f64,
    /// Largest error. In the unit of the scans.
    pub max_error: f64,
    /// Largest error of the uniform grid. In the unit of the scans.
    pub uniform_max_error: f64,
    /// Whether the result is the uniform grid, as the adaptive one lay no nearer. Vertices snapped to the border moved all
    /// the same. 1 or 0.
    pub is_uniform: u64,
    /// Valid pixels of the image.
    pub valid_pixels: u64,
    /// Valid pixels whose rays do not meet the planes of their quad in front of the sensor. They have no error.
    pub missed_pixels: u64,
    /// Missed pixels of the uniform grid.
    pub uniform_missed_pixels: u64,
    /// Invalid pixels that were filled.
    pub gaps_filled: u64,
    /// Vertices that were moved so that no quad folds over.
    pub unfolded: u64,
    /// Vertices that were moved from the background onto the border of the surface.
    pub snapped: u64,
    /// Quads of the mesh: those that are not on the background.
    pub quads: u64,
}

/// Prepares a struct of figures. Call srf_quads_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_quads_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_quads_report_init_sized(report: *mut srf_quads_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_quads_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
