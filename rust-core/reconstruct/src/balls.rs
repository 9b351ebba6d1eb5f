//! The circumscribed balls of all cells: how far it is from their centres to the nearest samples.

use rayon::prelude::*;

use super::complex::Complex;
use base::error::Result;
use base::progress::Progress;

/// Cells worked on between two checks for cancelling.
pub(super) const CHUNK: usize = 1 << 14;

/// Of each cell.
pub(super) struct Balls {
    /// Infinite for cells outside the hull.
    pub(super) radii: Vec<f32>,
    /// For each slot (bit) whether the ball's centre lies on the cell's side of the facet opposite to it.
    pub(super) sides: Vec<u8>,
}

impl Balls {
    pub(super) fn of(complex: Complex<'_>, progress: &Progress<'_>) -> Result<Balls> {
        let mut radii = vec![f32::INFINITY; complex.len()];
        let mut sides = vec![0b1111; complex.len()];
        let chunks = radii.par_chunks_mut(CHUNK).zip(sides.par_chunks_mut(CHUNK)).enumerate();
        chunks.try_for_each(|(chunk, (radii, sides))| {
            for (i, (radius, sides)) in radii.iter_mut().zip(sides).enumerate() {
                let cell = (chunk * CHUNK + i) as u32;
                if !complex.is_outer(cell) {
                    (*radius, *sides) = complex.ball(cell);
                }
            }
            progress.advance(CHUNK as u64)
        })?;
        Ok(Balls { radii, sides })
    }

    /// Radius of the smallest ball through a facet that holds no sample: the smallest clearance on the way between the
    /// centres of the two balls beside it.
    pub(super) fn clearance(&self, complex: Complex<'_>, cell: u32, slot: usize) -> f32 {
        let beyond = complex.neighbour(cell, slot);
        let mirror = complex.mirror(cell, slot);
        let smaller = self.radii[cell as usize].min(self.radii[beyond as usize]);
        if self.sides[cell as usize] >> slot & 1 == 1 && self.sides[beyond as usize] >> mirror & 1 == 1 {
            smaller.min(complex.circle(complex.facet(cell, slot)) as f32)
        } else {
            smaller
        }
    }
}
