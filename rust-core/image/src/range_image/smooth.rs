//! Noise taken out of a range image, along its rays.
//!
//! A plane is linear in 1 / range where rays fan out from a point, in range where they are parallel. Second differences of these *heights*
//! along rows and columns are noise, or relief. A pass adds a quarter of a second difference to its pixel, which makes a binomial kernel,
//! unless it is larger than noise alone makes it: then it is relief, or a jump, and stays. So planes stay where they are, up to their
//! borders, nothing is mixed across a jump, and what has no noise is left as it is.
//!
//! Two results serve two purposes. The *place* of the surface must not be biased, since no merging takes out again what all scans of a
//! place have in common. So it takes few passes, as many as the noise is pixels large, and *twicing* \[Tuk77\]: a second smoothing takes
//! from the first what the first took from the shape. The *direction* that the surface faces, and the choice of pixels that are its
//! neighbours, need more passes: differences of neighbours are the noisier the closer they are.

use super::noise::Noise;
use super::pitch::Pitch;
use super::samples::SampleGrid;
use super::{Projection, RangeImage};
use base::error::Result;
use base::progress::Progress;

/// Second differences larger than this many of the deviations that noise gives them are relief: one in 16,000 is not.
const RELIEF: f64 = 4.0;

/// An image is clean where its noise is below this share of the distance of pixels: its facets are turned by 2 degrees.
const CLEAN: f64 = 0.025;

/// Passes for the facing beyond those for the place.
const FACING: usize = 4;

/// Passes for the place: as many as the noise is pixels large, rounded down from here on, and at most so many.
const ROUND: f64 = 0.4;
const MOST: f64 = 8.0;

/// Samples of an image with noise, smoothed for two purposes.
pub struct Smoothed {
    /// By how much each sample lies further along its ray where noise is taken out for a surface that doesn't fold.
    pub facing: Vec<f64>,
    /// The same without bias.
    pub place: Vec<f64>,
    /// Standard deviation of each sample along its ray, as measured.
    pub deviation: Vec<f32>,
}

/// Takes the noise out of an image whose samples are `grid`. `None` for a clean image. Its pixels are blocks of `side` x `side` of the
/// image that `noise` was measured from. O(pixels), 40 bytes per pixel.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn smoothed(
    image: &RangeImage,
    grid: &SampleGrid,
    noise: &Noise,
    side: usize,
    progress: &Progress<'_>,
) -> Result<Option<Smoothed>> {
    if noise.typical() == 0.0 {
        return Ok(None);
    }
    let deviation = noise.of_samples(image, grid, progress)?;
    let pitch = Pitch::of(image);
    let noisy = |k: usize| f64::from(deviation[k]) > CLEAN * pitch.at(grid.positions[k]);
    if 2 * (0..grid.len()).filter(|&k| noisy(k)).count() < grid.len() {
        return Ok(None);
    }
    let window = Window::of(image, grid);
    let eye = image.projection().eye();
    // Values of an orthographic image rise toward the sensor.
    let sign = if matches!(image.projection(), Projection::Orthographic { .. }) { -1.0 } else { 1.0 };
    let mut heights = vec![f64::NAN; window.len()];
    // The limit of a second difference of noise, and the passes for the place.
    let (mut limits, mut passes) = (vec![0.0; window.len()], vec![0_u8; window.len()]);
    for block in progress.ranges(grid.len()) {
        for k in block? {
            let (at, range, sigma) = (window.at(grid.pixels[k]), image.range(grid.pixels[k] as usize), deviation[k]);
            let sigma = f64::from(sigma) * noise.left_by_blocks(side);
            heights[at] = if eye.is_some() { 1.0 / range } else { range };
            limits[at] = RELIEF * eye.map_or(sigma, |eye| sigma / (grid.positions[k].distance(eye) * range));
            passes[at] = (sigma / pitch.at(grid.positions[k]) + ROUND).min(MOST) as u8;
        }
    }
    let most = passes.iter().copied().max().unwrap_or(0);
    let deviations = deviations(2 * usize::from(most) + FACING);
    let stride = (noise.correlation() as usize / side).max(1);
    // A pass of those pixels that want at least so many, after so many passes of all.
    let flow = |heights: &mut [f64], least: u8, after: usize| {
        progress.check()?;
        window.flow(heights, &limits, deviations[after], stride, |at| passes[at] >= least);
        Ok(())
    };
    let mut once = heights.clone();
    for pass in 0..most {
        flow(&mut once, pass + 1, usize::from(pass))?;
    }
    let mut twice = once.clone();
    for pass in 0..most {
        flow(&mut twice, pass + 1, usize::from(most + pass))?;
    }
    let mut facing = once.clone();
    for pass in 0..FACING {
        flow(&mut facing, 0, usize::from(most) + pass)?;
    }
    let along = |height: &dyn Fn(usize) -> f64| -> Vec<f64> {
        let further = |k: usize| {
            let at = window.at(grid.pixels[k]);
            let (old, new) = (heights[at], height(at));
            eye.map_or(sign * (new - old), |eye| grid.positions[k].distance(eye) * (old / new - 1.0))
        };
        (0..grid.len()).map(further).collect()
    };
    let (place, facing) = (along(&|at| 2.0 * once[at] - twice[at]), along(&|at| facing[at]));
    Ok(Some(Smoothed { facing, place, deviation }))
}

/// The rows and columns that have samples.
struct Window {
    cols: usize,
    top: usize,
    left: usize,
    height: usize,
    width: usize,
}

impl Window {
    fn of(image: &RangeImage, grid: &SampleGrid) -> Window {
        let cols = image.cols();
        let (mut left, mut right) = (usize::MAX, 0);
        for &pixel in &grid.pixels {
            (left, right) = (left.min(pixel as usize % cols), right.max(pixel as usize % cols));
        }
        let row = |pixel: Option<&u32>| pixel.map_or(0, |&pixel| pixel as usize / cols);
        let (top, bottom) = (row(grid.pixels.first()), row(grid.pixels.last()));
        Window { cols, top, left, height: bottom + 1 - top, width: (right + 1).saturating_sub(left) }
    }

    fn len(&self) -> usize {
        self.height * self.width
    }

    fn at(&self, pixel: u32) -> usize {
        (pixel as usize / self.cols - self.top) * self.width + pixel as usize % self.cols - self.left
    }

    /// A pass along the rows, then one along the columns, of the pixels that are `wanted`.
    fn flow(&self, heights: &mut [f64], limits: &[f64], deviation: f64, stride: usize, wanted: impl Fn(usize) -> bool) {
        // False where a neighbour is missing: its height is NaN.
        let taken = |bend: f64, at: usize| {
            if bend.abs() <= deviation * limits[at] && wanted(at) { 0.25 * bend } else { 0.0 }
        };
        let width = self.width;
        if width > 2 * stride {
            let mut old = vec![0.0; width];
            for first in (0..self.len()).step_by(width) {
                old.copy_from_slice(&heights[first..first + width]);
                let bends = old.iter().zip(&old[stride..]).zip(&old[2 * stride..]);
                for (c, ((before, here), after)) in bends.enumerate() {
                    let at = first + stride + c;
                    heights[at] += taken(before + after - 2.0 * here, at);
                }
            }
        }
        if self.height > 2 * stride {
            // The rows above as they were, a ring of as many as the stride.
            let mut above = heights[..stride * width].to_vec();
            for row in stride..self.height - stride {
                let (here, below) = heights[row * width..].split_at_mut(stride * width);
                let slot = row % stride * width;
                for c in 0..width {
                    let (before, old) = (above[slot + c], here[c]);
                    here[c] += taken(before + below[c] - 2.0 * old, row * width + c);
                    above[slot + c] = old;
                }
            }
        }
    }
}

/// Standard deviations of a second difference of white noise of deviation 1 after no pass, one, and so on.
fn deviations(count: usize) -> Vec<f64> {
    let convolved = |a: &[f64], b: &[f64]| {
        let mut sum = vec![0.0; a.len() + b.len() - 1];
        for (i, x) in a.iter().enumerate() {
            for (j, y) in b.iter().enumerate() {
                sum[i + j] += x * y;
            }
        }
        sum
    };
    let power = |a: &[f64]| a.iter().map(|x| x * x).sum::<f64>();
    let mut kernel = vec![1.0];
    (0..count)
        .map(|_| {
            let deviation = (power(&convolved(&kernel, &[1.0, -2.0, 1.0])) * power(&kernel)).sqrt();
            kernel = convolved(&kernel, &[0.25, 0.5, 0.25]);
            deviation
        })
        .collect()
}
