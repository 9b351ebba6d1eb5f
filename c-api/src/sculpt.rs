//! Sculpting a range image to few triangles within a tolerance.

use std::borrow::Borrow;

use surfrecon::Progress;
use surfrecon::range_image::RangeImage;
use surfrecon::sculpt::{SculptParams, Sculpted, Sculptor, Tolerance};

use crate::guard::guard;
use crate::handle::{self, Shared, handle};
use crate::image::{Image, srf_image};
use crate::mesh::srf_mesh;
use crate::params::sculpt::srf_sculpt_params;
use crate::progress::{srf_progress, watched};
use crate::settings::from_data;
use crate::status::{Failure, srf_status};
use crate::{params, pointer, sized};

/// An image that its sculptor keeps.
pub struct Kept(Shared<Image>);

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
    /// Valid pixels that no mesh covers, for want of neighbours or hidden behind others. The tolerance does not hold for them.
    pub isolated_pixels: u64,
    /// Triangles of the mesh that has every sample.
    pub full_triangles: u64,
    /// Triangles of the result.
    pub triangles: u64,
    /// Largest distance once coordinates are rounded to single precision, as STL, GLB and many programs keep them.
    pub max_error_single: f64,
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
            max_error_single: certificate.max_error_single,
        }
    }
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
        let params = params::read::<SculptParams, _>("params", params)?;
        watched(progress, |progress| {
            let sculptor = Sculptor::prepare(Kept(image), &params, progress)?;
            handle::give("out_sculptor", out_sculptor, Prepared { sculptor, tolerance: params.tolerance })
        })
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
/// invalid pixel or bridges a jump, and seen from the sensor the mesh covers every place at most once. One exception: samples
/// whose triangles all hide behind others, as seen along the rays, are not covered and have no bound; they count as
/// isolated_pixels. Vertex attributes:
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
        sculpt("sculptor", sculptor, progress, out_mesh, out_certificate, |prepared, progress| {
            let tolerance = from_data(tolerance).map_or(prepared.tolerance, Tolerance::Absolute);
            prepared.sculptor.refine(tolerance, progress)
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
        sculpt("sculptor", sculptor, progress, out_mesh, out_certificate, |prepared, progress| {
            prepared.sculptor.at_most(max_triangles, progress)
        })
    })
}

/// What both ways to sculpt have in common.
fn sculpt(
    name: &str,
    sculptor: *const srf_sculptor,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_certificate: *mut srf_certificate,
    work: impl FnOnce(&Prepared, &Progress<'_>) -> surfrecon::Result<Sculpted>,
) -> Result<(), Failure> {
    pointer::writable("out_mesh", out_mesh)?;
    if !out_certificate.is_null() {
        sized::writable("out_certificate", out_certificate)?;
    }
    let prepared = handle::get(name, sculptor)?;
    watched(progress, |progress| {
        let sculpted = work(&prepared, progress)?;
        if !out_certificate.is_null() {
            sized::write("out_certificate", out_certificate, (&sculpted).into())?;
        }
        handle::give("out_mesh", out_mesh, sculpted.mesh.into())
    })
}
