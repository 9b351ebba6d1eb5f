//! Editing a scan: selections and true size noted, and made when it is read.

use glam::DAffine3;

use super::edits::{Edit, Placed};
use super::scan::{Content, FileScan};
use base::error::Result;
use base::progress::Progress;
use image::select::{Selection, Similarity, scale_cloud, scale_image, scale_mesh};

impl FileScan {
    /// Keeps or removes samples, whenever the scan is read from now on. The region is of the world as the scan lies in it now. A scan that
    /// is placed elsewhere afterwards takes its selections along. Of what was selected before what is left counts.
    pub fn select(&mut self, selection: Selection) {
        let placed = Placed { selection, world_from_sensor: self.world_from_sensor };
        self.edits.0.push(Edit::Select(placed.into()));
    }

    /// Gives the scan another size and place: its pose now, its samples whenever it is read from now on. Then it lies in no coordinate
    /// reference system any more.
    ///
    /// # Errors
    /// A place that becomes too large.
    pub fn transform(&mut self, similarity: &Similarity) -> Result<()> {
        self.world_from_sensor = similarity.of_pose(self.world_from_sensor).map_err(|error| self.says(error))?;
        if *similarity != Similarity::IDENTITY {
            self.set_crs(None);
        }
        if similarity.scale() != 1.0 {
            self.edits.0.push(Edit::Scale(similarity.scale()));
        }
        Ok(())
    }

    /// Factor of the samples of the file: 1 unless the scan was given another size.
    pub fn scale(&self) -> f64 {
        self.edits.0.iter().fold(1.0, |all, edit| if let Edit::Scale(scale) = edit { all * scale } else { all })
    }

    /// The content that was read, as if the scan lay at the origin, with the edits made, placed.
    pub(super) fn edited(&self, mut content: Content, progress: &Progress<'_>) -> Result<Content> {
        // Images may be read with an offset of their own.
        let mut scan_from_samples = match &content {
            Content::RangeImage(image) => image.world_from_sensor,
            Content::Points(cloud) => cloud.world_from_cloud,
            Content::Mesh(_) => DAffine3::IDENTITY,
        };
        for edit in &self.edits.0 {
            let done = match edit {
                Edit::Select(placed) => {
                    let world_from_samples = placed.world_from_sensor * scan_from_samples;
                    selected(&mut content, &placed.selection, world_from_samples, progress)
                }
                Edit::Scale(scale) => {
                    scan_from_samples.translation *= *scale;
                    match &mut content {
                        Content::RangeImage(image) => scale_image(image, *scale),
                        Content::Mesh(mesh) => scale_mesh(mesh, *scale),
                        Content::Points(cloud) => scale_cloud(cloud, *scale),
                    }
                }
            };
            done.map_err(|error| self.says(error))?;
        }
        let world_from_samples = self.world_from_sensor * scan_from_samples;
        match &mut content {
            Content::RangeImage(image) => image.world_from_sensor = world_from_samples,
            Content::Points(cloud) => cloud.world_from_cloud = world_from_samples,
            Content::Mesh(_) => {}
        }
        Ok(content)
    }
}

fn selected(
    content: &mut Content,
    selection: &Selection,
    world_from_samples: DAffine3,
    progress: &Progress<'_>,
) -> Result<()> {
    match content {
        Content::RangeImage(image) => {
            image.world_from_sensor = world_from_samples;
            selection.of_image(image, progress)
        }
        Content::Mesh(mesh) => selection.of_mesh(mesh, world_from_samples, progress),
        Content::Points(cloud) => {
            cloud.world_from_cloud = world_from_samples;
            selection.of_cloud(cloud, progress)
        }
    }
    .map(drop)
}
