//! Places: what any scan comes down to where only where its samples lie counts, and from which side they were seen.

use glam::{DAffine3, DVec3};

use crate::oriented::OrientedPoints;
use crate::range_image::RangeImage;
use base::error::Result;
use base::memory;
use base::progress::Progress;
use mesh::TriMesh;
use mesh::point_cloud::PointCloud;

/// Places of the samples of a scan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Places {
    /// In the scan's own frame, finite.
    pub positions: Vec<DVec3>,
    /// A direction for each, of any length, toward the side that it was seen from. Zero if that is not known.
    pub outward: Vec<DVec3>,
    /// Places them in the world.
    pub world_from_places: DAffine3,
}

impl Places {
    /// The valid pixels of an image, seen from its sensor. O(pixels).
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn of_image(image: &RangeImage, progress: &Progress<'_>) -> Result<Self> {
        memory::foresee(image.len(), 2.0 * size_of::<DVec3>() as f64, "the samples of", "pixels")?;
        let mut places = Places { world_from_places: image.world_from_sensor, ..Places::default() };
        let visit = |_: usize, _: usize, point: DVec3| {
            places.positions.push(point);
            places.outward.push(-image.projection().view_direction(point));
        };
        image.try_for_each_valid(visit, progress)?;
        Ok(places)
    }

    /// The vertices of a mesh that have a face, seen from outside. O(vertices + faces).
    ///
    /// # Errors
    /// A mesh that is not valid. A coordinate too large.
    pub fn of_mesh(mesh: &TriMesh, world_from_mesh: DAffine3) -> Result<Self> {
        OrientedPoints::of_mesh(mesh, world_from_mesh).map(Places::from)
    }

    /// The finite points of a cloud, seen from where its normals point. O(points).
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn of_cloud(cloud: &PointCloud, world_from_places: DAffine3, progress: &Progress<'_>) -> Result<Self> {
        memory::foresee(cloud.positions.len(), 2.0 * size_of::<DVec3>() as f64, "the places of", "points")?;
        let mut places = Places { world_from_places, ..Places::default() };
        for block in progress.ranges(cloud.positions.len()) {
            for k in block?.filter(|&k| cloud.positions[k].is_finite()) {
                let normal = cloud.normals.as_ref().map_or(DVec3::ZERO, |all| DVec3::from(all[k].map(f64::from)));
                places.positions.push(cloud.positions[k]);
                places.outward.push(if normal.is_finite() { normal } else { DVec3::ZERO });
            }
        }
        Ok(places)
    }
}

impl From<OrientedPoints> for Places {
    fn from(points: OrientedPoints) -> Self {
        Places { positions: points.positions, outward: points.areas, world_from_places: points.world_from_points }
    }
}
