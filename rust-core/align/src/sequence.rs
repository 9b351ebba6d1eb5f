//! Frames of a recording, which follow each other: each is compared with the next, near where it would lie had the sensor stood still.
//!
//! Neighbours overlap and differ by a small motion, so that ICP from rest finds it, and no other place where they fit is looked for. If
//! that fails, the motion before or after is tried, then the next frame but one. Then track is lost. Pieces of the recording are joined like
//! any scans, but in their order, and only where the sensor would not have to leap ([`Steps`]).

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;
use rayon::prelude::*;

use crate::coloured;
use crate::constraints::Ordered;
use crate::finding::{Finding, Limits};
use crate::group::Group;
use crate::judge::{Mode, touching_share};
use crate::linear::{apart, rigid};
use crate::pair::Pair;
use crate::view::View;
use crate::walls::{Beside, beside};
use base::error::Result;
use base::progress::Progress;
use image::source::{Moment, ScanSource};

/// The numbers of scans in the order in which they were taken, and where each stands in the recording: `None` unless all are frames of one
/// recording, each another one.
pub(crate) fn in_time(sources: &[&dyn ScanSource]) -> Option<Vec<(usize, u64)>> {
    let moments: Vec<Moment<'_>> = sources.iter().map(|source| source.moment()).collect::<Option<_>>()?;
    let mut order: Vec<usize> = (0..moments.len()).collect();
    order.sort_by(|&a, &b| moments[a].at.total_cmp(&moments[b].at));
    let follow = |two: &[usize]| {
        let [before, after] = [&moments[two[0]], &moments[two[1]]];
        before.recording == after.recording && before.at < after.at
    };
    let at: Vec<f64> = order.iter().map(|&k| moments[k].at).collect();
    order.windows(2).all(follow).then(|| order.into_iter().zip(places(&at)).collect())
}

/// The first two scans, of all that are frames of one recording, that have the same place in it.
pub(crate) fn twice(sources: &[&dyn ScanSource]) -> Option<[usize; 2]> {
    let moments: Vec<Moment<'_>> = sources.iter().map(|source| source.moment()).collect::<Option<_>>()?;
    let mut order: Vec<usize> = (0..moments.len()).collect();
    order.sort_by(|&a, &b| moments[a].at.total_cmp(&moments[b].at));
    let is_one = moments.iter().all(|moment| moment.recording == moments[0].recording);
    let same = order.windows(2).find(|two| is_one && moments[two[0]].at == moments[two[1]].at)?;
    Some([same[0], same[1]])
}

/// Places of frames in their recording, counted in usual steps from the first: in a gap of numbers or times frames are missing.
fn places(at: &[f64]) -> Vec<u64> {
    let steps = || at.windows(2).map(|two| two[1] - two[0]);
    let mut sorted: Vec<f64> = steps().collect();
    sorted.sort_by(f64::total_cmp);
    let usual = sorted.get(sorted.len() / 2).copied().unwrap_or(1.0);
    // Long pauses are gaps like others.
    let counted = steps().map(|step| (step / usual).round().clamp(1.0, 1e6) as u64);
    let mut place = 0;
    let after = counted.map(|step| {
        place += step;
        place
    });
    [0].into_iter().chain(after).collect()
}

/// Neighbours are off by this share of their radius, about.
const REACH: f64 = 0.2;

/// The pairs of frames that follow each other, `frames` in their order. Where track is lost, those of the next but one as well. O(frames).
pub(crate) fn followed(
    views: &[View],
    frames: &[usize],
    limits: &Limits,
    progress: &Progress<'_>,
) -> Result<Vec<Pair>> {
    let steps: Vec<[usize; 2]> = frames.windows(2).map(|two| [two[0], two[1]]).collect();
    let from_rest = steps.par_iter().map(|&step| {
        progress.advance(1)?;
        Ok(follow(views, step, &DAffine3::IDENTITY, limits))
    });
    let mut found: Vec<Pair> = from_rest.collect::<Result<_>>()?;
    let motions: Vec<Option<DAffine3>> =
        found.iter().zip(&steps).map(|(pair, step)| moved(views, pair, *step).filter(|_| holds(pair))).collect();
    let motion = |k: Option<usize>| k.and_then(|k| motions.get(k).copied().flatten());
    let lost = || (0..steps.len()).into_par_iter().filter(|&k| motions[k].is_none());
    let again = lost().map(|k| {
        progress.check()?;
        let near = [motion(k.checked_sub(1)), motion(Some(k + 1))];
        let tried = near.into_iter().flatten().map(|start| follow(views, steps[k], &start, limits));
        Ok((k, tried.into_iter().find(holds)))
    });
    let again: Vec<(usize, Option<Pair>)> = again.collect::<Result<_>>()?;
    again.into_iter().for_each(|(k, pair)| {
        if let Some(pair) = pair {
            found[k] = pair;
        }
    });
    let lost: Vec<usize> = (0..steps.len()).filter(|&k| found[k].finding != Finding::Sure).collect();
    let over = lost.par_iter().map(|&k| {
        progress.check()?;
        let mut over = Vec::new();
        // From the frame before the step, and from its first frame.
        for first in [k.checked_sub(1), Some(k)].into_iter().flatten().filter(|first| first + 2 < frames.len()) {
            let usual = motion(first.checked_sub(1)).or_else(|| motion(Some(first + 2)));
            let both = motion(Some(first)).zip(motion(Some(first + 1))).map(|(one, other)| one * other);
            let starts = [both, usual.map(|usual| usual * usual), Some(DAffine3::IDENTITY)].into_iter().flatten();
            let pair = [frames[first], frames[first + 2]];
            over.extend(starts.map(|start| follow(views, pair, &start, limits)).find(holds));
        }
        Ok(over)
    });
    let over: Vec<Vec<Pair>> = over.collect::<Result<_>>()?;
    found.extend(over.into_iter().flatten());
    Ok(found)
}

/// The pair of two frames that follow each other, from where `first_from_second`, of the sensors' frames, has them.
fn follow(views: &[View], [first, second]: [usize; 2], first_from_second: &DAffine3, limits: &Limits) -> Pair {
    let (a, b) = (first.min(second), first.max(second));
    let a_from_b = if a == first { *first_from_second } else { first_from_second.inverse() };
    let middle = |k: usize| DAffine3::from_translation(views[k].reduced.middle);
    let start = rigid(&(middle(a).inverse() * a_from_b * middle(b)));
    let reach = REACH * views[a].reduced.radius.max(views[b].reduced.radius);
    let mut pair = Pair::near(views, a, b, &start, reach, limits);
    if holds(&pair) {
        pair.finding = match beside([&views[a], &views[b]], &pair.modes[0]) {
            Beside::Same => pair.finding,
            // Walls of another place fit as well: the frame after must say the same.
            Beside::Little => Finding::Weak,
            Beside::Other => Finding::SeenThrough,
        };
    }
    let both = [&views[a], &views[b]];
    let is_near = |mode: &Mode| apart(&mode.a_from_b, &start, views[a].reduced.radius) < BY_COLOUR * reach;
    if limits.use_colour
        && matches!(pair.finding, Finding::Slides | Finding::Weak)
        && coloured::can_tell(both)
        && let Some(mode) = coloured::place(both, &pair.modes, limits).filter(is_near)
    {
        (pair.modes, pair.finding) = (vec![mode], Finding::Sure);
    }
    pair
}

/// Colours find neighbours that are off by so many times as much.
const BY_COLOUR: f64 = 2.0;

/// The motion between the sensors of two frames that a pair of both has.
fn moved(views: &[View], pair: &Pair, [first, _]: [usize; 2]) -> Option<DAffine3> {
    let middle = |k: usize| DAffine3::from_translation(views[k].reduced.middle);
    let a_from_b = pair.modes.first()?.a_from_b;
    let between = middle(pair.a) * a_from_b * middle(pair.b).inverse();
    Some(if pair.a == first { between } else { between.inverse() })
}

/// Whether a pair holds two frames together.
fn holds(pair: &Pair) -> bool {
    matches!(pair.finding, Finding::Sure | Finding::Weak)
}

/// Limits that a recording sets to the places of its frames.
pub(crate) struct Steps {
    /// The number of each scan in the order of the recording, and its place, which counts frames that are missing.
    number: Vec<usize>,
    place: Vec<u64>,
    /// Pairs of frames that were followed from one to the next.
    followed: BTreeSet<[usize; 2]>,
    /// Pairs of which the same was found, but which share less than others do, or frames are missing between them: by their motion from
    /// rest they may be anywhere.
    uneven: BTreeSet<[usize; 2]>,
    /// The numbers from which a frame was followed to the next, or the next but one, and that number.
    starts: BTreeMap<usize, usize>,
    /// How far the sensor moves and turns from one frame to the next, at most, as points at the radius of a frame move.
    longest: f64,
    /// How far it moves alone, at most.
    furthest: f64,
    /// Whether what was recorded repeats itself: then frames are only followed, and pieces of the recording stay apart.
    pub repeats: bool,
}

/// The longest step, by the median of those that were followed, and by the radius of a frame at least.
const LONGEST: f64 = 1.5;
const LEAST: f64 = 0.35;
/// The furthest move, by that which a tenth of those that were followed exceed, and by the radius of a frame at least. Doors of a corridor
/// repeat every few steps: pieces of it came to lie four steps off.
const FURTHEST: f64 = 2.5;
const LEAST_MOVE: f64 = 0.1;
/// Least share of a frame that lies on the one before it, whatever was between them ...
const OVERLAP: f64 = 0.1;
/// ... unless so many frames are missing there.
const MISSING: u64 = 3;

/// Pairs that are followed share this share at least of what those of the recording usually do. Of 45 virtual turns in which the sensor
/// leapt by a quarter or a third of a turn five were joined wrongly, by pairs that shared 0.25 to 0.77 of it.
const EVEN: f64 = 0.8;

/// Pieces are next to each other though so many pairs of frames were followed in between: somebody else's frames, or a bare corner.
const STRAY: usize = 1;

/// A frame's number in the recording, that of its scan, whether it is of the second of two groups, and its pose.
type Frame = (usize, usize, bool, DAffine3);

impl Steps {
    /// Of the pairs that were followed.
    pub fn new(views: &[View], order: &Ordered, followed: &[Pair]) -> Self {
        let (mut number, mut place) = (vec![0; views.len()], vec![0; views.len()]);
        for (at, (&scan, &of_scan)) in order.frames.iter().zip(&order.places).enumerate() {
            (number[scan], place[scan]) = (at, of_scan);
        }
        let radius = views.iter().map(|view| view.reduced.radius).fold(0.0, f64::max);
        let held = || followed.iter().filter(|pair| holds(pair));
        // Of those followed to the next but one a motion is two steps.
        let one_step = |pair: &&Pair| number[pair.a].abs_diff(number[pair.b]) == 1;
        let motions: Vec<DAffine3> =
            held().filter(one_step).filter_map(|pair| moved(views, pair, [pair.a, pair.b])).collect();
        let sorted = |length: &dyn Fn(&DAffine3) -> f64| {
            let mut lengths: Vec<f64> = motions.iter().map(length).collect();
            lengths.sort_by(f64::total_cmp);
            lengths
        };
        let lengths = sorted(&|motion| apart(&DAffine3::IDENTITY, motion, radius));
        let usual = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
        let longest = (LONGEST * usual).max(LEAST * radius);
        let moves = sorted(&|motion| motion.translation.length());
        let far = moves.get(moves.len() * 9 / 10).copied().unwrap_or(f64::INFINITY);
        let furthest = (FURTHEST * far).max(LEAST_MOVE * radius);
        let ends = |pair: &Pair| [number[pair.a].min(number[pair.b]), number[pair.a].max(number[pair.b])];
        let mut starts = BTreeMap::new();
        for [from, to] in held().map(ends) {
            starts.entry(from).and_modify(|known: &mut usize| *known = (*known).max(to)).or_insert(to);
        }
        let share = |pair: &Pair| pair.modes[0].verdict.overlap().into_iter().fold(0.0, f64::max);
        let mut shares: Vec<f64> = held().map(share).collect();
        shares.sort_by(f64::total_cmp);
        let least = EVEN * shares.get(shares.len() / 2).copied().unwrap_or(0.0);
        let is_even = |pair: &&Pair| {
            let missing = place[pair.a].abs_diff(place[pair.b]) - number[pair.a].abs_diff(number[pair.b]) as u64;
            share(pair) >= least && missing < MISSING
        };
        let (even, uneven): (Vec<&Pair>, Vec<&Pair>) = held().partition(is_even);
        let [followed, uneven] = [even, uneven].map(|pairs| pairs.iter().map(|pair| [pair.a, pair.b]).collect());
        Steps { number, place, followed, uneven, starts, longest, furthest, repeats: false }
    }

    /// The share of the frames that were followed to the next.
    pub fn share(&self) -> f64 {
        self.starts.len() as f64 / (self.number.len() - 1).max(1) as f64
    }

    /// Whether a pair is of frames that were followed from one to the next.
    pub fn is_followed(&self, pair: &Pair) -> bool {
        self.followed.contains(&[pair.a, pair.b])
    }

    /// Whether a pair was found as those that are followed, but is unlike them.
    pub fn is_uneven(&self, pair: &Pair) -> bool {
        self.uneven.contains(&[pair.a, pair.b])
    }

    /// Whether a pair may join two groups, the second moved.
    pub fn joins(&self, views: &[View], pair: &Pair, [first, second]: [&Group; 2], motion: &DAffine3) -> Joins {
        if self.is_followed(pair) || self.is_uneven(pair) {
            return Joins::Now;
        }
        let one = first.members.iter().map(|&(scan, pose)| (self.number[scan], scan, false, pose));
        let other = second.members.iter().map(|&(scan, pose)| (self.number[scan], scan, true, *motion * pose));
        let mut all: Vec<Frame> = one.chain(other).collect();
        all.sort_by_key(|frame| frame.0);
        let leaps = |a: &Frame, b: &Frame| {
            let [from, to] =
                [a, b].map(|(_, k, _, pose)| *pose * DAffine3::from_translation(-views[*k].reduced.middle));
            let both = [&views[a.1], &views[b.1]];
            let steps = self.place[b.1] - self.place[a.1];
            apart(&from, &to, both[0].reduced.radius) > self.longest * steps as f64
                || from.translation.distance(to.translation) > self.furthest * steps as f64
                || (steps < (b.0 - a.0) as u64 + MISSING && touching_share(both, &(a.3.inverse() * b.3), 0.0) < OVERLAP)
        };
        // Pieces come together in their order: what was followed between two of them says where these are.
        let is_next = |a: &Frame, b: &Frame| {
            let between = self.starts.range(a.0 + 1..b.0.max(a.0 + 1)).filter(|(_, to)| **to < b.0);
            between.count() <= STRAY
        };
        let mut meet = all.windows(2).filter(|two| two[0].2 != two[1].2);
        if self.repeats || meet.clone().any(|two| leaps(&two[0], &two[1])) {
            Joins::Never
        } else if meet.any(|two| is_next(&two[0], &two[1])) {
            Joins::Now
        } else {
            Joins::Later
        }
    }
}

/// Whether a pair may join two groups of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Joins {
    Now,
    /// Once the groups between the two have their places.
    Later,
    /// The sensor would have to leap from a frame of one to the next of the other, further than it does elsewhere or out of sight of what it
    /// saw before. Or what was recorded repeats itself.
    Never,
}
