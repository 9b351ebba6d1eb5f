//! The merge of more scans than memory holds.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::export::{Encoding, WriteOptions, check_file_in_pieces, part_path};
use surfrecon::merge::{MergeParams, MergeReport};
use surfrecon::params::{Params as _, Value, find};
use surfrecon::{IntoFile, Progress};

use crate::background::{Background, made};
use crate::errors::to_python;
use crate::job::Job;
use crate::memory_folder::Place;
use crate::mesh::provenance_of;
use crate::params::{params, whole};
use crate::paths::FsPath;
use crate::progress::Watch;
use crate::report;
use crate::settings::limit_of;
use crate::sources::{Clouds, Source, as_dyn, sources};

/// Refuses what a surface can't be written as piece by piece, before the work.
///
/// Raises:
///     InputError: another ending than ``.ply``, or text.
#[pyfunction]
#[pyo3(signature = (path, encoding = None))]
pub fn _check_file_in_pieces(path: Place, encoding: Option<&str>) -> PyResult<()> {
    let encoding = encoding.and_then(Encoding::named).unwrap_or_default();
    check_file_in_pieces(path.as_ref(), &WriteOptions { encoding, ..WriteOptions::default() })
        .map_err(|error| to_python(&error))
}

/// Merges scans, of which there may be more than memory holds, straight into a PLY file.
///
/// The file's bytes are those of ``surfrecon.merge`` with the same options and ``Mesh.write``. Neither all scans nor the surface are in
/// memory at once: what stages leave for each other is in files of the workspace, which are removed at the end. They take up to 200 bytes
/// for each intersection of a scan with the grid (``report.intersections``). The room for the surface is taken from the disk as soon as its
/// size is known. Give ``workspace`` a fast disk.
///
/// >>> report = surfrecon.merge_to_file(scans, "surface.ply", max_memory=2 * 10**9)
///
/// Args:
///     scans: as for ``surfrecon.merge``. Only those of files, as ``surfrecon.open`` gives them, are not in memory already.
///     path: its ending is ``.ply``. A file that is there is replaced once all is written, or stays as it is.
#[doc = include_str!("params/merge.txt")]
///     max_memory: most bytes that the merge takes. Scans that are being read come on top, one a thread. Default, and at most: what
///         ``set_memory_limit`` or the context allow, else what is free.
///     workspace: a folder that exists, for what memory does not hold. Default: that of the file.
///     keep: what the merge finds out stays in the workspace, which has to be given: the next merge with the same parameters that finds it
///         there renews only what scans have a part in that are new, gone or moved, and goes on where one was stopped or killed. The bytes are those
///         of a first merge. Files are taken for the same as long as their sizes and times are. It takes some 300 bytes an intersection. Remove
///         the folder ``surfrecon-merge-...`` when it is of no more use.
///     encoding: ``"binary"``, the default, or ``"binary_double"``, as for ``Mesh.write``. Text has no place here.
///     part_triangles: most triangles of a file, as for ``Mesh.write``: of a larger surface files beside it get the rest. That takes
///         the disk's room for the surface twice, and 12 bytes of memory for each triangle of a part. 0 for one file.
///     provenance: what the file says of where it is from, as for ``Mesh.write``.
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     The ``MergeReport``.
///
/// Raises:
///     ParameterError: an option out of its range.
///     InputError: a name that does not end in ``.ply``, a workspace that is no folder, scans that can't be used.
///     FormatError, FileError: a scan that can't be read, files that can't be written, a full disk, with the bytes that were wanted.
///     OutOfMemoryError: less memory than it takes at least, 12 MB a thread.
///     Cancelled: ``progress`` returned ``False``. As after each error no file is left, and the workspace is as it
///         was, but for what ``keep`` leaves there.
#[pyfunction]
// options: merge
#[pyo3(signature = (scans, path, *, max_memory = None, workspace = None, keep = false, encoding = None, part_triangles = None, provenance = None, progress = None, **options), text_signature = "(scans, path, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, match_exposure=True, close='holes', flat_base=False, base_up='z', edge_limit=None, grazing_limit=1.5707963267948966, threads=0, max_memory=None, workspace=None, keep=False, encoding=None, part_triangles=None, provenance=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn merge_to_file<'py>(
    py: Python<'py>,
    scans: &Bound<'py, PyAny>,
    path: Place,
    max_memory: Option<&Bound<'py, PyAny>>,
    workspace: Option<FsPath>,
    keep: bool,
    encoding: Option<&str>,
    part_triangles: Option<&Bound<'_, PyAny>>,
    provenance: Option<&Bound<'py, PyAny>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let write = written(encoding, part_triangles, provenance)?;
    let call = FileCall::new(scans, path, max_memory, (workspace, keep), write, options)?;
    report::of(py, &Watch::new(progress).run(py, |progress| call.run(progress))?)
}

/// The name of one of so many files that a mesh is in, counted from 1.
#[pyfunction]
pub fn _part_path(path: PathBuf, number: u64, count: u64) -> OsString {
    part_path(&path, number, count).into_os_string()
}

/// How a surface is written that is merged into a file.
///
/// # Errors
/// `ParameterError`, `InputError`.
pub fn written(
    encoding: Option<&str>,
    part_triangles: Option<&Bound<'_, PyAny>>,
    provenance: Option<&Bound<'_, PyAny>>,
) -> PyResult<WriteOptions> {
    let mut write = WriteOptions { provenance: provenance_of(provenance)?, ..WriteOptions::default() };
    let encoding = encoding.map(|encoding| ("encoding", Value::Choice(encoding)));
    let row = find("write", "part_triangles").expect("the parameter is in the table");
    let number = part_triangles.map_or(Ok(0.0), |given| whole(row, given))?;
    for (name, value) in encoding.into_iter().chain([("part_triangles", Value::Number(number))]) {
        write.set(name, value).map_err(|error| to_python(&error))?;
    }
    Ok(write)
}

/// A merge into a file with all it needs, free of Python.
pub struct FileCall {
    sources: Vec<Arc<Source>>,
    path: Place,
    params: MergeParams,
    into: IntoFile,
}

impl FileCall {
    /// Checks and takes the arguments of Python's `merge_to_file`.
    ///
    /// # Errors
    /// `ParameterError`, `InputError`, `TypeError`.
    pub fn new(
        scans: &Bound<'_, PyAny>,
        path: Place,
        max_memory: Option<&Bound<'_, PyAny>>,
        (workspace, keep): (Option<FsPath>, bool),
        write: WriteOptions,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let params = params("merge_to_file", options)?;
        let max_memory = max_memory.map(|given| limit_of("max_memory", given)).transpose()?.flatten();
        let sources = sources(scans, Clouds::Refused)?.into_iter().map(Arc::new).collect();
        let into = IntoFile { max_memory, workspace: workspace.map(|path| path.0), keep, write };
        Ok(FileCall { sources, path, params, into })
    }

    /// Merges.
    ///
    /// # Errors
    /// See [`surfrecon::merge_to_file`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<MergeReport> {
        let report = surfrecon::merge_to_file(&as_dyn(&self.sources), &self.path, &self.params, &self.into, progress)?;
        report.tell();
        Ok(report)
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.merge_to_file`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, InputError, TypeError: an option out of its range or of another kind, at once. Other errors are raised by
    ///         ``result``.
    #[staticmethod]
    // options: merge
    #[pyo3(signature = (scans, path, *, max_memory = None, workspace = None, keep = false, encoding = None, part_triangles = None, provenance = None, **options), text_signature = "(scans, path, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, match_exposure=True, close='holes', flat_base=False, base_up='z', edge_limit=None, grazing_limit=1.5707963267948966, threads=0, max_memory=None, workspace=None, keep=False, encoding=None, part_triangles=None, provenance=None)")]
    #[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn merge_to_file(
        scans: &Bound<'_, PyAny>,
        path: Place,
        max_memory: Option<&Bound<'_, PyAny>>,
        workspace: Option<FsPath>,
        keep: bool,
        encoding: Option<&str>,
        part_triangles: Option<&Bound<'_, PyAny>>,
        provenance: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let write = written(encoding, part_triangles, provenance)?;
        let call = FileCall::new(scans, path, max_memory, (workspace, keep), write, options)?;
        Job::of(Background::start(move |progress| made(call.run(progress)?, |py, report| report::of(py, &report))))
    }
}
