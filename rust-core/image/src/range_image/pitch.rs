//! How far apart neighbouring pixels look.

use glam::DVec3;

use super::{Projection, RangeImage};

/// Distance of neighbouring pixels across their rays: a length, or, where rays fan out from `eye`, that at distance 1 from it.
pub struct Pitch {
    length: f64,
    eye: Option<DVec3>,
}

impl Pitch {
    /// That of an image. O(pixels) for point grids.
    pub fn of(image: &RangeImage) -> Pitch {
        let eye = image.projection().eye();
        let length = match *image.projection() {
            Projection::Orthographic { step, .. } | Projection::Spherical { step, .. } => {
                step[0].abs().min(step[1].abs())
            }
            Projection::Pinhole { focal, .. } => 1.0 / focal[0].abs().max(focal[1].abs()),
            Projection::PointGrid(_) => {
                let mut lengths: Vec<f64> = (1..image.len())
                    .filter(|i| i % image.cols() > 0)
                    .map(|i| {
                        let (a, b) = (image.point_in_sensor(i - 1), image.point_in_sensor(i));
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

    /// At a distance from the sensor, which does not matter where rays are parallel.
    pub fn at_range(&self, range: f64) -> f64 {
        if self.eye.is_some() { self.length * range } else { self.length }
    }

    /// At a point.
    pub fn at(&self, point: DVec3) -> f64 {
        self.eye.map_or(self.length, |eye| self.length * point.distance(eye))
    }
}
