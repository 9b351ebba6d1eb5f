//! The nodes of a grid that a field is computed on: all of a coarse one, of a fine one those around openings.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::memory;
use base::progress::Progress;

use super::grid::Grid;
use super::rows::{NONE, Rows};

/// Of a node with its values, and of one around an opening at the peak of a solve. Measured.
const BYTES_A_NODE: f64 = 60.0;
const BYTES_A_NODE_SOLVED: f64 = 110.0;

/// Nodes by rising index in their grid.
pub struct Nodes {
    pub grid: Grid,
    rows: Rows,
    /// Numbers of the nodes beside each: -x, +x, -y, +y, -z, +z. [`NONE`] where they are no part.
    neighbours: Vec<[u32; 6]>,
}

impl Nodes {
    /// All of a grid.
    ///
    /// # Errors
    /// [`base::Error::OutOfMemory`].
    pub fn all(grid: Grid) -> Result<Self> {
        memory::expect_each(grid.len(), BYTES_A_NODE, 0.0, "closing", "nodes of the fill's grid")?;
        let places = (0..grid.len()).map(|node| grid.node(node).map(|i| i as u32)).collect();
        Ok(Nodes::of(grid, places))
    }

    fn of(grid: Grid, places: Vec<[u32; 3]>) -> Self {
        let rows = Rows::new(grid.counts.map(|n| n as u32), places);
        Nodes { grid, neighbours: rows.neighbours(), rows }
    }

    /// The nodes of a finer grid in the cells at marked nodes of this one.
    ///
    /// # Errors
    /// [`base::Error::OutOfMemory`]. [`base::Error::Cancelled`].
    pub fn finer(&self, marked: &[bool], grid: Grid, progress: &Progress<'_>) -> Result<Self> {
        let along = self.grid.cells_along(&grid);
        let first = |axis: usize, cell: u32| along[axis].partition_point(|own| own.0 < cell) as u32;
        let mut places = Vec::new();
        for (number, &place) in self.rows.places().iter().enumerate() {
            if number % 1024 == 0 {
                progress.check()?;
            }
            if !self.cell(number).is_some_and(|corners| corners.iter().any(|&corner| marked[corner])) {
                continue;
            }
            let [x, y, z] = [0, 1, 2].map(|axis| first(axis, place[axis])..first(axis, place[axis] + 1));
            for k in z {
                places.extend(y.clone().flat_map(|j| x.clone().map(move |i| [k, j, i])));
            }
        }
        memory::expect_each(places.len(), BYTES_A_NODE_SOLVED, 0.0, "closing", "nodes around openings")?;
        progress.sort(&mut places, &|a, b| a.cmp(b))?;
        Ok(Nodes::of(grid, places.into_iter().map(|[k, j, i]| [i, j, k]).collect()))
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.neighbours.len()
    }

    /// Place of a node in the world.
    pub fn place(&self, number: usize) -> DVec3 {
        self.grid.origin + self.grid.cell * DVec3::from(self.rows.places()[number].map(f64::from))
    }

    /// Node of a number, in the grid.
    pub fn node(&self, number: usize) -> [u32; 3] {
        self.rows.places()[number]
    }

    /// Numbers of the nodes of a row along x.
    pub fn row(&self, j: usize, k: usize) -> std::ops::Range<usize> {
        self.rows.row(j as u32, k as u32)
    }

    /// Number of the nodes on each side, or [`NONE`].
    pub fn sides(&self, number: usize) -> &[u32; 6] {
        &self.neighbours[number]
    }

    /// Numbers of the nodes beside one.
    pub fn beside(&self, number: usize) -> impl Iterator<Item = usize> {
        self.neighbours[number].into_iter().filter(|&other| other != NONE).map(|other| other as usize)
    }

    /// Whether all six nodes beside one are there.
    pub fn is_within(&self, number: usize) -> bool {
        !self.neighbours[number].contains(&NONE)
    }

    /// Whether a node lies on the outside of the grid.
    pub fn is_outermost(&self, number: usize) -> bool {
        self.node(number).iter().zip(self.grid.counts).any(|(&i, n)| i == 0 || i as usize + 1 == n)
    }

    /// The corners of the cell that begins at a node, x fastest, if all of them are there.
    pub fn cell(&self, number: usize) -> Option<[usize; 8]> {
        let mut corners = [number; 8];
        for corner in 1..8_usize {
            let axis = corner.ilog2() as usize;
            let from = corners[corner & !(1 << axis)];
            corners[corner] = Some(self.neighbours[from][2 * axis + 1]).filter(|&next| next != NONE)? as usize;
        }
        Some(corners)
    }

    /// Corners of all cells of which each corner is there.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 8]> {
        (0..self.len()).filter_map(|number| self.cell(number))
    }

    /// The nodes that are at most some steps along each axis away from marked ones, over nodes that are there.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn grown(&self, mut marked: Vec<bool>, steps: usize, progress: &Progress<'_>) -> Result<Vec<bool>> {
        for axis in 0..3 {
            for _ in 0..steps {
                progress.check()?;
                let sides = |n: &[u32; 6]| [n[2 * axis], n[2 * axis + 1]];
                let is_beside = |n: &[u32; 6]| sides(n).iter().any(|&n| n != NONE && marked[n as usize]);
                marked = self.neighbours.par_iter().zip(&marked).map(|(n, &own)| own || is_beside(n)).collect();
            }
        }
        Ok(marked)
    }

    /// A field on the nodes at the nodes of others, linear along each axis. Beyond the box it is that of the nearest place in the box.
    /// Their cells must be there.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn resampled(&self, field: &[f64], to: &Nodes, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let along = self.grid.cells_along(&to.grid);
        let mut values = vec![0.0; to.len()];
        values.par_chunks_mut(1 << 12).enumerate().try_for_each(|(chunk, values)| {
            progress.check()?;
            let (mut known, mut corners) = ([NONE; 3], [0; 8]);
            for (i, value) in values.iter_mut().enumerate() {
                let node = to.node((chunk << 12) + i);
                let cell: [(u32, f64); 3] = std::array::from_fn(|axis| along[axis][node[axis] as usize]);
                if known != cell.map(|along| along.0) {
                    known = cell.map(|along| along.0);
                    corners = self.cell(self.rows.find(known) as usize).expect("the cells of finer nodes are there");
                }
                let weights = Grid::weights(cell.map(|along| along.1));
                *value = corners.iter().zip(weights).map(|(&node, weight)| weight * field[node]).sum();
            }
            Ok(())
        })?;
        Ok(values)
    }
}
