//! Stage 9: holes, with a second chance for those whose surroundings stand in the way. [MI04, sec. 3.4]
//!
//! A hole between the ragged borders of two scans may have no fill that does not cross the surface. Its border is peeled,
//! ring by ring, until there is one: what is lost is the border of a scan that disagreed with the others. Where peeling
//! does not lead to a fill, all that was peeled is put back.

use rustc_hash::{FxHashMap, FxHashSet};

use super::components::parts;
use super::extract::Surface;
use super::holes::{self, Reason};
use super::lattice::Lattice;
use super::passes;
use super::pinches;
use base::error::Result;
use base::progress::Progress;

/// Rings peeled at most.
const PEEL_ROUNDS: usize = 3;
/// Times that peeling begins anew without the holes for which it was in vain.
const TRIALS: usize = 8;

/// What was closed and what wasn't.
pub struct Closed {
    /// Holes closed.
    pub closed: u64,
    /// Boundary loops left open.
    pub open: u64,
    /// Whether triangles were peeled, so that parts may have come off.
    pub peeled: bool,
}

/// The longest boundary to close.
#[derive(Clone, Copy)]
pub enum Limit {
    /// World units.
    Length(f64),
    /// World units, but at most this share of the diagonal of the bounding box of the connected part the hole is in: the
    /// rim of a part is no hole.
    OfPart(f64, f64),
}

/// Closes all holes with a boundary within `limit`.
///
/// # Errors
/// Cancelled.
pub fn close_holes(surface: &mut Surface, limit: Limit, lattice: &Lattice, progress: &Progress<'_>) -> Result<Closed> {
    let limits = Limits::new(surface, limit, progress)?;
    let boundary = std::mem::take(&mut surface.boundary);
    let report = holes::close(
        &mut surface.positions,
        &mut surface.triangles,
        &boundary,
        |vertices| limits.of(vertices),
        progress,
    )?;
    surface.adopt_fill(&report);
    let mut result = Closed { closed: report.closed as u64, open: report.open.len() as u64, peeled: false };
    let next = successors(&boundary);
    let mut stuck = Vec::new();
    for open in &report.open {
        let sides = walk(open.vertex, &next);
        surface.boundary.extend(&sides);
        if open.reason == Reason::Crossing {
            stuck.push(sides.iter().map(|side| side[0]).collect());
        }
    }
    for _ in 0..TRIALS {
        if stuck.is_empty() {
            break;
        }
        let mut trial = Trial::new(surface.copied(progress)?, &stuck);
        trial.run(&limits, lattice, progress)?;
        if trial.failed.is_empty() {
            result.closed += trial.closed;
            result.open -= stuck.len() as u64;
            result.peeled = true;
            *surface = trial.surface;
            break;
        }
        let mut number = 0;
        stuck.retain(|_| {
            number += 1;
            !trial.failed.contains(&(number - 1))
        });
    }
    Ok(result)
}

/// The limit of each loop.
struct Limits {
    length: f64,
    /// The part of each vertex, and the limits of parts that have a boundary; empty if all have the same.
    parts: Vec<u32>,
    of_part: FxHashMap<u32, f64>,
}

impl Limits {
    fn new(surface: &Surface, limit: Limit, progress: &Progress<'_>) -> Result<Self> {
        let (length, share) = match limit {
            Limit::Length(length) => return Ok(Limits { length, parts: Vec::new(), of_part: FxHashMap::default() }),
            Limit::OfPart(length, share) => (length, share),
        };
        let parts = parts(surface.positions.len(), &surface.triangles, progress)?;
        let empty = (glam::DVec3::INFINITY, glam::DVec3::NEG_INFINITY);
        let mut boxes: FxHashMap<u32, _> = surface.boundary.iter().map(|s| (parts[s[0] as usize], empty)).collect();
        passes::each(parts.len(), progress, |v| {
            if let Some((low, high)) = boxes.get_mut(&parts[v]) {
                *low = low.min(surface.positions[v]);
                *high = high.max(surface.positions[v]);
            }
        })?;
        let within = |(low, high): (glam::DVec3, glam::DVec3)| length.min(share * low.distance(high));
        let of_part = boxes.into_iter().map(|(part, bounds)| (part, within(bounds))).collect();
        Ok(Limits { length, parts, of_part })
    }

    fn of(&self, vertices: &[u32]) -> f64 {
        // Vertices that were split off lie beside others of their part.
        let part = vertices.iter().find_map(|&v| self.parts.get(v as usize));
        part.and_then(|part| self.of_part.get(part)).copied().unwrap_or(self.length)
    }
}

/// An attempt to close holes by peeling, on a copy of the surface.
struct Trial {
    surface: Surface,
    /// Of the vertices at a peeled hole its number, of those at other loops [`OTHER`].
    hole_of: FxHashMap<u32, usize>,
    closed: u64,
    /// Holes that stay open.
    failed: FxHashSet<usize>,
}

/// At a loop that is not being closed.
const OTHER: usize = usize::MAX;

impl Trial {
    fn new(surface: Surface, stuck: &[Vec<u32>]) -> Self {
        let mut hole_of: FxHashMap<u32, usize> = surface.boundary.iter().map(|side| (side[0], OTHER)).collect();
        for (hole, vertices) in stuck.iter().enumerate() {
            hole_of.extend(vertices.iter().map(|&v| (v, hole)));
        }
        Trial { surface, hole_of, closed: 0, failed: FxHashSet::default() }
    }

    /// Peels and closes until all holes are closed, or it is known which can't be.
    fn run(&mut self, limits: &Limits, lattice: &Lattice, progress: &Progress<'_>) -> Result<()> {
        let mut stuck: FxHashSet<u32> = self.hole_of.iter().filter(|at| *at.1 != OTHER).map(|at| *at.0).collect();
        for round in 1..=PEEL_ROUNDS {
            let peeled: FxHashSet<usize> = stuck.iter().filter_map(|v| self.hole_of.get(v).copied()).collect();
            self.peel(&stuck, progress)?;
            pinches::split(&mut self.surface, lattice, progress)?;
            let wanted = self.take_loops(peeled);
            if !self.failed.is_empty() {
                return Ok(());
            }
            let surface = &mut self.surface;
            let report = holes::close(
                &mut surface.positions,
                &mut surface.triangles,
                &wanted,
                |vertices| limits.of(vertices),
                progress,
            )?;
            surface.adopt_fill(&report);
            self.closed += report.closed as u64;
            let next = successors(&wanted);
            stuck.clear();
            for open in &report.open {
                let sides = walk(open.vertex, &next);
                self.surface.boundary.extend(&sides);
                if open.reason == Reason::Crossing && round < PEEL_ROUNDS {
                    stuck.extend(sides.iter().map(|side| side[0]));
                } else {
                    self.failed.extend(sides.iter().filter_map(|side| self.hole_of.get(&side[0])));
                }
            }
            if stuck.is_empty() || !self.failed.is_empty() {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Takes the loops around peeled holes out of the boundary. Holes that have met another loop have failed, and those
    /// around which nothing is left.
    fn take_loops(&mut self, mut peeled: FxHashSet<usize>) -> Vec<[u32; 2]> {
        let boundary = std::mem::take(&mut self.surface.boundary);
        let next = successors(&boundary);
        let mut seen = FxHashSet::default();
        let mut wanted = Vec::new();
        for &[first, _] in &boundary {
            if seen.contains(&first) {
                continue;
            }
            let sides = walk(first, &next);
            seen.extend(sides.iter().map(|side| side[0]));
            let holes: FxHashSet<usize> = sides.iter().filter_map(|s| self.hole_of.get(&s[0]).copied()).collect();
            if holes.contains(&OTHER) {
                self.failed.extend(holes.iter().copied().filter(|&hole| hole != OTHER));
                self.surface.boundary.extend(sides);
            } else {
                wanted.extend(sides);
            }
            peeled.retain(|hole| !holes.contains(hole));
        }
        self.failed.extend(peeled);
        wanted
    }

    /// Removes all triangles at these vertices and brings the boundary up to date.
    fn peel(&mut self, vertices: &FxHashSet<u32>, progress: &Progress<'_>) -> Result<()> {
        let surface = &mut self.surface;
        let mut marked = passes::filled(false, surface.positions.len(), progress)?;
        vertices.iter().for_each(|&v| marked[v as usize] = true);
        let goes = passes::made(surface.triangles.len(), progress, |t| {
            surface.triangles[t].iter().any(|&v| marked[v as usize])
        })?;
        let mut removed = Vec::new();
        passes::retain(&mut surface.cases, progress, |t, _| !goes[t])?;
        passes::retain(&mut surface.triangles, progress, |t, triangle| {
            if goes[t] {
                removed.push(triangle);
            }
            !goes[t]
        })?;
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let gone: FxHashSet<[u32; 2]> = removed.iter().flat_map(sides).collect();
        let open: FxHashSet<[u32; 2]> = surface.boundary.iter().copied().collect();
        surface.boundary.retain(|side| !gone.contains(side));
        for t in &removed {
            let hole = t.iter().filter(|v| marked[**v as usize]).find_map(|v| self.hole_of.get(v).copied());
            for [a, b] in sides(t) {
                if let Some(hole) = hole {
                    self.hole_of.entry(a).or_insert(hole);
                }
                // The far side of a removed side is a new boundary, unless it was removed too or there was none.
                if !gone.contains(&[b, a]) && !open.contains(&[a, b]) {
                    surface.boundary.push([b, a]);
                }
            }
        }
        Ok(())
    }
}

/// The vertex after each vertex of a boundary.
fn successors(boundary: &[[u32; 2]]) -> FxHashMap<u32, u32> {
    boundary.iter().map(|&[a, b]| (a, b)).collect()
}

/// The sides of the loop through a vertex.
fn walk(first: u32, next: &FxHashMap<u32, u32>) -> Vec<[u32; 2]> {
    let mut sides = Vec::new();
    let mut at = first;
    while let Some(&to) = next.get(&at) {
        sides.push([at, to]);
        at = to;
        if at == first || sides.len() > next.len() {
            break;
        }
    }
    sides
}
