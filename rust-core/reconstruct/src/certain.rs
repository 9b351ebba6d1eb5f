//! Facets that are certain: of a surface sampled well, large balls touch the samples from both sides.

use rayon::prelude::*;

use super::balls::{Balls, CHUNK};
use super::complex::Complex;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::INFINITE;

/// A facet between two balls larger than it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Certain {
    /// Its size by that of the smaller ball, as bits.
    share: u32,
    /// In the order of their numbers.
    pub(super) facet: [u32; 3],
    pub(super) cell: u32,
}

/// Of the facets that are wanted, those whose two balls exceed their clearance by a factor, the most certain first.
pub(super) fn certain(
    complex: Complex<'_>,
    balls: &Balls,
    factor: f32,
    is_wanted: impl Fn([u32; 3]) -> bool + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<Certain>> {
    let found: Vec<Vec<Certain>> = complex
        .cells
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, cells)| {
            progress.check()?;
            let mut found = Vec::new();
            for cell in (chunk * CHUNK..).take(cells.len()).map(|cell| cell as u32) {
                for slot in 0..4 {
                    let beyond = complex.neighbour(cell, slot);
                    let mut facet = complex.facet(cell, slot);
                    facet.sort_unstable();
                    if beyond < cell || facet[2] == INFINITE || !is_wanted(facet) {
                        continue;
                    }
                    let clearance = balls.clearance(complex, cell, slot);
                    let smaller = balls.radii[cell as usize].min(balls.radii[beyond as usize]);
                    if smaller > factor * clearance {
                        found.push(Certain { share: (clearance / smaller).to_bits(), facet, cell });
                    }
                }
            }
            Ok(found)
        })
        .collect::<Result<_>>()?;
    let mut found = found.concat();
    progress.sort(&mut found, &Ord::cmp)?;
    Ok(found)
}
