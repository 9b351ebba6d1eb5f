//! Motions of two scans, refined at their coarser levels and made exact at the finer ones. Each kept once, the best first.

use glam::DAffine3;

use crate::gravity::keeps_up;
use crate::judge::{Mode, judge, tolerance};
use crate::linear::apart;
use crate::refine::{Both, Reach};
use crate::view::View;

/// Samples of each scan for a look and for steps, and for the verdict.
pub(crate) const FEW: usize = 400;
pub(crate) const MANY: usize = 1000;

/// The last of what refines roughly.
pub(crate) fn last_rough(cell: f64) -> Reach {
    Reach { distance: 1.2 * cell, scale: 0.6 * cell, steps: 6, enough: 0.05 * cell }
}

/// Different motions near some, refined at the coarser level.
pub(crate) fn refined_roughly(both: [&View; 2], starts: impl Iterator<Item = DAffine3>) -> Vec<Mode> {
    let cell = both[0].coarse.cell.max(both[1].coarse.cell);
    let radius = both[0].reduced.radius.min(both[1].reduced.radius);
    let coarse = Both::new(&both[0].coarse, &both[1].coarse, FEW);
    let rough =
        [3.0, 2.0].map(|by| Reach { distance: by * cell, scale: 0.5 * by * cell, steps: 6, enough: 0.05 * cell });
    let schedule = [rough[0], rough[1], last_rough(cell)];
    let mut modes: Vec<Mode> = Vec::new();
    for start in starts {
        let Some(a_from_b) = coarse.refine(&start, &schedule, radius) else { continue };
        if modes.iter().all(|mode| apart(&mode.a_from_b, &a_from_b, radius) >= cell) {
            modes.push(Mode { a_from_b, verdict: judge(both, &coarse, &a_from_b, 0.7 * cell) });
        }
    }
    modes.sort_by(|x, y| y.verdict.score().total_cmp(&x.verdict.score()));
    modes
}

/// Motions made exact at the finer level: those that keep what is up.
pub(crate) fn exact(both: [&View; 2], rough: &[DAffine3]) -> Vec<Mode> {
    let [few, many] = [FEW, MANY].map(|samples| Both::new(both[0].fine(), both[1].fine(), samples));
    let cell = both[0].fine().cell.max(both[1].fine().cell);
    let width = tolerance(both);
    let radius = both[0].reduced.radius.min(both[1].reduced.radius);
    let schedule = [2.5, 1.5, 1.0].map(|by| Reach {
        distance: (by + 0.5) * width,
        scale: 0.5 * by * width,
        steps: 8,
        enough: 0.02 * cell,
    });
    let refined = rough.iter().filter_map(|start| few.refine(start, &schedule, radius));
    let refined = refined.filter(|a_from_b| keeps_up(both, a_from_b));
    let mut modes: Vec<Mode> =
        refined.map(|a_from_b| Mode { a_from_b, verdict: judge(both, &many, &a_from_b, tolerance(both)) }).collect();
    rank(&mut modes, both);
    modes
}

/// Puts the best first, and keeps those that are the same once.
pub(crate) fn rank(modes: &mut Vec<Mode>, both: [&View; 2]) {
    let cell = both[0].coarse.cell.max(both[1].coarse.cell);
    let radius = both[0].reduced.radius.min(both[1].reduced.radius);
    modes.sort_by(|x, y| y.verdict.score().total_cmp(&x.verdict.score()));
    let mut kept: Vec<Mode> = Vec::new();
    for mode in modes.drain(..) {
        if kept.iter().all(|other| apart(&other.a_from_b, &mode.a_from_b, radius) >= 1.5 * cell) {
            kept.push(mode);
        }
    }
    *modes = kept;
}
