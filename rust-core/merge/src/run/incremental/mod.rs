//! A merge that is run again when its scans have changed: what it finds out it keeps, and what a changed scan has a part in it finds
//! out anew. Results are those of a merge of the same scans that knows nothing, to the bit.
//!
//! | kept | file | renewed where |
//! |---|---|---|
//! | spacing and noise of scans | `defaults` | the scan changed |
//! | crossings, by scan | `scans` | the scan changed |
//! | sums of crossings, by bundle | `bundles` | it has crossings of a changed scan |
//! | what scans see of these | `visibility` | the sums changed, and of changed scans everywhere |
//! | labels and vertices, by brick | `bricks` | the remaining sums changed in it or beside it |
//! | cells, by brick | `bricks` | labels changed in it or beside it |
//!
//! Whatever is measured of all scans together, the cell, the merge distance, how bright scans are, is measured anew. If it differs, so does
//! all that follows from it, everywhere.

mod bricks;
mod bundles;
mod findings;
mod scans;
mod stages;
mod visibility;

use crate::intake::setup::Setup;
use crate::params::MergeParams;
use crate::report::Merged;
use crate::run::memory::run_by;
use crate::run::started::{if_it_fits, refuse_twins, started, surface};
use base::error::{Error, Result};
use base::memory::attempted;
use base::progress::Progress;
use findings::Findings;
use image::source::ScanSource;
use stages::Incremental;

pub use bricks::Renewed;

/// A scan to merge, with a number for what it is: as long as the number is the same, so is the scan.
#[deprecated(since = "0.2.0", note = "`Reuse` takes the scans' versions")]
#[derive(Clone, Copy)]
pub struct Versioned<'a> {
    /// The scan.
    pub scan: &'a dyn ScanSource,
    /// No other scan of a list has it.
    pub version: u64,
}

/// Keeps what merges leave for the next one, which is faster by it: [`Reuse`](crate::Reuse) takes it.
///
/// Scans are loaded when they are new to it, and not again. It keeps about 125 bytes per intersection of a scan with the grid. Among it are
/// 11 bytes per pixel of images with lines of sight. At its peak it takes half as much again as a merge that keeps nothing.
#[derive(Default)]
pub struct Merger {
    kept: Option<Box<Findings>>,
}

impl Merger {
    /// The former name of [`merge`](crate::merge) with [`Reuse`](crate::Reuse).
    ///
    /// # Errors
    /// As [`merge`](crate::merge).
    #[deprecated(since = "0.2.0", note = "it is `merge`, with `Run::reuse`")]
    #[expect(deprecated, reason = "it takes what it took")]
    pub fn run(&mut self, scans: &[Versioned<'_>], params: &MergeParams, progress: &Progress<'_>) -> Result<Merged> {
        let (sources, versions) = apart(scans);
        self.run_by((&sources, &versions), params, &Setup::default(), progress)
    }

    /// The former name of [`merge`](crate::merge) with [`Reuse`](crate::Reuse) and [`Store::MemoryOrFiles`](crate::Store::MemoryOrFiles),
    /// which gives the surface where this gave `None`.
    ///
    /// # Errors
    /// As [`merge`](crate::merge).
    #[deprecated(since = "0.2.0", note = "it is `merge`, with `Run::reuse` and `Store::MemoryOrFiles`")]
    #[expect(deprecated, reason = "it takes what it took")]
    pub fn run_if_it_fits(
        &mut self,
        scans: &[Versioned<'_>],
        params: &MergeParams,
        memory: Option<u64>,
        progress: &Progress<'_>,
    ) -> Result<Option<Merged>> {
        let (sources, versions) = apart(scans);
        if_it_fits(memory, |setup| self.run_by((&sources, &versions), params, setup, progress))
    }

    /// Merges scans of so many versions. The result is the same as that of a merge that keeps nothing, but for the seconds and the working
    /// bytes in the report. After an error, or when it was cancelled, what was kept before stays. If memory holds the merge but not what
    /// would be kept, nothing is kept.
    pub(crate) fn run_by(
        &mut self,
        (scans, versions): (&[&dyn ScanSource], &[u64]),
        params: &MergeParams,
        setup: &Setup,
        progress: &Progress<'_>,
    ) -> Result<Merged> {
        refuse_twins(scans.len(), versions)?;
        // If a refused allocation ends the work, nothing is kept.
        let mut kept = self.kept.take().unwrap_or_default();
        setup.fit.begin();
        let merged = attempted(|| {
            let work = || surface(&mut Incremental::new(&mut kept, (scans, versions), params, setup), params, progress);
            started(scans, params, progress, work)
        });
        match merged {
            Some(Err(Error::OutOfMemory(_))) | None => {}
            Some(merged) => {
                self.kept = Some(kept);
                return merged;
            }
        }
        // Cells that memory chooses must not depend on what is kept.
        drop(kept);
        run_by(scans, params, setup, progress)
    }

    /// Of how many bricks of space that scans speak of, what was known before the last run did not tell all.
    pub fn renewed(&self) -> Renewed {
        self.kept.as_ref().map_or_else(Renewed::default, |kept| kept.bricks.renewed)
    }

    /// Gives back what is kept: the next run finds out everything.
    pub fn forget(&mut self) {
        self.kept = None;
    }
}

/// Scans, and their versions.
#[expect(deprecated, reason = "of those who still give both in one")]
fn apart<'a>(scans: &[Versioned<'a>]) -> (Vec<&'a dyn ScanSource>, Vec<u64>) {
    scans.iter().map(|scan| (scan.scan, scan.version)).unzip()
}

#[cfg(test)]
mod tests;
