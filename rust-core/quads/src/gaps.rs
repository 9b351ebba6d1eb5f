//! Stage 1: single-pixel gaps are filled with the mean of their neighbours. \[GSB97, sec. 2.1\]
//!
//! The paper's S(r, c) names the diagonal neighbours only. All eight are meant.

use std::borrow::Cow;

use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use image::range_image::{Projection, RangeImage, Samples};

/// The image with its gaps filled, and how many pixels were. Filled pixels are valid in the result and stay invalid in `image`. Each pass
/// looks at the pass before only. O(pixels) per pass. Without a gap nothing is copied.
///
/// Values are averaged as they are, points coordinate by coordinate, without attributes.
pub(super) fn fill<'a>(
    image: &'a RangeImage,
    passes: usize,
    neighbours: usize,
    progress: &Progress<'_>,
) -> Result<(Cow<'a, RangeImage>, usize)> {
    let mut filled = Cow::Borrowed(image);
    let mut count = 0;
    for _ in 0..passes {
        let gaps = match filled.samples() {
            Samples::Values(values) => {
                let found = find(values, image.cols(), neighbours, |v| v.is_nan(), mean_value, progress)?;
                if found.is_empty() {
                    break;
                }
                count += found.len();
                let mut values = values.clone();
                for &(index, value) in &found {
                    values[index] = value;
                }
                RangeImage::from_values(image.rows(), image.cols(), values, *image.projection())?
            }
            Samples::Points(points) => {
                let found = find(points, image.cols(), neighbours, |p| p[0].is_nan(), mean_point, progress)?;
                if found.is_empty() {
                    break;
                }
                count += found.len();
                let mut points = points.clone();
                for &(index, point) in &found {
                    points[index] = point;
                }
                let Projection::PointGrid(viewing) = *image.projection() else {
                    unreachable!("an image of points is a point grid")
                };
                RangeImage::from_points(image.rows(), image.cols(), points, viewing)?
            }
        };
        filled = Cow::Owned(gaps);
    }
    Ok((filled, count))
}

/// Differences from the first, so that far-away surfaces keep their digits.
fn mean_value(values: &[f64]) -> f64 {
    values[0] + values.iter().map(|v| v - values[0]).sum::<f64>() / values.len() as f64
}

fn mean_point(points: &[[f32; 3]]) -> [f32; 3] {
    std::array::from_fn(|axis| {
        let first = f64::from(points[0][axis]);
        let sum: f64 = points.iter().map(|p| f64::from(p[axis]) - first).sum();
        (first + sum / points.len() as f64) as f32
    })
}

/// The gaps with the values that fill them, in pixel order. A value that is not finite fills nothing.
fn find<T: Copy + Default + Send + Sync + Finite>(
    samples: &[T],
    cols: usize,
    neighbours: usize,
    is_invalid: impl Fn(T) -> bool + Sync,
    mean: impl Fn(&[T]) -> T + Sync,
    progress: &Progress<'_>,
) -> Result<Vec<(usize, T)>> {
    if samples.is_empty() {
        return Ok(Vec::new());
    }
    let rows = samples.len() / cols;
    let per_row = (0..rows)
        .into_par_iter()
        .map(|row| {
            progress.check()?;
            let mut found = Vec::new();
            let own = &samples[row * cols..(row + 1) * cols];
            // Most rows have no gap, which is seen many pixels at a time.
            if !own.iter().fold(false, |any, &sample| any | is_invalid(sample)) {
                return Ok(found);
            }
            for (col, &sample) in own.iter().enumerate() {
                if !is_invalid(sample) {
                    continue;
                }
                let mut valid = [T::default(); 8];
                let mut count = 0;
                for r in row.saturating_sub(1)..(row + 2).min(rows) {
                    for c in col.saturating_sub(1)..(col + 2).min(cols) {
                        let neighbour = samples[r * cols + c];
                        if !is_invalid(neighbour) {
                            valid[count] = neighbour;
                            count += 1;
                        }
                    }
                }
                if count >= neighbours {
                    let value = mean(&valid[..count]);
                    if value.is_usable() {
                        found.push((row * cols + col, value));
                    }
                }
            }
            Ok(found)
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(per_row.concat())
}

/// Whether a sample can stand in an image.
trait Finite {
    fn is_usable(&self) -> bool;
}

impl Finite for f64 {
    fn is_usable(&self) -> bool {
        self.is_finite()
    }
}

impl Finite for [f32; 3] {
    fn is_usable(&self) -> bool {
        self.iter().all(|x| x.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(rows: usize, cols: usize, values: Vec<f64>) -> RangeImage {
        RangeImage::from_values(rows, cols, values, Projection::Orthographic { first: [0.0; 2], step: [1.0, 1.0] })
            .unwrap()
    }

    #[test]
    fn a_single_gap_takes_the_mean_of_its_eight_neighbours_and_larger_ones_stay() {
        let mut values: Vec<f64> = (0..49).map(|i| 1e9 + f64::from(i)).collect();
        values[8] = f64::NAN;
        values[31] = f64::NAN;
        values[32] = f64::NAN;
        let holed = image(7, 7, values);
        let (filled, count) = fill(&holed, 5, 8, &Progress::none()).unwrap();
        assert_eq!((count, filled.range(8)), (1, 1e9 + 8.0));
        assert!(filled.range(31).is_nan() && filled.range(32).is_nan() && holed.range(8).is_nan());
        let (filled, count) = fill(&holed, 1, 7, &Progress::none()).unwrap();
        assert_eq!((count, filled.valid_count()), (3, 49));
        assert!((filled.range(31) - (1e9 + 31.0)).abs() < 0.2);
        let (filled, count) = fill(&holed, 0, 1, &Progress::none()).unwrap();
        assert!(count == 0 && matches!(filled, Cow::Borrowed(_)));
    }

    #[test]
    fn gaps_grow_shut_a_pixel_a_pass_and_points_are_averaged() {
        let points: Vec<[f32; 3]> = (0..81)
            .map(|i| {
                let (r, c) = ((i / 9) as f32, (i % 9) as f32);
                if (2.0..=6.0).contains(&r) && (2.0..=6.0).contains(&c) { [f32::NAN; 3] } else { [c, r, 0.5] }
            })
            .collect();
        let grid = RangeImage::from_points(9, 9, points, image::range_image::Viewing::ALONG_MINUS_Z).unwrap();
        for (passes, valid) in [(0, 56), (1, 72), (2, 80), (3, 81), (9, 81)] {
            let (filled, count) = fill(&grid, passes, 3, &Progress::none()).unwrap();
            assert_eq!((filled.valid_count(), count), (valid, valid - 56), "{passes} passes");
        }
        assert!(matches!(fill(&grid, 1, 3, &Progress::cancel_after(0)), Err(base::Error::Cancelled)));
    }
}
