//! The merge and its report.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::error::meant;
use surfrecon::merge::{MergeParams, Merged, Run, Store};
use surfrecon::mesh::measure::Side;
use surfrecon::{Error, Progress, memory};

use crate::errors::{input_error, to_python};
use crate::incremental::Incremental;
use crate::mesh::Mesh;
use crate::params::params;
use crate::paths::FsPath;
use crate::progress::Watch;
use crate::report;
use crate::settings::limit_of;
use crate::sources::{Clouds, Source, as_dyn, sources};

/// Merges registered scans into one surface (Marching Intersections).
///
/// Options that are ``None`` take their defaults. The default voxel is measured on up to eight scans, spread through the list in
/// the order of their names. ``report.voxel_reason`` says what decided. If memory makes it grow, its size follows from the scans and the limit
/// (``max_memory``, ``set_memory_limit`` or the context's) alone. Without a limit it follows from what is free at that moment: for equal
/// results give a limit, or ``voxel``.
///
/// The noise of range images is measured and averaged out. Of three and more range images that know from where they were seen
/// (all but grids of points with parallel rays), more may see through a place than have a surface there: that place is dropped
/// (``report.seen_through``). Meshes are taken as they are.
///
/// >>> result = surfrecon.merge(scans)
/// >>> result.mesh.write("surface.ply")
/// >>> finer = surfrecon.merge(scans, voxel=result.report.voxel / 2)
///
/// Args:
///     scans: a ``ScanSet``, or a list of ``Scan``, ``RangeImage``, ``Mesh``, ``(Mesh, world_from_mesh)`` or
///         ``(Mesh, world_from_mesh, name)``. Scans on disk are read when needed, at most one a thread in memory.
#[doc = include_str!("params/merge.txt")]
///     measure: whether to measure how far the surface lies from the scans, which then are all in memory at once.
///     files: ``"always"`` merges more scans than memory holds into a surface that it does hold, the same to the bit: what stages leave for
///         each other is in files of the workspace, up to 200 bytes for each intersection of a scan with the grid, which are removed
///         at the end. ``"if_needed"`` begins in memory, and anew in files once it is foreseen, or found, that the voxel as given or
///         measured does not fit there (``report.in_files``). If files do not do either, a measured voxel grows. ``"never"``,
///         the default without ``max_memory`` and ``workspace``, only lets it grow.
///     max_memory: most bytes that the merge takes. Scans that are being read come on top, one a thread, and in files the surface.
///         Default, for 0 too, and at most: what ``set_memory_limit`` or the context allow, else what is free.
///     workspace: a folder that exists, for what memory does not hold: on a disk, which the system's for temporary files, the
///         default, is not on every system.
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``MergeResult`` with ``mesh`` in the world, ``report`` and, if asked for, ``distances``. Attributes of vertices: ``confidence``,
///     ``noise`` (the standard deviation of the samples along their rays), ``interpolated`` (on no scan exactly), ``source_scan`` (the
///     scan of largest weight by its place in ``report.scan_names``, -1 where ``interpolated``), and ``colour`` if any scan has it.
///     Attribute of faces: ``hole_fill``. Colours are averaged in linear light, without highlights where three scans and more have a
///     say. Alpha is 0 where no scan has a colour: such vertices have the nearest one.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError, FormatError, FileError: a scan that can't be used or read.
///     OutOfMemoryError: a given ``voxel`` that needs more memory than there is. The text names one that fits. In files: no memory for
///         the surface, or less than 12 MB.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: merge
#[pyo3(signature = (scans, *, measure = false, files = None, max_memory = None, workspace = None, progress = None, **options), text_signature = "(scans, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, match_exposure=True, close='holes', flat_base=False, base_up='z', edge_limit=None, grazing_limit=1.5707963267948966, threads=0, measure=False, files=None, max_memory=None, workspace=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn merge(
    py: Python<'_>,
    scans: &Bound<'_, PyAny>,
    measure: bool,
    files: Option<&str>,
    max_memory: Option<&Bound<'_, PyAny>>,
    workspace: Option<FsPath>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<MergeResult> {
    MergeCall::new(scans, measure, store(files, max_memory, workspace)?, options)?.result(py, progress)
}

/// Returns where a merge keeps what its stages leave, and in how many bytes of memory, of Python's arguments.
///
/// # Errors
/// `ParameterError`, `InputError`, `TypeError`.
pub fn store(
    files: Option<&str>,
    max_memory: Option<&Bound<'_, PyAny>>,
    workspace: Option<FsPath>,
) -> PyResult<(Store, Option<u64>)> {
    let max_memory = max_memory.map(|given| limit_of("max_memory", given)).transpose()?.flatten();
    let is_given = max_memory.is_some() || workspace.is_some();
    let store = match files.unwrap_or(if is_given { "always" } else { "never" }) {
        "always" => Store::Files { workspace: workspace.map(|path| path.0) },
        "if_needed" => Store::MemoryOrFiles { workspace: workspace.map(|path| path.0) },
        "never" if is_given => {
            let text = "max_memory and workspace are for merges in files: leave them out, or files=\"never\"";
            return Err(input_error(text.to_owned()));
        }
        "never" => Store::Memory,
        other => {
            let allowed = "\"never\", \"if_needed\" or \"always\"".to_owned();
            let meant = meant(other, ["never", "if_needed", "always"]);
            let error = Error::Parameter { name: "files", value: format!("{other:?}{meant}"), allowed, unit: "" };
            return Err(to_python(&error));
        }
    };
    Ok((store, max_memory))
}

/// A merge with all it needs, free of Python.
pub struct MergeCall {
    sources: Vec<Arc<Source>>,
    /// The kept state of a merger, where the scans are one's.
    incremental: Option<Incremental>,
    params: MergeParams,
    measure: bool,
    /// The store that it works in, and its most bytes of memory.
    store: (Store, Option<u64>),
}

/// A merged surface, and the distances of its vertices from the scans if they were asked for.
pub type Measured = (Merged, Option<Vec<f64>>);

/// Share of the time that the merge itself takes where the surface is measured afterwards.
const MERGING: f64 = 0.8;

impl MergeCall {
    /// Checks and takes the arguments of Python's `merge`.
    ///
    /// # Errors
    /// `ParameterError`, `TypeError`.
    pub fn new(
        scans: &Bound<'_, PyAny>,
        measure: bool,
        store: (Store, Option<u64>),
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let params = params("merge", options)?;
        let sources = sources(scans, Clouds::Refused)?.into_iter().map(Arc::new).collect();
        Ok(MergeCall { sources, incremental: None, params, measure, store })
    }

    /// The same of the scans of a merger.
    ///
    /// # Errors
    /// `ParameterError`, `TypeError`.
    pub fn incremental(
        incremental: Incremental,
        measure: bool,
        store: (Store, Option<u64>),
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let params = params("merge", options)?;
        Ok(MergeCall { sources: incremental.sources(), incremental: Some(incremental), params, measure, store })
    }

    /// Runs it whole, while Python watches.
    ///
    /// # Errors
    /// As of [`merge`].
    pub fn result(&self, py: Python<'_>, progress: Option<Py<PyAny>>) -> PyResult<MergeResult> {
        let merged = Watch::new(progress).run_parts(py, |watch| {
            let merged = self.run(&watch.span(0.0, self.merging()))?;
            self.measured(merged, &watch.span(self.merging(), 1.0))
        })?;
        MergeResult::new(py, merged)
    }

    /// Share of the whole that [`MergeCall::run`] takes. [`MergeCall::measured`] takes the rest.
    pub fn merging(&self) -> f64 {
        if self.measure { MERGING } else { 1.0 }
    }

    /// Merges.
    ///
    /// # Errors
    /// See [`surfrecon::merge::merge`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Merged> {
        let (store, memory) = self.store.clone();
        let merged = match &self.incremental {
            Some(incremental) => incremental.run(&self.params, (store, memory), progress),
            None => {
                let run = Run { store, memory, reuse: None };
                surfrecon::merge::merge(&as_dyn(&self.sources), &self.params, run, progress)
            }
        }?;
        merged.report.tell();
        Ok(merged)
    }

    /// Measures what was merged, if that was asked for.
    ///
    /// # Errors
    /// See [`surfrecon::merge::deviation`].
    pub fn measured(&self, merged: Merged, progress: &Progress<'_>) -> surfrecon::Result<Measured> {
        if !self.measure {
            return Ok((merged, None));
        }
        let MergeParams { triangulation, threads, .. } = &self.params;
        let sources = as_dyn(&self.sources);
        let points = &merged.mesh.positions;
        let deviation =
            || surfrecon::merge::deviation(points, &sources, triangulation, Side::Ignored, *threads, progress);
        let found = match memory::attempted(deviation) {
            Some(Err(Error::OutOfMemory(_))) | None if merged.report.in_files => return Ok((merged, None)),
            Some(found) => found?,
            None => deviation()?,
        };
        Ok((merged, Some(found.distances)))
    }
}

/// Result of a merge.
///
/// >>> result = surfrecon.merge(scans, measure=True)
/// >>> result.mesh.write("surface.ply")
/// >>> bool(np.median(result.distances) < result.report.voxel)
/// True
#[pyclass(frozen, module = "surfrecon")]
pub struct MergeResult {
    /// The surface, in the world. Vertex attributes: ``confidence`` (summed over the scans), ``interpolated`` (on no scan
    /// exactly), ``source_scan`` (the scan of largest weight, -1 where interpolated), ``noise`` (of the samples, as measured), and
    /// ``colour`` if any scan has colours. Attribute of the triangles: ``hole_fill``.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    /// Figures of the run: a ``MergeReport``.
    #[pyo3(get)]
    report: Py<PyAny>,
    /// (n,) float64: the distance of each vertex from the nearest point of the scans. ``None`` unless it was asked for, and
    /// where memory was too short for it after a merge in files.
    #[pyo3(get)]
    distances: Option<Py<PyArray1<f64>>>,
}

impl MergeResult {
    pub fn new(py: Python<'_>, (merged, distances): Measured) -> PyResult<Self> {
        let report = report::of(py, &merged.report)?.unbind();
        let distances = distances.map(|distances| PyArray1::from_vec(py, distances).unbind());
        Ok(MergeResult { mesh: Py::new(py, Mesh::from(merged.mesh))?, report, distances })
    }
}

#[pymethods]
impl MergeResult {
    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<MergeResult {}>", self.mesh.bind(py).repr()?))
    }
}
