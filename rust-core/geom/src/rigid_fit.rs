//! The rigid motion between two sets of points, in closed form.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::linear::eigen;

/// The rigid transform that takes points `from` to points `to` with the least sum of weighted squared distances (Horn 1987):
/// the rotation is the eigenvector of the largest eigenvalue.
///
/// Sums of products lose the digits of points that lie far from the origin beside their extent: give these less their mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidFit {
    weight: f64,
    from: DVec3,
    to: DVec3,
    products: DMat3,
}

impl Default for RigidFit {
    fn default() -> Self {
        RigidFit::new()
    }
}

impl RigidFit {
    /// Of nothing yet.
    pub fn new() -> Self {
        RigidFit { weight: 0.0, from: DVec3::ZERO, to: DVec3::ZERO, products: DMat3::ZERO }
    }

    /// A point and where it is to come to lie, with a weight > 0.
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

    /// `None` where a turn is left open: without points, for points in a line.
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
            let truth = DAffine3::from_rotation_translation(DQuat::from_scaled_axis(3.0 * turn), shift);
            let mut fit = RigidFit::new();
            points.iter().for_each(|&p| fit.point(p, truth.transform_point3(p), 0.7));
            if let Some(found) = fit.solve() {
                for &p in &points {
                    prop_assert!(found.transform_point3(p).distance(truth.transform_point3(p)) < 1e-6);
                }
            }
        }
    }

    #[test]
    fn what_decides_nothing_has_no_answer() {
        let mut fit = RigidFit::new();
        assert!(fit.solve().is_none());
        (0..3).for_each(|i| fit.point(DVec3::X * f64::from(i), DVec3::X * f64::from(i), 1.0));
        assert!(fit.solve().is_none(), "points in a line turn about it");
    }
}
