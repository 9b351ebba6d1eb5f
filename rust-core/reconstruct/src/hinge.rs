//! Open surfaces, continued: the facets with an edge of the border, and which is the best. \[CSD04\]

use std::ops::BitXor;

use glam::DVec3;

use super::complex::{Complex, place_in};
use super::grow::{Candidate, Front, Rank};
use geom::delaunay3::INFINITE;

/// Cosine of the bend up to which the size of a facet decides: 30 degrees, as in \[CSD04\].
const SMOOTH: f64 = 0.866;
/// Cosine of the sharpest bend: 150 degrees.
const SHARPEST: f64 = -0.866;

impl<F: FnMut([u32; 3]) -> f64> Front<'_, F> {
    /// Looks at all facets with an edge of the border that end at no vertex inside the surface and are not bent too sharply.
    pub(super) fn around(&mut self, edge: [u32; 2], mut look: impl FnMut(&mut Self, Candidate)) {
        let (hinge, mut around) = self.hinge(edge);
        loop {
            if self.may_end_at(around.apex, &hinge)
                && let Some(candidate) = self.candidate(&hinge, &around, hinge.least(self.complex, around.apex))
            {
                look(self, candidate);
            }
            if !around.turn(self.complex) {
                return;
            }
        }
    }

    /// The best facet over an edge of the border that is trusted and `may_go`.
    pub(super) fn best(&mut self, edge: [u32; 2], may_go: impl Fn(&mut Self, Candidate) -> bool) -> Option<Candidate> {
        let (hinge, mut around) = self.hinge(edge);
        let mut ring = std::mem::take(&mut self.ring);
        loop {
            if self.may_end_at(around.apex, &hinge) {
                ring.push((hinge.least(self.complex, around.apex), around));
            }
            if !around.turn(self.complex) {
                break;
            }
        }
        // The one that can be smallest first: mostly it is the best, and nothing else is asked of the others.
        if let Some(first) = (0..ring.len()).min_by(|&i, &j| ring[i].0.total_cmp(&ring[j].0)) {
            ring.swap(0, first);
        }
        let mut best: Option<Candidate> = None;
        for (least, around) in ring.drain(..) {
            if best.is_some_and(|best| best.rank < Rank::smooth(least)) {
                continue;
            }
            if let Some(candidate) = self.candidate(&hinge, &around, least)
                && best.is_none_or(|best| candidate < best)
                && self.is_trusted(candidate)
                && may_go(self, candidate)
            {
                best = Some(candidate);
            }
        }
        self.ring = ring;
        best
    }

    /// What facets over an edge of the border are measured by, and the first of them.
    fn hinge(&self, edge: [u32; 2]) -> (Hinge, Around) {
        let [opposite, start] = self.beside[edge[0] as usize];
        let [from, to, third] = [edge[0], edge[1], opposite].map(|v| self.complex.points[v as usize]);
        let normal = (to - from).cross(third - from).normalize_or_zero();
        (Hinge { edge, opposite, from, to, normal }, Around::new(self.complex, edge, start))
    }

    /// Whether a facet over an edge may end at a vertex: neither at infinity nor inside the surface, nor the triangle that is there.
    fn may_end_at(&self, apex: u32, hinge: &Hinge) -> bool {
        apex != hinge.opposite && apex != INFINITE && !self.border.is_inside(apex)
    }

    /// The facet at hand, unless it is bent too sharply. `least`: see [`Hinge::least`].
    fn candidate(&self, hinge: &Hinge, &Around { cell, slot, apex, .. }: &Around, least: f32) -> Option<Candidate> {
        let edge = hinge.edge;
        let beyond = self.complex.points[apex as usize] - hinge.to;
        let bend = hinge.normal.dot((hinge.from - hinge.to).cross(beyond).normalize_or_zero());
        // What closes a hole of three edges is welcome however it is bent: facets cross nothing.
        if bend < SHARPEST && !(self.border.has([apex, edge[0]]) && self.border.has([edge[1], apex])) {
            return None;
        }
        let rank = if bend >= SMOOTH {
            Rank::smooth(self.balls.clearance(self.complex, cell, slot).max(least))
        } else {
            Rank::bent((1.0 - bend) as f32)
        };
        Some(Candidate { rank, edge, apex, cell })
    }
}

/// An edge of the border with the triangle beside it.
struct Hinge {
    edge: [u32; 2],
    /// The triangle's third vertex.
    opposite: u32,
    from: DVec3,
    to: DVec3,
    /// The triangle's.
    normal: DVec3,
}

/// What the radius of a ball through two samples is at least, by their distance: half, less what rounding takes.
const LEAST: f64 = 0.499;

impl Hinge {
    /// What the clearance of the facet that ends at a vertex is at least.
    fn least(&self, complex: Complex<'_>, apex: u32) -> f32 {
        let apex = complex.points[apex as usize];
        (LEAST * apex.distance_squared(self.from).max(apex.distance_squared(self.to)).sqrt()) as f32
    }
}

/// The facets with an edge, one after the other.
#[derive(Clone, Copy)]
pub(super) struct Around {
    /// The edge's two vertices, as numbers joined by exclusive or: with these and a third the fourth vertex of a cell is known.
    ends: u32,
    start: u32,
    /// A cell with the facet, its slot opposite to it, and the facet's third vertex.
    pub(super) cell: u32,
    pub(super) slot: usize,
    apex: u32,
}

impl Around {
    pub(super) fn new(complex: Complex<'_>, edge: [u32; 2], cell: u32) -> Self {
        let vertices = complex.vertices(cell);
        let ends = edge[0] ^ edge[1];
        let apex = vertices.into_iter().find(|v| !edge.contains(v)).expect("two other vertices");
        let slot = place_in(vertices, vertices.into_iter().fold(ends ^ apex, BitXor::bitxor));
        Around { ends, start: cell, cell, slot, apex }
    }

    /// Goes on through the facet; false once all were seen.
    pub(super) fn turn(&mut self, complex: Complex<'_>) -> bool {
        self.cell = complex.neighbour(self.cell, self.slot);
        let vertices = complex.vertices(self.cell);
        self.slot = place_in(vertices, self.apex);
        self.apex = vertices.into_iter().fold(self.ends ^ self.apex, BitXor::bitxor);
        self.cell != self.start
    }
}
