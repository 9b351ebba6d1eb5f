//! Gravity: a motion of two scans that know what is up keeps it up.

use glam::DAffine3;

use crate::view::View;

/// Cosine of how far up may be off between two scans, 10 degrees: phones know it to 1 or 2 while they are moved.
const UPRIGHT: f64 = 0.985;

/// How far off up may be between two scans, in whole degrees.
pub(crate) fn most_tipped() -> f64 {
    UPRIGHT.acos().to_degrees().round()
}

/// How far a motion turns up, in degrees, where two scans know it and may not differ by so much.
pub(crate) fn tipped(both: [&View; 2], a_from_b: &DAffine3) -> Option<f64> {
    let [of_a, of_b] = both.map(|view| view.reduced.up);
    let off = a_from_b.transform_vector3(of_b?).angle_between(of_a?).to_degrees();
    (!keeps_up(both, a_from_b)).then_some(off)
}

/// Whether a motion keeps up where both scans know it, or one of them does not.
pub(crate) fn keeps_up(both: [&View; 2], a_from_b: &DAffine3) -> bool {
    let [Some(of_a), Some(of_b)] = both.map(|view| view.reduced.up) else { return true };
    a_from_b.transform_vector3(of_b).dot(of_a) > UPRIGHT
}
