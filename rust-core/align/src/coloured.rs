//! The place where colours or intensities agree, of scans that may turn or slide by shape, or fit in several places.
//!
//! Places that are coloured alike are found by means and deviations over rings around a point. The agreement of tints where surfaces lie
//! on each other tells places apart.

use glam::{DAffine3, DVec3};

use crate::correspond::correspond;
use crate::features::{Descriptor, Features, LENGTH};
use crate::finding::{BALANCE, Finding, Limits, fits};
use crate::gravity::keeps_up;
use crate::hypothesise::{Like, hypothesise};
use crate::judge::{Hold, Mode, Touch, judge, tolerance};
use crate::level::Level;
use crate::linear::apart;
use crate::neighbours::Neighbours;
use crate::refine::{Both, Contact, Reach};
use crate::view::View;

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

/// How well tints agree where surfaces touch: 1 at best, about 0 in a wrong place.
fn agreement(both: &Both<'_>, contacts: &[Contact]) -> f64 {
    let [a, b] = both.levels.map(|level| &level.tints.values);
    let exposure = both.exposure(contacts);
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
/// Pivots that are tried, hypotheses that are looked at, and of these made exact.
const PIVOTS: usize = 400;
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

/// Of two scans that fit by their shape, but not in one place alone, the place where their tints agree, if there is one alone.
/// Places by shape are looked at as well.
pub(crate) fn place(both: [&View; 2], by_shape: &[Mode], limits: &Limits) -> Option<Mode> {
    let cell = both[0].coarse.cell.max(both[1].coarse.cell);
    let radius = both[0].reduced.radius.min(both[1].reduced.radius);
    let [of_a, of_b] = both.map(|view| view.colour_features.get_or_init(|| features(&view.coarse)));
    let likes: Vec<Like> = correspond(of_a, of_b).iter().map(|m| Like::of_features(both, [of_a, of_b], m)).collect();
    let hypotheses = hypothesise(&likes, cell, radius, PIVOTS);
    let upright = hypotheses.iter().filter(|h| keeps_up(both, &h.a_from_b));
    let starts = upright.take(ROUGH).map(|h| h.a_from_b).chain(by_shape.iter().map(|m| m.a_from_b));
    let coarse = Both { by_colour: true, ..Both::new(&both[0].coarse, &both[1].coarse, FEW) };
    let reach =
        |by: f64, cell: f64| Reach { distance: by * cell, scale: 0.5 * by * cell, steps: 8, enough: 0.02 * cell };
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
        let of_tints = fine.by_tints(&a_from_b, &contacts);
        let touches: Vec<Touch> = contacts.iter().chain(&of_tints).map(Touch::of).collect();
        let hold = if touches.is_empty() { Hold::default() } else { Hold::of(&touches, area, radius) };
        Some(Coloured { mode: Mode { a_from_b, verdict }, agreement, hold })
    };
    let mut found: Vec<Coloured> = rough.iter().filter_map(exact).collect();
    found.sort_by(|x, y| y.score().total_cmp(&x.score()));
    let best = found.first()?;
    let fits_by_shape = |one: &Coloured| {
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
    let mut mode = best.mode;
    mode.verdict.hold = best.hold;
    is_sure.then_some(mode)
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
