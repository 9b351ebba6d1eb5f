//! Stage 2: empty space falls into basins. \[GJ03\], \[Ede03\]
//!
//! Around every point of space, how far is it to the nearest sample? The balls of the cells are where this clearance is
//! known: from a cell whose ball's centre lies beyond one of its facets, clearance grows through that facet. Following
//! the largest ball uphill, every cell ends in a *basin*, the cells around one local maximum. Cells whose way leads
//! through the convex hull end outside; they are the paper's erosion of cells with a centre outside the hull (Fig. 1b),
//! taken together with all that flows into them.
//!
//! Between two basins the largest *gate* counts: the smallest clearance on the way from one ball's centre to the other's
//! through a facet. Nothing depends on the order of the cells.

use rayon::prelude::*;

use super::balls::{Balls, CHUNK};
use super::complex::Complex;
use crate::error::Result;
use crate::progress::Progress;

/// The basin of the outside.
pub(super) const OUTSIDE: u32 = 0;

/// A facet between two basins.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Gate {
    /// The bits of the clearance, which order like the clearance itself; the lowest says whether the gate is tangent.
    clearance: u32,
    /// Four times the cell plus the slot.
    facet: u32,
}

impl Gate {
    fn new(clearance: f32, tangent: bool, cell: usize, slot: usize) -> Self {
        Gate { clearance: clearance.to_bits() & !1 | u32::from(tangent), facet: (4 * cell + slot) as u32 }
    }

    pub(super) fn clearance(self) -> f32 {
        f32::from_bits(self.clearance & !1)
    }

    /// Whether two balls touch here that are large beside the clearance: they lie on different sides of a surface.
    pub(super) fn is_tangent(self) -> bool {
        self.clearance & 1 == 1
    }

    pub(super) fn cell(self) -> u32 {
        self.facet / 4
    }

    pub(super) fn slot(self) -> usize {
        self.facet as usize % 4
    }
}

/// Cells gathered into basins.
pub(super) struct Basins {
    /// Of each cell.
    pub(super) basin: Vec<u32>,
    /// The largest ball of each basin; infinite for the outside.
    pub(super) depth: Vec<f32>,
    /// The facets between different basins, from the largest clearance to the smallest.
    pub(super) gates: Vec<Gate>,
}

/// Balls that exceed the clearance of their common facet by this factor make the facet a tangent one.
const TANGENT: f32 = 2.0;

impl Basins {
    pub(super) fn find(complex: Complex<'_>, progress: &Progress<'_>) -> Result<Basins> {
        let balls = Balls::of(complex, progress)?;
        let (basin, depth) = flow(complex, &balls, progress)?;
        let gates = gates(complex, &basin, &balls, progress)?;
        Ok(Basins { basin, depth, gates })
    }
}

/// Marks a cell whose basin isn't known yet, and carries the cell that it flows into.
const FLOWS: u32 = 1 << 31;

fn flow(complex: Complex<'_>, balls: &Balls, progress: &Progress<'_>) -> Result<(Vec<u32>, Vec<f32>)> {
    let Balls { radii, sides } = balls;
    let mut basin = vec![0_u32; complex.len()];
    // Uphill, or the cell itself at a maximum.
    basin.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, basin)| {
        for (i, basin) in basin.iter_mut().enumerate() {
            let cell = (chunk * CHUNK + i) as u32;
            let vertices = complex.vertices(cell);
            let (mut best, mut to, mut apex) = (radii[cell as usize], cell, 0);
            for slot in (0..4).filter(|slot| sides[cell as usize] >> slot & 1 == 0) {
                let beyond = complex.neighbour(cell, slot);
                let radius = radii[beyond as usize];
                if radius > best || (radius == best && to != cell && vertices[slot] < apex) {
                    (best, to, apex) = (radius, beyond, vertices[slot]);
                }
            }
            *basin = to | FLOWS;
        }
        progress.advance(CHUNK as u64)
    })?;
    let mut depth = vec![f32::INFINITY];
    for cell in 0..basin.len() as u32 {
        if basin[cell as usize] == cell | FLOWS {
            basin[cell as usize] = if complex.is_outer(cell) {
                OUTSIDE
            } else {
                depth.push(radii[cell as usize]);
                depth.len() as u32 - 1
            };
        }
    }
    let mut way = Vec::new();
    for cell in 0..basin.len() {
        let mut here = cell;
        while basin[here] & FLOWS != 0 {
            way.push(here);
            here = (basin[here] & !FLOWS) as usize;
        }
        let end = basin[here];
        way.drain(..).for_each(|cell| basin[cell] = end);
        if cell.is_multiple_of(CHUNK) {
            progress.advance(CHUNK as u64)?;
        }
    }
    Ok((basin, depth))
}

fn gates(complex: Complex<'_>, basin: &[u32], balls: &Balls, progress: &Progress<'_>) -> Result<Vec<Gate>> {
    let chunks = complex.len().div_ceil(CHUNK);
    let parts: Vec<Vec<Gate>> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let mut gates = Vec::new();
            for cell in chunk * CHUNK..((chunk + 1) * CHUNK).min(complex.len()) {
                for slot in 0..4 {
                    let beyond = complex.neighbour(cell as u32, slot) as usize;
                    if beyond > cell && basin[beyond] != basin[cell] {
                        let clearance = balls.clearance(complex, cell as u32, slot);
                        let smaller = balls.radii[cell].min(balls.radii[beyond]);
                        gates.push(Gate::new(clearance, smaller > TANGENT * clearance, cell, slot));
                    }
                }
            }
            progress.advance(CHUNK as u64)?;
            Ok(gates)
        })
        .collect::<Result<_>>()?;
    let mut gates = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    parts.into_iter().for_each(|part| gates.extend_from_slice(&part));
    gates.par_sort_unstable_by(|a, b| b.clearance.cmp(&a.clearance));
    // Equal clearances, as on lattices, in the order of the facets' vertices, whatever the numbers of the cells.
    let key = |gate: &Gate| {
        let mut vertices = complex.facet(gate.cell(), gate.slot());
        vertices.sort_unstable();
        vertices
    };
    for equal in gates.chunk_by_mut(|a, b| a.clearance == b.clearance) {
        if equal.len() > 1 {
            equal.sort_unstable_by_key(key);
        }
    }
    Ok(gates)
}
