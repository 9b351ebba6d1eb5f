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

/// The rigid transform that takes points `from` to points `to` with the least sum of weighted squared distances (Horn 1987):
/// the rotation is the eigenvector of the largest eigenvalue.
pub(crate) struct Horn {
    weight: f64,
    from: DVec3,
    to: DVec3,
    products: DMat3,
}

impl Horn {
    pub fn new() -> Self {
        Horn { weight: 0.0, from: DVec3::ZERO, to: DVec3::ZERO, products: DMat3::ZERO }
    }

    pub fn point(&mut self, from: DVec3, to: DVec3, weight: f64) {
        self.weight += weight;
        self.from += weight * from;
        self.to += weight * to;
        self.direction(from, to, weight);
    }

    /// A direction, which says nothing of the translation.
    pub fn direction(&mut self, from: DVec3, to: DVec3, weight: f64) {
        self.products += weight * DMat3::from_cols(from * to.x, from * to.y, from * to.z);
    }

    pub fn solve(&self) -> Option<DAffine3> {
        if !(self.weight > 0.0) {
            return None;
        }
        let (from, to) = (self.from / self.weight, self.to / self.weight);
        let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
        // s[i][j]: from_i * to_j.
        let m = self.products - self.weight * outer(from, to);
        let s = |i: usize, j: usize| m.col(j)[i];
        let [xx, xy, xz] = [s(0, 0), s(0, 1), s(0, 2)];
        let [yx, yy, yz] = [s(1, 0), s(1, 1), s(1, 2)];
        let [zx, zy, zz] = [s(2, 0), s(2, 1), s(2, 2)];
        let n = [
            [xx + yy + zz, yz - zy, zx - xz, xy - yx],
            [yz - zy, xx - yy - zz, xy + yx, zx + xz],
            [zx - xz, xy + yx, -xx + yy - zz, yz + zy],
            [xy - yx, zx + xz, yz + zy, -xx - yy + zz],
        ];
        let (values, vectors) = eigen(&n);
        // Of two equal eigenvalues any rotation between both does: nothing is known.
        if !(values[3] - values[2] > 1e-9 * values[3].abs()) {
            return None;
        }
        let [w, x, y, z] = vectors[3];
        let rotation = DQuat::from_xyzw(x, y, z, w).normalize();
        Some(DAffine3::from_rotation_translation(rotation, to - rotation * from))
    }
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

    fn vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-1.0..1.0_f64).prop_map(DVec3::from)
    }

    proptest! {
        #[test]
        fn a_motion_is_found_again(
            points in prop::collection::vec(vector(), 4..20), turn in vector(), shift in vector(),
        ) {
            let truth = motion(3.0 * turn, shift);
            let mut horn = Horn::new();
            points.iter().for_each(|&p| horn.point(p, truth.transform_point3(p), 0.7));
            if let Some(found) = horn.solve() {
                for &p in &points {
                    prop_assert!(found.transform_point3(p).distance(truth.transform_point3(p)) < 1e-6);
                }
            }
        }

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
        let mut horn = Horn::new();
        assert!(horn.solve().is_none());
        (0..3).for_each(|i| horn.point(DVec3::X * f64::from(i), DVec3::X * f64::from(i), 1.0));
        assert!(horn.solve().is_none(), "points in a line turn about it");
        assert!(solve(&[[0.0; 6]; 6], &[0.0; 6]).is_none());
    }
}
