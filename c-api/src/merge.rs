//! Merging registered scans into one surface.

use std::ffi::c_char;
use std::path::PathBuf;

use surfrecon::export::WriteOptions;
use surfrecon::merge::{MergeParams, Merged, Store};
use surfrecon::reports::Report as _;
use surfrecon::{IntoFile, Progress};

use crate::files::path_of;
use crate::guard::guard;
use crate::handle;
use crate::merger::{Merger, srf_merger};
use crate::mesh::srf_mesh;
use crate::params::merge::srf_merge_params;
use crate::params::write::srf_write_options;
use crate::progress::{srf_progress, watched};
use crate::provenance::provenance_of;
use crate::reports::merge::srf_merge_report;
use crate::status::{Failure, flag, srf_status};
use crate::{params, pointer, report, sized};

/// Merges what was added into one surface, by Marching Intersections: a manifold mesh with boundary, the same to the bit for any number of
/// threads and any order of adding. Vertex attributes: confidence, noise (standard deviation of a sample there, 0 where scans are clean),
/// interpolated (on no scan exactly), source_scan (the scan of largest weight by the order of names, -1 where interpolated), colour if any
/// scan has colours. Colours are averaged in linear light, and have alpha 0 and the nearest colour where no scan has one. Attribute of
/// triangles: hole_fill. Blocks. Memory follows the intersections of scans and grid, 24 bytes each.
/// merger      not NULL
/// params      NULL for the defaults
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only. Not NULL
/// out_report  initialized by srf_merge_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT, SRF_ERR_FORMAT, SRF_ERR_IO, SRF_ERR_OUT_OF_MEMORY, SRF_ERR_CANCELLED,
///             SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_run(
    merger: *const srf_merger,
    params: *const srf_merge_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_merge_report,
) -> srf_status {
    guard(|| {
        run(merger, params, progress, out_mesh, out_report, |merger, params, progress| {
            merger.run(params, (Store::Memory, None), progress)
        })
    })
}

/// Runs it by `merge`, and hands out what it gives.
fn run(
    merger: *const srf_merger,
    params: *const srf_merge_params,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_merge_report,
    merge: impl FnOnce(&Merger, &MergeParams, &Progress<'_>) -> surfrecon::Result<Merged> + Send,
) -> Result<(), Failure> {
    pointer::writable("out_mesh", out_mesh)?;
    if !out_report.is_null() {
        sized::writable("out_report", out_report)?;
    }
    let merger = handle::get("merger", merger)?;
    let params = params::read("params", params)?;
    watched(progress, |progress| {
        let merged = merge(&merger, &params, progress)?;
        merged.report.tell();
        if !out_report.is_null() {
            report::write("out_report", out_report, merged.report.values())?;
        }
        handle::give("out_mesh", out_mesh, merged.mesh.into())
    })
}

/// Most bytes to take, as C says it.
fn most(bytes: u64) -> Option<u64> {
    (bytes != 0).then_some(bytes)
}

fn workspace_of(workspace: *const c_char) -> Result<Option<PathBuf>, Failure> {
    if workspace.is_null() { Ok(None) } else { path_of("workspace", workspace).map(|folder| Some(folder.to_owned())) }
}

/// Merges what was added, of which there may be more than memory holds, into a surface that it does hold. The surface is the same to the
/// bit as that of srf_merger_run() with memory enough. out_report says which way it went. Data that memory does not hold are in files of
/// the workspace, up to 200 bytes for each intersection of scans and grid, which are removed at the end. A folder that is itself in memory,
/// as some systems have it for temporary files, gains nothing. Scans of sets and of sources are read and made several times. Blocks.
/// merger          not NULL
/// params          NULL for the defaults
/// only_if_needed  1 to begin in memory, with what srf_merger_keep() kept, and anew in files once it is foreseen, or found, that cells as
///                 large as given or measured do not fit. The kept memory is given back then. If files do not do either, cells that were
///                 not given are larger, as those of srf_merger_run(). 0 to work in files, and to keep nothing
/// max_memory      most bytes that the merge takes, beside the scans that are being read, one per thread, and in files the surface. 0 for,
///                 and at most, what srf_set_memory_limit() or the context allow, else what is free
/// workspace       a folder that exists, UTF-8. NULL for the system's for temporary files
/// progress        NULL for none
/// out_mesh        receives a new handle on SRF_OK only. Not NULL
/// out_report      initialized by srf_merge_report_init(). NULL if not wanted
/// returns         SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT also for a workspace that is no folder, SRF_ERR_FORMAT, SRF_ERR_IO also for a
///                 full disk, SRF_ERR_OUT_OF_MEMORY also where the surface does not fit, and in files for less than 12 MB,
///                 SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_run_in_files(
    merger: *const srf_merger,
    params: *const srf_merge_params,
    only_if_needed: u32,
    max_memory: u64,
    workspace: *const c_char,
    progress: *const srf_progress,
    out_mesh: *mut *mut srf_mesh,
    out_report: *mut srf_merge_report,
) -> srf_status {
    guard(|| {
        let only_if_needed = flag("only_if_needed", only_if_needed)?;
        let (memory, workspace) = (most(max_memory), workspace_of(workspace)?);
        let store = if only_if_needed { Store::MemoryOrFiles { workspace } } else { Store::Files { workspace } };
        run(merger, params, progress, out_mesh, out_report, |merger, params, progress| {
            merger.run(params, (store, memory), progress)
        })
    })
}

/// Merges what was added, of which there may be more than memory holds, straight into a PLY file. Its bytes are those that srf_merger_run()
/// and srf_mesh_write() make. Neither all scans nor the surface are in memory at once, but images and meshes that were added are. Scans of
/// sets and of sources are read and made several times. Data that memory does not hold are in files of the workspace, up to 200 bytes for
/// each intersection of scans and grid, which are removed at the end. A file of that name is replaced once all is written, or stays as it
/// is. Nothing is kept for another run, whatever srf_merger_keep() said. Blocks.
/// merger      not NULL
/// path        UTF-8, ending in .ply. Not NULL
/// params      NULL for the defaults
/// max_memory  most bytes that the merge takes, beside the scans that are being read, one per thread. 0 for, and at most, what
///             srf_set_memory_limit() or the context allow, else what is free
/// workspace   a folder that exists, UTF-8. NULL for that of the file
/// options     how the file is written, not as text. NULL for the defaults
/// provenance  an object in JSON that the file says of where it is from, as by srf_mesh_write_from(). NULL for none
/// progress    NULL for none
/// out_report  initialized by srf_merge_report_init(). NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT also for a workspace that is no folder, SRF_ERR_FORMAT, SRF_ERR_IO also for a full
///             disk, SRF_ERR_OUT_OF_MEMORY also for less than 12 MB per thread, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
///             SRF_ERR_STRUCT_SIZE. Since 0.2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merger_write(
    merger: *const srf_merger,
    path: *const c_char,
    params: *const srf_merge_params,
    max_memory: u64,
    workspace: *const c_char,
    options: *const srf_write_options,
    provenance: *const c_char,
    progress: *const srf_progress,
    out_report: *mut srf_merge_report,
) -> srf_status {
    guard(|| {
        if !out_report.is_null() {
            sized::writable("out_report", out_report)?;
        }
        let (merger, path) = (handle::get("merger", merger)?, path_of("path", path)?);
        let params = params::read("params", params)?;
        let into = IntoFile {
            keep: false,
            max_memory: most(max_memory),
            workspace: workspace_of(workspace)?,
            write: WriteOptions { provenance: provenance_of(provenance)?, ..params::read("options", options)? },
        };
        let made = watched(progress, |progress| Ok(merger.write(path, &params, &into, progress)?))?;
        made.tell();
        if !out_report.is_null() {
            report::write("out_report", out_report, made.values())?;
        }
        Ok(())
    })
}
