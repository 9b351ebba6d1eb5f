//! Stage 2: the curvature image, and from it how much each pixel attracts vertices. \[GSB97, sec. 2.1, eq. 1 and 2\]
//!
//! Differences from the paper: The unit of the curvature is a share of the depth extent, not of whatever the ranges are in. The column's
//! second difference reads R(r + 1, c) where the paper prints R(r, c + 1). T(x) is a power of x, or log(1 + x) on request, as log x has no
//! value at 0. Curvature next to invalid pixels is 0 unless the background is given one, so the rim of the background attracts nothing by
//! itself.

use rayon::prelude::*;

use super::params::QuadParams;
use base::error::Result;
use base::progress::Progress;

/// Rows handled between two looks at the progress.
const BAND: usize = 16;

/// T for every curvature, scaled to 0..=255: 0 for 0, at least 1 for everything else.
fn transfer(params: &QuadParams) -> [u8; 256] {
    let t = |k: f64| if params.exponent > 0.0 { k.powf(params.exponent) } else { k.ln_1p() };
    let whole = t(f64::from(params.curvature_limit));
    std::array::from_fn(|k| if k == 0 { 0 } else { (255.0 * t(k as f64) / whole).round().clamp(1.0, 255.0) as u8 })
}

/// The density a pixel, row by row. `extent` is the depth extent. O(pixels).
pub(super) fn image(
    ranges: &[f64],
    cols: usize,
    extent: f64,
    params: &QuadParams,
    progress: &Progress<'_>,
) -> Result<Vec<u8>> {
    let table = transfer(params);
    let mut density = curvature(ranges, cols, extent, params, progress, |row| {
        for k in row {
            *k = table[usize::from(*k)];
        }
    })?;
    if let Some(curvature) = params.background_curvature {
        let background = table[usize::from(curvature.min(params.curvature_limit))];
        density.par_iter_mut().zip(ranges).for_each(|(density, range)| {
            if range.is_nan() {
                *density = background;
            }
        });
    }
    Ok(density)
}

/// The 8-bit curvature image: K^R or K^C of each pixel, bit by bit. `finish` is called on each row of it.
fn curvature(
    ranges: &[f64],
    cols: usize,
    extent: f64,
    params: &QuadParams,
    progress: &Progress<'_>,
    finish: impl Fn(&mut [u8]) + Sync,
) -> Result<Vec<u8>> {
    let rows = ranges.len() / cols;
    let scale = 1.0 / (params.curvature_unit * extent);
    // A plane has no curvature, and no unit for it either.
    let scale = if scale.is_finite() { scale } else { 0.0 };
    let limit = f64::from(params.curvature_limit);
    let mut image = vec![0_u8; ranges.len()];
    image.par_chunks_mut(BAND * cols).enumerate().try_for_each(|(band, image)| {
        for (i, out) in image.chunks_exact_mut(cols).enumerate() {
            let row = band * BAND + i;
            let here = &ranges[row * cols..(row + 1) * cols];
            let beside = cols.saturating_sub(2);
            if row > 0 && row + 1 < rows {
                let (above, below) =
                    (&ranges[(row - 1) * cols..row * cols], &ranges[(row + 1) * cols..(row + 2) * cols]);
                for col in 0..cols {
                    out[col] = quantized((above[col] - here[col]) + (below[col] - here[col]), scale, limit);
                }
            }
            let (left, middle, right) = (&here[..beside], &here[1..=beside], &here[cols - beside..]);
            for (col, out) in out[1..=beside].iter_mut().enumerate() {
                *out |= quantized((left[col] - middle[col]) + (right[col] - middle[col]), scale, limit);
            }
            finish(out);
        }
        progress.advance(image.len() as u64)
    })?;
    Ok(image)
}

/// A second difference as a whole number from 0 to `limit`. 0 for NaN.
#[inline(always)]
fn quantized(difference: f64, scale: f64, limit: f64) -> u8 {
    let x = difference.abs() * scale;
    let x = if x >= limit { limit } else { x };
    let x = if x > 0.0 { x } else { 0.0 };
    // The low bits of x + 2^52 are x rounded; unlike a cast this is computed for many pixels at once.
    (x + 4_503_599_627_370_496.0).to_bits() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(ranges: &[f64], cols: usize, params: &QuadParams, extent: f64) -> Vec<u8> {
        let rows = ranges.len() / cols;
        let at = |r: usize, c: usize| ranges[r * cols + c];
        let cut = |x: f64| {
            let x = (x.abs() / (params.curvature_unit * extent)).min(f64::from(params.curvature_limit));
            if x.is_nan() { 0 } else { x.round_ties_even() as u8 }
        };
        let mut out = vec![0; ranges.len()];
        for r in 0..rows {
            for c in 0..cols {
                // `min` turns NaN into the limit, so the invalid are left out first.
                let valid = |list: &[f64]| list.iter().all(|z| !z.is_nan());
                let (mut k_row, mut k_col) = (0, 0);
                if c > 0 && c + 1 < cols && valid(&[at(r, c - 1), at(r, c), at(r, c + 1)]) {
                    k_row = cut(at(r, c - 1) - 2.0 * at(r, c) + at(r, c + 1));
                }
                if r > 0 && r + 1 < rows && valid(&[at(r - 1, c), at(r, c), at(r + 1, c)]) {
                    k_col = cut(at(r - 1, c) - 2.0 * at(r, c) + at(r + 1, c));
                }
                out[r * cols + c] = k_row | k_col;
            }
        }
        out
    }

    #[test]
    fn the_curvature_is_that_of_the_formula() {
        for cols in [1, 2, 3, 17] {
            for rows in [1, 2, 3, 23] {
                let ranges: Vec<f64> = (0..rows * cols)
                    .map(|i| if i % 11 == 5 { f64::NAN } else { ((i * i * 7919) % 1009) as f64 })
                    .collect();
                let params = QuadParams { curvature_limit: 200, curvature_unit: 1.0 / 1024.0, ..QuadParams::default() };
                let made = curvature(&ranges, cols, 2048.0, &params, &Progress::none(), |_| ()).unwrap();
                assert_eq!(made, plain(&ranges, cols, &params, 2048.0), "{rows} x {cols}");
            }
        }
    }

    #[test]
    fn density_rises_with_curvature_and_the_background_has_its_own() {
        for exponent in [0.0, 0.33, 1.0] {
            let table = transfer(&QuadParams { exponent, ..QuadParams::default() });
            assert!(table.windows(2).all(|w| w[0] <= w[1]) && table[0] == 0 && table[1] > 0 && table[255] == 255);
        }
        let ranges = [0.0, 0.0, 0.0, f64::NAN, 1e-3, 0.0];
        let params = QuadParams { background_curvature: Some(5), ..QuadParams::default() };
        let table = transfer(&params);
        assert_eq!(image(&ranges, 6, 1.0, &params, &Progress::none()).unwrap(), [0, 0, 0, table[5], 0, 0]);
        // Neither a plane nor an extent beyond all numbers has a unit of curvature.
        for extent in [0.0, f64::INFINITY, 1e-320] {
            let params = QuadParams::default();
            assert!(image(&[0.0, 1.0, 0.0], 3, extent, &params, &Progress::none()).unwrap().iter().all(|&d| d == 0));
        }
    }
}
