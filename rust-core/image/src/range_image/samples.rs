//! The valid pixels of an image in compact form, with their neighbours and the distances to them.
//!
//! A scan's grid is mostly empty (362,000 of 2 million pixels of the Stanford bunny are valid), so everything that
//! walks over neighbours walks over this list instead. Neighbours in a row are neighbours in the list, which leaves only
//! the rows above and below to be looked up.

use glam::DVec3;

use super::RangeImage;
use base::error::{Error, Result};
use base::progress::Progress;

/// Stands for a neighbour that isn't there.
pub const NO_SAMPLE: u32 = u32::MAX;

/// Valid pixels of a range image, row by row, as *samples*: `k` below is a sample, `k + 1` its right neighbour if
/// [`SampleGrid::has_right`] says so.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SampleGrid {
    /// Measured points in the sensor's frame.
    pub positions: Vec<DVec3>,
    /// Index of each sample's pixel, rising.
    pub pixels: Vec<u32>,
    /// The sample one row up, or [`NO_SAMPLE`].
    pub up: Vec<u32>,
    /// The sample one row down, or [`NO_SAMPLE`].
    pub down: Vec<u32>,
    /// Squared distance to the right neighbour, infinite where there is none.
    pub right_squared: Vec<f64>,
    /// Squared distance to the sample one row down, infinite where there is none.
    pub down_squared: Vec<f64>,
}

impl SampleGrid {
    /// Collects the valid pixels. O(pixels), 56 bytes a valid pixel.
    ///
    /// # Errors
    /// [`Error::Input`] if the image has more than 2^32 - 2 pixels. [`Error::Cancelled`].
    pub fn new(image: &RangeImage, progress: &Progress<'_>) -> Result<Self> {
        if image.len() >= NO_SAMPLE as usize {
            let (name, pixels) = (image.called(), image.len());
            return Err(Error::input(format!(
                "{name}: {pixels} pixels, but an image may have at most {}",
                NO_SAMPLE - 1
            )));
        }
        let cols = image.cols() as u32;
        let valid = image.valid_count();
        let mut grid = SampleGrid {
            positions: Vec::with_capacity(valid),
            pixels: Vec::with_capacity(valid),
            up: Vec::with_capacity(valid),
            down: vec![NO_SAMPLE; valid],
            right_squared: Vec::with_capacity(valid),
            down_squared: vec![f64::INFINITY; valid],
        };
        // The last sample seen in each column; it is the upper neighbour if its pixel is the one above.
        let mut last_in_column = vec![0_u32; image.cols()];
        let visit = |row: usize, col: usize, point: DVec3| {
            let (pixel, k) = (row as u32 * cols + col as u32, grid.pixels.len());
            if let (Some(&previous), true) = (grid.pixels.last(), col > 0)
                && previous + 1 == pixel
            {
                grid.right_squared[k - 1] = point.distance_squared(grid.positions[k - 1]);
            }
            let above = last_in_column[col] as usize;
            if above < k && grid.pixels[above] + cols == pixel {
                grid.down_squared[above] = point.distance_squared(grid.positions[above]);
                grid.down[above] = k as u32;
                grid.up.push(above as u32);
            } else {
                grid.up.push(NO_SAMPLE);
            }
            last_in_column[col] = k as u32;
            grid.positions.push(point);
            grid.pixels.push(pixel);
            grid.right_squared.push(f64::INFINITY);
        };
        image.try_for_each_valid(visit, progress)?;
        Ok(grid)
    }

    /// Moves every sample. The neighbours stay.
    pub fn move_samples(&mut self, place: impl Fn(usize, DVec3) -> DVec3) {
        for (k, position) in self.positions.iter_mut().enumerate() {
            *position = place(k, *position);
        }
        for k in 0..self.len() {
            if self.has_right(k) {
                self.right_squared[k] = self.positions[k].distance_squared(self.positions[k + 1]);
            }
            if self.down[k] != NO_SAMPLE {
                self.down_squared[k] = self.positions[k].distance_squared(self.positions[self.down[k] as usize]);
            }
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.pixels.len()
    }

    /// Whether no pixel is valid.
    pub fn is_empty(&self) -> bool {
        self.pixels.is_empty()
    }

    /// Whether the pixel to the right of sample `k` is valid. It is sample `k + 1` then.
    pub fn has_right(&self, k: usize) -> bool {
        self.right_squared[k] < f64::INFINITY
    }

    /// Whether the pixel to the left of sample `k` is valid. It is sample `k - 1` then.
    pub fn has_left(&self, k: usize) -> bool {
        k > 0 && self.has_right(k - 1)
    }

    /// The left, right, upper and lower neighbours of sample `k`.
    pub fn neighbours(&self, k: usize) -> [Option<usize>; 4] {
        let there = |n: u32| (n != NO_SAMPLE).then_some(n as usize);
        [self.has_left(k).then(|| k - 1), self.has_right(k).then(|| k + 1), there(self.up[k]), there(self.down[k])]
    }
}
