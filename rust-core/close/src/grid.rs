//! The box of nodes on which closing computes: cubes of one size, x fastest.

use glam::DVec3;

/// Nodes along each axis plus one are a multiple of this, so that each coarser grid has the same outer bound.
const MULTIPLE: usize = 8;

/// A box of nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Place of the first node.
    pub origin: DVec3,
    /// Distance of neighbouring nodes.
    pub cell: f64,
    /// Nodes along x, y and z.
    pub counts: [usize; 3],
}

impl Grid {
    /// Covers a box with `margin` around it.
    pub fn around(lo: DVec3, hi: DVec3, cell: f64, margin: f64) -> Self {
        let size = hi - lo + 2.0 * margin;
        let counts = size.to_array().map(|s| ((s / cell).ceil() as usize + 2).div_ceil(MULTIPLE) * MULTIPLE - 1);
        let spans = DVec3::from(counts.map(|n| (n - 1) as f64 * cell));
        Grid { origin: 0.5 * (lo + hi) - 0.5 * spans, cell, counts }
    }

    /// Number of nodes.
    #[allow(clippy::len_without_is_empty, reason = "a grid has nodes")]
    pub fn len(&self) -> usize {
        self.counts.iter().product()
    }

    /// Steps of the index along x, y and z.
    pub fn strides(&self) -> [usize; 3] {
        [1, self.counts[0], self.counts[0] * self.counts[1]]
    }

    /// Index of a node.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        i + self.counts[0] * (j + self.counts[1] * k)
    }

    /// Node of an index.
    pub fn node(&self, index: usize) -> [usize; 3] {
        let rest = index / self.counts[0];
        [index % self.counts[0], rest % self.counts[1], rest / self.counts[1]]
    }

    /// Place of a node.
    pub fn place(&self, index: usize) -> DVec3 {
        self.origin + self.cell * DVec3::from(self.node(index).map(|i| i as f64))
    }

    /// Whether a node lies on the outside of the box.
    pub fn is_outermost(&self, index: usize) -> bool {
        self.node(index).iter().zip(self.counts).any(|(&i, n)| i == 0 || i + 1 == n)
    }

    /// The cell that a place lies in, by its first node, and the place in it, 0 to 1 along each axis. It is clamped to the box.
    pub fn cell_of(&self, place: DVec3) -> (usize, [f64; 3]) {
        let at = ((place - self.origin) / self.cell).to_array();
        let mut fraction = [0.0; 3];
        let mut first = [0; 3];
        for axis in 0..3 {
            let x = at[axis].clamp(0.0, (self.counts[axis] - 1) as f64);
            first[axis] = (x as usize).min(self.counts[axis] - 2);
            fraction[axis] = x - first[axis] as f64;
        }
        (self.index(first), fraction)
    }

    /// The eight corners of a cell by its first node, x fastest.
    pub fn cell(&self, first: usize) -> [usize; 8] {
        let [x, y, z] = self.strides();
        std::array::from_fn(|corner| first + (corner & 1) * x + (corner >> 1 & 1) * y + (corner >> 2) * z)
    }

    /// Weights of a cell's corners at a place in it.
    pub fn weights(fraction: [f64; 3]) -> [f64; 8] {
        let along = |axis: usize, far: bool| if far { fraction[axis] } else { 1.0 - fraction[axis] };
        std::array::from_fn(|corner| (0..3).map(|axis| along(axis, corner >> axis & 1 == 1)).product())
    }

    /// The eight corners of a cell by its first node, with the weights of a place in it.
    pub fn corners(&self, first: usize, fraction: [f64; 3]) -> [(usize, f64); 8] {
        let (nodes, weights) = (self.cell(first), Grid::weights(fraction));
        std::array::from_fn(|corner| (nodes[corner], weights[corner]))
    }

    /// Corners of all cells, x fastest.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 8]> {
        let [nx, ny, nz] = self.counts.map(|n| n - 1);
        let firsts = (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
        firsts.map(|first| self.cell(self.index(first)))
    }

    /// Along each axis, the cell of this grid that each node of another lies in, by its first node, and the place in it, 0 to 1. It is
    /// clamped to the box.
    pub fn cells_along(&self, other: &Grid) -> [Vec<(u32, f64)>; 3] {
        std::array::from_fn(|axis| {
            let offset = (other.origin[axis] - self.origin[axis]) / self.cell;
            let last = self.counts[axis] - 1;
            let cell = |node: usize| {
                let x = (offset + node as f64 * other.cell / self.cell).clamp(0.0, last as f64);
                let first = (x as usize).min(last - 1);
                (first as u32, x - first as f64)
            };
            (0..other.counts[axis]).map(cell).collect()
        })
    }
}
