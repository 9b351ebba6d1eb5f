//! Open surfaces: the surface grows over the facets of the tetrahedralization. \[CSD04\]
//!
//! It begins at a facet that is certain, one between two balls much larger than it is. At an edge of the border, of all
//! facets with that edge the best continues the surface: among those that bend it little the one with the smallest empty
//! ball, else the one that bends it least. Always the best of all edges is taken next, and only if it is not larger than
//! the sampling around it allows. It may end
//!
//! * in a new sample,
//! * between two or three edges of the border, which closes an ear or a hole,
//! * at a sample elsewhere on the border. That alone would pinch the surface there, so it comes together with the facet
//!   that joins it to one of the border's edges at that sample, or waits.
//!
//! So every vertex has one fan of triangles and the surface is oriented, always. A facet that waits is tried again when nothing else is
//! left, first with any facet that joins it, then with the next best facet of its edge.
//!
//! A facet that ends at another loop of the border of the same part makes a handle, and is refused. Things scanned from one side have none,
//! but noise offers one at every crumpled place. `handles` finds those that the samples force.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::{FxHashMap, FxHashSet};

use super::balls::Balls;
use super::basins::TANGENT;
use super::border::Border;
use super::certain::{Certain, certain};
use super::complex::Complex;
use super::hinge::Around;
use super::lines::Lines;
use base::error::Result;
use base::progress::{Pace, Progress};

/// Of so many facets one is looked at first: nearly all parts are begun by one of these.
const FEW: u32 = 16;

/// Share of the samples that parts begun by certain facets must miss for others to begin some, too.
const MISSED: f64 = 0.01;

/// Rank of a facet at an edge, smaller is better: smooth ones by size, then the others by bend. The bits of that, and above them whether it
/// is bent.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Rank(u64);

impl Rank {
    pub(super) fn smooth(size: f32) -> Self {
        Rank(size.to_bits().into())
    }

    pub(super) fn bent(by: f32) -> Self {
        Rank(1 << 32 | u64::from(by.to_bits()))
    }

    fn is_smooth(self) -> bool {
        self.0 >> 32 == 0
    }
}

/// A facet that could continue the surface over the edge from `edge[0]` to `edge[1]`, with a cell that has it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Candidate {
    pub(super) rank: Rank,
    pub(super) edge: [u32; 2],
    pub(super) apex: u32,
    pub(super) cell: u32,
}

/// Rules for facets that would pinch the surface.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Patience {
    /// They wait until the facet that joins them is the best at its edge ...
    Strict,
    /// ... until there is one.
    AnyTwin,
    /// The next best facet goes before them.
    NextBest,
}

/// Whether a facet fits onto the border.
pub(super) enum Fit {
    No,
    Waits,
    Alone,
    /// With this facet beside it, and a cell that has it.
    WithTwin([u32; 3], u32),
    /// With another part turned over.
    Turned,
}

/// Facets that are not too large.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// Those that the sampling allows.
    Sampling,
    /// Between parts those so many times as large ...
    Times(u32),
    /// ... and those that continue their part smoothly, [`SMOOTHER`] times as large as that.
    Smooth(u32),
}

/// A gap that a surface crosses smoothly may be so many times as wide as others.
const SMOOTHER: u32 = 4;

/// A surface that grows.
pub(super) struct Front<'a, F> {
    pub(super) complex: Complex<'a>,
    pub(super) balls: &'a Balls,
    pub(super) lines: &'a Lines,
    /// Largest perimeter that the sampling around a facet allows.
    pub(super) allowed: F,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Of each cell, for each slot (bit) whether its facet is one of the triangles.
    used: Vec<u8>,
    pub(super) border: Border,
    /// The triangle beside each edge of the border, by the edge's first vertex: its third vertex, and a cell that has it.
    pub(super) beside: Vec<[u32; 2]>,
    queue: BinaryHeap<Reverse<Candidate>>,
    pub(super) patience: Patience,
    /// The part that each sample came to first.
    pub(super) part_of: Vec<u32>,
    /// Of each part one that it is joined with.
    pub(super) parts: Vec<u32>,
    /// Facets that would make a handle, by edge and apex.
    pub(super) refused: FxHashSet<([u32; 2], u32)>,
    pub(super) reach: Reach,
    /// While parts are joined, the triangles of each that is joined with no other or is the first of those that are.
    pub(super) members: FxHashMap<u32, Vec<u32>>,
    /// Facets for which a part was turned over since a triangle was added last, by edge and apex.
    pub(super) turned: FxHashSet<([u32; 2], u32)>,
    /// The facets with an edge and what their clearances are at least: kept and refilled, so that nothing is allocated for each edge.
    pub(super) ring: Vec<(f32, Around)>,
}

impl<'a, F: FnMut([u32; 3]) -> f64> Front<'a, F> {
    /// Grows a part from every certain facet that no other part came to, the most certain first.
    pub(super) fn grow(
        complex: Complex<'a>,
        balls: &'a Balls,
        lines: &'a Lines,
        allowed: F,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let count = complex.points.len();
        let mut front = Front {
            complex,
            balls,
            lines,
            allowed,
            triangles: Vec::with_capacity(2 * count),
            used: vec![0; complex.len()],
            border: Border::new(count),
            beside: vec![[u32::MAX; 2]; count],
            queue: BinaryHeap::new(),
            patience: Patience::Strict,
            part_of: vec![u32::MAX; count],
            parts: Vec::new(),
            refused: FxHashSet::default(),
            reach: Reach::Sampling,
            members: FxHashMap::default(),
            turned: FxHashSet::default(),
            ring: Vec::new(),
        };
        for (share, factor) in [(FEW, TANGENT), (1, TANGENT), (1, 0.0)] {
            // If opposite walls are nearer than their samples are to each other, few facets are certain or none.
            let is_missed: Vec<bool> = (0..count as u32).map(|v| !front.border.is_used(v)).collect();
            let missed = is_missed.iter().filter(|is| **is).count();
            if factor == 0.0 && (missed as f64) < MISSED * count as f64 {
                break;
            }
            let is_wanted = |v: u32| is_missed[v as usize];
            for certain in certain(complex, balls, factor, share, is_wanted, progress)? {
                front.grow_from(certain, progress)?;
            }
        }
        Ok(front)
    }

    /// Grows a part from a facet, unless it is too large or another part has one of its vertices.
    fn grow_from(&mut self, Certain { facet, cell, .. }: Certain, progress: &Progress<'_>) -> Result<()> {
        if facet.iter().any(|&vertex| self.border.is_used(vertex))
            || self.complex.perimeter(facet) > (self.allowed)(facet)
            || self.lines.is_jump(self.complex.points, facet)
        {
            return Ok(());
        }
        let (first, part) = (self.triangles.len(), self.parts.len() as u32);
        self.parts.push(part);
        facet.iter().for_each(|&vertex| self.part_of[vertex as usize] = part);
        self.place(facet, cell);
        self.border.enter(facet, |_| false);
        self.note(facet, cell);
        self.run(first, progress)
    }

    /// The first of the parts that a sample's part is joined with.
    pub(super) fn part(&mut self, vertex: u32) -> u32 {
        let mut part = self.part_of[vertex as usize];
        while self.parts[part as usize] != part {
            let up = self.parts[self.parts[part as usize] as usize];
            self.parts[part as usize] = up;
            part = up;
        }
        part
    }

    /// Enters a triangle.
    fn place(&mut self, triangle: [u32; 3], cell: u32) {
        let vertices = self.complex.vertices(cell);
        let slot = (0..4).find(|&slot| !triangle.contains(&vertices[slot])).expect("a facet of the cell");
        let beyond = self.complex.neighbour(cell, slot);
        self.used[cell as usize] |= 1 << slot;
        self.used[beyond as usize] |= 1 << self.complex.mirror(cell, slot);
        if !self.members.is_empty() {
            let part = self.part(triangle[0]);
            self.members.entry(part).or_default().push(self.triangles.len() as u32);
            self.turned.clear();
        }
        self.triangles.push(triangle);
    }

    /// Notes what lies beside those of a triangle's edges that are on the border.
    fn note(&mut self, [a, b, c]: [u32; 3], cell: u32) {
        for (edge, apex) in [([a, b], c), ([b, c], a), ([c, a], b)] {
            if self.border.has(edge) {
                self.beside[edge[0] as usize] = [apex, cell];
            }
        }
    }

    /// Grows from the triangles from `first` on until nothing fits.
    pub(super) fn run(&mut self, first: usize, progress: &Progress<'_>) -> Result<()> {
        self.patience = Patience::Strict;
        loop {
            let before = self.triangles.len();
            self.enqueue_from(first, progress)?;
            self.exhaust(progress)?;
            self.patience = match (self.triangles.len() > before, self.patience) {
                (true, _) => Patience::Strict,
                (false, Patience::Strict) => Patience::AnyTwin,
                (false, Patience::AnyTwin) => Patience::NextBest,
                (false, Patience::NextBest) => return Ok(()),
            };
        }
    }

    /// Queues the edges of the border beside the triangles from `first` on, in any order.
    fn enqueue_from(&mut self, first: usize, progress: &Progress<'_>) -> Result<()> {
        let mut pace = Pace::new(progress);
        if first == 0 {
            for from in 0..self.complex.points.len() as u32 {
                pace.after(1)?;
                if let Some(to) = self.border.next(from) {
                    self.enqueue([from, to]);
                }
            }
            return Ok(());
        }
        for triangle in first..self.triangles.len() {
            pace.after(1)?;
            let [a, b, c] = self.triangles[triangle];
            for edge in [[a, b], [b, c], [c, a]] {
                self.enqueue(edge);
            }
        }
        Ok(())
    }

    /// Takes what is queued until nothing is left.
    ///
    /// Theorem: it ends. Three numbers fall, as the digits of one number do: facets that are no triangles, facets that are not refused, and
    /// facets that may still turn a part over ([`Front::may_turn`]). A facet that is taken and becomes a triangle, is refused anew or turns
    /// a part makes one of them fall, and only those behind it may rise. Any other leaves the queue for the best facet at its edge that is
    /// possible, or for none. Unless a number has fallen meanwhile, that one makes one fall when it is taken, or leaves the queue for none.
    fn exhaust(&mut self, progress: &Progress<'_>) -> Result<()> {
        while let Some(Reverse(Candidate { edge: [from, to], apex, cell, .. })) = self.queue.pop() {
            progress.check()?;
            if !self.border.has([from, to]) {
                continue;
            }
            let triangle = [to, from, apex];
            match self.fit(triangle, cell) {
                Fit::Alone => {
                    self.attach(triangle, cell);
                    self.enqueue([from, apex]);
                    self.enqueue([apex, to]);
                }
                Fit::WithTwin(..) if self.part(from) == self.part(apex) && !self.is_same_loop(from, apex) => {
                    self.refused.insert(([from, to], apex));
                    self.enqueue_possible([from, to]);
                }
                Fit::WithTwin(twin, twin_cell) => self.glue(triangle, cell, twin, twin_cell),
                Fit::Turned => self.turn_for([from, to], apex),
                Fit::Waits if self.patience < Patience::NextBest => {}
                Fit::No | Fit::Waits => self.enqueue_possible([from, to]),
            }
        }
        Ok(())
    }

    /// Adds a triangle that fits alone.
    fn attach(&mut self, triangle: [u32; 3], cell: u32) {
        let [to, _, apex] = triangle;
        if !self.border.is_used(apex) {
            self.part_of[apex as usize] = self.part_of[to as usize];
        }
        self.place(triangle, cell);
        self.border.attach(triangle);
        self.note(triangle, cell);
    }

    /// Adds a triangle with its twin, and goes on around them.
    pub(super) fn glue(&mut self, triangle: [u32; 3], cell: u32, twin: [u32; 3], twin_cell: u32) {
        self.unite(triangle[0], triangle[2]);
        self.place(triangle, cell);
        self.place(twin, twin_cell);
        self.border.glue(triangle, twin);
        self.note(triangle, cell);
        self.note(twin, twin_cell);
        for vertex in triangle {
            if let Some(next) = self.border.next(vertex) {
                self.enqueue([vertex, next]);
            }
        }
    }

    /// Whether two vertices of the border are on one loop of it. Takes as long as it is from the one to the other, or
    /// around the shorter loop.
    fn is_same_loop(&self, a: u32, b: u32) -> bool {
        let next = |vertex| self.border.next(vertex).expect("on the border");
        let (mut from_a, mut from_b) = (next(a), next(b));
        loop {
            if from_a == a || from_a == b {
                return from_a == b;
            }
            if from_b == a || from_b == b {
                return from_b == a;
            }
            (from_a, from_b) = (next(from_a), next(from_b));
        }
    }

    /// Whether a directed edge of a cell has no triangle on its side, and at most one on the other.
    fn is_free(&self, [from, to]: [u32; 2], cell: u32) -> bool {
        if !self.border.is_used(from) || !self.border.is_used(to) || self.border.has([to, from]) {
            return true;
        }
        if self.border.has([from, to]) || self.border.is_inside(from) || self.border.is_inside(to) {
            return false;
        }
        let mut around = Around::new(self.complex, [from, to], cell);
        loop {
            if self.used[around.cell as usize] >> around.slot & 1 == 1 {
                return false;
            }
            if !around.turn(self.complex) {
                return true;
            }
        }
    }

    /// Whether a triangle over the border's edge from `from` to `to` fits.
    pub(super) fn fit(&mut self, triangle: [u32; 3], cell: u32) -> Fit {
        let [to, from, apex] = triangle;
        if !self.is_free([from, apex], cell) || !self.is_free([apex, to], cell) {
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
            let Some(twin) = self.twin(edge, end).filter(|twin| third[0] != third[1] && self.is_free(third, twin.cell))
            else {
                continue;
            };
            if best.is_none_or(|best| twin.rank < best.0) {
                best = Some((twin.rank, [edge[1], edge[0], end], twin.cell));
            }
        }
        if self.may_turn([from, to], apex) {
            for (edge, end) in [([previous, apex], from), ([apex, next], to)] {
                if self.twin(edge, end).is_some_and(|twin| best.is_none_or(|best| twin.rank < best.0)) {
                    return Fit::Turned;
                }
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
            if candidate.apex == apex && front.is_trusted(candidate) {
                twin = Some(candidate);
            }
            if is_strict
                && best.is_none_or(|best| candidate < best)
                && front.is_possible(candidate)
                && front.is_trusted(candidate)
            {
                best = Some(candidate);
            }
        });
        twin.filter(|twin| !is_strict || best.is_none_or(|best| best.apex == twin.apex))
    }

    /// Whether a facet's edges are free and it is not one that was refused.
    fn is_possible(&self, candidate: Candidate) -> bool {
        let Candidate { edge: [from, to], apex, cell, .. } = candidate;
        !self.border.is_used(apex)
            || self.is_free([from, apex], cell)
                && self.is_free([apex, to], cell)
                && !self.refused.contains(&(candidate.edge, apex))
    }

    /// Queues the best facet that could continue the surface over an edge of the border, if there is one. Whether it is
    /// possible turns out when its turn comes: mostly it is.
    pub(super) fn enqueue(&mut self, edge: [u32; 2]) {
        if self.patience == Patience::NextBest {
            self.enqueue_possible(edge);
        } else {
            self.enqueue_if(edge, |_, _| true);
        }
    }

    /// Like [`Front::enqueue`] for the best that is possible. With the least patience, that fits at once.
    fn enqueue_possible(&mut self, edge: [u32; 2]) {
        let is_last = self.patience == Patience::NextBest;
        self.enqueue_if(edge, |front, candidate| {
            let Candidate { edge: [from, to], apex, cell, .. } = candidate;
            front.is_possible(candidate)
                && !(is_last && matches!(front.fit([to, from, apex], cell), Fit::No | Fit::Waits))
        });
    }

    fn enqueue_if(&mut self, edge: [u32; 2], may_go: impl Fn(&mut Self, Candidate) -> bool) {
        if !self.border.has(edge) {
            return;
        }
        if let Some(best) = self.best(edge, may_go) {
            self.queue.push(Reverse(best));
        }
    }

    /// Whether a facet is not too large, spans no jump and, if it joins parts, has nothing seen behind it.
    pub(super) fn is_trusted(&mut self, candidate: Candidate) -> bool {
        let facet = [candidate.edge[0], candidate.edge[1], candidate.apex];
        if self.reach != Reach::Sampling {
            let parts = facet.map(|vertex| self.part_of[vertex as usize]);
            if parts.contains(&u32::MAX) || parts == [parts[0]; 3] {
                return false;
            }
        }
        let times = match self.reach {
            Reach::Sampling => 1,
            Reach::Smooth(times) if candidate.rank.is_smooth() => SMOOTHER * times,
            Reach::Times(times) | Reach::Smooth(times) => times,
        };
        self.complex.perimeter(facet) <= f64::from(times) * (self.allowed)(facet)
            && !self.lines.is_jump(self.complex.points, facet)
            && !(self.reach != Reach::Sampling && self.lines.pass(self.complex.points, facet))
    }
}
