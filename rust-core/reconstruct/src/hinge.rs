//! The facets with an edge of the border of an open surface, one after the other.

use std::ops::BitXor;

use glam::DVec3;

use super::complex::{Complex, place_in};

/// An edge of the border with the triangle beside it.
pub(super) struct Hinge {
    pub(super) edge: [u32; 2],
    /// The triangle's third vertex.
    pub(super) opposite: u32,
    pub(super) from: DVec3,
    pub(super) to: DVec3,
    /// The triangle's.
    pub(super) normal: DVec3,
}

/// Least radius of a ball through two samples, by their distance: half, less what rounding takes.
const LEAST: f64 = 0.499;

impl Hinge {
    /// Least clearance of the facet that ends at a vertex.
    pub(super) fn least(&self, complex: Complex<'_>, apex: u32) -> f32 {
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
    pub(super) apex: u32,
}

impl Around {
    pub(super) fn new(complex: Complex<'_>, edge: [u32; 2], cell: u32) -> Self {
        let vertices = complex.vertices(cell);
        let ends = edge[0] ^ edge[1];
        let apex = vertices.into_iter().find(|v| !edge.contains(v)).expect("two other vertices");
        let slot = place_in(vertices, vertices.into_iter().fold(ends ^ apex, BitXor::bitxor));
        Around { ends, start: cell, cell, slot, apex }
    }

    /// Goes on through the facet. False once all were seen.
    pub(super) fn turn(&mut self, complex: Complex<'_>) -> bool {
        self.cell = complex.neighbour(self.cell, self.slot);
        let vertices = complex.vertices(self.cell);
        self.slot = place_in(vertices, self.apex);
        self.apex = vertices.into_iter().fold(self.ends ^ self.apex, BitXor::bitxor);
        self.cell != self.start
    }
}
