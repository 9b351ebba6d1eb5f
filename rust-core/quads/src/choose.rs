//! Rows and columns for a wanted error, ours: the smallest grid found whose error, as measured, is at most that.

use super::candidate::{Candidate, Source};
use super::tiles::Layout;
use base::error::Result;
use base::progress::Progress;

/// Bisects the number of vertices along the longer side of a tile. Both sides grow together, as the tiles' sides are. The error does not
/// fall strictly with it, so the result need not be the smallest grid there is. The last resort is a grid with a vertex per pixel.
pub(super) fn smallest(source: &Source<'_>, error: f64, progress: &Progress<'_>) -> Result<Candidate> {
    let size = [source.image.rows(), source.image.cols()];
    let tiles = source.layout([2, 2])?;
    let tiles = [tiles.row_lines.len() - 1, tiles.col_lines.len() - 1];
    // Most steps along each side of a tile.
    let most = [0, 1].map(|axis| (size[axis] - 1) / tiles[axis]);
    let longest = most[0].max(most[1]);
    let try_steps = |steps: usize| {
        let along = |axis: usize| ((steps * most[axis]).div_ceil(longest)).clamp(1, most[axis]) + 1;
        source.candidate(Layout::new(size, tiles, [along(0), along(1)])?, progress)
    };
    let is_within = |candidate: &Candidate| source.judged(&candidate.measured) <= error;
    // Doubles until it is fine enough, then halves the gap.
    let (mut low, mut steps) = (0, 1);
    let mut best = loop {
        let candidate = try_steps(steps)?;
        if is_within(&candidate) {
            break candidate;
        }
        if steps == longest {
            return source.candidate(Layout::new(size, [1, 1], size)?, progress);
        }
        (low, steps) = (steps, (2 * steps).min(longest));
    };
    let mut high = steps;
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        let candidate = try_steps(middle)?;
        if is_within(&candidate) {
            (best, high) = (candidate, middle);
        } else {
            low = middle;
        }
    }
    Ok(best)
}
