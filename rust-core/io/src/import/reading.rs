//! Reading a scan: by the registry, or as the frame of a recording.

use std::borrow::Cow;
use std::hash::{Hash as _, Hasher as _};
use std::path::Path;

use glam::{DAffine3, DVec3};
use rustc_hash::FxHasher;

use super::crs;
use super::edits::Edits;
use super::numbering::number_in;
use super::registry::{Role, format_of};
use super::scan::{Content, FileScan};
use base::error::{Error, Result, known_as};
use base::log::{self, Level};
use base::progress::Progress;
use image::frame::{Camera, ColourImage, ConfidenceImage, Frame};
use image::oriented::OrientedPoints;
use image::places::Places;
use image::range_image::RangeImage;
use image::select::scale_frame;
use image::source::{Decoded, Loading, Moment, OrientedSurface, PlacedCloud, PlacedMesh, ScanSource};
use image::triangulate::TriangulateParams;
use mesh::Crs;

impl FileScan {
    /// Reads the samples: those that are kept, in their true size.
    ///
    /// # Errors
    /// The file can't be read or is damaged. A mask that does not fit.
    pub fn read(&self) -> Result<Content> {
        self.read_with(&Progress::none())
    }

    /// As [`FileScan::read`]. `progress` counts the bytes of the file.
    ///
    /// # Errors
    /// As [`FileScan::read`]. [`Error::Cancelled`].
    pub fn read_with(&self, progress: &Progress<'_>) -> Result<Content> {
        self.read_as(Damage::Refused, progress)
    }

    fn read_as(&self, damage: Damage, progress: &Progress<'_>) -> Result<Content> {
        let mut content = if self.edits.is_empty() {
            self.whole(damage, progress)?
        } else {
            let local = FileScan { world_from_sensor: DAffine3::IDENTITY, edits: Edits::default(), ..self.clone() };
            self.edited(local.whole(damage, progress)?, progress)?
        };
        let crs = self.crs()?;
        match &mut content {
            Content::RangeImage(image) => image.crs = crs,
            Content::Points(cloud) => cloud.crs = crs,
            Content::Mesh(mesh) => mesh.crs = crs.filter(|_| self.world_from_sensor == DAffine3::IDENTITY),
        }
        Ok(content)
    }

    /// The coordinate reference system of the world that it lies in: what `ReadOptions::crs` or its file names. Looked up in
    /// headers each time.
    ///
    /// # Errors
    /// A file that can't be read.
    pub fn crs(&self) -> Result<Option<Crs>> {
        match self.named_crs() {
            // Said when it was opened.
            Err(Error::Format { .. }) => Ok(None),
            named => named,
        }
    }

    /// As [`FileScan::crs`]. A name that is no system is an error.
    pub(super) fn named_crs(&self) -> Result<Option<Crs>> {
        if self.left_crs {
            return Ok(None);
        }
        match &self.options.crs {
            Some(crs) => Ok(Some(crs.clone())),
            None if self.recording.is_some() => Ok(None),
            None => crs::of_file(self),
        }
    }

    /// Reads what the file holds. A frame's colours are looked up before anything is removed that may hide them from others.
    fn whole(&self, damage: Damage, progress: &Progress<'_>) -> Result<Content> {
        if let Some(frame) = self.recorded(damage, progress)? {
            return Ok(Content::RangeImage(frame.into_range_image(progress)?.0));
        }
        let Role::Scans { read, .. } = format_of(&self.path)?.role else { return Err(self.is_no_scan()) };
        progress.plan(&[("reading", 1.0)]);
        let outcome = progress.watch(|| read(self, progress));
        // A reader may take the end of reading for the end of the file.
        let read = match progress.check().and(outcome) {
            Err(error @ Error::Format { .. }) if damage == Damage::LeftOut && self.is_one_of_many() => {
                return self.nothing(&error);
            }
            other => other?,
        };
        match read {
            Content::Mesh(mesh) if mesh.triangles.is_empty() => {
                let problem = "the mesh has no triangles: export it with its faces, or as points";
                Err(Error::format(&self.path, "whole file", problem))
            }
            content => Ok(content),
        }
    }

    /// The image without a sample that stands for a scan that is damaged. The log is told once.
    fn nothing(&self, why: &Error) -> Result<Content> {
        let damage = format!("is skipped: {why}");
        if self.damage.set(damage.clone()).is_ok() {
            log::tell(Level::Warning, &format!("{} {damage}", self.name));
        }
        let camera = self.options.camera.unwrap_or_else(|| Camera::new([1.0; 2], [0.5; 2]));
        let [cols, rows] = camera.size.unwrap_or([1; 2]);
        let projection = camera.projection(self.options.depth);
        let mut image = RangeImage::from_values(rows, cols, vec![f64::NAN; rows * cols], projection)?;
        image.name = self.name.clone();
        Ok(Content::RangeImage(image))
    }

    /// The colour image of a frame, with its own camera. `None` if it has none, and for other scans.
    ///
    /// # Errors
    /// As [`FileScan::read_with`].
    pub fn colour(&self, progress: &Progress<'_>) -> Result<Option<ColourImage>> {
        let Some(recording) = &self.recording else { return Ok(None) };
        let mut image = progress.watch(|| recording.colour(self.part, &self.options, progress))?;
        if let Some(image) = &mut image {
            image.colour_from_depth.translation *= self.scale();
        }
        Ok(image)
    }

    /// Confidence of a frame's sensor in its depths. `None` if it does not say, and for other scans.
    ///
    /// # Errors
    /// As [`FileScan::read_with`].
    pub fn confidence(&self, progress: &Progress<'_>) -> Result<Option<ConfidenceImage>> {
        let Some(recording) = &self.recording else { return Ok(None) };
        progress.watch(|| recording.confidence(self.part, &self.options, progress))
    }

    /// The frame of a recording as it was recorded, nothing left out, in its true size. `None` for other scans.
    ///
    /// # Errors
    /// As [`FileScan::read_with`].
    pub fn frame(&self, progress: &Progress<'_>) -> Result<Option<Frame>> {
        let Some(mut frame) = self.recorded(Damage::Refused, progress)? else { return Ok(None) };
        scale_frame(&mut frame, self.scale()).map_err(|error| self.says(error))?;
        Ok(Some(frame))
    }

    fn recorded(&self, damage: Damage, progress: &Progress<'_>) -> Result<Option<Frame>> {
        let Some(recording) = &self.recording else { return Ok(None) };
        progress.plan(&[("reading", 1.0)]);
        progress.stage(0, 1);
        let (place, options) = (self.world_from_sensor, &self.options);
        let read = || match damage {
            Damage::Refused => recording.frame(self.part, place, options, progress),
            Damage::LeftOut => recording.undamaged_parts(self.part, place, options, progress),
        };
        let mut frame = progress.watch(read)?;
        frame.depth.name = self.name.clone();
        progress.advance(1)?;
        Ok(Some(frame))
    }

    /// About `count` of its points, spread over it, in its own frame. Cheaper than reading it where the format allows. Fewer if there are
    /// fewer.
    ///
    /// # Errors
    /// The file can't be read or is damaged.
    pub fn preview_points(&self, count: usize) -> Result<Vec<DVec3>> {
        if self.edits.leave_out() {
            let places = self.places(&Progress::none())?.positions;
            let step = places.len().div_ceil(count.max(1)).max(1);
            return Ok(places.into_iter().step_by(step).collect());
        }
        let mut points = self.recorded_points(count)?;
        points.iter_mut().for_each(|point| *point *= self.scale());
        Ok(points)
    }

    fn recorded_points(&self, count: usize) -> Result<Vec<DVec3>> {
        if let Some(recording) = &self.recording {
            return recording.preview(self.part, count, &self.options);
        }
        match format_of(&self.path)?.role {
            Role::Scans { preview, .. } => preview(self, count),
            _ => Err(self.is_no_scan()),
        }
    }

    fn is_no_scan(&self) -> Error {
        Error::input(format!("{}: this lists scans and isn't one itself, so open it instead", known_as(&self.path)))
    }
}

/// Treatment of damaged images of a frame, and of damaged scans of many.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Damage {
    /// They are an error.
    Refused,
    /// They are left out, and the log is told: of many frames one does not end the work.
    LeftOut,
}

impl image::source::Read for FileScan {
    fn as_source(&self) -> &dyn ScanSource {
        self
    }

    fn world_from_scan(&self) -> DAffine3 {
        self.world_from_sensor
    }
}

impl ScanSource for FileScan {
    fn name(&self) -> &str {
        &self.name
    }

    fn crs(&self) -> Result<Option<Crs>> {
        FileScan::crs(self)
    }

    fn file(&self) -> Option<&Path> {
        Some(&self.path)
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
        match self.decoded(progress)? {
            Some(decoded) => decoded.load(loading, progress),
            None => Err(Error::input(format!(
                "{}: this holds points without a grid or triangles, which are no surface, so reconstruct one first",
                known_as(&self.path)
            ))),
        }
    }

    fn decoded(&self, progress: &Progress<'_>) -> Result<Option<Decoded>> {
        Ok(match self.read_as(Damage::LeftOut, &progress.unseen())? {
            Content::RangeImage(image) => Some(Decoded::Image(image)),
            Content::Mesh(mesh) => Some(Decoded::Mesh(mesh, self.world_from_sensor)),
            Content::Points(_) => None,
        })
    }

    fn image(&self, progress: &Progress<'_>) -> Result<Option<Cow<'_, RangeImage>>> {
        match self.read_as(Damage::LeftOut, &progress.unseen())? {
            Content::RangeImage(image) => Ok(Some(Cow::Owned(image))),
            Content::Mesh(_) | Content::Points(_) => Ok(None),
        }
    }

    fn oriented_points(&self, progress: &Progress<'_>) -> Result<OrientedPoints> {
        let (name, place) = (self.name.clone(), self.world_from_sensor);
        if let Some(doubt) = &self.doubt {
            return Err(Error::input(doubt.as_ref()));
        }
        match self.read_as(Damage::LeftOut, &progress.unseen())? {
            Content::RangeImage(image) => image.oriented_points(progress),
            Content::Mesh(mesh) => PlacedMesh { name, mesh: &mesh, world_from_mesh: place }.oriented_points(progress),
            Content::Points(cloud) => {
                PlacedCloud { name, cloud: &cloud, world_from_cloud: place }.oriented_points(progress)
            }
        }
    }

    fn moment(&self) -> Option<Moment<'_>> {
        match &self.recording {
            Some(recording) => {
                recording.is_in_time().then_some(Moment { recording: self.opened.as_deref()?, at: self.part as f64 })
            }
            None => self.is_depth_image().then_some(Moment {
                recording: self.path.parent()?,
                at: number_in(self.path.file_stem()?.to_str()?)?.value,
            }),
        }
    }

    fn up(&self) -> Option<DVec3> {
        self.recording.as_ref()?.up(self.part)
    }

    fn damage(&self) -> Option<String> {
        match &self.recording {
            Some(recording) => recording.damage(self.part),
            None => self.damage.get().cloned(),
        }
    }

    fn places(&self, progress: &Progress<'_>) -> Result<Places> {
        match self.read_as(Damage::LeftOut, &progress.unseen())? {
            Content::RangeImage(image) => Places::of_image(&image, progress),
            Content::Mesh(mesh) => Places::of_mesh(&mesh, self.world_from_sensor).map_err(|error| self.says(error)),
            Content::Points(cloud) => Places::of_cloud(&cloud, self.world_from_sensor, progress),
        }
    }

    fn version(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> Result<u64> {
        let ending = self.ending();
        let is_all = self.recording.is_none() && self._memory.is_none() && self.edits.is_empty();
        if !is_all || !WHOLE.contains(&&ending[..]) {
            return self.content(triangulation, progress);
        }
        let failed = |error| Error::io(&self.path, error);
        let whole = std::path::absolute(&self.path).map_err(failed)?;
        let status = std::fs::metadata(&whole).map_err(failed)?;
        let mut hasher = FxHasher::default();
        (whole, status.len(), status.modified().ok(), self.part, &self.name, format!("{:?}", self.options))
            .hash(&mut hasher);
        self.world_from_sensor.to_cols_array().map(f64::to_bits).hash(&mut hasher);
        Ok(hasher.finish())
    }
}

/// Endings of files that have all of a scan but its pose: of others more files may tell what it is.
const WHOLE: [&str; 9] = ["e57", "npy", "pcd", "pfm", "pgm", "ply", "png", "ptx", "stl"];

#[cfg(test)]
mod tests {
    use std::path::PathBuf;
    use std::sync::Arc;

    use super::*;
    use crate::import::options::ReadOptions;
    use image::frame::Camera;

    #[test]
    fn depth_images_are_taken_in_the_order_of_their_numbers() {
        let at = |name: &str, camera: Option<Camera>| {
            let options = Arc::new(ReadOptions { camera, ..ReadOptions::default() });
            let scan = FileScan::with(Path::new(name), &options);
            scan.moment().map(|moment| (moment.recording.to_owned(), moment.at))
        };
        let camera = Some(Camera::new([1.0; 2], [0.5; 2]));
        let found = |folder: &str, at: f64| Some((PathBuf::from(folder), at));
        assert_eq!(at("a/depth_00012.png", camera), found("a", 12.0));
        assert_eq!(at("a/7.npy", camera), found("a", 7.0));
        assert_eq!(at("b/1305031453.374112.png", camera), found("b", 1_305_031_453.374_112));
        assert_eq!(at("b/frame-3.depth.PGM", camera), found("b", 3.0));
        for name in ["a/depth.png", "a/v1.2.3.png", "a/scan3.ply"] {
            assert_eq!(at(name, camera), None, "{name}");
        }
        assert_eq!(at("a/heights_00012.png", None), None);
    }
}
