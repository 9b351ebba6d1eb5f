//! The paper's own carving, with `topology = free`. \[RELP00, sec. 3\]
//!
//! Cells whose ball has its centre outside the hull go first. Then every cell goes that shows the outside a facet with a perimeter above
//! the threshold, which is the mean over the exterior facets times the factor. The mean is taken anew until it changes by less than 1 %.
//! With a local threshold perimeters are measured in spacings of the samples around.
//!
//! Differences from the paper: (1) A stack makes each facet enter once per threshold instead of a pass over all cells per step. The cells
//! that go at one threshold do not depend on the order, so the result is the same. (2) Sums are taken in whole numbers, so that they do not
//! depend on the order either.

use glam::DVec3;
use rayon::prelude::*;

use super::balls::CHUNK;
use super::complex::{Complex, FACETS};
use base::error::Result;
use base::progress::Progress;
use geom::predicates::orient3d;

/// Change of the mean that ends the carving.
const SETTLED: f64 = 0.01;

/// Rounds after which it ends in any case. The mean falls by 1 % or more in each, so a thousand mean nothing is left.
const ROUNDS: usize = 1000;

/// Result of carving.
pub(super) struct Carved {
    /// The side of each cell: 1 inside, 0 outside.
    pub(super) sides: Vec<u8>,
    /// The last threshold: a perimeter, or one in local spacings.
    pub(super) threshold: f64,
    /// Times the mean was taken.
    pub(super) rounds: usize,
}

/// Carves. `size` gives a facet's perimeter in the unit of the threshold.
pub(super) fn carve(
    complex: Complex<'_>,
    factor: f64,
    size: impl Fn([u32; 3]) -> f64 + Sync,
    progress: &Progress<'_>,
) -> Result<Carved> {
    let mut sides = erode(complex, progress)?;
    let mut exterior: Vec<(u32, u8)> = Vec::new();
    for cell in (0..complex.len() as u32).filter(|&cell| sides[cell as usize] == 1) {
        for slot in 0..4 {
            if sides[complex.neighbour(cell, slot) as usize] == 0 {
                exterior.push((cell, slot as u8));
            }
        }
    }
    let (mut threshold, mut rounds) = (0.0_f64, 0);
    while !exterior.is_empty() && rounds < ROUNDS {
        let sizes: Vec<f64> =
            exterior.par_iter().map(|&(cell, slot)| size(complex.facet(cell, usize::from(slot)))).collect();
        let next = mean(&sizes) * factor;
        let change = (next - threshold).abs();
        if rounds > 0 && change <= SETTLED * threshold {
            break;
        }
        (threshold, rounds) = (next, rounds + 1);
        let mut kept = Vec::new();
        let mut stack = exterior;
        while let Some((cell, slot)) = stack.pop() {
            if sides[cell as usize] == 0 {
                continue;
            }
            if size(complex.facet(cell, usize::from(slot))) <= threshold {
                kept.push((cell, slot));
                continue;
            }
            progress.check()?;
            sides[cell as usize] = 0;
            for slot in 0..4 {
                let beyond = complex.neighbour(cell, slot);
                if sides[beyond as usize] == 1 {
                    stack.push((beyond, complex.mirror(cell, slot) as u8));
                }
            }
        }
        kept.retain(|&(cell, _)| sides[cell as usize] == 1);
        kept.sort_unstable();
        kept.dedup();
        exterior = kept;
    }
    Ok(Carved { sides, threshold, rounds })
}

/// The mean, the same for any order.
fn mean(sizes: &[f64]) -> f64 {
    let largest = sizes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let unit = largest / (1_u64 << 40) as f64;
    let sum: u128 = sizes.iter().map(|size| (size / unit).round() as u128).sum();
    sum as f64 / sizes.len().max(1) as f64 * unit
}

/// All cells but those whose ball has its centre outside the hull (Fig. 1b).
fn erode(complex: Complex<'_>, progress: &Progress<'_>) -> Result<Vec<u8>> {
    let mut sides = vec![0; complex.len()];
    sides.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, sides)| {
        for (i, side) in sides.iter_mut().enumerate() {
            *side = u8::from(centre_is_inside(complex, (chunk * CHUNK + i) as u32));
        }
        progress.advance(CHUNK as u64)
    })?;
    Ok(sides)
}

/// Walks from a cell towards the centre of its ball and sees whether that leads out of the hull.
fn centre_is_inside(complex: Complex<'_>, cell: u32) -> bool {
    if complex.is_outer(cell) {
        return false;
    }
    let (centre, radius, sides) = complex.centred_ball(cell);
    if sides == 0b1111 {
        return true;
    }
    let lowest = complex.vertices(cell).into_iter().min().expect("four vertices");
    let target: DVec3 = complex.points[lowest as usize] + centre;
    if !radius.is_finite() || !target.is_finite() {
        return false;
    }
    let mut here = cell;
    // The walk ends by itself in a Delaunay complex; the bound is for coordinates at the end of what numbers hold.
    for _ in 0..complex.len() {
        let vertices = complex.vertices(here);
        let beyond = (0..4).find(|&slot| {
            let [a, b, c] = FACETS[slot].map(|i| complex.points[vertices[i] as usize]);
            let [own, goal] = [complex.points[vertices[slot] as usize], target].map(|p| orient3d(a, b, c, p));
            goal != 0 && goal != own
        });
        let Some(slot) = beyond else { return true };
        here = complex.neighbour(here, slot);
        if complex.is_outer(here) {
            return false;
        }
    }
    true
}
