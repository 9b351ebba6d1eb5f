//! One scan of a set: where it is.

use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use glam::{DAffine3, DVec3};

use super::edits::Edits;
use super::options::ReadOptions;
use crate::memory_folder::MemoryFolder;
use base::error::{Error, Result};
use base::progress::Progress;
use image::frame::{ColourImage, ConfidenceImage, Frame};
use image::range_image::RangeImage;
use mesh::point_cloud::PointCloud;
use mesh::{Crs, TriMesh};

/// One scan of a [`ScanSet`](super::ScanSet): its file and its pose. Its samples stay on disk until [`FileScan::read`].
#[derive(Clone, Debug)]
pub struct FileScan {
    /// Name for people, unique within the set.
    pub name: String,
    /// The file that holds the samples.
    pub path: PathBuf,
    /// The scan of the file, counted from 0.
    pub part: usize,
    /// Places the scan in the world.
    pub world_from_sensor: DAffine3,
    /// Facts that the file doesn't say itself.
    pub options: Arc<ReadOptions>,
    /// Beginning of the part, for formats whose parts lie one after the other.
    pub(crate) begin: Begin,
    /// Name among the scans of its file, where `name` is another one.
    pub(crate) within: Option<String>,
    /// The recording that it is a frame of.
    pub(crate) recording: Option<Arc<dyn Frames>>,
    /// The path under which that was opened.
    pub(crate) opened: Option<Arc<Path>>,
    /// Edits of its samples after they are read.
    pub(crate) edits: Edits,
    /// Whether it is one of many, which go on without it if its file is damaged.
    pub(crate) of_many: bool,
    /// Damage of its file, which reading it with others has met.
    pub(crate) damage: Arc<OnceLock<String>>,
    /// Reason why nobody can tell whether its numbers are heights or depths.
    pub(crate) doubt: Option<Arc<str>>,
    /// Whether it was taken out of the system that its file names.
    pub(crate) left_crs: bool,
    /// The folder in memory that it lies in: stays there as long as the scan.
    pub(crate) _memory: Option<MemoryFolder>,
}

/// The recording that a scan is a frame of. Frames are known by their place in it.
pub(crate) trait Frames: Debug + Send + Sync {
    /// Whether frames have an order in time.
    fn is_in_time(&self) -> bool;

    /// Direction of up in a frame, of length 1, where the recorder measured gravity.
    fn up(&self, index: usize) -> Option<DVec3>;

    /// Number that tells whether a frame is listed as it was: of its files, its cameras, its pose and how its depths are stored.
    fn print_of(&self, index: usize) -> Option<u64>;

    /// Reads a frame.
    ///
    /// # Errors
    /// A file of it can't be read or is damaged. Cancelled.
    fn frame(
        &self,
        index: usize,
        world_from_sensor: DAffine3,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Frame>;

    /// Reads the parts of a frame that are not damaged, and keeps what was damaged.
    ///
    /// # Errors
    /// A file of it can't be read. Cancelled.
    fn undamaged_parts(
        &self,
        index: usize,
        world_from_sensor: DAffine3,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Frame>;

    /// Damage of a frame that reading it has met.
    fn damage(&self, index: usize) -> Option<String>;

    /// About so many points of a frame, in its own frame.
    ///
    /// # Errors
    /// As [`Frames::frame`].
    fn preview(&self, index: usize, count: usize, options: &Arc<ReadOptions>) -> Result<Vec<DVec3>>;

    /// Reads the confidences of a frame.
    ///
    /// # Errors
    /// As [`Frames::frame`].
    fn confidence(
        &self,
        index: usize,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Option<ConfidenceImage>>;

    /// Whether a frame has a colour image.
    fn has_colour(&self, index: usize) -> bool;

    /// Reads the colours of a frame.
    ///
    /// # Errors
    /// As [`Frames::frame`].
    fn colour(&self, index: usize, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<Option<ColourImage>>;
}

/// A place in a file of text.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Begin {
    pub(crate) byte: u64,
    /// Lines before it.
    pub(crate) line: u64,
}

/// Content that a scan turned out to hold.
#[derive(Clone, Debug)]
pub enum Content {
    /// A grid of samples, placed in the world.
    RangeImage(RangeImage),
    /// A triangle mesh in its own frame.
    Mesh(TriMesh),
    /// Points without connectivity.
    Points(PointCloud),
}

impl FileScan {
    /// The only scan of a file, where the file's own frame is the world. Named like the file.
    pub fn new(path: &Path) -> Self {
        FileScan {
            name: path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned(),
            path: path.to_owned(),
            part: 0,
            world_from_sensor: DAffine3::IDENTITY,
            options: Arc::default(),
            begin: Begin::default(),
            within: None,
            recording: None,
            opened: None,
            edits: Edits::default(),
            of_many: false,
            damage: Arc::default(),
            doubt: None,
            left_crs: false,
            _memory: MemoryFolder::of(path),
        }
    }

    /// The only scan of a file that is understood as `options` say.
    pub(super) fn with(path: &Path, options: &Arc<ReadOptions>) -> Self {
        FileScan { options: options.clone(), ..FileScan::new(path) }
    }

    /// Says which coordinate reference system it lies in, whatever its file names.
    pub fn set_crs(&mut self, crs: Option<Crs>) {
        self.left_crs = crs.is_none();
        Arc::make_mut(&mut self.options).crs = crs;
    }

    /// Its name among the scans of its file, whatever else is opened with it.
    pub fn own_name(&self) -> &str {
        self.within.as_deref().unwrap_or(&self.name)
    }

    /// Whether it is a frame of a recording.
    pub fn is_frame(&self) -> bool {
        self.recording.is_some()
    }

    /// Whether it is a frame with a colour image, which is not read.
    pub fn has_colour(&self) -> bool {
        self.recording.as_ref().is_some_and(|recording| recording.has_colour(self.part))
    }

    /// Names the scan in an error.
    pub(super) fn says(&self, error: Error) -> Error {
        match error {
            Error::Input(text) => Error::Input(format!("{}: {text}", self.name)),
            other => other,
        }
    }

    /// The ending of its file's name, in small letters.
    pub(super) fn ending(&self) -> String {
        self.path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase()
    }

    /// Whether it is left out if it is damaged, where many are read: a frame, an image of a depth camera, one of a folder.
    pub fn is_one_of_many(&self) -> bool {
        self.of_many || self.is_frame() || self.is_depth_image()
    }

    /// Whether it is an image that the caller gave a camera.
    pub fn is_depth_image(&self) -> bool {
        self.options.camera.is_some() && IMAGES.contains(&&self.ending()[..])
    }
}

/// Endings of images.
const IMAGES: [&str; 7] = ["exr", "npy", "pfm", "pgm", "png", "tif", "tiff"];
