//! Figures of prepare_print. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of preparing a print. Lengths are in the unit of the result. Starts with its size. Prepared by
/// srf_prepare_print_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_prepare_print_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Factor by which the mesh was scaled. 1 if it was not. Since 0.2.
    pub scale: f64,
    /// Size along x. In the unit of the scans. Since 0.2.
    pub size_x: f64,
    /// Size along y. In the unit of the scans. Since 0.2.
    pub size_y: f64,
    /// Size along z. In the unit of the scans. Since 0.2.
    pub size_z: f64,
    /// Volume before all steps, in the cube of the unit of the input. Since 0.2.
    pub volume_before: f64,
    /// Volume of the result. Since 0.2.
    pub volume: f64,
    /// Largest distance by which a vertex that was kept moved, but for scaling. In the unit of the scans. Since 0.2.
    pub deviation: f64,
    /// Faces that were added. The attribute added marks them. Since 0.2.
    pub added_faces: u64,
    /// Height of the base above the lowest point. There is none if no base was asked for. Then it is SRF_FROM_DATA. In the
    /// unit of the scans. Since 0.2.
    pub base_height: f64,
    /// Faces of the base. Since 0.2.
    pub base_faces: u64,
    /// Area of the base without a hole in it, in the square of the unit. Since 0.2.
    pub base_area: f64,
    /// Thickness of the thinnest wall before walls were thickened, measured behind the centres of faces. There is none if
    /// that was not asked for, or no wall is thinner than twice that. Then it is SRF_FROM_DATA. In the unit of the scans.
    /// Since 0.2.
    pub wall_before: f64,
    /// Thickness of the thinnest wall after that. Faces beside a wall tilt when its sides move apart. So a wall at a sharp
    /// edge may be thinner than the thinnest before. Then it is SRF_FROM_DATA. In the unit of the scans. Since 0.2.
    pub wall_after: f64,
    /// Faces that moved when walls were thickened. Since 0.2.
    pub moved_faces: u64,
    /// Faces of the result whose walls are thinner than asked for. The attribute thin marks them. Since 0.2.
    pub thin_faces: u64,
    /// Cell in which the cavity was made. The walls are as thick as asked for within one. Then it is SRF_FROM_DATA. In the
    /// unit of the scans. Since 0.2.
    pub hollow_cell: f64,
    /// Least distance of the cavity from the surface. It is measured at the vertices and the centres of the faces of the
    /// cavity. There is none without a cavity. Then it is SRF_FROM_DATA. In the unit of the scans. Since 0.2.
    pub thinnest_wall: f64,
    /// Largest distance of the cavity from the surface, measured likewise. Then it is SRF_FROM_DATA. In the unit of the
    /// scans. Since 0.2.
    pub thickest_wall: f64,
    /// Cavities that no hole leads into. Since 0.2.
    pub shut_cavities: u64,
    /// Diameter of the largest hole that would find room. There is none if no drain was asked for. Then it is
    /// SRF_FROM_DATA. In the unit of the scans. Since 0.2.
    pub drain_room: f64,
    /// Whether a hole was made. 1 or 0. Since 0.2.
    pub is_drained: u64,
    /// Parts that it was cut into. 1 if it was not cut. Since 0.2.
    pub parts: u64,
}

/// Prepares a struct of figures. Call srf_prepare_print_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_prepare_print_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_prepare_print_report_init_sized(
    report: *mut srf_prepare_print_report,
    size: usize,
) -> srf_status {
    guard(|| sized::init::<srf_prepare_print_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
