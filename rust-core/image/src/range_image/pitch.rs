//! How far apart neighbouring pixels look.

use glam::DVec3;

use super::samples::SampleGrid;
use super::{Projection, RangeImage};

/// Distance of neighbouring pixels across their rays: a length, or, where rays fan out from `eye`, that at distance 1 from it.
pub struct Pitch {
    length: f64,
    eye: Option<DVec3>,
}

impl Pitch {
    /// That of an image whose samples are `grid`. O(samples) for point grids.
    pub fn of(image: &RangeImage, grid: &SampleGrid) -> Pitch {
        let eye = image.projection().eye();
        let length = match *image.projection() {
            Projection::Orthographic { step, .. } | Projection::Spherical { step, .. } => {
                step[0].abs().min(step[1].abs())
            }
            Projection::Pinhole { focal, .. } => 1.0 / focal[0].abs().max(focal[1].abs()),
            Projection::PointGrid(_) => {
                let mut lengths: Vec<f64> = (0..grid.len())
                    .filter(|&k| grid.has_right(k))
                    .map(|k| {
                        let (a, b) = (grid.positions[k], grid.positions[k + 1]);
                        let across = (b - a).reject_from_normalized(image.projection().view_direction(a)).length();
                        eye.map_or(across, |eye| across / a.distance(eye))
                    })
                    .filter(|length| length.is_finite())
                    .collect();
                let middle = lengths.len() / 2;
                // Without neighbours there is no noise to compare it with.
                if lengths.is_empty() { 1.0 } else { *lengths.select_nth_unstable_by(middle, f64::total_cmp).1 }
            }
        };
        Pitch { length, eye }
    }

    /// At a sample.
    pub fn at(&self, grid: &SampleGrid, k: usize) -> f64 {
        self.eye.map_or(self.length, |eye| self.length * grid.positions[k].distance(eye))
    }

    /// At a distance from the sensor, which does not matter where rays are parallel.
    pub fn at_range(&self, range: f64) -> f64 {
        if self.eye.is_some() { self.length * range } else { self.length }
    }
}
