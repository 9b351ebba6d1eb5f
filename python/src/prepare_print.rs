//! Closed meshes made ready for printing.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::printing::{self, PrepareParams, PrepareReport, PreparedPrint as Core};
use surfrecon::{Progress, TriMesh};

use crate::background::{Background, made};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::params;
use crate::progress::Watch;
use crate::report;

// types:
// @final
// class Prepared:
//     @property
//     def mesh(self) -> Mesh: ...
//     @property
//     def parts(self) -> list[Mesh]: ...
//     @property
//     def report(self) -> PrepareReport: ...
//
// def prepare_print(
//     mesh: Mesh,
//     *,
//     # options: prepare_print
//     # end
//     progress: _Progress | None = None,
// ) -> Prepared: ...

// types of Job:
// @staticmethod
// def prepare_print(
//     mesh: Mesh,
//     *,
//     # options: prepare_print
//     # end
// ) -> Job: ...

/// Makes a closed mesh ready for printing in 3D, by the steps that are asked for.
///
/// In this order: its size, a flat base, thicker walls, a cavity with a drain, parts that the printer holds. The result is closed, and no
/// faces cross. Lengths are in the unit of the result. Options that are ``None`` leave their step out.
///
/// >>> prepared = surfrecon.prepare_print(mesh, scale_to=120, flat_base=True)
/// >>> round(max(prepared.report.size), 6)
/// 120.0
///
/// Args:
///     mesh: closed, an oriented manifold, without crossing faces.
#[doc = include_str!("params/prepare_print.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``Prepared`` with the mesh, its parts and a report.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: a mesh that is open, crosses itself or is inside out. The text says what to do.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: prepare_print
#[pyo3(signature = (mesh, *, progress = None, **options), text_signature = "(mesh, *, scale_to=None, scale_side='longest', flat_base=False, base_height=None, min_wall=None, hollow=None, hollow_cell=None, drain=None, drain_sides=32, printer_width=None, printer_depth=None, printer_height=None, print_up='z', threads=0, progress=None)")]
pub fn prepare_print(
    py: Python<'_>,
    mesh: &Mesh,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Prepared> {
    let call = PreparePrintCall::new(mesh, options)?;
    let made = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Prepared::new(py, made)
}

/// A call whose arguments are checked, to be run on any thread.
pub struct PreparePrintCall {
    mesh: Arc<TriMesh>,
    params: PrepareParams,
}

impl PreparePrintCall {
    /// Checks and takes the arguments.
    pub fn new(mesh: &Mesh, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        Ok(PreparePrintCall { mesh: mesh.mesh.clone(), params: params("prepare_print", options)? })
    }

    /// Runs it.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        printing::prepare_print(&self.mesh, &self.params, progress)
    }
}

/// A mesh that is ready for printing, with its figures.
///
/// >>> prepared = surfrecon.prepare_print(mesh, printer_height=0.5)
/// >>> len(prepared.parts) == prepared.report.parts
/// True
#[pyclass(frozen, module = "surfrecon")]
pub struct Prepared {
    /// The mesh. Its face attribute ``added`` marks what was made up. If it was cut, ``part`` has the number of the part of each face.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    report: PrepareReport,
}

impl Prepared {
    /// With the mesh as an object of Python.
    pub fn new(py: Python<'_>, core: Core) -> PyResult<Self> {
        Ok(Prepared { mesh: Py::new(py, Mesh::from(core.mesh))?, report: core.report })
    }
}

#[pymethods]
impl Prepared {
    /// The parts that the printer holds, each as a mesh. The mesh alone if it was not cut. Newly made.
    #[getter]
    fn parts(&self, py: Python<'_>) -> PyResult<Vec<Py<Mesh>>> {
        let mesh = &self.mesh.get().mesh;
        if self.report.parts < 2 {
            return Ok(vec![self.mesh.clone_ref(py)]);
        }
        let parts = py.detach(|| (0..self.report.parts).filter_map(|k| printing::part(mesh, k)).collect::<Vec<_>>());
        parts.into_iter().map(|part| Py::new(py, Mesh::from(part))).collect()
    }

    /// Figures of the run: a ``PrepareReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.report)
    }

    fn __repr__(&self) -> String {
        let count = self.report.parts;
        format!("<Prepared {count} {}>", if count == 1 { "part" } else { "parts" })
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.prepare_print`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``prepare_print``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: prepare_print
    #[pyo3(signature = (mesh, **options), text_signature = "(mesh, *, scale_to=None, scale_side='longest', flat_base=False, base_height=None, min_wall=None, hollow=None, hollow_cell=None, drain=None, drain_sides=32, printer_width=None, printer_depth=None, printer_height=None, print_up='z', threads=0)")]
    fn prepare_print(mesh: &Mesh, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = PreparePrintCall::new(mesh, options)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, prepared| Ok(Bound::new(py, Prepared::new(py, prepared)?)?.into_any()))
        }))
    }
}
