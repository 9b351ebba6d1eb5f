//! Two scans: the motions that may join them, each refined and judged.

use glam::DAffine3;

use crate::coloured;
use crate::correspond::correspond;
use crate::finding::{Finding, Limits, RIVAL, find, fits};
use crate::gravity::keeps_up;
use crate::hypothesise::{Effort, Like, hypothesise};
use crate::judge::{Mode, glance, judge, tolerance};
use crate::linear::apart;
use crate::modes::{FEW, MANY, exact, last_rough, rank, refined_roughly};
use crate::reach::Bound;
use crate::refine::{Both, Reach};
use crate::symmetries::symmetries;
use crate::view::View;
use crate::walls::beside_walls;

/// Hypotheses refined roughly by a quick search, and of these refined wholly. A thorough one takes more of both.
const ROUGH: usize = 6;
const WHOLE: usize = 4;
const THOROUGHLY: usize = 3;

/// Least share of the points that look alike in two views of a room that must agree on a motion, so that a quick search goes on. The least
/// of 341 right pairs of virtual rooms was 0.036, and 0.043 the tenth. Of 1210 others a third have less than 0.033.
const AGREEING: f64 = 1.0 / 30.0;

/// Two scans, and what was found of them: the likeliest mode first.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    pub a: usize,
    pub b: usize,
    pub modes: Vec<Mode>,
    pub finding: Finding,
    /// The likeliest motion that fits, where all lie beyond reach.
    pub beyond: Option<DAffine3>,
}

impl Pair {
    /// Searches for the motion: anywhere, or within reach of rough poses.
    pub fn search(views: &[View], a: usize, b: usize, effort: Effort, bound: &Bound, limits: &Limits) -> Self {
        let both = [&views[a], &views[b]];
        let mut rough = rough_modes(both, effort, |motion| bound.allows(views, [a, b], motion));
        if bound.binds() {
            let given = both[0].reduced.world_from_local().inverse() * both[1].reduced.world_from_local();
            rough.extend(rough_near(both, &given, bound.reach(a).max(bound.reach(b))));
        }
        Self::judged(views, a, b, rough, bound, limits)
    }

    /// Looks near a motion.
    pub fn near(views: &[View], a: usize, b: usize, start: &DAffine3, reach: f64, limits: &Limits) -> Self {
        let both = [&views[a], &views[b]];
        let rough: Vec<DAffine3> = rough_near(both, start, reach).into_iter().collect();
        let modes = exact(both, &rough);
        Pair { a, b, finding: find(both, &modes, limits), modes, beyond: None }
    }

    /// As the caller has it.
    pub fn given(views: &[View], a: usize, b: usize, a_from_b: &DAffine3, limits: &Limits) -> Self {
        let both = [&views[a], &views[b]];
        let fine = Both::new(both[0].fine(), both[1].fine(), MANY);
        let verdict = judge(both, &fine, a_from_b, tolerance(both));
        let modes = vec![Mode { a_from_b: *a_from_b, verdict }];
        Pair { a, b, finding: find(both, &modes, limits), modes, beyond: None }
    }

    /// Places in which one fits the other.
    pub fn places(&self, views: &[View], limits: &Limits) -> usize {
        let both = [&views[self.a], &views[self.b]];
        let least = RIVAL * self.modes[0].verdict.score();
        let fitting = |mode: &&Mode| {
            mode.verdict.score() >= least
                && matches!(fits(both, &mode.verdict, limits), Finding::Sure | Finding::Weak | Finding::Slides)
        };
        self.modes.iter().filter(fitting).count()
    }

    fn judged(views: &[View], a: usize, b: usize, rough: Vec<DAffine3>, bound: &Bound, limits: &Limits) -> Self {
        let both = [&views[a], &views[b]];
        let is_allowed = |mode: &Mode| bound.allows(views, [a, b], &mode.a_from_b);
        let (modes, out): (Vec<Mode>, Vec<Mode>) = exact(both, &rough).into_iter().partition(is_allowed);
        let fits_there = |mode: &&Mode| matches!(fits(both, &mode.verdict, limits), Finding::Sure | Finding::Weak);
        let beyond = out.iter().find(fits_there).filter(|_| modes.is_empty()).map(|mode| mode.a_from_b);
        let mut pair = Pair { a, b, modes, finding: Finding::Nothing, beyond };
        pair.finding = find(both, &pair.modes, limits);
        if matches!(pair.finding, Finding::Sure | Finding::Weak) {
            // A scan that fits itself elsewhere fits others elsewhere, too.
            let best = pair.modes[0].a_from_b;
            let [of_a, of_b] = both.map(|view| view.symmetries.get_or_init(|| symmetries(view)));
            let others: Vec<DAffine3> =
                of_a.iter().map(|own| *own * best).chain(of_b.iter().map(|own| best * *own)).collect();
            if !others.is_empty() {
                pair.modes.extend(exact(both, &others).into_iter().filter(is_allowed));
                rank(&mut pair.modes, both);
                pair.finding = find(both, &pair.modes, limits);
            }
        }
        if matches!(pair.finding, Finding::Sure | Finding::Weak) && stands_still(both, &pair.modes[0]) {
            pair.finding = Finding::Background;
        }
        if !bound.binds()
            && matches!(pair.finding, Finding::Sure | Finding::Weak | Finding::Ambiguous)
            && !pair.modes.iter().any(|mode| stands_still(both, mode))
            && let Some((mode, finding)) = beside_walls(both, &pair.modes, limits)
        {
            pair.modes.sort_by_key(|other| other.a_from_b != mode.a_from_b);
            pair.finding = finding;
        }
        if limits.use_colour
            && matches!(pair.finding, Finding::Slides | Finding::Weak | Finding::Ambiguous | Finding::Walls)
            && coloured::can_tell(both)
            && let Some(mode) = coloured::place(both, &pair.modes, limits).filter(is_allowed)
        {
            (pair.modes, pair.finding) = (vec![mode], Finding::Sure);
        }
        pair
    }
}

/// A motion near another, refined at the coarser level.
fn rough_near(both: [&View; 2], start: &DAffine3, reach: f64) -> Option<DAffine3> {
    let cell = both[0].coarse.cell.max(both[1].coarse.cell);
    let halvings = (reach / (2.0 * cell)).log2().ceil().max(0.0) as i32;
    let by = |n: i32| Reach {
        distance: 2.0 * cell * 2.0_f64.powi(n),
        scale: cell * 2.0_f64.powi(n),
        steps: 6,
        enough: 0.05 * cell,
    };
    let schedule: Vec<Reach> = (0..=halvings).rev().map(by).chain([last_rough(cell)]).collect();
    let coarse = Both::new(&both[0].coarse, &both[1].coarse, FEW);
    coarse.refine(start, &schedule, both[0].reduced.radius.min(both[1].reduced.radius))
}

/// Motions by what looks alike, refined at the coarser level, the best first: those that are allowed, if there are any.
fn rough_modes(both: [&View; 2], effort: Effort, is_allowed: impl Fn(&DAffine3) -> bool) -> Vec<DAffine3> {
    let [first, second] = both;
    if first.is_empty() || second.is_empty() {
        return Vec::new();
    }
    let cell = first.coarse.cell.max(second.coarse.cell);
    let likes: Vec<Like> = correspond(first.features(), second.features()).iter().map(|m| Like::of(both, m)).collect();
    let radius = first.reduced.radius.min(second.reduced.radius);
    let mut found: Vec<(f64, DAffine3)> = Vec::new();
    let samples = both.map(|view| view.coarse.spread(FEW));
    let hypotheses = hypothesise(&likes, cell, radius, effort as usize);
    let agreeing = hypotheses.first().map_or(0, |first| first.inliers);
    let is_room = both.iter().all(|view| view.is_of_room());
    if effort == Effort::Quick && is_room && (agreeing as f64) < AGREEING * likes.len() as f64 {
        return Vec::new();
    }
    for hypothesis in hypotheses.iter().filter(|hypothesis| keeps_up(both, &hypothesis.a_from_b)) {
        let seen = glance(both, [&samples[0], &samples[1]], &hypothesis.a_from_b, 1.5 * cell);
        if seen.is_some_and(|seen| seen.contradiction() > 0.5) {
            continue;
        }
        found.push((seen.map_or(hypothesis.inliers as f64, |seen| seen.score()), hypothesis.a_from_b));
    }
    found.sort_by(|x, y| y.0.total_cmp(&x.0));
    if found.iter().any(|(_, motion)| is_allowed(motion)) {
        found.retain(|(_, motion)| is_allowed(motion));
    }
    let times = if effort == Effort::Thorough { THOROUGHLY } else { 1 };
    found.truncate(times * ROUGH);
    let mut modes = refined_roughly(both, found.into_iter().map(|f| f.1));
    modes.truncate(times * WHOLE);
    modes.into_iter().map(|mode| mode.a_from_b).collect()
}

/// Whether two range images fit as they were taken, without moving: what both saw stood still before the sensor. Then each
/// must have seen all that the other saw, unless something else has moved.
fn stands_still(both: [&View; 2], mode: &Mode) -> bool {
    let [a, b] = both;
    let (Some(eye_a), Some(eye_b)) = (a.reduced.eye, b.reduced.eye) else { return false };
    // Motion of the frames that the scans were taken in.
    let motion =
        DAffine3::from_translation(a.reduced.middle) * mode.a_from_b * DAffine3::from_translation(-b.reduced.middle);
    let radius = a.reduced.radius.max(b.reduced.radius) + (a.reduced.middle - eye_a).length();
    let stands = eye_a.distance(eye_b) < a.fine().cell
        && apart(&motion, &DAffine3::IDENTITY, radius) < 2.0 * a.fine().cell.max(b.fine().cell);
    let samples = both.map(|view| view.coarse.spread(usize::MAX));
    let tolerance = tolerance(both);
    stands
        && glance(both, [&samples[0], &samples[1]], &mode.a_from_b, tolerance).is_some_and(|seen| {
            let differs = seen.through[0] + seen.through[1] + seen.hidden;
            differs > DIFFERENT * (differs + seen.touching())
        })
}

/// Two takes of the same view differ by no more than this share of what both can tell.
const DIFFERENT: f64 = 0.002;
