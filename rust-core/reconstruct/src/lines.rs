//! Open surfaces of scans: what lines of sight, from sensors to the samples they saw, say of facets.
//!
//! A facet that sensors see edge-on, one of its samples behind another, spans a jump: they looked past the one at the other. And where they
//! saw something behind a facet, there is none.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::facet_scale::TRUSTED;
use super::seen::Sighted;
use base::error::Result;
use base::progress::Progress;

/// Spacings along its line of sight from which on something lies behind something else.
const BEHIND: f64 = 3.0;

/// Tangent of the angle between a surface and one that is seen head-on, from which on sensors see nothing of it: 80.5 degrees.
const STEEP: f64 = 6.0;

/// Spacings along lines of sight that a loop around a jump reaches at least. Less deep ones are of steep places, where noise and missing
/// samples leave facets that look like jumps.
const DEEP: f64 = 6.0;

/// Lines, and bundles of them, that are in a bundle: their samples follow each other, so they lie near each other.
const MEMBERS: usize = 8;

/// A line of sight.
#[derive(Clone, Copy)]
struct Line {
    /// From the sample to its sensor, of length 1. Zero if that is not known.
    direction: DVec3,
    /// Distance of the sensor.
    length: f64,
    /// Distance before the sample of a thing that it lies behind.
    behind: f64,
}

/// The lines of sight of all samples. None if no sensor is known.
#[derive(Default)]
pub(super) struct Lines {
    lines: Vec<Line>,
    /// Bundles of lines, bundles of these, and so on up to one.
    levels: Vec<Vec<Bundle>>,
}

impl Lines {
    /// `allowed`: largest perimeter of a facet at a sample.
    pub(super) fn of(
        sighted: Sighted<'_>,
        mut allowed: impl FnMut(u32) -> f64,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let mut lines = Vec::new();
        if sighted.seen.sensors.is_empty() {
            return Ok(Lines::default());
        }
        let share = BEHIND / (3.0 * TRUSTED);
        lines.reserve_exact(sighted.samples.points.len());
        for range in progress.ranges(sighted.samples.points.len()) {
            lines.extend(range?.map(|sample| {
                let toward = sighted.toward_sensor(sample);
                Line {
                    direction: toward.normalize_or_zero(),
                    length: toward.length(),
                    behind: share * allowed(sample as u32),
                }
            }));
        }
        let from = sighted.samples.points.par_chunks(MEMBERS);
        let mut levels: Vec<Vec<Bundle>> = Vec::new();
        let mut bundles: Vec<Bundle> =
            lines.par_chunks(MEMBERS).zip(from).map(|(lines, from)| Bundle::of_lines(lines, from)).collect();
        while bundles.len() > 1 {
            progress.check()?;
            let above = bundles.par_chunks(MEMBERS).map(Bundle::of).collect();
            levels.push(std::mem::replace(&mut bundles, above));
        }
        levels.push(bundles);
        Ok(Lines { lines, levels })
    }

    pub(super) fn are_unknown(&self) -> bool {
        self.lines.is_empty()
    }

    /// Whether a facet spans a jump: the sensors of all its samples see it edge-on, and one of these behind another.
    pub(super) fn is_jump(&self, points: &[DVec3], facet: [u32; 3]) -> bool {
        if self.are_unknown() {
            return false;
        }
        let [a, b, c] = facet.map(|v| points[v as usize]);
        let edges = [b - a, c - b, a - c];
        let normal = edges[0].cross(edges[1]);
        let lines = facet.map(|v| self.lines[v as usize]);
        let behind = lines.iter().map(|line| line.behind).sum::<f64>() / 3.0;
        lines.iter().all(|line| {
            let along = edges.iter().map(|edge| edge.dot(line.direction).abs()).fold(0.0, f64::max);
            along > behind && STEEP * normal.dot(line.direction).abs() < normal.cross(line.direction).length()
        })
    }

    /// Whether samples of some facets near each other are far enough behind others for a loop around these to be around a jump.
    pub(super) fn are_deep(&self, points: &[DVec3], facets: &[[u32; 3]]) -> bool {
        if self.are_unknown() {
            return false;
        }
        let vertices = facets.as_flattened();
        let lines = || vertices.iter().map(|&v| self.lines[v as usize]);
        let direction = lines().map(|line| line.direction).sum::<DVec3>().normalize_or_zero();
        let behind = lines().map(|line| line.behind).sum::<f64>() / vertices.len() as f64;
        let along = || vertices.iter().map(|&v| points[v as usize].dot(direction));
        let [nearest, farthest] = [along().fold(f64::NEG_INFINITY, f64::max), along().fold(f64::INFINITY, f64::min)];
        nearest - farthest > DEEP / BEHIND * behind
    }

    /// Whether a line of sight passes through a facet.
    pub(super) fn pass(&self, points: &[DVec3], facet: [u32; 3]) -> bool {
        let corners = facet.map(|v| points[v as usize]);
        self.levels
            .last()
            .is_some_and(|top| self.any_pass(points, corners, &Ball::around(&corners), self.levels.len(), 0..top.len()))
    }

    /// The same for the bundles `which` of the level below `level`. Of 0, for lines.
    fn any_pass(&self, points: &[DVec3], corners: [DVec3; 3], ball: &Ball, level: usize, which: Range<usize>) -> bool {
        match level.checked_sub(1) {
            None => which.into_iter().any(|i| self.lines[i].passes(points[i], corners)),
            Some(level) => which.into_iter().any(|i| {
                let below = if level == 0 { self.lines.len() } else { self.levels[level - 1].len() };
                let members = MEMBERS * i..below.min(MEMBERS * (i + 1));
                self.levels[level][i].may_meet(ball) && self.any_pass(points, corners, ball, level, members)
            }),
        }
    }
}

impl Line {
    /// Whether it passes through a triangle well before the sample that it ends at.
    fn passes(&self, from: DVec3, corners: [DVec3; 3]) -> bool {
        let [a, b, c] = corners.map(|corner| corner - from);
        let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|normal| normal.dot(self.direction));
        let normal = (b - a).cross(c - a);
        let at = normal.dot(a) / normal.dot(self.direction);
        (sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0))
            && at > self.behind
            && at < self.length
    }
}

/// Around points.
#[derive(Clone, Copy)]
struct Ball {
    centre: DVec3,
    radius: f64,
}

impl Ball {
    fn around(points: &[DVec3]) -> Self {
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        Ball { centre, radius: points.iter().map(|point| point.distance(centre)).fold(0.0, f64::max) }
    }
}

/// Around lines of sight of samples near each other.
struct Bundle {
    from: Ball,
    direction: DVec3,
    /// Largest difference of directions from that one. Negative if there are no lines.
    spread: f64,
}

impl Bundle {
    fn of_lines(lines: &[Line], from: &[DVec3]) -> Self {
        let known = || lines.iter().map(|line| line.direction).filter(|direction| *direction != DVec3::ZERO);
        let direction = known().sum::<DVec3>().normalize_or_zero();
        let spread = known().map(|other| other.distance(direction)).fold(-1.0, f64::max);
        Bundle { from: Ball::around(from), direction, spread }
    }

    fn of(bundles: &[Bundle]) -> Self {
        let known = || bundles.iter().filter(|bundle| bundle.spread >= 0.0);
        let direction = known().map(|bundle| bundle.direction).sum::<DVec3>().normalize_or_zero();
        let spread = known().map(|other| other.direction.distance(direction) + other.spread).fold(-1.0, f64::max);
        let centre = bundles.iter().map(|bundle| bundle.from.centre).sum::<DVec3>() / bundles.len() as f64;
        let radius =
            bundles.iter().map(|bundle| bundle.from.centre.distance(centre) + bundle.from.radius).fold(0.0, f64::max);
        Bundle { from: Ball { centre, radius }, direction, spread }
    }

    /// Whether one of the lines may meet a ball.
    fn may_meet(&self, ball: &Ball) -> bool {
        let off = ball.centre - self.from.centre;
        let room = ball.radius + self.from.radius + self.spread * off.length();
        self.spread >= 0.0 && off.cross(self.direction).length() <= room && off.dot(self.direction) >= -room
    }
}
