//! More scans than memory holds, merged into a file by several processes.

use std::path::Path;

use base::error::{Error, Result};
use base::progress::Progress;
use io::export::{WriteOptions, check_file_in_pieces, write_mesh_in_pieces};
use merge::disk::{self, Stage, Together};
use merge::{MergeParams, MergeReport, ScanSource};
use mesh::sink::MeshSink;

use crate::merge_to_file::memory;

/// Where a merge works that processes do together.
#[derive(Clone, Copy, Debug)]
pub struct TaskFolder<'a> {
    /// A folder that exists and has nothing else in it, which all processes reach under this name or another.
    pub folder: &'a Path,
    /// Most bytes of memory that a process takes; by default, and at most, what the limit allows or what is free.
    pub max_memory: Option<u64>,
    /// How many tasks a stage has; some stages are one task. The same for all tasks of a merge.
    pub tasks: u32,
}

impl<'a> TaskFolder<'a> {
    fn together(self, params: &MergeParams) -> Result<Together<'a>> {
        params.validate()?;
        if !self.folder.is_dir() {
            return Err(Error::input(format!("{}: tasks need a folder that exists", self.folder.display())));
        }
        if self.tasks == 0 {
            return Err(Error::input("a stage has one task at least, got 0"));
        }
        Ok(Together { folder: self.folder, memory: memory(self.max_memory, params.threads)?, tasks: self.tasks })
    }
}

/// Does a task of a merge, unless it is done: see [`disk::run_task`].
///
/// # Errors
/// As [`merge::run`]; a folder that is none; no such task; a task before it that is not done, by its name; too little memory; a file that
/// can't be read or written.
pub fn merge_task(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    folder: TaskFolder<'_>,
    (stage, number): (Stage, u32),
    progress: &Progress<'_>,
) -> Result<()> {
    disk::run_task(sources, params, folder.together(params)?, (stage, number), progress)
}

/// Writes the surface into a PLY file once all tasks are done: its bytes are those of [`merge_to_file`](crate::merge_to_file). The folder of
/// the tasks stays as it is.
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
    let together = folder.together(params)?;
    check_file_in_pieces(path, write)?;
    let put = |sink: &mut dyn MeshSink| disk::put_together(sources, params, together, sink, progress);
    Ok(MergeReport { in_files: true, ..write_mesh_in_pieces(path, write, put)? })
}
