//! Voxel and merge distance from the data, where the caller gives none.

use rayon::prelude::*;

use super::bundles::{MANY, RawBundle, in_sample};
use super::crossing::Crossing;
use super::lines::for_each_line;
use base::error::{Error, Result};
use base::progress::Progress;
use image::source::{Loading, OrientedSurface, ScanSource};
use image::triangulate::TriangulateParams;

/// Voxel in mean nearest-neighbour distances. [MI04, sec. 3.1]
const VOXEL_FACTOR: f64 = 3.0;
/// At most this many scans are read for the voxel.
const VOXEL_SCANS: usize = 8;
/// Distances of more than this many medians of their scan are mistakes, which must not count.
const OUTLIER: f64 = 10.0;

/// Three times the mean distance of a sample to its nearest neighbour within its scan, over up to eight scans spread
/// evenly through the list. Outliers don't count.
///
/// # Errors
/// A scan can't be loaded; no scan has a triangle; cancelled.
pub fn voxel(sources: &[&dyn ScanSource], triangulation: &TriangulateParams, progress: &Progress<'_>) -> Result<f64> {
    let count = sources.len().min(VOXEL_SCANS);
    let sums = (0..count)
        .into_par_iter()
        .map(|i| {
            progress.check()?;
            let source = sources[i * sources.len() / count];
            let surface = source.load(&Loading { triangulation: *triangulation, cell: 0.0 }, progress)?;
            Ok(nearest_neighbour_sum(&surface))
        })
        .collect::<Result<Vec<_>>>()?;
    let (sum, samples) = sums.iter().fold((0.0, 0_u64), |(s, n), &(sum, samples)| (s + sum, n + samples));
    if samples > 0 && sum <= 0.0 {
        return Err(Error::input(
            "the samples of the scans are so close to each other that their distance counts as 0: use a smaller unit",
        ));
    }
    if samples == 0 {
        return Err(Error::input(
            "no scan has a triangle, so there is nothing to merge: check the scans or raise edge_limit",
        ));
    }
    Ok(VOXEL_FACTOR * sum / samples as f64)
}

/// Sum of the world lengths of each vertex's shortest edge, and the number of vertices with an edge, both without outliers.
fn nearest_neighbour_sum(surface: &OrientedSurface) -> (f64, u64) {
    let world: Vec<_> = surface.positions.iter().map(|&p| surface.world_from_surface.transform_vector3(p)).collect();
    let mut nearest = vec![f64::INFINITY; world.len()];
    for t in &surface.triangles {
        for i in 0..3 {
            let (a, b) = (t[i] as usize, t[(i + 1) % 3] as usize);
            let length = world[a].distance(world[b]);
            nearest[a] = nearest[a].min(length);
            nearest[b] = nearest[b].min(length);
        }
    }
    nearest.retain(|d| d.is_finite());
    if nearest.is_empty() {
        return (0.0, 0);
    }
    let mut sorted = nearest.clone();
    let most = OUTLIER * *sorted.select_nth_unstable_by(nearest.len() / 2, f64::total_cmp).1;
    nearest.iter().filter(|&&d| d <= most).fold((0.0, 0), |(sum, n), d| (sum + d, n + 1))
}

/// Bins a cell for distances between scans.
const BINS_PER_CELL: f64 = 32.0;
/// Distances beyond this many cells are other surfaces.
const REACH: f64 = 8.0;
/// Lines more oblique than this say little about the distance along the normal.
const LEAST_NORMAL: f32 = 0.5;

/// Distances along the normal between the crossings of scans that follow each other in number, with the same sign: of each
/// the nearest, so that they do not shrink as scans are added.
#[derive(Clone, Debug)]
pub struct OverlapDistances {
    counts: Vec<u64>,
}

impl OverlapDistances {
    /// Measures all lines or, where many crossings were found, a sample of `scans` scans. O(crossings).
    ///
    /// # Errors
    /// Cancelled.
    pub fn measure(bundles: &[RawBundle], found: u64, scans: usize, progress: &Progress<'_>) -> Result<Self> {
        let empty = || vec![0_u64; (REACH * BINS_PER_CELL) as usize];
        let counts = bundles
            .par_iter()
            .try_fold(empty, |mut counts, raw| {
                progress.check()?;
                let sample;
                let chunks = if found <= MANY {
                    &raw.found.chunks
                } else {
                    let rest = raw.found.chunks.iter().flatten().copied();
                    let rest = rest.filter(|c| in_sample(&raw.key, c, scans));
                    sample = [raw.found.added.sample.iter().copied().chain(rest).collect()];
                    &sample[..]
                };
                for_each_line(chunks, |_, line| {
                    line.retain(|c| c.normal.abs() >= LEAST_NORMAL);
                    // Stable: within a scan they stay in order along the line.
                    line.sort_by_key(|c| (c.enters(), c.scan()));
                    let of_scan: Vec<&[Crossing]> =
                        line.chunk_by(|a, b| (a.enters(), a.scan()) == (b.enters(), b.scan())).collect();
                    for pair in of_scan.windows(2).filter(|pair| pair[0][0].enters() == pair[1][0].enters()) {
                        let nearest = pair[1].iter().map(|other| distance(&pair[0][0], other)).fold(REACH, f64::min);
                        if let Some(count) = counts.get_mut((nearest * BINS_PER_CELL) as usize) {
                            *count += 1;
                        }
                    }
                });
                Ok(counts)
            })
            .try_reduce(empty, |a, b| Ok(a.iter().zip(&b).map(|(a, b)| a + b).collect()))?;
        Ok(OverlapDistances { counts })
    }

    /// The distance in cells that this share of the pairs stays below; `None` without a pair.
    pub fn quantile(&self, share: f64) -> Option<f64> {
        let total: u64 = self.counts.iter().sum();
        let mut left = (total as f64 * share).ceil() as u64;
        for (bin, &count) in self.counts.iter().enumerate() {
            if left <= count && total > 0 {
                return Some((bin as f64 + left as f64 / count as f64) / BINS_PER_CELL);
            }
            left -= count.min(left);
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
