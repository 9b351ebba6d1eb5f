//! Whether the poses of a recording mean what its layout says: under the right convention its frames lie on each other.
//!
//! Programs that write the same layout differ in the axes of a camera (y down and looking along z, or y up and along -z) and in the sense
//! of a pose (camera to world, or world to camera). All four are tried on pairs of frames that overlap, and if these do not decide, on all
//! of these frames together. The caller's word counts before.

use std::sync::Arc;

use glam::DAffine3;

use super::super::options::ReadOptions;
use super::super::options::{CameraAxes, PoseSense};
use super::super::overlap::{Overlap, short};
use super::clock;
use super::pairs::Pairs;
use super::recording::{Convention, Recording};
use base::error::Result;
use base::progress::Progress;
use image::frame::TURNED;

/// Another convention than the layout's is taken where it makes distances this many times smaller: where the layout
/// leaves no doubt, and where it does.
const CLEARLY: [f64; 2] = [3.0, 1.5];

/// Frames of pairs that lie on each other lie no further apart than this share of their depths.
const GOOD: f64 = 0.02;

/// Frames look through at most this share of the points of others that they see, if another convention is taken. Things alike come to lie
/// on each other, too, but cut through each other then.
const MOST_THROUGH: f64 = 0.15;

/// The ways to read poses: whether the axes and whether the sense are the other ones.
const WAYS: [[bool; 2]; 4] = [[false, false], [true, false], [false, true], [true, true]];

/// Findings about the frames.
#[derive(Default)]
pub(super) struct Found {
    /// For people to look at.
    pub(super) doubts: Vec<String>,
    /// For people who want to know.
    pub(super) notes: Vec<String>,
}

/// Looks at some frames: finds what their poses mean and corrects all poses where that is not what the layout says.
pub(super) fn check(recording: &mut Recording, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<Found> {
    let mut found = Found::default();
    let mut pairs = Pairs::of(recording, options, progress)?;
    while !pairs.damaged.is_empty() {
        found.doubts.extend(recording.skip(std::mem::take(&mut pairs.damaged)));
        pairs = Pairs::of(recording, options, progress)?;
    }
    let count = recording.entries.len();
    let given = recording.convention;
    let ways = WAYS.into_iter().filter(|way| is_allowed(*way, given, options));
    let read_so: Vec<_> = ways.map(|way| move |pose: DAffine3| read(pose, given, way)).collect();
    found.doubts.extend(clock::check(recording, &pairs, &read_so));
    if recording.entries.len() != count {
        pairs = Pairs::of(recording, options, progress)?;
    }
    let (note, is_doubtful) = convention(recording, options, &pairs);
    if is_doubtful {
        found.doubts.push(note)
    } else {
        found.notes.push(note)
    }
    found
        .notes
        .extend(pairs.left_out.in_words().map(|words| format!("of {} frames looked at: {words}", pairs.count())));
    Ok(found)
}

/// Finds the convention and corrects the poses. Says which it is and why, and whether that is in doubt.
fn convention(recording: &mut Recording, options: &ReadOptions, pairs: &Pairs) -> (String, bool) {
    let given = recording.convention;
    let ways: Vec<[bool; 2]> = WAYS.into_iter().filter(|way| is_allowed(*way, given, options)).collect();
    let poses: Vec<DAffine3> = recording.entries.iter().map(|entry| entry.world_from_sensor).collect();
    let take = |recording: &mut Recording, way: [bool; 2]| {
        if way != WAYS[0] {
            for entry in &mut recording.entries {
                entry.world_from_sensor = read(entry.world_from_sensor, given, way);
            }
            for photo in &mut recording.photos {
                photo.world_from_camera = read(photo.world_from_camera, given, way);
            }
        }
    };
    let first = ways[0];
    if ways.len() == 1 {
        take(recording, first);
        return (format!("poses read as {}, as was asked for", describe(given, first)), false);
    }
    let ways = that_differ(&ways, |way, k| read(poses[k], given, way), poses.len());
    let name = |k: usize| describe(given, ways[k]);
    if ways.len() == 1 || pairs.points().filter(|(_, points)| !points.is_empty()).count() < 2 {
        take(recording, first);
        return (format!("poses read as {}: nothing shows another reading", name(0)), false);
    }
    let clearly = CLEARLY[usize::from(!given.is_sure)];
    let mut apart: Vec<f64> = ways.iter().map(|&way| pairs.apart(&|k| Some(read(poses[k], given, way)))).collect();
    // If frames meet too little, the nearest points lie there by chance.
    let good = GOOD * pairs.depth();
    let is_possible =
        |way: usize| way == 0 || pairs.looked_through(&|k| read(poses[k], given, ways[way])) <= MOST_THROUGH;
    let is_good = |apart: &[f64], way: usize| apart[way] <= good && is_possible(way);
    let mut decided = decide(&apart, clearly).filter(|&way| is_good(&apart, way));
    if decided.is_none() {
        let (indices, points): (Vec<usize>, Vec<_>) = pairs.points().map(|(k, points)| (k, points.to_vec())).unzip();
        let overlap = Overlap::of(points);
        let of_all: Vec<f64> =
            ways.iter().map(|&way| overlap.median(&|k| read(poses[indices[k]], given, way))).collect();
        decided = decide(&of_all, clearly).filter(|&way| way == 0 || is_good(&of_all, way));
        if decided.is_some() || !apart[0].is_finite() {
            apart = of_all;
        }
    }
    let best_but = |taken: usize| {
        let others = (0..ways.len()).filter(|&k| k != taken);
        others.min_by(|&a, &b| apart[a].total_cmp(&apart[b])).unwrap_or(taken)
    };
    let Some(best) = decided else {
        take(recording, first);
        let other = best_but(0);
        let clocks = if recording.timed.is_some() { ", at the times of images and poses" } else { "" };
        let note = format!(
            "the meaning of the poses is not decided: they are read as {}, and overlapping frames lie {} apart. As \
                {} they would lie {} apart. If the scans do not fit, say {}. Look also at the camera and at the \
                scale of the depths{clocks}.",
            name(0),
            short(apart[0]),
            name(other),
            short(apart[other]),
            unsaid(options)
        );
        return (note, true);
    };
    take(recording, ways[best]);
    if best == 0 {
        let other = best_but(0);
        let note = format!(
            "poses read as {} (overlapping frames lie {} apart, as {}: {})",
            name(0),
            short(apart[0]),
            name(other),
            short(apart[other])
        );
        return (note, false);
    }
    let note = format!(
        "poses read as {}, not as {} usually writes them, {}: so the frames lie on each other ({} apart, else {})",
        name(best),
        recording.layout,
        name(0),
        short(apart[best]),
        short(apart[0])
    );
    (note, false)
}

/// Options that decide what the caller has left open.
fn unsaid(options: &ReadOptions) -> &'static str {
    match (options.poses, options.axes) {
        (PoseSense::Auto, CameraAxes::Auto) => {
            "poses = \"camera_to_world\" or \"world_to_camera\" and axes = \"y_down\" or \"y_up\""
        }
        (PoseSense::Auto, _) => "poses = \"camera_to_world\" or \"world_to_camera\"",
        (_, _) => "axes = \"y_down\" or \"y_up\"",
    }
}

/// The way that is surely the right one, the first where nothing clearly speaks against it. `None` if another is about as good.
fn decide(apart: &[f64], clearly: f64) -> Option<usize> {
    let best = (0..apart.len()).min_by(|&a, &b| apart[a].total_cmp(&apart[b]))?;
    let next = (1..apart.len()).map(|k| apart[k]).fold(f64::INFINITY, f64::min);
    match best {
        0 => (next > CLEARLY[1] * apart[0]).then_some(0),
        _ => (apart[0] >= clearly * apart[best]).then_some(best),
    }
}

/// The ways but those in which frames lie to each other as in one before: a camera that moves sideways and never turns does not show its
/// axes.
fn that_differ(ways: &[[bool; 2]], pose: impl Fn([bool; 2], usize) -> DAffine3, count: usize) -> Vec<[bool; 2]> {
    let relative = |way: [bool; 2], k: usize| pose(way, 0).inverse() * pose(way, k);
    let longest = (0..count).map(|k| relative(WAYS[0], k).translation.length()).fold(0.0, f64::max);
    let is_same = |a: DAffine3, b: DAffine3| {
        a.matrix3.abs_diff_eq(b.matrix3, 1e-6) && a.translation.abs_diff_eq(b.translation, 1e-6 * longest)
    };
    let mut kept: Vec<[bool; 2]> = Vec::new();
    for &way in ways {
        if !kept.iter().any(|&other| (0..count).all(|k| is_same(relative(way, k), relative(other, k)))) {
            kept.push(way);
        }
    }
    kept
}

/// Whether the caller leaves a way open.
fn is_allowed([other_axes, other_sense]: [bool; 2], given: Convention, options: &ReadOptions) -> bool {
    let is_up = given.looks_along_minus_z != other_axes;
    let is_to_camera = given.world_to_camera != other_sense;
    let axes = match options.axes {
        CameraAxes::Auto => true,
        CameraAxes::YDown => !is_up,
        CameraAxes::YUp => is_up,
    };
    let sense = match options.poses {
        PoseSense::Auto => true,
        PoseSense::CameraToWorld => !is_to_camera,
        PoseSense::WorldToCamera => is_to_camera,
    };
    axes && sense
}

/// A pose that was read as the layout says, read in another way.
fn read(pose: DAffine3, given: Convention, [other_axes, other_sense]: [bool; 2]) -> DAffine3 {
    // Back to the matrix of the file.
    let written = if given.looks_along_minus_z { pose * TURNED } else { pose };
    let sensed = if other_sense { written.inverse() } else { written };
    if given.looks_along_minus_z != other_axes { sensed * TURNED } else { sensed }
}

fn describe(given: Convention, [other_axes, other_sense]: [bool; 2]) -> String {
    let axes = match given.looks_along_minus_z != other_axes {
        true => "y up, looking along -z",
        false => "y down, looking along z",
    };
    let sense = if given.world_to_camera != other_sense { "world to camera" } else { "camera to world" };
    format!("{axes}, {sense}")
}
