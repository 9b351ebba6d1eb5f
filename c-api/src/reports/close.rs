//! Figures of close. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of closing. Starts with its size. Prepared by srf_close_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_close_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Size of a cell of the merge that was used. In the unit of the scans. Since 0.2.
    pub cell: f64,
    /// Size of a cell of the fill. It is twice a cell of the merge, more where memory asks for it. 0 if nothing was filled.
    /// In the unit of the scans. Since 0.2.
    pub fill_cell: f64,
    /// Merge distance that was used. In the unit of the scans. Since 0.2.
    pub merge_distance: f64,
    /// Longest boundary that was closed. There is none where length does not matter. Then it is SRF_FROM_DATA. In the unit
    /// of the scans. Since 0.2.
    pub max_hole_length: f64,
    /// Whether scans said where nothing is. Without them openings are closed by their shape alone. 1 or 0. Since 0.2.
    pub has_sight: u64,
    /// Openings closed. Since 0.2.
    pub closed: u64,
    /// Openings left open as none was to be closed. Since 0.2.
    pub left_not_asked: u64,
    /// Openings left open as their boundaries are longer than the longest hole. Since 0.2.
    pub left_too_long: u64,
    /// Openings left open as they may be rims. Since 0.2.
    pub left_not_enclosed: u64,
    /// Openings left open as a scan saw through where they would be closed. Since 0.2.
    pub left_seen_through: u64,
    /// Openings left open as each fill would cross the surface. Since 0.2.
    pub left_crossing: u64,
    /// Openings left open as the flat base cuts their fills. Since 0.2.
    pub left_base: u64,
    /// Openings left open as their fills would turn the surface inside out. Since 0.2.
    pub left_inside_out: u64,
    /// Length of the longest boundary of an opening that was closed. In the unit of the scans. Since 0.2.
    pub largest_opening: f64,
    /// Vertices that were added. Since 0.2.
    pub added_vertices: u64,
    /// Triangles that were added. Since 0.2.
    pub added_triangles: u64,
    /// Area of the triangles that were added, in the square of the unit of the surface. Since 0.2.
    pub filled_area: f64,
    /// Share of the result's area that was filled. Since 0.2.
    pub filled_share: f64,
    /// Triangles that were filled where a scan saw through, as was asked for. Since 0.2.
    pub forced_triangles: u64,
    /// Edges that are left open. Since 0.2.
    pub open_edges: u64,
    /// Whether the result is a closed manifold. 1 or 0. Since 0.2.
    pub is_closed: u64,
}

/// Prepares a struct of figures. Call srf_close_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_close_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_close_report_init_sized(report: *mut srf_close_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_close_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
