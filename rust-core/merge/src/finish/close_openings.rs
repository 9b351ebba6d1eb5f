//! Stage 10, where more than holes is to be closed: the surface gets a smooth fill that keeps out of what the scans saw to be empty.

use ::close::{CloseParams, CloseReport, Closed, LeftOpen, Openings, Scans};

use crate::params::MergeParams;
use crate::report::{MergeReport, Warning, WarningKind};
use crate::stages::FILLING;
use crate::visibility::eyes::Eyes;
use base::error::Result;
use base::progress::Progress;
use mesh::TriMesh;

/// Whether more than holes is to be closed.
pub fn is_asked(params: &MergeParams) -> bool {
    matches!(params.close, Openings::All | Openings::Seen)
}

/// The surface with its openings closed. `report` is that of the surface, and is told of it.
///
/// # Errors
/// A scan can't be loaded any more. [`base::Error::OutOfMemory`]. Cancelled.
pub fn close(
    surface: &TriMesh,
    eyes: &Eyes<'_>,
    params: &MergeParams,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<TriMesh> {
    progress.stage(FILLING, eyes.count() as u64);
    let scans = Scans::new(eyes.all(progress)?);
    let params = CloseParams {
        openings: params.close,
        cell: Some(report.voxel),
        // Of scans that are exact it may be 0. The fill keeps a cell away then.
        merge_distance: Some(report.merge_distance).filter(|distance| *distance > 0.0),
        flat_base: params.flat_base,
        base_up: params.base_up,
        threads: params.threads,
        ..CloseParams::default()
    };
    let part = progress.part(FILLING);
    let Closed { mesh, report: closing } = ::close::close_on_this_pool(surface, &scans, &params, &part)?;
    tell(&closing, &mesh, report);
    Ok(mesh)
}

fn tell(closing: &CloseReport, closed: &TriMesh, report: &mut MergeReport) {
    let left: usize = closing.left.iter().sum();
    report.holes = [closing.closed as u64, left as u64];
    report.holes_seen_through = closing.left[LeftOpen::SeenThrough as usize] as u64;
    report.faces[2] += closing.added[1] as u64;
    (report.filled_area, report.filled_share) = (Some(closing.filled_area), Some(closing.filled_share));
    let sides = closed.triangles.iter().skip(closed.triangles.len() - closing.added[1]);
    let lengths = sides.flat_map(|&[a, b, c]| {
        [[a, b], [b, c], [c, a]].map(|side| {
            let [from, to] = side.map(|v| closed.positions[v as usize]);
            from.distance(to)
        })
    });
    report.shortest_edge = lengths.fold(report.shortest_edge, f64::min);
    // A rim was asked to stay open.
    let open = closing.open.iter().filter(|place| place.kind != LeftOpen::NotEnclosed);
    report.warnings.extend(open.map(|place| Warning { kind: WarningKind::Open, text: place.text.clone() }));
}
