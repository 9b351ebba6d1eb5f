//! VRIP's `.conf`, as the Stanford archive writes it.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use glam::{DAffine3, DMat3, DQuat};

use super::atomic::write_atomically;
use crate::error::{Error, Result};

/// How far a pose may be from a rigid one.
const RIGID: f64 = 1e-6;

/// A scan file and its place, for [`write_conf`].
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedFile {
    /// Name of the file, relative to the folder of the list.
    pub file: String,
    /// Places what the file holds in the world; a rotation and a translation.
    pub world_from_file: DAffine3,
}

/// Writes a list of placed scans. Quaternions have the order x y z w and rotate world to scan, as in the Stanford
/// archive.
///
/// # Errors
/// A name that the format can't hold, a pose that isn't rigid; [`Error::Io`].
pub fn write_conf(path: &Path, scans: &[PlacedFile]) -> Result<()> {
    let mut text = "camera 0 0 0 0 0 0 1\n".to_owned();
    for scan in scans {
        let name = &scan.file;
        if name.is_empty() || name.trim() != name || name.contains(['\n', '\r', '\0']) {
            let remedy = "a list can't hold a name that is empty, starts or ends with a blank or spans lines";
            return Err(Error::input(format!("scan {name:?}: {remedy}")));
        }
        let rotation = scan.world_from_file.matrix3;
        let t = scan.world_from_file.translation;
        if !(rotation * rotation.transpose()).abs_diff_eq(DMat3::IDENTITY, RIGID)
            || rotation.determinant() < 0.0
            || !t.is_finite()
        {
            return Err(Error::input(format!("scan {name}: its pose is not a rotation and a translation")));
        }
        let q = DQuat::from_mat3(&rotation).normalize().conjugate();
        // Nothing can fail: it is written to memory.
        let _ = writeln!(text, "bmesh {name} {} {} {} {} {} {} {}", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    write_atomically(path, |file| file.write_all(text.as_bytes()).map_err(|e| Error::io(path, e)))
}
