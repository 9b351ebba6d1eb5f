//! Whether the clocks of images and poses agree, where both have times: how frames overlap shows by how much one is ahead.

use glam::DAffine3;

use super::super::overlap::short;
use super::pairs::Pairs;
use super::recording::Recording;

/// Furthest shift that is looked for, and from one try to the next, in seconds: coarse, then fine.
const FURTHEST: f64 = 3.0;
const COARSE: f64 = 0.05;
const FINE: f64 = 0.01;

/// A shift is taken where it makes distances this many times smaller.
const CLEARLY: f64 = 2.0;

/// Frames that lie further apart than this share of their depths do not lie on each other.
const APART: f64 = 0.01;

/// Frames look through at most this share of the points of others that they see, where a shift is taken.
const MOST_THROUGH: f64 = 0.1;

/// Finds by how much the poses are late and places the frames anew where they are. Says so, or that frames that overlap lie apart. Nobody
/// has decided what the poses mean yet: each of `readings` may be right.
pub(super) fn check<R>(recording: &mut Recording, pairs: &Pairs, readings: &[R]) -> Option<String>
where
    R: Fn(DAffine3) -> DAffine3,
{
    let timed = recording.timed.as_ref()?;
    let placed = |reading: &R, k: usize, shift: f64| timed.poses.at(timed.times[k] + shift).map(reading);
    let apart = |reading: &R, shift: f64| pairs.apart(&|k| placed(reading, k, shift));
    let found = readings.iter().map(|reading| apart(reading, 0.0)).fold(f64::INFINITY, f64::min);
    let good = APART * pairs.depth();
    let least = |reading: &R, steps: i32, step: f64, around: f64| {
        let shifts = (-steps..=steps).map(|k| around + f64::from(k) * step);
        let tried = shifts.map(|shift| (apart(reading, shift), shift));
        // Of equal ones the least shift.
        tried.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.abs().total_cmp(&b.1.abs()))).unwrap_or((found, 0.0))
    };
    let shifted = readings.iter().map(|reading| {
        let (_, near) = least(reading, (FURTHEST / COARSE).round() as i32, COARSE, 0.0);
        let (best, shift) = least(reading, (COARSE / FINE).round() as i32, FINE, near);
        (best, shift, reading)
    });
    let (best, shift, reading) = shifted.min_by(|a, b| a.0.total_cmp(&b.0))?;
    // Frames without a pose at that time stay where they are, for the comparison.
    let through = || {
        pairs.looked_through(&|k| {
            placed(reading, k, shift).unwrap_or_else(|| reading(recording.entries[k].world_from_sensor))
        })
    };
    if best * CLEARLY < found && best <= good && through() <= MOST_THROUGH {
        let placed: Vec<Option<DAffine3>> = timed.times.iter().map(|time| timed.poses.at(time + shift)).collect();
        let mut kept = placed.iter().map(Option::is_some);
        let count = recording.entries.len();
        for (entry, pose) in recording.entries.iter_mut().zip(&placed) {
            entry.world_from_sensor = pose.unwrap_or(entry.world_from_sensor);
        }
        let lost = placed.iter().filter(|pose| pose.is_none()).count();
        recording.entries.retain(|_| kept.next().unwrap_or(false));
        recording.timed = None;
        let beside = if lost > 0 {
            format!(", and {lost} of {count} frames have no pose and are skipped")
        } else {
            String::new()
        };
        return Some(format!(
            "the clocks of depth images and poses differ. Each image takes the pose {} s {}. So overlapping frames \
                lie {} apart, not {}{beside}.",
            short(shift.abs()),
            if shift > 0.0 { "later" } else { "earlier" },
            short(best),
            short(found)
        ));
    }
    (found.is_finite() && found > good).then(|| {
        format!(
            "overlapping frames lie {} apart, and no shift of time within {FURTHEST} s brings them together. Check \
                that depth images and poses have times of one clock, and check the camera.",
            short(found)
        )
    })
}
