//! True size and ground: one similarity for all scans.

use glam::DVec3;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::select;

use crate::arrays;
use crate::errors::{guarded, input_error, to_python};
use crate::params::no_others;
use crate::regions::Plane;

/// Scales, turns and shifts the world: true size and ground. ``second @ first`` is both, the right one first.
///
/// >>> metres = surfrecon.Similarity(np.diag([0.001, 0.001, 0.001, 1]))
/// >>> metres.apply([(2000, 0, 500)])
/// array([[2. , 0. , 0.5]])
/// >>> scans = surfrecon.transformed(scans, metres)
///
/// Args:
///     matrix: 4 x 4 that scales all directions alike, turns and shifts, within 0.02 of that.
///
/// Raises:
///     InputError: a matrix that does anything else, numbers that are not finite.
#[pyclass(frozen, module = "surfrecon")]
#[derive(Clone, Copy)]
pub struct Similarity {
    pub similarity: select::Similarity,
}

/// A similarity as Python hands it over: one, or its matrix.
pub struct Given(pub Similarity);

impl<'py> FromPyObject<'_, 'py> for Given {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        match given.cast::<Similarity>() {
            Ok(similarity) => Ok(Given(*similarity.get())),
            Err(_) => Similarity::of_matrix(&given, "similarity").map(Given),
        }
    }
}

impl Similarity {
    fn of_matrix(matrix: &Bound<'_, PyAny>, name: &str) -> PyResult<Self> {
        let similarity = select::Similarity::from_affine(arrays::affine(matrix, name)?);
        Ok(Similarity { similarity: similarity.map_err(|e| to_python(&e))? })
    }
}

#[pymethods]
impl Similarity {
    #[new]
    fn new(matrix: &Bound<'_, PyAny>) -> PyResult<Self> {
        Similarity::of_matrix(matrix, "matrix")
    }

    /// 4 x 4 float64.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::matrix(py, &self.similarity.to_affine())
    }

    /// The factor of lengths.
    #[getter]
    fn scale(&self) -> f64 {
        self.similarity.scale()
    }

    /// The similarity that takes it back.
    fn inverse(&self) -> Self {
        Similarity { similarity: self.similarity.inverse() }
    }

    /// Points, (n, 3), where they come to lie: (n, 3) float64.
    fn apply<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (coordinates, shape) = arrays::floats(points, "points", &[None, Some(3)])?;
        let moved: Vec<f64> = guarded(|| {
            let moved = arrays::vectors(coordinates).into_iter().flat_map(|at| self.similarity.of_place(at).to_array());
            Ok(moved.collect())
        })?;
        Ok(PyArray1::from_vec(points.py(), moved).reshape([shape[0], 3])?.into_any())
    }

    fn __matmul__(&self, first: &Similarity) -> Self {
        Similarity { similarity: first.similarity.then(&self.similarity) }
    }

    fn __repr__(&self) -> String {
        format!("<Similarity of scale {:?}>", self.similarity.scale())
    }
}

/// The scale about the origin that makes two picked places lie as far apart as they truly do.
///
/// >>> size = surfrecon.true_size((0, 0, 0), (0, 0, 4), 1.0)  # picked 4 apart, in truth 1
/// >>> size.scale
/// 0.25
/// >>> scans = surfrecon.transformed(scans, size)
///
/// Args:
///     a, b: (3,) in the world.
///     distance: how far apart they are, > 0, in the unit that the scans are to have.
///
/// Returns:
///     A ``Similarity`` for ``transformed``.
///
/// Raises:
///     InputError: places that are the same, numbers that are not finite, a distance not above 0.
#[pyfunction]
pub fn true_size(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>, distance: f64) -> PyResult<Similarity> {
    let similarity = select::Similarity::true_size(arrays::vector(a, "a")?, arrays::vector(b, "b")?, distance);
    Ok(Similarity { similarity: similarity.map_err(|e| to_python(&e))? })
}

/// The least turn, and shift along ``up``, that lay a plane to height 0, with what is above it above.
///
/// >>> floor = surfrecon.Plane.through([(0, 0, 7), (1, 0, 7), (0, 1, 7)])
/// >>> level = surfrecon.ground(floor)
/// >>> level.apply([(0, 0, 7), (0, 0, 10)])[:, 2]
/// array([0., 3.])
///
/// Args:
///     plane: a ``Plane``: picked by three points, or found by ``dominant_plane``.
///     up: ``"x"``, ``"y"``, ``"z"``, ``"-x"``, ``"-y"``, ``"-z"`` or a direction (3,).
///
/// Returns:
///     A ``Similarity`` of scale 1 for ``transformed``.
///
/// Raises:
///     InputError: no such direction.
#[pyfunction]
#[pyo3(signature = (plane, *, up = None, **others), text_signature = "(plane, *, up='z')")]
pub fn ground(
    plane: &Plane,
    up: Option<&Bound<'_, PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Similarity> {
    no_others("ground", others)?;
    let up = match up {
        None => DVec3::Z,
        Some(given) => match given.extract::<String>() {
            Ok(name) => named_axis(&name)?,
            Err(_) => arrays::vector(given, "up")?,
        },
    };
    let similarity = select::Similarity::ground(&plane.plane, up).map_err(|e| to_python(&e))?;
    Ok(Similarity { similarity })
}

fn named_axis(name: &str) -> PyResult<DVec3> {
    Ok(match name {
        "x" => DVec3::X,
        "y" => DVec3::Y,
        "z" => DVec3::Z,
        "-x" => DVec3::NEG_X,
        "-y" => DVec3::NEG_Y,
        "-z" => DVec3::NEG_Z,
        _ => {
            let known = "\"x\", \"y\", \"z\", \"-x\", \"-y\", \"-z\"";
            return Err(input_error(format!("up must be one of {known} or a direction, got {name:?}")));
        }
    })
}
