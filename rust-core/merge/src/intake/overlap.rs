//! Distances between scans that overlap.

use rayon::prelude::*;

use crate::crossings::bundles::{RawBundle, in_sample};
use crate::crossings::crossing::Crossing;
use crate::crossings::lines::for_each_line;
use crate::crossings::scan_order::ScanOrder;
use base::error::Result;
use base::progress::Progress;

/// Bins a cell for distances between scans.
const BINS_PER_CELL: f64 = 32.0;
/// Distances beyond this many cells are other surfaces.
const REACH: f64 = 8.0;
/// Less of the pairs, or fewer of the crossings in pairs, may be near each other by chance.
const LEAST_SHARE: f64 = 0.25;
const LEAST_PAIRED: f64 = 0.03;
/// Pairs on the lines of an axis that tell something of it.
const LEAST_PAIRS: f64 = 50.0;
/// Parts of the reach of which the emptiest counts.
const PARTS: usize = 8;
/// Lines more oblique than this say little about the distance along the normal.
const LEAST_NORMAL: f32 = 0.5;

/// Distances along the normal between the crossings of scans that follow each other in order, with the same sign: of each
/// the nearest, so that they do not shrink as scans are added.
#[derive(Clone, Debug)]
pub struct OverlapDistances {
    /// By the axis of the lines.
    of_axis: [Counts; 3],
}

#[derive(Clone, Debug)]
struct Counts {
    /// Pairs, by distance.
    pairs: Vec<f64>,
    /// Crossings that could have been in pairs.
    crossings: f64,
}

impl Counts {
    fn none() -> Self {
        Counts { pairs: vec![0.0; (REACH * BINS_PER_CELL) as usize], crossings: 0.0 }
    }

    fn add(&mut self, other: &Counts) {
        self.pairs.iter_mut().zip(&other.pairs).for_each(|(a, b)| *a += b);
        self.crossings += other.crossings;
    }
}

/// The same of one bundle: few distances are met in it.
#[derive(Clone, Debug, Default)]
pub struct BundleDistances {
    /// Bins with their pairs.
    pairs: Box<[(u16, f64)]>,
    crossings: f64,
}

impl BundleDistances {
    /// Whether no crossing was looked at.
    pub fn is_none(&self) -> bool {
        self.crossings == 0.0
    }

    /// Measures a bundle. `are_sampled` as in [`OverlapDistances::measure`].
    pub fn measure(raw: &RawBundle, scan_order: &ScanOrder<'_>, are_sampled: bool) -> Self {
        let mut counts = Counts::none();
        counts.count(raw, scan_order, are_sampled);
        let pairs = (0..).zip(counts.pairs).filter(|bin| bin.1 > 0.0).collect();
        BundleDistances { pairs, crossings: counts.crossings }
    }
}

impl OverlapDistances {
    /// Of no bundle.
    pub fn none() -> Self {
        OverlapDistances { of_axis: [0; 3].map(|_| Counts::none()) }
    }

    /// They in numbers, exactly.
    pub fn to_numbers(&self) -> Vec<f64> {
        self.of_axis.iter().flat_map(|of| of.pairs.iter().copied().chain([of.crossings])).collect()
    }

    /// The distances that [`OverlapDistances::to_numbers`] wrote. `None` for other numbers.
    pub fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let mut all = Self::none();
        let each = all.of_axis[0].pairs.len() + 1;
        if numbers.len() != each * all.of_axis.len() {
            return None;
        }
        for (of_axis, numbers) in all.of_axis.iter_mut().zip(numbers.chunks(each)) {
            of_axis.pairs.copy_from_slice(&numbers[..each - 1]);
            of_axis.crossings = numbers[each - 1];
        }
        Some(all)
    }

    /// Adds those of a bundle of lines along an axis.
    pub fn add(&mut self, axis: u8, bundle: &BundleDistances) {
        let counts = &mut self.of_axis[axis as usize];
        bundle.pairs.iter().for_each(|&(bin, pairs)| counts.pairs[bin as usize] += pairs);
        counts.crossings += bundle.crossings;
    }

    /// Measures all lines or, where crossings were so many that they were added up, the sample that was kept of them. O(crossings).
    ///
    /// # Errors
    /// Cancelled.
    pub fn measure(
        bundles: &[RawBundle],
        scan_order: &ScanOrder<'_>,
        are_sampled: bool,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        bundles
            .par_iter()
            .try_fold(Self::none, |mut all, raw| {
                progress.check()?;
                all.of_axis[raw.key.axis as usize].count(raw, scan_order, are_sampled);
                Ok(all)
            })
            .try_reduce(Self::none, |mut a, b| {
                a.of_axis.iter_mut().zip(&b.of_axis).for_each(|(a, b)| a.add(b));
                Ok(a)
            })
    }

    /// The distance in cells that this share of the pairs stays below. `None` if too few scans overlap to tell.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let mut all = Counts::none();
        self.of_axis.iter().for_each(|of_axis| all.add(of_axis));
        all.quantile(share)
    }

    /// The distance that a quarter of the pairs stays below, on the lines of the axis where that is most. Level surfaces say nothing of
    /// errors to the side. Veils and things that moved, which fit nothing, are the smaller part.
    pub fn largest_quarter(&self) -> Option<f64> {
        let told = |counts: &&Counts| counts.pairs.iter().sum::<f64>() >= LEAST_PAIRS;
        let quarters = self.of_axis.iter().filter(told).filter_map(|of_axis| of_axis.quantile(0.25));
        quarters.reduce(f64::max)
    }
}

impl Counts {
    /// Counts the pairs of a bundle.
    fn count(&mut self, raw: &RawBundle, scan_order: &ScanOrder<'_>, are_sampled: bool) {
        let sample;
        let chunks = if are_sampled {
            let rest = raw.found.chunks.iter().flatten().copied();
            let rest = rest.filter(|c| in_sample(&raw.key, c, scan_order));
            sample = [raw.found.added.sample.iter().copied().chain(rest).collect()];
            &sample[..]
        } else {
            &raw.found.chunks[..]
        };
        for_each_line(chunks, |_, line| {
            line.retain(|c| c.normal.abs() >= LEAST_NORMAL);
            self.crossings += line.len() as f64;
            let place = |c: &Crossing| scan_order.place(c.scan()).expect("it is of a scan of the order") as u32;
            line.iter_mut().for_each(|c| *c = c.of_scan(place(c)));
            // Stable: within a scan they stay in order along the line.
            line.sort_by_key(|c| (c.enters(), c.scan()));
            let of_scan: Vec<&[Crossing]> =
                line.chunk_by(|a, b| (a.enters(), a.scan()) == (b.enters(), b.scan())).collect();
            for pair in of_scan.windows(2).filter(|pair| pair[0][0].enters() == pair[1][0].enters()) {
                let nearest = pair[1].iter().map(|other| distance(&pair[0][0], other)).fold(REACH, f64::min);
                if let Some(count) = self.pairs.get_mut((nearest * BINS_PER_CELL) as usize) {
                    *count += 1.0;
                }
            }
        });
    }

    /// Surfaces of other parts are met at any distance alike, the same surface near its own: what the emptiest part of the reach
    /// holds is taken off everywhere.
    fn quantile(&self, share: f64) -> Option<f64> {
        let part = self.pairs.len() / PARTS;
        let means = self.pairs.chunks(part).map(|bins| bins.iter().sum::<f64>() / bins.len() as f64);
        let other = means.fold(f64::INFINITY, f64::min);
        let total: f64 = self.pairs.iter().map(|count| count - other).sum();
        if total <= (LEAST_SHARE * self.pairs.iter().sum::<f64>()).max(LEAST_PAIRED * self.crossings) {
            return None;
        }
        let mut left = total * share;
        for (bin, count) in self.pairs.iter().map(|count| (count - other).max(0.0)).enumerate() {
            if left <= count {
                return Some((bin as f64 + left / count) / BINS_PER_CELL);
            }
            left -= count;
        }
        None
    }
}

/// Distance of two crossings of a line along their mean normal, in cells.
fn distance(a: &Crossing, b: &Crossing) -> f64 {
    let along = f64::from(b.cell - a.cell) + f64::from(b.fraction - a.fraction);
    let normal = 0.5 * f64::from(a.normal + b.normal);
    (along * normal + b.residual() - a.residual()).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distances(count: impl Fn(f64) -> f64) -> Counts {
        let bins = (0..(REACH * BINS_PER_CELL) as usize).map(|bin| count((bin as f64 + 0.5) / BINS_PER_CELL));
        Counts { pairs: bins.collect(), crossings: 0.0 }
    }

    #[test]
    fn other_surfaces_do_not_count() {
        let near = |d: f64| if d < 1.0 { 1000.0 } else { 0.0 };
        for other in [0.0, 20.0, 100.0] {
            let found = distances(|d| near(d) + other);
            for share in [0.25, 0.5, 0.95] {
                assert!((found.quantile(share).unwrap() - share).abs() < 1e-9, "{share} beside {other}");
            }
        }
        assert_eq!(distances(|_| 1000.0).quantile(0.5), None);
        // Far apart, all of them.
        let far = distances(|d| if d > 5.0 && d < 6.0 { 100.0 } else { 0.0 });
        assert!((far.quantile(0.5).unwrap() - 5.5).abs() < 1e-9);
        assert_eq!(distances(|_| 0.0).quantile(0.5), None);
        let few = Counts { crossings: 1.1e6, ..distances(near) };
        assert_eq!(few.quantile(0.5), None);
        assert!(Counts { crossings: 1e6, ..few }.quantile(0.5).is_some());
    }
}
