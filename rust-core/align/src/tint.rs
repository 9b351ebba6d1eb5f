//! Colours and intensities of a scan's points, and how they change along the surface.

use glam::{DMat3, DVec3};

use crate::neighbours::Neighbours;

/// Brightness, and red and blue against the others, 0 to 1 and -1 to 1. Of intensities the first alone.
pub(crate) type Tint = DVec3;

/// Tints of samples, where there are colours or intensities.
pub(crate) fn tints(colour: Option<&[[u8; 4]]>, intensity: Option<&[f32]>) -> Option<Vec<Tint>> {
    if let Some(colour) = colour {
        let tint = |[r, g, b, _]: &[u8; 4]| {
            let [r, g, b] = [r, g, b].map(|x| f64::from(*x) / 255.0);
            let bright = (r + g + b) / 3.0;
            DVec3::new(bright, r - bright, b - bright)
        };
        return Some(colour.iter().map(tint).collect());
    }
    let intensity = intensity?;
    let finite = |x: &&f32| x.is_finite() && **x >= 0.0;
    let sum: f64 = intensity.iter().filter(finite).map(|x| f64::from(*x)).sum();
    let mean = sum / intensity.iter().filter(finite).count().max(1) as f64;
    let tint = |x: &f32| match (finite(&x), mean > 0.0) {
        (true, true) => DVec3::new((0.5 * f64::from(*x) / mean).min(1.0), 0.0, 0.0),
        _ => DVec3::new(0.5, 0.0, 0.0),
    };
    Some(intensity.iter().map(tint).collect())
}

/// The tints of a level's points. Empty where the scan has none.
#[derive(Default)]
pub(crate) struct Tints {
    pub values: Vec<Tint>,
    /// How each of the three changes along the surface.
    pub gradients: Vec<[DVec3; 3]>,
    /// The difference of neighbours that gradients don't explain, as a deviation.
    pub noise: f64,
    /// Mean square of the differences from the mean.
    pub variance: f64,
}

/// Tints are never known better.
const LEAST_NOISE: f64 = 0.01;
/// Cells around a point that its gradient is of.
const AROUND: f64 = 1.8;

impl Tints {
    /// Of points, a cell apart, with their normals.
    pub fn new(values: Vec<Tint>, points: &[DVec3], normals: &[DVec3], cell: f64, grid: &Neighbours) -> Self {
        let mut near = Vec::new();
        let mut gradients = Vec::with_capacity(values.len());
        let (mut unexplained, mut count) = (0.0, 0.0);
        for (k, &here) in points.iter().enumerate() {
            grid.within(here, AROUND * cell, &mut near);
            let normal = normals[k];
            // Ridge: what neighbours say of a direction that none lies in is nothing.
            let ridge = 0.1 * cell * cell;
            let mut squares = DMat3::from_diagonal(DVec3::splat(ridge));
            let mut right = [DVec3::ZERO; 3];
            for &n in near.iter().filter(|&&n| n as usize != k) {
                let along = (points[n as usize] - here).reject_from(normal);
                squares += DMat3::from_cols(along * along.x, along * along.y, along * along.z);
                let by = values[n as usize] - values[k];
                for (right, by) in right.iter_mut().zip(by.to_array()) {
                    *right += by * along;
                }
            }
            let inverse = squares.inverse();
            let gradient = right.map(|right| inverse * right);
            for &n in near.iter().filter(|&&n| n as usize != k) {
                let along = points[n as usize] - here;
                let by = values[n as usize] - values[k];
                let off = by - DVec3::from(gradient.map(|gradient| gradient.dot(along)));
                unexplained += off.length_squared();
                count += 1.0;
            }
            gradients.push(gradient);
        }
        let mean = values.iter().sum::<DVec3>() / values.len().max(1) as f64;
        let variance = values.iter().map(|v| v.distance_squared(mean)).sum::<f64>() / values.len().max(1) as f64;
        let noise = (0.5 * unexplained / f64::max(count, 1.0)).sqrt().max(LEAST_NOISE);
        Tints { values, gradients, noise, variance }
    }

    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }
}
