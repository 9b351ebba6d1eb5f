//! Blocks of pixels in place of pixels: where pixels are finer than what is wanted of an image and their noise is large,
//! they are averaged before anything else is made of them.
//!
//! A plane is linear in the *heights* of its pixels (1 / range where rays fan out). So the mean of a block's heights is the plane's at the
//! middle of the block: averaging moves no plane. A block that a jump runs through has the height of those of its samples that lie
//! together, the most of them. If a part of it is missing, the block has the height of their plane at its middle.

use super::noise::Noise;
use super::noise::heights::Heights;
use super::pitch::Pitch;
use super::{DepthKind, Projection, RangeImage, Samples, Viewing};
use base::error::Result;
use base::progress::Progress;
use mesh::srgb::Mix;

/// Blocks are not larger than this share of a cell, since relief of their size is lost. Nor are they so large that their own noise would be
/// less than 1 / 3 of their side. The noise that is left is taken out by smoothing along the surface.
const CELL: f64 = 0.9;
const NOISE: f64 = 3.0;
/// Largest side of a block, in pixels.
const LARGEST: usize = 8;
/// Every so manieth sample tells how noise and pixels compare.
const EVERY: usize = 61;
/// Samples of a block lie together within this many standard deviations, and this many times the distance of its pixels.
const DEVIATIONS: f64 = 6.0;
const STEEP: f64 = 6.0;

/// Pixels along a side of a block, for cells of this size.
pub fn side(image: &RangeImage, noise: &Noise, cell: f64) -> usize {
    if noise.typical() == 0.0 || cell == 0.0 {
        return 1;
    }
    let pitch = Pitch::of(image);
    let mut sides: Vec<f64> = (0..image.len())
        .step_by(EVERY)
        .filter(|&pixel| image.is_valid(pixel))
        .map(|pixel| {
            let range = image.range(pixel);
            let (pitch, sigma) = (pitch.at_range(range), noise.deviation(range, 1.0));
            (CELL * cell / pitch).min((NOISE * sigma / pitch).sqrt())
        })
        .collect();
    let middle = sides.len() / 2;
    let typical = if sides.is_empty() { 1.0 } else { *sides.select_nth_unstable_by(middle, f64::total_cmp).1 };
    (typical as usize).clamp(1, LARGEST)
}

/// Samples of less spread than this, in pixels to the fourth, lie on one line: three neighbours have 1 / 3.
const LEAST_SPREAD: f64 = 0.1;

/// The image whose pixels are blocks of `side` x `side` of this one's. All that is neither sample, colour nor confidence is left out.
/// O(pixels).
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn averaged(image: &RangeImage, noise: &Noise, side: usize, progress: &Progress<'_>) -> Result<RangeImage> {
    let heights = Heights::new(image, progress)?.heights;
    let (rows, cols) = (image.rows().div_ceil(side), image.cols().div_ceil(side));
    let projection = coarser(image.projection(), side);
    let pitch = Pitch::of(image);
    let fans_out = image.projection().eye().is_some();
    // How far apart heights of one surface are at most.
    let limit = |height: f64| {
        let range = if fans_out { height.recip() } else { 0.0 };
        let along = (side - 1) as f64 * STEEP * pitch.at_range(range) + DEVIATIONS * noise.deviation(range, 1.0);
        if fans_out { along * height * height } else { along }
    };
    let mut values = Vec::with_capacity(rows * cols);
    let mut points = Vec::new();
    let mut colour = image.colour.as_ref().map(|_| Vec::with_capacity(rows * cols));
    let mut confidence = image.confidence.as_ref().map(|_| Vec::with_capacity(rows * cols));
    let mut block = Block::default();
    for row in 0..rows {
        progress.check()?;
        for col in 0..cols {
            block.fill(&heights, [image.rows(), image.cols()], [row * side, col * side], side);
            block.keep_one_surface(limit, side);
            let height = block.height(side);
            match image.samples() {
                Samples::Values(_) => values.push(value(&projection, row, col, height)),
                Samples::Points(all) => points.push(block.mean_point(all)),
            }
            if let (Some(blocks), Some(pixels)) = (&mut colour, &image.colour) {
                blocks.push(block.mean_colour(pixels));
            }
            if let (Some(blocks), Some(pixels)) = (&mut confidence, &image.confidence) {
                blocks.push(block.mean::<1>(|pixel, _| pixels[pixel])[0]);
            }
        }
    }
    let mut blocks = match image.samples() {
        Samples::Values(_) => RangeImage::from_values(rows, cols, values, projection)?,
        Samples::Points(_) => {
            let Projection::PointGrid(viewing) = projection else { unreachable!("points without a point grid") };
            RangeImage::from_points(rows, cols, points, viewing)?
        }
    };
    (blocks.name, blocks.world_from_sensor) = (image.name.clone(), image.world_from_sensor);
    (blocks.colour, blocks.confidence) = (colour, confidence);
    Ok(blocks)
}

/// The projection of blocks.
fn coarser(projection: &Projection, side: usize) -> Projection {
    let (side, middle) = (side as f64, 0.5 * (side - 1) as f64);
    let first = |first: [f64; 2], step: [f64; 2]| [first[0] + middle * step[0], first[1] + middle * step[1]];
    match *projection {
        Projection::Orthographic { first: f, step } => {
            Projection::Orthographic { first: first(f, step), step: step.map(|s| s * side) }
        }
        Projection::Spherical { first: f, step } => {
            Projection::Spherical { first: first(f, step), step: step.map(|s| s * side) }
        }
        Projection::Pinhole { focal, centre, depth } => {
            Projection::Pinhole { focal: focal.map(|f| f / side), centre: centre.map(|c| (c - middle) / side), depth }
        }
        Projection::PointGrid(viewing) => Projection::PointGrid(viewing),
    }
}

/// The value of a pixel at this height.
fn value(projection: &Projection, row: usize, col: usize, height: f64) -> f64 {
    match projection {
        Projection::Orthographic { .. } | Projection::PointGrid(Viewing::Parallel(_)) => height,
        Projection::Pinhole { depth: DepthKind::Ray, .. } => {
            let through = projection.point(row, col, 1.0);
            height.recip() / through.z
        }
        _ => height.recip(),
    }
}

/// A valid pixel of a block.
struct Sample {
    height: f64,
    pixel: usize,
    /// Rows and columns from the middle of the block.
    from_middle: [f64; 2],
}

/// The valid pixels of a block.
#[derive(Default)]
struct Block {
    samples: Vec<Sample>,
}

impl Block {
    fn fill(&mut self, heights: &[f64], [rows, cols]: [usize; 2], [top, left]: [usize; 2], side: usize) {
        self.samples.clear();
        let middle = 0.5 * (side - 1) as f64;
        for row in top..(top + side).min(rows) {
            for col in left..(left + side).min(cols) {
                let height = heights[row * cols + col];
                if !height.is_nan() {
                    let from_middle = [(row - top) as f64 - middle, (col - left) as f64 - middle];
                    self.samples.push(Sample { height, pixel: row * cols + col, from_middle });
                }
            }
        }
    }

    /// Keeps the most samples that lie together, or none where they are less than half of the block.
    fn keep_one_surface(&mut self, limit: impl Fn(f64) -> f64, side: usize) {
        let (low, high) = self.samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), sample| {
            (low.min(sample.height), high.max(sample.height))
        });
        if high - low > limit(low) {
            self.samples.sort_by(|a, b| a.height.total_cmp(&b.height));
            let end = |first: usize| {
                let least = self.samples[first].height;
                self.samples.partition_point(|sample| sample.height - least <= limit(least))
            };
            // Of equally many the nearest, of the largest heights where rays fan out.
            let best = (0..self.samples.len()).map(|first| (end(first) - first, first)).max();
            let (count, first) = best.expect("a block with two heights");
            self.samples.truncate(first + count);
            self.samples.drain(..first);
        }
        if 2 * self.samples.len() < side * side {
            self.samples.clear();
        }
    }

    /// The height of the plane through the samples at the middle of the block. NaN if they lie on one line.
    fn height(&self, side: usize) -> f64 {
        let count = self.samples.len() as f64;
        let mean = self.samples.iter().map(|sample| sample.height).sum::<f64>() / count;
        if self.samples.len() == side * side {
            return mean;
        }
        let sum = |of: &dyn Fn(&Sample) -> f64| self.samples.iter().map(of).sum::<f64>();
        let [y, x] = [0, 1].map(|axis| sum(&|sample| sample.from_middle[axis]) / count);
        let yy = sum(&|sample| (sample.from_middle[0] - y).powi(2));
        let xx = sum(&|sample| (sample.from_middle[1] - x).powi(2));
        let xy = sum(&|sample| (sample.from_middle[0] - y) * (sample.from_middle[1] - x));
        let (yh, xh) = (
            sum(&|sample| (sample.from_middle[0] - y) * sample.height),
            sum(&|sample| (sample.from_middle[1] - x) * sample.height),
        );
        let determinant = xx * yy - xy * xy;
        if determinant < LEAST_SPREAD {
            return f64::NAN;
        }
        mean - (x * (xh * yy - yh * xy) + y * (yh * xx - xh * xy)) / determinant
    }

    fn mean_point(&self, points: &[[f32; 3]]) -> [f32; 3] {
        if self.samples.is_empty() { [f32::NAN; 3] } else { self.mean(|pixel, axis| points[pixel][axis]) }
    }

    fn mean_colour(&self, colours: &[[u8; 4]]) -> [u8; 4] {
        let mut mix = Mix::default();
        self.samples.iter().for_each(|sample| mix.add(colours[sample.pixel], 1));
        mix.colour()
    }

    fn mean<const N: usize>(&self, of: impl Fn(usize, usize) -> f32) -> [f32; N] {
        let count = self.samples.len().max(1) as f32;
        std::array::from_fn(|i| self.samples.iter().map(|sample| of(sample.pixel, i)).sum::<f32>() / count)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::test_images::*;
    use super::*;

    const PIXELS: usize = 47;

    fn blocks_of(image: &RangeImage, side: usize) -> RangeImage {
        let none = &Progress::none();
        averaged(image, &Noise::measure(image, none).unwrap(), side, none).unwrap()
    }

    #[test]
    fn blocks_of_a_plane_lie_on_it() {
        for projection in projections(PIXELS, PIXELS) {
            let point = ahead(&projection);
            let normal = (point.normalize() + DVec3::new(0.2, -0.1, 0.15)).normalize();
            let plane_at = plane(point, normal);
            let index = std::cell::Cell::new(0_usize);
            // One pixel in eleven is missing.
            let image = render(PIXELS, PIXELS, projection, |origin, direction| {
                index.set(index.get() + 1);
                if index.get().is_multiple_of(11) { None } else { plane_at(origin, direction) }
            });
            // Seen spherically, a plane is linear up to the square of the angle between pixels.
            let most = if matches!(projection, Projection::Spherical { .. }) { 2e-3 } else { 1e-12 };
            for (side, image) in [(2, image.clone()), (3, image.clone()), (5, image.clone())] {
                let blocks = blocks_of(&image, side);
                assert_eq!([blocks.rows(), blocks.cols()], [PIXELS.div_ceil(side); 2]);
                assert!(blocks.valid_count() >= (PIXELS / side).pow(2), "{projection:?} {side}");
                blocks.for_each_valid(|row, col, at| {
                    let off = (at - point).dot(normal).abs();
                    assert!(off < most, "{projection:?}, blocks of {side}: {row}, {col} is off by {off}");
                });
            }
            let points = blocks_of(&as_point_grid(&image), 2);
            points.for_each_valid(|_, _, at| assert!((at - point).dot(normal).abs() < 1e-6, "{projection:?}"));
        }
    }

    #[test]
    fn nothing_lies_between_the_sides_of_a_jump() {
        for projection in projections(PIXELS, PIXELS) {
            let (centre, eye) = (ahead(&projection), projection.eye());
            let count = std::cell::Cell::new(0_usize);
            // Fans and parallel rays alike: columns from the 21st on lie further away.
            let image = render(PIXELS, PIXELS, projection, |origin, direction| {
                count.set(count.get() + 1);
                let far = if (count.get() - 1) % PIXELS > 20 { 1.5 } else { 1.0 };
                plane(centre * far, centre.normalize())(origin, direction)
            });
            for side in [2, 3, 4] {
                let blocks = blocks_of(&image, side);
                assert!(blocks.valid_count() + 2 * blocks.rows() + blocks.cols() >= blocks.len());
                blocks.for_each_valid(|_, _, at| {
                    let along = at.dot(centre.normalize()) / centre.length();
                    let near = (along - 1.0).abs().min((along - 1.5).abs());
                    assert!(near < 5e-3, "{projection:?} {eye:?}, blocks of {side}: {along}");
                });
            }
        }
    }

    #[test]
    fn clean_images_and_those_wanted_as_they_are_stay() {
        let projection = projections(PIXELS, PIXELS)[2];
        let image = render(PIXELS, PIXELS, projection, sphere(1.5 * ahead(&projection), 1.0));
        let none = &Progress::none();
        let noise = Noise::measure(&image, none).unwrap();
        assert_eq!(side(&image, &noise, 0.0), 1);
        assert_eq!(side(&image, &noise, 10.0), 1);
    }

    #[test]
    fn colours_and_confidences_are_means_of_what_counts() {
        let image = RangeImage::from_values(
            2,
            4,
            vec![1.0, 1.0, 1.0, 9.0, 1.0, 1.0, 1.0, 1.0],
            Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] },
        );
        let mut image = image.unwrap();
        image.colour = Some((0..8).map(|i| [10 * i, 0, 0, 255]).collect());
        image.confidence = Some(vec![1.0, 0.0, 0.5, 100.0, 1.0, 0.0, 0.5, 0.5]);
        let blocks = blocks_of(&image, 2);
        // In linear light; the mean of the bytes would be 25.
        assert_eq!(blocks.colour.as_ref().unwrap()[0], [31, 0, 0, 255]);
        let confidence = blocks.confidence.as_ref().unwrap();
        assert_eq!(confidence[0], 0.5);
        // The pixel far away is not of the surface.
        assert!((blocks.range(1) - 1.0).abs() < 1e-12 && confidence[1] == 0.5, "{} {confidence:?}", blocks.range(1));
    }
}
