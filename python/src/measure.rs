//! Distances of points, and of a whole surface, to a mesh.

use std::sync::Arc;

use glam::DVec3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::mesh::Crs;
use surfrecon::mesh::certify::{Certified, certify};
use surfrecon::mesh::measure::{self, Side};
use surfrecon::triangulate::TriangulateParams;
use surfrecon::{Progress, TriMesh};

use crate::arrays;
use crate::background::{Background, made};
use crate::crs::{CrsText, crs_of};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::{self, no_others};
use crate::progress::Watch;
use crate::report;
use crate::sources::{Clouds, Source, as_dyn, sources};

/// Exact distances of points to the nearest points of a mesh, or of scans.
///
/// >>> floor = surfrecon.Mesh([(0, 0, 0), (9, 0, 0), (0, 9, 0)], [(0, 1, 2)])
/// >>> surfrecon.distances([(1, 1, 2), (1, 1, -3)], floor, signed=True)
/// array([ 2., -3.])
/// >>> samples = image.world_points()[image.valid]
/// >>> off = surfrecon.distances(samples, scans[1:])  # of one scan from the others
///
/// Args:
///     points: (n, 3) real numbers.
///     mesh: the surface, or scans as ``merge`` takes them, with the points in the world.
///     signed: whether distances behind the surface are negative. Right wherever the mesh is closed.
///     crs: the coordinate reference system that the points are in, if that is known.
///     threads: worker threads, 0 for one a core. The result is the same for any number.
///     progress: called as ``progress(stage, fraction)``. ``False`` cancels. Ctrl-C cancels as well.
///
/// Returns:
///     (n,) float64, in the unit of the points.
///
/// Raises:
///     InputError: a mesh without triangles, a point that isn't finite, points and mesh, or scans, of different systems, or in
///         degrees.
///     FormatError, FileError: a scan that can't be read.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
#[pyo3(signature = (points, mesh, *, signed = false, crs = None, threads = None, progress = None, **others),
    text_signature = "(points, mesh, *, signed=False, crs=None, threads=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn distances<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    mesh: &Bound<'py, PyAny>,
    signed: bool,
    crs: Option<CrsText>,
    threads: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    no_others("distances", others)?;
    let call = DistanceCall::new(points, mesh, signed, crs, threads)?;
    let distances = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Ok(PyArray1::from_vec(py, distances))
}

/// A measurement with all it needs, free of Python.
pub struct DistanceCall {
    points: Vec<DVec3>,
    crs: Option<Crs>,
    reference: Reference,
    side: Side,
    threads: usize,
}

/// The surface that distances are measured to.
enum Reference {
    Mesh(Arc<TriMesh>),
    Scans(Vec<Source>),
}

impl DistanceCall {
    /// Checks and takes the arguments of Python's `distances`.
    ///
    /// # Errors
    /// `ParameterError`, `InputError`, `TypeError`.
    pub fn new(
        points: &Bound<'_, PyAny>,
        mesh: &Bound<'_, PyAny>,
        signed: bool,
        crs: Option<CrsText>,
        threads: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let crs = crs_of(crs)?;
        let (coordinates, _) = arrays::floats(points, "points", &[None, Some(3)])?;
        let reference = match mesh.cast::<Mesh>() {
            Ok(mesh) => Reference::Mesh(mesh.get().mesh.clone()),
            Err(_) => Reference::Scans(sources(mesh, Clouds::Refused)?),
        };
        let side = if signed { Side::Signed } else { Side::Ignored };
        let threads = params::threads(threads)?;
        Ok(DistanceCall { points: arrays::vectors(coordinates), crs, reference, side, threads })
    }

    /// Runs it.
    ///
    /// # Errors
    /// See [`measure::deviation`] and [`surfrecon::merge::deviation`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Vec<f64>> {
        let DistanceCall { points, crs, reference, side, threads } = self;
        let of_reference = match reference {
            Reference::Mesh(mesh) => mesh.crs.clone(),
            Reference::Scans(scans) => surfrecon::merge::common_crs(&as_dyn(scans))?,
        };
        let name = if matches!(reference, Reference::Mesh(_)) { "the mesh" } else { "what they are measured against" };
        Crs::common([("the points", crs.clone()), (name, of_reference)])?;
        let found = match reference {
            Reference::Mesh(mesh) => measure::deviation(points, mesh, *side, *threads, progress)?,
            Reference::Scans(scans) => {
                let triangulation = TriangulateParams::default();
                surfrecon::merge::deviation(points, &as_dyn(scans), &triangulation, *side, *threads, progress)?
            }
        };
        Ok(found.distances)
    }
}

/// For each point the triangle of a mesh that is nearest, of several as near the one of the smallest index.
///
/// >>> steps = surfrecon.Mesh([(0, 0, 0), (9, 0, 0), (0, 9, 0), (9, 9, 0)], [(0, 1, 2), (1, 3, 2)])
/// >>> surfrecon.nearest_triangles([(1, 1, 2), (8, 8, 2)], steps)
/// array([0, 1], dtype=uint32)
///
/// Args:
///     points: (n, 3) real numbers.
///     mesh: the surface.
///     threads: worker threads, 0 for one a core. The result is the same for any number.
///     progress: called as ``progress(stage, fraction)``. ``False`` cancels. Ctrl-C cancels as well.
///
/// Returns:
///     (n,) uint32, indices into ``mesh.triangles``.
///
/// Raises:
///     InputError: a mesh without triangles, a point that isn't finite.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
#[pyo3(signature = (points, mesh, *, threads = None, progress = None, **others),
    text_signature = "(points, mesh, *, threads=None, progress=None)")]
pub fn nearest_triangles<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    mesh: &Mesh,
    threads: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyArray1<u32>>> {
    no_others("nearest_triangles", others)?;
    let (coordinates, _) = arrays::floats(points, "points", &[None, Some(3)])?;
    let (points, mesh) = (arrays::vectors(coordinates), mesh.mesh.clone());
    let threads = params::threads(threads)?;
    let found =
        Watch::new(progress).run(py, move |progress| measure::nearest_triangles(&points, &mesh, threads, progress))?;
    Ok(PyArray1::from_vec(py, found))
}

/// Distance of a whole surface to another, with a bound that holds between the vertices too.
///
/// >>> coarse = surfrecon.cluster(mesh, vertices=500).mesh
/// >>> report = surfrecon.surface_distance(coarse, mesh)
/// >>> report.reached <= report.bound
/// True
///
/// Args:
///     mesh: the surface that is measured.
///     reference: the surface it is measured against, in the same frame.
///     signed: whether distances behind the reference are negative. Right wherever it is closed.
///     threads: worker threads, 0 for one a core. The result is the same for any number.
///     progress: called as ``progress(stage, fraction)``. ``False`` cancels. Ctrl-C cancels as well.
///
/// Returns:
///     A ``DistanceReport``. No point of ``mesh`` exceeds its ``bound``, which is within 1 % of ``reached``, or a millionth of the
///     reference's extent above it, unless that takes more than 8 measurements a vertex and 100,000.
///
/// Raises:
///     InputError: a reference without triangles, meshes of different coordinate reference systems, or in degrees.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
#[pyo3(signature = (mesh, reference, *, signed = false, threads = None, progress = None, **others),
    text_signature = "(mesh, reference, *, signed=False, threads=None, progress=None)")]
pub fn surface_distance<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    reference: &Mesh,
    signed: bool,
    threads: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    no_others("surface_distance", others)?;
    let call = SurfaceDistanceCall::new(mesh, reference, signed, threads)?;
    distance_report(py, Watch::new(progress).run(py, |progress| call.run(progress))?)
}

/// The report that `surface_distance` returns.
///
/// # Errors
/// None but of Python itself.
pub fn distance_report(py: Python<'_>, found: Certified) -> PyResult<Bound<'_, PyAny>> {
    let figures = report::of(py, &found.report())?;
    figures.set_item("distances", PyArray1::from_vec(py, found.vertices.distances))?;
    Ok(figures)
}

/// A measurement of a surface with all it needs, free of Python.
pub struct SurfaceDistanceCall {
    mesh: Arc<TriMesh>,
    reference: Arc<TriMesh>,
    side: Side,
    threads: usize,
}

impl SurfaceDistanceCall {
    /// Checks and takes the arguments of Python's `surface_distance`.
    ///
    /// # Errors
    /// `ParameterError`.
    pub fn new(mesh: &Mesh, reference: &Mesh, signed: bool, threads: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let side = if signed { Side::Signed } else { Side::Ignored };
        let threads = params::threads(threads)?;
        Ok(SurfaceDistanceCall { mesh: mesh.mesh.clone(), reference: reference.mesh.clone(), side, threads })
    }

    /// Runs it.
    ///
    /// # Errors
    /// See [`certify`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Certified> {
        certify(&self.mesh, &self.reference, self.side, self.threads, progress)
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.distances`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     InputError, TypeError: like ``distances``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    #[pyo3(signature = (points, mesh, *, signed = false, crs = None, threads = None, **others),
        text_signature = "(points, mesh, *, signed=False, crs=None, threads=None)")]
    fn distances(
        points: &Bound<'_, PyAny>,
        mesh: &Bound<'_, PyAny>,
        signed: bool,
        crs: Option<CrsText>,
        threads: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Job.distances", others)?;
        let call = DistanceCall::new(points, mesh, signed, crs, threads)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, distances| Ok(PyArray1::from_vec(py, distances).into_any()))
        }))
    }

    /// Starts ``surfrecon.surface_distance`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError: like ``surface_distance``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    #[pyo3(signature = (mesh, reference, *, signed = false, threads = None, **others),
        text_signature = "(mesh, reference, *, signed=False, threads=None)")]
    fn surface_distance(
        mesh: &Mesh,
        reference: &Mesh,
        signed: bool,
        threads: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Job.surface_distance", others)?;
        let call = SurfaceDistanceCall::new(mesh, reference, signed, threads)?;
        Job::of(Background::start(move |progress| made(call.run(progress)?, distance_report)))
    }
}
