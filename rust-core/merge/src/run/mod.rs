//! Ways to run the steps: what stages leave for each other is in memory, in memory for the next merge too, or in files.

pub mod incremental;
pub mod memory;
pub mod out_of_core;
pub mod started;

use std::path::{Path, PathBuf};

use crate::intake::decoded::DecodedOnce;
use crate::intake::setup::{Fit, Setup};
use crate::params::MergeParams;
use crate::report::Merged;
use base::error::{Error, Result};
use base::memory::attempted;
use base::progress::Progress;
use base::{fewer_threads, threads};
use image::source::ScanSource;
use incremental::Merger;
use memory::run_by;
use mesh::TriMesh;
use out_of_core::{LEAST, Workspace};
use started::if_it_fits;

/// Settings of a run of a merge: nothing of it changes the result, but where cells have to grow for memory.
#[derive(Default)]
pub struct Run<'a> {
    /// The place where stages keep what they leave for each other.
    pub store: Store,
    /// Most bytes of memory that are taken, beside scans that are being read, and in files the surface. By default, and at most, as many as
    /// the limit allows or as are free.
    pub memory: Option<u64>,
    /// Findings of a run before.
    pub reuse: Option<Reuse<'a>>,
}

/// The store in which a merge keeps what its stages leave for each other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Store {
    /// Memory. Cells that were not given grow where they would not fit.
    #[default]
    Memory,
    /// Files, for more scans than memory holds.
    Files {
        /// A folder that exists, which is as before at the end. By default the system's for temporary files.
        workspace: Option<PathBuf>,
    },
    /// Memory as long as cells fit that are as large as given or measured, else files. If files do not do either, cells that were not given
    /// grow.
    MemoryOrFiles {
        /// As of [`Store::Files`].
        workspace: Option<PathBuf>,
    },
}

/// Findings that merges of scans that change leave for each other. A merge in files neither takes nor leaves anything of it.
pub struct Reuse<'a> {
    /// Keeps it.
    pub merger: &'a mut Merger,
    /// A number for what each scan is: as long as that is the same, so is the scan. No two scans have the same.
    pub versions: &'a [u64],
}

/// Merges the scans into one surface: the same for each way to run it, to the bit.
///
/// In files the folder needs room: up to 200 bytes for each intersection of a scan with the grid. A folder that is itself in memory, as
/// some systems have it for temporary files, gains nothing. [`MergeReport::in_files`](crate::MergeReport::in_files) says which way it went.
/// With [`Store::MemoryOrFiles`] the work begins in memory, and begins anew in files once it is foreseen, or found, that cells do not fit:
/// so long that took in vain.
///
/// # Errors
/// Parameters out of range. Scans of different coordinate reference systems, or in degrees. All errors of loading a scan. Too little
/// memory. Versions that are not one per scan. In files also a workspace that is no folder, and files that can't be written: nothing is
/// left there then. [`Error::Cancelled`].
pub fn merge(scans: &[&dyn ScanSource], params: &MergeParams, run: Run<'_>, progress: &Progress<'_>) -> Result<Merged> {
    let Run { store, memory, reuse } = run;
    match &store {
        Store::Memory => {
            let setup = Setup { fit: Fit::within(memory), ..Setup::default() };
            in_memory(scans, params, &setup, reuse, progress)
        }
        Store::Files { workspace } => in_files(scans, params, workspace.as_deref(), memory, progress),
        Store::MemoryOrFiles { workspace } => {
            let in_memory = || if_it_fits(memory, |setup| in_memory(scans, params, setup, reuse, progress));
            where_it_fits(scans, params, (workspace.as_deref(), memory), progress, in_memory)
        }
    }
}

/// Merges in memory, with what is kept of it or without.
fn in_memory(
    scans: &[&dyn ScanSource],
    params: &MergeParams,
    setup: &Setup,
    reuse: Option<Reuse<'_>>,
    progress: &Progress<'_>,
) -> Result<Merged> {
    let memory = setup.fit.memory.is_finite().then_some(setup.fit.memory as u64);
    let once = DecodedOnce::all(scans, memory);
    let once: Vec<&dyn ScanSource> = once.iter().map(|scan| scan as &dyn ScanSource).collect();
    let scans = if once.is_empty() { scans } else { &once };
    match reuse {
        Some(Reuse { merger, versions }) => merger.run_by((scans, versions), params, setup, progress),
        None => run_by(scans, params, setup, progress),
    }
}

/// Gives what `in_memory` gives. Else the merge in files, else one in cells that fit.
fn where_it_fits(
    scans: &[&dyn ScanSource],
    params: &MergeParams,
    (workspace, memory): (Option<&Path>, Option<u64>),
    progress: &Progress<'_>,
    in_memory: impl FnOnce() -> Result<Option<Merged>>,
) -> Result<Merged> {
    let in_files = || in_files(scans, params, workspace, memory, progress);
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
    run_by(scans, params, &Setup { fit: Fit::within(memory), ..Setup::default() }, progress)
}

fn in_files(
    scans: &[&dyn ScanSource],
    params: &MergeParams,
    workspace: Option<&Path>,
    memory: Option<u64>,
    progress: &Progress<'_>,
) -> Result<Merged> {
    params.validate()?;
    params.go_together()?;
    let temporary = std::env::temp_dir();
    let folder = out_of_core::existing(workspace.unwrap_or(&temporary))?;
    let memory = out_of_core::memory(memory, 1, "in files")?;
    // Whether it can be done must not depend on the threads there are: elsewhere cells are larger.
    let most = (memory / LEAST) as usize;
    let merge = |threads| {
        let threads = threads::pool(threads)?.current_num_threads().min(most);
        let params = &MergeParams { threads, ..*params };
        let mut mesh = TriMesh::default();
        let workspace = Workspace { folder, memory, kept: None };
        let mut report = out_of_core::run(scans, params, workspace, &mut mesh, progress)?;
        report.in_files = true;
        Ok(Merged { mesh, report })
    };
    fewer_threads::where_memory_is_short(params.threads, || true, merge)
}
