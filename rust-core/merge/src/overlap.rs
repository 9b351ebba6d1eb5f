//! How far scans that overlap lie from each other.

use rayon::prelude::*;

use super::bundles::{RawBundle, in_sample};
use super::crossing::Crossing;
use super::lines::for_each_line;
use base::error::Result;
use base::progress::Progress;

/// Bins a cell for distances between scans.
const BINS_PER_CELL: f64 = 32.0;
/// Distances beyond this many cells are other surfaces.
const REACH: f64 = 8.0;
/// Less of the pairs, or fewer of the crossings in pairs, may be near each other by chance.
const LEAST_SHARE: f64 = 0.25;
const LEAST_PAIRED: f64 = 0.03;
/// Lines more oblique than this say little about the distance along the normal.
const LEAST_NORMAL: f32 = 0.5;

/// Distances along the normal between the crossings of scans that follow each other in number, with the same sign: of each
/// the nearest, so that they do not shrink as scans are added.
#[derive(Clone, Debug)]
pub struct OverlapDistances {
    counts: Vec<u64>,
    /// Crossings that could have been in pairs.
    crossings: u64,
}

impl OverlapDistances {
    /// Measures all lines or, of so many scans that crossings were added up, the sample that was kept of them. O(crossings).
    ///
    /// # Errors
    /// Cancelled.
    pub fn measure(bundles: &[RawBundle], sampled: Option<usize>, progress: &Progress<'_>) -> Result<Self> {
        let empty = || OverlapDistances { counts: vec![0; (REACH * BINS_PER_CELL) as usize], crossings: 0 };
        bundles
            .par_iter()
            .try_fold(empty, |mut all, raw| {
                progress.check()?;
                let sample;
                let chunks = match sampled {
                    None => &raw.found.chunks[..],
                    Some(scans) => {
                        let rest = raw.found.chunks.iter().flatten().copied();
                        let rest = rest.filter(|c| in_sample(&raw.key, c, scans));
                        sample = [raw.found.added.sample.iter().copied().chain(rest).collect()];
                        &sample[..]
                    }
                };
                for_each_line(chunks, |_, line| {
                    line.retain(|c| c.normal.abs() >= LEAST_NORMAL);
                    all.crossings += line.len() as u64;
                    // Stable: within a scan they stay in order along the line.
                    line.sort_by_key(|c| (c.enters(), c.scan()));
                    let of_scan: Vec<&[Crossing]> =
                        line.chunk_by(|a, b| (a.enters(), a.scan()) == (b.enters(), b.scan())).collect();
                    for pair in of_scan.windows(2).filter(|pair| pair[0][0].enters() == pair[1][0].enters()) {
                        let nearest = pair[1].iter().map(|other| distance(&pair[0][0], other)).fold(REACH, f64::min);
                        if let Some(count) = all.counts.get_mut((nearest * BINS_PER_CELL) as usize) {
                            *count += 1;
                        }
                    }
                });
                Ok(all)
            })
            .try_reduce(empty, |a, b| {
                let counts = a.counts.iter().zip(&b.counts).map(|(a, b)| a + b).collect();
                Ok(OverlapDistances { counts, crossings: a.crossings + b.crossings })
            })
    }

    /// The distance in cells that this share of the pairs stays below; `None` where too few scans overlap to tell.
    ///
    /// Surfaces of other parts are met at any distance alike, the same surface near by: what the farther half of the reach
    /// holds is taken off everywhere.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let counts = || self.counts.iter().map(|&count| count as f64);
        let far = self.counts.len() / 2;
        let other = counts().skip(far).sum::<f64>() / far as f64;
        let total: f64 = counts().map(|count| count - other).sum();
        if total <= (LEAST_SHARE * counts().sum::<f64>()).max(LEAST_PAIRED * self.crossings as f64) {
            return None;
        }
        let mut left = total * share;
        for (bin, count) in counts().map(|count| (count - other).max(0.0)).enumerate() {
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

    fn distances(count: impl Fn(f64) -> f64) -> OverlapDistances {
        let counts = (0..(REACH * BINS_PER_CELL) as usize).map(|bin| count((bin as f64 + 0.5) / BINS_PER_CELL) as u64);
        OverlapDistances { counts: counts.collect(), crossings: 0 }
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
        assert_eq!(distances(|d| 1000.0 * d).quantile(0.5), None);
        assert_eq!(distances(|_| 0.0).quantile(0.5), None);
        let few = OverlapDistances { crossings: 1_100_000, ..distances(near) };
        assert_eq!(few.quantile(0.5), None);
        assert!(OverlapDistances { crossings: 1_000_000, ..few }.quantile(0.5).is_some());
    }
}
