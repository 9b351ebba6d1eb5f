//! Edges are turned until no point is inside of the circle around a triangle. \[Law77\]
//!
//! The circle around a triangle in a plane is where the sphere through its corners and any point beside the plane meets
//! it. So one point above the plane, the same for all circles, makes the exact sign for spheres one for circles, however
//! the plane lies in space.

use glam::DVec3;

use super::triangulation::{Delaunay2, OUTSIDE};
use super::view::View;
use crate::predicates::{Arithmetic, sphere_sign};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Cost of a sign beside that of looking at an entry.
const COSTLY: usize = 32;

/// Whether points are inside of circles in their plane.
pub(super) struct Circles<'a> {
    points: &'a [DVec3],
    factor: f64,
    arithmetic: Arithmetic,
    above: DVec3,
}

impl<'a> Circles<'a> {
    pub(super) fn new(points: &'a [DVec3], view: &View) -> Self {
        let all = || points.iter().map(|p| *p * view.factor);
        let (low, high) = all().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let mut above = points[0] * view.factor;
        // As far away as the points are from each other, with few digits; but far enough to be another number.
        let mut height = (high - low).max_element().log2().ceil().exp2();
        while above[view.axis] + height == above[view.axis] {
            height *= 2.0;
        }
        above[view.axis] += height;
        let (arithmetic, factor) = Arithmetic::of(all().chain([above]));
        Circles { points, factor: view.factor * factor, arithmetic, above: above * factor }
    }

    /// Whether a point lies inside of the circle of a triangle that turns counter-clockwise where it is seen from.
    pub(super) fn holds(&self, triangle: [u32; 3], point: u32) -> bool {
        let at = |v: u32| self.points[v as usize] * self.factor;
        let [a, b, c] = triangle.map(at);
        sphere_sign([a, b, c, self.above, at(point)], self.arithmetic) > 0
    }
}

pub(super) fn make_delaunay(
    made: &mut Delaunay2,
    points: &[DVec3],
    view: &View,
    progress: &Progress<'_>,
) -> Result<()> {
    let circles = Circles::new(points, view);
    let mut pace = Pace::new(progress);
    let mut suspects = Vec::new();
    for triangle in 0..made.triangles.len() as u32 {
        suspects.extend([0, 1, 2].map(|slot| (triangle, slot)));
        while let Some((triangle, slot)) = suspects.pop() {
            pace.after(COSTLY)?;
            let Some(other) = made.beyond(triangle, slot) else { continue };
            let apex = made.triangles[other.0 as usize][other.1];
            if circles.holds(made.triangles[triangle as usize], apex) {
                made.turn(triangle, slot, other);
                suspects.extend([0, 1, 2].map(|slot| (triangle, slot)));
                suspects.extend([0, 1, 2].map(|slot| (other.0, slot)));
            }
        }
    }
    Ok(())
}

impl Delaunay2 {
    /// The triangle across the edge opposite to a corner, and its corner opposite to that edge.
    fn beyond(&self, triangle: u32, slot: usize) -> Option<(u32, usize)> {
        let other = self.neighbours[triangle as usize][slot];
        let mirror = || self.neighbours[other as usize].iter().position(|&n| n == triangle);
        (other != OUTSIDE).then(|| (other, mirror().expect("neighbours are mutual")))
    }

    /// Turns the edge opposite to a corner: it joins that corner to the one beyond.
    fn turn(&mut self, triangle: u32, slot: usize, (other, mirror): (u32, usize)) {
        let [apex, from, to] = [0, 1, 2].map(|k| self.triangles[triangle as usize][(slot + k) % 3]);
        let beyond = self.triangles[other as usize][mirror];
        // Names by the edge that they lie across.
        let [_, to_apex, apex_from] = [0, 1, 2].map(|k| self.neighbours[triangle as usize][(slot + k) % 3]);
        let [_, from_beyond, beyond_to] = [0, 1, 2].map(|k| self.neighbours[other as usize][(mirror + k) % 3]);
        self.triangles[triangle as usize] = [apex, from, beyond];
        self.neighbours[triangle as usize] = [from_beyond, other, apex_from];
        self.triangles[other as usize] = [apex, beyond, to];
        self.neighbours[other as usize] = [beyond_to, to_apex, triangle];
        self.replace_neighbour(from_beyond, other, triangle);
        self.replace_neighbour(to_apex, triangle, other);
    }

    fn replace_neighbour(&mut self, of: u32, before: u32, after: u32) {
        if of != OUTSIDE {
            let place = self.neighbours[of as usize].iter_mut().find(|n| **n == before);
            *place.expect("neighbours are mutual") = after;
        }
    }
}
