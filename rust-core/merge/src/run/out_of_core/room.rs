//! Room in the workspace, foreseen before the work.

use std::path::Path;

use super::collect::Grid;
use super::setting::Setting;
use crate::intake::budget;
use base::error::{Error, Result, counted};
use base::log::{self, Level};
use base::memory::size;
use base::progress::Progress;
use image::source::{Loading, ScanSource};

/// Bytes that a crossing takes, at least and at most: fewer the more scans see the same. Measured 36 to 119, without the surface.
const BYTES_A_CROSSING: [f64; 2] = [30.0, 200.0];
/// Bytes from which on a person may want to know.
const MUCH: f64 = 1e9;
/// Of at least so many scans some are looked at ...
const MANY: usize = 32;
/// ... so many, beside the first.
const SOME: usize = 3;

/// Tells what room the merge will take, and refuses one whose least there is not.
///
/// # Errors
/// [`Error::Io`]: there is not that room. [`Error::OutOfMemory`]: a scan that is looked at is too large. A scan can't be loaded. Cancelled.
pub fn foresee(
    sources: &[&dyn ScanSource],
    loading: &Loading,
    first: &Grid,
    setting: &Setting<'_>,
    progress: &Progress<'_>,
) -> Result<()> {
    if !setting.has_all {
        return Ok(());
    }
    let folder = setting.folder;
    let mut seen = vec![first.crossings];
    if sources.len() >= MANY {
        for number in (1..=SOME).map(|k| k * (sources.len() - 1) / SOME) {
            let surface = sources[number].load(loading, progress)?;
            progress.check()?;
            setting.workers(surface.positions.len())?;
            seen.push(budget::crossings(&surface, loading.cell));
        }
    }
    let crossings = seen.iter().sum::<f64>() / seen.len() as f64 * sources.len() as f64;
    let [least, most] = BYTES_A_CROSSING.map(|bytes| bytes * crossings);
    // Two digits of it are known at best.
    let digits = 10_f64.powf(crossings.max(10.0).log10().floor() - 1.0);
    let text = format!(
        "{} and cells of {} have some {:.0} intersections, which take {} to {}",
        counted(sources.len() as u64, "scan", "scans"),
        loading.cell,
        (crossings / digits).round() * digits,
        size(least),
        size(most)
    );
    if least >= MUCH {
        log::tell(Level::Info, &format!("{}: {text}", folder.display()));
    }
    // Files of a merge that goes on need not be written again; if the system does not say what is free, writing will.
    let there = fs4::available_space(folder).map_or(f64::INFINITY, |bytes| bytes as f64) + taken(folder);
    if least <= there {
        return Ok(());
    }
    let text = format!("{text}, but {} are free: free some, choose another workspace, or larger cells", size(there));
    Err(Error::io(folder, std::io::Error::new(std::io::ErrorKind::StorageFull, text)))
}

/// Bytes of the files of a folder.
fn taken(folder: &Path) -> f64 {
    let files = folder.read_dir().into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|of| of.len() as f64).sum()
}
