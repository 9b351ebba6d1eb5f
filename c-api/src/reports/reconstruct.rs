//! Figures of reconstruct. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// The figures of a surface through points. Starts with its size. Prepared by srf_reconstruct_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_reconstruct_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Points given.
    pub points: u64,
    /// Points on the surface.
    pub used: u64,
    /// Delaunay tetrahedra. None where the points lie in one plane.
    pub tetrahedra: u64,
    /// Whether the surface is closed: it has no border, also not one of a gap or of facets left out. 1 or 0.
    pub closed: u64,
    /// The threshold that was used: a perimeter with a global one, in mean spacings of a facet's points with a local one.
    pub threshold: f64,
    /// Times the mean perimeter was taken, with the paper's carving or in a plane.
    pub rounds: u64,
    /// Tetrahedra that changed sides to make the surface manifold.
    pub repaired: u64,
    /// Points brought onto the surface afterwards.
    pub gathered: u64,
    /// Facets left out: those over gaps, and those that kept the surface from being manifold.
    pub cut_facets: u64,
    /// Parts turned over by normals, sensors or direction.
    pub turned_parts: u64,
    /// Points dropped since a coordinate isn't finite.
    pub not_finite: u64,
    /// Points dropped since they are at the same place as a point before them.
    pub duplicates: u64,
    /// Points dropped inside of the surface.
    pub inside: u64,
    /// Points dropped outside of the surface.
    pub outside: u64,
    /// Noise of the points as measured: their standard deviation across the surface. 0 for fewer than 1,024. In the unit of
    /// the scans. Since 0.2.
    pub noise: f64,
    /// Side of a square of the surface that has one point, as measured. In the unit of the scans. Since 0.2.
    pub spacing: f64,
    /// Radius within which the surface was smoothed. 0 if it goes through the points. It was so many times smaller or
    /// larger where points that carry noise lie much closer together or further apart than usual. In the unit of the scans.
    /// Since 0.2.
    pub smoothing: f64,
    /// Root mean square of the distances by which smoothing moved the points on the surface. In the unit of the scans.
    /// Since 0.2.
    pub moved: f64,
    /// Points dropped since they are far from any surface that the others tell. Since 0.2.
    pub outliers: u64,
}

/// Prepares a struct of figures. Call srf_reconstruct_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_reconstruct_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_reconstruct_report_init_sized(
    report: *mut srf_reconstruct_report,
    size: usize,
) -> srf_status {
    guard(|| sized::init::<srf_reconstruct_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
