//! The four kinds of rays that an image has, and points on them.

use glam::DVec3;

use super::view::{CentralView, FlatView, ParallelView, PinholeView, View};
use image::range_image::{Projection, RangeImage, Samples, Viewing};

/// The rays of an image.
pub(super) enum Rays<'a> {
    /// Orthographic.
    Flat(FlatView<'a>),
    /// Pinhole.
    Pinhole(PinholeView<'a>),
    /// Point grid, parallel rays.
    Parallel(ParallelView<'a>),
    /// Rays from a point, not on a lattice.
    Central(CentralView<'a>),
}

impl<'a> Rays<'a> {
    /// `mirrored`: triangles that turn like columns toward rows turn clockwise seen from the sensor.
    pub fn new(image: &'a RangeImage, mirrored: bool) -> Self {
        let cols = image.cols() as u32;
        let sign = if mirrored { -1.0 } else { 1.0 };
        match (image.projection(), image.samples()) {
            (Projection::Orthographic { .. }, Samples::Values(values)) => Rays::Flat(FlatView { values, cols }),
            (&Projection::Pinhole { focal, centre, depth }, Samples::Values(values)) => {
                Rays::Pinhole(PinholeView { values, cols, focal, centre, depth })
            }
            (Projection::PointGrid(Viewing::Parallel(direction)), _) => {
                // Along an axis this is a signed permutation: the points keep every digit.
                let toward = -direction.normalize();
                let (right, up) = across(toward);
                Rays::Parallel(ParallelView { image, right: right * sign, up, toward })
            }
            (Projection::PointGrid(Viewing::From(eye)), _) => Rays::Central(CentralView { image, eye: *eye, sign }),
            _ => Rays::Central(CentralView { image, eye: DVec3::ZERO, sign }),
        }
    }
}

impl Rays<'_> {
    /// The point on the ray of pixel `index` whose [`Site::value`] is `value`, in the sensor's frame.
    pub fn point(&self, image: &RangeImage, index: u32, value: f64) -> DVec3 {
        let sample = image.point_in_sensor(index as usize);
        match self {
            Rays::Flat(_) => sample.with_z(value),
            Rays::Pinhole(view) => sample * (view.site(index).inverse / value),
            Rays::Parallel(view) => sample + view.toward * (value - view.site(index).height),
            Rays::Central(view) => view.eye + (sample - view.eye) / value,
        }
    }
}

/// Columns between two rows of a lattice, as far as angles go.
pub(super) fn aspect(image: &RangeImage) -> f64 {
    match image.projection() {
        Projection::Orthographic { step, .. } => (step[1] / step[0]).abs(),
        Projection::Pinhole { focal, .. } => (focal[0] / focal[1]).abs(),
        _ => 1.0,
    }
}

/// Two directions that make a right-handed frame with `toward`, a unit vector.
fn across(toward: DVec3) -> (DVec3, DVec3) {
    let axis = if toward.x.abs() < 0.5 { DVec3::X } else { DVec3::Y };
    let right = (axis - toward * toward.dot(axis)).normalize();
    (right, toward.cross(right))
}
