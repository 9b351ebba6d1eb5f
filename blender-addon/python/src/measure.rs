//! Distances of points to a mesh.

use std::sync::Arc;

use glam::DVec3;
use numpy::PyArray1;
use pyo3::prelude::*;
use surfrecon::mesh::measure::{Side, deviation};
use surfrecon::{Progress, TriMesh};

use crate::arrays;
use crate::mesh::Mesh;
use crate::params::count_of;
use crate::progress::Watch;

/// Exact distances of points to the nearest points of a mesh.
///
/// Args:
///     points: (n, 3) real numbers.
///     mesh: the surface.
///     signed: whether distances behind the surface are negative; right wherever the mesh is closed.
///     threads: worker threads, 0 for one a core. The result is the same for any number.
///     progress: called as ``progress(stage, fraction)``; ``False`` cancels. Ctrl-C cancels as well.
///
/// Returns:
///     (n,) float64, in the unit of the points.
///
/// Raises:
///     InputError: a mesh without triangles, a point that isn't finite.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
#[pyo3(signature = (points, mesh, *, signed = false, threads = None, progress = None))]
pub fn distances<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    mesh: &Mesh,
    signed: bool,
    threads: Option<i64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let call = DistanceCall::new(points, mesh, signed, threads)?;
    let distances = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Ok(PyArray1::from_vec(py, distances))
}

/// A measurement with all it needs, free of Python.
pub struct DistanceCall {
    points: Vec<DVec3>,
    mesh: Arc<TriMesh>,
    side: Side,
    threads: usize,
}

impl DistanceCall {
    /// Checks and takes the arguments of Python's `distances`.
    ///
    /// # Errors
    /// `ParameterError`, `InputError`, `TypeError`.
    pub fn new(points: &Bound<'_, PyAny>, mesh: &Mesh, signed: bool, threads: Option<i64>) -> PyResult<Self> {
        let (coordinates, _) = arrays::floats(points, "points", &[None, Some(3)])?;
        let side = if signed { Side::Signed } else { Side::Ignored };
        let threads = count_of("merge", "threads", threads)?;
        Ok(DistanceCall { points: arrays::vectors(&coordinates), mesh: mesh.mesh.clone(), side, threads })
    }

    /// Runs it.
    ///
    /// # Errors
    /// See [`deviation`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Vec<f64>> {
        Ok(deviation(&self.points, &self.mesh, self.side, self.threads, progress)?.distances)
    }
}
