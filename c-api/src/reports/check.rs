//! Figures of check. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// A mesh as a surface: counts, and what follows from them. Triangles that name a vertex out of range or a vertex twice are
/// counted, then left out of all that follows. So are vertices without a triangle. Starts with its size. Prepared by
/// srf_check_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_check_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Triangles, all of them.
    pub triangles: u64,
    /// Vertices that a triangle uses.
    pub vertices: u64,
    /// Vertices that none uses.
    pub unused_vertices: u64,
    /// Vertices with a coordinate that is not finite.
    pub non_finite_vertices: u64,
    /// Triangles that name a vertex that doesn't exist.
    pub out_of_range_triangles: u64,
    /// Triangles that name a vertex twice.
    pub degenerate_triangles: u64,
    /// Triangles of three different vertices whose area, computed in double precision, is zero.
    pub zero_area_triangles: u64,
    /// Triangles with the same three vertices as another one, beyond the first.
    pub duplicate_triangles: u64,
    /// Edges, each counted once.
    pub edges: u64,
    /// Edges of one triangle.
    pub boundary_edges: u64,
    /// Edges of more than two triangles.
    pub non_manifold_edges: u64,
    /// Edges whose two triangles run through it in the same direction.
    pub misoriented_edges: u64,
    /// Vertices whose triangles fall into more than one fan of triangles joined over edges.
    pub non_manifold_vertices: u64,
    /// Parts joined over edges.
    pub components: u64,
    /// Triangles of the largest part.
    pub largest_component: u64,
    /// Connected groups of boundary edges. They are closed loops on a manifold.
    pub boundary_loops: u64,
    /// Vertices - edges + triangles.
    pub euler_characteristic: i64,
    /// Whether the mesh is an oriented manifold with boundary, with finite coordinates and no degenerate or duplicate
    /// triangle. Triangles of zero area are no matter of topology. 1 or 0.
    pub is_manifold: u64,
    /// Whether it is a manifold without boundary. 1 or 0.
    pub is_closed: u64,
    /// Handles of all parts together, boundary loops taken as closed by disks. There are none unless it is a manifold. Then
    /// it is -1.
    pub genus: i64,
}

/// Prepares a struct of figures. Call srf_check_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_check_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_check_report_init_sized(report: *mut srf_check_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_check_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
