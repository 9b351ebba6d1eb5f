//! Small systems of linear equations: six unknowns a rigid motion.

use glam::{DAffine3, DMat3, DQuat, DVec3};

pub(crate) use geom::linear::{eigen, solve};

pub(crate) type Vector6 = [f64; 6];
pub(crate) type Matrix6 = [[f64; 6]; 6];

/// Normal equations of a motion `[rotation, translation]`: sums of `J^T J` and `J^T r`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    pub squares: Matrix6,
    pub gradient: Vector6,
    /// Sum of weighted squared residuals, and of weights.
    pub residual: f64,
    pub weight: f64,
}

impl Sums {
    #[inline]
    pub fn add(&mut self, row: &Vector6, residual: f64, weight: f64) {
        for i in 0..6 {
            let scaled = weight * row[i];
            for j in 0..=i {
                self.squares[i][j] += scaled * row[j];
            }
            self.gradient[i] += scaled * residual;
        }
        self.residual += weight * residual * residual;
        self.weight += weight;
    }

    /// The upper triangle as the lower.
    pub fn mirrored(&self) -> Matrix6 {
        let mut all = self.squares;
        for i in 0..6 {
            for j in 0..i {
                all[j][i] = all[i][j];
            }
        }
        all
    }
}

/// The rigid motion of a small rotation vector and a translation, rotation first.
pub(crate) fn motion(rotation: DVec3, translation: DVec3) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_scaled_axis(rotation), translation)
}

/// A rigid transform to its nearest rotation: products of many lose their right angles.
pub(crate) fn rigid(transform: &DAffine3) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_mat3(&transform.matrix3).normalize(), transform.translation)
}

/// Largest distance that two motions put a scan's points apart by, about.
pub(crate) fn apart(x: &DAffine3, y: &DAffine3, radius: f64) -> f64 {
    let difference = x.inverse() * *y;
    let turn = (difference.matrix3 - DMat3::IDENTITY).to_cols_array().iter().map(|d| d * d).sum::<f64>().sqrt();
    difference.translation.length() + turn * radius / std::f64::consts::SQRT_2
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn solutions_and_eigenvectors_are_such(rows in prop::collection::vec(prop::array::uniform6(-1.0..1.0_f64), 12)) {
            let mut sums = Sums::default();
            rows.iter().enumerate().for_each(|(i, row)| sums.add(row, i as f64, 1.0));
            let matrix = sums.mirrored();
            if let Some(x) = solve(&matrix, &sums.gradient) {
                for i in 0..6 {
                    let product: f64 = (0..6).map(|j| matrix[i][j] * x[j]).sum();
                    prop_assert!((product - sums.gradient[i]).abs() < 1e-6);
                }
            }
            let (values, vectors) = eigen(&matrix);
            prop_assert!(values.is_sorted());
            for (value, vector) in values.iter().zip(&vectors) {
                for i in 0..6 {
                    let product: f64 = (0..6).map(|j| matrix[i][j] * vector[j]).sum();
                    prop_assert!((product - value * vector[i]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn what_decides_nothing_has_no_answer() {
        assert!(solve(&[[0.0; 6]; 6], &[0.0; 6]).is_none());
    }
}
