//! More scans than memory holds, merged in files into a surface that it does hold.

use std::path::{Path, PathBuf};

use base::error::{Error, Result};
use base::memory::{attempted, available, limit_of_calls, size};
use base::progress::Progress;
use base::{fewer_threads, threads};
use merge::incremental::{Merger, Versioned};
use merge::out_of_core::{LEAST, Workspace};
use merge::{MergeParams, Merged, ScanSource};
use mesh::TriMesh;

/// Taken where neither a limit nor the system says what memory there is.
const UNKNOWN: u64 = 2 << 30;

/// Where a merge works that keeps in files what its stages leave for each other, and when it does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InFiles {
    /// Most bytes of memory that are taken, beside scans that are being read and the surface; by default, and at most, what the limit
    /// allows or what is free.
    pub max_memory: Option<u64>,
    /// A folder that exists, for what memory does not hold, which is removed at the end; by default the system's for temporary files.
    pub workspace: Option<PathBuf>,
    /// Works in memory as long as cells fit that are as large as given or measured.
    pub only_if_needed: bool,
}

/// Merges scans, of which there may be more than memory holds, into a surface that it does hold: the same, to the bit, as [`merge::run`]
/// gives where there is memory enough. [`MergeReport::in_files`](merge::MergeReport::in_files) says which way it went.
///
/// The folder for what memory does not hold needs room: up to 200 bytes for each intersection of a scan with the grid. A folder that is
/// itself in memory, as some systems have it for temporary files, gains nothing.
///
/// With `only_if_needed` the work begins in memory, and begins anew in files once it is foreseen, or found, that the cells as given or
/// measured do not fit: so long that took in vain. Where files do not do either, cells that were not given are larger, as [`merge::run`]
/// makes them.
///
/// # Errors
/// As [`merge::run`]; a workspace that is no folder; too little memory, with the least that does, or not enough for the surface; files that
/// can't be written. Nothing is left in the workspace.
pub fn merge_in_files(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    files: &InFiles,
    progress: &Progress<'_>,
) -> Result<Merged> {
    if !files.only_if_needed {
        return in_files(sources, params, files, progress);
    }
    let in_memory = || merge::run_if_it_fits(sources, params, files.max_memory, progress);
    where_it_fits(sources, params, files, progress, in_memory)
}

/// As [`merge_in_files`], only if needed, of scans that were merged before: as long as memory holds what `merger` keeps, too, only what
/// changed is found out anew; else the merger forgets what it kept.
///
/// # Errors
/// As [`merge_in_files`]; two scans of one version.
pub fn merge_again_in_files(
    merger: &mut Merger,
    scans: &[Versioned<'_>],
    params: &MergeParams,
    files: &InFiles,
    progress: &Progress<'_>,
) -> Result<Merged> {
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan.scan).collect();
    let in_memory = || merger.run_if_it_fits(scans, params, files.max_memory, progress);
    where_it_fits(&sources, params, files, progress, in_memory)
}

/// What `in_memory` gives; else the merge in files, else one in cells that fit.
fn where_it_fits(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    files: &InFiles,
    progress: &Progress<'_>,
    in_memory: impl FnOnce() -> Result<Option<Merged>>,
) -> Result<Merged> {
    let in_files = || in_files(sources, params, files, progress);
    let may_be_larger = params.voxel.is_none();
    match attempted(in_memory) {
        Some(Ok(Some(merged))) => return Ok(merged),
        Some(Ok(None)) | None if !may_be_larger => return in_files(),
        Some(Ok(None)) | None => match attempted(in_files) {
            Some(Err(Error::OutOfMemory(_) | Error::Io { .. })) | None => {}
            Some(found) => return found,
        },
        Some(Err(Error::OutOfMemory(_))) if may_be_larger => {}
        Some(Err(error)) => return Err(error),
    }
    merge::run_within(sources, params, files.max_memory, progress)
}

fn in_files(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    files: &InFiles,
    progress: &Progress<'_>,
) -> Result<Merged> {
    params.validate()?;
    let temporary = std::env::temp_dir();
    let folder = existing(files.workspace.as_deref().unwrap_or(&temporary))?;
    let memory = memory(files.max_memory, 1, "in files")?;
    // Whether it can be done must not depend on the threads there are: elsewhere cells are larger.
    let most = (memory / LEAST) as usize;
    let merge = |threads| {
        let threads = threads::pool(threads)?.current_num_threads().min(most);
        let params = &MergeParams { threads, ..*params };
        let mut mesh = TriMesh::default();
        let workspace = Workspace { folder, memory, kept: None };
        let mut report = merge::out_of_core::run(sources, params, workspace, &mut mesh, progress)?;
        report.in_files = true;
        Ok(Merged { mesh, report })
    };
    fewer_threads::where_memory_is_short(params.threads, || true, merge)
}

/// A folder to work in.
pub fn existing(folder: &Path) -> Result<&Path> {
    if !folder.is_dir() {
        return Err(Error::input(format!("{}: the workspace must be a folder that exists", folder.display())));
    }
    Ok(folder)
}

/// Bytes to work with for so many threads; `how` says where.
pub fn memory(most: Option<u64>, workers: usize, how: &str) -> Result<u64> {
    let (left, known) = available();
    let there = match limit_of_calls() {
        // What is taken at the moment is chance.
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
            "merging {how} needs {least} at least, {each} for each of {workers} threads, {memory} are {known}; \
             allow more, or fewer threads"
        )));
    }
    Ok(memory)
}
