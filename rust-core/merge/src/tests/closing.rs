//! Closing within a merge: where nothing was seen through, and the same bytes on every way.

use super::*;
use crate::incremental::Merger;
use crate::visibility::tests::{CELL, FLOOR, cuboids, frames};
use close::{CloseParams, Openings, Scans};
use image::range_image::test_images::is_past;

/// A frame of four bars and a box above a floor. Cameras see through the frame. Nobody sees it, or the box, from below.
pub(crate) const WINDOW: [[DVec3; 2]; 6] = [
    FLOOR,
    [DVec3::new(0.9, 0.9, 0.2), DVec3::splat(0.14)],
    [DVec3::new(0.0, 0.35, 0.7), DVec3::new(0.5, 0.15, 0.1)],
    [DVec3::new(0.0, -0.35, 0.7), DVec3::new(0.5, 0.15, 0.1)],
    [DVec3::new(0.35, 0.0, 0.7), DVec3::new(0.15, 0.2, 0.1)],
    [DVec3::new(-0.35, 0.0, 0.7), DVec3::new(0.15, 0.2, 0.1)],
];

fn window(count: usize) -> Vec<RangeImage> {
    frames(count, [0.0; 2], |_| cuboids(&WINDOW))
}

fn params(close: Openings) -> MergeParams {
    MergeParams { voxel: Some(CELL), close, max_hole_length: Some(4.0), ..MergeParams::default() }
}

fn merged(frames: &[RangeImage], params: &MergeParams) -> Merged {
    let sources: Vec<&dyn ScanSource> = frames.iter().map(|frame| frame as &dyn ScanSource).collect();
    merge(&sources, params, Run::default(), &Progress::none()).unwrap()
}

/// Filled places, by the centres of faces, that a scan saw through.
fn seen_through(merged: &Merged, frames: &[RangeImage]) -> [usize; 2] {
    let Some(AttributeData::Bool(fills)) = merged.mesh.face_attribute("hole_fill") else { panic!("it is marked") };
    let slack = merged.report.merge_distance + 0.5 * merged.report.voxel;
    let centre = |t: usize| merged.mesh.corners(t).iter().sum::<DVec3>() / 3.0;
    let filled: Vec<DVec3> = (0..fills.len()).filter(|&t| fills[t]).map(centre).collect();
    let past = filled.iter().filter(|&&place| frames.iter().any(|frame| is_past(frame, place, slack)));
    [filled.len(), past.count()]
}

#[test]
fn no_hole_is_closed_that_a_scan_saw_through() {
    let frames = window(8);
    let found = merged(&frames, &params(Openings::Holes));
    let [filled, past] = seen_through(&found, &frames);
    assert_eq!(past, 0, "of {filled}");
    assert!(filled > 10 && found.report.holes_seen_through > 0, "{filled}, {:?}", found.report.holes);
    assert!(found.report.holes[1] >= found.report.holes_seen_through);
    // Fewer scans than vote on surfaces look as well.
    let found = merged(&frames[..2], &params(Openings::Holes));
    assert_eq!(seen_through(&found, &frames[..2])[1], 0);
    // Meshes say nothing: then the same hole is closed.
    let mesh = merged(&frames, &params(Openings::None)).mesh;
    assert!(merge_mesh(&mesh, &params(Openings::Holes)).report.holes_seen_through == 0);
}

#[test]
fn closing_within_a_merge_is_closing_after_it() {
    let frames = window(5);
    let open = merged(&frames, &params(Openings::None));
    assert_eq!((open.report.faces[2], open.report.holes[0]), (0, 0));
    for (openings, flat_base) in [(Openings::All, false), (Openings::All, true), (Openings::Seen, false)] {
        let found = merged(&frames, &MergeParams { flat_base, ..params(openings) });
        let scans = Scans::of_images(&frames, &Progress::none()).unwrap();
        let closing = CloseParams {
            openings,
            flat_base,
            cell: Some(open.report.voxel),
            merge_distance: Some(open.report.merge_distance),
            ..CloseParams::default()
        };
        let after = close::close_seen_by(&open.mesh, &scans, &closing, &Progress::none()).unwrap();
        assert!(found.mesh == after.mesh, "{openings:?}");
        assert_eq!(found.report.filled_area, Some(after.report.filled_area));
        assert_eq!(found.report.faces[2], after.report.added[1] as u64);
        assert_eq!(
            found.report.holes.map(|count| count as usize),
            [after.report.closed, after.report.left.iter().sum()]
        );
        assert_eq!(found.mesh.positions[..open.mesh.positions.len()], open.mesh.positions[..]);
        assert_eq!(seen_through(&found, &frames)[1], 0);
        let shortest = (0..found.mesh.triangles.len())
            .map(|t| found.mesh.corners(t))
            .fold(f64::INFINITY, |least, [a, b, c]| least.min(a.distance(b)).min(b.distance(c)).min(c.distance(a)));
        assert!((found.report.shortest_edge - shortest).abs() <= 1e-12 * shortest);
        let warned = found.report.warnings.iter().filter(|warning| warning.kind == WarningKind::Open).count();
        let rims = after.report.left[close::LeftOpen::NotEnclosed as usize];
        assert_eq!(warned as u64, found.report.holes[1] - rims as u64, "{:?}", found.report.warnings);
    }
}

#[test]
fn what_is_closed_is_the_same_in_blocks_on_threads_and_again() {
    let mut frames = window(6);
    let plain = |mut merged: Merged| {
        (merged.report.seconds, merged.report.working_bytes) = Default::default();
        merged
    };
    for close in [Openings::All, Openings::Holes] {
        let params = params(close);
        let first = plain(merged(&frames, &params));
        for threads in [1, 3] {
            assert!(plain(merged(&frames, &MergeParams { threads, ..params })) == first, "{threads}");
        }
        let sources: Vec<&dyn ScanSource> = frames.iter().map(|frame| frame as &dyn ScanSource).collect();
        let setup = Setup { block: Some(1), ..Setup::default() };
        assert!(plain(by_setup(&sources, &params, &setup, &Progress::none()).unwrap()) == first);
        // By what a merge of fewer scans has left.
        let mut merger = Merger::default();
        for count in [2, 4, 6] {
            let versions: Vec<u64> = (0..count as u64).collect();
            let run = Run { reuse: Some(Reuse { merger: &mut merger, versions: &versions }), ..Run::default() };
            let again = merge(&sources[..count], &params, run, &Progress::none()).unwrap();
            assert!(plain(again) == plain(merged(&frames[..count], &params)), "{count}");
        }
        frames.reverse();
        assert!(plain(merged(&frames, &params)) == first);
    }
}

#[test]
fn closing_tells_its_stages_and_is_cancelled() {
    let frames = window(3);
    let sources: Vec<&dyn ScanSource> = frames.iter().map(|frame| frame as &dyn ScanSource).collect();
    let mut ticks = Vec::new();
    let progress = Progress::new(|tick| {
        ticks.push(tick);
        std::ops::ControlFlow::Continue(())
    });
    merge(&sources, &params(Openings::All), Run::default(), &progress).unwrap();
    drop(progress);
    assert!(ticks.is_sorted_by(|a, b| a.fraction <= b.fraction));
    let solving = ticks.iter().find(|tick| tick.stage == "solving for the fill").expect("it takes longest");
    assert!(solving.fraction > 0.3 && solving.fraction < 0.9, "{solving:?}");
    let checks = (0..12).map(|k| 1 << (2 * k));
    let cancelled = checks.filter(|&after| {
        let found = merge(&sources, &params(Openings::All), Run::default(), &Progress::cancel_after(after));
        matches!(found, Err(Error::Cancelled))
    });
    assert!(cancelled.count() > 6);
}
