//! Errors of a real scanner beside the truth, from a hash of seed, pixel and purpose: no state, so no order of evaluation.

use glam::{DAffine3, DQuat, DVec3};

use super::params::ScanParams;
use image::range_image::RangeImage;

/// Cosine below which noise grows no further.
const GRAZING: f64 = 0.05;

/// Numbers for different purposes are independent.
#[derive(Clone, Copy)]
enum Purpose {
    Noise = 1,
    Dropout = 2,
    Shift = 3,
    Axis = 4,
    Turn = 5,
}

/// A random word: the finalizer of SplitMix64 \[SLF14\] over a chain of the three inputs.
fn word(seed: u64, purpose: Purpose, index: u64) -> u64 {
    let mix = |mut z: u64| {
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    };
    let step = 0x9e37_79b9_7f4a_7c15_u64;
    let z = mix(seed.wrapping_add(step));
    let z = mix(z ^ (purpose as u64).wrapping_mul(step));
    mix(z.wrapping_add(index.wrapping_add(1).wrapping_mul(step)))
}

/// Uniform in (0, 1).
fn uniform(seed: u64, purpose: Purpose, index: u64) -> f64 {
    ((word(seed, purpose, index) >> 12) as f64 + 0.5) / (1u64 << 52) as f64
}

/// Normally distributed with deviation 1 (Box and Muller).
fn normal(seed: u64, purpose: Purpose, index: u64) -> f64 {
    let (u, v) = (uniform(seed, purpose, 2 * index), uniform(seed, purpose, 2 * index + 1));
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Error of a pixel along its ray in world units. `None` if the pixel drops out. `cosine` is the cosine between its ray and the surface's
/// normal.
pub(super) fn along_ray(params: &ScanParams, pixel: u64, cosine: impl FnOnce() -> f64) -> Option<f64> {
    let needs_cosine = params.noise > 0.0 && params.noise_grazing > 0.0 || params.dropout_grazing > 0.0;
    let cosine = if needs_cosine { cosine() } else { 1.0 };
    // NaN for a triangle without area: as grazing as can be.
    let cosine = if cosine.is_nan() { 0.0 } else { cosine.min(1.0) };
    let drop = params.dropout + params.dropout_grazing * (1.0 - cosine).powi(4);
    if drop > 0.0 && uniform(params.seed, Purpose::Dropout, pixel) < drop {
        return None;
    }
    if params.noise == 0.0 {
        return Some(0.0);
    }
    let growth = 1.0 + params.noise_grazing * (1.0 / cosine.max(GRAZING) - 1.0);
    Some(params.noise * growth * normal(params.seed, Purpose::Noise, pixel))
}

/// The value rounded to a multiple of `quantum`, if there is one.
pub(super) fn quantize(value: f64, quantum: f64) -> f64 {
    if quantum > 0.0 { (value / quantum).round() * quantum } else { value }
}

/// The image's pose with the error the parameters ask for: a turn about the centre of the image's points, then a shift.
pub(super) fn reported_pose(image: &RangeImage, params: &ScanParams) -> DAffine3 {
    let pose = image.world_from_sensor;
    if params.pose_shift == 0.0 && params.pose_turn == 0.0 {
        return pose;
    }
    let (mut sum, mut count) = (DVec3::ZERO, 0usize);
    for pixel in 0..image.len() {
        if image.is_valid(pixel) {
            sum += image.point_in_sensor(pixel);
            count += 1;
        }
    }
    let centre = pose.transform_point3(if count > 0 { sum / count as f64 } else { DVec3::ZERO });
    let three = |purpose| DVec3::from_array([0, 1, 2].map(|i| normal(params.seed, purpose, i)));
    let axis = three(Purpose::Axis).try_normalize().unwrap_or(DVec3::Z);
    let turn = DQuat::from_axis_angle(axis, params.pose_turn * normal(params.seed, Purpose::Turn, 0));
    let shift = three(Purpose::Shift) * params.pose_shift;
    DAffine3 {
        matrix3: glam::DMat3::from_quat(turn) * pose.matrix3,
        translation: centre + turn * (pose.translation - centre) + shift,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_right_moments_and_no_neighbours_agree() {
        let n = 200_000;
        let x: Vec<f64> = (0..n).map(|i| normal(7, Purpose::Noise, i)).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..n as usize).map(f).sum::<f64>() / n as f64;
        // Five standard errors each.
        let within = |value: f64, expected: f64, deviation: f64| {
            assert!((value - expected).abs() < 5.0 * deviation / (n as f64).sqrt(), "{value} instead of {expected}");
        };
        within(mean(&|i| x[i]), 0.0, 1.0);
        within(mean(&|i| x[i] * x[i]), 1.0, 2f64.sqrt());
        within(mean(&|i| x[i].powi(4)), 3.0, 96f64.sqrt());
        within(mean(&|i| x[i] * x[(i + 1) % n as usize]), 0.0, 1.0);
        within(mean(&|i| x[i] * normal(8, Purpose::Noise, i as u64)), 0.0, 1.0);
        within(mean(&|i| uniform(7, Purpose::Dropout, i as u64)), 0.5, 12f64.sqrt().recip());
    }
}
