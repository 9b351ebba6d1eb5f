//! Figures of check_print. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of the checks for printing. Starts with its size. Prepared by srf_check_print_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_check_print_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Whether the mesh is an oriented manifold without openings. 1 or 0. Since 0.2.
    pub is_closed: u64,
    /// Whether it is an oriented manifold, with or without openings. 1 or 0. Since 0.2.
    pub is_manifold: u64,
    /// Openings: groups of open edges that hang together. Since 0.2.
    pub openings: u64,
    /// Edges of one face. Since 0.2.
    pub open_edges: u64,
    /// Edges of more than two faces. Since 0.2.
    pub non_manifold_edges: u64,
    /// Vertices at which more than one fan of faces meets. Since 0.2.
    pub non_manifold_vertices: u64,
    /// Edges whose two faces are turned against each other. Since 0.2.
    pub misoriented_edges: u64,
    /// Pairs of faces that cross. This is exact. Since 0.2.
    pub crossing_pairs: u64,
    /// Faces that cross another. Since 0.2.
    pub crossing_faces: u64,
    /// Bodies: faces joined over edges. A cavity is a body, too. Since 0.2.
    pub bodies: u64,
    /// Size along x. In the unit of the scans. Since 0.2.
    pub size_x: f64,
    /// Size along y. In the unit of the scans. Since 0.2.
    pub size_y: f64,
    /// Size along z. In the unit of the scans. Since 0.2.
    pub size_z: f64,
    /// Whether it fits into the printer, as it is or turned by a quarter about the vertical. 1 or 0. Since 0.2.
    pub is_fitting: u64,
    /// Volume of all bodies together, in the cube of the unit of the mesh. There is none unless the mesh is closed. Then it
    /// is SRF_FROM_DATA. Since 0.2.
    pub volume: f64,
    /// Volume times density. There is none without either. Then it is SRF_FROM_DATA. Since 0.2.
    pub weight: f64,
    /// Thickness up to which walls are measured. In the unit of the scans. Since 0.2.
    pub wall_limit: f64,
    /// Thickness of the thinnest wall. There is none if no wall is thinner than they are measured. Then it is
    /// SRF_FROM_DATA. In the unit of the scans. Since 0.2.
    pub thinnest_wall: f64,
    /// Number of the face in front of the thinnest wall, counted from 0. There is none without such a wall. Then it is
    /// UINT64_MAX. Since 0.2.
    pub thinnest_face: u64,
    /// Faces whose walls are thinner than the thinnest wall that the printer makes, by more than the error of measuring, 2
    /// %. Since 0.2.
    pub thin_faces: u64,
    /// Largest distance of a corner from the centre of its face. Walls are measured at centres. Where faces are larger than
    /// walls are thick, a wall may be thinner between them. In the unit of the scans. Since 0.2.
    pub wall_spacing: f64,
    /// Faces that hang over and do not lie on the ground. Since 0.2.
    pub overhang_faces: u64,
    /// Area of the faces that hang over, in the square of the unit of the mesh. Since 0.2.
    pub overhang_area: f64,
}

/// Prepares a struct of figures. Call srf_check_print_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_check_print_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_check_print_report_init_sized(
    report: *mut srf_check_print_report,
    size: usize,
) -> srf_status {
    guard(|| sized::init::<srf_check_print_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
