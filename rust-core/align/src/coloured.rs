//! Colour and intensity, where shape lets scans turn or slide, or fits in several places.
//!
//! Tints are compared where surfaces lie on each other: their gradients give equations as normals do (Park, Zhou, Koltun, "Colored
//! Point Cloud Registration Revisited", ICCV 2017, equation 8; here symmetric, and each tint in deviations of its own noise), and how
//! well they agree tells places apart. What is coloured alike is found by means and deviations over rings around a point.

use glam::{DAffine3, DVec3};

use crate::correspond::correspond;
use crate::features::{Descriptor, Features, LENGTH};
use crate::finding::{BALANCE, Finding, Limits, fits};
use crate::hypothesise::{Like, hypothesise};
use crate::judge::{Hold, Mode, Touch, expected, judge, tolerance};
use crate::level::{Level, Neighbours};
use crate::linear::apart;
use crate::pair::{Effort, Pair};
use crate::refine::{Both, Contact, Reach};
use crate::view::View;

/// Brightness, and red and blue against the others, 0 to 1 and -1 to 1; of intensities the first alone.
pub(crate) type Tint = DVec3;

/// Tints of samples, where there are colours or intensities.
pub(crate) fn tints(colour: Option<&[[u8; 4]]>, intensity: Option<&[f32]>) -> Option<Vec<Tint>> {
    if let Some(colour) = colour {
        let tint = |[r, g, b, _]: &[u8; 4]| {
            let [r, g, b] = [r, g, b].map(|x| f64::from(*x) / 255.0);
            let bright = (r + g + b) / 3.0;
            DVec3::new(bright, r - bright, b - bright)
        };
        return Some(colour.iter().map(tint).collect());
    }
    let intensity = intensity?;
    let finite = |x: &&f32| x.is_finite() && **x >= 0.0;
    let sum: f64 = intensity.iter().filter(finite).map(|x| f64::from(*x)).sum();
    let mean = sum / intensity.iter().filter(finite).count().max(1) as f64;
    let tint = |x: &f32| match (finite(&x), mean > 0.0) {
        (true, true) => DVec3::new((0.5 * f64::from(*x) / mean).min(1.0), 0.0, 0.0),
        _ => DVec3::new(0.5, 0.0, 0.0),
    };
    Some(intensity.iter().map(tint).collect())
}

/// The tints of a level's points; empty where the scan has none.
#[derive(Default)]
pub(crate) struct Tints {
    pub values: Vec<Tint>,
    /// How each of the three changes along the surface.
    pub gradients: Vec<[DVec3; 3]>,
    /// What neighbours differ by that gradients don't explain, as a deviation.
    pub noise: f64,
    /// Mean square of the differences from the mean.
    pub variance: f64,
}

/// Tints are never known better.
const LEAST_NOISE: f64 = 0.01;
/// Cells around a point that its gradient is of.
const AROUND: f64 = 1.8;

impl Tints {
    pub fn new(values: Vec<Tint>, level: &Level, grid: &Neighbours) -> Self {
        let mut near = Vec::new();
        let mut gradients = Vec::with_capacity(values.len());
        let (mut unexplained, mut count) = (0.0, 0.0);
        for (k, &here) in level.points.iter().enumerate() {
            grid.within(here, AROUND * level.cell, &mut near);
            let normal = level.normals[k];
            // Ridge: what neighbours say of a direction that none lies in is nothing.
            let ridge = 0.1 * level.cell * level.cell;
            let mut squares = glam::DMat3::from_diagonal(DVec3::splat(ridge));
            let mut right = [DVec3::ZERO; 3];
            for &n in near.iter().filter(|&&n| n as usize != k) {
                let along = (level.points[n as usize] - here).reject_from(normal);
                squares += glam::DMat3::from_cols(along * along.x, along * along.y, along * along.z);
                let by = values[n as usize] - values[k];
                for (right, by) in right.iter_mut().zip(by.to_array()) {
                    *right += by * along;
                }
            }
            let inverse = squares.inverse();
            let gradient = right.map(|right| inverse * right);
            for &n in near.iter().filter(|&&n| n as usize != k) {
                let along = level.points[n as usize] - here;
                let by = values[n as usize] - values[k];
                let off = by - DVec3::from(gradient.map(|gradient| gradient.dot(along)));
                unexplained += off.length_squared();
                count += 1.0;
            }
            gradients.push(gradient);
        }
        let mean = values.iter().sum::<DVec3>() / values.len().max(1) as f64;
        let variance = values.iter().map(|v| v.distance_squared(mean)).sum::<f64>() / values.len().max(1) as f64;
        let noise = (0.5 * unexplained / f64::max(count, 1.0)).sqrt().max(LEAST_NOISE);
        Tints { values, gradients, noise, variance }
    }

    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}

/// Whether two scans' tints can be compared, and say anything.
pub(crate) fn can_tell([a, b]: [&View; 2]) -> bool {
    let is_painted = |view: &View| {
        let tints = &view.fine().tints;
        !tints.is_empty() && tints.variance.sqrt() > PAINTED * tints.noise
    };
    a.reduced.has_chroma == b.reduced.has_chroma && is_painted(a) && is_painted(b)
}

/// Tints that differ by less of their noise say nothing.
const PAINTED: f64 = 1.5;

/// Mean difference of the tints where surfaces touch: another exposure, another lamp.
fn exposure(both: &Both<'_>, contacts: &[Contact]) -> Tint {
    let [a, b] = both.levels.map(|level| &level.tints.values);
    let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
    for contact in contacts {
        let [i, j] = contact.indices.map(|k| k as usize);
        sum += contact.area * (b[j] - a[i]);
        weight += contact.area;
    }
    sum / f64::max(weight, f64::MIN_POSITIVE)
}

/// The equations that tints give at contacts, three each.
pub(crate) fn contacts(both: &Both<'_>, a_from_b: &DAffine3, contacts: &[Contact]) -> Vec<Contact> {
    let [a, b] = both.levels.map(|level| &level.tints);
    if a.is_empty() || b.is_empty() {
        return Vec::new();
    }
    let exposure = exposure(both, contacts);
    // A deviation of tint counts as much as one of distance.
    let unit = expected(both.levels) / a.noise.hypot(b.noise);
    let mut found = Vec::with_capacity(3 * contacts.len());
    for contact in contacts {
        let [i, j] = contact.indices.map(|k| k as usize);
        let by = (b.values[j] - a.values[i] - exposure).to_array();
        for (channel, by) in by.into_iter().enumerate() {
            let normals = [a.gradients[i][channel], a_from_b.transform_vector3(b.gradients[j][channel])].map(|g| unit * g);
            let normal = 0.5 * (normals[0] + normals[1]);
            found.push(Contact { normals, normal, offset: -unit * by, ..*contact });
        }
    }
    found
}

/// How well tints agree where surfaces touch: 1 at best, about 0 in a wrong place.
fn agreement(both: &Both<'_>, contacts: &[Contact]) -> f64 {
    let [a, b] = both.levels.map(|level| &level.tints.values);
    let exposure = exposure(both, contacts);
    let (mut off, mut weight) = (0.0, 0.0);
    let mut means = [DVec3::ZERO; 2];
    let mut squares = 0.0;
    for contact in contacts {
        let [i, j] = contact.indices.map(|k| k as usize);
        off += contact.area * (b[j] - a[i] - exposure).length_squared();
        means[0] += contact.area * a[i];
        means[1] += contact.area * b[j];
        squares += contact.area * (a[i].length_squared() + b[j].length_squared());
        weight += contact.area;
    }
    if weight == 0.0 {
        return 0.0;
    }
    let means = means.map(|mean| mean / weight);
    let varies = squares / weight - means[0].length_squared() - means[1].length_squared();
    // Noise of both is no disagreement.
    let noise: f64 = both.levels.iter().map(|level| level.tints.noise.powi(2)).sum();
    if varies < 2.0 * noise { 0.0 } else { 1.0 - (off / weight - noise).max(0.0) / (varies - noise) }
}

/// Tints that agree less are not of the same place.
const AGREES: f64 = 0.6;
/// Another place whose tints agree by so much of the best one's leaves it in doubt.
const RIVAL: f64 = 0.75;
/// Hypotheses that are looked at, and of these made exact.
const ROUGH: usize = 24;
const WHOLE: usize = 8;
const FEW: usize = 400;
const MANY: usize = 1000;

struct Coloured {
    mode: Mode,
    agreement: f64,
    /// With what tints hold.
    hold: Hold,
}

impl Coloured {
    fn score(&self) -> f64 {
        self.mode.verdict.score() * self.agreement.max(0.0)
    }
}

/// Two scans that fit by their shape, but not in one place alone: the place where their tints agree, if there is one alone.
pub(crate) fn pair(views: &[View], by_shape: Pair, limits: &Limits) -> Pair {
    let (a, b) = (by_shape.a, by_shape.b);
    let both = [&views[a], &views[b]];
    let cell = both[0].coarse.cell.max(both[1].coarse.cell);
    let radius = both[0].reduced.radius.min(both[1].reduced.radius);
    let [of_a, of_b] = both.map(|view| view.colour_features.get_or_init(|| features(&view.coarse)));
    let likes: Vec<Like> = correspond(of_a, of_b).iter().map(|m| Like::of_features(both, [of_a, of_b], m)).collect();
    let hypotheses = hypothesise(&likes, cell, radius, Effort::Thorough as usize);
    let starts = hypotheses.iter().take(ROUGH).map(|h| h.a_from_b).chain(by_shape.modes.iter().map(|m| m.a_from_b));
    let coarse = Both { by_colour: true, ..Both::new(&both[0].coarse, &both[1].coarse, FEW) };
    let reach = |by: f64, cell: f64| Reach { distance: by * cell, scale: 0.5 * by * cell, steps: 8, enough: 0.02 * cell };
    let mut rough: Vec<(f64, DAffine3)> = Vec::new();
    for start in starts {
        let Some(motion) = coarse.refine(&start, &[reach(2.0, cell), reach(1.2, cell)], radius) else { continue };
        if rough.iter().all(|(_, other)| apart(other, &motion, radius) >= cell) {
            let verdict = judge(both, &coarse, &motion, 0.7 * cell);
            let agreement = agreement(&coarse, &touching(&coarse, &motion, 0.7 * cell));
            rough.push((verdict.score() * agreement.max(0.0), motion));
        }
    }
    rough.sort_by(|x, y| y.0.total_cmp(&x.0));
    rough.truncate(WHOLE);
    let fine = Both { by_colour: true, ..Both::new(both[0].fine(), both[1].fine(), MANY) };
    let width = tolerance(both);
    let exact = |(_, start): &(f64, DAffine3)| {
        let a_from_b = fine.refine(start, &[reach(2.0, width), reach(1.5, width)], radius)?;
        let verdict = judge(both, &fine, &a_from_b, width);
        let contacts = touching(&fine, &a_from_b, width);
        let agreement = agreement(&fine, &contacts);
        let area: f64 = contacts.iter().map(|contact| contact.area).sum();
        let of_tints = self::contacts(&fine, &a_from_b, &contacts);
        let touches: Vec<Touch> = contacts.iter().chain(&of_tints).map(Touch::of).collect();
        let hold = if touches.is_empty() { Hold::default() } else { Hold::of(&touches, area, radius) };
        Some(Coloured { mode: Mode { a_from_b, verdict }, agreement, hold })
    };
    let mut found: Vec<Coloured> = rough.iter().filter_map(exact).collect();
    found.sort_by(|x, y| y.score().total_cmp(&x.score()));
    let Some(best) = found.first() else { return by_shape };
    let fits_by_shape =
        |one: &Coloured| {
        matches!(fits(both, &one.mode.verdict, limits), Finding::Sure | Finding::Weak | Finding::Slides)
    };
    let is_other = |other: &Coloured| {
        apart(&other.mode.a_from_b, &best.mode.a_from_b, radius) >= 1.5 * cell
            && other.agreement > RIVAL * best.agreement
            && other.mode.verdict.touching() > RIVAL * best.mode.verdict.touching()
            && fits_by_shape(other)
    };
    let is_sure = fits_by_shape(best)
        && best.agreement > AGREES
        && best.hold.balance() > BALANCE
        && !found[1..].iter().any(is_other);
    if !is_sure {
        return by_shape;
    }
    let mut mode = best.mode;
    mode.verdict.hold = best.hold;
    Pair { finding: Finding::Sure, modes: vec![mode], ..by_shape }
}

fn touching(both: &Both<'_>, a_from_b: &DAffine3, width: f64) -> Vec<Contact> {
    let mut found = Vec::new();
    both.contacts(a_from_b, width, |contact| found.push(contact));
    found
}

/// Rings that a place is described by, in cells, and their width.
const RINGS: usize = 8;
const RING: f64 = 0.9;
/// Least distance of described places, in cells, and most of them.
const APART: f64 = 1.1;
const MOST: usize = 1000;

/// Places of a level, described by the means and deviations of tints in rings around them.
fn features(level: &Level) -> Features {
    let none = Features { points: Vec::new(), descriptors: Vec::new() };
    let tints = &level.tints;
    if tints.is_empty() {
        return none;
    }
    let far = RINGS as f64 * RING * level.cell;
    let grid = Neighbours::new(&level.points, far / 2.0);
    let steep = |k: usize| tints.gradients[k].iter().map(|g| g.length_squared()).sum::<f64>();
    let mut order: Vec<u32> = (0..level.len() as u32).filter(|&k| !level.is_border[k as usize]).collect();
    order.sort_by(|&i, &j| steep(j as usize).total_cmp(&steep(i as usize)).then(i.cmp(&j)));
    let mut is_near = vec![false; level.len()];
    let mut near = Vec::new();
    let mut points = Vec::new();
    for k in order {
        if !is_near[k as usize] && points.len() < MOST {
            points.push(k);
            grid.within(level.points[k as usize], APART * level.cell, &mut near);
            near.iter().for_each(|&n| is_near[n as usize] = true);
        }
    }
    let descriptors = points.iter().map(|&k| described(level, &grid, k as usize, &mut near)).collect();
    Features { points, descriptors }
}

fn described(level: &Level, grid: &Neighbours, k: usize, near: &mut Vec<u32>) -> Descriptor {
    let here = level.points[k];
    grid.within(here, RINGS as f64 * RING * level.cell, near);
    let mut sums = [(DVec3::ZERO, 0.0, 0.0); RINGS];
    for &n in near.iter() {
        let n = n as usize;
        let ring = (here.distance(level.points[n]) / (RING * level.cell)) as usize;
        if ring < RINGS && level.normals[n].dot(level.normals[k]) > 0.3 {
            let (sum, square, weight) = &mut sums[ring];
            *sum += level.areas[n] * level.tints.values[n];
            *square += level.areas[n] * level.tints.values[n].x.powi(2);
            *weight += level.areas[n];
        }
    }
    let total: f64 = sums.iter().map(|sum| sum.2).sum();
    let mean = sums.iter().map(|sum| sum.0).sum::<DVec3>() / total.max(f64::MIN_POSITIVE);
    let mut descriptor = [0; LENGTH];
    // Differences from the mean around: exposures are not the same.
    let entry = |x: f64| (128.0 + STEEP * x).clamp(0.0, 255.0) as u8;
    for (ring, (sum, square, weight)) in sums.into_iter().enumerate() {
        let at = if weight > 0.0 { sum / weight } else { mean };
        let spread = if weight > 0.0 { (square / weight - at.x * at.x).max(0.0).sqrt() } else { 0.0 };
        let differs = (at - mean).to_array();
        for (place, x) in differs.into_iter().chain([spread]).enumerate() {
            descriptor[4 * ring + place] = entry(x);
        }
    }
    descriptor
}

/// Steps of a description that a tint of 1 is.
const STEEP: f64 = 400.0;
