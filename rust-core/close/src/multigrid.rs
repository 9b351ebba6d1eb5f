//! The Laplacian on any set of nodes of a grid, approximately inverted by one V-cycle: what conjugate gradients are preconditioned by.
//!
//! Outside of the set values are 0. A coarser level has the nodes at even places. Prolongation is linear, restriction its transpose.
//! Smoothing goes forward before and backward after the coarser level. So the cycle is a symmetric positive definite operator. \[BHM00,
//! chap. 3\]

use super::rows::{NONE, Rows};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Fewer nodes are smoothed often instead of made coarser.
const FEW: usize = 200;
const SWEEPS_OF_FEW: usize = 12;

/// The levels from fine to coarse.
pub struct Multigrid {
    levels: Vec<Level>,
}

struct Level {
    /// -x, +x, -y, +y, -z, +z.
    neighbours: Vec<[u32; 6]>,
    /// Energy of an edge, of the finest level's 1.
    scale: f64,
    /// Added to the Laplacian's diagonal.
    mass: Vec<f64>,
    /// Nodes of the next level and their weights: up to eight, then [`NONE`].
    parents: Vec<[(u32, f32); 8]>,
}

/// Room for one cycle.
pub struct Scratch {
    values: Vec<[Vec<f64>; 2]>,
}

impl Multigrid {
    /// Of nodes of a grid that has these counts, rising with x fastest. `mass` is added to the diagonal. About 150 bytes per node.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn new(
        counts: [usize; 3],
        nodes: impl Iterator<Item = [u32; 3]>,
        mass: Vec<f64>,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let mut levels: Vec<Level> = Vec::new();
        // Counted from 1, so that the first even place is the second node and the outer bound stays where it is.
        let mut counts = counts.map(|n| n as u32 + 2);
        let mut rows = Rows::new(counts, nodes.map(|node| node.map(|i| i + 1)).collect());
        let (mut mass, mut scale) = (mass, 1.0);
        let mut pace = Pace::new(progress);
        loop {
            progress.check()?;
            let (neighbours, places) = (rows.neighbours(), rows.places());
            let is_last = places.len() <= FEW || counts.iter().any(|&n| n < 7);
            let coarse: Vec<[u32; 3]> = match is_last {
                true => Vec::new(),
                false => places.iter().filter(|p| p.iter().all(|i| i % 2 == 0)).map(|p| p.map(|i| i / 2)).collect(),
            };
            if coarse.is_empty() {
                levels.push(Level { neighbours, scale, mass, parents: Vec::new() });
                return Ok(Multigrid { levels });
            }
            let coarse_counts = counts.map(|n| (n - 1).div_ceil(2) + 1);
            let mut coarse_mass = vec![0.0; coarse.len()];
            let coarse_rows = Rows::new(coarse_counts, coarse);
            let mut parents = Vec::with_capacity(places.len());
            for (&place, &mass) in places.iter().zip(&mass) {
                pace.after(1)?;
                let of_place = parents_among(&coarse_rows, place);
                for (parent, weight) in of_place {
                    if parent != NONE {
                        coarse_mass[parent as usize] += f64::from(weight) * mass;
                    }
                }
                parents.push(of_place);
            }
            levels.push(Level { neighbours, scale, mass, parents });
            (rows, counts, mass, scale) = (coarse_rows, coarse_counts, coarse_mass, 2.0 * scale);
        }
    }

    /// Neighbours of each node among the nodes.
    pub fn neighbours(&self) -> &[[u32; 6]] {
        &self.levels[0].neighbours
    }

    /// Room for [`Multigrid::cycle`].
    pub fn scratch(&self) -> Scratch {
        Scratch { values: self.levels.iter().map(|l| [0, 1].map(|_| vec![0.0; l.neighbours.len()])).collect() }
    }

    /// One V-cycle: `x` becomes approximately the inverse Laplacian of `right`. Checks the progress on each level.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn cycle(&self, right: &[f64], x: &mut [f64], scratch: &mut Scratch, progress: &Progress<'_>) -> Result<()> {
        scratch.values[0][0].copy_from_slice(right);
        self.descend(0, &mut scratch.values, progress)?;
        x.copy_from_slice(&scratch.values[0][1]);
        Ok(())
    }

    fn descend(&self, depth: usize, values: &mut [[Vec<f64>; 2]], progress: &Progress<'_>) -> Result<()> {
        progress.check()?;
        let level = &self.levels[depth];
        let (own, coarser) = values.split_at_mut(1);
        let [right, x] = &mut own[0];
        if level.parents.is_empty() {
            x.fill(0.0);
            for _ in 0..SWEEPS_OF_FEW {
                level.forward(right, x);
                level.backward(right, x);
            }
            return Ok(());
        }
        x.fill(0.0);
        level.forward(right, x);
        let coarse_right = &mut coarser[0][0];
        coarse_right.fill(0.0);
        for i in 0..x.len() {
            let residual = right[i] - level.apply_at(x, i);
            for &(parent, weight) in level.parents[i].iter().take_while(|parent| parent.0 != NONE) {
                coarse_right[parent as usize] += f64::from(weight) * residual;
            }
        }
        self.descend(depth + 1, coarser, progress)?;
        let coarse_x = &coarser[0][1];
        for i in 0..x.len() {
            for &(parent, weight) in level.parents[i].iter().take_while(|parent| parent.0 != NONE) {
                x[i] += f64::from(weight) * coarse_x[parent as usize];
            }
        }
        level.backward(right, x);
        progress.check()
    }
}

impl Level {
    fn sum_at(&self, x: &[f64], i: usize) -> f64 {
        let mut sum = 0.0;
        for neighbour in self.neighbours[i] {
            if neighbour != NONE {
                sum += x[neighbour as usize];
            }
        }
        sum
    }

    fn apply_at(&self, x: &[f64], i: usize) -> f64 {
        self.scale * (6.0 * x[i] - self.sum_at(x, i)) + self.mass[i] * x[i]
    }

    fn smooth_at(&self, right: &[f64], x: &mut [f64], i: usize) {
        x[i] = (right[i] + self.scale * self.sum_at(x, i)) / (6.0 * self.scale + self.mass[i]);
    }

    fn forward(&self, right: &[f64], x: &mut [f64]) {
        for i in 0..x.len() {
            self.smooth_at(right, x, i);
        }
    }

    fn backward(&self, right: &[f64], x: &mut [f64]) {
        for i in (0..x.len()).rev() {
            self.smooth_at(right, x, i);
        }
    }
}

/// Parents of a place of the finer level among the places of the coarser one, with their weights.
fn parents_among(coarse: &Rows, place: [u32; 3]) -> [(u32, f32); 8] {
    let mut parents = [(NONE, 0.0); 8];
    let mut count = 0;
    for corner in 0..8 {
        let (mut parent, mut weight, mut twice) = ([0; 3], 1.0, false);
        for axis in 0..3 {
            let far = (corner >> axis & 1) as u32;
            match place[axis] % 2 {
                0 => (parent[axis], twice) = (place[axis] / 2, twice || far == 1),
                _ => (parent[axis], weight) = (place[axis] / 2 + far, 0.5 * weight),
            }
        }
        let found = if twice { NONE } else { coarse.find(parent) };
        if found != NONE {
            parents[count] = (found, weight);
            count += 1;
        }
    }
    parents
}
