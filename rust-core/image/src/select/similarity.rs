//! True size and ground: one transform for all scans of a set, and for what was made of them.
//!
//! Poses stay rigid: the scale goes into samples and translations.

use glam::{DAffine3, DMat3, DVec3};

use base::error::{Error, Result, Shown};
use base::magnitude;
use base::memory;
use mesh::point_cloud::PointCloud;
use mesh::{AttributeData, Crs, TriMesh};

use super::region::Plane;
use crate::frame::Frame;
use crate::range_image::{Projection, RangeImage, Samples, Viewing};
use crate::rigid;

/// Scales, then turns and shifts: takes the world to another, which is in no coordinate reference system any more unless nothing changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    scale: f64,
    turned: DAffine3,
}

/// Attributes that are lengths in the unit of the mesh.
const LENGTHS: [&str; 2] = ["error", "noise"];

impl Similarity {
    /// Changes nothing.
    pub const IDENTITY: Similarity = Similarity { scale: 1.0, turned: DAffine3::IDENTITY };

    /// Makes two places lie `distance` apart: a scale about the origin.
    ///
    /// # Errors
    /// Places that are the same, numbers that are not finite, too large or too small, a distance not above 0.
    pub fn true_size(a: DVec3, b: DVec3, distance: f64) -> Result<Self> {
        magnitude::place("the first point", a)?;
        magnitude::place("the second point", b)?;
        let measured = a.distance(b);
        if a == b {
            return Err(Error::input(format!(
                "both points lie at {}: pick two that lie apart, whose distance is known",
                magnitude::shown(a)
            )));
        }
        if distance.is_nan() || distance <= 0.0 {
            return Err(Error::input(format!("the true distance must be > 0, got {}", Shown(distance))));
        }
        magnitude::divisor("the true distance", distance)?;
        magnitude::divisor("the distance of the two points", measured)?;
        Similarity::scaling(distance / measured)
    }

    /// Scales about the origin.
    ///
    /// # Errors
    /// A scale that is not above 0, not finite, too large or too small.
    pub fn scaling(scale: f64) -> Result<Self> {
        if scale.is_nan() || scale <= 0.0 {
            return Err(Error::input(format!("the scale must be > 0, got {}", Shown(scale))));
        }
        Ok(Similarity { scale: magnitude::divisor("the scale", scale)?, turned: DAffine3::IDENTITY })
    }

    /// Lays a plane into the plane through the origin that `up` is the normal of, with what lies above it on the side of `up`. It is the
    /// least turn about the origin that does, and a shift along `up`.
    ///
    /// # Errors
    /// A direction that is not finite or has no length.
    pub fn ground(plane: &Plane, up: DVec3) -> Result<Self> {
        let up = Plane::new(DVec3::ZERO, magnitude::direction("up", up)?, 0.0)?.normal();
        let height = plane.point().dot(plane.normal());
        Ok(Similarity {
            scale: 1.0,
            turned: DAffine3 { matrix3: least_turn(plane.normal(), up), translation: -height * up },
        })
    }

    /// The nearest similarity to a transform that scales all directions alike, does not mirror and has axes orthonormal within
    /// [`rigid::TOLERANCE`] but for the scale.
    ///
    /// # Errors
    /// What is wrong and the remedy.
    pub fn from_affine(transform: DAffine3) -> Result<Self> {
        let [a, b, c] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
        for column in [a, b, c, transform.translation] {
            magnitude::place("each column of the similarity", column)?;
        }
        let lengths = [a, b, c].map(DVec3::length);
        // Of a rotation times a scale all three, and the mean of what rounding left of them.
        let scale = if lengths[0] == lengths[1] && lengths[1] == lengths[2] {
            lengths[0]
        } else {
            lengths.iter().sum::<f64>() / 3.0
        };
        let scale = Similarity::scaling(scale)?.scale;
        let turn = DAffine3 { matrix3: transform.matrix3 * scale.recip(), translation: transform.translation };
        let turned = rigid::nearest(turn).map_err(|why| {
            Error::input(format!(
                "the similarity must scale all directions alike, turn and shift only: less its scale {why}"
            ))
        })?;
        Ok(Similarity { scale, turned })
    }

    /// As a transform of places.
    pub fn to_affine(&self) -> DAffine3 {
        DAffine3 { matrix3: self.turned.matrix3 * self.scale, translation: self.turned.translation }
    }

    /// Factor of lengths.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// This one first, then another.
    #[must_use]
    pub fn then(&self, next: &Similarity) -> Similarity {
        Similarity {
            scale: self.scale * next.scale,
            turned: DAffine3 {
                matrix3: next.turned.matrix3 * self.turned.matrix3,
                translation: next.of_place(self.turned.translation),
            },
        }
    }

    /// Takes back.
    #[must_use]
    pub fn inverse(&self) -> Similarity {
        let back = self.turned.matrix3.transpose();
        let scale = self.scale.recip();
        Similarity { scale, turned: DAffine3 { matrix3: back, translation: back * self.turned.translation * -scale } }
    }

    /// The new place of a place.
    pub fn of_place(&self, at: DVec3) -> DVec3 {
        self.turned.matrix3 * (at * self.scale) + self.turned.translation
    }

    /// The pose of a scan whose samples are scaled, too.
    ///
    /// # Errors
    /// A place that becomes too large.
    pub fn of_pose(&self, world_from_scan: DAffine3) -> Result<DAffine3> {
        if *self == Similarity::IDENTITY {
            return Ok(world_from_scan);
        }
        let translation = self.of_place(world_from_scan.translation);
        Ok(DAffine3 {
            matrix3: self.turned.matrix3 * world_from_scan.matrix3,
            translation: magnitude::place("the place of the scan", translation)?,
        })
    }

    /// Samples and pose of an image. Grid and rays stay. O(pixels).
    ///
    /// # Errors
    /// Samples that become too large or too small.
    pub fn of_image(&self, image: &mut RangeImage) -> Result<()> {
        let pose = self.of_pose(image.world_from_sensor)?;
        scale_image(image, self.scale)?;
        image.world_from_sensor = pose;
        image.crs = self.of_crs(image.crs.take());
        Ok(())
    }

    /// Points and pose of a cloud. O(points).
    ///
    /// # Errors
    /// Points that become too large or too small.
    pub fn of_cloud(&self, cloud: &mut PointCloud) -> Result<()> {
        let pose = self.of_pose(cloud.world_from_cloud)?;
        scale_cloud(cloud, self.scale)?;
        cloud.world_from_cloud = pose;
        cloud.crs = self.of_crs(cloud.crs.take());
        Ok(())
    }

    /// The vertices of a mesh that lies in the world, and its attributes that are lengths. O(vertices).
    ///
    /// # Errors
    /// Coordinates that become too large or too small.
    pub fn of_mesh(&self, mesh: &mut TriMesh) -> Result<()> {
        scale_mesh(mesh, self.scale)?;
        if self.turned != DAffine3::IDENTITY {
            mesh.positions.iter_mut().for_each(|at| *at = self.turned.transform_point3(*at));
            finite("vertex", &mesh.positions)?;
        }
        mesh.crs = self.of_crs(mesh.crs.take());
        Ok(())
    }

    /// The system that coordinates are in afterwards.
    pub fn of_crs(&self, crs: Option<Crs>) -> Option<Crs> {
        crs.filter(|_| *self == Similarity::IDENTITY)
    }
}

/// The rotation by the least angle that takes one unit vector to another. About a fixed axis if they are opposite.
fn least_turn(from: DVec3, to: DVec3) -> DMat3 {
    let (across, cos) = (from.cross(to), from.dot(to));
    let sin = across.length();
    let axis = match across.try_normalize() {
        Some(axis) => axis,
        None if cos > 0.0 => return DMat3::IDENTITY,
        None => from.any_orthonormal_vector(),
    };
    // Rodrigues: the part along the axis stays, the rest turns.
    let turn = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
    DMat3::from_cols(turn(DVec3::X), turn(DVec3::Y), turn(DVec3::Z))
}

fn finite(what: &str, places: &[DVec3]) -> Result<()> {
    // Those of clouds may have been so before.
    let bad = places.iter().find(|at| at.is_finite() && at.abs().max_element() > magnitude::LARGEST);
    match bad {
        None => Ok(()),
        Some(at) => Err(Error::input(format!(
            "a {what} would lie at {}, but coordinates may be at most {:e} in size: check the distance and its unit",
            magnitude::shown(*at),
            magnitude::LARGEST
        ))),
    }
}

/// Multiplies the samples of an image in its own frame.
///
/// # Errors
/// Samples that become too large or too small.
pub fn scale_image(image: &mut RangeImage, scale: f64) -> Result<()> {
    if scale == 1.0 {
        return Ok(());
    }
    let (rows, cols) = (image.rows(), image.cols());
    memory::foresee(image.len(), 12.0, "scaling", "pixels")?;
    let lost = |problem: &dyn std::fmt::Display| {
        Error::input(format!("scaled by {} samples become too large or too small: {problem}", Shown(scale)))
    };
    let scaled = match image.samples() {
        Samples::Values(values) => {
            let projection = match *image.projection() {
                Projection::Orthographic { first, step } => {
                    Projection::Orthographic { first: first.map(|x| x * scale), step: step.map(|x| x * scale) }
                }
                other => other,
            };
            RangeImage::from_values(rows, cols, values.iter().map(|value| value * scale).collect(), projection)
        }
        Samples::Points(points) => {
            let viewing = match *image.projection() {
                Projection::PointGrid(Viewing::From(origin)) => Viewing::From(origin * scale),
                Projection::PointGrid(viewing) => viewing,
                _ => unreachable!("points are of a grid of points"),
            };
            let larger = |x: f32| (f64::from(x) * scale) as f32;
            RangeImage::from_points(rows, cols, points.iter().map(|point| point.map(larger)).collect(), viewing)
        }
    };
    let mut scaled = scaled.map_err(|error| lost(&error))?;
    let mut largest = 0.0_f64;
    scaled.for_each_valid(|_, _, point| largest = largest.max(point.abs().max_element()));
    if largest > magnitude::LARGEST || scaled.valid_count() != image.valid_count() {
        return Err(lost(&"check the distance and its unit"));
    }
    scaled.name = std::mem::take(&mut image.name);
    scaled.world_from_sensor = image.world_from_sensor;
    scaled.colour = image.colour.take();
    scaled.intensity = image.intensity.take();
    scaled.confidence = image.confidence.take();
    scaled.crs = image.crs.take();
    *image = scaled;
    Ok(())
}

/// Multiplies the points of a cloud, and where they were seen from, in its own frame.
///
/// # Errors
/// Points that become too large.
pub fn scale_cloud(cloud: &mut PointCloud, scale: f64) -> Result<()> {
    if scale == 1.0 {
        return Ok(());
    }
    cloud.positions.iter_mut().chain(&mut cloud.sensor).for_each(|at| *at *= scale);
    finite("point", &cloud.positions)?;
    finite("sensor", cloud.sensor.as_slice())
}

/// Multiplies the vertices of a mesh in its own frame, and its attributes that are lengths.
///
/// # Errors
/// Vertices that become too large.
pub fn scale_mesh(mesh: &mut TriMesh, scale: f64) -> Result<()> {
    if scale == 1.0 {
        return Ok(());
    }
    mesh.positions.iter_mut().for_each(|at| *at *= scale);
    finite("vertex", &mesh.positions)?;
    mesh.rounding_room = mesh.rounding_room.map(|room| room * scale);
    for attribute in mesh.vertex_attributes.iter_mut().chain(&mut mesh.face_attributes) {
        if let (true, AttributeData::F32(lengths)) = (LENGTHS.contains(&attribute.name.as_str()), &mut attribute.data) {
            lengths.iter_mut().for_each(|length| *length = (f64::from(*length) * scale) as f32);
        }
    }
    Ok(())
}

/// Multiplies all lengths of a frame in its own frame.
///
/// # Errors
/// Samples that become too large or too small.
pub fn scale_frame(frame: &mut Frame, scale: f64) -> Result<()> {
    scale_image(&mut frame.depth, scale)?;
    frame.reach = frame.reach.map(|reach| reach * scale);
    if let Some(colour) = &mut frame.colour {
        colour.colour_from_depth.translation *= scale;
    }
    Ok(())
}
