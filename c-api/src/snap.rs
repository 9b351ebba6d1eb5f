//! Scans placed by hand: one drawn to the others, and how far it lies off them.

use surfrecon::align::AlignParams;
use surfrecon::reports::Report;

use crate::align::{known, prepared, srf_aligner};
use crate::array::{Borrowed, srf_array};
use crate::guard::guard;
use crate::params::align::srf_align_params;
use crate::pose::srf_pose;
use crate::progress::{srf_progress, watched};
use crate::reports::snap::srf_snap_report;
use crate::status::srf_status;
use crate::{handle, params, pointer, report, sized};

/// Draws one scan, from a rough pose, to others, which stay: for placing by hand. What was said of the scans is not asked. The same to
/// the bit for any number of threads. Some tens of milliseconds for any number of scans, once these were read: the first call does so.
/// aligner          not NULL
/// scan             number of a scan that was added
/// world_from_scan  a pose a scan, in the order of adding, rigid: that of the scan itself is where it starts. All 0, as
///                  srf_alignment_scan() has it of scans without a group, for those that it is not drawn to. NULL for the poses that they were added with
/// count            scans that were added, 0 if world_from_scan is NULL
/// params           its reach, by default a tenth of the scan's size, is how far it is drawn, about. Its tolerance, min_overlap and
///                  threads count too. NULL for the defaults
/// progress         NULL for none
/// out_snap         initialized by srf_snap_report_init(). Not NULL
/// out_touches      room for a byte a scan that was added: 1 if the scan touches that one, else 0. NULL if not wanted
/// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for fewer than two scans, poses for another number of scans, one that is
///                  not rigid or none of the scan itself, SRF_ERR_FORMAT, SRF_ERR_IO, SRF_ERR_OUT_OF_MEMORY,
///                  SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_snap(
    aligner: *const srf_aligner,
    scan: usize,
    world_from_scan: *const srf_pose,
    count: usize,
    params: *const srf_align_params,
    progress: *const srf_progress,
    out_snap: *mut srf_snap_report,
    out_touches: *mut u8,
) -> srf_status {
    guard(|| {
        sized::writable("out_snap", out_snap)?;
        let told = handle::get("aligner", aligner)?;
        let scan = known(&told, "scan", scan)?;
        let poses = told.poses(world_from_scan, count)?;
        let params: AlignParams = params::read("params", params)?;
        watched(progress, |progress| {
            let scans = prepared(aligner, &told, params.threads, progress)?;
            let snap = scans.snap(scan, &poses, &params, progress)?;
            if !out_touches.is_null() {
                let touches: Vec<u8> = (0..poses.len()).map(|other| snap.touches.contains(&other).into()).collect();
                pointer::copy_out("out_touches", out_touches, &touches)?;
            }
            report::write("out_snap", out_snap, snap.values())
        })
    })
}

/// How far points of a scan lie outside of the surfaces of others, along normals: a mean over a few samples, so that warp and what
/// moved shows. On as many threads as the scans were read with. The same to the bit for any number. O(points + scans).
/// aligner          not NULL
/// scan             number of a scan that was added
/// world_from_scan  where the scans lie: a pose a scan, in the order of adding, rigid. All 0 for scans that are left out. NULL for the
///                  poses that they were added with
/// count            scans that were added, 0 if world_from_scan is NULL
/// points           3 SRF_TYPE_F64 or SRF_TYPE_F32 a point, in the scan's own frame. Not NULL
/// progress         NULL for none
/// out_distances    room for a double a point: negative inside, NaN where no other scan is near or the point is not finite. Not NULL
/// returns          SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT for fewer than two scans, poses for another number of scans, one that is
///                  not rigid or none of the scan itself, SRF_ERR_FORMAT, SRF_ERR_IO, SRF_ERR_OUT_OF_MEMORY,
///                  SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_aligner_misfit(
    aligner: *const srf_aligner,
    scan: usize,
    world_from_scan: *const srf_pose,
    count: usize,
    points: *const srf_array,
    progress: *const srf_progress,
    out_distances: *mut f64,
) -> srf_status {
    guard(|| {
        let told = handle::get("aligner", aligner)?;
        let scan = known(&told, "scan", scan)?;
        let poses = told.poses(world_from_scan, count)?;
        let points = Borrowed::new("points", points, 3)?.points()?;
        if !points.is_empty() {
            pointer::writable("out_distances", out_distances)?;
        }
        watched(progress, |progress| {
            let scans = prepared(aligner, &told, 0, progress)?;
            pointer::copy_out("out_distances", out_distances, &scans.misfit(scan, &poses, &points, progress)?)
        })
    })
}
