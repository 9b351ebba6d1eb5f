//! Open surfaces, continued: of the facets with an edge of the border the best. \[CSD04\]

use super::grow::{Candidate, Front, Rank};
use super::hinge::{Around, Hinge};
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

    /// The hinge by which facets over an edge of the border are measured, and the first of them.
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
        // A facet that closes a hole of three edges is welcome however it is bent: facets cross nothing.
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
