//! Open surfaces, continued: from the facets all agree on, the surface grows over the rest. \[CSD04\]
//!
//! At an edge of the border, of all facets with that edge the best continues the surface: among those that bend it
//! little the one with the smallest empty ball, else the one that bends it least. Always the best of all edges is taken
//! next, and only if it is not larger than the sampling around it allows. It may end
//!
//! * in a new sample,
//! * between two or three edges of the border, which closes an ear or a hole,
//! * at a sample elsewhere on the border. That alone would pinch the surface there, so it comes together with the facet
//!   that joins it to one of the border's edges at that sample, or waits.
//!
//! So every vertex has one fan of triangles and the surface is oriented, always. What waits is tried again when nothing
//! else is left, first with any facet that joins it, then with the next best facet of its edge.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashMap;

use super::balls::Balls;
use super::border::Border;
use super::complex::Complex;
use super::fans::keep_largest;
use super::sheet::Choice;
use base::error::Result;
use base::progress::{Pace, Progress};
use geom::delaunay3::INFINITE;

/// Cosine of the bend up to which the size of a facet decides: 30 degrees, as in \[CSD04\].
const SMOOTH: f64 = 0.866;
/// Cosine of the sharpest bend: 150 degrees.
const SHARPEST: f64 = -0.866;

/// Facets joined over edges, each with a cell that has it.
type Part = Vec<([u32; 3], u32)>;

/// What a facet counts whose samples' spacings may have to be found first, in entries looked at.
const COSTLY: usize = 64;

/// Share of the perimeter allowed for facets that none of their vertices chose.
const STRANGER: f64 = 0.6;

/// How good a facet is at an edge, smaller is better: smooth ones by size, then the others by bend.
type Rank = (bool, u32);

/// A facet that could continue the surface over the edge from `edge[0]` to `edge[1]`, with a cell that has it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    rank: Rank,
    edge: [u32; 2],
    apex: u32,
    cell: u32,
}

/// What may happen to facets that would pinch the surface.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Patience {
    /// They wait until the facet that joins them is the best at its edge ...
    Strict,
    /// ... until there is one.
    AnyTwin,
    /// The next best facet goes before them.
    NextBest,
}

/// Whether a facet fits onto the border.
enum Fit {
    No,
    Waits,
    Alone,
    /// With this facet beside it, and a cell that has it.
    WithTwin([u32; 3], u32),
}

/// A surface that grows.
pub(super) struct Front<'a, F> {
    complex: Complex<'a>,
    balls: &'a Balls,
    choices: &'a [Choice],
    /// Largest perimeter that the sampling around a facet allows.
    allowed: F,
    triangles: Vec<[u32; 3]>,
    /// A cell of each triangle.
    cells: Vec<u32>,
    /// The triangle of each directed edge.
    edges: FxHashMap<[u32; 2], u32>,
    border: Border,
    queue: BinaryHeap<Reverse<Candidate>>,
    patience: Patience,
}

impl<'a, F: FnMut([u32; 3]) -> f64> Front<'a, F> {
    /// The surface over the facets chosen, oriented, its parts in any of their two orientations.
    pub(super) fn grow(
        complex: Complex<'a>,
        balls: &'a Balls,
        choices: &'a [Choice],
        allowed: F,
        progress: &Progress<'_>,
    ) -> Result<Vec<[u32; 3]>> {
        let mut front = Front {
            complex,
            balls,
            choices,
            allowed,
            triangles: Vec::new(),
            cells: Vec::new(),
            edges: FxHashMap::default(),
            border: Border::new(complex.points.len()),
            queue: BinaryHeap::new(),
            patience: Patience::Strict,
        };
        for part in front.parts(progress)? {
            front.grow_from(&part, progress)?;
        }
        // Where opposite walls are nearer than their samples are to each other, too few facets are agreed on.
        let samples = complex.points.len();
        if 2 * (0..samples as u32).filter(|&vertex| front.border.is_used(vertex)).count() < samples {
            for seed in front.disputed(progress)? {
                front.grow_from(&[seed], progress)?;
            }
        }
        front.close_small_holes(progress)?;
        Ok(front.triangles)
    }

    /// Enters a part, unless it was grown over meanwhile, from a larger one, and grows on from it.
    fn grow_from(&mut self, part: &[([u32; 3], u32)], progress: &Progress<'_>) -> Result<()> {
        progress.check()?;
        if part.iter().flat_map(|seed| seed.0).any(|vertex| self.border.is_used(vertex)) {
            return Ok(());
        }
        let first = self.triangles.len();
        for &(triangle, cell) in part {
            self.add(triangle, cell);
        }
        for triangle in part {
            self.border.enter(triangle.0, |edge| self.edges.contains_key(&edge));
        }
        self.run(first, progress)
    }

    /// The facets that two of their vertices chose, the smallest first.
    fn disputed(&mut self, progress: &Progress<'_>) -> Result<Vec<([u32; 3], u32)>> {
        let choices = self.choices;
        let mut seeds = Vec::new();
        for block in progress.blocks(choices) {
            let disputed = block?.iter().filter(|choice| choice.votes == 2 && choice.vertices[2] != INFINITE);
            seeds.extend(
                disputed
                    .map(|choice| (self.complex.perimeter(choice.vertices), choice.vertices, choice.cell))
                    .filter(|&(perimeter, facet, _)| perimeter <= (self.allowed)(facet)),
            );
        }
        type Seed = (f64, [u32; 3], u32);
        progress.sort(&mut seeds, &|a: &Seed, b: &Seed| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))?;
        Ok(seeds.into_iter().map(|(_, facet, cell)| (facet, cell)).collect())
    }

    /// Closes holes of three or four edges whose facets are none of the tetrahedralization's, as there are where the surface
    /// folds.
    fn close_small_holes(&mut self, progress: &Progress<'_>) -> Result<()> {
        let mut pace = Pace::new(progress);
        for from in 0..self.complex.points.len() as u32 {
            pace.after(1)?;
            let mut hole = vec![from];
            while let Some(next) = self.border.next(hole[hole.len() - 1]).filter(|_| hole.len() < 5) {
                hole.push(next);
            }
            let facets = match hole[..] {
                [a, b, c, d, _] if d == a => vec![[[b, a, c]; 2]],
                [a, b, c, d, e] if e == a => vec![[[b, a, c], [d, c, a]], [[c, b, d], [a, d, b]]],
                _ => continue,
            };
            let length = |edge: [u32; 2]| {
                let [a, b] = edge.map(|vertex| self.complex.points[vertex as usize]);
                a.distance(b)
            };
            let longest = hole.windows(2).map(|edge| length([edge[0], edge[1]])).fold(0.0, f64::max);
            let diagonal = |[[_, a, c], _]: &[[u32; 3]; 2]| length([*a, *c]);
            // Facets of the hole's own corners beside it: then it is the other side of a part that small.
            let is_alone = hole.windows(2).any(|edge| {
                let inside = self.edges.get(&[edge[0], edge[1]]);
                inside.is_some_and(|&t| self.triangles[t as usize].iter().all(|vertex| hole.contains(vertex)))
            });
            let fits = |pair: &[[u32; 3]; 2]| {
                // Between samples no farther apart than some that the surface joins already, however dense they are.
                let is_trusted = diagonal(pair) <= longest;
                let is_free =
                    |[a, b, c]: [u32; 3]| ![[a, b], [b, c], [c, a]].iter().any(|edge| self.edges.contains_key(edge));
                !is_alone && is_trusted && pair.iter().all(|&facet| is_free(facet))
            };
            let mut facets = facets;
            facets.sort_by(|a, b| diagonal(a).total_cmp(&diagonal(b)));
            if let Some([first, second]) = facets.into_iter().find(fits) {
                self.add(first, u32::MAX);
                self.border.attach(first);
                if second != first {
                    self.add(second, u32::MAX);
                    self.border.attach(second);
                }
            }
        }
        Ok(())
    }

    /// The facets on which all agree, in parts joined over edges with two of them, oriented, each vertex with one fan; the
    /// largest part first.
    fn parts(&mut self, progress: &Progress<'_>) -> Result<Vec<Part>> {
        let mut agreed: Vec<([u32; 3], u32)> = Vec::new();
        let mut pace = Pace::new(progress);
        for choice in self.choices.iter().filter(|choice| choice.is_agreed()) {
            pace.after(COSTLY)?;
            if self.complex.perimeter(choice.vertices) <= (self.allowed)(choice.vertices) {
                agreed.push((choice.vertices, choice.cell));
            }
        }
        let mut parts = oriented_parts(&agreed, progress)?;
        let complex = self.complex;
        let mut all: Vec<[u32; 3]> = parts.iter().flatten().map(|seed| seed.0).collect();
        if keep_largest(&mut all, complex.points.len(), |triangle| complex.perimeter(triangle), progress)? > 0 {
            // In the order they were in.
            let mut kept = all.into_iter().peekable();
            agreed = Vec::with_capacity(kept.len());
            for seed in parts.into_iter().flatten() {
                if kept.next_if_eq(&seed.0).is_some() {
                    agreed.push(seed);
                }
            }
            parts = oriented_parts(&agreed, progress)?;
        }
        parts.sort_by_key(|part| Reverse(part.len()));
        Ok(parts)
    }

    /// Enters a triangle; its edges are free.
    fn add(&mut self, [a, b, c]: [u32; 3], cell: u32) {
        for edge in [[a, b], [b, c], [c, a]] {
            self.edges.insert(edge, self.triangles.len() as u32);
        }
        self.triangles.push([a, b, c]);
        self.cells.push(cell);
    }

    /// Grows from the triangles from `first` on until nothing fits.
    fn run(&mut self, first: usize, progress: &Progress<'_>) -> Result<()> {
        self.patience = Patience::Strict;
        loop {
            let before = self.triangles.len();
            for triangle in first..before {
                let [a, b, c] = self.triangles[triangle];
                for edge in [[a, b], [b, c], [c, a]] {
                    self.enqueue(edge);
                }
                if triangle % 256 == 0 {
                    progress.check()?;
                }
            }
            self.exhaust(progress)?;
            self.patience = match (self.triangles.len() > before, self.patience) {
                (true, _) => Patience::Strict,
                (false, Patience::Strict) => Patience::AnyTwin,
                (false, Patience::AnyTwin) => Patience::NextBest,
                (false, Patience::NextBest) => return Ok(()),
            };
        }
    }

    fn exhaust(&mut self, progress: &Progress<'_>) -> Result<()> {
        while let Some(Reverse(Candidate { edge: [from, to], apex, cell, .. })) = self.queue.pop() {
            progress.check()?;
            if !self.border.has([from, to]) {
                continue;
            }
            let triangle = [to, from, apex];
            match self.fit(triangle) {
                Fit::Alone => {
                    self.add(triangle, cell);
                    self.border.attach(triangle);
                }
                Fit::WithTwin(twin, twin_cell) => {
                    self.add(triangle, cell);
                    self.add(twin, twin_cell);
                    self.border.glue(triangle, twin);
                }
                Fit::Waits if self.patience < Patience::NextBest => continue,
                Fit::No | Fit::Waits => {
                    self.enqueue([from, to]);
                    continue;
                }
            }
            for vertex in triangle {
                if let Some(next) = self.border.next(vertex) {
                    self.enqueue([vertex, next]);
                }
            }
        }
        Ok(())
    }

    /// Whether a triangle over the border's edge from `from` to `to` fits.
    fn fit(&mut self, triangle: [u32; 3]) -> Fit {
        let [to, from, apex] = triangle;
        if [[from, apex], [apex, to]].iter().any(|edge| self.edges.contains_key(edge)) {
            return Fit::No;
        }
        if !self.border.is_used(apex) || self.border.has([apex, from]) || self.border.has([to, apex]) {
            return Fit::Alone;
        }
        let (Some(next), Some(previous)) = (self.border.next(apex), self.border.previous(apex)) else {
            return Fit::No;
        };
        let mut best: Option<(Rank, [u32; 3], u32)> = None;
        // The facet between this one and the border's edge after the apex, or before it.
        for (edge, end) in [([apex, next], from), ([previous, apex], to)] {
            let third = if edge[0] == apex { [from, next] } else { [previous, to] };
            if self.edges.contains_key(&third) || third[0] == third[1] {
                continue;
            }
            let Some(twin) = self.twin(edge, end) else { continue };
            if best.is_none_or(|best| twin.rank < best.0) {
                best = Some((twin.rank, [edge[1], edge[0], end], twin.cell));
            }
        }
        best.map_or(Fit::Waits, |(_, twin, cell)| Fit::WithTwin(twin, cell))
    }

    /// The facet at a border's edge that ends at `apex`, if there is one that may join.
    fn twin(&mut self, edge: [u32; 2], apex: u32) -> Option<Candidate> {
        let is_strict = self.patience == Patience::Strict;
        let mut twin: Option<Candidate> = None;
        let mut best: Option<Candidate> = None;
        self.around(edge, |front, candidate| {
            if candidate.apex == apex {
                twin = Some(candidate);
            }
            if is_strict && best.is_none_or(|best| candidate < best) && front.is_possible(candidate) {
                best = Some(candidate);
            }
        });
        twin.filter(|twin| !is_strict || best.is_none_or(|best| best.apex == twin.apex))
    }

    /// Whether a facet's edges are free and its apex is not inside the surface.
    fn is_possible(&self, candidate: Candidate) -> bool {
        let Candidate { edge: [from, to], apex, .. } = candidate;
        (!self.border.is_used(apex) || self.border.next(apex).is_some())
            && ![[from, apex], [apex, to]].iter().any(|edge| self.edges.contains_key(edge))
    }

    /// Queues the best facet that could continue the surface over an edge of the border, if there is one.
    fn enqueue(&mut self, edge: [u32; 2]) {
        if !self.border.has(edge) {
            return;
        }
        let is_last = self.patience == Patience::NextBest;
        let mut best: Option<Candidate> = None;
        self.around(edge, |front, candidate| {
            if best.is_none_or(|best| candidate < best)
                && front.is_possible(candidate)
                && !(is_last && {
                    let [from, to] = candidate.edge;
                    matches!(front.fit([to, from, candidate.apex]), Fit::No | Fit::Waits)
                })
            {
                best = Some(candidate);
            }
        });
        if let Some(best) = best {
            self.queue.push(Reverse(best));
        }
    }

    /// Whether a facet is not too large, by a stricter measure where none of its vertices chose it.
    fn is_trusted(&mut self, facet: [u32; 3]) -> bool {
        let mut vertices = facet;
        vertices.sort_unstable();
        let is_chosen = self.choices.binary_search_by(|choice| choice.vertices.cmp(&vertices)).is_ok();
        let share = if is_chosen { 1.0 } else { STRANGER };
        self.complex.perimeter(facet) <= share * (self.allowed)(facet)
    }

    /// Looks at all facets with an edge of the border that are neither too large nor too sharply bent.
    fn around(&mut self, edge: [u32; 2], mut look: impl FnMut(&mut Self, Candidate)) {
        let triangle = self.edges[&edge] as usize;
        let opposite = self.triangles[triangle].into_iter().find(|v| !edge.contains(v)).expect("a third vertex");
        let start = self.cells[triangle];
        let complex = self.complex;
        let [a, b, c] = [edge[0], edge[1], opposite].map(|v| complex.points[v as usize]);
        let before = (b - a).cross(c - a).normalize_or_zero();
        // Around the edge, through the facet that the walk came to a cell by.
        let vertices = complex.vertices(start);
        let mut here = start;
        let mut apex = vertices.into_iter().find(|v| !edge.contains(v)).expect("two other vertices");
        loop {
            // Leaves `here` through the facet of the edge and `apex`.
            let slot = (0..4)
                .find(|&slot| complex.vertices(here)[slot] != apex && !edge.contains(&complex.vertices(here)[slot]))
                .expect("two other vertices");
            let beyond = complex.neighbour(here, slot);
            if apex != opposite && apex != INFINITE {
                let after = (a - b).cross(complex.points[apex as usize] - b).normalize_or_zero();
                let bend = before.dot(after);
                let facet = [edge[0], edge[1], apex];
                if bend >= SHARPEST && self.is_trusted(facet) {
                    let rank = if bend >= SMOOTH {
                        (false, self.balls.clearance(complex, here, slot).to_bits())
                    } else {
                        (true, ((1.0 - bend) as f32).to_bits())
                    };
                    look(self, Candidate { rank, edge, apex, cell: here });
                }
            }
            let next = complex.vertices(beyond).into_iter().find(|v| *v != apex && !edge.contains(v));
            apex = next.expect("two other vertices");
            here = beyond;
            if here == start {
                return;
            }
        }
    }
}

/// Facets in parts joined over edges with two of them, oriented.
fn oriented_parts(facets: &[([u32; 3], u32)], progress: &Progress<'_>) -> Result<Vec<Part>> {
    let mut pace = Pace::new(progress);
    let mut at_edge: FxHashMap<[u32; 2], [u32; 3]> = FxHashMap::default();
    for (i, &(facet, _)) in facets.iter().enumerate() {
        pace.after(8)?;
        let [a, b, c] = facet;
        for edge in [[a, b], [b, c], [c, a]] {
            let entry = at_edge.entry([edge[0].min(edge[1]), edge[0].max(edge[1])]).or_insert([0, u32::MAX, u32::MAX]);
            entry[0] += 1;
            let count = entry[0] as usize;
            if let Some(place) = entry.get_mut(count) {
                *place = i as u32;
            }
        }
    }
    let mut parts = Vec::new();
    let mut turned: Vec<Option<[u32; 3]>> = vec![None; facets.len()];
    for first in 0..facets.len() {
        if turned[first].is_some() {
            continue;
        }
        turned[first] = Some(facets[first].0);
        let mut part = vec![first];
        let mut next = 0;
        while next < part.len() {
            pace.after(8)?;
            let here = part[next];
            next += 1;
            let [a, b, c] = turned[here].expect("turned when it was reached");
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let [count, x, y] = at_edge[&[from.min(to), from.max(to)]];
                let other = (if x as usize == here { y } else { x }) as usize;
                if count == 2 && turned[other].is_none() {
                    let apex = facets[other].0.into_iter().find(|&v| v != from && v != to).expect("a third vertex");
                    turned[other] = Some([to, from, apex]);
                    part.push(other);
                }
            }
        }
        let seed = |i: usize| (turned[i].expect("turned when it was reached"), facets[i].1);
        parts.push(part.into_iter().map(seed).collect());
    }
    Ok(parts)
}
