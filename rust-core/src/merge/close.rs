//! Stage 9: holes, with a second chance for those whose surroundings stand in the way. [MI04, sec. 3.4]
//!
//! A hole between the ragged borders of two scans may have no fill that does not cross the surface. Its border is peeled,
//! ring by ring, until there is one: what is lost is the border of a scan that disagreed with the others.

use rustc_hash::{FxHashMap, FxHashSet};

use super::holes::{self, OpenLoop, Reason};
use super::lattice::Lattice;
use super::pinches;
use super::reconstruct::Surface;
use crate::error::Result;
use crate::progress::Progress;

/// Rings peeled at most.
const PEEL_ROUNDS: usize = 3;

/// What was closed and what wasn't.
pub struct Closed {
    /// Holes closed.
    pub closed: u64,
    /// Boundary loops left open.
    pub open: u64,
    /// Whether triangles were peeled, so that parts may have come off.
    pub peeled: bool,
}

/// Closes all holes with a boundary of at most `limit`, in world units.
///
/// # Errors
/// Cancelled.
pub fn close_holes(surface: &mut Surface, limit: f64, lattice: &Lattice, progress: &Progress<'_>) -> Result<Closed> {
    let mut result = Closed { closed: 0, open: 0, peeled: false };
    for round in 0..=PEEL_ROUNDS {
        let boundary = std::mem::take(&mut surface.boundary);
        let report = holes::close(&mut surface.positions, &mut surface.triangles, &boundary, limit, progress)?;
        surface.adopt_fill(&report);
        result.closed += report.closed as u64;
        result.open = report.open.len() as u64;
        let next: FxHashMap<u32, u32> = boundary.iter().map(|&[a, b]| (a, b)).collect();
        surface.boundary = report.open.iter().flat_map(|open| walk(open, &next)).collect();
        let stuck: FxHashSet<u32> = report
            .open
            .iter()
            .filter(|open| open.reason == Reason::Crossing)
            .flat_map(|open| walk(open, &next).into_iter().map(|side| side[0]))
            .collect();
        if stuck.is_empty() || round == PEEL_ROUNDS {
            break;
        }
        peel(surface, &stuck);
        result.peeled = true;
        pinches::split(surface, lattice);
    }
    Ok(result)
}

/// The sides of a loop.
fn walk(open: &OpenLoop, next: &FxHashMap<u32, u32>) -> Vec<[u32; 2]> {
    let mut sides = Vec::with_capacity(open.edges);
    let mut at = open.vertex;
    while let Some(&to) = next.get(&at) {
        sides.push([at, to]);
        at = to;
        if at == open.vertex || sides.len() >= open.edges {
            break;
        }
    }
    sides
}

/// Removes all triangles at these vertices and brings the boundary up to date.
fn peel(surface: &mut Surface, vertices: &FxHashSet<u32>) {
    let mut marked = vec![false; surface.positions.len()];
    vertices.iter().for_each(|&v| marked[v as usize] = true);
    let goes = |t: &[u32; 3]| t.iter().any(|&v| marked[v as usize]);
    let removed: Vec<[u32; 3]> = surface.triangles.iter().copied().filter(goes).collect();
    let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let gone: FxHashSet<[u32; 2]> = removed.iter().flat_map(sides).collect();
    let open: FxHashSet<[u32; 2]> = surface.boundary.iter().copied().collect();
    surface.boundary.retain(|side| !gone.contains(side));
    // The far side of a removed side is a new boundary, unless it was removed too or there was none.
    for t in &removed {
        for [a, b] in sides(t) {
            if !gone.contains(&[b, a]) && !open.contains(&[a, b]) {
                surface.boundary.push([b, a]);
            }
        }
    }
    let mut t = 0;
    let keep: Vec<bool> = surface.triangles.iter().map(|t| !goes(t)).collect();
    surface.cases.retain(|_| {
        t += 1;
        keep[t - 1]
    });
    surface.triangles.retain(|t| !goes(t));
}
