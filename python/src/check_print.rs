//! Checks of a mesh before it is printed.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::close::print::{Checked as Core, PrintParams};
use surfrecon::{Progress, TriMesh};

use crate::background::{Background, made};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::params;
use crate::progress::Watch;
use crate::report;

// types:
// @final
// class Checked:
//     @property
//     def mesh(self) -> Mesh: ...
//     @property
//     def crossings(self) -> NDArray[np.uint32]: ...
//     @property
//     def report(self) -> PrintReport: ...
//
// def check_print(
//     mesh: Mesh,
//     *,
//     # options: check_print
//     # end
//     progress: _Progress | None = None,
// ) -> Checked: ...

// types of Job:
// @staticmethod
// def check_print(
//     mesh: Mesh,
//     *,
//     # options: check_print
//     # end
// ) -> Job: ...

/// Checks whether a mesh can be printed in 3D: closed, manifold, no crossing faces, walls, overhangs, size.
///
/// Nothing is repaired. The report has a finding for each fault, with what to do. The mesh of the result is the same, with three more
/// face attributes: ``wall``, ``crossing`` and ``overhang``. Options that are ``None`` take their defaults.
///
/// >>> checked = surfrecon.check_print(mesh, min_wall=0.001)
/// >>> checked.report.is_closed, checked.report.crossing_pairs
/// (True, 0)
///
/// Args:
///     mesh: any mesh.
#[doc = include_str!("params/check_print.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``Checked`` with the mesh and a report.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: a vertex whose coordinates are not finite.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: check_print
#[pyo3(signature = (mesh, *, progress = None, **options), text_signature = "(mesh, *, min_wall=None, max_wall=None, overhang=0.7853981633974483, print_up='z', printer_width=None, printer_depth=None, printer_height=None, density=None, threads=0, progress=None)")]
pub fn check_print(
    py: Python<'_>,
    mesh: &Mesh,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Checked> {
    let call = CheckPrintCall::new(mesh, options)?;
    let made = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Checked::new(py, made)
}

/// A call whose arguments are checked, to be run on any thread.
pub struct CheckPrintCall {
    mesh: Arc<TriMesh>,
    params: PrintParams,
}

impl CheckPrintCall {
    /// Checks and takes the arguments.
    pub fn new(mesh: &Mesh, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        Ok(CheckPrintCall { mesh: mesh.mesh.clone(), params: params("check_print", options)? })
    }

    /// Runs it.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        surfrecon::close::print::check_print(&self.mesh, &self.params, progress)
    }
}

/// A mesh that was checked for printing, with its figures.
///
/// >>> checked = surfrecon.check_print(mesh)
/// >>> len(checked.crossings) == checked.report.crossing_pairs
/// True
#[pyclass(frozen, module = "surfrecon")]
pub struct Checked {
    /// The mesh with three more face attributes: ``wall``, the thickness behind the face, ``crossing``, whether the face crosses
    /// another, and ``overhang``, whether it hangs over. Where a wall is thicker than is measured, or nothing lies
    /// behind a face, ``wall`` is ``report.wall_limit``.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    core: Core,
}

impl Checked {
    /// With the mesh as an object of Python.
    pub fn new(py: Python<'_>, mut core: Core) -> PyResult<Self> {
        let mesh = Py::new(py, Mesh::from(std::mem::take(&mut core.mesh)))?;
        Ok(Checked { mesh, core })
    }
}

#[pymethods]
impl Checked {
    /// (n, 2) uint32: the pairs of faces that cross, the smaller number first, rising. Newly copied.
    #[getter]
    fn crossings<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        numpy::PyArray2::from_array(py, &numpy::ndarray::aview2(&self.core.report.crossings)).into_any()
    }

    /// Figures of the run: a ``PrintReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.core.report)
    }

    fn __repr__(&self) -> String {
        let count = self.core.report.findings.len();
        format!("<Checked {count} {}>", if count == 1 { "finding" } else { "findings" })
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.check_print`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``check_print``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: check_print
    #[pyo3(signature = (mesh, **options), text_signature = "(mesh, *, min_wall=None, max_wall=None, overhang=0.7853981633974483, print_up='z', printer_width=None, printer_depth=None, printer_height=None, density=None, threads=0)")]
    fn check_print(mesh: &Mesh, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = CheckPrintCall::new(mesh, options)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, checked| Ok(Bound::new(py, Checked::new(py, checked)?)?.into_any()))
        }))
    }
}
