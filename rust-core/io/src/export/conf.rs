//! VRIP's `.conf`, as the Stanford archive writes it.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use glam::{DAffine3, DMat3, DQuat};

use super::atomic::{Staged, StagedSet, stage};
use super::ply::{self, PlyOptions, range_grid_frame};
use super::{Holding, ending_for};
use crate::import::conf::SENSE;
use base::error::{Error, Result, known_as};
use base::progress::Progress;
use image::range_image::RangeImage;

/// Largest difference of a pose from a rigid one.
const RIGID: f64 = 1e-6;

/// A scan file and its place, for [`write_conf`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedFile {
    /// Name of the file, relative to the folder of the list.
    pub file: String,
    /// Places what the file holds in the world. A rotation and a translation.
    pub world_from_file: DAffine3,
}

/// Writes range images as a set that opens as one: each as a range grid named like it in the folder of `path`, and the
/// list that places them, last.
///
/// # Errors
/// A name that can't be a file's on every system, or is there twice but for its case. As
/// [`write_range_grid_ply`](super::write_range_grid_ply) and [`write_conf`]. The files get their names when all are written: then nothing
/// can fail but renaming, which leaves the list as it was.
pub fn write_scan_list(
    path: &Path,
    images: &[&RangeImage],
    options: impl Into<PlyOptions>,
    progress: &Progress<'_>,
) -> Result<()> {
    if ending_for(path, Holding::Images).ok() != Some("conf") {
        return Err(Error::input(format!("{}: the name must end in .conf", known_as(path))));
    }
    if images.is_empty() {
        return Err(Error::input("there is no range image to write"));
    }
    let options = options.into();
    let mut names = HashSet::new();
    if let Some(image) = images.iter().find(|i| !is_file_name(&i.name) || !names.insert(i.name.to_lowercase())) {
        let problem = "each image needs a name of its own that can be a file's: give it one (image.name = ...)";
        return Err(Error::input(format!("{:?}: {problem}", image.name)));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    ply::begin(progress, images.iter().map(|image| ply::elements_of(image)).sum());
    let mut placed = Vec::with_capacity(images.len());
    let mut written = StagedSet::default();
    for image in images {
        let file = format!("{}.ply", image.name);
        let world_from_file = image.world_from_sensor * range_grid_frame(image)?;
        written.add(ply::stage_grid(&folder.join(&file), image, &options, progress)?)?;
        placed.push(PlacedFile { file, world_from_file });
    }
    written.add(stage_conf(path, &placed)?)?;
    written.keep()
}

/// Whether a name is that of a file in the same folder, on any system.
fn is_file_name(name: &str) -> bool {
    let reserved = |c: char| c.is_control() || matches!(c, '/' | '\\' | ':' | '*' | '?' | '"' | '<' | '>' | '|');
    !name.is_empty() && name.trim() == name && !name.starts_with('.') && !name.contains(reserved)
}

/// Writes a list of placed scans. Quaternions have the order x y z w and rotate world to scan, as in the Stanford
/// archive.
///
/// # Errors
/// A name that the format can't hold, a pose that isn't rigid. [`Error::Io`].
pub fn write_conf(path: &Path, scans: &[PlacedFile]) -> Result<()> {
    stage_conf(path, scans)?.keep()
}

/// Refuses a name that a list can't hold, and a pose that isn't rigid.
pub(super) fn check_placed(scan: &PlacedFile) -> Result<()> {
    let name = &scan.file;
    if name.is_empty() || name.trim() != name || name.contains(['\n', '\r', '\0']) {
        let remedy = "a list can't hold a name that is empty, starts or ends with a blank or spans lines";
        return Err(Error::input(format!("scan {name:?}: {remedy}")));
    }
    check_pose(name, &scan.world_from_file)
}

/// Refuses a pose that isn't rigid.
pub(super) fn check_pose(name: &str, world_from_scan: &DAffine3) -> Result<()> {
    let rotation = world_from_scan.matrix3;
    if !(rotation * rotation.transpose()).abs_diff_eq(DMat3::IDENTITY, RIGID)
        || rotation.determinant() < 0.0
        || !world_from_scan.translation.is_finite()
    {
        return Err(Error::input(format!("scan {name}: its pose is not a rotation and a translation")));
    }
    Ok(())
}

fn stage_conf(path: &Path, scans: &[PlacedFile]) -> Result<Staged> {
    let mut text = format!("{SENSE}\ncamera 0 0 0 0 0 0 1\n");
    for scan in scans {
        check_placed(scan)?;
        let PlacedFile { file: name, world_from_file } = scan;
        let (rotation, t) = (world_from_file.matrix3, world_from_file.translation);
        let q = DQuat::from_mat3(&rotation).normalize().conjugate();
        // Nothing can fail: it is written to memory.
        let _ = writeln!(text, "bmesh {name} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    stage(path, &Progress::none(), |file| file.write_all(text.as_bytes()).map_err(|e| Error::io(path, e)))
}
