//! Figures of texture. Written by `make generate` from their declaration in the core: change that.

use crate::guard::guard;
use crate::sized;
use crate::status::srf_status;

/// A photo, and how it was used. Starts with its size. Prepared by srf_textured_photo_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_textured_photo {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Texels that it sees. Since 0.2.
    pub texels: u64,
    /// Factors of its light: red, green, blue. Since 0.2.
    pub gain: [f64; 3],
    /// Distance by which its camera was moved: pixels, in the root mean square over the surface. Since 0.2.
    pub moved: f64,
}

/// Prepares a struct of figures. Call srf_textured_photo_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_textured_photo): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_textured_photo_init_sized(report: *mut srf_textured_photo, size: usize) -> srf_status {
    guard(|| sized::init::<srf_textured_photo>("report", report, size, bytemuck::Zeroable::zeroed()))
}

/// The figures of texturing. Starts with its size. Prepared by srf_texture_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_texture_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Tiles. Since 0.2.
    pub tiles: u64,
    /// Texels that triangles cover. Since 0.2.
    pub texels: u64,
    /// Texels that a photo sees. Since 0.2.
    pub seen: u64,
    /// Number of photos. The photos, in the order in which they were given. Since 0.2.
    pub photos_count: u64,
    /// Grey by which the photos differed before cameras were moved. There is none if no camera could be moved. Then it is
    /// SRF_FROM_DATA. Since 0.2.
    pub difference_before: f64,
    /// Grey by which the photos differ after that. There is none if no camera could be moved. Then it is SRF_FROM_DATA.
    /// Since 0.2.
    pub difference_after: f64,
    /// Height that 0 of the height map stands for. There is none without a height map. Then it is SRF_FROM_DATA. In the
    /// unit of the scans. Since 0.2.
    pub lowest: f64,
    /// Height that 65,535 of the height map stands for. There is none without a height map. Then it is SRF_FROM_DATA. In
    /// the unit of the scans. Since 0.2.
    pub highest: f64,
}

/// Prepares a struct of figures. Call srf_texture_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_texture_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_texture_report_init_sized(report: *mut srf_texture_report, size: usize) -> srf_status {
    guard(|| sized::init::<srf_texture_report>("report", report, size, bytemuck::Zeroable::zeroed()))
}
