//! Reading scans: the registry of formats, and what a file or folder of scans opens as.

use std::path::{Path, PathBuf};

use glam::DAffine3;

use crate::error::{Error, Result};
use crate::merge::{OrientedSurface, ScanSource};
use crate::mesh::TriMesh;
use crate::point_cloud::PointCloud;
use crate::range_image::RangeImage;
use crate::triangulate::TriangulateParams;

/// Scans opened together: from one file, or from a side file that places several.
#[derive(Clone, Debug, Default)]
pub struct ScanSet {
    /// The scans, each loaded on demand.
    pub scans: Vec<Scan>,
    /// What a person should know about how the files were understood, for example the quaternion convention used.
    pub notes: Vec<String>,
}

/// One scan of a [`ScanSet`]: where it is and where it stands; its samples stay on disk until [`Scan::read`].
#[derive(Clone, Debug)]
pub struct Scan {
    /// Name for people, unique within the set.
    pub name: String,
    /// The file that holds the samples.
    pub path: PathBuf,
    /// Places the scan in the world.
    pub world_from_sensor: DAffine3,
}

/// What a scan turned out to hold.
#[derive(Clone, Debug)]
pub enum Content {
    /// A grid of samples, placed in the world.
    RangeImage(RangeImage),
    /// A triangle mesh in its own frame.
    Mesh(TriMesh),
    /// Points without connectivity.
    Points(PointCloud),
}

/// Opens a file: a single scan or a side file that places several (`.conf`).
///
/// # Errors
/// The file can't be read or its format isn't known.
pub fn open(path: &Path) -> Result<ScanSet> {
    Err(Error::format(path, "start of file", "unknown format"))
}

impl Scan {
    /// Reads the samples.
    ///
    /// # Errors
    /// The file can't be read or is damaged.
    pub fn read(&self) -> Result<Content> {
        Err(Error::format(&self.path, "start of file", "unknown format"))
    }
}

impl ScanSource for Scan {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, triangulation: &TriangulateParams) -> Result<OrientedSurface> {
        match self.read()? {
            Content::RangeImage(image) => OrientedSurface::from_range_image(&image, triangulation),
            Content::Mesh(mesh) => OrientedSurface::from_mesh(&mesh, self.world_from_sensor),
            Content::Points(_) => Err(Error::input(format!(
                "{}: holds points without a grid or triangles, which can't be merged; reconstruct a surface first",
                self.path.display()
            ))),
        }
    }
}
