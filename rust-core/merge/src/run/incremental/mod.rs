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
mod scans;
mod stages;
mod visibility;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::crossings::scan_order;
use crate::crossings::scan_order::ScanOrder;
use crate::intake::defaults;
use crate::intake::setup::Setup;
use crate::params::MergeParams;
use crate::report::Merged;
use crate::run::{if_it_fits, refuse_twins, run_by, started, surface};
use base::error::{Error, Result};
use base::memory::attempted;
use base::progress::Progress;
use image::source::ScanSource;
use image::triangulate::TriangulateParams;
use stages::Incremental;

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

/// Amount that a run had to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Renewed {
    /// Bricks that were labelled anew.
    pub bricks: usize,
    /// All bricks.
    pub of: usize,
}

/// Findings that a run leaves for the next.
#[derive(Default)]
struct Findings {
    triangulation: TriangulateParams,
    /// The hashes that break ties between scans of one name, by their versions.
    contents: FxHashMap<u64, u64>,
    known: defaults::Known,
    scans: scans::Scans,
    bundles: bundles::KeptBundles,
    visibility: visibility::VisibilityCache,
    bricks: bricks::Bricks,
}

impl Findings {
    /// The order of scans of so many versions.
    fn scan_order<'a>(
        &mut self,
        sources: &[&'a dyn ScanSource],
        versions: &[u64],
        progress: &Progress<'_>,
    ) -> Result<ScanOrder<'a>> {
        let found = std::sync::Mutex::new(std::mem::take(&mut self.contents));
        let known = || found.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let content = |place: usize| {
            let (scan, version) = (sources[place], versions[place]);
            let before = known().get(&version).copied();
            let content = before.map_or_else(|| scan.content(&self.triangulation, progress), Ok)?;
            known().insert(version, content);
            Ok(content)
        };
        let order = scan_order::in_order(sources, content, progress);
        self.contents = std::mem::take(&mut *known());
        Ok(ScanOrder::new(sources, versions, &order?))
    }

    /// Forgets the scans of other versions.
    fn forget_others(&mut self, versions: &[u64]) {
        let versions: FxHashSet<u64> = versions.iter().copied().collect();
        self.contents.retain(|version, _| versions.contains(version));
        self.known.keep(&versions);
        self.scans.keep(&versions);
    }
}

#[cfg(test)]
mod tests;
