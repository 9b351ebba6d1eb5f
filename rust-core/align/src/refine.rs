//! A motion made exact: symmetric point-to-plane ICP \[RUS19\].
//!
//! Rusinkiewicz, "A Symmetric Objective Function for ICP", ACM TOG 38(4), 2019, equation 9: residual `(p - q) . (n_p + n_q)`, half of the
//! rotation on either side. Differences: points of both scans look for their nearest in the other. Points on borders are matched with none
//! (Turk & Levoy 1994). Matches weigh less the farther they are from the plane (Welsch).

use glam::{DAffine3, DQuat, DVec3};

use crate::level::{Level, expected};
use crate::linear::{Sums, rigid, solve};
use crate::tint::Tint;

/// Least cosine between normals of matched points.
const COSINE: f64 = 0.6;
/// Share of the mean square that directions nothing holds get, so that they stay.
const RIDGE: f64 = 1e-5;

/// Two levels of different scans, and the points of each that look for their nearest in the other.
pub(crate) struct Both<'a> {
    pub levels: [&'a Level; 2],
    pub samples: [Vec<u32>; 2],
    /// Whether steps go by tints as well.
    pub by_colour: bool,
}

/// Points of both scans near each other, in the first's frame.
#[derive(Clone, Copy)]
pub(crate) struct Contact {
    /// Their indices in the levels.
    pub indices: [u32; 2],
    pub a: DVec3,
    pub b: DVec3,
    /// Unit normals. Of a contact by colour gradients of a tint, in deviations of distance a deviation of tint.
    pub normals: [DVec3; 2],
    /// The mean of both.
    pub normal: DVec3,
    pub area: f64,
    /// A term that is added to the distance: 0, but for contacts by colour.
    pub offset: f64,
}

impl Contact {
    /// The same in another frame.
    pub fn moved(&self, by: &DAffine3) -> Self {
        Contact {
            a: by.transform_point3(self.a),
            b: by.transform_point3(self.b),
            normals: self.normals.map(|normal| by.transform_vector3(normal)),
            normal: by.transform_vector3(self.normal),
            ..*self
        }
    }

    pub fn distance(&self) -> f64 {
        (self.b - self.a).dot(self.normal) + self.offset
    }
}

fn mean([a, b]: [DVec3; 2]) -> DVec3 {
    (a + b).normalize()
}

impl<'a> Both<'a> {
    pub fn new(a: &'a Level, b: &'a Level, samples: usize) -> Self {
        Both { levels: [a, b], samples: [a.spread(samples), b.spread(samples)], by_colour: false }
    }

    /// Calls `visit` with every sample's nearest point closer than `distance` that faces the same way and lies on no border.
    pub fn contacts(&self, a_from_b: &DAffine3, distance: f64, mut visit: impl FnMut(Contact)) {
        let b_from_a = a_from_b.inverse();
        let [a, b] = self.levels;
        for &k in &self.samples[1] {
            let k = k as usize;
            let at = a_from_b.transform_point3(b.points[k]);
            let Some((n, _)) = a.near.nearest_within(at, distance) else { continue };
            let n = n as usize;
            let normal = a_from_b.transform_vector3(b.normals[k]);
            if !a.is_border[n] && a.normals[n].dot(normal) > COSINE {
                let normals = [a.normals[n], normal];
                let indices = [n as u32, k as u32];
                visit(Contact {
                    indices,
                    a: a.points[n],
                    b: at,
                    normals,
                    normal: mean(normals),
                    area: b.areas[k],
                    offset: 0.0,
                });
            }
        }
        for &k in &self.samples[0] {
            let k = k as usize;
            let Some((n, _)) = b.near.nearest_within(b_from_a.transform_point3(a.points[k]), distance) else {
                continue;
            };
            let n = n as usize;
            let normal = a_from_b.transform_vector3(b.normals[n]);
            if !b.is_border[n] && a.normals[k].dot(normal) > COSINE {
                let normals = [a.normals[k], normal];
                let at = a_from_b.transform_point3(b.points[n]);
                let indices = [k as u32, n as u32];
                visit(Contact {
                    indices,
                    a: a.points[k],
                    b: at,
                    normals,
                    normal: mean(normals),
                    area: a.areas[k],
                    offset: 0.0,
                });
            }
        }
    }

    /// Mean difference of the tints where surfaces touch: another exposure, another lamp.
    pub fn exposure(&self, contacts: &[Contact]) -> Tint {
        let [a, b] = self.levels.map(|level| &level.tints.values);
        let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
        for contact in contacts {
            let [i, j] = contact.indices.map(|k| k as usize);
            sum += contact.area * (b[j] - a[i]);
            weight += contact.area;
        }
        sum / f64::max(weight, f64::MIN_POSITIVE)
    }

    /// The equations that tints give at contacts, three each: gradients are to tints what normals are to distances (Park, Zhou, Koltun,
    /// "Colored Point Cloud Registration Revisited", ICCV 2017, equation 8. Here it is symmetric, and a deviation of a tint's noise counts
    /// as much as one of distance).
    pub fn by_tints(&self, a_from_b: &DAffine3, contacts: &[Contact]) -> Vec<Contact> {
        let [a, b] = self.levels.map(|level| &level.tints);
        if a.is_empty() || b.is_empty() {
            return Vec::new();
        }
        let exposure = self.exposure(contacts);
        let unit = expected(self.levels) / a.noise.hypot(b.noise);
        let mut found = Vec::with_capacity(3 * contacts.len());
        for contact in contacts {
            let [i, j] = contact.indices.map(|k| k as usize);
            let by = (b.values[j] - a.values[i] - exposure).to_array();
            for (channel, by) in by.into_iter().enumerate() {
                let gradients = [a.gradients[i][channel], a_from_b.transform_vector3(b.gradients[j][channel])];
                let normals = gradients.map(|gradient| unit * gradient);
                let normal = 0.5 * (normals[0] + normals[1]);
                found.push(Contact { normals, normal, offset: -unit * by, ..*contact });
            }
        }
        found
    }

    /// One step: the motion after it, and how far it moved points at distance `radius` from the middle of the contacts.
    fn step(&self, a_from_b: &DAffine3, reach: f64, scale: f64, radius: f64) -> Option<(DAffine3, f64)> {
        let mut contacts = Vec::new();
        self.contacts(a_from_b, reach, |contact| contacts.push(contact));
        if self.by_colour {
            contacts.extend(self.by_tints(a_from_b, &contacts));
        }
        let (step, by) = step(&contacts, scale, radius)?;
        Some((rigid(&(step * *a_from_b)), by))
    }

    /// Steps at falling reaches, each until steps are small. `None` where the scans don't touch.
    pub fn refine(&self, start: &DAffine3, schedule: &[Reach], radius: f64) -> Option<DAffine3> {
        let mut motion = *start;
        for reach in schedule {
            for _ in 0..reach.steps {
                let (moved, by) = self.step(&motion, reach.distance, reach.scale, radius)?;
                motion = moved;
                if by < reach.enough {
                    break;
                }
            }
        }
        Some(motion)
    }
}

/// The motion that brings the second points of contacts closest to the first, and how far it moves points at distance `radius`
/// from the middle of the contacts. Residuals beyond `scale` weigh less than a third.
pub(crate) fn step(contacts: &[Contact], scale: f64, radius: f64) -> Option<(DAffine3, f64)> {
    if contacts.len() < FEWEST {
        return None;
    }
    let middle = contacts.iter().map(|c| c.a + c.b).sum::<DVec3>() / (2.0 * contacts.len() as f64);
    let mut sums = Sums::default();
    for contact in contacts {
        let residual = contact.distance();
        let arm = (contact.a + contact.b - 2.0 * middle).cross(contact.normal) / radius;
        let weight = (-(residual / scale).powi(2)).exp();
        let n = contact.normal;
        sums.add(&[arm.x, arm.y, arm.z, n.x, n.y, n.z], residual, weight);
    }
    let mut squares = sums.mirrored();
    let ridge = RIDGE * (0..6).map(|i| squares[i][i]).sum::<f64>();
    (0..6).for_each(|i| squares[i][i] += ridge);
    let x = solve(&squares, &sums.gradient.map(|g| -g))?;
    let turn = DVec3::new(x[0], x[1], x[2]) / radius;
    let shift = DVec3::new(x[3], x[4], x[5]);
    let angle = turn.length().atan();
    let half = DQuat::from_scaled_axis(turn.normalize_or_zero() * angle);
    let about = |q: DQuat| DAffine3::from_rotation_translation(q, DVec3::ZERO);
    let step = DAffine3::from_translation(middle)
        * about(half)
        * DAffine3::from_translation(shift * angle.cos())
        * about(half)
        * DAffine3::from_translation(-middle);
    Some((step, 2.0 * angle * radius + shift.length()))
}

/// Fewer contacts decide nothing.
const FEWEST: usize = 12;

/// How a part of the steps looks for contacts. Lengths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    pub distance: f64,
    /// Residuals beyond weigh less than a third.
    pub scale: f64,
    pub steps: usize,
    /// Smaller steps end it.
    pub enough: f64,
}
