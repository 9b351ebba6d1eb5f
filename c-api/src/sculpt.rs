//! Sculpting a range image to few triangles within a tolerance.

use surfrecon::Progress;
use surfrecon::reports::Report as _;
use surfrecon::sculpt::{SculptParams, Sculpted, Sculptor, Tolerance};

use crate::guard::guard;
use crate::handle::{self, handle};
use crate::image::srf_image;
use crate::mesh::srf_mesh;
use crate::params::sculpt::srf_sculpt_params;
use crate::progress::{srf_progress, watched};
use crate::reports::sculpt::srf_sculpt_report;
use crate::settings::from_data;
use crate::sources::KeptImage;
use crate::status::{Failure, srf_status};
use crate::{params, pointer, report, sized};

/// An image ready to be sculpted, and the tolerance that is meant where none is given.
pub struct Prepared {
    sculptor: Sculptor<KeptImage>,
    tolerance: Tolerance,
}

/// A range image ready to be sculpted to one tolerance after the other. Released with srf_sculptor_free().
#[allow(non_camel_case_types)]
pub struct srf_sculptor {
    _opaque: [u8; 0],
}

handle!(srf_sculptor, Prepared);

/// Makes an image ready to be sculpted: finds where the mesh may be, once for all tolerances. O(pixels). The image is kept as it is now. It
/// may be freed or changed afterwards.
/// image         not NULL
/// params        NULL for the defaults
/// progress      NULL for none
/// out_sculptor  receives a new handle on SRF_OK only. Not NULL
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
            let sculptor = Sculptor::prepare(KeptImage(image), &params, progress)?;
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

/// The mesh of few triangles within a tolerance, finer or coarser than any before. It does not depend on those. In the sensor's frame.
/// srf_image_camera() places it. Every sample's ray meets the mesh within the tolerance, nothing covers an invalid pixel or bridges a jump,
/// and seen from the sensor the mesh covers every place at most once. One exception: samples whose triangles all hide behind others, as
/// seen along the rays, are not covered and have no bound. They count as isolated_pixels. Vertex attributes: range_row, range_col, error,
/// and colour, intensity, confidence where the image has them. Attribute of triangles: error.
/// sculptor         not NULL
/// tolerance        in the unit of the samples, >= 0. SRF_FROM_DATA for that of the params of srf_sculptor_create()
/// progress         NULL for none
/// out_mesh         receives a new handle on SRF_OK only. Not NULL
/// out_report       initialized by srf_sculpt_report_init(). NULL if not wanted
/// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculptor_refine(
    sculptor: *const srf_sculptor,
    tolerance: f64,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_sculpt_report,
) -> srf_status {
    guard(|| {
        sculpt("sculptor", sculptor, progress, out_mesh, out_report, |prepared, progress| {
            let tolerance = from_data(tolerance).map_or(prepared.tolerance, Tolerance::Absolute);
            prepared.sculptor.refine(tolerance, progress)
        })
    })
}

/// The mesh of the smallest tolerance found that has at most a number of triangles. It takes up to 24 times the work of
/// srf_sculptor_refine(), and is the mesh that this makes with the tolerance in out_report.
/// sculptor         not NULL
/// max_triangles    what the mesh may have at most
/// progress         NULL for none
/// out_mesh         receives a new handle on SRF_OK only. Not NULL
/// out_report       initialized by srf_sculpt_report_init(). NULL if not wanted
/// returns          SRF_OK, SRF_ERR_INPUT if any mesh that covers the image has more, SRF_ERR_CANCELLED, SRF_ERR_HANDLE,
///                  SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_sculptor_at_most(
    sculptor: *const srf_sculptor,
    max_triangles: usize,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_sculpt_report,
) -> srf_status {
    guard(|| {
        sculpt("sculptor", sculptor, progress, out_mesh, out_report, |prepared, progress| {
            prepared.sculptor.at_most(max_triangles, progress)
        })
    })
}

/// The part that both ways to sculpt have in common.
fn sculpt(
    name: &str,
    sculptor: *const srf_sculptor,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_sculpt_report,
    work: impl FnOnce(&Prepared, &Progress<'_>) -> surfrecon::Result<Sculpted>,
) -> Result<(), Failure> {
    pointer::writable("out_mesh", out_mesh)?;
    if !out_report.is_null() {
        sized::writable("out_report", out_report)?;
    }
    let prepared = handle::get(name, sculptor)?;
    watched(progress, |progress| {
        let sculpted = work(&prepared, progress)?;
        if !out_report.is_null() {
            let mut values = sculpted.report.values();
            values.extend(sculpted.certificate.values());
            report::write("out_report", out_report, values)?;
        }
        handle::give("out_mesh", out_mesh, sculpted.mesh.into())
    })
}
