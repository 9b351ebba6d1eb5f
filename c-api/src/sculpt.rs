//! Sculpting a range image to few triangles within a tolerance.

use std::borrow::Borrow;
use std::sync::Arc;

use surfrecon::range_image::RangeImage;
use surfrecon::sculpt::{SculptParams, Sculpted, Sculptor, Tolerance};
use surfrecon::triangulate::TriangulateParams;

use crate::guard::guard;
use crate::handle::{self, handle};
use crate::image::{Image, srf_image, srf_triangulate_params};
use crate::mesh::srf_mesh;
use crate::progress::{srf_progress, watched};
use crate::settings::{SRF_FROM_DATA, from_data, threads};
use crate::status::{Failure, srf_status, srf_status::SRF_ERR_PARAMETER};
use crate::{pointer, sized};

/// An image that its sculptor keeps.
pub struct Kept(Arc<Image>);

impl Borrow<RangeImage> for Kept {
    fn borrow(&self) -> &RangeImage {
        &self.0.image
    }
}

/// An image ready to be sculpted, and the tolerance that is meant where none is given.
pub struct Prepared {
    sculptor: Sculptor<Kept>,
    tolerance: Tolerance,
}

/// A range image ready to be sculpted to one tolerance after the other. Released with srf_sculptor_free().
#[allow(non_camel_case_types)]
pub struct srf_sculptor {
    _opaque: [u8; 0],
}

handle!(srf_sculptor, Prepared);

/// How an image is sculpted. Starts with its size; set to the defaults by srf_sculpt_params_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_sculpt_params {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Worker threads, at most 1024; 0, the default, for the number of srf_set_threads(). Results are the same for any number.
    pub threads: u32,
    /// Largest distance between a sample and the mesh along the sample's ray, in the unit of the samples, >= 0; 0 reproduces
    /// every sample. SRF_FROM_DATA, the default: relative_tolerance times the depth extent.
    pub tolerance: f64,
    /// The tolerance as a share of the depth extent, >= 0: of the difference between the farthest and the nearest range of the
    /// covered samples. Looked at where tolerance is SRF_FROM_DATA. Default 0.001.
    pub relative_tolerance: f64,
    /// Work spent on fewer triangles at the same tolerance: 0 digs only, 1, the default, also removes vertices, 2 searches for
    /// fewer yet.
    pub effort: u64,
    /// As in srf_triangulate_params.
    pub edge_limit: f64,
    /// As in srf_triangulate_params.
    pub grazing_limit: f64,
    /// 1, the default: every vertex is a sample. 0: vertices may leave their samples along the ray, within the tolerance, for
    /// fewer triangles.
    pub interpolate: u64,
    /// Smallest angle of triangles that replace others, as seen from the sensor, 0, the default, to pi/6 radians.
    pub min_angle: f64,
    /// 0, the default: open borders stay as they are in the image but for vertices on straight lines. 1: they are simplified,
    /// too, for fewer triangles; the mesh reaches at most half a pixel beyond them and covers no other pixel. Needs an effort of
    /// at least 1.
    pub simplify_borders: u64,
}

impl srf_sculpt_params {
    fn defaults() -> Self {
        let core = SculptParams::default();
        let triangulation = srf_triangulate_params::defaults();
        let (tolerance, relative_tolerance) = match core.tolerance {
            Tolerance::Absolute(tolerance) => (tolerance, 0.0),
            Tolerance::OfDepthExtent(share) => (SRF_FROM_DATA, share),
        };
        srf_sculpt_params {
            struct_size: size_of::<Self>() as u32,
            threads: core.threads as u32,
            tolerance,
            relative_tolerance,
            effort: u64::from(core.effort),
            edge_limit: triangulation.edge_limit,
            grazing_limit: triangulation.grazing_limit,
            interpolate: u64::from(core.interpolate),
            min_angle: core.min_angle,
            simplify_borders: u64::from(core.simplify_borders),
        }
    }

    fn to_core(self) -> Result<SculptParams, Failure> {
        for (name, value) in [("interpolate", self.interpolate), ("simplify_borders", self.simplify_borders)] {
            if value > 1 {
                return Err(Failure::new(SRF_ERR_PARAMETER, format!("params.{name} must be 0 or 1, got {value}")));
            }
        }
        Ok(SculptParams {
            tolerance: from_data(self.tolerance)
                .map_or(Tolerance::OfDepthExtent(self.relative_tolerance), Tolerance::Absolute),
            // What does not fit is out of range anyway.
            effort: u32::try_from(self.effort).unwrap_or(u32::MAX),
            triangulation: TriangulateParams {
                edge_limit: from_data(self.edge_limit),
                grazing_limit: self.grazing_limit,
            },
            interpolate: self.interpolate == 1,
            min_angle: self.min_angle,
            simplify_borders: self.simplify_borders == 1,
            threads: threads(self.threads),
        })
    }
}

/// How far a sculpted mesh lies from the samples, measured on the result along the samples' rays. Starts with its size;
/// prepared by srf_certificate_init(). Lengths are in the unit of the samples.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_certificate {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// Tolerance that was used.
    pub tolerance: f64,
    /// Difference between the farthest and the nearest range of the covered samples.
    pub depth_extent: f64,
    /// Largest distance.
    pub max_error: f64,
    /// Root of the mean square.
    pub rms_error: f64,
    /// 95 % of the samples lie at most this far from the mesh.
    pub p95_error: f64,
    /// Row of the sample farthest from the mesh.
    pub worst_row: u64,
    /// Its column.
    pub worst_col: u64,
    /// Samples whose rays meet the mesh.
    pub samples: u64,
    /// Valid pixels that no mesh covers, for want of neighbours or hidden behind others.
    pub isolated_pixels: u64,
    /// Triangles of the mesh that has every sample.
    pub full_triangles: u64,
    /// Triangles of the result.
    pub triangles: u64,
}

impl From<&Sculpted> for srf_certificate {
    fn from(sculpted: &Sculpted) -> Self {
        let (certificate, report) = (&sculpted.certificate, &sculpted.report);
        let [worst_row, worst_col] = certificate.worst_pixel.unwrap_or_default().map(|place| place as u64);
        srf_certificate {
            struct_size: size_of::<Self>() as u32,
            reserved: 0,
            tolerance: report.tolerance,
            depth_extent: report.depth_extent,
            max_error: certificate.max_error,
            rms_error: certificate.rms_error,
            p95_error: certificate.p95_error,
            worst_row,
            worst_col,
            samples: certificate.covered as u64,
            isolated_pixels: report.isolated_pixels as u64,
            full_triangles: report.full_triangles as u64,
            triangles: report.triangles as u64,
        }
    }
}

/// Sets the defaults. Call srf_sculpt_params_init(params), which adds the size that this header knows.
/// params   not NULL
/// size     sizeof(srf_sculpt_params): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculpt_params_init_sized(params: *mut srf_sculpt_params, size: usize) -> srf_status {
    guard(|| sized::init("params", params, size, srf_sculpt_params::defaults()))
}

/// Prepares a struct for srf_sculptor_refine(). Call srf_certificate_init(certificate), which adds the size that this header knows.
/// certificate  not NULL
/// size         sizeof(srf_certificate): what of the struct this library does not know becomes 0
/// returns      SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_certificate_init_sized(certificate: *mut srf_certificate, size: usize) -> srf_status {
    guard(|| sized::init("certificate", certificate, size, srf_certificate::default()))
}

/// Makes an image ready to be sculpted: finds where the mesh may be, once for all tolerances. O(pixels). The image is kept as
/// it is now; it may be freed or changed afterwards.
/// image         not NULL
/// params        NULL for the defaults
/// progress      NULL for none
/// out_sculptor  receives a new handle on SRF_OK only; not NULL
/// returns       SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
///               SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculptor_create(
    image: *const srf_image,
    params: *const srf_sculpt_params,
    progress: *const srf_progress,
    out_sculptor: *mut *mut srf_sculptor,
) -> srf_status {
    guard(|| {
        pointer::writable("out_sculptor", out_sculptor)?;
        let image = handle::get("image", image)?;
        let params = sized::read("params", params, srf_sculpt_params::defaults())?.to_core()?;
        let sculptor = Sculptor::prepare(Kept(image), &params, &watched(progress))?;
        handle::give("out_sculptor", out_sculptor, Prepared { sculptor, tolerance: params.tolerance })
    })
}

/// Releases a sculptor.
/// sculptor   NULL does nothing
/// returns    SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculptor_free(sculptor: *mut srf_sculptor) -> srf_status {
    guard(|| handle::free("sculptor", sculptor))
}

/// The mesh of few triangles within a tolerance, finer or coarser than any before; it does not depend on those. In the
/// sensor's frame; srf_image_camera() places it. Every sample's ray meets the mesh within the tolerance, nothing covers an
/// invalid pixel or bridges a jump, and seen from the sensor the mesh covers every place at most once. Vertex attributes:
/// range_row, range_col, error, and colour, intensity, confidence where the image has them; of triangles: error.
/// sculptor         not NULL
/// tolerance        in the unit of the samples, >= 0; SRF_FROM_DATA for that of the params of srf_sculptor_create()
/// progress         NULL for none
/// out_mesh         receives a new handle on SRF_OK only; not NULL
/// out_certificate  initialized by srf_certificate_init(); NULL if not wanted
/// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculptor_refine(
    sculptor: *const srf_sculptor,
    tolerance: f64,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_certificate: *mut srf_certificate,
) -> srf_status {
    guard(|| {
        sculpt("sculptor", sculptor, out_mesh, out_certificate, |prepared| {
            let tolerance = from_data(tolerance).map_or(prepared.tolerance, Tolerance::Absolute);
            prepared.sculptor.refine(tolerance, &watched(progress))
        })
    })
}

/// The mesh of the smallest tolerance found that has at most a number of triangles; up to 24 times the work of
/// srf_sculptor_refine(), whose mesh of the tolerance in out_certificate it is.
/// sculptor         not NULL
/// max_triangles    what the mesh may have at most
/// progress         NULL for none
/// out_mesh         receives a new handle on SRF_OK only; not NULL
/// out_certificate  initialized by srf_certificate_init(); NULL if not wanted
/// returns          SRF_OK, SRF_ERR_INPUT if any mesh that covers the image has more, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///                  SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculptor_at_most(
    sculptor: *const srf_sculptor,
    max_triangles: usize,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_certificate: *mut srf_certificate,
) -> srf_status {
    guard(|| {
        sculpt("sculptor", sculptor, out_mesh, out_certificate, |prepared| {
            prepared.sculptor.at_most(max_triangles, &watched(progress))
        })
    })
}

/// What both ways to sculpt have in common.
fn sculpt(
    name: &str,
    sculptor: *const srf_sculptor,
    out_mesh: *mut *mut srf_mesh,
    out_certificate: *mut srf_certificate,
    work: impl FnOnce(&Prepared) -> surfrecon::Result<Sculpted>,
) -> Result<(), Failure> {
    pointer::writable("out_mesh", out_mesh)?;
    if !out_certificate.is_null() {
        sized::writable("out_certificate", out_certificate)?;
    }
    let prepared = handle::get(name, sculptor)?;
    let sculpted = work(&prepared)?;
    if !out_certificate.is_null() {
        sized::write("out_certificate", out_certificate, (&sculpted).into())?;
    }
    handle::give("out_mesh", out_mesh, sculpted.mesh.into())
}
