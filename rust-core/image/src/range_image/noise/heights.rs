//! Measures of an image's tiles: differences of their heights, how they lie, the steps of their values.

use std::ops::Range;

use glam::DVec3;

use super::super::projection::Tables;
use super::super::{DepthKind, Projection, RangeImage, Samples, Viewing};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Side of a tile in pixels: large enough for a deviation good to 6 %, small enough to lie between edges.
pub(super) const TILE: usize = 16;

/// Factors of a fourth difference along a line. Products of those of two second ones make a fourth one across a square.
const FOURTH: [f64; 5] = [1.0, -4.0, 6.0, -4.0, 1.0];
const SECOND: [f64; 3] = [1.0, -2.0, 1.0];

/// Fewer differences of a kind say nothing.
const LEAST: usize = 32;

/// Share of the differences of a tile, the smallest, that count: the others may lie across jumps.
const INLIERS: f64 = 0.75;

/// Standard deviation of a normally distributed x by the mean of that share of |x|.
const BY_INLIERS: f64 = 1.941_96;

/// Lag of the differences by which slopes are measured, in pixels.
const SLOPE_LAG: usize = 4;

/// A part of the image with at least one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    pub(super) top: usize,
    pub(super) left: usize,
    /// Samples in it.
    pub(super) count: usize,
    pub(super) range: f64,
    pub(super) obliquity: f64,
    /// Coordinate along the ray.
    pub(super) depth: f64,
    /// Length along the ray of a unit of height.
    pub(super) unit: f64,
    /// Standard deviation along the ray that differences at a lag and at twice that lag show.
    pub(super) deviations: Option<[f64; 2]>,
    /// Smallest difference along the ray of neighbours in a row, but 0. Infinite for none.
    pub(super) step: f64,
    /// Share of the neighbours in a row that are equal.
    pub(super) equal: f64,
}

/// A number per pixel that is linear in row and column where the surface is a plane. NaN for an invalid pixel.
pub struct Heights {
    pub heights: Vec<f64>,
    pub(super) rows: usize,
    pub(super) cols: usize,
    /// Tiles side by side.
    pub(super) across: usize,
}

impl Heights {
    /// Of an image. O(pixels).
    ///
    /// # Errors
    /// Cancelled.
    pub fn new(image: &RangeImage, progress: &Progress<'_>) -> Result<Heights> {
        let (rows, cols, projection) = (image.rows(), image.cols(), image.projection());
        let inverse = projection.eye().is_some();
        let mut heights = Vec::with_capacity(image.len());
        for block in progress.ranges(image.len()) {
            let block = block?;
            match (image.samples(), projection) {
                (Samples::Values(values), Projection::Pinhole { depth: DepthKind::Ray, .. }) => {
                    heights.extend(block.map(|i| projection.point(i / cols, i % cols, values[i]).z.recip()));
                }
                (Samples::Values(values), _) if inverse => heights.extend(values[block].iter().map(|v| v.recip())),
                (Samples::Values(values), _) => heights.extend_from_slice(&values[block]),
                (Samples::Points(_), _) if inverse => heights.extend(block.map(|i| image.range(i).recip())),
                (Samples::Points(_), _) => heights.extend(block.map(|i| image.range(i))),
            }
        }
        Ok(Heights { heights, rows, cols, across: cols.div_ceil(TILE) })
    }

    /// Tiles of the image, without deviations: all that have samples or, of more, about `most`, evenly.
    pub(super) fn tiles(&self, image: &RangeImage, most: usize, progress: &Progress<'_>) -> Result<Vec<Tile>> {
        let mut counts = vec![0_usize; self.across * self.rows.div_ceil(TILE)];
        let mut pace = Pace::new(progress);
        for (row, heights) in self.heights.chunks_exact(self.cols.max(1)).enumerate() {
            for (count, heights) in counts[row / TILE * self.across..].iter_mut().zip(heights.chunks(TILE)) {
                *count += heights.iter().filter(|height| !height.is_nan()).count();
            }
            pace.after(self.cols)?;
        }
        let with_samples = counts.iter().filter(|&&count| count > 0).count();
        let wanted = most.min(with_samples);
        let unproject = image.projection().tables(self.rows, self.cols);
        let (mut tiles, mut scratch) = (Vec::with_capacity(wanted), Vec::new());
        for (number, (index, &count)) in counts.iter().enumerate().filter(|(_, count)| **count > 0).enumerate() {
            // As many as there are steps of wanted / with_samples that begin here.
            if (number + 1) * wanted / with_samples > number * wanted / with_samples {
                let (top, left) = (index / self.across * TILE, index % self.across * TILE);
                tiles.push(self.tile(image, &unproject, [top, left], count, &mut scratch));
                pace.after(TILE * TILE)?;
            }
        }
        Ok(tiles)
    }

    fn tile(
        &self,
        image: &RangeImage,
        unproject: &Tables<'_>,
        [top, left]: [usize; 2],
        count: usize,
        scratch: &mut Vec<f64>,
    ) -> Tile {
        let projection = image.projection();
        let mut points = [[DVec3::NAN; TILE]; TILE];
        let (mut position, mut height) = (DVec3::ZERO, 0.0);
        for (points, pixels) in points.iter_mut().zip(self.rows_of(top, left, [[0, 0]; 2])) {
            for (point, pixel) in points.iter_mut().zip(pixels) {
                if !self.heights[pixel].is_nan() {
                    *point = match image.samples() {
                        Samples::Values(values) => unproject.point(pixel / self.cols, pixel % self.cols, values[pixel]),
                        Samples::Points(_) => image.point_in_sensor(pixel),
                    };
                    position += *point;
                    height += self.heights[pixel];
                }
            }
        }
        let (position, height) = (position / count as f64, height / count as f64);
        let (ray, range) = (projection.view_direction(position), range(projection, position));
        // How far a sample moves along its ray when its height grows by 1.
        let move_by_height = match projection {
            Projection::Orthographic { .. } => -1.0,
            Projection::PointGrid(Viewing::Parallel(_)) => 1.0,
            _ => -range / height,
        };
        // Across the rays samples lie where they should; along them the mean would follow jumps.
        let [right, down] = self.slopes(top, left, scratch);
        let edge = |[down, right]: [usize; 2], slope: f64| {
            let (mut sum, mut count) = (DVec3::ZERO, 0.0);
            for row in 0..TILE - down {
                for col in 0..TILE - right {
                    let edge = points[row + down][col + right] - points[row][col];
                    (sum, count) = if edge.x.is_nan() { (sum, count) } else { (sum + edge, count + 1.0) };
                }
            }
            let mean = sum / count;
            mean - ray * mean.dot(ray) + ray * (slope * move_by_height)
        };
        let normal = edge([0, 1], right).cross(edge([1, 0], down)).normalize();
        // Values lie on steps of what the sensor measures: depth, its inverse, or the distance along the ray.
        let heights = self.rows_of(top, left, [[0, 0]; 2]).map(|pixels| &self.heights[pixels]);
        let by_height = steps(heights.flat_map(|row| row.windows(2)).map(|pair| [pair[0], pair[1]]));
        let distances = |pair: &[DVec3]| [pair[0], pair[1]].map(|point| self::range(projection, point));
        let by_range = match projection.eye() {
            Some(_) => steps(points.iter().flat_map(|row| row.windows(2)).map(distances)),
            None => (f64::INFINITY, 0.0),
        };
        let (step, equal) =
            if by_range.1 > by_height.1 { by_range } else { (by_height.0 * f64::abs(move_by_height), by_height.1) };
        Tile {
            top,
            left,
            count,
            range,
            obliquity: obliquity(normal.dot(ray)),
            depth: if projection.eye().is_some() { range } else { height },
            unit: f64::abs(move_by_height),
            deviations: None,
            step,
            equal,
        }
    }

    /// The pixels of a tile, row by row, that are at least so many rows and columns from the borders before and after them.
    fn rows_of(&self, top: usize, left: usize, [before, after]: [[usize; 2]; 2]) -> impl Iterator<Item = Range<usize>> {
        let end = |start: usize, count: usize, after: usize| (start + TILE).min(count.saturating_sub(after));
        let (first, last) = (left.max(before[1]), end(left, self.cols, after[1]));
        let rows = if first < last { top.max(before[0])..end(top, self.rows, after[0]) } else { 0..0 };
        rows.map(move |row| row * self.cols + first..row * self.cols + last)
    }

    /// Median slopes of a tile to the right and down, in height by pixel. NaN if no samples are as far apart as needed.
    fn slopes(&self, top: usize, left: usize, scratch: &mut Vec<f64>) -> [f64; 2] {
        [([0, SLOPE_LAG], SLOPE_LAG), ([SLOPE_LAG, 0], SLOPE_LAG * self.cols)].map(|(after, ahead)| {
            scratch.clear();
            for pixels in self.rows_of(top, left, [[0, 0], after]) {
                let pairs = self.heights[pixels.clone()].iter().zip(&self.heights[pixels.start + ahead..]);
                scratch.extend(pairs.map(|(here, there)| there - here).filter(|difference| !difference.is_nan()));
            }
            if scratch.is_empty() {
                return f64::NAN;
            }
            let middle = scratch.len() / 2;
            *scratch.select_nth_unstable_by(middle, f64::total_cmp).1 / SLOPE_LAG as f64
        })
    }

    /// Measures the deviations of tiles by differences at `lag` and at twice that.
    pub(super) fn differ(&self, tiles: &mut [Tile], lag: usize, progress: &Progress<'_>) -> Result<()> {
        let mut pace = Pace::new(progress);
        for tile in tiles {
            let near = self.deviation(tile, lag);
            let far = self.deviation(tile, 2 * lag);
            tile.deviations = near.map(|(near, _)| [near, far.map_or(f64::INFINITY, |(far, _)| far)]);
            pace.after(2 * TILE * TILE)?;
        }
        Ok(())
    }

    /// Standard deviation along the ray that differences at this lag show, and their number. `None` for too few of them.
    pub(super) fn deviation(&self, tile: &Tile, lag: usize) -> Option<(f64, f64)> {
        let down = lag * self.cols;
        let line = |step: usize| [0, 1, 2, 3, 4].map(|i| (i * step, FOURTH[i]));
        let square = std::array::from_fn::<_, 9, _>(|i| (i / 3 * down + i % 3 * lag, SECOND[i / 3] * SECOND[i % 3]));
        let kinds = [
            self.variance(tile, [0, 2 * lag], &line(lag)),
            self.variance(tile, [2 * lag, 0], &line(down)),
            self.variance(tile, [lag, lag], &square),
        ];
        let count: f64 = kinds.iter().map(|(_, count)| count).sum();
        let sum: f64 = kinds.iter().map(|(variance, count)| variance * count).sum();
        (count > 0.0).then(|| ((sum / count).sqrt() * tile.unit, count))
    }

    /// Variance of the heights of a tile by differences that reach so many rows and columns to all sides, and the number of those. 0 for
    /// too few. A difference is the sum of heights so many pixels after the first it reaches, times factors.
    fn variance(&self, tile: &Tile, reach: [usize; 2], terms: &[(usize, f64)]) -> (f64, f64) {
        // Bits of numbers >= 0 are sorted as they are.
        let mut bits = [0; TILE * TILE];
        let mut count = 0;
        let before = reach[0] * self.cols + reach[1];
        for pixels in self.rows_of(tile.top, tile.left, [reach; 2]) {
            let mut differences = [0.0; TILE];
            for &(after, factor) in terms {
                let heights = &self.heights[pixels.start - before + after..][..pixels.len()];
                for (difference, height) in differences.iter_mut().zip(heights) {
                    *difference += factor * height;
                }
            }
            for difference in &differences[..pixels.len()] {
                // Chosen, not branched on: where an image has holes is hard to guess.
                bits[count] = difference.abs().to_bits();
                count += usize::from(!difference.is_nan());
            }
        }
        if count < LEAST {
            return (0.0, 0.0);
        }
        let inliers = (INLIERS * count as f64) as usize;
        bits[..count].select_nth_unstable(inliers);
        let mean = bits[..inliers].iter().map(|&bits| f64::from_bits(bits)).sum::<f64>() / inliers as f64;
        let gain: f64 = terms.iter().map(|(_, factor)| factor * factor).sum();
        ((BY_INLIERS * mean).powi(2) / gain, count as f64)
    }
}

/// Differences smaller than this share of the values are rounding errors, of single precision.
const ROUNDING: f64 = 5e-7;

/// Smallest difference of neighbours, but 0, and the share of those that are equal.
fn steps(neighbours: impl Iterator<Item = [f64; 2]>) -> (f64, f64) {
    let (mut least, mut equal, mut count) = (f64::INFINITY, 0, 0);
    for [here, there] in neighbours {
        let difference = (there - here).abs();
        let is_equal = difference <= ROUNDING * here.abs();
        count += usize::from(!difference.is_nan());
        equal += usize::from(is_equal);
        least = if !is_equal && difference < least { difference } else { least };
    }
    (least, equal as f64 / count.max(1) as f64)
}

const MOST_OBLIQUE: f64 = 19.0;

/// 1 / cos - 1, at most [`MOST_OBLIQUE`]. 0 for NaN, if the normal isn't known.
pub(super) fn obliquity(cosine: f64) -> f64 {
    if cosine.is_nan() { 0.0 } else { (1.0 / cosine.abs() - 1.0).clamp(0.0, MOST_OBLIQUE) }
}

/// Distance from the sensor. 0 for parallel rays, whose noise is the same everywhere.
pub(super) fn range(projection: &Projection, position: DVec3) -> f64 {
    projection.eye().map_or(0.0, |eye| position.distance(eye))
}
