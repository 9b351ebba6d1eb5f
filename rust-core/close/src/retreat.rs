//! The fill out of seen space: what enters it moves back, and what can't is found.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;

use super::stitch::Growing;
use super::surface::normal;
use super::visibility::Envelope;

/// Rounds, and how far a vertex moves in one, in cells.
const ROUNDS: usize = 12;
const STEP: f64 = 0.25;
/// Places asked on a triangle lie this near to each other, in cells.
const PITCH: f64 = 0.5;
/// Most places along a side.
const MOST: usize = 64;

/// Places within half a cell of measured vertices. The surface itself is there.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum NearMeasured {
    /// They are not asked.
    Passed,
    /// They are asked, too: scans that contradict each other saw through there.
    Asked,
}

/// Whether any place of each filled triangle was seen through. False for measured ones. Places lie half a cell apart or nearer. The tolerance
/// is at least that of [`retreat`], which knows of most triangles already.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn in_seen_space(
    surface: &Growing,
    envelope: Envelope<'_>,
    cell: f64,
    beside: NearMeasured,
    progress: &Progress<'_>,
) -> Result<Vec<bool>> {
    let mut seen = vec![false; surface.triangles.len()];
    let is_open = |t| beside == NearMeasured::Asked || !surface.is_unseen(t);
    ask(surface, envelope, cell, beside, &mut seen, is_open, progress)?;
    Ok(seen)
}

/// Answers for the filled triangles that `is_new` says.
fn ask(
    surface: &Growing,
    envelope: Envelope<'_>,
    cell: f64,
    beside: NearMeasured,
    seen: &mut [bool],
    is_new: impl Fn(usize) -> bool + Sync,
    progress: &Progress<'_>,
) -> Result<()> {
    if envelope.visibility.is_blind() {
        return Ok(());
    }
    let first = surface.measured[1];
    seen[first..].par_chunks_mut(64).enumerate().try_for_each(|(chunk, seen)| {
        progress.check()?;
        for (i, seen) in seen.iter_mut().enumerate() {
            let t = first + 64 * chunk + i;
            if is_new(t) {
                let is_passed = |v: u32| beside == NearMeasured::Passed && (v as usize) < surface.measured[0];
                *seen = is_in_seen_space(surface.corners(t), surface.triangles[t].map(is_passed), envelope, cell);
            }
        }
        Ok(())
    })
}

/// Whether any place of a triangle was seen through, but for those within half a cell of a measured corner: the surface itself is there.
pub fn is_in_seen_space(triangle: [DVec3; 3], is_measured: [bool; 3], envelope: Envelope<'_>, cell: f64) -> bool {
    let is_beside = |place: DVec3| {
        (0..3).any(|k| is_measured[k] && place.distance_squared(triangle[k]) <= (PITCH * cell) * (PITCH * cell))
    };
    places(triangle, PITCH * cell).any(|place| !is_beside(place) && envelope.is_seen(place))
}

/// Corners, and places between them not farther apart than `pitch`, up to a limit.
fn places([a, b, c]: [DVec3; 3], pitch: f64) -> impl Iterator<Item = DVec3> {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let n = ((longest / pitch).ceil() as usize).clamp(2, MOST);
    let at = move |i: usize, j: usize| a + (b - a) * (i as f64 / n as f64) + (c - a) * (j as f64 / n as f64);
    (0..=n).flat_map(move |i| (0..=n - i).map(move |j| at(i, j)))
}

/// Moves filled vertices of triangles in seen space against the normal, into what nobody saw, until none is left or the rounds are over.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn retreat(surface: &mut Growing, envelope: Envelope<'_>, cell: f64, progress: &Progress<'_>) -> Result<()> {
    let mut seen = vec![false; surface.triangles.len()];
    let mut is_moved = vec![true; surface.positions.len()];
    for _ in 0..ROUNDS {
        let is_new = |t: usize| !surface.is_unseen(t) && surface.triangles[t].iter().any(|&v| is_moved[v as usize]);
        ask(surface, envelope, cell, NearMeasured::Passed, &mut seen, is_new, progress)?;
        surface.set_unseen(&seen);
        let filled = surface.measured[1]..surface.triangles.len();
        is_moved.fill(false);
        for t in filled.clone().filter(|&t| seen[t]) {
            surface.triangles[t].iter().for_each(|&v| is_moved[v as usize] = v as usize >= surface.measured[0]);
        }
        if !is_moved.contains(&true) {
            break;
        }
        let mut moves = vec![DVec3::ZERO; surface.positions.len()];
        for t in filled {
            let normal = normal(surface.corners(t));
            surface.triangles[t].iter().for_each(|&v| moves[v as usize] -= normal);
        }
        for v in (surface.measured[0]..surface.positions.len()).filter(|&v| is_moved[v]) {
            surface.positions[v] += STEP * cell * moves[v].normalize_or_zero();
        }
        surface.forget_around(&is_moved);
    }
    Ok(())
}
