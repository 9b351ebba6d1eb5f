//! Clustering: a dense mesh, or points, to a coarse mesh of well-shaped triangles.

use std::sync::Arc;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use surfrecon::cluster::{ClusterParams, Clustered as Core, Resolution};
use surfrecon::params::{Params as _, Value, find};
use surfrecon::{PointCloud, Progress, TriMesh};

use crate::background::{Background, made};
use crate::errors::{input_error, to_python};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::{params, params_but, whole};
use crate::progress::Watch;
use crate::range_image::RangeImage;
use crate::reconstruct::cloud_of;
use crate::report;

/// Replaces a dense mesh by a coarse one of well-shaped triangles on the same surface, or makes one of points.
///
/// Components, boundaries and genus stay. Vertices lie on the mesh, those of boundaries on its boundaries. The attributes of
/// vertices ride along. Options that are ``None`` take their defaults.
///
/// >>> coarse = surfrecon.cluster(mesh, vertices=500)
/// >>> len(coarse.mesh.positions)
/// 500
/// >>> near = surfrecon.cluster(mesh, max_error=0.05)
///
/// Args:
///     mesh: the dense mesh. Edges of more than two triangles, or of two that turn against each other, are cut. Or points: a
///         ``PointCloud``, or (n, 3) real numbers. The surface through them, as ``reconstruct`` makes it, is clustered.
#[doc = include_str!("params/cluster.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``Clustered`` with the mesh, the patches and a report.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: two of vertices, patches, max_error and triangles given, a mesh without triangles, or points without a surface.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: cluster
#[pyo3(signature = (mesh, *, progress = None, **options), text_signature = "(mesh, *, vertices=None, patches=None, max_error=None, triangles=None, adaptivity=1.0, iterations=40, relaxation=50, fitting=0, min_angle=0.0, feature_angle=0.6981317007977318, seed=0, threads=0, progress=None)")]
pub fn cluster(
    py: Python<'_>,
    mesh: &Bound<'_, PyAny>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Clustered> {
    let params: ClusterParams = params("cluster", options)?;
    let call = ClusterCall { dense: Dense::of(mesh)?, levels: vec![params.resolution], chain: false, params };
    let mut made = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Clustered::new(py, made.remove(0))
}

/// The input that is clustered.
enum Dense {
    Mesh(Arc<TriMesh>),
    Points(Arc<PointCloud>),
}

impl Dense {
    /// A mesh, or what [`cloud_of`] takes.
    fn of(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        if given.is_instance_of::<RangeImage>() {
            return Err(PyTypeError::new_err(
                "mesh must be a Mesh, a PointCloud or (n, 3) real numbers, got a RangeImage: give its .triangulate(), or its .to_cloud()",
            ));
        }
        match given.cast::<Mesh>() {
            Ok(mesh) => Ok(Dense::Mesh(mesh.get().mesh.clone())),
            Err(_) => Ok(Dense::Points(cloud_of(given)?)),
        }
    }
}

/// A call whose arguments are checked, to be run on any thread.
pub struct ClusterCall {
    dense: Dense,
    levels: Vec<Resolution>,
    /// Whether a list is wanted, be it of one.
    pub chain: bool,
    params: ClusterParams,
}

impl ClusterCall {
    /// Checks and takes the arguments of `Job.cluster`.
    pub fn new(
        mesh: &Bound<'_, PyAny>,
        levels: Option<Vec<Bound<'_, PyAny>>>,
        levels_of: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let params: ClusterParams = params("cluster", options)?;
        if levels.is_some() && params.resolution != Resolution::Tenth {
            return Err(input_error("levels must go without vertices, patches, max_error and triangles".to_owned()));
        }
        let chain = levels.is_some();
        let levels = match levels {
            Some(levels) => chain_of(&levels, levels_of)?,
            None => vec![params.resolution],
        };
        Ok(ClusterCall { dense: Dense::of(mesh)?, levels, chain, params })
    }

    /// Runs it.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Vec<Core>> {
        match &self.dense {
            Dense::Mesh(mesh) => surfrecon::cluster::levels(mesh, &self.levels, &self.params, progress),
            Dense::Points(cloud) => surfrecon::cluster::levels_of_points(cloud, &self.levels, &self.params, progress),
        }
    }
}

/// Resolutions of so many vertices, or triangles, each.
fn chain_of(counts: &[Bound<'_, PyAny>], levels_of: Option<&str>) -> PyResult<Vec<Resolution>> {
    let levels_of = levels_of.unwrap_or("vertices");
    if !["vertices", "triangles"].contains(&levels_of) {
        return Err(input_error(format!("levels_of must be \"vertices\" or \"triangles\", got {levels_of:?}")));
    }
    let row = find("cluster", levels_of).expect("the parameter is in the table");
    let level = |count: &Bound<'_, PyAny>| {
        let mut level = Resolution::Tenth;
        level.set(row.name, Value::Number(whole(row, count)?)).map_err(|e| to_python(&e))?;
        Ok(level)
    };
    counts.iter().map(level).collect()
}

/// A chain of levels of detail from one run: finer levels go on splitting the patches of coarser ones.
///
/// >>> fine, coarse = surfrecon.cluster_levels(mesh, [1000, 100])
/// >>> fine.mesh.write("levels.glb", coarser=[coarse.mesh])
///
/// Args:
///     mesh: the dense mesh, or points, as for ``cluster``.
///     vertices: vertices of each level, or triangles.
///     levels_of: what the levels are counted in, ``"vertices"`` or ``"triangles"``. Default: vertices.
///     adaptivity, iterations, relaxation, fitting, seed, threads, progress: as for ``cluster``.
///
/// Returns:
///     A list of ``Clustered``, one a level, in the order of ``vertices``. ``finest.mesh.write("x.glb", coarser=[...])``
///     writes a chain as glTF with levels of detail.
///
/// Raises:
///     ParameterError, InputError, Cancelled: as ``cluster``.
#[pyfunction]
// options: cluster but vertices patches max_error triangles
#[pyo3(signature = (mesh, vertices, *, levels_of = None, progress = None, **options), text_signature = "(mesh, vertices, *, adaptivity=1.0, iterations=40, relaxation=50, fitting=0, min_angle=0.0, feature_angle=0.6981317007977318, seed=0, threads=0, levels_of=None, progress=None)")]
pub fn cluster_levels(
    py: Python<'_>,
    mesh: &Bound<'_, PyAny>,
    vertices: Vec<Bound<'_, PyAny>>,
    levels_of: Option<&str>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<Clustered>> {
    let params = params_but(&["vertices", "patches", "max_error", "triangles"], "cluster_levels", options)?;
    let call = ClusterCall { dense: Dense::of(mesh)?, levels: chain_of(&vertices, levels_of)?, chain: true, params };
    let made = Watch::new(progress).run(py, |progress| call.run(progress))?;
    made.into_iter().map(|made| Clustered::new(py, made)).collect()
}

/// A clustered mesh with its patches and figures.
///
/// >>> coarse = surfrecon.cluster(mesh, patches=100)
/// >>> len(coarse.labels) == len(mesh.positions), int(coarse.labels.max())
/// (True, 99)
#[pyclass(frozen, module = "surfrecon")]
pub struct Clustered {
    /// The surface, with the vertex attributes of the input.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    core: Core,
}

impl Clustered {
    /// With the mesh as an object of Python.
    pub fn new(py: Python<'_>, mut core: Core) -> PyResult<Self> {
        let mesh = Py::new(py, Mesh::from(std::mem::take(&mut core.mesh)))?;
        Ok(Clustered { mesh, core })
    }
}

/// One level, or a chain of them as a list.
pub fn clustered(py: Python<'_>, levels: Vec<Core>, chain: bool) -> PyResult<Bound<'_, PyAny>> {
    let levels: Vec<_> =
        levels.into_iter().map(|level| Bound::new(py, Clustered::new(py, level)?)).collect::<PyResult<_>>()?;
    if chain {
        return Ok(PyList::new(py, levels)?.into_any());
    }
    Ok(levels.into_iter().next().expect("one level was asked for").into_any())
}

#[pymethods]
impl Clustered {
    /// (n,) int32: patch of each vertex or point of the input, -1 for one that no triangle uses. Newly copied.
    #[getter]
    fn labels<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        numpy::PyArray1::from_slice(py, &self.core.labels).into_any()
    }

    /// Figures of the run: a ``ClusterReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.core.report)
    }

    fn __repr__(&self) -> String {
        let report = &self.core.report;
        let angle = report.after.mean_smallest_angle.to_degrees();
        let (vertices, triangles, error) = (report.vertices, report.triangles, report.max_error);
        format!(
            "<Clustered {vertices} vertices, {triangles} triangles, at most {error:.4} off, mean smallest angle {angle:.1} degrees>"
        )
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.cluster`` with the same arguments but ``progress``. With ``levels``, a list of numbers of vertices, or
    /// of triangles by ``levels_of``, ``surfrecon.cluster_levels``, whose list is the result.
    ///
    /// Raises:
    ///     ParameterError, InputError: like ``cluster``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: cluster
    #[pyo3(signature = (mesh, *, levels = None, levels_of = None, **options), text_signature = "(mesh, *, vertices=None, patches=None, max_error=None, triangles=None, adaptivity=1.0, iterations=40, relaxation=50, fitting=0, min_angle=0.0, feature_angle=0.6981317007977318, seed=0, threads=0, levels=None, levels_of=None)")]
    fn cluster(
        mesh: &Bound<'_, PyAny>,
        levels: Option<Vec<Bound<'_, PyAny>>>,
        levels_of: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = ClusterCall::new(mesh, levels, levels_of, options)?;
        let chain = call.chain;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, move |py, levels| clustered(py, levels, chain))
        }))
    }
}
