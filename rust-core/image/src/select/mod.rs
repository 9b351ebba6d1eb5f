//! Selections: the parts of scans that are kept or removed before they are merged or aligned: by a box, by a plane, by a mask.
//!
//! | file | what |
//! |---|---|
//! | `region` | boxes, planes and masks: which samples they hold |
//! | `similarity` | true size and ground: turns, shifts and scales all scans alike |
//!
//! A range image keeps its grid, its projection and its pose: a removed sample is a pixel of which nothing is known. So a merge does
//! not see through places whose samples were removed. A mesh keeps the faces of which all three vertices stay. Attributes stay with
//! what they are of.

mod region;
mod similarity;
#[cfg(test)]
mod tests;

pub use crate::places::Places;
pub use region::{Mask, OrientedBox, Plane};
pub use similarity::{Similarity, scale_cloud, scale_frame, scale_image, scale_mesh};

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use base::error::Result;
use base::memory;
use base::progress::{Pace, Progress};
use mesh::TriMesh;
use mesh::point_cloud::PointCloud;

use crate::range_image::RangeImage;

/// The rule that tells samples apart.
#[derive(Clone, Debug, PartialEq)]
pub enum Region {
    /// Inside of a box or on its sides.
    Box(OrientedBox),
    /// Below a plane, on it, or at most its margin above.
    Below(Plane),
    /// Marked, in the one scan that the mask is of.
    Mask(Arc<Mask>),
}

/// A region, and whether what it holds stays or goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// The region of the samples.
    pub region: Region,
    /// They stay and all others go. Else it is the other way round.
    pub keep: bool,
}

impl Region {
    /// Keeps what the region holds.
    pub fn kept(self) -> Selection {
        Selection { region: self, keep: true }
    }

    /// Removes what the region holds.
    pub fn removed(self) -> Selection {
        Selection { region: self, keep: false }
    }

    fn holds(&self, index: usize, at: DVec3) -> bool {
        match self {
            Region::Box(region) => region.contains(at),
            Region::Below(plane) => plane.contains(at),
            Region::Mask(mask) => mask.is_marked(index),
        }
    }
}

/// Bytes that selecting takes for a sample beside those that stay.
const A_SAMPLE: f64 = 8.0;

impl Selection {
    /// Makes the pixels of an image invalid whose samples don't stay. Returns how many. O(pixels).
    ///
    /// # Errors
    /// A mask of another size. [`base::Error::Cancelled`].
    pub fn of_image(&self, image: &mut RangeImage, progress: &Progress<'_>) -> Result<usize> {
        if let Region::Mask(mask) = &self.region {
            mask.fits_image(image.rows(), image.cols())?;
        }
        progress.check()?;
        memory::foresee(image.len(), A_SAMPLE, "selecting", "pixels")?;
        let (cols, world_from_sensor) = (image.cols(), image.world_from_sensor);
        let mut gone = Vec::new();
        let visit = |row: usize, col: usize, point: DVec3| {
            let pixel = row * cols + col;
            if self.region.holds(pixel, world_from_sensor.transform_point3(point)) != self.keep {
                gone.push(pixel);
            }
        };
        image.try_for_each_valid(visit, progress)?;
        let count = gone.len();
        image.leave_out(gone);
        Ok(count)
    }

    /// Takes the points of a cloud out that don't stay. Returns how many. O(points).
    ///
    /// # Errors
    /// A mask of another number of marks than points. [`base::Error::Cancelled`].
    pub fn of_cloud(&self, cloud: &mut PointCloud, progress: &Progress<'_>) -> Result<usize> {
        if let Region::Mask(mask) = &self.region {
            mask.fits_list(cloud.positions.len(), "points")?;
        }
        let stay = self.staying(&cloud.positions, cloud.world_from_cloud, progress)?;
        let gone = cloud.positions.len() - stay.len();
        if gone > 0 {
            cloud.positions = picked(&cloud.positions, &stay);
            cloud.normals = cloud.normals.as_ref().map(|all| picked(all, &stay));
            cloud.colour = cloud.colour.as_ref().map(|all| picked(all, &stay));
            cloud.intensity = cloud.intensity.as_ref().map(|all| picked(all, &stay));
        }
        Ok(gone)
    }

    /// Takes the vertices of a mesh out that don't stay, and the faces at them. Returns how many vertices. Others keep their order, their
    /// attributes and those of their faces. O(vertices + faces).
    ///
    /// # Errors
    /// A mask of another number of marks than vertices. A mesh that is not valid. [`base::Error::Cancelled`].
    pub fn of_mesh(&self, mesh: &mut TriMesh, world_from_mesh: DAffine3, progress: &Progress<'_>) -> Result<usize> {
        if let Region::Mask(mask) = &self.region {
            mask.fits_list(mesh.positions.len(), "vertices")?;
        }
        mesh.validate()?;
        let stay = self.staying(&mesh.positions, world_from_mesh, progress)?;
        let gone = mesh.positions.len() - stay.len();
        if gone == 0 {
            return Ok(0);
        }
        const GONE: u32 = u32::MAX;
        let mut number = vec![GONE; mesh.positions.len()];
        for (new, &old) in stay.iter().enumerate() {
            number[old] = new as u32;
        }
        let mut faces = Vec::new();
        let mut pace = Pace::new(progress);
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            pace.after(1)?;
            if triangle.iter().all(|&v| number[v as usize] != GONE) {
                faces.push(face);
            }
        }
        mesh.positions = picked(&mesh.positions, &stay);
        mesh.triangles = faces.iter().map(|&face| mesh.triangles[face].map(|v| number[v as usize])).collect();
        mesh.vertex_attributes.iter_mut().for_each(|attribute| *attribute = attribute.gather(&stay));
        mesh.face_attributes.iter_mut().for_each(|attribute| *attribute = attribute.gather(&faces));
        Ok(gone)
    }

    /// The points that stay, ascending.
    fn staying(&self, points: &[DVec3], world_from_points: DAffine3, progress: &Progress<'_>) -> Result<Vec<usize>> {
        memory::foresee(points.len(), A_SAMPLE, "selecting", "points")?;
        let mut stay = Vec::new();
        for block in progress.ranges(points.len()) {
            let holds = |k: &usize| self.region.holds(*k, world_from_points.transform_point3(points[*k])) == self.keep;
            stay.extend(block?.filter(holds));
        }
        Ok(stay)
    }
}

fn picked<T: Copy>(all: &[T], places: &[usize]) -> Vec<T> {
    places.iter().map(|&k| all[k]).collect()
}
