//! Motions other than none that lay a scan on itself: what fits one place of it fits the others, too.
//!
//! They are sought by what looks alike, and along the screws that hold the scan least: lobes of a pillar, teeth of a wheel and
//! bricks of a wall follow each other along one of these, and are often cut by rims where the next would have to look alike.
//! Where the scan could slide on itself nothing repeats itself: smooth parts lie on each other everywhere.

use glam::{DAffine3, DVec3};

use crate::correspond::repeats;
use crate::finding::FREE;
use crate::hypothesise::{Effort, Like, hypothesise};
use crate::judge::{Hold, Mode, glance, judge};
use crate::linear::{Vector6, apart};
use crate::modes::refined_roughly;
use crate::refine::Both;
use crate::view::View;

/// Motions that are refined, and kept of these.
const REFINED: usize = 24;
const KEPT: usize = 12;
/// Cells by which a scan must be moved so that it is a place of its own.
const OTHER_PLACE: f64 = 4.0;
/// Share of a scan that lies on itself after a symmetry.
const SELF_OVERLAP: f64 = 0.2;

pub(crate) fn symmetries(view: &View) -> Vec<DAffine3> {
    if view.is_empty() {
        return Vec::new();
    }
    let is_other =
        |motion: &DAffine3| apart(motion, &DAffine3::IDENTITY, view.reduced.radius) > OTHER_PLACE * view.coarse.cell;
    let starts = along_screws(view).into_iter().chain(by_likeness(view)).filter(is_other).take(REFINED);
    let mut modes = refined_roughly([view, view], starts);
    let repeats = |Mode { a_from_b, verdict }: &Mode| {
        is_other(a_from_b) && verdict.overlap()[0] > SELF_OVERLAP && verdict.hold.balance() > FREE
    };
    modes.retain(repeats);
    modes.truncate(KEPT);
    let mut motions: Vec<DAffine3> = Vec::new();
    for motion in modes.iter().flat_map(|mode: &Mode| [mode.a_from_b, mode.a_from_b.inverse()]) {
        if motions.iter().all(|known| apart(known, &motion, view.reduced.radius) > OTHER_PLACE * view.coarse.cell) {
            motions.push(motion);
        }
    }
    motions
}

/// Motions by points that look alike, the best first.
fn by_likeness(view: &View) -> Vec<DAffine3> {
    let cell = view.coarse.cell;
    let likes: Vec<Like> = repeats(view.features(), &view.coarse.points, OTHER_PLACE * cell)
        .iter()
        .map(|m| Like::of([view, view], m))
        .collect();
    let hypotheses = hypothesise(&likes, cell, view.reduced.radius, Effort::Quick as usize);
    hypotheses.iter().map(|h| h.a_from_b).collect()
}

/// Samples that tell where along a screw a scan fits itself.
const SAMPLES: usize = 300;
/// Cells between looks along a screw.
const STEP: f64 = 1.5;

/// Motions by which a scan fits itself best along each of the screws that its normal equations have as eigenvectors, the best first.
fn along_screws(view: &View) -> Vec<DAffine3> {
    let both = Both::new(&view.coarse, &view.coarse, SAMPLES);
    let cell = view.coarse.cell;
    let hold = judge([view, view], &both, &DAffine3::IDENTITY, 0.7 * cell).hold;
    let mut found: Vec<(f64, DAffine3)> = Vec::new();
    for vector in &hold.vectors {
        let screw = Screw::new(&hold, vector);
        let looks: Vec<(f64, DAffine3)> = (0..(screw.length(view.reduced.radius) / (STEP * cell)) as usize)
            .map(|k| {
                let motion = screw.by(STEP * cell * k as f64);
                let seen = glance([view, view], [&both.samples[0], &both.samples[1]], &motion, 1.5 * cell)
                    .unwrap_or_else(|| judge([view, view], &both, &motion, 1.5 * cell));
                (seen.score() / seen.total[0].max(f64::MIN_POSITIVE), motion)
            })
            .collect();
        let tops = looks.windows(3).filter(|look| look[1].0 > look[0].0.max(SELF_OVERLAP) && look[1].0 >= look[2].0);
        found.extend(tops.map(|look| look[1]));
    }
    found.sort_by(|x, y| y.0.total_cmp(&x.0));
    found.into_iter().map(|(_, motion)| motion).collect()
}

/// A turn about an axis with a shift along it.
struct Screw {
    /// A point of the axis, and its direction times the turn. Or no turn, and a shift.
    point: DVec3,
    turn: DVec3,
    shift: DVec3,
}

impl Screw {
    fn new(hold: &Hold, vector: &Vector6) -> Self {
        let [x, y, z, u, v, w] = *vector;
        let (turn, shift) = (DVec3::new(x, y, z) / hold.radius, DVec3::new(u, v, w));
        let square = turn.length_squared();
        if square * hold.radius * hold.radius < STRAIGHT * STRAIGHT {
            return Screw { point: hold.middle, turn: DVec3::ZERO, shift };
        }
        let point = hold.middle + turn.cross(shift) / square;
        Screw { point, turn, shift: turn * (turn.dot(shift) / square) }
    }

    /// How far it goes until it comes back, or past a scan of this radius.
    fn length(&self, radius: f64) -> f64 {
        let turn = self.turn.length();
        let back = if turn > 0.0 { std::f64::consts::PI / turn } else { f64::INFINITY };
        back.min(2.0 * radius / self.shift.length().max(f64::MIN_POSITIVE))
    }

    fn by(&self, length: f64) -> DAffine3 {
        let turned = DAffine3::from_quat(glam::DQuat::from_scaled_axis(self.turn * length));
        DAffine3::from_translation(self.point + self.shift * length) * turned * DAffine3::from_translation(-self.point)
    }
}

/// Turns by less than this share of a shift are none.
const STRAIGHT: f64 = 0.05;
