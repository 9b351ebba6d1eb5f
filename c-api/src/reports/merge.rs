//! Figures of merge. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// Rule that decided the size of a cell.
#[allow(non_camel_case_types, dead_code)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_voxel_reason {
    /// The caller gave it.
    SRF_VOXEL_REASON_GIVEN = 1,
    /// 1.5 times the mean distance of neighbouring samples.
    SRF_VOXEL_REASON_SPACING = 2,
    /// Half the median standard deviation of the samples.
    SRF_VOXEL_REASON_NOISE = 3,
    /// 1.5 times the median distance between scans that overlap.
    SRF_VOXEL_REASON_DISTANCE = 4,
    /// Coarser than that, so that it fits into memory: by the limit and the scans alone, or, where there is no limit, by
    /// what is free at that moment.
    SRF_VOXEL_REASON_MEMORY = 5,
}

/// The figures of a merge, among them those of the paper's tables. Starts with its size. Prepared by
/// srf_merge_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_merge_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Scans merged.
    pub scans: u64,
    /// Triangles of all scans.
    pub input_triangles: u64,
    /// Size of a cell that was used. In the unit of the scans.
    pub voxel: f64,
    /// Rule that decided the size of a cell. A value of srf_voxel_reason, such as SRF_VOXEL_REASON_GIVEN.
    pub voxel_reason: u64,
    /// Merge distance that was used. In the unit of the scans.
    pub merge_distance: f64,
    /// Longest boundary that was closed. In the unit of the scans.
    pub max_hole_length: f64,
    /// Median distance between overlapping scans along grid lines, as measured. There is none where no scans overlap. Then
    /// it is SRF_FROM_DATA. In the unit of the scans.
    pub overlap_residual: f64,
    /// Median standard deviation of the samples along their rays, as measured. 0 where scans are clean. In the unit of the
    /// scans.
    pub noise: f64,
    /// Median standard deviation of the samples of range images across the rays. It follows from how noise grows on
    /// surfaces seen at an angle. In the unit of the scans.
    pub noise_across: f64,
    /// Median step that values of range images along the ray are multiples of. 0 for none. In the unit of the scans.
    pub noise_step: f64,
    /// Median number of pixels of range images over which errors depend on each other. 1 for white noise.
    pub noise_correlation: f64,
    /// Cells that the scans span along x, y and z.
    pub grid: [u64; 3],
    /// Intersections of scans with grid lines.
    pub intersections: u64,
    /// Edges of the grid whose intersections were dropped since more scans see through there than have a surface there. A
    /// triangle has about one and a half.
    pub seen_through: u64,
    /// Intersections left after fusing.
    pub fused_intersections: u64,
    /// Artificial intersections that became vertices.
    pub artificial_intersections: u64,
    /// Triangles made directly (case a).
    pub faces_direct: u64,
    /// Triangles made after analysis of the neighbouring cells (case b).
    pub faces_settled: u64,
    /// Triangles that fill holes (case c).
    pub faces_filling: u64,
    /// Holes closed.
    pub holes_closed: u64,
    /// Boundary loops left open.
    pub holes_open: u64,
    /// Connected parts dropped: those that no scan saw, and those that are too small.
    pub dropped_components: u64,
    /// Triangles of the parts that were dropped.
    pub dropped_faces: u64,
    /// Largest number of bytes that intersections and the surface held at once.
    pub working_bytes: u64,
    /// Whether stages left in files what they leave for each other. 1 or 0.
    pub in_files: u64,
    /// Length of the shortest edge of the surface. It is at least a hundredth of a cell. In the unit of the scans. Since
    /// 0.2.
    pub shortest_edge: f64,
    /// Holes of these that are open as a scan saw through where they would be closed. Since 0.2.
    pub holes_seen_through: u64,
    /// Area that was filled, in the square of the unit of the scans. There is none where holes alone were closed. Then it
    /// is SRF_FROM_DATA. Since 0.2.
    pub filled_area: f64,
    /// Share of the area of the surface that was filled. There is none where holes alone were closed. Then it is
    /// SRF_FROM_DATA. Since 0.2.
    pub filled_share: f64,
}

/// Prepares a struct of figures. Call srf_merge_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_merge_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merge_report_init_sized(report: *mut srf_merge_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_merge_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
