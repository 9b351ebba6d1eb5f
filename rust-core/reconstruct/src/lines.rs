//! Open surfaces of scans: what lines of sight, from sensors to the samples they saw, say of facets.
//!
//! A facet that sensors see edge-on, one of its samples behind another, spans a jump: they looked past the one at the other. And where they
//! saw something behind a facet, there is none.

use std::sync::atomic::{AtomicU8, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::TRUSTED;
use super::complex::{Complex, Star};
use super::seen::Sighted;
use super::walk::along;
use base::error::Result;
use base::progress::Progress;

/// Spacings along its line of sight from which on something lies behind something else.
const BEHIND: f64 = 3.0;

/// Tangent of the angle between a surface and one that is seen head-on, from which on sensors see nothing of it: 80.5 degrees.
const STEEP: f64 = 6.0;

/// Samples looked at together: they lie near each other.
const CHUNK: usize = 64;

/// A line of sight.
#[derive(Clone, Copy)]
struct Line {
    /// From the sample to its sensor, of length 1; zero where that is not known.
    direction: DVec3,
    /// How far the sensor is.
    length: f64,
    /// How far before the sample something is that it lies behind.
    behind: f64,
}

/// The lines of sight of all samples; none where no sensor is known.
#[derive(Default)]
pub(super) struct Lines {
    lines: Vec<Line>,
    bundles: Vec<Bundle>,
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
        let of_chunks = lines.par_chunks(CHUNK).zip(sighted.samples.points.par_chunks(CHUNK));
        let bundles = of_chunks.map(|(lines, from)| Bundle::of(lines, from)).collect();
        progress.check()?;
        Ok(Lines { lines, bundles })
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

    /// The facets that lines of sight pass through, by cell a bit for each slot; of a facet between two cells either may have it.
    pub(super) fn crossed(&self, complex: Complex<'_>, incident: &[u32], progress: &Progress<'_>) -> Result<Vec<u8>> {
        if self.are_unknown() {
            return Ok(Vec::new());
        }
        let crossed: Vec<AtomicU8> = (0..complex.len()).map(|_| AtomicU8::new(0)).collect();
        self.lines.par_chunks(CHUNK).enumerate().try_for_each_init(Star::default, |star, (chunk, lines)| {
            progress.check()?;
            for (vertex, line) in (chunk * CHUNK..).zip(lines) {
                if line.direction == DVec3::ZERO || incident[vertex] == u32::MAX {
                    continue;
                }
                complex.star(vertex as u32, incident[vertex], star);
                along(complex, vertex as u32, star, line.direction, line.length, |cell, slot, at| {
                    if at > line.behind && at < line.length {
                        crossed[cell as usize].fetch_or(1 << slot, Ordering::Relaxed);
                    }
                });
            }
            Ok(())
        })?;
        Ok(crossed.into_iter().map(AtomicU8::into_inner).collect())
    }

    /// Whether a line of sight passes through one of a few triangles near each other.
    pub(super) fn pass(&self, points: &[DVec3], triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<bool> {
        let ball = Ball::around(triangles.as_flattened().iter().map(|&v| points[v as usize]));
        for (bundle, (lines, from)) in self.bundles.iter().zip(self.lines.chunks(CHUNK).zip(points.chunks(CHUNK))) {
            if !bundle.may_meet(&ball) {
                continue;
            }
            progress.check()?;
            for &triangle in triangles {
                let corners = triangle.map(|v| points[v as usize]);
                if from.iter().zip(lines).any(|(&from, line)| line.passes(from, corners)) {
                    return Ok(true);
                }
            }
        }
        Ok(false)
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
struct Ball {
    centre: DVec3,
    radius: f64,
}

impl Ball {
    fn around(points: impl ExactSizeIterator<Item = DVec3> + Clone) -> Self {
        let centre = points.clone().sum::<DVec3>() / points.len() as f64;
        Ball { centre, radius: points.map(|point| point.distance(centre)).fold(0.0, f64::max) }
    }
}

/// Around lines of sight of samples near each other.
struct Bundle {
    from: Ball,
    direction: DVec3,
    /// How far directions are from that one.
    spread: f64,
}

impl Bundle {
    fn of(lines: &[Line], from: &[DVec3]) -> Self {
        let known = || lines.iter().map(|line| line.direction).filter(|direction| *direction != DVec3::ZERO);
        let direction = known().sum::<DVec3>().normalize_or_zero();
        let spread = known().map(|other| other.distance(direction)).fold(0.0, f64::max);
        Bundle { from: Ball::around(from.iter().copied()), direction, spread }
    }

    /// Whether one of the lines may meet a ball.
    fn may_meet(&self, ball: &Ball) -> bool {
        let off = ball.centre - self.from.centre;
        off.cross(self.direction).length() <= ball.radius + self.from.radius + self.spread * off.length()
    }
}
