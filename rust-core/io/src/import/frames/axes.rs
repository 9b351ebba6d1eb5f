//! Whether the poses of a recording mean what its layout says: under the right convention its frames lie on each other.
//!
//! Programs that write the same layout differ in the axes of a camera (y down and looking along z, or y up and along
//! -z) and in the sense of a pose (camera to world, or world to camera). All four are tried on some frames.

use std::sync::Arc;

use glam::DAffine3;

use super::super::ReadOptions;
use super::super::overlap::{Overlap, short};
use super::recording::{Convention, Recording};
use base::error::Result;
use base::progress::Progress;
use image::frame::{LeftOut, TURNED};

/// Frames that take part; of more, some are taken evenly.
const FRAMES: usize = 16;

/// Points of a frame that others are compared with, about.
const POINTS: usize = 1500;

/// Another convention than the layout's is taken where it makes distances this many times smaller: where the layout
/// leaves no doubt, and where it does.
const CLEARLY: [f64; 2] = [3.0, 1.5];

/// The ways to read poses: whether the axes and whether the sense are the other ones.
const WAYS: [[bool; 2]; 4] = [[false, false], [true, false], [false, true], [true, true]];

/// Looks at some frames: finds what their poses mean and corrects all poses where that is not what the layout says.
/// Notes of what was found, and of what of these frames is left out.
pub(super) fn check(
    recording: &mut Recording,
    options: &Arc<ReadOptions>,
    progress: &Progress<'_>,
) -> Result<Vec<String>> {
    let count = recording.entries.len();
    let taken: Vec<usize> = (0..count.min(FRAMES)).map(|i| i * count / count.min(FRAMES)).collect();
    let mut left_out = LeftOut::default();
    let mut points = Vec::with_capacity(taken.len());
    for &index in &taken {
        progress.check()?;
        let (image, out) = recording.without_colour(index, options, progress)?.into_range_image(progress)?;
        left_out.add(&out);
        let step = (image.valid_count() / POINTS).max(1);
        let valid = (0..image.len()).filter(|&i| image.is_valid(i));
        points.push(valid.step_by(step).map(|i| image.point_in_sensor(i)).collect());
    }
    let mut notes = vec![convention(recording, &taken, &Overlap::of(points))];
    notes.extend(left_out.in_words().map(|words| format!("of {} frames looked at: {words}", taken.len())));
    Ok(notes)
}

/// Finds the convention, corrects the poses; says which it is and why.
fn convention(recording: &mut Recording, taken: &[usize], overlap: &Overlap) -> String {
    let given = recording.convention;
    let poses: Vec<DAffine3> = taken.iter().map(|&index| recording.entries[index].world_from_sensor).collect();
    if overlap.is_alone() || poses.iter().all(|pose| pose.matrix3.abs_diff_eq(poses[0].matrix3, 1e-9)) {
        return format!(
            "poses read as {}: no frame is turned, nothing shows another sense",
            describe(given, [false; 2])
        );
    }
    let medians = WAYS.map(|way| overlap.median(&|k| read(poses[k], given, way)));
    let best = (0..WAYS.len()).min_by(|&a, &b| medians[a].total_cmp(&medians[b])).unwrap_or(0);
    let next = (0..WAYS.len()).filter(|&k| k != best).min_by(|&a, &b| medians[a].total_cmp(&medians[b])).unwrap_or(0);
    let clearly = CLEARLY[usize::from(!given.is_sure)];
    let distance = |k: usize| format!("{}: {}", describe(given, WAYS[k]), short(medians[k]));
    if best == 0 || medians[0] < clearly * medians[best] {
        let doubt = if medians[next] < CLEARLY[1] * medians[0] {
            ", which does not decide; if frames lie far apart, look at the camera and the scale of the depths"
        } else {
            ""
        };
        let other = if best == 0 { next } else { best };
        return format!(
            "poses read as {} (median distance of overlapping frames {}; {}){doubt}",
            describe(given, WAYS[0]),
            short(medians[0]),
            distance(other)
        );
    }
    for entry in &mut recording.entries {
        entry.world_from_sensor = read(entry.world_from_sensor, given, WAYS[best]);
    }
    format!(
        "poses read as {}, not as {} usually writes them: so the frames lie on each other (median distance {}; {})",
        describe(given, WAYS[best]),
        recording.layout,
        short(medians[best]),
        distance(0)
    )
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
    let sense = if other_sense { "the other sense" } else { "the layout's sense" };
    format!("{axes}, in {sense}")
}
