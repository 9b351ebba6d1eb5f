//! Along which axis the points of a plane are looked at: that of the largest component of its normal.

use glam::{DVec2, DVec3};

use crate::predicates::{Arithmetic, orient2d};
use base::error::{Error, Result};

/// Of a plane from the side where the axis' coordinate is large: points turn the same way in both.
pub(super) struct View {
    /// The coordinate that is left out.
    pub(super) axis: usize,
    /// A power of two that makes coordinates ordinary.
    pub(super) factor: f64,
    /// Whether circles are not seen as circles.
    pub(super) is_sheared: bool,
    /// Whether it is seen from the side that triangles are not to show.
    pub(super) is_from_behind: bool,
}

impl View {
    pub(super) fn of(points: &[DVec3], corners: [usize; 3]) -> Result<View> {
        let (_, factor) = Arithmetic::of(points.iter().copied());
        let mut view = View { axis: 0, factor, is_sheared: false, is_from_behind: false };
        for point in points {
            if let Some(x) = (*point * factor).to_array().into_iter().find(|&x| !is_in_range(x)) {
                return Err(Error::input(format!(
                    "the points lie in one plane, and a coordinate of {:e} is too small beside the others to be multiplied with \
                     them: make it 0",
                    x / factor
                )));
            }
        }
        let corners = corners.map(|i| points[i]);
        let [a, b, c] = corners.map(|p| p * factor);
        let normal = (b - a).cross(c - a).abs();
        let signs = [0, 1, 2].map(|axis| {
            let [a, b, c] = corners.map(|p| View { axis, ..view }.seen(p));
            orient2d(a, b, c)
        });
        let visible = (0..3).filter(|&axis| signs[axis] != 0);
        view.axis = visible.max_by(|&i, &j| normal[i].total_cmp(&normal[j])).expect("three points not on a line");
        view.is_sheared = signs.iter().filter(|&&sign| sign != 0).count() > 1;
        let front = [2, 1, 0].into_iter().find(|&axis| signs[axis] != 0).expect("three points not on a line");
        view.is_from_behind = signs[view.axis] != signs[front];
        Ok(view)
    }

    /// The place where a point is seen.
    pub(super) fn seen(&self, point: DVec3) -> DVec2 {
        DVec2::new(point[(self.axis + 1) % 3], point[(self.axis + 2) % 3]) * self.factor
    }
}

/// Whether exact arithmetic on doubles can multiply a coordinate.
pub(super) fn is_in_range(x: f64) -> bool {
    x == 0.0 || (spade::MIN_ALLOWED_VALUE..=spade::MAX_ALLOWED_VALUE).contains(&x.abs())
}
