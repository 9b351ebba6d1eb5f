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

    /// The six neighbours of a node, `None` beyond the box: -x, +x, -y, +y, -z, +z.
    pub fn neighbours(&self, index: usize) -> [Option<usize>; 6] {
        let (node, strides) = (self.node(index), self.strides());
        std::array::from_fn(|side| {
            let axis = side / 2;
            if side % 2 == 0 {
                (node[axis] > 0).then(|| index - strides[axis])
            } else {
                (node[axis] + 1 < self.counts[axis]).then(|| index + strides[axis])
            }
        })
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

    /// The eight corners of a cell by its first node, with the weights of a place in it.
    pub fn corners(&self, first: usize, fraction: [f64; 3]) -> [(usize, f64); 8] {
        let strides = self.strides();
        std::array::from_fn(|corner| {
            let mut place = (first, 1.0);
            for axis in 0..3 {
                let far = corner >> axis & 1 == 1;
                place.0 += if far { strides[axis] } else { 0 };
                place.1 *= if far { fraction[axis] } else { 1.0 - fraction[axis] };
            }
            place
        })
    }

    /// The value of a field at a place, linear along each axis.
    pub fn sample(&self, field: &[f64], place: DVec3) -> f64 {
        let (first, fraction) = self.cell_of(place);
        self.corners(first, fraction).iter().map(|&(node, weight)| weight * field[node]).sum()
    }
}
