//! Evidence for a motion and against it: surface on surface, and surface where a sensor saw through \[HH03\].
//!
//! Huber & Hebert, "Fully automatic registration of multiple 3D data sets", Image and Vision Computing 21, 2003.

use glam::{DAffine3, DVec3};

use crate::level::expected;
use crate::linear::{Matrix6, Vector6, eigen};
use crate::refine::{Both, Contact};
use crate::view::View;
use crate::visibility::Seen;

/// Areas by what was found of them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Verdict {
    /// Of samples of the first and of the second: on the other's surface.
    pub on: [f64; 2],
    /// The area that the other's sensor saw through.
    pub through: [f64; 2],
    /// The area where the other's surface is near and faces another way. Told by a glance alone.
    pub otherwise: [f64; 2],
    /// Behind what the other saw, of both. Told by a glance alone.
    pub hidden: f64,
    /// Of all samples.
    pub total: [f64; 2],
    /// The distance of a scan's own neighbours along their normals, of both scans, as a deviation.
    pub expected: f64,
    /// Mean square of the distances of those on the other's surface, along the normal.
    pub mean_square: f64,
    pub hold: Hold,
}

impl Verdict {
    pub fn touching(&self) -> f64 {
        self.on[0] + self.on[1]
    }

    /// Share of what could be told that speaks against the motion.
    pub fn contradiction(&self) -> f64 {
        let through = self.through[0] + self.through[1];
        through / (through + self.touching()).max(f64::MIN_POSITIVE)
    }

    /// Share of the scan that lies less on the other, of its own.
    pub fn overlap(&self) -> [f64; 2] {
        [0, 1].map(|i| self.on[i] / self.total[i].max(f64::MIN_POSITIVE))
    }

    /// The score that ranks motions of the same two scans.
    pub fn score(&self) -> f64 {
        self.touching() * self.closeness()
            - 2.0 * (self.through[0] + self.through[1])
            - 0.7 * (self.otherwise[0] + self.otherwise[1])
    }

    /// How far the pose may be off in the direction that is held least, where each piece of so many cells counts once.
    pub fn slip(&self, cell: f64) -> f64 {
        let pieces = self.touching() / (PIECE * PIECE * cell * cell);
        self.mean_square.sqrt().max(EXACT * cell) / (pieces * self.hold.least).max(f64::MIN_POSITIVE).sqrt()
    }

    /// How close surfaces lie for what they can: 1 where they coincide, 0 from what is too far for the same surface. Different
    /// surfaces that bend alike lie 1.4 to 5 times as far apart as the same. The same lie at most 0.85 times `expected`.
    pub fn closeness(&self) -> f64 {
        let far = FAR * self.expected;
        if self.expected == 0.0 { 1.0 } else { (1.0 - self.mean_square / (far * far)).max(0.0) }
    }
}

/// Beyond so many times what is expected, surfaces are not the same.
const FAR: f64 = 1.2;
/// Surfaces are never closer than so many cells, by what lies between points.
const EXACT: f64 = 0.05;
/// Width of a piece of surface whose distances are off together, in cells.
pub(crate) const PIECE: f64 = 4.0;

/// How far surfaces of two scans may lie from each other at their finer levels: a cell, or what their noise does.
pub(crate) fn tolerance(views: [&View; 2]) -> f64 {
    let noise = views[0].fine().noise.hypot(views[1].fine().noise);
    views[0].fine().cell.max(views[1].fine().cell).max(NOISE * noise)
}

/// Deviations of the distance of two surfaces that are within the tolerance.
const NOISE: f64 = 4.0;

/// A quick look by depths alone, with so many samples.
pub(crate) fn glance(views: [&View; 2], samples: [&[u32]; 2], a_from_b: &DAffine3, tolerance: f64) -> Option<Verdict> {
    let motions = [a_from_b.inverse(), *a_from_b];
    let mut verdict = Verdict::default();
    for side in 0..2 {
        let (mine, other) = (&views[side].coarse, views[1 - side].depth_map()?);
        for &k in samples[side] {
            let area = mine.areas[k as usize];
            verdict.total[side] += area;
            let (at, normal) = (mine.points[k as usize], mine.normals[k as usize]);
            match other.see(motions[side].transform_point3(at), motions[side].transform_vector3(normal), tolerance) {
                Seen::Surface => verdict.on[side] += area,
                Seen::Otherwise => verdict.otherwise[side] += area,
                Seen::Through => verdict.through[side] += area,
                Seen::Hidden => verdict.hidden += area,
                Seen::Nothing => {}
            }
        }
    }
    Some(verdict)
}

/// Samples that tell whether two scans may touch at all.
const GLANCE: usize = 150;

/// Share of a few samples of the second that lie near the first, or no further from there than `margin`.
pub(crate) fn touching_share([a, b]: [&View; 2], motion: &DAffine3, margin: f64) -> f64 {
    if motion.translation.length() >= a.reduced.radius + b.reduced.radius + margin {
        return 0.0;
    }
    let cell = a.coarse.cell.max(b.coarse.cell);
    let samples = b.coarse.spread(GLANCE);
    let touches = |k: &&u32| {
        let at = motion.transform_point3(b.coarse.points[**k as usize]);
        a.coarse.near.nearest_within(at, 3.0 * cell + margin).is_some()
    };
    samples.iter().filter(touches).count() as f64 / samples.len().max(1) as f64
}

/// The whole look, at one level: by nearest points with normals, and depths.
pub(crate) fn judge(views: [&View; 2], both: &Both<'_>, a_from_b: &DAffine3, tolerance: f64) -> Verdict {
    let motions = [a_from_b.inverse(), *a_from_b];
    let mut verdict = Verdict { expected: expected(both.levels), ..Verdict::default() };
    let radius = views[0].reduced.radius.min(views[1].reduced.radius);
    let mut touches: Vec<Touch> = Vec::new();
    for side in 0..2 {
        let (mine, other) = (both.levels[side], both.levels[1 - side]);
        for &k in &both.samples[side] {
            let k = k as usize;
            let area = mine.areas[k];
            verdict.total[side] += area;
            let at = motions[side].transform_point3(mine.points[k]);
            let normal = motions[side].transform_vector3(mine.normals[k]);
            if let Some((n, _)) = other.near.nearest_within(at, 2.0 * other.cell + tolerance) {
                let n = n as usize;
                let cosine = other.normals[n].dot(normal);
                let mean = (other.normals[n] + normal).normalize_or_zero();
                let distance = (at - other.points[n]).dot(mean);
                if cosine > 0.6 && distance.abs() <= tolerance {
                    if !other.is_border[n] {
                        verdict.on[side] += area;
                        touches.push(match side {
                            0 => {
                                let normals = [mine.normals[k], a_from_b.transform_vector3(other.normals[n])];
                                Touch { place: mine.points[k], normals, distance, area }
                            }
                            _ => Touch { place: at, normals: [normal, other.normals[n]], distance, area },
                        });
                    }
                    continue;
                }
                // The other side of something thin.
                if cosine < -0.3 && distance.abs() <= tolerance {
                    continue;
                }
            }
            if views[1 - side].depth_map().is_some_and(|map| map.see(at, normal, 2.0 * tolerance) == Seen::Through) {
                verdict.through[side] += area;
            }
        }
    }
    if !touches.is_empty() {
        let weight: f64 = touches.iter().map(|touch| touch.area).sum();
        verdict.mean_square =
            touches.iter().map(|touch| touch.area * touch.distance * touch.distance).sum::<f64>() / weight;
        verdict.hold = Hold::of(&touches, weight, radius);
    }
    verdict
}

/// A sample on the other's surface, in one frame.
pub(crate) struct Touch {
    pub place: DVec3,
    pub normals: [DVec3; 2],
    /// Along the normal.
    pub distance: f64,
    pub area: f64,
}

impl Touch {
    pub fn of(contact: &Contact) -> Self {
        let Contact { normals, area, .. } = *contact;
        Touch { place: 0.5 * (contact.a + contact.b), normals, distance: contact.distance(), area }
    }
}

/// A motion that may join two scans.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Mode {
    pub a_from_b: DAffine3,
    pub verdict: Verdict,
}

/// The hold of a scan against sliding on another: the normal equations' eigenvalues, lengths and turns (times the radius) alike.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hold {
    /// Rising. Their mean is 1. Below 0 by noise alone.
    pub values: [f64; 6],
    /// Turn (times the radius) and shift of each, about `middle`.
    pub vectors: Matrix6,
    pub middle: DVec3,
    pub radius: f64,
    /// The least eigenvalue of unit vectors of turn and shift, on average over the area.
    pub least: f64,
}

impl Hold {
    /// Noise of normals would hold even a sphere. It is not the same in two scans, so that the products of one's rows with the
    /// other's are free of it.
    pub fn of(touches: &[Touch], weight: f64, radius: f64) -> Self {
        let middle = touches.iter().map(|touch| touch.area * touch.place).sum::<DVec3>() / weight;
        let mut products = [[0.0; 6]; 6];
        for touch in touches {
            let [a, b]: [Vector6; 2] = touch.normals.map(|normal| {
                let arm = (touch.place - middle).cross(normal) / radius;
                [arm.x, arm.y, arm.z, normal.x, normal.y, normal.z]
            });
            for i in 0..6 {
                for j in 0..6 {
                    products[i][j] += touch.area * 0.5 * (a[i] * b[j] + b[i] * a[j]);
                }
            }
        }
        let (values, vectors) = eigen(&products);
        let mean = values.iter().sum::<f64>() / 6.0;
        Hold { values: values.map(|value| value / mean), vectors, middle, radius, least: values[0].max(0.0) / weight }
    }

    /// The least eigenvalue: 0 where something may slide.
    pub fn balance(&self) -> f64 {
        self.values[0].max(0.0)
    }
}
