//! Some samples of each scan, in the world and in an order of their own.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use base::{magnitude, memory};
use image::source::ScanSource;

/// Samples of all scans together, about.
const MOST: usize = 1 << 18;
/// Samples of a scan, however many scans there are.
const LEAST: usize = 16;
/// Bits a coordinate in the order along a curve.
const BITS: u32 = 21;
/// Share of the samples on either side that says nothing of what the scans extend over.
const OUTLYING: f64 = 0.05;

/// A sample: where it lies, less the origin of the pool, and toward where it was seen from, zero if that is not known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    pub at: DVec3,
    pub outward: DVec3,
}

/// The samples. Neighbours in the list are mostly neighbours in space.
pub struct Pool {
    pub points: Vec<Sample>,
    /// In the world: amid the samples, so that coordinates are small.
    pub origin: DVec3,
    /// Extent of nearly all samples.
    pub extent: f64,
}

impl Pool {
    /// Reads scans. O(samples). The samples that are kept take some megabytes.
    ///
    /// # Errors
    /// Errors of reading, of the first scan that can't be read. A place too large. Cancelled.
    pub fn of(sources: &[&dyn ScanSource], progress: &Progress<'_>) -> Result<Pool> {
        let share = (MOST / sources.len().max(1)).max(LEAST);
        memory::foresee(sources.len(), (2 * share * size_of::<Sample>()) as f64, "finding the plane of", "scans")?;
        let read = sources.par_iter().map(|source| {
            let samples = some(*source, share, progress);
            progress.advance(1)?;
            samples
        });
        let read: Vec<Result<Vec<Sample>>> = read.collect();
        progress.check()?;
        let mut points = Vec::new();
        for samples in read {
            points.append(&mut samples?);
        }
        progress.check()?;
        let (low, high) = bounds(&points);
        let (origin, extent) = (0.5 * (low + high), (high - low).length());
        points.iter_mut().for_each(|sample| sample.at -= origin);
        let scale = f64::from(1_u32 << BITS) / (high - low).max_element().max(magnitude::SMALLEST);
        // If places are the same, so are the keys and all that follows.
        let bits = |v: DVec3| v.to_array().map(|x| (x + 0.0).to_bits());
        let key = |sample: &Sample| (along(sample.at * scale), bits(sample.at), bits(sample.outward));
        points.par_sort_by_cached_key(key);
        progress.check()?;
        Ok(Pool { points, origin, extent })
    }
}

/// About `share` samples of a scan, spread over it.
fn some(source: &dyn ScanSource, share: usize, progress: &Progress<'_>) -> Result<Vec<Sample>> {
    let places = source.places(progress)?;
    let count = places.positions.len();
    let mut samples = Vec::with_capacity(count.min(share));
    for k in 0..count.min(share) {
        // One of each stretch of the list, not the same of each: pixels in a row of a grid are in a row in space.
        let chosen = if count <= share {
            k
        } else {
            let (first, last) = (k * count / share, (k + 1) * count / share);
            first + (random(k as u64) % (last - first) as u64) as usize
        };
        let at = places.world_from_places.transform_point3(places.positions[chosen]);
        samples.push(Sample {
            at: magnitude::place("a sample", at)?,
            outward: places.world_from_places.transform_vector3(places.outward[chosen]).normalize_or_zero(),
        });
    }
    Ok(samples)
}

/// Bounds along the axes of all but the outlying samples.
fn bounds(points: &[Sample]) -> (DVec3, DVec3) {
    let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
    let outlying = (OUTLYING * points.len() as f64) as usize;
    for axis in 0..3 {
        let mut along: Vec<f64> = points.iter().map(|sample| sample.at[axis]).collect();
        if along.is_empty() {
            break;
        }
        low[axis] = *along.select_nth_unstable_by(outlying, f64::total_cmp).1;
        let last = along.len() - 1 - outlying;
        high[axis] = *along.select_nth_unstable_by(last, f64::total_cmp).1;
    }
    (low, high)
}

/// Morton's order: the place on a curve through a cube about the origin.
fn along(at: DVec3) -> u64 {
    let middle = f64::from(1_u32 << (BITS - 1));
    // A cast saturates, and takes NaN to 0.
    let [x, y, z] = at.to_array().map(|x| ((x + middle) as u32).min((1 << BITS) - 1));
    (0..BITS).fold(0, |all, bit| {
        let digit = |x: u32| u64::from(x >> bit & 1);
        all | (digit(x) << 2 | digit(y) << 1 | digit(z)) << (3 * bit)
    })
}

/// Splitmix64 \[SLF14\].
pub fn random(i: u64) -> u64 {
    let z = i.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
