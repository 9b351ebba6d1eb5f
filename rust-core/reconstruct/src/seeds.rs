//! Some samples that are looked at for all, and how many of their neighbours.

/// Samples looked at.
const SEEDS: usize = 512;

/// Neighbours that are looked at, at first.
pub(super) const FEWEST: usize = 32;

/// Samples before and after a seed on the curve, among which its neighbours are looked for at first.
pub(super) const WINDOW: usize = 128;

/// Evenly along the curve.
pub(super) fn seeds(samples: usize) -> impl Iterator<Item = usize> {
    let count = samples.min(SEEDS);
    (0..count).map(move |k| (2 * k + 1) * samples / (2 * count))
}
