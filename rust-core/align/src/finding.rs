//! Whether a motion may join two scans: overlap, closeness, lines of sight, balance and uniqueness must all pass.

use crate::judge::{Mode, Verdict};
use crate::params::AlignParams;
use crate::view::View;

/// The outcome for two scans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Finding {
    /// No motion makes them touch.
    Nothing,
    /// They touch by less than is asked for.
    Little,
    /// Their surfaces lie further from each other where they touch than noise explains.
    Loose,
    /// The sensor of one saw through the surface of the other.
    SeenThrough,
    /// The part that both scans hold stands still before the sensor, but they differ elsewhere.
    Background,
    /// They share hardly more than walls, which fit other walls as well.
    Walls,
    /// They fit, but may turn or slide.
    Slides,
    /// They fit in several places.
    Ambiguous,
    /// They fit, in this place alone, but hold each other so little that another pair must say the same.
    Weak,
    /// They fit, in this place alone.
    Sure,
}

/// Limits for a pair.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Share of a scan that must lie on the other.
    pub min_overlap: f64,
    /// Largest root mean square of the distances between surfaces that touch. By default from cell and noise.
    pub tolerance: Option<f64>,
    /// Whether tints may decide where shape does not.
    pub use_colour: bool,
}

impl Limits {
    pub fn of(params: &AlignParams) -> Self {
        let AlignParams { min_overlap, tolerance, use_colour, .. } = *params;
        Limits { min_overlap, tolerance, use_colour }
    }
}

/// Root mean square distance of surfaces that coincide, at most, by that of a scan's own neighbours.
pub(crate) const APART: f64 = 0.82;
/// Least share of a scan that lies on others if it nearly fits them, and most of what sensors can tell that may speak against it.
pub(crate) const NEARLY: f64 = 0.3;
pub(crate) const THROUGH_NEARLY: f64 = 0.25;
/// Share of what sensors can tell that may speak against a motion.
const THROUGH: f64 = 0.03;
/// Least eigenvalue of what holds a scan, where six equal ones are 1: enough by itself, and with another pair that says the same.
/// The slack that noise has left to slide through grows as it falls: at 0.0013 a pair of coarse scans was placed 6 samples off.
pub(crate) const BALANCE: f64 = 0.002;
pub(crate) const FREE: f64 = 0.0003;
/// A direction in which a pose may be off by so many cells is not held.
const SLIP: f64 = 2.0;
/// A motion is in doubt if another that fits has this share of its score: of what repeats itself, the right place is often that of less
/// overlap.
pub(crate) const RIVAL: f64 = 0.35;
/// Areas of the finer cell that must touch.
const CONTACTS: f64 = 30.0;

/// Largest root mean square distance of surfaces that are taken for the same.
pub(crate) fn closest(verdict: &Verdict, limits: &Limits) -> f64 {
    limits.tolerance.unwrap_or(APART * verdict.expected)
}

/// Whether a motion fits by itself.
pub(crate) fn fits(views: [&View; 2], verdict: &Verdict, limits: &Limits) -> Finding {
    let cell = views[0].fine().cell.max(views[1].fine().cell);
    let overlap = verdict.overlap();
    if verdict.touching() == 0.0 {
        Finding::Nothing
    } else if overlap[0].max(overlap[1]) < limits.min_overlap
        || verdict.on[0].min(verdict.on[1]) < CONTACTS * cell * cell
    {
        Finding::Little
    } else if verdict.mean_square.sqrt() > closest(verdict, limits) {
        Finding::Loose
    } else if verdict.contradiction() > THROUGH {
        Finding::SeenThrough
    } else if verdict.hold.balance() < FREE || verdict.slip(cell) > SLIP * cell {
        Finding::Slides
    } else if verdict.hold.balance() < BALANCE {
        Finding::Weak
    } else {
        Finding::Sure
    }
}

/// The outcome of the first of the modes, ranked by score, beside the others.
pub(crate) fn find(views: [&View; 2], modes: &[Mode], limits: &Limits) -> Finding {
    find_where(modes, |verdict| fits(views, verdict, limits))
}

/// [`find`] with another word on whether a motion fits by itself.
pub(crate) fn find_where(modes: &[Mode], fits: impl Fn(&Verdict) -> Finding) -> Finding {
    let Some(first) = modes.first() else { return Finding::Nothing };
    let finding = fits(&first.verdict);
    if !matches!(finding, Finding::Sure | Finding::Weak) {
        return finding;
    }
    let is_rival = |mode: &Mode| {
        mode.verdict.score() > RIVAL * first.verdict.score()
            && !matches!(
                fits(&mode.verdict),
                Finding::Nothing | Finding::Little | Finding::Loose | Finding::SeenThrough
            )
    };
    if modes[1..].iter().any(is_rival) { Finding::Ambiguous } else { finding }
}
