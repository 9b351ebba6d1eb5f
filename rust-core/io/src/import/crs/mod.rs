//! The coordinate reference system that a file names, looked up in headers alone.
//!
//! | file | what |
//! |---|---|
//! | `las` | records of LAS |
//! | `said` | provenance in our own PLY, OBJ, glTF and E57 |
//!
//! If a file names none, and is no depth image, a file of its name with the ending `.prj` beside it is asked, which holds well-known text.
//! A damaged file names none: its reader says what is wrong. If something can't be taken for the text of a system, that is told, also of
//! such a file.

mod las;
mod said;

use std::io::Read;
use std::path::Path;

use ::e57::E57Reader;
use mesh::Crs;
use mesh::crs::LONGEST;

use self::said::understood;
use super::file::watched;
use super::geo_keys::NamedCrs;
use super::raster::tiff;
use super::scan::FileScan;
use super::{e57, file};
use crate::export::Provenance;
use base::error::{Error, Result};

/// Bytes that tell a format.
const START: usize = 64;

/// The system that the file of a scan names, or the file beside it.
///
/// # Errors
/// [`Error::Io`]. [`Error::Format`] for what can't be taken for the text of a system.
pub(super) fn of_file(scan: &FileScan) -> Result<Option<Crs>> {
    let own = named(&scan.path, own(scan)?)?;
    if own.is_some() || scan.options.camera.is_some() { Ok(own) } else { beside(&scan.path) }
}

fn named(path: &Path, named: NamedCrs) -> Result<Option<Crs>> {
    named.map_err(|problem| Error::format(path, "coordinate reference system", problem))
}

fn own(scan: &FileScan) -> Result<NamedCrs> {
    let path = &scan.path;
    let (start, _) = file::read_start(path, START)?;
    if start.starts_with(b"LASF") {
        let (mut file, length) = file::open(path)?;
        return watched(&mut file, path, |mut input| Ok(las::named(&mut input, length).unwrap_or(Ok(None))));
    }
    if e57::sniff(&start) {
        return watched(&mut file::open(path)?.0, path, |input| {
            let Ok(reader) = E57Reader::new(input) else { return Ok(Ok(None)) };
            let text = reader.coordinate_metadata().filter(|text| !text.trim().is_empty());
            // Its coordinates are metres, whatever system they are said to be in.
            Ok(text.map(|text| understood(text).map(|crs| crs.with_degrees(false))).transpose())
        });
    }
    if tiff::sniff(&start) {
        return if scan.options.camera.is_some() { Ok(Ok(None)) } else { tiff::named(scan) };
    }
    Ok(said::of_file(path, &start)?.crs())
}

/// The system that a `.prj` beside a file names. Other programs have projects of that ending: of those it is told that they are none.
fn beside(path: &Path) -> Result<Option<Crs>> {
    let path = path.with_extension("prj");
    if !file::is_file(&path) {
        return Ok(None);
    }
    let mut bytes = Vec::new();
    let (file, _) = file::open(&path)?;
    file.take(LONGEST as u64 + 1).read_to_end(&mut bytes).map_err(|error| Error::io(&path, error))?;
    let text = String::from_utf8_lossy(&bytes);
    if !Crs::is_well_known_text(&text) {
        let problem = "expected well-known text, without which the coordinates are in no known system";
        return named(&path, Err(problem.to_owned()));
    }
    named(&path, understood(&text).map(Some))
}

/// Provenance that a file of this library tells: of PLY, OBJ, glTF and E57. `None` if it tells nothing.
///
/// # Errors
/// [`Error::Io`]. [`Error::Input`] for a file that can't be opened.
pub fn provenance(path: &Path) -> Result<Option<Provenance>> {
    let (start, _) = file::read_start(path, START)?;
    Ok(said::of_file(path, &start)?.provenance.map(Provenance::from))
}

#[cfg(test)]
mod tests;
