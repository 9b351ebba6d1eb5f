//! Rigid transforms out of what others write: the one rule for poses of files, of arrays and of host objects.

use glam::{DAffine3, DMat3, DVec3};

/// Tolerance for axes of a pose that are not orthonormal: the largest entry of the axes' scalar products less those of an orthonormal
/// frame. Poses come out of other programs' single precision and few printed digits. Scans of another scale are further off.
pub const TOLERANCE: f64 = 0.02;

/// From here on axes are orthonormal to the last digits and stay as they are.
const EXACT: f64 = 1e-13;

/// The rigid transform nearest to one whose axes are orthonormal within [`TOLERANCE`]: the rotation nearest to the
/// axes, the translation as it is. Axes orthonormal to the last digits stay as they are.
///
/// # Errors
/// The fault and the remedy, to be put behind the name of the pose.
pub fn nearest(transform: DAffine3) -> Result<DAffine3, String> {
    let axes = transform.matrix3;
    let off = departure(axes);
    if !(off <= TOLERANCE) || !transform.translation.is_finite() {
        let [a, b, c] = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::length);
        return Err(format!(
            "its axes have the lengths {a:.4}, {b:.4}, {c:.4} and are orthonormal within {off:.2e}, which must be at \
                most {TOLERANCE}. Apply scale and shear to the samples instead."
        ));
    }
    if axes.determinant() < 0.0 {
        return Err("it mirrors, but a scan can only be turned and moved".to_owned());
    }
    let mut rotation = axes;
    if off > EXACT {
        // Newton's iteration for the polar decomposition: quadratic from so close.
        for _ in 0..8 {
            rotation = (rotation + rotation.inverse().transpose()) * 0.5;
        }
    }
    Ok(DAffine3 { matrix3: rotation, translation: transform.translation })
}

/// Largest departure of axes from unit length and right angles.
pub(crate) fn departure(axes: DMat3) -> f64 {
    let rest = (axes.transpose() * axes - DMat3::IDENTITY).to_cols_array();
    // A NaN is the largest of all.
    rest.into_iter().map(f64::abs).fold(0.0, |most, d| if most >= d || most.is_nan() { most } else { d })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn turn() -> DMat3 {
        DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.2, 2.0))
    }

    fn made(axes: DMat3) -> Result<DAffine3, String> {
        nearest(DAffine3 { matrix3: axes, translation: DVec3::new(1e6, 2.0, -3.0) })
    }

    /// Theorem: a pose within the tolerance becomes orthonormal to the last digits, no further from the given one than that was from
    /// orthonormal. The translation stays.
    #[test]
    fn what_is_nearly_rigid_becomes_it() {
        for digits in [1e2, 1e4, 1e7] {
            let printed = DMat3::from_cols_array(&turn().to_cols_array().map(|x| (x * digits).round() / digits));
            let pose = made(printed).unwrap();
            assert!(departure(pose.matrix3) < 1e-15, "{pose:?}");
            let moved = (pose.matrix3 - printed).to_cols_array().map(f64::abs).into_iter().fold(0.0, f64::max);
            assert!(moved <= departure(printed) && moved < 1.0 / digits, "{moved} with {digits}");
            assert_eq!(pose.translation, DVec3::new(1e6, 2.0, -3.0));
        }
        assert_eq!(made(turn()).unwrap().matrix3, turn());
        assert!(made(turn() * 1.0099).is_ok());
    }

    #[test]
    fn what_is_not_says_why() {
        for (axes, why) in [
            (turn() * 1.0101, "its axes have the lengths 1.0101, 1.0101, 1.0101 and are orthonormal within 2.03e-2"),
            (turn() * DMat3::from_diagonal(DVec3::new(1.0, 2.0, 1.0)), "lengths 1.0000, 2.0000, 1.0000"),
            (turn() * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)), "it mirrors, but a scan can only be turned"),
            (DMat3::from_diagonal(DVec3::new(1.0, f64::NAN, 1.0)), "must be at most 0.02. Apply scale and shear"),
        ] {
            let error = made(axes).unwrap_err();
            assert!(error.contains(why), "{error}");
        }
    }
}
