//! Scans without poses to one frame, at once or read once and as often as wanted.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DAffine3;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList};
use surfrecon::Progress;
use surfrecon::align::{AlignParams, Alignment as Core, Constraints};
use surfrecon::export::{PlacedFile, PlacedScan, write_poses, write_trajectory};
use surfrecon::memory_folder::MemoryFolder;

use crate::arrays;
use crate::background::{Background, made_class};
use crate::constraints::constraints;
use crate::errors::{input_error, to_python};
use crate::job::Job;
use crate::memory_folder::Place;
use crate::params::{no_others, params, params_only};
use crate::progress::Watch;
use crate::ready::{ReadCall, Ready};
use crate::report;
use crate::sources::{self, Source};

/// Brings scans to one frame: finds where each lies from what overlaps, in any order and from any poses.
///
/// A scan is placed only if it overlaps another, is held against turning and sliding, and fits in one place alone. Others are
/// left out, with the reason in words. Lines of sight of range images count as evidence: no scan is put where
/// another's sensor saw through. The same scans give the same poses to the bit, in any order and with any number of threads.
///
/// It is ``Aligner(scans).align()``: make an ``Aligner`` to align the same scans again without reading them again, or to place some
/// by hand.
///
/// >>> aligned = surfrecon.align(scans)
/// >>> aligned.report.placed, aligned.report.messages
/// (6, [])
/// >>> result = surfrecon.merge(aligned.scans)
///
/// Args:
///     scans: a ``ScanSet``, or a list of ``Scan``, ``RangeImage``, ``PointCloud`` (with normals), ``Mesh``, ``(Mesh, world_from_mesh)`` or
///         ``(Mesh, world_from_mesh, name)``. At least two.
///     fixed: numbers of scans that stay where they are. Without any, the largest scan of the largest group stays.
///     picks: points that two scans show: ``Pick``, ``(a, b, point_a, point_b)`` or ``(a, b, point_a, point_b, weight)``, with the numbers
///         of the scans and the points in the scans' own frames. Three for a pair place it even where it may turn. With normals,
///         which ``Pick`` takes, two do.
///     trusted: pairs ``(a, b)`` of scans that touch: the motion that fits them best is used, even if it is not sure.
///     rejected: pairs that must not be compared.
///     axis: of a turntable: ``(point, direction)``, (3,) each, in the frame that all scans were taken in. The direction may have any
///         length but 0. Found where ``turntable`` says that there was one and it is not given.
///     angles: by how much the turntable was turned when each scan was taken: (n,) in radians, one a scan in the order given,
///         counter-clockwise where the axis points to the viewer. Either way round if the axis is not given.
#[doc = include_str!("params/align.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Options that are ``None`` take their defaults. Giving ``axis`` or ``angles`` means ``turntable="turned"``.
///
/// Returns:
///     An ``Alignment``: poses, the scans that were placed, ready for ``merge``, and a report.
///
/// Raises:
///     ParameterError: an option out of its range.
///     InputError, FormatError, FileError: fewer than two scans, one that can't be used or read, one that is scaled, a number that
///         is no scan's, arrays of another shape, other numbers than finite ones, another number of angles than scans.
///     TypeError: what is no scan, no pick or no number.
///     OutOfMemoryError: more scans than memory holds.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: align
#[pyo3(signature = (scans, *, fixed = None, picks = None, trusted = None, rejected = None, axis = None, angles = None, progress = None, **options), text_signature = "(scans, *, start='auto', reach=None, turntable='no', tolerance=None, min_overlap=0.03, use_colour=True, threads=0, fixed=None, picks=None, trusted=None, rejected=None, axis=None, angles=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn align(
    py: Python<'_>,
    scans: &Bound<'_, PyAny>,
    fixed: Option<&Bound<'_, PyAny>>,
    picks: Option<&Bound<'_, PyAny>>,
    trusted: Option<&Bound<'_, PyAny>>,
    rejected: Option<&Bound<'_, PyAny>>,
    axis: Option<&Bound<'_, PyAny>>,
    angles: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Alignment> {
    let call = AlignCall::new(options, || constraints(fixed, picks, trusted, rejected, axis, angles))?;
    let scans = call.scans(scans)?;
    Watch::new(progress).run_parts(py, |watch| {
        call.check(&scans)?;
        let ready = scans.run(&watch.span(0.0, READING))?;
        call.run(ready, &watch.span(READING, 1.0))
    })
}

/// Share of the time that reading the scans takes.
pub const READING: f64 = 0.3;

/// The request to align scans, free of Python.
pub struct AlignCall {
    params: AlignParams,
    constraints: Constraints,
}

impl AlignCall {
    /// Checks and takes the arguments of Python's `align` but the scans.
    ///
    /// # Errors
    /// `ParameterError`, `TypeError`, `InputError`.
    pub fn new(
        options: Option<&Bound<'_, PyDict>>,
        constraints: impl FnOnce() -> PyResult<Constraints>,
    ) -> PyResult<Self> {
        Ok(AlignCall { params: params("align", options)?, constraints: constraints()? })
    }

    /// Takes the scans.
    ///
    /// # Errors
    /// `TypeError`.
    pub fn scans(&self, scans: &Bound<'_, PyAny>) -> PyResult<ReadCall> {
        ReadCall::new(scans, self.params.threads)
    }

    /// Refuses what can't be asked of these scans, before they are read.
    ///
    /// # Errors
    /// See [`Constraints::validate`].
    pub fn check(&self, scans: &ReadCall) -> surfrecon::Result<()> {
        self.constraints.validate(scans.count())
    }

    /// Aligns.
    ///
    /// # Errors
    /// See [`surfrecon::align::Prepared::align`].
    pub fn run(&self, ready: Arc<Ready>, progress: &Progress<'_>) -> surfrecon::Result<Alignment> {
        let found = ready.prepared.align(&self.params, &self.constraints, progress)?;
        Ok(Alignment { ready, found, report: PyOnceLock::new() })
    }
}

/// The poses of scans in one frame, and how well they are known. It holds what was made ready of the scans, 1 to 2.5 MB each.
///
/// >>> aligned = surfrecon.align(scans)
/// >>> [pose is not None for pose in aligned.world_from_scan]
/// [True, True, True, True, True, True]
/// >>> aligned.write("aligned.conf")
#[pyclass(frozen, module = "surfrecon")]
pub struct Alignment {
    ready: Arc<Ready>,
    found: Core,
    report: PyOnceLock<Py<PyAny>>,
}

impl Alignment {
    /// The scans that have a pose, with it.
    fn placed(&self) -> impl Iterator<Item = (&Source, DAffine3)> {
        self.numbered().map(|(_, source, pose)| (source, pose))
    }

    /// The scans that have a pose, with their numbers and it.
    fn numbered(&self) -> impl Iterator<Item = (usize, &Source, DAffine3)> {
        let poses = self.ready.sources.iter().zip(&self.found.world_from_scan).enumerate();
        poses.filter_map(|(number, (source, pose))| pose.map(|pose| (number, source, pose)))
    }
}

#[pymethods]
impl Alignment {
    /// The pose of each scan, in the order given: 4 x 4 float64, or ``None`` for those that aren't placed.
    #[getter]
    fn world_from_scan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let poses = self.found.world_from_scan.iter().map(|pose| pose.as_ref().map(|pose| arrays::matrix(py, pose)));
        PyList::new(py, poses)
    }

    /// The scans that were placed, where they belong: what ``merge`` takes. In the order given. Those that aren't placed are left
    /// out.
    #[getter]
    fn scans<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let scans = self.placed().map(|(source, pose)| sources::placed(py, source, pose));
        PyList::new(py, scans.collect::<PyResult<Vec<_>>>()?)
    }

    /// The report: an ``AlignReport``, the same one whenever it is asked for.
    #[getter]
    fn report(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let made = || {
            let figures = report::of(py, &self.found.report)?;
            figures.set_item("summary", self.found.report.lines())?;
            Ok(figures.unbind())
        };
        self.report.get_or_try_init(py, made).map(|report| report.clone_ref(py))
    }

    /// The scans as they were made ready: to align them again, with more constraints, or to place by hand what is not placed.
    #[getter]
    fn aligner(&self) -> Aligner {
        Aligner::from(self.ready.clone())
    }

    /// How far a scan lies outside of the others' surfaces, along normals: what no rigid pose explains, such as warp and what moved. A
    /// mean over a few samples, nearly free of noise. Below 0 where the scan lies inside.
    ///
    /// >>> aligned = surfrecon.align(scans)
    /// >>> off = aligned.misfit(0)
    /// >>> off.shape == scans[0].read().valid.shape
    /// True
    ///
    /// Args:
    ///     scan: its number, counted from 0.
    ///     points: (n, 3) or (rows, cols, 3) real numbers in the scan's own frame. Default: all samples of the scan, which is read again if
    ///         it is on disk.
    ///     progress: as for ``align``.
    ///
    /// Returns:
    ///     float64 in the unit of the scans: (n,) or (rows, cols) like ``points``. Without them (rows, cols) for a range image, one a
    ///     vertex for a mesh, one a point for a cloud. NaN where no other scan is near, and where there is no sample. Time grows with
    ///     points and with scans.
    ///
    /// Raises:
    ///     InputError: no such scan, one that is not placed, or points of another shape.
    ///     FormatError, FileError: the scan can't be read again.
    ///     TypeError: points that aren't real numbers.
    ///     Cancelled: ``progress`` returned ``False``.
    #[pyo3(signature = (scan, points = None, *, progress = None, **others),
        text_signature = "($self, scan, points=None, *, progress=None)")]
    fn misfit<'py>(
        &self,
        py: Python<'py>,
        scan: &Bound<'py, PyAny>,
        points: Option<&Bound<'py, PyAny>>,
        progress: Option<Py<PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        no_others("Alignment.misfit", others)?;
        self.ready.misfit(py, scan, &self.found.world_from_scan, points, progress)
    }

    /// Writes where the files of the placed scans lie: ``.conf`` (VRIP), ``.mlp`` or ``.aln`` (MeshLab), or ``.tum`` (TUM's trajectory:
    /// a line a placed scan, and before it a comment that names the scan).
    ///
    /// Read them with ``surfrecon.open(path)``, with ``allow_outside=True`` where files lie outside of its folder. Read a ``.tum`` with its
    /// scans, in any order: ``surfrecon.open([*files, path])``. Scans that have no line are passed over.
    ///
    /// >>> surfrecon.align(scans).write("aligned.conf")
    /// >>> len(surfrecon.open("aligned.conf"))
    /// 6
    ///
    /// Args:
    ///     path: the list. Names in it are relative to its folder, absolute for files outside of it.
    ///
    /// Raises:
    ///     InputError: another ending, or a scan that is no file of its own. Of a ``.tum`` two scans that have the same name.
    ///     FileError: writing failed. No file is left, and one that was there is untouched.
    fn write(&self, py: Python<'_>, path: Place) -> PyResult<()> {
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("tum")) {
            let scans = self.numbered().map(|(number, source, pose)| scan_of(number, source, pose, &path));
            let placed: Vec<PlacedScan> = scans.collect::<PyResult<_>>()?;
            return py.detach(|| write_trajectory(&path, &placed)).map_err(|error| to_python(&error));
        }
        let files = self.placed().map(|(source, pose)| file_of(source, pose, &path));
        let placed: Vec<PlacedFile> = files.collect::<PyResult<_>>()?;
        py.detach(|| write_poses(&path, &placed)).map_err(|error| to_python(&error))
    }

    fn __repr__(&self) -> String {
        let report = &self.found.report;
        format!("<Alignment of {} scans, {} placed>", report.scans.len(), report.placed())
    }
}

/// A file as a list names it: relative to the list's folder, or absolute where it lies outside of that.
fn name_in(list: &Path, file: &Path) -> PathBuf {
    let absolute = |path: &Path| match MemoryFolder::of(path) {
        None => std::path::absolute(path).unwrap_or_else(|_| path.to_owned()),
        Some(_) => path.to_owned(),
    };
    let (list, file) = (absolute(list), absolute(file));
    let inside = list.parent().and_then(|folder| file.strip_prefix(folder).ok());
    inside.map_or_else(|| file.clone(), Path::to_owned)
}

/// The error of a scan that has another size than its file.
fn scaled(name: &str) -> PyErr {
    input_error(format!(
        "{name:?} has another size than its file, which a list of poses can't say: write it to a file with surfrecon.write() and align that"
    ))
}

/// A path as lists have it. On Windows alone a backslash separates folders: elsewhere names may have one.
fn with_slashes(path: &str) -> String {
    if cfg!(windows) { path.replace('\\', "/") } else { path.to_owned() }
}

/// A scan as a trajectory has it.
fn scan_of(number: usize, source: &Source, world_from_scan: DAffine3, list: &Path) -> PyResult<PlacedScan> {
    let (name, file) = match source {
        Source::Read(scan) if scan.scale() != 1.0 => return Err(scaled(&scan.name)),
        Source::Read(scan) => {
            let file = name_in(list, &scan.path);
            let is_found = MemoryFolder::of(&scan.path).is_none() || file != scan.path;
            // A name that is no text can't be written. The scan's own has to do.
            (scan.own_name().to_owned(), with_slashes(file.to_str().filter(|_| is_found).unwrap_or_default()))
        }
        other => (other.as_source().name().to_owned(), String::new()),
    };
    let name = if name.is_empty() { format!("scan {number}") } else { name };
    Ok(PlacedScan { name, file, number, world_from_scan })
}

/// A scan as a list of files has it.
fn file_of(source: &Source, world_from_file: DAffine3, list: &Path) -> PyResult<PlacedFile> {
    let file = match source {
        Source::Read(scan) if scan.scale() != 1.0 => return Err(scaled(&scan.name)),
        Source::Read(scan) if scan.is_depth_image() => {
            return Err(input_error(format!(
                "{:?} is a depth image, and a list of this kind does not say its camera. Write the poses as .tum, \
                    and open the images with it and the camera.",
                scan.name
            )));
        }
        Source::Read(scan) if scan.part == 0 => {
            let inside = name_in(list, &scan.path);
            if inside == scan.path && MemoryFolder::of(&scan.path).is_some() {
                return Err(input_error(format!(
                    "{:?} lies in memory, where only a list in its own folder finds it: write the list there, or the poses as .tum",
                    scan.name
                )));
            }
            let Some(inside) = inside.to_str() else {
                return Err(input_error(format!(
                    "{}: a list of poses is UTF-8, which this name is not: rename the file",
                    inside.display()
                )));
            };
            with_slashes(inside)
        }
        other => {
            return Err(input_error(format!(
                "{:?} is no file of its own, so that no list can place it. Write each scan to a file with \
                    surfrecon.write() and align the files, or write the poses as .tum.",
                other.as_source().name()
            )));
        }
    };
    Ok(PlacedFile { file, world_from_file })
}

/// Scans that are read once and aligned, drawn to others by hand or compared as often as wanted.
///
/// Of their samples nothing is kept in memory but what comes from the caller: 1 to 2.5 MB a scan. A result does not depend on calls before.
/// Calls may run at once, on several threads.
///
/// >>> aligner = surfrecon.Aligner(scans)
/// >>> first = aligner.align()
/// >>> second = aligner.align(rejected=[(0, 3)])  # scans are not read again
///
/// Args:
///     scans: as for ``align``. At least two. Changing them later changes nothing here.
///     threads: worker threads for reading and ``misfit``, 0 for one a core.
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Raises:
///     ParameterError: ``threads`` out of its range.
///     InputError, FormatError, FileError: fewer than two scans, one that can't be used or read, one that is scaled.
///     OutOfMemoryError: more scans than memory holds.
///     Cancelled: ``progress`` returned ``False``.
#[pyclass(frozen, module = "surfrecon")]
pub struct Aligner {
    ready: Arc<Ready>,
}

impl From<Arc<Ready>> for Aligner {
    fn from(ready: Arc<Ready>) -> Self {
        Aligner { ready }
    }
}

#[pymethods]
impl Aligner {
    #[new]
    // options: align only threads
    #[pyo3(signature = (scans, *, progress = None, **options), text_signature = "(scans, *, threads=0, progress=None)")]
    fn new(
        py: Python<'_>,
        scans: &Bound<'_, PyAny>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = ReadCall::with_options(scans, options)?;
        Watch::new(progress).run(py, |progress| call.run(progress)).map(Aligner::from)
    }

    /// Brings the scans to one frame. Arguments, result and errors as of ``surfrecon.align``.
    // options: $self align
    #[pyo3(signature = (*, fixed = None, picks = None, trusted = None, rejected = None, axis = None, angles = None, progress = None, **options), text_signature = "($self, *, start='auto', reach=None, turntable='no', tolerance=None, min_overlap=0.03, use_colour=True, threads=0, fixed=None, picks=None, trusted=None, rejected=None, axis=None, angles=None, progress=None)")]
    #[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn align(
        &self,
        py: Python<'_>,
        fixed: Option<&Bound<'_, PyAny>>,
        picks: Option<&Bound<'_, PyAny>>,
        trusted: Option<&Bound<'_, PyAny>>,
        rejected: Option<&Bound<'_, PyAny>>,
        axis: Option<&Bound<'_, PyAny>>,
        angles: Option<&Bound<'_, PyAny>>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Alignment> {
        let call = AlignCall::new(options, || constraints(fixed, picks, trusted, rejected, axis, angles))?;
        Watch::new(progress).run(py, |progress| call.run(self.ready.clone(), progress))
    }

    /// Draws one scan, from a rough pose, to the others, which stay: for placing by hand. Some tens of milliseconds, however many
    /// scans there are and however large they are.
    ///
    /// >>> aligner = surfrecon.Aligner(scans)
    /// >>> rough = scans[2].world_from_sensor + 0.5 * np.eye(4, k=3)  # half a millimetre off along x
    /// >>> aligner.snap(2, rough).state
    /// 'fits'
    ///
    /// Args:
    ///     scan: its number, counted from 0.
    ///     world_from_scan: 4 x 4, rigid: where it starts.
    ///     poses: where the others lie: a list of 4 x 4, rigid, one a scan, ``None`` for those that it must not be drawn to. The pose of
    ///         the scan itself does not count. Default: the poses that the scans have. ``alignment.world_from_scan`` fits.
    ///     reach: how far it is drawn, about, in the unit of the scans, > 0. Default: a tenth of its size.
    ///     tolerance, min_overlap, threads: as for ``align``.
    ///     progress: as for ``align``.
    ///
    /// Returns:
    ///     A ``Snap``: where it was drawn to, whether it fits there, and if not, why.
    ///
    /// Raises:
    ///     ParameterError: an option out of its range.
    ///     InputError: no such scan, another number of poses than scans, a pose that is no rigid 4 x 4 matrix.
    ///     Cancelled: ``progress`` returned ``False``.
    // options: $self align only reach tolerance min_overlap threads
    #[pyo3(signature = (scan, world_from_scan, *, poses = None, progress = None, **options), text_signature = "($self, scan, world_from_scan, *, reach=None, tolerance=None, min_overlap=0.03, threads=0, poses=None, progress=None)")]
    fn snap<'py>(
        &self,
        py: Python<'py>,
        scan: &Bound<'_, PyAny>,
        world_from_scan: &Bound<'_, PyAny>,
        poses: Option<&Bound<'_, PyAny>>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let params: AlignParams =
            params_only(&["reach", "tolerance", "min_overlap", "threads"], "Aligner.snap", options)?;
        let scan = self.ready.number(scan)?;
        let start = arrays::rigid(world_from_scan, "world_from_scan")?;
        let mut poses = self.ready.poses(poses)?;
        poses[scan] = Some(start);
        let call = |progress: &Progress<'_>| self.ready.prepared.snap(scan, &poses, &params, progress);
        report::of(py, &Watch::new(progress).run(py, call)?)
    }

    /// How far a scan lies outside of the others' surfaces, along normals, where the scans lie as ``poses`` says: what no rigid
    /// pose explains, such as warp and what moved. A mean over a few samples, nearly free of noise. Below 0 where the scan lies inside.
    ///
    /// Args:
    ///     scan: its number, counted from 0.
    ///     poses: a list of 4 x 4, rigid, one a scan, ``None`` for those that don't count. Default: the poses that the scans have.
    ///         ``Alignment.misfit`` takes those that were found.
    ///     points: (n, 3) or (rows, cols, 3) real numbers in the scan's own frame. Default: all samples of the scan, which is read again if
    ///         it is on disk.
    ///     progress: as for ``align``.
    ///
    /// Returns:
    ///     float64 in the unit of the scans: (n,) or (rows, cols) like ``points``. Without them (rows, cols) for a range image, one a
    ///     vertex for a mesh, one a point for a cloud. NaN where no other scan is near, and where there is no sample. Time grows with
    ///     points and with scans.
    ///
    /// Raises:
    ///     InputError: no such scan, or no pose of it, another number of poses than scans, a pose that is no rigid 4 x 4 matrix, points of
    ///         another shape.
    ///     FormatError, FileError: the scan can't be read again.
    ///     TypeError: points that aren't real numbers.
    ///     Cancelled: ``progress`` returned ``False``.
    #[pyo3(signature = (scan, poses = None, points = None, *, progress = None, **others),
        text_signature = "($self, scan, poses=None, points=None, *, progress=None)")]
    fn misfit<'py>(
        &self,
        py: Python<'py>,
        scan: &Bound<'py, PyAny>,
        poses: Option<&Bound<'py, PyAny>>,
        points: Option<&Bound<'py, PyAny>>,
        progress: Option<Py<PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        no_others("Aligner.misfit", others)?;
        let poses = self.ready.poses(poses)?;
        self.ready.misfit(py, scan, &poses, points, progress)
    }

    fn __len__(&self) -> usize {
        self.ready.sources.len()
    }

    fn __repr__(&self) -> String {
        format!("<Aligner of {} scans>", self.ready.sources.len())
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.align`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``align``, at once. InputError for arrays of another shape. Other errors are raised by
    ///         ``result``.
    #[staticmethod]
    // options: align
    #[pyo3(signature = (scans, *, fixed = None, picks = None, trusted = None, rejected = None, axis = None, angles = None, **options), text_signature = "(scans, *, start='auto', reach=None, turntable='no', tolerance=None, min_overlap=0.03, use_colour=True, threads=0, fixed=None, picks=None, trusted=None, rejected=None, axis=None, angles=None)")]
    #[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn align(
        scans: &Bound<'_, PyAny>,
        fixed: Option<&Bound<'_, PyAny>>,
        picks: Option<&Bound<'_, PyAny>>,
        trusted: Option<&Bound<'_, PyAny>>,
        rejected: Option<&Bound<'_, PyAny>>,
        axis: Option<&Bound<'_, PyAny>>,
        angles: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = AlignCall::new(options, || constraints(fixed, picks, trusted, rejected, axis, angles))?;
        let scans = call.scans(scans)?;
        Job::of(Background::start_calls(&[READING, 1.0 - READING], move |calls| {
            call.check(&scans)?;
            let ready = scans.run(calls.begin(0))?;
            made_class(call.run(ready, calls.begin(1))?)
        }))
    }

    /// Starts ``surfrecon.Aligner`` with the same arguments but ``progress``: the result is one.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``Aligner``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: align only threads
    #[pyo3(signature = (scans, **options), text_signature = "(scans, *, threads=0)")]
    fn aligner(scans: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = ReadCall::with_options(scans, options)?;
        Job::of(Background::start(move |progress| made_class(Aligner::from(call.run(progress)?))))
    }
}
