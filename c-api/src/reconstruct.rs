//! Making a surface through scattered points.

use surfrecon::PointCloud;
use surfrecon::reconstruct::{Reason, ReconstructParams, Reconstructed, Reconstructor};
use surfrecon::reports::Report as _;
use surfrecon::threads::{Exclusive, Taken};

use crate::array::{Borrowed, srf_array};
use crate::cloud::srf_cloud;
use crate::guard::guard;
use crate::handle::{self, Shared, handle};
use crate::mesh::srf_mesh;
use crate::params::reconstruct::srf_reconstruct_params;
use crate::progress::{srf_progress, watched};
use crate::reports::reconstruct::srf_reconstruct_report;
use crate::status::{Failure, srf_status, srf_status::*};
use crate::{params, pointer, report, sized};

/// Scattered points from which surfaces are made with one set of parameters after the other. Released with
/// srf_reconstructor_free().
#[allow(non_camel_case_types)]
pub struct srf_reconstructor {
    _opaque: [u8; 0],
}

handle!(srf_reconstructor, Exclusive<Reconstructor<Shared<PointCloud>>>);

/// Reasons why a point is not on a surface.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_dropped {
    /// It is on it.
    SRF_DROPPED_USED = 0,
    /// A coordinate isn't a finite number.
    SRF_DROPPED_NOT_FINITE = 1,
    /// At the same place as a point before it. Of points that are flat but for noise, also right above another.
    SRF_DROPPED_DUPLICATE = 2,
    /// Inside the closed surface, out of its reach.
    SRF_DROPPED_INSIDE = 3,
    /// Outside the surface: too far away for the threshold, or carved away.
    SRF_DROPPED_OUTSIDE = 4,
    /// Far from any surface that the others tell. Since 0.2.
    SRF_DROPPED_OUTLIER = 5,
}

/// Takes a cloud. It is kept as it is now and may be freed afterwards. O(1): the points are tetrahedralized for the first surface.
/// cloud              not NULL. Its normals, if it has any, say which side of the surface is seen. Zero where unknown. If points carry
///                    noise they also tell the sides of thin walls apart, and what is inside
/// sensors            3 SRF_TYPE_F64 or SRF_TYPE_F32 a place, one place or one per point: where the points were seen from, in the cloud's
///                    frame. Go before the normals. Open surfaces then span no jumps, over which sensors looked from one point past it at
///                    another, and no gaps and holes through which points were seen. What was seen from one side only is closed only if
///                    that is asked for. Three NaN where that is not known of a point, whose normal counts then. A jump is told only
///                    between points whose sensors are all known. NULL for what srf_cloud_sensor() says. With neither, closed surfaces are
///                    turned outwards, open ones up
/// out_reconstructor  receives a new handle on SRF_OK only. Not NULL
/// returns            SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_reconstructor_create(
    cloud: *const srf_cloud,
    sensors: *const srf_array,
    out_reconstructor: *mut *mut srf_reconstructor,
) -> srf_status {
    guard(|| {
        pointer::writable("out_reconstructor", out_reconstructor)?;
        let mut reconstructor = Reconstructor::new(handle::get("cloud", cloud)?)?;
        if let Some(sensors) = Borrowed::optional("sensors", sensors, 3)? {
            reconstructor.seen_from(sensors.points()?)?;
        }
        handle::give("out_reconstructor", out_reconstructor, Exclusive::new(reconstructor))
    })
}

/// Releases a reconstructor.
/// reconstructor  NULL does nothing
/// returns        SRF_OK, SRF_ERR_HANDLE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_reconstructor_free(reconstructor: *mut srf_reconstructor) -> srf_status {
    guard(|| handle::free("reconstructor", reconstructor))
}

/// Makes a surface through the points: the first in O(n log n) in practice, others in a fraction of that. It does not depend on those. In
/// the cloud's frame. Its vertices are the used points in their order. Vertex attributes: source_point, and colour, intensity, normal_x,
/// normal_y, normal_z where the cloud has them.
/// reconstructor  not NULL. Used by one call at a time, others are refused
/// params         NULL for the defaults
/// progress       NULL for none
/// out_mesh       receives a new handle on SRF_OK only. Not NULL
/// out_report     initialized by srf_reconstruct_report_init(). NULL if not wanted
/// out_dropped    room for a byte per point, values of srf_dropped. NULL if not wanted
/// returns        SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for points without a surface, SRF_ERR_CANCELLED,
///                SRF_ERR_OUT_OF_MEMORY, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_reconstructor_surface(
    reconstructor: *const srf_reconstructor,
    params: *const srf_reconstruct_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_reconstruct_report,
    out_dropped: *mut u8,
) -> srf_status {
    guard(|| {
        pointer::writable("out_mesh", out_mesh)?;
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let params = params::read::<ReconstructParams, _>("params", params)?;
        let shared = handle::get("reconstructor", reconstructor)?;
        let made = surface(&shared, &params, progress)?;
        if !out_report.is_null() {
            report::write("out_report", out_report, made.report.values())?;
        }
        if !out_dropped.is_null() {
            pointer::copy_out("out_dropped", out_dropped, &reasons(&made))?;
        }
        handle::give("out_mesh", out_mesh, made.mesh.into())
    })
}

fn surface(
    shared: &Exclusive<Reconstructor<Shared<PointCloud>>>,
    params: &ReconstructParams,
    progress: *const srf_progress,
) -> Result<Reconstructed, Failure> {
    // Waiting here could wait for ever: for this very thread, from its progress callback.
    let mut reconstructor = shared.take().map_err(|taken| {
        let text = match taken {
            Taken::InUse => "reconstructor is making another surface: wait for it, or create two",
            Taken::LeftBehind => {
                "reconstructor was making a surface when this process was forked, and can't be used here: create another"
            }
        };
        Failure::new(SRF_ERR_INPUT, text.to_owned())
    })?;
    watched(progress, |progress| Ok(reconstructor.surface(params, progress)?))
}

/// Of each point, why it is not on the surface.
fn reasons(made: &Reconstructed) -> Vec<u8> {
    let mut reasons = vec![srf_dropped::SRF_DROPPED_USED as u8; made.report.points];
    for dropped in &made.report.dropped {
        reasons[dropped.point as usize] = match dropped.reason {
            Reason::NotFinite => srf_dropped::SRF_DROPPED_NOT_FINITE,
            Reason::Duplicate => srf_dropped::SRF_DROPPED_DUPLICATE,
            Reason::Inside => srf_dropped::SRF_DROPPED_INSIDE,
            Reason::Outside => srf_dropped::SRF_DROPPED_OUTSIDE,
            Reason::Outlier => srf_dropped::SRF_DROPPED_OUTLIER,
        } as u8;
    }
    reasons
}
