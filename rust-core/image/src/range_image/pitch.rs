//! Pitch: how far apart neighbouring pixels look.

use glam::DVec3;

use super::samples::{NO_SAMPLE, SampleGrid};
use super::{Projection, RangeImage};

/// Pixels count as square if neither side is longer than the other by this factor. Scans of the Stanford bunny and dragon, which one limit
/// for both directions suits, come to 1.75. Spinning scanners come to 10.
pub const SQUARE: f64 = 2.0;

/// Samples of a point grid whose neighbours are looked at.
const LOOKED_AT: usize = 1 << 11;

/// Whether pixels are as high as wide, as seen along their rays, whatever the surface's slant. `grid` has the samples of
/// `image`, as they are or smoothed. O(1) beside a few of the samples.
pub fn is_square(image: &RangeImage, grid: &SampleGrid) -> bool {
    let [width, height] = match *image.projection() {
        Projection::Orthographic { step, .. } | Projection::Spherical { step, .. } => step.map(f64::abs),
        Projection::Pinhole { focal, .. } => focal.map(|focal| focal.abs().recip()),
        Projection::PointGrid(_) => sides(image, grid),
    };
    width.max(height) < SQUARE * width.min(height)
}

/// Median width and height of a point grid's pixels across their rays, by range where rays fan out. 1 and 1 where one of
/// them isn't known.
fn sides(image: &RangeImage, grid: &SampleGrid) -> [f64; 2] {
    let (projection, eye) = (image.projection(), image.projection().eye());
    let across = |a: usize, b: usize| {
        let (a, b) = (grid.positions[a], grid.positions[b]);
        let across = (b - a).reject_from_normalized(projection.view_direction(a)).length();
        eye.map_or(across, |eye| across / a.distance(eye))
    };
    // Odd, so that it is no multiple of an even number of columns.
    let looked_at = || (0..grid.len()).step_by((grid.len() / LOOKED_AT) | 1);
    // Pairs at the same place say nothing.
    let is_apart = |length: &f64| *length > 0.0;
    let right = looked_at().filter(|&k| grid.has_right(k)).map(|k| across(k, k + 1)).filter(is_apart);
    let is_above = |k: &usize| grid.down[*k] != NO_SAMPLE;
    let down = looked_at().filter(is_above).map(|k| across(k, grid.down[k] as usize)).filter(is_apart);
    match (middle(right.collect()), middle(down.collect())) {
        (Some(width), Some(height)) => [width, height],
        _ => [1.0; 2],
    }
}

/// The median of those that are finite.
fn middle(mut lengths: Vec<f64>) -> Option<f64> {
    lengths.retain(|length| length.is_finite());
    let middle = lengths.len() / 2;
    (!lengths.is_empty()).then(|| *lengths.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Distance of neighbouring pixels across their rays: a length, or, where rays fan out from `eye`, that at distance 1 from it.
pub struct Pitch {
    length: f64,
    eye: Option<DVec3>,
}

impl Pitch {
    /// The pitch of an image. O(pixels) for point grids.
    pub fn of(image: &RangeImage) -> Pitch {
        let eye = image.projection().eye();
        let length = match *image.projection() {
            Projection::Orthographic { step, .. } | Projection::Spherical { step, .. } => {
                step[0].abs().min(step[1].abs())
            }
            Projection::Pinhole { focal, .. } => 1.0 / focal[0].abs().max(focal[1].abs()),
            Projection::PointGrid(_) => {
                let across = |i: usize, j: usize| {
                    let (a, b) = (image.point_in_sensor(i), image.point_in_sensor(j));
                    let across = (b - a).reject_from_normalized(image.projection().view_direction(a)).length();
                    eye.map_or(across, |eye| across / a.distance(eye))
                };
                let cols = image.cols();
                let width = middle((1..image.len()).filter(|i| i % cols > 0).map(|i| across(i - 1, i)).collect());
                let looked_at = (cols..image.len()).step_by((image.len() / LOOKED_AT) | 1);
                let height = middle(looked_at.map(|i| across(i - cols, i)).collect());
                match (width, height) {
                    (Some(width), Some(height)) if height > 0.0 && SQUARE * height <= width => height,
                    // Without neighbours there is no noise to compare it with.
                    _ => width.unwrap_or(1.0),
                }
            }
        };
        Pitch { length, eye }
    }

    /// At a distance from the sensor, which does not matter where rays are parallel.
    pub fn at_range(&self, range: f64) -> f64 {
        if self.eye.is_some() { self.length * range } else { self.length }
    }

    /// At a point.
    pub fn at(&self, point: DVec3) -> f64 {
        self.eye.map_or(self.length, |eye| self.length * point.distance(eye))
    }
}
