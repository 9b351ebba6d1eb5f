//! Scans that are opened together.

use std::path::Path;
use std::sync::Arc;

use super::options::ReadOptions;
use super::scan::FileScan;
use base::error::Result;
use base::log::{self, Level};
use image::source::{ScanSource, common_crs};
use mesh::Crs;

/// Scans opened together: from one file, or from a side file that places several.
#[derive(Clone, Debug, Default)]
pub struct ScanSet {
    /// The scans, each loaded on demand.
    pub scans: Vec<FileScan>,
    /// Notes for people on how the files were understood, for example the quaternion convention used.
    pub notes: Vec<String>,
}

impl ScanSet {
    /// Tells the log its notes.
    pub fn tell(&self) {
        self.notes.iter().for_each(|note| log::tell(Level::Info, note));
    }

    /// The coordinate reference system that all scans which name one lie in.
    ///
    /// # Errors
    /// Scans of different systems, or in degrees. A file that can't be read.
    pub fn crs(&self) -> Result<Option<Crs>> {
        let sources: Vec<&dyn ScanSource> = self.scans.iter().map(|scan| scan as &dyn ScanSource).collect();
        common_crs(&sources)
    }
}

/// Opens the one scan of the file that a line of a list names. Takes the list, the line, the file, and the notes to add to.
pub(super) type OpenNamed = fn(&Path, usize, &Path, &Arc<ReadOptions>, &mut Vec<String>) -> Result<FileScan>;
