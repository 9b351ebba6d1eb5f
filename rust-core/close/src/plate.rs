//! The field of the fill: least squared Laplacian between what is known, and not negative where scans saw that nothing is.
//!
//! A distance field is continued as smoothly as a thin plate: that of a ball is biharmonic, so a ball is continued exactly. Seen space is
//! an inequality and is met by an active set: nodes that fell below zero are held at zero, and let go once they would rise.

use base::error::Result;
use base::progress::Progress;

use super::conjugate;
use super::grid::Grid;
use super::multigrid::{Multigrid, NONE};

/// The residual falls to this share, in the norm of the preconditioner.
const RESIDUAL: f64 = 3e-3;
const MOST_STEPS: usize = 100;
/// Rounds of the active set.
const ROUNDS: usize = 5;

/// Nodes of a grid whose values are looked for. All others keep theirs.
pub struct Plate<'a> {
    pub grid: &'a Grid,
    /// Rising. None on the outermost layer.
    pub free: &'a [u32],
    /// Of each node of `free`: whether a scan saw that nothing is there.
    pub is_seen: &'a [bool],
}

impl Plate<'_> {
    /// Solves for the field at the free nodes, from the values that they have. Returns the steps made.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn solve(&self, field: &mut [f64], progress: &Progress<'_>) -> Result<usize> {
        let mut is_held: Vec<bool> =
            self.free.iter().zip(self.is_seen).map(|(&node, &seen)| seen && field[node as usize] <= 0.0).collect();
        let mut steps = 0;
        for _ in 0..ROUNDS {
            for (&node, _) in self.free.iter().zip(&is_held).filter(|(_, held)| **held) {
                field[node as usize] = 0.0;
            }
            let loose: Vec<u32> =
                self.free.iter().zip(&is_held).filter(|(_, held)| !**held).map(|(&node, _)| node).collect();
            let system = System::new(self, &loose, progress)?;
            steps += system.relax(field, progress)?;
            if !self.hold(field, &system, &mut is_held) {
                break;
            }
        }
        for (&node, &seen) in self.free.iter().zip(self.is_seen) {
            if seen {
                field[node as usize] = field[node as usize].max(0.0);
            }
        }
        Ok(steps)
    }

    /// Changes the active set. Returns whether anything changed that matters.
    fn hold(&self, field: &[f64], system: &System<'_>, is_held: &mut [bool]) -> bool {
        let mut changed = 0;
        for (i, &node) in self.free.iter().enumerate() {
            let node = node as usize;
            if !self.is_seen[i] {
                continue;
            }
            let is_wrong = if is_held[i] {
                // Letting it rise would lower the energy.
                system.slope(field, node) < 0.0
            } else {
                field[node] < -1e-3 * self.grid.cell
            };
            if is_wrong {
                is_held[i] = !is_held[i];
                changed += 1;
            }
        }
        changed > 0
    }
}

/// Rows: nodes whose Laplacian counts, the loose ones first.
struct System<'a> {
    grid: &'a Grid,
    multigrid: Multigrid,
    rows: Vec<u32>,
    /// Of each row, the places of its neighbours among the rows.
    neighbours: Vec<[u32; 6]>,
    /// Place among the rows of each node of the grid.
    place: Vec<u32>,
    loose: usize,
}

impl<'a> System<'a> {
    fn new(plate: &Plate<'a>, loose: &[u32], progress: &Progress<'_>) -> Result<Self> {
        let grid = plate.grid;
        let multigrid = Multigrid::new(grid, loose, vec![0.0; loose.len()], progress)?;
        let mut place = vec![NONE; grid.len()];
        let mut rows = loose.to_vec();
        for (i, &node) in loose.iter().enumerate() {
            place[node as usize] = i as u32;
        }
        for &node in loose {
            for other in grid.neighbours(node as usize).into_iter().flatten() {
                if place[other] == NONE && !grid.is_outermost(other) {
                    place[other] = rows.len() as u32;
                    rows.push(other as u32);
                }
            }
        }
        progress.check()?;
        let neighbours_of =
            |&node: &u32| grid.neighbours(node as usize).map(|other| other.map_or(NONE, |other| place[other]));
        let neighbours = rows.iter().map(neighbours_of).collect();
        Ok(System { grid, multigrid, rows, neighbours, place, loose: loose.len() })
    }

    /// Laplacian of the whole field at a row.
    fn bend(&self, field: &[f64], row: usize) -> f64 {
        let node = self.rows[row] as usize;
        let sum: f64 = self.grid.neighbours(node).into_iter().flatten().map(|other| field[other]).sum();
        sum - 6.0 * field[node]
    }

    /// Half the derivative of the energy by the value at any node.
    fn slope(&self, field: &[f64], node: usize) -> f64 {
        let at = |node: usize| match self.place[node] {
            NONE => 0.0,
            row => self.bend(field, row as usize),
        };
        let sum: f64 = self.grid.neighbours(node).into_iter().flatten().map(at).sum();
        sum - 6.0 * at(node)
    }

    fn relax(&self, field: &mut [f64], progress: &Progress<'_>) -> Result<usize> {
        let n = self.loose;
        let mut bends: Vec<f64> = (0..self.rows.len()).map(|row| self.bend(field, row)).collect();
        let mut right = vec![0.0; n];
        self.transposed(&bends, &mut right);
        right.iter_mut().for_each(|r| *r = -*r);
        let mut scratch = self.multigrid.scratch();
        let mut between = vec![0.0; n];
        let mut x = vec![0.0; n];
        let steps = conjugate::solve(
            &mut x,
            &right,
            |x, y| {
                for (row, neighbours) in self.neighbours.iter().enumerate() {
                    let sum: f64 = neighbours.iter().map(|&place| x.get(place as usize).copied().unwrap_or(0.0)).sum();
                    bends[row] = sum - if row < n { 6.0 * x[row] } else { 0.0 };
                }
                self.transposed(&bends, y);
            },
            |residual, z| {
                self.multigrid.cycle(residual, &mut between, &mut scratch, progress)?;
                self.multigrid.cycle(&between, z, &mut scratch, progress)
            },
            RESIDUAL,
            MOST_STEPS,
            progress,
        )?;
        for (&node, x) in self.rows[..n].iter().zip(&x) {
            field[node as usize] += x;
        }
        Ok(steps)
    }

    fn transposed(&self, bends: &[f64], y: &mut [f64]) {
        for (i, y) in y.iter_mut().enumerate() {
            let of = |&place: &u32| bends.get(place as usize).copied().unwrap_or(0.0);
            *y = self.neighbours[i].iter().map(of).sum::<f64>() - 6.0 * bends[i];
        }
    }
}
