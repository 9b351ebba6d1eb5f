//! More scans than memory holds, merged into a file by several processes.

use std::path::Path;

use base::error::{Error, Result};
use base::progress::Progress;
use io::export::{WriteOptions, check_file_in_pieces, write_mesh_in_pieces};
use merge::out_of_core::{self, Keep, Stage, Together, versions};
use merge::{MergeParams, MergeReport, ScanSource};
use mesh::sink::MeshSink;

use crate::merge_to_file::{memory, refuse_what_is_read};

/// The folder in which a merge works that processes do together.
#[derive(Clone, Copy, Debug)]
pub struct TaskFolder<'a> {
    /// A folder that exists and has nothing else in it, which all processes reach under this name or another.
    pub folder: &'a Path,
    /// Most bytes of memory that a process takes. By default, and at most, what the limit allows or what is free.
    pub max_memory: Option<u64>,
    /// Number of tasks of a stage. Some stages are one task. The same for all tasks of a merge.
    pub tasks: u32,
    /// Whether what the merge finds out stays in the folder. The next merge in it with the same parameters and as many tasks then renews
    /// only what scans have a part in that are new, gone or others, as [`IntoFile::keep`](crate::IntoFile::keep) says. One at a time.
    pub keep: bool,
    /// Whether the folder has those files alone that a task needs, and its own are taken elsewhere, as to an object store. Then it is not
    /// refused for having less room than all of them take.
    pub has_a_part: bool,
}

impl<'a> TaskFolder<'a> {
    fn together(self, params: &MergeParams, versions: &'a [u64]) -> Result<Together<'a>> {
        params.validate()?;
        params.go_together()?;
        if !self.folder.is_dir() {
            return Err(Error::input(format!("{}: tasks need a folder that exists", self.folder.display())));
        }
        if self.tasks == 0 {
            return Err(Error::input("a stage has one task at least, got 0"));
        }
        let kept = self.keep.then_some(Keep { versions, stays: true });
        let memory = memory(self.max_memory, params.threads)?;
        Ok(Together { folder: self.folder, memory, tasks: self.tasks, kept, has_all: !self.has_a_part })
    }

    fn versions(self, sources: &[&dyn ScanSource], params: &MergeParams, progress: &Progress<'_>) -> Result<Vec<u64>> {
        if self.keep { versions(sources, params, progress) } else { Ok(Vec::new()) }
    }
}

/// Does a task of a merge, unless it is done: see [`out_of_core::run_task`].
///
/// # Errors
/// As [`merge::merge()`]. A folder that is none. No such task. A task before it that is not done, by its name. Too little memory. A file
/// that can't be read or written.
pub fn merge_task(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    folder: TaskFolder<'_>,
    (stage, number): (Stage, u32),
    progress: &Progress<'_>,
) -> Result<()> {
    let versions = folder.versions(sources, params, progress)?;
    out_of_core::run_task(sources, params, folder.together(params, &versions)?, (stage, number), progress)
}

/// Writes the surface into a PLY file once all tasks are done. Its bytes are those of [`merge_to_file`](crate::merge_to_file). The folder
/// of the tasks stays as it is. In one that is kept, [`end_merge_tasks`] removes what nobody needs any more.
///
/// # Errors
/// As [`merge_task`] and [`merge_to_file`](crate::merge_to_file).
pub fn merge_tasks_to_file(
    sources: &[&dyn ScanSource],
    path: &Path,
    params: &MergeParams,
    folder: TaskFolder<'_>,
    write: &WriteOptions,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    check_file_in_pieces(path, write)?;
    refuse_what_is_read(sources, path)?;
    let versions = folder.versions(sources, params, progress)?;
    let together = folder.together(params, &versions)?;
    let put = |sink: &mut dyn MeshSink| out_of_core::put_together(sources, params, together, sink, progress);
    Ok(MergeReport { in_files: true, ..write_mesh_in_pieces(path, write, put, progress)? })
}

/// Once the surface is written: a folder that is kept loses the marks of what is done, and what another merge has no use for. Others stay
/// as they are.
///
/// # Errors
/// A file can't be read or removed.
pub fn end_merge_tasks(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    folder: TaskFolder<'_>,
    progress: &Progress<'_>,
) -> Result<()> {
    let versions = folder.versions(sources, params, progress)?;
    out_of_core::end(sources, params, folder.together(params, &versions)?)
}
