//! From vertices in a host's frame, whose motion is known, to samples, projection and pose.
//!
//! The whole of a host's matrix and the vertices' motion is cut into a rigid pose and what remains, which goes into the image. A scale and
//! a mirror go into the parameters of its projection, so that it stays of its kind. A stretch goes into a grid of points.

use glam::{DAffine3, DMat3, DVec3};

use base::error::{Error, Result, Shown};
use base::magnitude;
use base::progress::Progress;

use super::motion::{self, Motion, ROUNDING};
use crate::range_image::{DepthKind, Projection, RangeImage, Viewing};
use crate::rigid;

/// Axes that are those of a similarity within this are one: hosts multiply matrices in single precision.
const SIMILAR: f64 = 1e-5;

/// A matrix that flattens space to less than this share of its size is one that scales by 0.
const FLAT: f64 = 1e-14;

/// Numbers below this lose digits in single precision.
const SINGLE_SMALLEST: f64 = f32::MIN_POSITIVE as f64 / f32::EPSILON as f64;

/// Vertices on their way to an image.
pub(super) struct Placing<'a> {
    pub rows: usize,
    pub cols: usize,
    pub projection: &'a Projection,
    /// The pixel of each vertex.
    pub pixels: &'a [u32],
    /// Each vertex in the host's frame.
    pub positions: &'a [DVec3],
    pub world_from_host: DAffine3,
    pub motion: Motion,
    /// Whether no anchor is left that could tell a motion: only rays do, where an image has them.
    pub is_blind: bool,
}

/// A transform as a pose and what remains to be done before it, in the sensor's frame.
struct Cut {
    pose: DAffine3,
    remainder: DMat3,
    /// The remainder where that is a scale, and a mirror if it is negative.
    scale: Option<f64>,
}

impl Placing<'_> {
    /// The image without attributes.
    ///
    /// # Errors
    /// [`Error::Input`] if the vertices are flattened, or their samples can't be held. [`Error::Cancelled`].
    pub fn image(&self, progress: &Progress<'_>) -> Result<RangeImage> {
        let cut = |host_from_sensor: DAffine3| -> Result<Cut> {
            let whole = self.world_from_host * host_from_sensor;
            for axes in [self.world_from_host.matrix3, whole.matrix3] {
                refuse_flat(axes)?;
            }
            Ok(Cut::of(&whole, mirror(self.projection)))
        };
        // Of two motions that took the anchors there the one with which the other vertices lie on their rays.
        for host_from_sensor in [Some(self.motion.host_from_sensor), self.motion.or_mirrored].into_iter().flatten() {
            let cut = cut(host_from_sensor)?;
            if let (true, Some(scale)) = (self.motion.is_known, cut.scale)
                && let Some(image) = self.along_rays(&cut.pose, &scaled(self.projection, scale), progress)?
            {
                return Ok(image);
            }
        }
        let cut = cut(self.motion.host_from_sensor)?;
        if self.is_blind && !matches!(self.projection, Projection::PointGrid(_)) {
            return Err(motion::nothing_tells(0));
        }
        self.as_points(&cut, progress)
    }

    /// Places a point of the host in the sensor's frame of a pose.
    fn sensor_from_host(&self, pose: &DAffine3) -> DAffine3 {
        let back = pose.matrix3.transpose();
        DAffine3 {
            matrix3: back * self.world_from_host.matrix3,
            translation: back * (self.world_from_host.translation - pose.translation),
        }
    }

    /// The image of a value per pixel, if each vertex lies on its pixel's ray. Never for a grid of points.
    fn along_rays(
        &self,
        pose: &DAffine3,
        projection: &Projection,
        progress: &Progress<'_>,
    ) -> Result<Option<RangeImage>> {
        if matches!(projection, Projection::PointGrid(_)) || projection.validate().is_err() {
            return Ok(None);
        }
        let sensor_from_host = self.sensor_from_host(pose);
        let world_from_host = longest(self.world_from_host.matrix3);
        let rays = projection.tables(self.rows, self.cols);
        let mut values = vec![f64::NAN; self.rows * self.cols];
        for range in progress.ranges(self.pixels.len()) {
            for i in range? {
                let pixel = self.pixels[i] as usize;
                let (row, col) = (pixel / self.cols, pixel % self.cols);
                let point = sensor_from_host.transform_point3(self.positions[i]);
                let value = match projection {
                    Projection::Pinhole { depth: DepthKind::Ray, .. } | Projection::Spherical { .. } => {
                        rays.point(row, col, 1.0).dot(point)
                    }
                    _ => point.z,
                };
                let is_ahead = value > 0.0 || matches!(projection, Projection::Orthographic { .. });
                let room = self.motion.rounding(self.positions[i]) * world_from_host;
                if !(is_ahead && rays.point(row, col, value).distance(point) <= room) {
                    return Ok(None);
                }
                values[pixel] = value;
            }
        }
        let mut image = RangeImage::from_values(self.rows, self.cols, values, *projection)?;
        image.world_from_sensor = *pose;
        Ok(Some(image))
    }

    /// The image of a point a pixel, seen from where the projection saw it.
    fn as_points(&self, cut: &Cut, progress: &Progress<'_>) -> Result<RangeImage> {
        let viewing = match *self.projection {
            Projection::Orthographic { .. } => Viewing::ALONG_MINUS_Z,
            Projection::Pinhole { .. } | Projection::Spherical { .. } => Viewing::From(DVec3::ZERO),
            Projection::PointGrid(viewing) => viewing,
        };
        let viewing = match viewing {
            // Of the length that it had.
            Viewing::Parallel(direction) => {
                let carried = cut.remainder * direction.normalize_or_zero();
                Viewing::Parallel(carried.normalize_or_zero() * direction.length())
            }
            Viewing::From(origin) => Viewing::From(cut.remainder * origin),
        };
        let sensor_from_host = self.sensor_from_host(&cut.pose);
        let mut points = vec![[f32::NAN; 3]; self.rows * self.cols];
        let mut largest = 0.0_f64;
        for range in progress.ranges(self.pixels.len()) {
            for i in range? {
                let point = sensor_from_host.transform_point3(self.positions[i]);
                if !point.as_vec3().is_finite() {
                    return Err(Error::input(format!(
                        "vertex {i} comes to lie at {}, which single precision cannot hold: use a larger unit",
                        magnitude::shown(point)
                    )));
                }
                largest = largest.max(point.abs().max_element());
                points[self.pixels[i] as usize] = point.as_vec3().to_array();
            }
        }
        if 0.0 < largest && largest < SINGLE_SMALLEST {
            return Err(Error::input(format!(
                "no vertex has a coordinate larger than {}, which single precision cannot hold with all its digits: use a smaller unit",
                Shown(largest)
            )));
        }
        let mut image = RangeImage::from_points(self.rows, self.cols, points, viewing)?;
        image.world_from_sensor = cut.pose;
        Ok(image)
    }
}

impl Cut {
    /// The pose is the rotation nearest to the transform, less the mirror if that mirrors.
    fn of(whole: &DAffine3, mirror: DVec3) -> Self {
        let axes = whole.matrix3;
        let mirrors = axes.determinant() < 0.0;
        let mirror = DMat3::from_diagonal(if mirrors { mirror } else { DVec3::ONE });
        let size = motion::size(axes);
        // A scale that is 1 but for rounding is none.
        let size = if (size - 1.0).abs() <= ROUNDING { 1.0 } else { size };
        let turned = DAffine3 { matrix3: axes * size.recip() * mirror, translation: whole.translation };
        if rigid::departure(turned.matrix3) <= SIMILAR
            && let Ok(pose) = rigid::nearest(turned)
        {
            return Cut { pose, remainder: mirror * size, scale: Some(if mirrors { -size } else { size }) };
        }
        let pose = DAffine3 { matrix3: nearest_rotation(axes) * mirror, translation: whole.translation };
        Cut { pose, remainder: pose.matrix3.transpose() * axes, scale: None }
    }
}

/// The mirror of the frame of a projection that keeps it of its kind.
fn mirror(projection: &Projection) -> DVec3 {
    match projection {
        Projection::Spherical { .. } => DVec3::new(1.0, -1.0, 1.0),
        _ => DVec3::new(-1.0, 1.0, 1.0),
    }
}

/// The projection of an image that is scaled, and mirrored by [`mirror`] if the scale is negative.
fn scaled(projection: &Projection, scale: f64) -> Projection {
    let (size, sign) = (scale.abs(), scale.signum());
    match *projection {
        Projection::Orthographic { first, step } => {
            let [across, down] = [size * sign, size];
            Projection::Orthographic {
                first: [first[0] * across, first[1] * down],
                step: [step[0] * across, step[1] * down],
            }
        }
        Projection::Pinhole { focal, centre, depth } => {
            Projection::Pinhole { focal: [focal[0] * sign, focal[1]], centre, depth }
        }
        Projection::Spherical { first, step } => {
            Projection::Spherical { first: [first[0] * sign, first[1]], step: [step[0] * sign, step[1]] }
        }
        grid @ Projection::PointGrid(_) => grid,
    }
}

fn longest(axes: DMat3) -> f64 {
    [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::length).into_iter().fold(0.0, f64::max)
}

/// The factor of the polar decomposition that turns, and mirrors if the axes do: Newton's iteration.
fn nearest_rotation(axes: DMat3) -> DMat3 {
    let mut rotation = axes * motion::size(axes).recip();
    // Its first steps halve what stretches, up to 1 / FLAT; the last ones double the digits.
    for _ in 0..64 {
        rotation = (rotation + rotation.inverse().transpose()) * 0.5;
        if rigid::departure(rotation) <= 4.0 * f64::EPSILON {
            break;
        }
    }
    rotation
}

fn refuse_flat(axes: DMat3) -> Result<()> {
    let longest = longest(axes);
    let relative = axes * longest.recip();
    if longest < magnitude::SMALLEST || !(relative.determinant().abs() > FLAT) {
        return Err(Error::input(
            "the matrix flattens the vertices: it scales by 0 in some direction. Set the scale to another number.",
        ));
    }
    Ok(())
}
