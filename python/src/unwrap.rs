//! Meshes with texture coordinates.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::error::counted;
use surfrecon::unwrap::{UnwrapParams, UnwrapReport, Unwrapped as Core};
use surfrecon::{Progress, TriMesh};

use crate::arrays;
use crate::background::{Background, made};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::params;
use crate::progress::Watch;
use crate::report;

// types:
// @final
// class Unwrapped:
//     @property
//     def mesh(self) -> Mesh: ...
//     @property
//     def uv(self) -> NDArray[np.float32]: ...
//     @property
//     def source(self) -> NDArray[np.uint32]: ...
//     @property
//     def chart(self) -> NDArray[np.int32]: ...
//     @property
//     def report(self) -> UnwrapReport: ...
//
// def unwrap(
//     mesh: Mesh,
//     *,
//     # options: unwrap
//     # end
//     progress: _Progress | None = None,
// ) -> Unwrapped: ...

// types of Job:
// @staticmethod
// def unwrap(
//     mesh: Mesh,
//     *,
//     # options: unwrap
//     # end
// ) -> Job: ...

/// Gives a mesh texture coordinates: charts that are packed into one tile or several.
///
/// No triangle is flipped and no two overlap. The triangles stay as they are, in their order. Vertices on seams come once per chart.
/// Files ``.obj``, ``.glb`` and ``.ply`` hold the coordinates. Options that are ``None`` take their defaults.
///
/// >>> unwrapped = surfrecon.unwrap(mesh, size=1024)
/// >>> unwrapped.uv.shape == (len(unwrapped.mesh.positions), 2)
/// True
///
/// Args:
///     mesh: any mesh: open, closed, of many parts. Edges that do not join two triangles of the same orientation become seams.
#[doc = include_str!("params/unwrap.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     An ``Unwrapped`` with the mesh, its coordinates and a report.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: a mesh without triangles, or charts that do not fit their tiles. The text says what to do.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: unwrap
#[pyo3(signature = (mesh, *, progress = None, **options), text_signature = "(mesh, *, tiles=None, texels_per_unit=None, size=2048, padding=4, cone=1.2217304763960306, max_stretch=4.0, threads=0, progress=None)")]
pub fn unwrap(
    py: Python<'_>,
    mesh: &Mesh,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Unwrapped> {
    let call = UnwrapCall::new(mesh, options)?;
    let made = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Unwrapped::new(py, made)
}

/// A call whose arguments are checked, to be run on any thread.
pub struct UnwrapCall {
    mesh: Arc<TriMesh>,
    params: UnwrapParams,
}

impl UnwrapCall {
    /// Checks and takes the arguments.
    pub fn new(mesh: &Mesh, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        Ok(UnwrapCall { mesh: mesh.mesh.clone(), params: params("unwrap", options)? })
    }

    /// Runs it.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        surfrecon::unwrap::unwrap(&self.mesh, &self.params, progress)
    }
}

/// A mesh with texture coordinates, and their figures.
///
/// >>> unwrapped = surfrecon.unwrap(mesh)
/// >>> bool((unwrapped.mesh.positions == mesh.positions[unwrapped.source]).all())
/// True
#[pyclass(frozen, module = "surfrecon")]
pub struct Unwrapped {
    /// The mesh. Its attributes ``s`` and ``t`` of the vertices are the coordinates.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    parts: Arc<Parts>,
    report: UnwrapReport,
}

/// The arrays that views look into.
struct Parts {
    uv: Vec<[f32; 2]>,
    source: Vec<u32>,
    chart: Vec<i32>,
}

impl Unwrapped {
    /// With the mesh as an object of Python.
    pub fn new(py: Python<'_>, core: Core) -> PyResult<Self> {
        let uv = core.uv.iter().map(|at| at.as_vec2().to_array()).collect();
        Ok(Unwrapped {
            mesh: Py::new(py, Mesh::from(core.mesh))?,
            parts: Arc::new(Parts { uv, source: core.source, chart: core.chart }),
            report: core.report,
        })
    }
}

#[pymethods]
impl Unwrapped {
    /// (n, 2) float32: texture coordinates of the vertices of ``mesh``, to the right and upwards. The image of tile ``k`` fills the unit
    /// square at ``(k % 10, k // 10)``, with its first row at the top. A read-only view.
    #[getter]
    fn uv<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::view(py, &self.parts, |parts| parts.uv.as_flattened(), (self.parts.uv.len(), 2))
    }

    /// (n,) uint32: the vertex of the input that each vertex of ``mesh`` was. A read-only view.
    #[getter]
    fn source<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::view(py, &self.parts, |parts| &parts.source, self.parts.source.len())
    }

    /// (m,) int32: the chart of each triangle. -1 for one without area in the texture. A read-only view.
    #[getter]
    fn chart<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::view(py, &self.parts, |parts| &parts.chart, self.parts.chart.len())
    }

    /// Figures of the run: an ``UnwrapReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.report)
    }

    fn __repr__(&self) -> String {
        let UnwrapReport { charts, tiles, .. } = self.report;
        format!("<Unwrapped {}, {}>", counted(charts as u64, "chart", "charts"), counted(tiles as u64, "tile", "tiles"))
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.unwrap`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``unwrap``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: unwrap
    #[pyo3(signature = (mesh, **options), text_signature = "(mesh, *, tiles=None, texels_per_unit=None, size=2048, padding=4, cone=1.2217304763960306, max_stretch=4.0, threads=0)")]
    fn unwrap(mesh: &Mesh, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = UnwrapCall::new(mesh, options)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, unwrapped| Ok(Bound::new(py, Unwrapped::new(py, unwrapped)?)?.into_any()))
        }))
    }
}
