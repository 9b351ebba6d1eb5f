//! The samples of an image as points.

use base::error::Result;
use base::magnitude;
use base::progress::Progress;
use mesh::point_cloud::PointCloud;

use super::{RangeImage, normals, samples, spacing};

base::stages! {
    PLAN:
    SAMPLES = "finding neighbours", 0.5;
    NORMALS = "finding normals", 0.5;
}

impl RangeImage {
    /// The valid pixels as a cloud, in the sensor's frame and placed in the world by the image's pose, with normals
    /// (zero where a pixel has too few neighbours), colours, and the sensor where rays fan out from one.
    ///
    /// # Errors
    /// An attribute of the wrong length, more than 2^32 - 2 pixels, or a coordinate larger than [`magnitude::LARGEST`].
    /// [`base::Error::Cancelled`].
    pub fn to_point_cloud(&self, progress: &Progress<'_>) -> Result<PointCloud> {
        self.validate()?;
        progress.plan(PLAN);
        progress.watch(|| self.points_and_normals(progress))
    }

    fn points_and_normals(&self, progress: &Progress<'_>) -> Result<PointCloud> {
        progress.stage(SAMPLES, 1);
        let grid = samples::SampleGrid::new(self, progress)?;
        magnitude::points("sample", &grid.positions)?;
        let spacing = spacing::Spacing::of(self, &grid, progress)?;
        let limit = spacing::EdgeLimit::from_data(self, &grid, spacing, progress)?;
        progress.stage(NORMALS, grid.len() as u64);
        let mut normals = Vec::with_capacity(grid.len());
        for range in progress.ranges(grid.len()) {
            let range = range?;
            progress.reach(range.end as u64);
            normals.extend(range.map(|k| normals::sample_normal(self, &grid, &limit, k).as_vec3().to_array()));
        }
        Ok(PointCloud {
            normals: Some(normals),
            colour: self.colour.as_ref().map(|c| grid.pixels.iter().map(|&p| c[p as usize]).collect()),
            intensity: self.intensity.as_ref().map(|v| grid.pixels.iter().map(|&p| v[p as usize]).collect()),
            positions: grid.positions,
            sensor: self.projection().eye(),
            world_from_cloud: self.world_from_sensor,
            crs: self.crs.clone(),
        })
    }
}
