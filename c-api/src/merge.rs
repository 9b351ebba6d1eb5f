//! Merging registered scans into one surface.

use std::ffi::c_char;
use std::path::PathBuf;

use surfrecon::export::WriteOptions;
use surfrecon::merge::{MergeParams, MergeReport, Merged, Store, VoxelReason};
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
use crate::settings::SRF_FROM_DATA;
use crate::status::{Failure, flag, srf_status};
use crate::{params, pointer, sized};

/// Figures of a merge. Starts with its size; prepared by srf_merge_report_init().
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub struct srf_merge_report {
    /// Bytes of this struct.
    pub struct_size: u32,
    /// Scans merged.
    pub scans: u32,
    /// Triangles of all scans.
    pub input_triangles: u64,
    /// Size of a cell that was used, in the unit of the scans.
    pub voxel: f64,
    /// Merge distance that was used, in the unit of the scans.
    pub merge_distance: f64,
    /// Longest boundary that was closed, in the unit of the scans.
    pub max_hole_length: f64,
    /// Median distance between overlapping scans along grid lines; SRF_FROM_DATA where it was not measured or none overlap.
    pub overlap_residual: f64,
    /// Cells spanned along x, y and z.
    pub grid: [u64; 3],
    /// Intersections of scans with grid lines.
    pub intersections: u64,
    /// Intersections left after fusing.
    pub fused_intersections: u64,
    /// Artificial intersections that became vertices.
    pub artificial_intersections: u64,
    /// Faces made directly.
    pub faces_direct: u64,
    /// Faces made after analysis of neighbouring cells.
    pub faces_settled: u64,
    /// Faces that fill holes.
    pub faces_filling: u64,
    /// Holes closed.
    pub holes_closed: u64,
    /// Boundary loops left open.
    pub holes_open: u64,
    /// Connected parts dropped.
    pub dropped_components: u64,
    /// Faces of those.
    pub dropped_faces: u64,
    /// Largest number of bytes held by intersections and the surface at once.
    pub working_bytes: u64,
    /// Median standard deviation of the samples along their rays, as measured, in the unit of the scans; 0 where scans are clean.
    pub noise: f64,
    /// What decided the size of a cell: a value of srf_voxel_reason.
    pub voxel_reason: u32,
    /// 0.
    pub reserved: u32,
    /// Edges of the grid whose intersections were dropped: more scans see through there than have a surface there.
    pub seen_through: u64,
    /// Of the range images, the median standard deviation of their samples across the rays, in the unit of the scans.
    pub noise_across: f64,
    /// Of the range images, the median step that values along the ray are multiples of, in the unit of the scans; 0 for none.
    pub noise_step: f64,
    /// Of the range images, the median number of pixels over which errors depend on each other: 1 for white noise.
    pub noise_correlation: f64,
    /// 1 where stages left in files what they leave for each other, 0 where all was in memory.
    pub in_files: u64,
}

/// What decided the size of a cell.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_voxel_reason {
    /// The caller gave it.
    SRF_VOXEL_REASON_GIVEN = 0,
    /// 1.5 times the mean distance of neighbouring samples.
    SRF_VOXEL_REASON_SPACING = 1,
    /// Half the median standard deviation of the samples.
    SRF_VOXEL_REASON_NOISE = 2,
    /// 1.5 times the median distance between scans that overlap.
    SRF_VOXEL_REASON_DISTANCE = 3,
    /// Coarser than that, so that it fits into memory: by the limit and the scans alone, or, where there is no limit, by what is free
    /// at that moment.
    SRF_VOXEL_REASON_MEMORY = 4,
}

impl From<VoxelReason> for srf_voxel_reason {
    fn from(reason: VoxelReason) -> Self {
        match reason {
            VoxelReason::Given => srf_voxel_reason::SRF_VOXEL_REASON_GIVEN,
            VoxelReason::Spacing => srf_voxel_reason::SRF_VOXEL_REASON_SPACING,
            VoxelReason::Noise => srf_voxel_reason::SRF_VOXEL_REASON_NOISE,
            VoxelReason::Distance => srf_voxel_reason::SRF_VOXEL_REASON_DISTANCE,
            VoxelReason::Memory => srf_voxel_reason::SRF_VOXEL_REASON_MEMORY,
        }
    }
}

impl From<MergeReport> for srf_merge_report {
    fn from(r: MergeReport) -> Self {
        srf_merge_report {
            struct_size: size_of::<Self>() as u32,
            scans: r.scans as u32,
            input_triangles: r.input_triangles,
            voxel: r.voxel,
            merge_distance: r.merge_distance,
            max_hole_length: r.max_hole_length,
            overlap_residual: r.overlap_residual.unwrap_or(SRF_FROM_DATA),
            grid: r.grid,
            intersections: r.intersections,
            fused_intersections: r.fused_intersections,
            artificial_intersections: r.artificial_intersections,
            faces_direct: r.faces[0],
            faces_settled: r.faces[1],
            faces_filling: r.faces[2],
            holes_closed: r.holes[0],
            holes_open: r.holes[1],
            dropped_components: r.dropped_components[0],
            dropped_faces: r.dropped_components[1],
            working_bytes: r.working_bytes,
            noise: r.noise,
            seen_through: r.seen_through,
            noise_across: r.noise_across,
            noise_step: r.noise_step,
            noise_correlation: r.noise_correlation,
            voxel_reason: srf_voxel_reason::from(r.voxel_reason) as u32,
            reserved: 0,
            in_files: r.in_files.into(),
        }
    }
}

/// Prepares a struct for srf_merger_run(). Call srf_merge_report_init(report), which adds the size that this header knows.
/// report   not NULL
/// size     sizeof(srf_merge_report): what of the struct this library does not know becomes 0
/// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn srf_merge_report_init_sized(report: *mut srf_merge_report, size: usize) -> srf_status {
    guard(|| sized::init("report", report, size, srf_merge_report::default()))
}

/// Merges what was added into one surface, by Marching Intersections: a manifold mesh with boundary, the same to the bit for
/// any number of threads and any order of adding. Vertex attributes: confidence, noise (standard deviation of a sample
/// there, 0 where scans are clean), interpolated (on no scan exactly), source_scan (the scan of largest weight by the order of names, -1
/// where interpolated), colour if any scan has colours (averaged in linear light; of alpha 0 and the nearest colour where no scan has
/// one); of triangles: hole_fill. Blocks; memory follows the intersections of scans and grid, 24 bytes each.
/// merger      not NULL
/// params      NULL for the defaults
/// progress    NULL for none
/// out_mesh    receives a new handle on SRF_OK only; not NULL
/// out_report  initialized by srf_merge_report_init(); NULL if not wanted
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
            sized::write("out_report", out_report, merged.report.into())?;
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

/// Merges what was added, of which there may be more than memory holds, into a surface that it does hold, the same to the bit as that of
/// srf_merger_run() where there is memory enough; out_report says which way it went. What memory does not hold is in files of the
/// workspace, up to 200 bytes for each intersection of scans and grid, which are removed at the end; a folder that is itself in memory, as
/// some systems have it for temporary files, gains nothing. Scans of sets and of sources are read and made several times. Blocks.
/// merger          not NULL
/// params          NULL for the defaults
/// only_if_needed  1 to begin in memory, with what srf_merger_keep() kept, and anew in files once it is foreseen, or found, that cells as
///                 large as given or measured do not fit; what was kept is given back then. Where files do not do either, cells that
///                 were not given are larger, as those of srf_merger_run(). 0 to work in files, and to keep nothing
/// max_memory      most bytes that the merge takes, beside the scans that are being read, one a thread, and in files the surface; 0 for, and
///                 at most, what srf_set_memory_limit() or the context allow, else what is free
/// workspace       a folder that exists, UTF-8; NULL for the system's for temporary files
/// progress        NULL for none
/// out_mesh        receives a new handle on SRF_OK only; not NULL
/// out_report      initialized by srf_merge_report_init(); NULL if not wanted
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

/// Merges what was added, of which there may be more than memory holds, straight into a PLY file: its bytes are those that
/// srf_merger_run() and srf_mesh_write() make. Neither all scans nor the surface are in memory at once, but images and meshes that were
/// added are; scans of sets and of sources are read and made several times. What memory does not hold is in files of the workspace, up to
/// 200 bytes for each intersection of scans and grid, which are removed at the end. A file of that name is replaced once all is
/// written, or stays as it is. Nothing is kept for another run, whatever srf_merger_keep() said. Blocks.
/// merger      not NULL
/// path        UTF-8, ending in .ply; not NULL
/// params      NULL for the defaults
/// max_memory  most bytes that the merge takes, beside the scans that are being read, one a thread; 0 for, and at most, what
///             srf_set_memory_limit() or the context allow, else what is free
/// workspace   a folder that exists, UTF-8; NULL for that of the file
/// options     how the file is written, not as text; NULL for the defaults
/// provenance  an object in JSON that the file says of where it is from, as by srf_mesh_write_from(); NULL for none
/// progress    NULL for none
/// out_report  initialized by srf_merge_report_init(); NULL if not wanted
/// returns     SRF_OK, SRF_ERR_PARAMETER, SRF_ERR_INPUT also for a workspace that is no folder, SRF_ERR_FORMAT, SRF_ERR_IO also for a full
///             disk, SRF_ERR_OUT_OF_MEMORY also for less than 12 MB a thread, SRF_ERR_CANCELLED, SRF_ERR_HANDLE, SRF_ERR_NULL,
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
        let report = watched(progress, |progress| Ok(merger.write(path, &params, &into, progress)?))?;
        report.tell();
        if !out_report.is_null() {
            sized::write("out_report", out_report, report.into())?;
        }
        Ok(())
    })
}
