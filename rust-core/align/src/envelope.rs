//! Points of walls, floor and ceiling: nearly all that the scan shows lies in front of the plane through each. Of an object seen from
//! outside no point is one: what the scan shows lies behind.

use glam::DVec3;

use crate::level::Level;

/// Samples that each plane is compared with.
const SAMPLES: usize = 400;
/// Share of the scan that may lie behind a wall: through doors and windows, and by noise.
const BEHIND: f64 = 0.05;
/// How far a plane may be off, in cells and by the distance.
const OFF: [f64; 2] = [2.0, 0.05];

/// Whether each point of a level is of a wall. O(n).
pub(crate) fn walls(level: &Level) -> Vec<bool> {
    let samples: Vec<(DVec3, f64)> =
        level.spread(SAMPLES).iter().map(|&k| (level.points[k as usize], level.areas[k as usize])).collect();
    let all: f64 = samples.iter().map(|sample| sample.1).sum();
    let is_wall = |k: usize| {
        let (here, normal) = (level.points[k], level.normals[k]);
        let is_behind = |there: DVec3| {
            let to = there - here;
            to.dot(normal) < -(OFF[0] * level.cell + OFF[1] * to.length())
        };
        let behind: f64 = samples.iter().filter(|(there, _)| is_behind(*there)).map(|(_, area)| area).sum();
        behind <= BEHIND * all
    };
    (0..level.len()).map(is_wall).collect()
}
