//! A grid of points seen from a place, as an image of ranges by azimuth and elevation: so places can be looked up in it.
//!
//! A pixel of it has the least range of the four neighbouring points around it: what is behind that is behind the surface
//! between them. Where one of the four is missing nothing is known.

use glam::{DMat3, DVec3};

use crate::range_image::{Projection, RangeImage};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Ranges by azimuth and elevation.
pub struct Around {
    /// From the frame of the grid to that of the ranges, whose origin is the eye.
    pub turn: DMat3,
    /// Spherical.
    pub projection: Projection,
    pub cols: usize,
    /// Row by row. NaN where nothing is known.
    pub ranges: Vec<f64>,
}

/// Length of the mean of all directions from which on the grid looks one way: then its middle lies far from the poles.
const ONE_WAY: f64 = 0.3;
/// Pixels by points, at most.
const MOST_PIXELS: f64 = 4.0;
/// Four neighbouring points reach over no more pixels than this, or they aren't neighbours.
const WIDEST: f64 = 8.0;

impl Around {
    /// Of a grid of points seen from `eye`. `None` if it has too few neighbouring points to tell how far apart its rays are. O(pixels), 32
    /// bytes per pixel.
    ///
    /// # Errors
    /// Cancelled.
    pub fn new(image: &RangeImage, eye: DVec3, progress: &Progress<'_>) -> Result<Option<Around>> {
        let mut sum = DVec3::ZERO;
        let mut count = 0.0;
        image.try_for_each_valid(
            |_, _, point| {
                sum += (point - eye).normalize_or_zero();
                count += 1.0;
            },
            progress,
        )?;
        let turn = turn(sum / f64::max(count, 1.0));
        // Azimuth, elevation and range of each pixel.
        let mut seen = vec![[f64::NAN; 3]; image.len()];
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        image.try_for_each_valid(
            |row, col, point| {
                let at = turn * (point - eye);
                let angles = [at.y.atan2(at.x), at.z.atan2(at.truncate().length())];
                for axis in 0..2 {
                    (low[axis], high[axis]) = (low[axis].min(angles[axis]), high[axis].max(angles[axis]));
                }
                seen[row * image.cols() + col] = [angles[0], angles[1], at.length()];
            },
            progress,
        )?;
        let Some(pitch) = pitch(&seen, image.cols(), progress)? else { return Ok(None) };
        let size = [0, 1].map(|axis| high[axis] - low[axis]);
        let most = MOST_PIXELS * image.len() as f64;
        // Neither more pixels nor longer rows.
        let step = pitch.max((size[0] * size[1] / most).sqrt()).max(size[0].max(size[1]) / most);
        let [cols, rows] = size.map(|size| (size / step) as usize + 1);
        let mut ranges = vec![f64::NAN; rows * cols];
        let mut pace = Pace::new(progress);
        for pair in seen.chunks_exact(image.cols()).collect::<Vec<_>>().windows(2) {
            for col in 1..image.cols() {
                let corners = [pair[0][col - 1], pair[0][col], pair[1][col - 1], pair[1][col]];
                // NaN if any is.
                let sum: f64 = corners.iter().map(|corner| corner[2]).sum();
                let bounds = [0, 1].map(|axis| {
                    let place = corners.map(|corner| (corner[axis] - low[axis]) / step);
                    [place.iter().copied().fold(f64::INFINITY, f64::min), place.iter().copied().fold(0.0, f64::max)]
                });
                if sum.is_nan() || bounds.iter().any(|[from, to]| to - from > WIDEST) {
                    continue;
                }
                let range = corners.iter().map(|corner| corner[2]).fold(f64::INFINITY, f64::min);
                for row in bounds[1][0].ceil() as usize..=bounds[1][1].floor() as usize {
                    for col in bounds[0][0].ceil() as usize..=bounds[0][1].floor() as usize {
                        let known = &mut ranges[row * cols + col];
                        *known = known.min(range);
                    }
                }
            }
            pace.after(image.cols())?;
        }
        let projection = Projection::Spherical { first: low, step: [step; 2] };
        Ok(Some(Around { turn, projection, cols, ranges }))
    }
}

/// A rotation after which a mean direction lies along x. None if the grid looks all around.
fn turn(mean: DVec3) -> DMat3 {
    if mean.length() < ONE_WAY {
        return DMat3::IDENTITY;
    }
    let forward = mean.normalize();
    let up = if forward.z.abs() < 0.8 { DVec3::Z } else { DVec3::Y };
    let left = up.cross(forward).normalize();
    DMat3::from_cols(forward, left, forward.cross(left)).transpose()
}

/// The larger of the median angles between neighbours in rows and in columns.
fn pitch(seen: &[[f64; 3]], cols: usize, progress: &Progress<'_>) -> Result<Option<f64>> {
    let mut pitch = None;
    for after in [1, cols] {
        progress.check()?;
        let angle = |(i, there): (usize, &[f64; 3])| {
            let here = seen[i];
            // A row's last and the next row's first are no neighbours.
            let are_beside = after > 1 || cols == 1 || (i + 1) % cols > 0;
            let away = ((there[0] - here[0]) * here[1].cos()).hypot(there[1] - here[1]);
            (are_beside && away > 0.0).then_some(away)
        };
        let mut angles: Vec<f64> = seen.iter().skip(after).enumerate().filter_map(angle).collect();
        let middle = angles.len() / 2;
        if !angles.is_empty() {
            let median = *angles.select_nth_unstable_by(middle, f64::total_cmp).1;
            pitch = Some(f64::max(pitch.unwrap_or(0.0), median));
        }
    }
    Ok(pitch)
}
