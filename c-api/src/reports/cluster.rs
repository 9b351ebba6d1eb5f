//! Figures of cluster. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of clustering. Starts with its size. Prepared by srf_cluster_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_cluster_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Patches made.
    pub patches: u64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Triangles of the mesh.
    pub triangles: u64,
    /// Parts of patches that became patches as they were not connected to the rest.
    pub separated: u64,
    /// Parts and patches that were given to their neighbours.
    pub dissolved: u64,
    /// Patches that were halved as they were no disks.
    pub halved: u64,
    /// Edges of the input that were cut as they don't join two triangles of the same orientation.
    pub cut_edges: u64,
    /// Points that are not on the surface through them. 0 for a mesh.
    pub off_surface: u64,
    /// Weighted sum of the squared distances of the input's vertices to their centres, after the last step of k-means.
    pub energy: f64,
    /// Before: Mean over the triangles of their smallest angle. It is pi/3 where all are equilateral. Radians.
    pub before_mean_smallest_angle: f64,
    /// Before: Smallest angle of all. Radians.
    pub before_smallest_angle: f64,
    /// Before: Largest angle of all. Radians.
    pub before_largest_angle: f64,
    /// After: Mean over the triangles of their smallest angle. It is pi/3 where all are equilateral. Radians.
    pub after_mean_smallest_angle: f64,
    /// After: Smallest angle of all. Radians.
    pub after_smallest_angle: f64,
    /// After: Largest angle of all. Radians.
    pub after_largest_angle: f64,
    /// No point of the input is farther from the mesh, and none of the mesh farther from the input, measured on the mesh.
    /// Some point is nearly as far: the bound is seldom more than 1 % above it, unless a largest error was asked for. 0 for
    /// the input itself. In the unit of the scans.
    pub max_error: f64,
    /// Whether the mesh is the input, as nothing coarser was found within the largest error, or has its topology. 1 or 0.
    pub kept_input: u64,
    /// Root mean square of the distances of the input's vertices from the mesh. In the unit of the scans. Since 0.2.
    pub rms_error: f64,
}

/// Prepares a struct of figures. Call srf_cluster_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_cluster_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_cluster_report_init_sized(report: *mut srf_cluster_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_cluster_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
