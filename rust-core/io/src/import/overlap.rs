//! Meaning of the quaternions of a side file, decided by how well the placed scans overlap.
//!
//! Some tools write the rotation from scan to world, Stanford's the one from world to scan. Some put the scalar first. Under the right
//! convention scans of one object lie on each other. So: a few points of each scan, and under each convention the median distance from
//! points to the nearest point of any other scan. A rigid motion keeps distances, so each scan's search tree is built once, in its own
//! frame, and the queries move.

use glam::{DAffine3, DMat3, DVec3};

use super::scan::FileScan;
use base::error::Result;
use base::progress::Progress;
use geom::neighbours::KdTree;

/// Meaning of a quaternion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Convention {
    /// It rotates world to scan (its conjugate places the scan), otherwise scan to world.
    pub(super) world_to_scan: bool,
    /// Its order is w x y z, otherwise x y z w.
    pub(super) scalar_first: bool,
}

/// The convention of the Stanford archive, if nothing speaks for another.
pub(super) const STANFORD: Convention = Convention { world_to_scan: true, scalar_first: false };

/// A convention and the one of the other sense differ in the lowest bit of their place.
const ALL: [Convention; 4] = [
    STANFORD,
    Convention { world_to_scan: false, scalar_first: false },
    Convention { world_to_scan: true, scalar_first: true },
    Convention { world_to_scan: false, scalar_first: true },
];

/// Points of a scan that others are compared with, at most.
const POINTS: usize = 1000;

/// Points compared under each convention, of all scans together, about.
const QUERIES: usize = 600;

/// Scans that take part, at most. Of more, some are taken evenly.
const SCANS: usize = 40;

/// The best convention must have a distance this many times smaller than another, or the two aren't told apart.
const CLEARLY: f64 = 1.5;

impl Convention {
    fn describe(self) -> &'static str {
        match (self.scalar_first, self.world_to_scan) {
            (false, true) => "(x y z w) rotating world to scan",
            (false, false) => "(x y z w) rotating scan to world",
            (true, true) => "(w x y z) rotating world to scan",
            (true, false) => "(w x y z) rotating scan to world",
        }
    }
}

/// The convention and a sentence that says why. `pose` places scan `i` in the world under a convention.
pub(super) fn decide(
    scans: &[FileScan],
    pose: &dyn Fn(usize, Convention) -> DAffine3,
    progress: &Progress<'_>,
) -> Result<(Convention, String)> {
    let stanford = |why: &str| {
        (STANFORD, format!("quaternions read as {}, as in the Stanford archive: {why}", STANFORD.describe()))
    };
    if scans.len() < 2 {
        return Ok(stanford("one scan alone can't show another sense"));
    }
    if (0..scans.len()).all(|i| pose(i, STANFORD).matrix3.abs_diff_eq(DMat3::IDENTITY, 1e-9)) {
        return Ok(stanford("no scan is rotated"));
    }
    let taken = scans.len().min(SCANS);
    let chosen: Vec<usize> = (0..taken).map(|i| i * scans.len() / taken).collect();
    let points = |&scan: &usize| progress.check().and_then(|()| scans[scan].preview_points(POINTS));
    let overlap = Overlap::of(chosen.iter().map(points).collect::<Result<_>>()?);
    let medians = ALL.map(|convention| overlap.median(&|k| pose(chosen[k], convention)));
    Ok(choose(&medians).unwrap_or_else(|why| stanford(&why)))
}

/// Some points of several scans, each in its own frame.
pub(super) struct Overlap {
    scans: Vec<KdTree>,
}

/// The convention that clearly overlaps best, and the sentence that says so. Else the reason why none does.
fn choose(medians: &[f64; 4]) -> Result<(Convention, String), String> {
    let best = (0..4).min_by(|&a, &b| medians[a].total_cmp(&medians[b])).unwrap_or(0);
    if !medians[best].is_finite() {
        return Err("the scans have too few points to compare".to_owned());
    }
    let chosen = if medians[0] < CLEARLY * medians[best] { 0 } else { best };
    let other_sense = chosen ^ 1;
    if medians[other_sense] < CLEARLY * medians[chosen] || medians[chosen] > medians[best] {
        return Err(format!(
            "the overlap of the points does not decide (median distance {}, in the other sense {})",
            short(medians[0]),
            short(medians[1])
        ));
    }
    let text = format!(
        "quaternions read as {} (median overlap distance {}, in the other sense {})",
        ALL[chosen].describe(),
        short(medians[chosen]),
        short(medians[other_sense])
    );
    Ok((ALL[chosen], text))
}

impl Overlap {
    /// Of these points.
    pub(super) fn of(points: Vec<Vec<DVec3>>) -> Overlap {
        Overlap { scans: points.iter().map(|points| KdTree::new(points)).collect() }
    }

    /// Median over points of all scans of the distance to the nearest point of any other scan, where `pose` places each.
    pub(super) fn median(&self, pose: &dyn Fn(usize) -> DAffine3) -> f64 {
        let per_scan = (QUERIES / self.scans.len().max(1)).max(16);
        let poses: Vec<DAffine3> = (0..self.scans.len()).map(pose).collect();
        let inverses: Vec<DAffine3> = poses.iter().map(DAffine3::inverse).collect();
        let mut distances = Vec::with_capacity(per_scan * self.scans.len());
        for (i, scan) in self.scans.iter().enumerate() {
            let points = scan.points();
            let taken = per_scan.min(points.len());
            for q in 0..taken {
                let point = poses[i].transform_point3(points[q * points.len() / taken]);
                let mut nearest = f64::INFINITY;
                for (j, other) in self.scans.iter().enumerate().filter(|(j, _)| *j != i) {
                    if let Some((_, d)) = other.nearest_within(inverses[j].transform_point3(point), nearest) {
                        nearest = d;
                    }
                }
                distances.push(nearest);
            }
        }
        if distances.is_empty() {
            return f64::INFINITY;
        }
        let middle = distances.len() / 2;
        *distances.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

/// Three significant digits.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let places = (2 - value.abs().log10().floor() as i32).max(0) as usize;
    if places > 12 { format!("{value:.2e}") } else { format!("{value:.places$}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// Points of a lopsided body (no two orientations of it look alike), as scan files with their poses.
    fn scans(folder: &std::path::Path, rotations: &[DQuat]) -> (Vec<FileScan>, Vec<(DVec3, DQuat)>) {
        let mut scans = Vec::new();
        let mut poses = Vec::new();
        for (i, rotation) in rotations.iter().enumerate() {
            let translation = DVec3::new(0.3, -0.2 * i as f64, 0.1);
            let mut text = "ply\nformat ascii 1.0\nelement vertex 2000\nproperty float x\nproperty float y\n\
                property float z\nend_header\n"
                .to_owned();
            for k in 0..2000 {
                let (u, v) = (f64::from(k % 50) / 50.0, f64::from(k / 50) / 40.0);
                let world = DVec3::new(u + 0.2 * v * v, 2.0 * v, 0.3 * (3.0 * u).sin() + u * v + 0.01 * i as f64);
                let p = rotation.inverse() * (world - translation);
                text += &format!("{} {} {}\n", p.x, p.y, p.z);
            }
            let path = folder.join(format!("{i}.ply"));
            std::fs::write(&path, text).unwrap();
            scans.push(FileScan::new(&path));
            poses.push((translation, *rotation));
        }
        (scans, poses)
    }

    fn turns() -> [DQuat; 4] {
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        [0.0, 0.9, 2.0, -1.3].map(|angle| DQuat::from_axis_angle(axis, angle))
    }

    /// Theorem: whichever convention the file was written in is the one found.
    #[test]
    fn finds_each_convention() {
        let folder = tempfile::tempdir().unwrap();
        let (scans, truth) = scans(folder.path(), &turns());
        for written in ALL {
            // The four numbers a tool of that convention writes.
            let numbers: Vec<[f64; 4]> = truth
                .iter()
                .map(|(_, q)| {
                    let q = if written.world_to_scan { q.conjugate() } else { *q };
                    if written.scalar_first { [q.w, q.x, q.y, q.z] } else { [q.x, q.y, q.z, q.w] }
                })
                .collect();
            let pose = |i: usize, c: Convention| {
                let [a, b, d, e] = numbers[i];
                let q = if c.scalar_first { DQuat::from_xyzw(b, d, e, a) } else { DQuat::from_xyzw(a, b, d, e) };
                let q = if c.world_to_scan { q.conjugate() } else { q };
                DAffine3::from_rotation_translation(q, truth[i].0)
            };
            let (found, why) = decide(&scans, &pose, &Progress::none()).unwrap();
            assert_eq!(found, written, "{why}");
            assert!(why.starts_with(&format!("quaternions read as {} (median", written.describe())), "{why}");
        }
    }

    #[test]
    fn says_when_nothing_decides() {
        let folder = tempfile::tempdir().unwrap();
        let (scans, truth) = scans(folder.path(), &turns());
        let decide = |count: usize, pose: &dyn Fn(usize, Convention) -> DAffine3| {
            let (found, why) = decide(&scans[..count], pose, &Progress::none()).unwrap();
            assert_eq!(found, STANFORD);
            why
        };
        assert!(decide(1, &|_, _| DAffine3::IDENTITY).contains("one scan alone"));
        assert!(decide(4, &|i, _| DAffine3::from_translation(truth[i].0)).contains("no scan is rotated"));
        let half_turns = |_, _| DAffine3::from_rotation_x(std::f64::consts::PI);
        assert!(decide(4, &half_turns).contains("does not decide"));
    }

    #[test]
    fn shows_three_digits() {
        let shown = [0.000_312_34, 22.94, 12345.6, 0.0, 1e-20].map(short);
        assert_eq!(shown, ["0.000312", "22.9", "12346", "0", "1.00e-20"]);
    }
}
