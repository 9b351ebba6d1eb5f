//! One scan drawn to others, which stay, from where it lies: for placing by hand.
//!
//! Symmetric ICP (`refine`) against all of them at once, at reaches that halve. The outcome is judged like a pair.

use glam::DAffine3;
use rayon::prelude::*;

use crate::finding::{Finding, Limits, closest, fits};
use crate::judge::{Hold, Touch, Verdict, judge, tolerance};
use crate::level::Level;
use crate::linear::{apart, rigid};
use crate::refine::{Both, Contact, step};
use crate::report::{Freedom, PairState, freedoms};
use crate::view::View;
use base::error::Result;
use base::progress::Progress;
use base::report::Report as _;

base::report! {
    /// The place that a scan was drawn to by hand, and how well it lies there.
    #[derive(Default)]
    pub struct Snap {
        /// The pose that the scan was drawn to. It is the pose that the scan had if it touches nothing.
        world_from_scan: DAffine3 = pose("Pose"),
        /// Whether it fits there, and if not, why: one of `fits`, `misfit`, `slides`, `seen_through` and `nothing`.
        state: PairState = choice("State", PairState::CHOICES).choices_named("pair_state"),
        /// Numbers of the scans that it touches, the nearest first.
        touches: Vec<usize> = count("Touches").list().counted(),
        /// Share of its surface that lies on the scan that shares most with it.
        overlap: f64 = ratio("Overlap"),
        /// Root mean square distance to the surfaces of the others, along normals.
        residual: f64 = length("Distance to others"),
        /// How well it is held against turning and sliding: 1 at best, 0 where it may turn or slide.
        balance: f64 = number("Balance"),
        /// Of what the sensors can tell, the share that speaks against it.
        seen_through: f64 = ratio("Seen through"),
        /// How far its points moved, at most.
        moved: f64 = length("Moved, at most"),
        /// Ways that it may turn or slide.
        freedoms: Vec<Freedom> = nested("Freedoms", &Freedom::SCHEMA).up_to(6),
    }
}

/// Samples of the scan, over all scans that it is drawn to: for steps far away, near, and for the verdict.
const FAR: usize = 700;
const NEAR: usize = 1000;
const VERDICT: usize = 1600;
/// Most scans that it is drawn to.
const OTHERS: usize = 12;
/// Steps at each reach, and in the end.
const STEPS: usize = 5;
const LAST_STEPS: usize = 6;

/// A scan that stays: its number, and where it lies.
pub(crate) struct Stays<'v> {
    pub number: usize,
    pub view: &'v View,
    pub world_from_local: DAffine3,
}

/// Draws a scan to others, from `start` (world from local) and no further than `reach`, about.
pub(crate) fn snap(
    view: &View,
    start: &DAffine3,
    others: &[Stays<'_>],
    reach: f64,
    limits: &Limits,
    progress: &Progress<'_>,
) -> Result<Snap> {
    let near = nearest(view, start, others, reach);
    let pose = drawn(view, start, &near, reach, progress)?;
    Ok(judged(view, start, pose, &near, limits))
}

/// The pose (world from local) that a scan is drawn to.
fn drawn(view: &View, start: &DAffine3, near: &[&Stays<'_>], reach: f64, progress: &Progress<'_>) -> Result<DAffine3> {
    let mut pose = *start;
    let radius = view.reduced.radius.max(f64::MIN_POSITIVE);
    let cell = near.iter().map(|other| other.view.coarse.cell).fold(view.coarse.cell, f64::max);
    let share = |samples: usize| share(samples, near.len());
    let halvings = (reach / (2.0 * cell)).log2().ceil().max(0.0) as i32;
    for n in (0..=halvings).rev().map(f64::from).chain([-0.7]) {
        let distance = 2.0 * cell * n.exp2();
        for _ in 0..STEPS {
            progress.check()?;
            let contacts = contacts(view, &pose, near, |view| &view.coarse, |_| distance, share(FAR));
            let Some((by, far)) = step(&contacts, 0.5 * distance, radius) else { break };
            pose = rigid(&(by * pose));
            if far < 0.05 * cell {
                break;
            }
        }
    }
    for wide in [2.5, 1.5] {
        let width = |other: &Stays<'_>| wide * tolerance([other.view, view]);
        let scale = near.iter().map(|other| width(other)).fold(0.0, f64::max) / 3.0;
        for _ in 0..LAST_STEPS {
            progress.check()?;
            let contacts = contacts(view, &pose, near, View::fine, width, share(NEAR));
            let Some((by, far)) = step(&contacts, scale, radius) else { break };
            pose = rigid(&(by * pose));
            if far < 0.02 * view.fine().cell {
                break;
            }
        }
    }
    Ok(pose)
}

/// Samples of each of several scans.
fn share(samples: usize, scans: usize) -> usize {
    samples.div_ceil(scans.max(1)).max(60)
}

/// The scans that may be within reach, the nearest first.
fn nearest<'a, 'v>(view: &View, pose: &DAffine3, others: &'a [Stays<'v>], reach: f64) -> Vec<&'a Stays<'v>> {
    let gap = |other: &Stays<'_>| {
        let between = other.world_from_local.translation.distance(pose.translation);
        between - other.view.reduced.radius - view.reduced.radius
    };
    let mut near: Vec<(f64, &Stays<'_>)> = others.iter().map(|other| (gap(other), other)).collect();
    near.retain(|(gap, other)| *gap < reach && !other.view.is_empty());
    near.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.number.cmp(&y.1.number)));
    near.truncate(OTHERS);
    near.into_iter().map(|(_, other)| other).collect()
}

/// Contacts with all the others, in the world, the scan's points second.
fn contacts<'v>(
    view: &'v View,
    pose: &DAffine3,
    others: &[&Stays<'v>],
    level: impl Fn(&'v View) -> &'v Level + Sync,
    distance: impl Fn(&Stays<'_>) -> f64 + Sync,
    samples: usize,
) -> Vec<Contact> {
    let of_each = others.par_iter().map(|other| {
        let mut found = Vec::new();
        let both = Both::new(level(other.view), level(view), samples);
        let other_from_scan = other.world_from_local.inverse() * *pose;
        both.contacts(&other_from_scan, distance(other), |contact| found.push(contact.moved(&other.world_from_local)));
        found
    });
    of_each.collect::<Vec<_>>().into_iter().flatten().collect()
}

fn judged(view: &View, start: &DAffine3, pose: DAffine3, others: &[&Stays<'_>], limits: &Limits) -> Snap {
    let samples = share(VERDICT, others.len());
    let looked = others.par_iter().map(|other| {
        let both = [other.view, view];
        let levels = Both::new(other.view.fine(), view.fine(), samples);
        judge(both, &levels, &(other.world_from_local.inverse() * pose), tolerance(both))
    });
    let looked: Vec<Verdict> = looked.collect();
    let mut all = Verdict::default();
    let mut touches = Vec::new();
    let mut overlap = 0.0_f64;
    let mut expected = 0.0;
    for (other, verdict) in others.iter().zip(&looked) {
        let weight = verdict.touching();
        overlap = overlap.max(verdict.overlap()[1]);
        all.mean_square += weight * verdict.mean_square;
        expected += weight * verdict.expected;
        for side in 0..2 {
            all.on[side] += verdict.on[side];
            all.through[side] += verdict.through[side];
            all.total[side] += verdict.total[side];
        }
        if verdict.overlap()[1] > TOUCHES {
            touches.push(other.number);
        }
    }
    let weight = all.touching().max(f64::MIN_POSITIVE);
    (all.mean_square, all.expected) = (all.mean_square / weight, expected / weight);
    let width = |other: &Stays<'_>| tolerance([other.view, view]);
    let held: Vec<Touch> = contacts(view, &pose, others, View::fine, width, samples).iter().map(Touch::of).collect();
    if !held.is_empty() {
        all.hold = Hold::of(&held, held.iter().map(|touch| touch.area).sum(), view.reduced.radius);
    }
    let largest = others.iter().map(|other| other.view).max_by(|x, y| x.reduced.area.total_cmp(&y.reduced.area));
    // The limit for the share of a pair's smaller scan holds for the scan's share on its best neighbour.
    let finding = match largest {
        Some(_) if overlap < limits.min_overlap => Finding::Little,
        Some(other) => fits([other, view], &all, &Limits { min_overlap: 0.0, ..*limits }),
        None => Finding::Nothing,
    };
    let state = match finding {
        Finding::Nothing | Finding::Little => PairState::Nothing,
        _ if all.mean_square.sqrt() > closest(&all, limits) => PairState::Misfit,
        Finding::SeenThrough => PairState::SeenThrough,
        Finding::Slides if all.hold.balance() < SLIDES => PairState::Slides,
        _ => PairState::Fits,
    };
    let (found, moved) = match state {
        PairState::Nothing => (*start, 0.0),
        _ => (pose, apart(start, &pose, view.reduced.radius)),
    };
    Snap {
        world_from_scan: found * DAffine3::from_translation(-view.reduced.middle),
        state,
        touches,
        overlap,
        residual: all.mean_square.sqrt(),
        balance: all.hold.balance().min(1.0),
        seen_through: all.contradiction(),
        moved,
        freedoms: if state == PairState::Slides { freedoms(&all.hold, &DAffine3::IDENTITY) } else { Vec::new() },
    }
}

/// Less balance than this is none. From a rough pose less is enough than without any.
const SLIDES: f64 = 0.0005;
/// Share of its surface on another from which a scan touches it.
const TOUCHES: f64 = 0.02;
