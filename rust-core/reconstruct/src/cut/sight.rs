//! What samples say of the cells along the line on which they were seen: before them is outside, behind them inside. \[LPK09\]

use glam::DVec3;
use rayon::prelude::*;

use super::poles::Poles;
use crate::complex::{Complex, Star};
use crate::seen::Fronts;
use crate::walk::along;
use base::error::Result;
use base::progress::Progress;

/// How far before and behind a sample, in spacings: further off lies what bends away, or the other side of a thin wall.
const REACH: f64 = 1.0;

/// Samples between two checks for cancelling.
const CHUNK: usize = 1 << 11;

/// Of each cell, the number of samples that say that it is outside, and inside; none where nothing is known of them.
pub(super) fn votes(
    complex: Complex<'_>,
    poles: &[Poles],
    fronts: &Fronts,
    progress: &Progress<'_>,
) -> Result<Vec<[u32; 2]>> {
    if fronts.are_unknown() {
        return Ok(Vec::new());
    }
    let incident = complex.incident();
    let found: Vec<[Vec<u32>; 2]> = poles
        .par_chunks(CHUNK)
        .enumerate()
        .map_init(Star::default, |star, (chunk, poles)| {
            progress.check()?;
            let mut found = [Vec::new(), Vec::new()];
            for (vertex, poles) in (chunk * CHUNK..).zip(poles) {
                let front = fronts.at(vertex);
                if front == DVec3::ZERO || incident[vertex] == u32::MAX {
                    continue;
                }
                complex.star(vertex as u32, incident[vertex], star);
                for (found, direction) in found.iter_mut().zip([front, -front]) {
                    let reach = REACH * f64::from(poles.spacing);
                    along(complex, vertex as u32, star, direction, reach, |cell, _, _| found.push(cell));
                }
            }
            Ok(found)
        })
        .collect::<Result<_>>()?;
    let mut votes = vec![[0; 2]; complex.len()];
    for found in found {
        progress.check()?;
        for (side, cells) in found.into_iter().enumerate() {
            cells.into_iter().for_each(|cell| votes[cell as usize][side] += 1);
        }
    }
    Ok(votes)
}
