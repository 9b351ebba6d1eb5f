//! The serpent's body: a tapering tube along its spine with scales, belly plates and fins.

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use super::column::{FLOOR, shaft_radius};
use super::field::{Part, smooth_max, smooth_step};

const BACK: DVec3 = DVec3::new(0.015, 0.12, 0.085);
const FLANK: DVec3 = DVec3::new(0.07, 0.36, 0.16);
const BELLY: DVec3 = DVec3::new(0.72, 0.52, 0.20);
const FIN: DVec3 = DVec3::new(0.62, 0.07, 0.03);
const SEAM: DVec3 = DVec3::new(0.01, 0.04, 0.03);

/// Segments of the spine.
const SEGMENTS: usize = 720;
/// Segments that share a bounding ball.
const GROUP: usize = 12;
const GROUPS: usize = SEGMENTS / GROUP;
const _: () = assert!(GROUPS * GROUP == SEGMENTS);
/// If the smooth tube is further away than this, so is everything on it, by at least 6.
const TALLEST: f64 = 16.0;
/// Scales around the body.
const SCALES: f64 = 12.0;

struct Vertebra {
    at: DVec3,
    radius: f64,
    /// Unit direction of the back, across the spine.
    back: DVec3,
    /// Unit direction toward the head.
    ahead: DVec3,
    /// Scales counted from the tail.
    scales: f64,
    /// Way from the tail.
    way: f64,
}

pub(super) struct Serpent {
    spine: Vec<Vertebra>,
    /// Centre and radius of the ball around each group of segments, body included.
    balls: Vec<(DVec3, f64)>,
}

/// Place of the head: the end of the spine and the axes (side, up, ahead).
pub(super) struct HeadFrame {
    pub at: DVec3,
    pub axes: DMat3,
}

/// The spine's course, from the tail at 0 to the head at 1.
fn course(t: f64) -> DVec3 {
    let angle = TAU * (2.85 * t - 0.35);
    // On the floor, then up around the shaft, then free of it.
    let climb = smooth_step(0.16, 0.86, t) * 0.55 + ((t - 0.2) / 0.66).clamp(0.0, 1.0) * 0.45;
    let z = FLOOR + 8.0 * smooth_step(0.0, 0.25, t) + 122.0 * climb;
    let lean = shaft_radius(z) + 7.5;
    let on_floor = 1.0 - smooth_step(0.12, 0.45, t);
    let free = smooth_step(0.80, 1.0, t);
    let rho = lean + 20.0 * on_floor + 34.0 * free;
    let rise = 52.0 * smooth_step(0.80, 1.02, t) - 20.0 * smooth_step(0.93, 1.03, t);
    DVec3::new(rho * angle.cos(), rho * angle.sin(), z + rise)
}

fn thickness(t: f64) -> f64 {
    let body = 1.3 + 9.0 * smooth_step(-0.12, 0.55, t) * (0.25 + 0.75 * smooth_step(0.0, 0.35, t));
    body - 2.6 * smooth_step(0.82, 0.97, t)
}

impl Serpent {
    pub fn new() -> Self {
        let points: Vec<DVec3> = (0..=SEGMENTS).map(|i| course(i as f64 / SEGMENTS as f64)).collect();
        let mut spine: Vec<Vertebra> = Vec::with_capacity(points.len());
        let (mut way, mut scales) = (0.0, 0.0);
        for i in 0..=SEGMENTS {
            let t = i as f64 / SEGMENTS as f64;
            let (before, after) = (points[i.saturating_sub(1)], points[(i + 1).min(SEGMENTS)]);
            let ahead = (after - before).normalize();
            let radius = thickness(t);
            if i > 0 {
                let step = points[i].distance(points[i - 1]);
                way += step;
                scales += step * SCALES / (TAU * radius.max(3.0) * 1.2);
            }
            // The back looks away from the shaft, upward on the floor and at the head.
            let outward = points[i].with_z(0.0).normalize();
            let upward = 1.6 * (1.0 - smooth_step(0.1, 0.35, t)) + 0.35 + 3.0 * smooth_step(0.86, 0.97, t);
            let back = outward + DVec3::Z * upward;
            let back = (back - ahead * back.dot(ahead)).normalize();
            spine.push(Vertebra { at: points[i], radius, back, ahead, scales, way });
        }
        let balls = spine[..SEGMENTS]
            .chunks(GROUP)
            .enumerate()
            .map(|(g, group)| {
                let centre = group[group.len() / 2].at;
                let members = &spine[g * GROUP..=g * GROUP + group.len()];
                (centre, members.iter().map(|v| v.at.distance(centre) + v.radius).fold(0.0, f64::max))
            })
            .collect();
        Serpent { spine, balls }
    }

    pub fn head_frame(&self) -> HeadFrame {
        let last = &self.spine[SEGMENTS];
        // The head bows a little below the neck's direction.
        let ahead = (last.ahead - last.back * 0.25 + last.at.with_z(0.0).normalize() * 0.35).normalize();
        let up = (last.back - ahead * last.back.dot(ahead)).normalize();
        HeadFrame { at: last.at, axes: DMat3::from_cols(ahead.cross(up), up, ahead) }
    }

    /// The segment whose tube is nearest: its index, how far along it, and the distance from the smooth tube. Only a bound of
    /// the distance where it is above `enough`.
    fn nearest(&self, p: DVec3, enough: f64) -> (usize, f64, f64) {
        let to_ball = |g: usize| p.distance(self.balls[g].0) - self.balls[g].1;
        let mut bounds = [0.0; GROUPS];
        let mut first = 0;
        for g in 0..GROUPS {
            bounds[g] = to_ball(g);
            if bounds[g] < bounds[first] {
                first = g;
            }
        }
        let mut best = (0, 0.0, f64::INFINITY);
        if bounds[first] > enough {
            return (0, 0.0, bounds[first]);
        }
        for g in std::iter::once(first).chain(0..GROUPS) {
            if bounds[g] >= best.2 {
                continue;
            }
            // Visited.
            bounds[g] = f64::INFINITY;
            for i in g * GROUP..(g + 1) * GROUP {
                let (a, b) = (&self.spine[i], &self.spine[i + 1]);
                let along = b.at - a.at;
                let t = ((p - a.at).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                let d = p.distance(a.at + along * t) - (a.radius + (b.radius - a.radius) * t);
                if d < best.2 {
                    best = (i, t, d);
                }
            }
        }
        best
    }

    pub fn part(&self, p: DVec3, coloured: bool) -> Part {
        let (i, t, smooth) = self.nearest(p, TALLEST);
        if smooth > TALLEST {
            // Nothing of the relief reaches further.
            return Part::new(smooth - 10.0, FLANK);
        }
        let (a, b) = (&self.spine[i], &self.spine[i + 1]);
        let mix = |f: &dyn Fn(&Vertebra) -> f64| f(a) + (f(b) - f(a)) * t;
        let (radius, scales, way) = (mix(&|v| v.radius), mix(&|v| v.scales), mix(&|v| v.way));
        let back = a.back.lerp(b.back, t).normalize();
        let ahead = a.ahead.lerp(b.ahead, t).normalize();
        let offset = p - a.at.lerp(b.at, t);
        let side = ahead.cross(back);
        let around = offset.dot(side).atan2(offset.dot(back));

        // Share of the belly, 0 on the back and flanks.
        let belly = smooth_step(2.05, 2.3, around.abs());
        let coarse = smooth_step(2.5, 5.0, radius);
        let v = around * SCALES / TAU;
        let diamond = ((scales + v) * TAU / 2.0).sin().abs() * ((scales - v) * TAU / 2.0).sin().abs();
        let plate = (scales * TAU / 2.0).sin().abs().sqrt().min(1.0);
        let relief = coarse * ((1.0 - belly) * 1.0 * diamond + belly * 0.45 * plate);
        let body = (smooth - relief) * 0.85;
        let skin = if coloured {
            let flank = BACK.lerp(FLANK, smooth_step(0.35, 1.6, around.abs()));
            let seam = coarse * (1.0 - smooth_step(0.0, 0.35, if belly > 0.5 { plate } else { diamond }));
            flank.lerp(BELLY, belly).lerp(SEAM, 0.75 * seam)
        } else {
            FLANK
        };
        let fin = self.fin(offset.dot(back), offset.dot(side), way, radius);
        Part::new(body, skin).blend(Part::new(fin, FIN), 1.2)
    }

    /// The comb along the back: thin spikes that lean toward the tail.
    fn fin(&self, up: f64, side: f64, way: f64, radius: f64) -> f64 {
        let length = self.spine[SEGMENTS].way;
        let (from_tail, from_head) = (way, length - way);
        let tall = 7.5 * smooth_step(60.0, 180.0, from_tail) * smooth_step(8.0, 50.0, from_head);
        if tall < 0.3 {
            return 1e6;
        }
        // A saw along the spine, sheared by the height so that the spikes lean back.
        let pitch = 11.0;
        let height = (up - radius).max(-2.0);
        let saw = ((way + 0.7 * height) / pitch).rem_euclid(1.0);
        let crest = tall * (0.30 + 0.70 * smooth_step(0.0, 0.62, saw) * (1.0 - smooth_step(0.62, 1.0, saw)));
        let share = (height / tall.max(1.0)).clamp(0.0, 1.0);
        let thick = 1.5 - 0.6 * share;
        smooth_max((height - crest) * 0.5, (side.abs() - thick).max(-height - 1.0), 0.8) * 0.9
    }
}
