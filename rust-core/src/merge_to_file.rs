//! More scans than memory holds, merged straight into a file.

use std::path::{Path, PathBuf};

use base::error::{Error, Result};
use base::progress::Progress;
use io::export::{WriteOptions, check_file_in_pieces, write_mesh_in_pieces};
use io::memory_folder::MemoryFolder;
use merge::out_of_core::{self, Keep, Workspace, existing, versions};
use merge::{MergeParams, MergeReport, ScanSource};
use mesh::sink::MeshSink;

/// The place where a merge works whose surface goes into a file, and how the file is written.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IntoFile {
    /// Most bytes of memory that are taken. By default, and at most, what the limit allows or what is free.
    pub max_memory: Option<u64>,
    /// A folder that exists, for what memory does not hold, which is removed at the end. By default that of the file.
    pub workspace: Option<PathBuf>,
    /// Whether what the merge finds out stays in the workspace, which has to be given. The next merge with the same parameters that finds
    /// it there renews only what scans have a part in that are new, gone or others. It goes on where one was stopped. The scans are told
    /// apart by [`ScanSource::version`].
    pub keep: bool,
    /// Options of writing the file.
    pub write: WriteOptions,
}

/// Merges scans, of which there may be more than memory holds, into a PLY file: its bytes are those that [`merge::merge()`] and
/// [`write_mesh`](io::export::write_mesh) make. Neither the scans nor the surface are in memory at once.
///
/// The folder for what memory does not hold needs room: up to 200 bytes for each intersection of a scan with the grid.
///
/// # Errors
/// As [`merge::merge()`]. A name that does not end in .ply, or text as the encoding. A workspace that is no folder. Too little memory, with
/// the least that does. A scan is read from the file. Files that can't be written. Then neither file nor anything else is left, and a file
/// that was there is untouched.
pub fn merge_to_file(
    sources: &[&dyn ScanSource],
    path: &Path,
    params: &MergeParams,
    into: &IntoFile,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    params.validate()?;
    params.go_together()?;
    check_file_in_pieces(path, &into.write)?;
    refuse_what_is_read(sources, path)?;
    if into.keep && into.workspace.is_none() {
        return Err(Error::input("what is kept needs a workspace: give a folder"));
    }
    let folder = folder(path, into.workspace.as_deref())?;
    let memory = memory(into.max_memory, params.threads)?;
    let versions = if into.keep { versions(sources, params, progress)? } else { Vec::new() };
    let kept = into.keep.then_some(Keep { versions: &versions, stays: true });
    let workspace = Workspace { folder, memory, kept };
    let merge = |sink: &mut dyn MeshSink| out_of_core::run(sources, params, workspace, sink, progress);
    let report = write_mesh_in_pieces(path, &into.write, merge, progress)?;
    Ok(MergeReport { in_files: true, ..report })
}

/// Refuses a path whose file a scan is read from.
///
/// # Errors
/// It is.
pub fn refuse_what_is_read(sources: &[&dyn ScanSource], path: &Path) -> Result<()> {
    let Ok(there) = path.canonicalize() else { return Ok(()) };
    let is_there = |file: &Path| file.canonicalize().is_ok_and(|file| file == there);
    match sources.iter().find(|scan| scan.file().is_some_and(is_there)) {
        Some(scan) => {
            let (path, scan) = (path.display(), scan.name());
            Err(Error::input(format!("{path}: scan {scan} is read from it: give the output another name")))
        }
        None => Ok(()),
    }
}

/// The folder to work in.
fn folder<'a>(file: &'a Path, given: Option<&'a Path>) -> Result<&'a Path> {
    let Some(folder) = given else {
        if MemoryFolder::of(file).is_some() {
            let file = file.display();
            return Err(Error::input(format!("{file}: a file in memory has no folder to work in: give a workspace")));
        }
        let beside = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        return Ok(beside.unwrap_or(Path::new(".")));
    };
    existing(folder)
}

/// Bytes to work with.
pub fn memory(most: Option<u64>, threads: usize) -> Result<u64> {
    out_of_core::memory(most, base::threads::pool(threads)?.current_num_threads(), "into a file")
}
