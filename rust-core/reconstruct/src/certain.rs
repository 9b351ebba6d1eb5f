//! Facets that are certain: of a surface sampled well, large balls touch the samples from both sides.

use rayon::prelude::*;

use super::balls::{Balls, CHUNK};
use super::complex::Complex;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::{Cell, INFINITE};

/// A facet between two balls larger than it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Certain {
    /// Its size by that of the smaller ball, as bits.
    share: u32,
    /// In the order of their numbers.
    pub(super) facet: [u32; 3],
    pub(super) cell: u32,
}

/// Facets with wanted vertices only, and of these one in `share` by the lowest number of a vertex. They are those whose two balls exceed
/// their clearance by a factor, the most certain first.
pub(super) fn certain(
    complex: Complex<'_>,
    balls: &Balls,
    factor: f32,
    share: u32,
    is_wanted: impl Fn(u32) -> bool + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<Certain>> {
    let found: Vec<Vec<Certain>> = complex
        .cells
        .par_chunks(CHUNK)
        .enumerate()
        .map(|(chunk, cells)| {
            progress.check()?;
            let mut found = Vec::new();
            for (i, Cell { vertices, neighbours }) in cells.iter().enumerate() {
                let cell = (chunk * CHUNK + i) as u32;
                if share > 1 && !vertices.iter().any(|v| v.is_multiple_of(share)) {
                    continue;
                }
                let is_left_out = vertices.map(|v| v == INFINITE || !is_wanted(v));
                let left_out = is_left_out.iter().filter(|is| **is).count();
                if left_out > 1 {
                    continue;
                }
                for slot in 0..4 {
                    let beyond = neighbours[slot];
                    if beyond < cell || left_out > usize::from(is_left_out[slot]) {
                        continue;
                    }
                    let mut facet = complex.facet(cell, slot);
                    facet.sort_unstable();
                    if !facet[0].is_multiple_of(share) {
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
