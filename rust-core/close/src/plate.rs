//! The field of the fill: least squared Laplacian between what is known, and not negative where scans saw that nothing is.
//!
//! A distance field is continued as smoothly as a thin plate: that of a ball is biharmonic, so a ball is continued exactly. Seen space is
//! an inequality and is met by an active set: nodes that fell below zero are held at zero, and let go once they would rise.

use base::error::Result;
use base::progress::Progress;

use super::conjugate;
use super::multigrid::Multigrid;
use super::nodes::Nodes;
use super::rows::NONE;

/// The residual falls to this share of the first round's, in the norm of the preconditioner.
const RESIDUAL: f64 = 1e-2;
const MOST_STEPS: usize = 100;
/// Rounds of the active set.
const ROUNDS: usize = 5;

/// Nodes whose values are looked for. All others keep theirs.
pub struct Plate<'a> {
    pub nodes: &'a Nodes,
    /// Rising. All six nodes beside each are there.
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
        let (mut steps, mut whole) = (0, None);
        for _ in 0..ROUNDS {
            for (&node, _) in self.free.iter().zip(&is_held).filter(|(_, held)| **held) {
                field[node as usize] = 0.0;
            }
            let loose: Vec<u32> =
                self.free.iter().zip(&is_held).filter(|(_, held)| !**held).map(|(&node, _)| node).collect();
            let system = System::new(self, &loose, progress)?;
            steps += system.relax(field, &mut whole, progress)?;
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
                field[node] < -1e-3 * self.nodes.grid.cell
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
    nodes: &'a Nodes,
    multigrid: Multigrid,
    rows: Vec<u32>,
    /// Of each row, the places of its neighbours among the rows.
    neighbours: Vec<[u32; 6]>,
    /// Place among the rows of each node.
    place: Vec<u32>,
    loose: usize,
}

impl<'a> System<'a> {
    fn new(plate: &Plate<'a>, loose: &[u32], progress: &Progress<'_>) -> Result<Self> {
        let nodes = plate.nodes;
        let places = loose.iter().map(|&node| nodes.node(node as usize));
        let multigrid = Multigrid::new(nodes.grid.counts, places, vec![0.0; loose.len()], progress)?;
        let mut place = vec![NONE; nodes.len()];
        let mut rows = loose.to_vec();
        for (i, &node) in loose.iter().enumerate() {
            place[node as usize] = i as u32;
        }
        for &node in loose {
            for other in nodes.beside(node as usize) {
                if place[other] == NONE && nodes.is_within(other) {
                    place[other] = rows.len() as u32;
                    rows.push(other as u32);
                }
            }
        }
        progress.check()?;
        let place_of = |&other: &u32| place.get(other as usize).copied().unwrap_or(NONE);
        let neighbours = rows.iter().map(|&node| nodes.sides(node as usize).each_ref().map(place_of)).collect();
        Ok(System { nodes, multigrid, rows, neighbours, place, loose: loose.len() })
    }

    /// Laplacian of the whole field at a row.
    fn bend(&self, field: &[f64], row: usize) -> f64 {
        let node = self.rows[row] as usize;
        let sum: f64 = self.nodes.beside(node).map(|other| field[other]).sum();
        sum - 6.0 * field[node]
    }

    /// Half the derivative of the energy by the value at any node.
    fn slope(&self, field: &[f64], node: usize) -> f64 {
        let at = |node: usize| match self.place[node] {
            NONE => 0.0,
            row => self.bend(field, row as usize),
        };
        let sum: f64 = self.nodes.beside(node).map(at).sum();
        sum - 6.0 * at(node)
    }

    /// Until the residual has fallen to a share of `whole`, which the first call sets. Returns the steps made.
    fn relax(&self, field: &mut [f64], whole: &mut Option<f64>, progress: &Progress<'_>) -> Result<usize> {
        let n = self.loose;
        let mut bends: Vec<f64> = (0..self.rows.len()).map(|row| self.bend(field, row)).collect();
        let mut right = vec![0.0; n];
        self.transposed(&bends, &mut right);
        right.iter_mut().for_each(|r| *r = -*r);
        let mut scratch = self.multigrid.scratch();
        let mut between = vec![0.0; n];
        let precondition = |residual: &[f64], z: &mut [f64]| {
            self.multigrid.cycle(residual, &mut between, &mut scratch, progress)?;
            self.multigrid.cycle(&between, z, &mut scratch, progress)
        };
        let mut x = vec![0.0; n];
        let matrix = |x: &[f64], y: &mut [f64]| {
            for (row, neighbours) in self.neighbours.iter().enumerate() {
                let sum: f64 = neighbours.iter().map(|&place| x.get(place as usize).copied().unwrap_or(0.0)).sum();
                bends[row] = sum - if row < n { 6.0 * x[row] } else { 0.0 };
            }
            self.transposed(&bends, y);
        };
        let mut system = conjugate::System { matrix, precondition };
        let whole = match *whole {
            Some(whole) => whole,
            None => *whole.insert(system.norm(&right)?),
        };
        let goal = conjugate::Goal { energy: RESIDUAL * RESIDUAL * whole, most_steps: MOST_STEPS };
        let steps = system.solve(&mut x, &right, goal, progress)?;
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
