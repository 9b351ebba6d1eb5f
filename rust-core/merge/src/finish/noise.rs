//! The median of the noise over vertices of which memory holds a few at a time.

use crate::surface::tile::Tiles;
use base::error::Result;
use base::progress::Progress;

/// Bits of a number that are counted at a time.
const BITS: u32 = 16;

/// Median of the noise over the vertices of all tiles, world units: of an even number the upper one.
///
/// # Errors
/// A tile can't be read. Cancelled.
pub fn typical(tiles: &impl Tiles, progress: &Progress<'_>) -> Result<f64> {
    // A number that is not negative is in the order of its bits.
    let upper = count(tiles, progress, |bits| Some(bits >> BITS))?;
    let vertices: u64 = upper.iter().sum();
    if vertices == 0 {
        return Ok(0.0);
    }
    let (high, before) = find(&upper, vertices / 2);
    let lower = count(tiles, progress, |bits| (bits >> BITS == high).then_some(bits & ((1 << BITS) - 1)))?;
    let (low, _) = find(&lower, vertices / 2 - before);
    Ok(f32::from_bits(high << BITS | low).into())
}

fn count(tiles: &impl Tiles, progress: &Progress<'_>, of: impl Fn(u32) -> Option<u32>) -> Result<Vec<u64>> {
    let mut counts = vec![0; 1 << BITS];
    for i in 0..tiles.count() {
        progress.check()?;
        tiles.noise(i)?.iter().filter_map(|noise| of(noise.to_bits())).for_each(|bits| counts[bits as usize] += 1);
    }
    Ok(counts)
}

/// The counted one of this place, and how many come before it and its equals.
fn find(counts: &[u64], place: u64) -> (u32, u64) {
    let mut before = 0;
    for (bits, count) in (0..).zip(counts) {
        if before + count > place {
            return (bits, before);
        }
        before += count;
    }
    unreachable!("there are more than the place");
}
