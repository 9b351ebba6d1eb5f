//! Stage 9b: a second chance for holes whose surroundings stand in the way. [MI04, sec. 3.4]
//!
//! A hole between the ragged borders of two scans may have no fill that does not cross the surface. Its border is peeled, ring by ring,
//! until there is one. The part that is lost is the border of a scan that disagreed with the others. If peeling does not lead to a fill,
//! all that was peeled is put back.
//!
//! Peeling and filling stay within the hole's **window**, a box around it, and holes are tried together only if their
//! windows have something in common. So what is tried in vain in one place changes nothing in another, and a window is all
//! that has to be in memory.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::crossings::lattice::Lattice;
use crate::surface::extract::{self, Surface};
use crate::surface::pinches;
use base::error::Result;
use base::progress::Progress;
use mesh::connected::parts;
use mesh::holes::{self, Bounds, HoleReason, successors, walk};

/// Rings peeled at most.
const ROUNDS: usize = 3;
/// Times that peeling begins anew without the holes for which it was in vain.
const TRIALS: usize = 8;
/// Largest width of a ring, in cells: sides of triangles are at most the diagonal of one.
const RING: f64 = 2.0;

/// Report of the attempts.
#[derive(Default)]
pub struct Retried {
    /// Holes that are open no more.
    pub holes: u64,
    /// Loops that were closed instead: peeling joins and parts them.
    pub closed: u64,
    /// Pieces that came off and were dropped, and their triangles.
    pub dropped: [u64; 2],
}

impl Retried {
    /// Of one that led to a fill.
    pub fn of(attempt: &Attempt) -> Self {
        let &Attempt { holes, closed, dropped, .. } = attempt;
        Retried { holes, closed, dropped }
    }

    /// Adds others.
    pub fn add(&mut self, other: &Retried) {
        self.holes += other.holes;
        self.closed += other.closed;
        (0..2).for_each(|i| self.dropped[i] += other.dropped[i]);
    }
}

/// The surface around the holes that have loops of these vertices, where peeling leads to a fill, in the order of the holes. The part of
/// the surface in the [`window`]s of the holes has to be known.
///
/// # Errors
/// Cancelled.
pub fn attempts(
    surface: &Surface,
    stuck: &[Vec<u32>],
    limit: impl Fn(&[u32]) -> f64 + Sync,
    least: f64,
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<Vec<Attempt>> {
    if stuck.is_empty() {
        return Ok(Vec::new());
    }
    let windows: Vec<Window> = stuck.iter().map(|hole| Window::around(surface, hole, lattice.voxel)).collect();
    let regions: Vec<Bounds> = windows.iter().map(|window| window.whole).collect();
    let near = holes::near(&surface.positions, &surface.triangles, &regions, progress)?;
    let groups = groups(&regions, &near, progress)?;
    let next = successors(&surface.boundary);
    let attempts: Vec<Option<Attempt>> = groups
        .into_par_iter()
        .map(|mut group| {
            let first = group[0];
            let cut = Excerpt::new(surface, &next, group.iter().flat_map(|&hole| &near[hole]).copied().collect());
            for _ in 0..TRIALS {
                if group.is_empty() {
                    break;
                }
                let mut trial = Trial::new(&cut, &group, stuck, &windows);
                trial.run(|vertices| limit(&cut.known(vertices)), lattice, progress)?;
                if trial.failed.is_empty() {
                    let dropped = trial.drop_pieces(least, progress)?;
                    let Trial { surface, origin, closed, .. } = trial;
                    let holes = group.len() as u64;
                    return Ok(Some(Attempt { cut, surface, origin, first, holes, closed, dropped }));
                }
                group.retain(|hole| !trial.failed.contains(hole));
            }
            Ok(None)
        })
        .collect::<Result<_>>()?;
    Ok(attempts.into_iter().flatten().collect())
}

/// All that matters to peeling a hole whose vertices lie in these bounds.
pub fn window(hole: Bounds, voxel: f64) -> Bounds {
    Window::of(hole, voxel).whole
}

/// All that is tried for a hole stays in here.
struct Window {
    /// Region in which its border may be peeled.
    reach: Bounds,
    /// Region that fills of that may meet.
    whole: Bounds,
}

impl Window {
    fn around(surface: &Surface, hole: &[u32], voxel: f64) -> Self {
        Self::of(Bounds::of(hole.iter().map(|&v| surface.positions[v as usize])), voxel)
    }

    fn of(bounds: Bounds, voxel: f64) -> Self {
        let reach = bounds.grown(ROUNDS as f64 * RING * voxel);
        Window { reach, whole: holes::region(reach) }
    }
}

/// The holes in groups: those whose windows meet, or have a triangle in common. `near` are the triangles that each window meets.
fn groups(windows: &[Bounds], near: &[Vec<u32>], progress: &Progress<'_>) -> Result<Vec<Vec<usize>>> {
    let boxes: Vec<(usize, Bounds)> = windows.iter().copied().enumerate().collect();
    let meeting = holes::meeting(&boxes, progress)?;
    let mut pairs: Vec<[u32; 2]> = meeting.iter().map(|&(a, b)| [a as u32, b as u32]).collect();
    let mut first_at: FxHashMap<u32, u32> = FxHashMap::default();
    for (hole, triangles) in near.iter().enumerate() {
        progress.check()?;
        for &t in triangles {
            let first = *first_at.entry(t).or_insert(hole as u32);
            if first != hole as u32 && pairs.last() != Some(&[hole as u32, first]) {
                pairs.push([hole as u32, first]);
            }
        }
    }
    let links: Vec<[u32; 3]> = pairs.iter().map(|&[a, b]| [a, b, b]).collect();
    let mut groups: Vec<Vec<usize>> = vec![Vec::new(); windows.len()];
    for (hole, &lowest) in parts(windows.len(), &links, progress)?.iter().enumerate() {
        groups[lowest as usize].push(hole);
    }
    groups.retain(|group| !group.is_empty());
    Ok(groups)
}

/// The surface in the windows of a group.
pub struct Excerpt {
    /// The surface before.
    pub surface: Surface,
    /// Numbers in the whole surface, ascending.
    pub vertices: Vec<u32>,
    /// Those of the triangles.
    pub triangles: Vec<u32>,
}

impl Excerpt {
    /// Of these triangles. `next` are the successors of the boundary.
    fn new(whole: &Surface, next: &FxHashMap<u32, u32>, mut triangles: Vec<u32>) -> Self {
        triangles.sort_unstable();
        triangles.dedup();
        let corners = || triangles.iter().map(|&t| whole.triangles[t as usize]);
        let mut vertices: Vec<u32> = corners().flatten().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |v: u32| vertices.partition_point(|&other| other < v) as u32;
        let of = |v: u32| v as usize;
        let sides = corners().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
        let surface = Surface {
            positions: vertices.iter().map(|&v| whole.positions[of(v)]).collect(),
            confidence: vertices.iter().map(|&v| whole.confidence[of(v)]).collect(),
            noise: vertices.iter().map(|&v| whole.noise[of(v)]).collect(),
            colour: vertices.iter().map(|&v| whole.colour[of(v)]).collect(),
            scan: vertices.iter().map(|&v| whole.scan[of(v)]).collect(),
            boundary: sides.filter(|[a, b]| next.get(a) == Some(b)).map(|side| side.map(number)).collect(),
            cases: triangles.iter().map(|&t| whole.cases[t as usize]).collect(),
            triangles: corners().map(|t| t.map(number)).collect(),
        };
        Excerpt { surface, vertices, triangles }
    }

    /// Those vertices that the whole surface has, by its numbers.
    fn known(&self, vertices: &[u32]) -> Vec<u32> {
        vertices.iter().filter_map(|&v| self.vertices.get(v as usize)).copied().collect()
    }
}

/// An attempt to close holes by peeling, on a copy of the surface around them.
struct Trial<'a> {
    windows: &'a [Window],
    surface: Surface,
    /// Of the triangles that are left of the cut, which they were.
    origin: Vec<u32>,
    /// Of the vertices at a peeled hole its number, of those at other loops [`OTHER`].
    hole_of: FxHashMap<u32, usize>,
    closed: u64,
    /// Holes that stay open.
    failed: FxHashSet<usize>,
}

/// At a loop that is not being closed.
const OTHER: usize = usize::MAX;

impl<'a> Trial<'a> {
    fn new(cut: &Excerpt, group: &[usize], stuck: &[Vec<u32>], windows: &'a [Window]) -> Self {
        let surface = cut.surface.clone();
        let mut hole_of: FxHashMap<u32, usize> = surface.boundary.iter().map(|side| (side[0], OTHER)).collect();
        let number = |v: &u32| cut.vertices.partition_point(|other| other < v) as u32;
        for &hole in group {
            hole_of.extend(stuck[hole].iter().map(|v| (number(v), hole)));
        }
        let origin = (0..surface.triangles.len() as u32).collect();
        Trial { windows, surface, origin, hole_of, closed: 0, failed: FxHashSet::default() }
    }

    /// Peels and closes until all holes are closed, or it is known which can't be.
    fn run(&mut self, limit: impl Fn(&[u32]) -> f64, lattice: &Lattice, progress: &Progress<'_>) -> Result<()> {
        let mut stuck: FxHashSet<u32> = self.hole_of.iter().filter(|at| *at.1 != OTHER).map(|at| *at.0).collect();
        for round in 1..=ROUNDS {
            let peeled: FxHashSet<usize> = stuck.iter().filter_map(|v| self.hole_of.get(v).copied()).collect();
            self.peel(&stuck);
            if !self.failed.is_empty() {
                return Ok(());
            }
            pinches::split(&mut self.surface, lattice, progress)?;
            let wanted = self.take_loops(peeled);
            if !self.failed.is_empty() {
                return Ok(());
            }
            let surface = &mut self.surface;
            let (places, triangles) = (&mut surface.positions, &mut surface.triangles);
            let shortest = extract::APART * lattice.voxel;
            let report = holes::close(places, triangles, &wanted, &limit, shortest, progress)?;
            surface.adopt_fill(&report);
            self.closed += report.closed as u64;
            let next = successors(&wanted);
            stuck.clear();
            for open in &report.open {
                let sides = walk(open.vertex, &next);
                self.surface.boundary.extend(&sides);
                if open.reason == HoleReason::Crossing && round < ROUNDS {
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

    /// Takes the loops around peeled holes out of the boundary. Holes that have met another loop have failed, those that
    /// have left their windows, and those around which nothing is left.
    fn take_loops(&mut self, mut peeled: FxHashSet<usize>) -> Vec<[u32; 2]> {
        let mut boundary = std::mem::take(&mut self.surface.boundary);
        let next = successors(&boundary);
        // Loops that leave the cut are chains in it.
        let ends: FxHashSet<u32> = boundary.iter().map(|side| side[1]).collect();
        boundary.sort_by_key(|side| ends.contains(&side[0]));
        let mut seen = FxHashSet::default();
        let mut wanted = Vec::new();
        for &[first, _] in &boundary {
            if seen.contains(&first) {
                continue;
            }
            let sides = walk(first, &next);
            seen.extend(sides.iter().map(|side| side[0]));
            let holes: FxHashSet<usize> = sides.iter().filter_map(|s| self.hole_of.get(&s[0]).copied()).collect();
            let place = Bounds::of(sides.iter().map(|side| self.surface.positions[side[0] as usize]));
            let is_within = |hole: &usize| self.windows[*hole].whole.encloses(&holes::region(place));
            if holes.contains(&OTHER) || !holes.iter().any(is_within) {
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

    /// Drops pieces of fewer than `least` triangles that are connected to nothing else. Gives their number and that of their triangles.
    fn drop_pieces(&mut self, least: f64, progress: &Progress<'_>) -> Result<[u64; 2]> {
        if least <= 0.0 {
            return Ok([0; 2]);
        }
        let surface = &mut self.surface;
        let part_of = parts(surface.positions.len(), &surface.triangles, progress)?;
        let mut faces: FxHashMap<u32, u64> = FxHashMap::default();
        surface.triangles.iter().for_each(|t| *faces.entry(part_of[t[0] as usize]).or_default() += 1);
        let sides = || surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let mut known: FxHashSet<[u32; 2]> = sides().collect();
        known.extend(surface.boundary.iter().map(|&[a, b]| [b, a]));
        // Beyond the window they go on.
        for [a, _] in sides().filter(|&[a, b]| !known.contains(&[b, a])) {
            faces.remove(&part_of[a as usize]);
        }
        faces.retain(|_, count| (*count as f64) < least);
        if faces.is_empty() {
            return Ok([0; 2]);
        }
        let is_in = |v: u32| faces.contains_key(&part_of[v as usize]);
        let goes: Vec<bool> = surface.triangles.iter().map(|t| is_in(t[0])).collect();
        surface.boundary.retain(|side| !is_in(side[0]));
        keep(&mut surface.cases, &goes);
        keep(&mut surface.triangles, &goes);
        keep(&mut self.origin, &goes);
        Ok([faces.len() as u64, faces.values().sum()])
    }

    /// Removes all triangles at these vertices and brings the boundary up to date.
    fn peel(&mut self, vertices: &FxHashSet<u32>) {
        let surface = &mut self.surface;
        let goes: Vec<bool> = surface.triangles.iter().map(|t| t.iter().any(|v| vertices.contains(v))).collect();
        let removed: Vec<[u32; 3]> = (surface.triangles.iter().zip(&goes)).filter(|t| *t.1).map(|t| *t.0).collect();
        keep(&mut surface.cases, &goes);
        keep(&mut surface.triangles, &goes);
        keep(&mut self.origin, &goes);
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let gone: FxHashSet<[u32; 2]> = removed.iter().flat_map(sides).collect();
        let open: FxHashSet<[u32; 2]> = surface.boundary.iter().copied().collect();
        surface.boundary.retain(|side| !gone.contains(side));
        for t in &removed {
            let hole = t.iter().filter(|v| vertices.contains(v)).find_map(|v| self.hole_of.get(v).copied());
            for [a, b] in sides(t) {
                if let Some(hole) = hole {
                    let hole = *self.hole_of.entry(a).or_insert(hole);
                    // Of what lies beyond, not all triangles may be known.
                    if hole != OTHER && !self.windows[hole].reach.contains(surface.positions[a as usize]) {
                        self.failed.insert(hole);
                    }
                }
                // The far side of a removed side is a new boundary, unless it was removed too or there was none.
                if !gone.contains(&[b, a]) && !open.contains(&[a, b]) {
                    surface.boundary.push([b, a]);
                }
            }
        }
    }
}

/// Keeps what does not go.
fn keep<T>(list: &mut Vec<T>, goes: &[bool]) {
    let mut goes = goes.iter();
    list.retain(|_| !goes.next().is_some_and(|goes| *goes));
}

/// New surface of a group.
pub struct Attempt {
    /// The surface before.
    pub cut: Excerpt,
    /// The surface now: vertices that there were keep their numbers.
    pub surface: Surface,
    /// Of the triangles that are left, which they were, the others follow.
    pub origin: Vec<u32>,
    /// The first of the holes.
    pub first: usize,
    /// Holes that are open no more.
    pub holes: u64,
    /// Loops that were closed.
    pub closed: u64,
    /// Pieces that were dropped, and their triangles.
    pub dropped: [u64; 2],
}

impl Attempt {
    /// Those of its vertices that have no triangle.
    pub fn bare(&self) -> Vec<u32> {
        let mut is_bare = vec![true; self.surface.positions.len()];
        self.surface.triangles.as_flattened().iter().for_each(|&v| is_bare[v as usize] = false);
        (0..).zip(is_bare).filter(|v| v.1).map(|v| v.0).collect()
    }
}

#[cfg(test)]
mod tests;
