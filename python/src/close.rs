//! Closing the openings of a surface.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::close::{CloseParams, Closed as Core};
use surfrecon::{Progress, TriMesh};

use crate::background::{Background, made};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::params;
use crate::progress::Watch;
use crate::report;
use crate::sources::{Clouds, Source, as_dyn, sources};

// types:
// @final
// class Closed:
//     @property
//     def mesh(self) -> Mesh: ...
//     @property
//     def report(self) -> CloseReport: ...
//
// def close(
//     mesh: Mesh,
//     scans: Iterable[_Alignable] | None = None,
//     *,
//     # options: close
//     # end
//     progress: _Progress | None = None,
// ) -> Closed: ...

// types of Job:
// @staticmethod
// def close(
//     mesh: Mesh,
//     scans: Iterable[_Alignable] | None = None,
//     *,
//     # options: close
//     # end
// ) -> Job: ...

/// Closes the openings of a surface with a smooth fill, but never where a scan saw that nothing is.
///
/// Vertices and triangles of the surface come first in the result, to the bit. The vertex attribute ``interpolated`` and the face
/// attribute ``hole_fill`` mark the fill, which crosses nothing. Openings that stay open are in the report, with the reason.
/// Options that are ``None`` take their defaults.
///
/// >>> merged = surfrecon.merge(scans).mesh
/// >>> closed = surfrecon.close(merged, scans)
/// >>> closed.report.closed > 0 and closed.report.open_edges < merged.check().boundary_edges
/// True
///
/// Args:
///     mesh: an oriented manifold in the world of its scans.
///     scans: the scans that the surface was merged of: a ``ScanSet`` or a list, as for ``merge``. Range images whose rays are
///         known say where nothing is. ``None`` closes by the shape of the openings alone.
#[doc = include_str!("params/close.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``Closed`` with the mesh and a report.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: a mesh that is no oriented manifold, or scans of another coordinate reference system.
///     FormatError, FileError: a scan that can't be read.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: close
#[pyo3(signature = (mesh, scans = None, *, progress = None, **options), text_signature = "(mesh, scans = None, *, openings='all', max_hole_length=None, cell=None, merge_distance=None, flat_base=False, force=False, base_up='z', base_depth=0.0, threads=0, progress=None)")]
pub fn close(
    py: Python<'_>,
    mesh: &Mesh,
    scans: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Closed> {
    let call = CloseCall::new(mesh, scans, options)?;
    let made = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Closed::new(py, made)
}

/// A call whose arguments are checked, to be run on any thread.
pub struct CloseCall {
    mesh: Arc<TriMesh>,
    scans: Vec<Source>,
    params: CloseParams,
}

impl CloseCall {
    /// Checks and takes the arguments.
    pub fn new(mesh: &Mesh, scans: Option<&Bound<'_, PyAny>>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let params = params("close", options)?;
        let scans = scans.map(|scans| sources(scans, Clouds::Taken)).transpose()?.unwrap_or_default();
        Ok(CloseCall { mesh: mesh.mesh.clone(), scans, params })
    }

    /// Runs it.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        surfrecon::close::close(&self.mesh, &as_dyn(&self.scans), &self.params, progress)
    }
}

/// A closed surface with its figures.
///
/// >>> closed = surfrecon.close(surfrecon.merge(scans).mesh, scans)
/// >>> int(closed.mesh.face_attributes["hole_fill"].sum()) >= closed.report.added[1]
/// True
#[pyclass(frozen, module = "surfrecon")]
pub struct Closed {
    /// The surface, then the fill. ``vertex_attributes["interpolated"]`` and ``face_attributes["hole_fill"]`` mark the fill,
    /// ``face_attributes["forced"]`` those faces that were filled where a scan saw through.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    core: Core,
}

impl Closed {
    /// With the mesh as an object of Python.
    pub fn new(py: Python<'_>, mut core: Core) -> PyResult<Self> {
        let mesh = Py::new(py, Mesh::from(std::mem::take(&mut core.mesh)))?;
        Ok(Closed { mesh, core })
    }
}

#[pymethods]
impl Closed {
    /// Figures of the run: a ``CloseReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.core.report)
    }

    fn __repr__(&self) -> String {
        let report = &self.core.report;
        let (closed, left) = (report.closed, report.left.iter().sum::<usize>());
        format!("<Closed {closed} openings closed, {left} left open>")
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.close`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``close``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: close
    #[pyo3(signature = (mesh, scans = None, **options), text_signature = "(mesh, scans = None, *, openings='all', max_hole_length=None, cell=None, merge_distance=None, flat_base=False, force=False, base_up='z', base_depth=0.0, threads=0)")]
    fn close(mesh: &Mesh, scans: Option<&Bound<'_, PyAny>>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = CloseCall::new(mesh, scans, options)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, closed| Ok(Bound::new(py, Closed::new(py, closed)?)?.into_any()))
        }))
    }
}
