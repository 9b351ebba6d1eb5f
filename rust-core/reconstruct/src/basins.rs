//! Stage 2: empty space falls into basins. \[GJ03\], \[Ede03\]
//!
//! Around every point of space, how far is it to the nearest sample? The balls of the cells are where this clearance is known: from a cell
//! whose ball's centre lies beyond one of its facets, clearance grows through that facet. Following the largest ball uphill, every cell
//! ends in a *basin*, the cells around one local maximum. Cells whose way leads through the convex hull end outside. They are the paper's
//! erosion of cells with a centre outside the hull (Fig. 1b), taken together with all that flows into them.
//!
//! Between two basins the largest *gate* counts: the smallest clearance on the way from one ball's centre to the other's
//! through a facet. Nothing depends on the order of the cells.

use std::ops::Range;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::balls::{Balls, CHUNK};
use super::complex::Complex;
use base::error::Result;
use base::progress::Progress;

/// The basin of the outside.
pub(super) const OUTSIDE: u32 = 0;

/// All facets between two basins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gate {
    /// The basins, the lower first.
    pub(super) basins: [u32; 2],
    /// Largest clearance of a facet.
    pub(super) clearance: f32,
    /// The first of the facets with that clearance, in the order of their vertices: four times a cell plus the slot.
    facet: u32,
    /// Number of them.
    pub(super) facets: u32,
    /// Those at which two balls touch that are large beside the clearance: they lie on different sides of a surface.
    pub(super) tangent: u32,
}

impl Gate {
    /// The vertices of the widest facet: what the gate is called whatever the numbers of cells and basins.
    fn name(&self, complex: Complex<'_>) -> [u32; 3] {
        let mut vertices = complex.facet(self.facet / 4, self.facet as usize % 4);
        vertices.sort_unstable();
        vertices
    }

    /// Takes in facets between the same basins.
    fn join(&mut self, other: &Gate, complex: Complex<'_>) {
        let is_wider = other.clearance > self.clearance
            || (other.clearance == self.clearance && other.name(complex) < self.name(complex));
        if is_wider {
            (self.clearance, self.facet) = (other.clearance, other.facet);
        }
        self.facets += other.facets;
        self.tangent += other.tangent;
    }
}

/// Cells gathered into basins.
pub(super) struct Basins {
    /// Of each cell.
    pub(super) basin: Vec<u32>,
    /// The largest ball of each basin. Infinite for the outside.
    pub(super) depth: Vec<f32>,
    /// From the widest to the narrowest.
    pub(super) gates: Vec<Gate>,
}

/// Balls that exceed the clearance of their common facet by this factor make the facet a tangent one.
pub(super) const TANGENT: f32 = 2.0;

impl Basins {
    pub(super) fn find(complex: Complex<'_>, balls: &Balls, progress: &Progress<'_>) -> Result<Basins> {
        let (basin, depth) = flow(complex, balls, progress)?;
        let gates = gates(complex, &basin, balls, progress)?;
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
    // The larger the parts, the fewer gates are found by several.
    let size = (complex.len() / PARTS).next_multiple_of(CHUNK).max(CHUNK);
    let parts: Vec<Vec<Gate>> = (0..complex.len().div_ceil(size))
        .into_par_iter()
        .map(|part| gates_of(complex, basin, balls, part * size..((part + 1) * size).min(complex.len()), progress))
        .collect::<Result<_>>()?;
    let mut gates = Vec::with_capacity(parts.iter().map(Vec::len).sum());
    parts.into_iter().for_each(|part| gates.extend_from_slice(&part));
    progress.sort(&mut gates, &|a: &Gate, b| a.basins.cmp(&b.basins))?;
    gates.dedup_by(|next, first| {
        let is_same = next.basins == first.basins;
        if is_same {
            first.join(next, complex);
        }
        is_same
    });
    // Equal clearances, as on lattices and spheres, by name.
    let named = |a: &Gate, b: &Gate| a.name(complex).cmp(&b.name(complex));
    progress.sort(&mut gates, &|a: &Gate, b: &Gate| b.clearance.total_cmp(&a.clearance).then_with(|| named(a, b)))?;
    Ok(gates)
}

/// Parts that the cells are divided into to look for gates.
const PARTS: usize = 32;

/// The gates at facets of some cells.
fn gates_of(
    complex: Complex<'_>,
    basin: &[u32],
    balls: &Balls,
    cells: Range<usize>,
    progress: &Progress<'_>,
) -> Result<Vec<Gate>> {
    let mut gates: Vec<Gate> = Vec::new();
    let mut places = FxHashMap::default();
    // By far most facets lie between the same two basins as the one before.
    let mut last = 0;
    for cell in cells {
        if cell.is_multiple_of(CHUNK) {
            progress.advance(CHUNK as u64)?;
        }
        for slot in 0..4 {
            let beyond = complex.neighbour(cell as u32, slot) as usize;
            if beyond < cell || basin[beyond] == basin[cell] {
                continue;
            }
            let clearance = balls.clearance(complex, cell as u32, slot);
            let smaller = balls.radii[cell].min(balls.radii[beyond]);
            let basins = [basin[cell].min(basin[beyond]), basin[cell].max(basin[beyond])];
            let (facet, tangent) = ((4 * cell + slot) as u32, u32::from(smaller > TANGENT * clearance));
            let gate = Gate { basins, clearance, facet, facets: 1, tangent };
            if gates.get(last).is_none_or(|found| found.basins != basins) {
                last = *places.entry(basins).or_insert(gates.len());
            }
            match gates.get_mut(last) {
                Some(found) => found.join(&gate, complex),
                None => gates.push(gate),
            }
        }
    }
    gates.shrink_to_fit();
    Ok(gates)
}
