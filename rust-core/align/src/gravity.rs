//! Gravity: a motion of two scans that know what is up keeps it up.

use glam::DAffine3;

use crate::view::View;

/// Cosine of how far up may be off between two scans, 10 degrees: phones know it to 1 or 2 while they are moved.
const UPRIGHT: f64 = 0.985;

/// Whether a motion keeps up where both scans know it, or one of them does not.
pub(crate) fn keeps_up(both: [&View; 2], a_from_b: &DAffine3) -> bool {
    let [Some(of_a), Some(of_b)] = both.map(|view| view.reduced.up) else { return true };
    a_from_b.transform_vector3(of_b).dot(of_a) > UPRIGHT
}
