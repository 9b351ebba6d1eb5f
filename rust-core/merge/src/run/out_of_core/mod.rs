//! A merge of more scans than memory holds: the same stages with the same results, to the bit. But what they leave for each other is in
//! files of a workspace, and of the grid a few blocks are in memory at a time.
//!
//! Stages are cut into tasks (`stages`), which one process does one after the other, or several do at once. Their list, and what is made of
//! the surface once they are done, is that of all merges (`driver`).
//!
//! | stage | file | leaves |
//! |---|---|---|
//! | 1 | `collect` | crossings of some scans, added up, by block: `segments` |
//! | 3 | `blocks` | sums of all scans, by block |
//! | | `visibility` | of these what scans do not see through |
//! | 4 | `labels` | labels and vertices, by block |
//! | 5 to 7 | `tiles` | the surface, by block |

mod blocks;
mod collect;
mod files;
mod labels;
mod room;
mod segments;
mod setting;
mod stages;
mod tiles;
mod versions;
mod visibility;

use std::fs::{File, TryLockError};
use std::hash::{Hash as _, Hasher as _};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rustc_hash::FxHasher;

use crate::driver::{self, Out};
use crate::params::MergeParams;
use crate::report::MergeReport;
use crate::run::started::{refuse_twins, started};
use base::error::{Error, Result};
use base::memory::{available, limit_of_calls, size};
use base::progress::Progress;
use image::source::ScanSource;
use mesh::sink::MeshSink;
use setting::Setting;
use stages::Tasks;

pub use crate::driver::Stage;
pub use versions::versions;

/// Bytes of memory that a worker needs.
pub const LEAST: u64 = 12_000_000;
/// Taken where neither a limit nor the system says what memory there is.
const UNKNOWN: u64 = 2 << 30;

/// The place where a merge keeps what memory does not hold, and how much it may hold.
#[derive(Clone, Copy, Debug)]
pub struct Workspace<'a> {
    /// A folder that exists: what is kept there, in a folder of its own, is removed at the end.
    pub folder: &'a Path,
    /// Bytes of memory.
    pub memory: u64,
    /// Whether another merge may go on with what this one leaves.
    pub kept: Option<Keep<'a>>,
}

/// Parts of a merge that are kept for the next one with the same parameters.
#[derive(Clone, Copy, Debug)]
pub struct Keep<'a> {
    /// A number for each scan that no other scan has, and another one if the scan is another.
    pub versions: &'a [u64],
    /// Whether a merge that is done is kept as well, so that a scan more or less renews only what it has a part in. Else what a merge has
    /// left that was stopped.
    pub stays: bool,
}

/// Merges scans, of which there may be more than memory holds, into one surface, which is handed to `sink`: the same as [`crate::merge`]
/// gives.
///
/// # Errors
/// As [`crate::merge`]. Versions that are not one per scan. A file can't be written. Another merge with the same parameters is at work in
/// the folder. The sink's.
pub fn run(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    workspace: Workspace<'_>,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    started(sources, params, progress, || {
        let Some(Keep { versions, stays }) = workspace.kept else {
            let folder = tempfile::Builder::new().prefix("surfrecon-merge-").tempdir_in(workspace.folder);
            let folder = folder.map_err(|error| Error::io(workspace.folder, error))?;
            let setting = Setting::of(folder.path(), workspace.memory);
            return merge(Tasks { sources, versions: places(sources), params, setting, portions: 1 }, sink, progress);
        };
        refuse_twins(sources.len(), versions)?;
        let KeptFolder { path: folder, lock, is_new } = kept_folder(workspace.folder, params)?;
        let setting = Setting { stays, ..Setting::of(&folder, workspace.memory) };
        let planned = stages::plan_mark(&setting);
        let tasks = Tasks { sources, versions: versions.to_vec(), params, setting, portions: 1 };
        let merged = tasks.begin().and_then(|()| merge(tasks, sink, progress));
        if merged.is_err() && is_new && !planned.exists() {
            // Nobody has a use for it.
            drop(lock);
            let _ = std::fs::remove_dir_all(&folder);
            return merged;
        }
        let report = merged?;
        if !stays {
            std::fs::remove_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        }
        Ok(report)
    })
}

/// Numbers for scans that nobody has a number for.
fn places(sources: &[&dyn ScanSource]) -> Vec<u64> {
    (0..sources.len() as u64).collect()
}

/// A merge that processes do together, each the tasks that it is given.
#[derive(Clone, Copy, Debug)]
pub struct Together<'a> {
    /// A folder that exists, which all of them reach. Nothing else is in it.
    pub folder: &'a Path,
    /// Bytes of memory of each.
    pub memory: u64,
    /// Number of tasks of those stages that are cut into tasks.
    pub tasks: u32,
    /// Whether another merge in the folder may go on with what this one leaves, of which nothing is removed then. One at a time.
    pub kept: Option<Keep<'a>>,
    /// Whether all files of the merge are in the folder, so that its room has to do for them.
    pub has_all: bool,
}

impl<'a> Together<'a> {
    fn tasks(self, sources: &'a [&'a dyn ScanSource], params: &'a MergeParams) -> Tasks<'a> {
        let stays = self.kept.is_some_and(|kept| kept.stays);
        let setting = Setting { stays, has_all: self.has_all, ..Setting::of(self.folder, self.memory) };
        let versions = self.kept.map_or_else(|| places(sources), |kept| kept.versions.to_vec());
        Tasks { sources, versions, params, setting, portions: self.tasks }
    }

    fn check(self, scans: usize) -> Result<()> {
        self.kept.map_or(Ok(()), |kept| refuse_twins(scans, kept.versions))
    }
}

/// Does a task of a merge, unless it is done. All tasks of all stages before have to be done. Those of a stage may be done in any order, at
/// once, and twice.
///
/// # Errors
/// As [`crate::merge`]. There is no such task. One before is not done. A file can't be written.
pub fn run_task(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    together: Together<'_>,
    (stage, number): (Stage, u32),
    progress: &Progress<'_>,
) -> Result<()> {
    let count = stage.tasks(together.tasks);
    if number >= count {
        return Err(Error::input(format!("there is no task {number} of {}, which has only {count}", stage.name())));
    }
    together.check(sources.len())?;
    started(sources, params, progress, || {
        let mut tasks = together.tasks(sources, params);
        if together.kept.is_some() && stage == Stage::Plan {
            tasks.begin()?;
        }
        tasks.task(stage, number, progress)
    })
}

/// Hands the surface to `sink` once all tasks are done: the same as [`run`] gives. The folder stays as it is. Once the surface is in its
/// place, [`end`] tidies it up.
///
/// # Errors
/// As [`run_task`]. The sink's.
pub fn put_together(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    together: Together<'_>,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    together.check(sources.len())?;
    started(sources, params, progress, || {
        let mut tasks = together.tasks(sources, params);
        let room = tasks.setting.room();
        driver::finish(&mut tasks, params, Out { sink, room }, progress)
    })
}

/// Once the surface is in its place: a folder that is kept loses the marks of what is done, and what another merge has no use for.
///
/// # Errors
/// A file can't be read or removed.
pub fn end(sources: &[&dyn ScanSource], params: &MergeParams, together: Together<'_>) -> Result<()> {
    together.tasks(sources, params).end()
}

/// Returns a folder to work in.
///
/// # Errors
/// It is none.
pub fn existing(folder: &Path) -> Result<&Path> {
    if !folder.is_dir() {
        return Err(Error::input(format!("{}: the workspace must be a folder that exists", folder.display())));
    }
    Ok(folder)
}

/// Returns the bytes to work with, at most so many, for so many threads. `how` says where.
///
/// # Errors
/// Less than they need.
pub fn memory(most: Option<u64>, workers: usize, how: &str) -> Result<u64> {
    let (left, known) = available();
    let there = match limit_of_calls() {
        // The memory that is taken at the moment is chance.
        Some(limit) if known != "free" => limit,
        _ if left.is_finite() => left as u64,
        _ => UNKNOWN,
    };
    let (memory, known) = most.filter(|&most| most < there).map_or((there, known), |most| (most, "given"));
    let least = LEAST * workers as u64;
    if memory < least {
        let least = size(least as f64);
        let (each, memory) = (size(LEAST as f64), size(memory as f64));
        return Err(Error::OutOfMemory(format!(
            "merging {how} needs {least} at least, {each} for each of {workers} threads, {memory} are {known}: allow more, or fewer threads"
        )));
    }
    Ok(memory)
}

/// The folder of what merges leave for each other.
struct KeptFolder {
    path: PathBuf,
    /// File that nobody else has as long as it is held.
    lock: File,
    /// Whether it was not there before.
    is_new: bool,
}

fn kept_folder(folder: &Path, params: &MergeParams) -> Result<KeptFolder> {
    let mut hasher = FxHasher::default();
    // Of the threads nothing depends.
    let params = MergeParams { threads: 0, ..*params };
    format!("{params:?}").hash(&mut hasher);
    let folder = folder.join(format!("surfrecon-merge-{:016x}", hasher.finish()));
    let failed = |error| Error::io(&folder, error);
    let is_new = match std::fs::create_dir(&folder) {
        Ok(()) => true,
        Err(error) if error.kind() == ErrorKind::AlreadyExists => false,
        Err(error) => return Err(failed(error)),
    };
    let lock = File::create(folder.join("lock")).map_err(failed)?;
    match lock.try_lock() {
        Ok(()) => Ok(KeptFolder { path: folder, lock, is_new }),
        Err(TryLockError::WouldBlock) => Err(Error::input(format!(
            "{}: another merge is at work here: wait for it, or choose another workspace",
            folder.display()
        ))),
        Err(TryLockError::Error(error)) => Err(failed(error)),
    }
}

fn merge(mut tasks: Tasks<'_>, sink: &mut dyn MeshSink, progress: &Progress<'_>) -> Result<MergeReport> {
    let params = tasks.params;
    let room = tasks.setting.room();
    let report = driver::merge(&mut tasks, params, Out { sink, room }, progress)?;
    tasks.end()?;
    Ok(report)
}

#[cfg(test)]
mod tests;
