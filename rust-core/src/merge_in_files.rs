//! The former names of merges in files into a surface in memory.
#![expect(deprecated, reason = "they take what they took")]

use std::path::PathBuf;

use base::error::Result;
use base::progress::Progress;
use merge::incremental::{Merger, Versioned};
use merge::{MergeParams, Merged, Reuse, Run, ScanSource, Store};

/// The former name of [`merge::Store`] and of the memory of [`merge::Run`].
#[deprecated(since = "0.2.0", note = "`merge::Run` says it")]
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InFiles {
    /// As [`Run::memory`].
    pub max_memory: Option<u64>,
    /// As of [`Store::Files`].
    pub workspace: Option<PathBuf>,
    /// Whether it is [`Store::MemoryOrFiles`].
    pub only_if_needed: bool,
}

/// The former name of [`merge::merge()`] with [`Store::Files`] or [`Store::MemoryOrFiles`].
///
/// # Errors
/// As [`merge::merge()`].
#[deprecated(since = "0.2.0", note = "it is called `merge::merge`, with `Store::Files` or `Store::MemoryOrFiles`")]
pub fn merge_in_files(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    files: &InFiles,
    progress: &Progress<'_>,
) -> Result<Merged> {
    merge::merge(sources, params, run_of(files, None), progress)
}

/// The former name of [`merge::merge()`] with [`Store::MemoryOrFiles`] and [`Reuse`].
///
/// # Errors
/// As [`merge::merge()`].
#[deprecated(since = "0.2.0", note = "it is called `merge::merge`, with `Store::MemoryOrFiles` and `Run::reuse`")]
pub fn merge_again_in_files(
    merger: &mut Merger,
    scans: &[Versioned<'_>],
    params: &MergeParams,
    files: &InFiles,
    progress: &Progress<'_>,
) -> Result<Merged> {
    let (sources, versions): (Vec<&dyn ScanSource>, Vec<u64>) =
        scans.iter().map(|scan| (scan.scan, scan.version)).unzip();
    let files = InFiles { only_if_needed: true, ..files.clone() };
    let reuse = Some(Reuse { merger, versions: &versions });
    merge::merge(&sources, params, run_of(&files, reuse), progress)
}

fn run_of<'a>(files: &InFiles, reuse: Option<Reuse<'a>>) -> Run<'a> {
    let workspace = files.workspace.clone();
    let store = if files.only_if_needed { Store::MemoryOrFiles { workspace } } else { Store::Files { workspace } };
    Run { store, memory: files.max_memory, reuse }
}
