//! Scans without poses to one frame.

use std::path::PathBuf;

use glam::{DAffine3, DVec3};
use numpy::PyArray2;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use surfrecon::align::{AlignParams, Alignment as Core, Constraints, Pick};
use surfrecon::export::{PlacedFile, write_poses};
use surfrecon::{Progress, align as core};

use crate::arrays;
use crate::errors::{input_error, to_python};
use crate::params::params;
use crate::progress::Watch;
use crate::sources::{Clouds, Source, as_dyn, sources};

/// Brings scans to one frame: finds where each lies from what overlaps, in any order and from any poses.
///
/// A scan is placed only if it overlaps another, is held against turning and sliding, and fits in one place alone; what is not
/// placed is left out, with the reason in words. Lines of sight of range images count as evidence: no scan is put where
/// another's sensor saw through. The same scans give the same poses to the bit, in any order and with any number of threads.
///
/// Args:
///     scans: a ``ScanSet``, or a list of ``Scan``, ``RangeImage``, ``PointCloud`` (with normals), ``Mesh``, ``(Mesh, world_from_mesh)`` or
///         ``(Mesh, world_from_mesh, name)``; at least two.
///     fixed: numbers of scans that stay where they are. Without any, the largest scan of the largest group stays.
///     picks: points that two scans show: ``(a, b, point_a, point_b)`` or ``(a, b, point_a, point_b, weight)``, with the numbers of the
///         scans and the points in the scans' own frames. Three for a pair place it even where it may turn.
///     trusted: pairs ``(a, b)`` of scans that touch: what fits them best is used, even if it is not sure.
///     rejected: pairs that must not be compared.
#[doc = include_str!("params/align.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread; ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     An ``Alignment``: poses, the scans that were placed, ready for ``merge``, and a report.
///
/// Raises:
///     ParameterError: an option out of its range.
///     InputError, FormatError, FileError: fewer than two scans, one that can't be used or read, one that is scaled, a number that
///         is no scan's.
///     OutOfMemoryError: more scans than memory holds.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: align
#[pyo3(signature = (scans, *, fixed = None, picks = None, trusted = None, rejected = None, progress = None, **options), text_signature = "(scans, *, start='unknown', reach=None, tolerance=None, min_overlap=0.03, threads=0, fixed=None, picks=None, trusted=None, rejected=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn align(
    py: Python<'_>,
    scans: &Bound<'_, PyAny>,
    fixed: Option<Vec<usize>>,
    picks: Option<Vec<Bound<'_, PyAny>>>,
    trusted: Option<Vec<[usize; 2]>>,
    rejected: Option<Vec<[usize; 2]>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Alignment> {
    let call = AlignCall::new(scans, fixed, picks, trusted, rejected, options)?;
    let found = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Ok(Alignment { sources: call.sources, found })
}

/// An alignment with all it needs, free of Python.
pub struct AlignCall {
    sources: Vec<Source>,
    params: AlignParams,
    constraints: Constraints,
}

impl AlignCall {
    /// Checks and takes the arguments of Python's `align`.
    ///
    /// # Errors
    /// `ParameterError`, `TypeError`, `InputError`.
    pub fn new(
        scans: &Bound<'_, PyAny>,
        fixed: Option<Vec<usize>>,
        picks: Option<Vec<Bound<'_, PyAny>>>,
        trusted: Option<Vec<[usize; 2]>>,
        rejected: Option<Vec<[usize; 2]>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let params = params("align", options)?;
        let picks =
            picks.iter().flatten().enumerate().map(|(number, pick)| picked(number, pick)).collect::<PyResult<_>>()?;
        let constraints = Constraints {
            fixed: fixed.unwrap_or_default(),
            picks,
            trusted: trusted.unwrap_or_default(),
            rejected: rejected.unwrap_or_default(),
        };
        Ok(AlignCall { sources: sources(scans, Clouds::Taken)?, params, constraints })
    }

    /// Aligns.
    ///
    /// # Errors
    /// See [`surfrecon::align::run`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        core::run(&as_dyn(&self.sources), &self.params, &self.constraints, progress)
    }

    /// The result for Python.
    pub fn finish(self, found: Core) -> Alignment {
        Alignment { sources: self.sources, found }
    }
}

fn picked(number: usize, pick: &Bound<'_, PyAny>) -> PyResult<Pick> {
    type WithWeight<'py> = (usize, usize, Bound<'py, PyAny>, Bound<'py, PyAny>, f64);
    let (a, b, point_a, point_b, weight): WithWeight<'_> = pick
        .extract()
        .or_else(|_| pick.extract().map(|(a, b, point_a, point_b)| (a, b, point_a, point_b, 1.0)))
        .map_err(|_| {
            PyTypeError::new_err(format!(
                "pick {number} must be (a, b, point_a, point_b) or (a, b, point_a, point_b, weight), got {pick}"
            ))
        })?;
    let point = |value: &Bound<'_, PyAny>, of: &str| -> PyResult<DVec3> {
        let (entries, _) = arrays::floats(value, &format!("{of} of pick {number}"), &[Some(3)])?;
        Ok(DVec3::from_slice(&entries))
    };
    let points = [point(&point_a, "point_a")?, point(&point_b, "point_b")?];
    Ok(Pick { scans: [a, b], points, normals: None, weight })
}

/// Where scans lie in one frame, and how well that is known.
#[pyclass(frozen, module = "surfrecon")]
pub struct Alignment {
    sources: Vec<Source>,
    found: Core,
}

#[pymethods]
impl Alignment {
    /// The pose of each scan, in the order given: 4 x 4 float64, or ``None`` for those that aren't placed.
    #[getter]
    fn world_from_scan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let poses = self.found.world_from_scan.iter().map(|pose| pose.as_ref().map(|pose| arrays::matrix(py, pose)));
        PyList::new(py, poses)
    }

    /// The scans that were placed, where they belong: what ``merge`` takes. In the order given; those that aren't placed are left
    /// out.
    #[getter]
    fn scans<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let placed = self.sources.iter().zip(&self.found.world_from_scan);
        let scans = placed.filter_map(|(source, pose)| pose.map(|pose| source.placed(py, pose)));
        PyList::new(py, scans.collect::<PyResult<Vec<_>>>()?)
    }

    /// What was found.
    #[getter]
    fn report(&self) -> AlignReport {
        AlignReport { report: self.found.report.clone() }
    }

    /// Writes where the files of the placed scans lie: ``.conf`` (VRIP), ``.mlp`` or ``.aln`` (MeshLab), or ``.tum`` (TUM's trajectory,
    /// without names: a line a placed scan).
    ///
    /// Args:
    ///     path: the list; names in it are relative to its folder.
    ///
    /// Raises:
    ///     InputError: another ending, or a scan that is no file of its own.
    ///     FileError: writing failed; no file is left, and one that was there is untouched.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let is_list = path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("tum"));
        let placed = self.sources.iter().zip(&self.found.world_from_scan);
        let placed: Vec<PlacedFile> = placed
            .filter_map(|(source, pose)| pose.map(|pose| file_of(source, pose, &path, is_list)))
            .collect::<PyResult<_>>()?;
        py.detach(|| write_poses(&path, &placed)).map_err(|error| to_python(&error))
    }

    fn __repr__(&self) -> String {
        let report = &self.found.report;
        format!("<Alignment of {} scans, {} placed>", report.scans.len(), report.placed())
    }
}

fn file_of(source: &Source, world_from_file: DAffine3, list: &std::path::Path, is_list: bool) -> PyResult<PlacedFile> {
    use surfrecon::merge::ScanSource as _;
    let file = match source {
        Source::File(scan) if scan.part == 0 => {
            let folder = list.parent().unwrap_or(std::path::Path::new(""));
            let inside = scan.path.strip_prefix(folder).unwrap_or(&scan.path);
            inside.to_string_lossy().replace('\\', "/")
        }
        other if !is_list => other.name().to_owned(),
        other => {
            return Err(input_error(format!(
                "{:?} is no file of its own, so that no list can place it: write the scans with surfrecon.write(), or the poses as .tum",
                other.name()
            )));
        }
    };
    Ok(PlacedFile { file, world_from_file })
}

/// What was found by ``align``: each scan, each pair, and what the user should know. Lengths in the unit of the scans.
#[pyclass(frozen, module = "surfrecon")]
pub struct AlignReport {
    report: core::AlignReport,
}

#[pymethods]
impl AlignReport {
    /// Each scan, in the order given.
    #[getter]
    fn scans(&self) -> Vec<AlignedScan> {
        self.report.scans.iter().map(|scan| AlignedScan { scan: scan.clone() }).collect()
    }

    /// The pairs of scans of which anything was found.
    #[getter]
    fn pairs(&self) -> Vec<AlignedPair> {
        self.report.pairs.iter().map(|pair| AlignedPair { pair: pair.clone() }).collect()
    }

    /// Numbers of the scans that are joined, a list a group; the first is the one that is placed.
    #[getter]
    fn groups(&self) -> Vec<Vec<usize>> {
        self.report.groups.clone()
    }

    /// Scans that have a pose.
    #[getter]
    fn placed(&self) -> usize {
        self.report.placed()
    }

    /// Pairs that were compared.
    #[getter]
    fn compared(&self) -> usize {
        self.report.compared
    }

    /// Root mean square distance of the surfaces of all pairs that touch, along normals; ``None`` where none do.
    #[getter]
    fn residual(&self) -> Option<f64> {
        self.report.residual
    }

    /// What the user should know, a sentence each.
    #[getter]
    fn messages(&self) -> Vec<String> {
        self.report.messages.clone()
    }

    fn __str__(&self) -> String {
        self.report.lines().join("\n")
    }

    fn __repr__(&self) -> String {
        format!("<AlignReport: {}>", self.report.lines()[0])
    }
}

/// What was found of a scan.
#[pyclass(frozen, module = "surfrecon")]
pub struct AlignedScan {
    scan: core::AlignedScan,
}

#[pymethods]
impl AlignedScan {
    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.scan.name
    }

    /// ``"placed"``, ``"kept"`` (its pose is as given), ``"apart"`` (joined with others, but these with nothing) or ``"unplaced"``.
    #[getter]
    fn state(&self) -> &'static str {
        self.scan.state.name()
    }

    /// Why it is not placed, and what to do; empty if it is.
    #[getter]
    fn reason(&self) -> &str {
        &self.scan.reason
    }

    /// Number of its group: 0 is the one that is placed; ``None`` if it is in none.
    #[getter]
    fn group(&self) -> Option<usize> {
        self.scan.group
    }

    /// 4 x 4 float64, its pose in its group, or ``None``. Scans of a group that is not placed lie together where the largest of
    /// them was given.
    #[getter]
    fn world_from_scan<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.scan.world_from_scan.as_ref().map(|pose| arrays::matrix(py, pose))
    }

    /// 6 x 6 float64: covariance of a small motion of it in the world, a turn about ``middle`` (radians), then a shift. Zero for
    /// scans that are kept.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows: Vec<Vec<f64>> = self.scan.covariance.iter().map(|row| row.to_vec()).collect();
        Ok(PyArray2::from_vec2(py, &rows).expect("rows of equal length").into_any())
    }

    /// The middle of its points, in the world.
    #[getter]
    fn middle(&self) -> [f64; 3] {
        self.scan.middle.to_array()
    }

    /// One standard deviation of the place of its points, where it is largest.
    #[getter]
    fn deviation(&self) -> f64 {
        self.scan.deviation
    }

    /// Ways that nothing holds it: ``("turn" or "slide", direction, point of the axis)``.
    #[getter]
    fn free(&self) -> Vec<Free> {
        self.scan.free.iter().map(free).collect()
    }

    /// Share of its surface that lies on the scan that shares most with it.
    #[getter]
    fn overlap(&self) -> f64 {
        self.scan.overlap
    }

    /// Root mean square distance to the surfaces of others, along normals.
    #[getter]
    fn residual(&self) -> f64 {
        self.scan.residual
    }

    /// Median distance of its samples.
    #[getter]
    fn spacing(&self) -> f64 {
        self.scan.spacing
    }

    fn __repr__(&self) -> String {
        let reason = if self.scan.reason.is_empty() { String::new() } else { format!(": {}", self.scan.reason) };
        format!("<AlignedScan {:?} {}{reason}>", self.scan.name, self.state())
    }
}

type Free = (&'static str, [f64; 3], [f64; 3]);

fn free(freedom: &core::Freedom) -> Free {
    (if freedom.turns { "turn" } else { "slide" }, freedom.direction.to_array(), freedom.point.to_array())
}

/// What was found of two scans.
#[pyclass(frozen, module = "surfrecon")]
pub struct AlignedPair {
    pair: core::AlignedPair,
}

#[pymethods]
impl AlignedPair {
    /// Their numbers, the smaller first.
    #[getter]
    fn scans(&self) -> (usize, usize) {
        self.pair.scans.into()
    }

    /// ``"fits"``, ``"misfit"`` (they overlap, but further apart than noise explains), or why the pair was not used: ``"slides"``,
    /// ``"ambiguous"``, ``"background"``, ``"seen_through"``, ``"disagrees"``, ``"rejected"``.
    #[getter]
    fn state(&self) -> &'static str {
        self.pair.state.name()
    }

    /// Share of either surface that lies on the other.
    #[getter]
    fn overlap(&self) -> (f64, f64) {
        self.pair.overlap.into()
    }

    /// Root mean square distance of the surfaces where they touch, along normals.
    #[getter]
    fn residual(&self) -> f64 {
        self.pair.residual
    }

    /// How well it is held against turning and sliding: 1 at best, 0 where it may.
    #[getter]
    fn balance(&self) -> f64 {
        self.pair.balance
    }

    /// Of what the sensors can tell, the share that speaks against it.
    #[getter]
    fn seen_through(&self) -> f64 {
        self.pair.seen_through
    }

    /// Places in which one fits the other.
    #[getter]
    fn places(&self) -> usize {
        self.pair.places
    }

    /// Ways that it may turn or slide: ``("turn" or "slide", direction, point of the axis)``.
    #[getter]
    fn free(&self) -> Vec<Free> {
        self.pair.free.iter().map(free).collect()
    }

    fn __repr__(&self) -> String {
        let [a, b] = self.pair.scans;
        format!("<AlignedPair {a}, {b} {}>", self.state())
    }
}
