//! Boxes and planes: regions of the world that samples are kept or removed by.

use glam::DVec3;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::plane::DominantPlane;
use surfrecon::select::{self, OrientedBox as Core};

use crate::arrays;
use crate::errors::{guarded, to_python};
use crate::params::no_others;
use crate::pickling::{self, Reduced, reduced};

/// A box anywhere in the world: a region that samples are kept or removed by. What lies on its sides is inside.
///
/// >>> box = surfrecon.Box(np.diag([50.0, 50.0, 20.0, 1.0]))  # 100 x 100 x 40 about the origin
/// >>> box.contains([(0, 0, 10), (0, 0, 30)])
/// array([ True, False])
/// >>> part = surfrecon.merge(surfrecon.keep(scans, box)).mesh
///
/// Args:
///     world_from_box: 4 x 4, affine: the box is what the cube from -1 to 1 along each axis becomes.
///
/// Raises:
///     InputError: a flat box, a matrix that is not affine, numbers that are not finite.
#[pyclass(frozen, name = "Box", module = "surfrecon")]
pub struct OrientedBox {
    pub region: Core,
    text: String,
}

impl OrientedBox {
    /// The box that pickle was given.
    ///
    /// # Errors
    /// `InputError` for numbers that are not finite.
    pub fn of_numbers(numbers: [f64; 15], text: String) -> PyResult<Self> {
        Ok(OrientedBox { region: Core::of_numbers(numbers).map_err(|e| to_python(&e))?, text })
    }
}

#[pymethods]
impl OrientedBox {
    #[new]
    fn new(world_from_box: &Bound<'_, PyAny>) -> PyResult<Self> {
        let place = arrays::any_affine(world_from_box, "world_from_box")?;
        let region = Core::new(place).map_err(|e| to_python(&e))?;
        let (at, axes) = (place.translation, place.matrix3);
        let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| 2.0 * axis.length());
        Ok(OrientedBox { region, text: format!("<Box of {x:.6} x {y:.6} x {z:.6} at {:?}>", at.to_array()) })
    }

    /// The box along the world's axes between two corners.
    ///
    /// >>> surfrecon.Box.between((0, 0, 0), (2, 2, 2)).contains([(2, 1, 1)])
    /// array([ True])
    ///
    /// Raises:
    ///     InputError: ``high`` not above ``low`` along each axis, numbers that are not finite.
    #[staticmethod]
    fn between(low: &Bound<'_, PyAny>, high: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (low, high) = (arrays::vector(low, "low")?, arrays::vector(high, "high")?);
        let region = Core::between(low, high).map_err(|e| to_python(&e))?;
        Ok(OrientedBox { region, text: format!("<Box between {:?} and {:?}>", low.to_array(), high.to_array()) })
    }

    /// Whether points, (n, 3) in the world, lie in the box or on its sides: (n,) bool.
    fn contains<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        of_points(points, |at| self.region.contains(at))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let parts = PyDict::new(py);
        parts.set_item("numbers", self.region.numbers())?;
        parts.set_item("text", &self.text)?;
        reduced("box", parts)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> &str {
        &self.text
    }
}

/// A plane in the world. As a region that samples are kept or removed by it is all that lies below it, on it, and up to ``margin``
/// above: a table or the ground.
///
/// >>> floor = surfrecon.Plane((0, 0, 0), (0, 0, 1), margin=0.5)
/// >>> floor.contains([(3, 4, 0.2), (3, 4, 2)]), floor.height([(3, 4, 2)])
/// (array([ True, False]), array([2.]))
/// >>> above = surfrecon.remove(scans, floor)
///
/// Args:
///     point: (3,) on the plane.
///     normal: (3,) of any length, points above.
///     margin: what lies at most so far above belongs to the region.
///
/// Raises:
///     InputError: a normal of length 0, numbers that are not finite.
#[pyclass(frozen, module = "surfrecon")]
#[derive(Clone)]
pub struct Plane {
    pub plane: select::Plane,
    /// The share of the samples that lie on it, if ``dominant_plane`` found it.
    #[pyo3(get)]
    share: Option<f64>,
    /// How far these scatter about it, root mean square, if ``dominant_plane`` found it.
    #[pyo3(get)]
    spread: Option<f64>,
}

impl From<DominantPlane> for Plane {
    fn from(found: DominantPlane) -> Self {
        Plane { plane: found.plane, share: Some(found.share), spread: Some(found.spread) }
    }
}

impl Plane {
    /// The plane that pickle was given, with its share and spread.
    ///
    /// # Errors
    /// `InputError` for numbers that are not finite.
    pub fn of_numbers(numbers: [f64; 5], (share, spread): (Option<f64>, Option<f64>)) -> PyResult<Self> {
        Ok(Plane { plane: select::Plane::of_numbers(numbers).map_err(|e| to_python(&e))?, share, spread })
    }

    fn given(plane: surfrecon::Result<select::Plane>) -> PyResult<Self> {
        Ok(Plane { plane: plane.map_err(|e| to_python(&e))?, share: None, spread: None })
    }
}

#[pymethods]
impl Plane {
    #[new]
    #[pyo3(signature = (point, normal, *, margin = 0.0, **others), text_signature = "(point, normal, *, margin=0.0)")]
    fn new(
        point: &Bound<'_, PyAny>,
        normal: &Bound<'_, PyAny>,
        margin: f64,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Plane", others)?;
        let (point, normal) = (arrays::vector(point, "point")?, arrays::vector(normal, "normal")?);
        Plane::given(select::Plane::new(point, normal, margin))
    }

    /// The plane through three points.
    ///
    /// >>> floor = surfrecon.Plane.through([(0, 0, 1), (5, 0, 1), (0, 5, 1)], above=(0, 0, 9))
    /// >>> floor.normal
    /// array([0., 0., 1.])
    ///
    /// Args:
    ///     points: (3, 3).
    ///     above: (3,), a place that lies above, such as the eye. Default: above is where the points turn counter-clockwise.
    ///
    /// Raises:
    ///     InputError: points on one line, ``above`` on the plane, numbers that are not finite.
    #[staticmethod]
    #[pyo3(signature = (points, *, above = None, **others), text_signature = "(points, *, above=None)")]
    fn through(
        points: &Bound<'_, PyAny>,
        above: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Plane.through", others)?;
        let (p, _) = arrays::floats(points, "points", &[Some(3), Some(3)])?;
        let point = |k: usize| DVec3::new(p[3 * k], p[3 * k + 1], p[3 * k + 2]);
        let plane = select::Plane::through([point(0), point(1), point(2)]);
        match above {
            None => Plane::given(plane),
            Some(above) => {
                let above = arrays::vector(above, "above")?;
                Plane::given(plane.and_then(|plane| plane.facing(above)))
            }
        }
    }

    /// (3,) float64: its point nearest to the origin.
    #[getter]
    fn point<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.plane.point().to_array())
    }

    /// (3,) float64 of unit length, points above.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.plane.normal().to_array())
    }

    /// The margin: samples at most so far above belong to the region, in the unit of the scans.
    #[getter]
    fn margin(&self) -> f64 {
        self.plane.margin()
    }

    /// The same plane with another margin.
    ///
    /// Raises:
    ///     InputError: one that is not finite.
    fn with_margin(&self, margin: f64) -> PyResult<Self> {
        Ok(Plane { plane: self.plane.with_margin(margin).map_err(|e| to_python(&e))?, ..*self })
    }

    /// The same plane with above and below exchanged.
    fn flipped(&self) -> Self {
        Plane { plane: self.plane.flipped(), ..*self }
    }

    /// How far points, (n, 3) in the world, lie above: (n,) float64, negative below.
    fn height<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        of_points(points, |at| self.plane.height(at))
    }

    /// Whether points, (n, 3) in the world, lie below, on the plane, or at most the margin above: (n,) bool.
    fn contains<'py>(&self, points: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        of_points(points, |at| self.plane.contains(at))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let parts = pickling::attributes(slf, &["share", "spread"])?;
        parts.set_item("numbers", slf.get().plane.numbers())?;
        reduced("plane", parts)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        let (point, normal) = (self.plane.point().to_array(), self.plane.normal().to_array());
        let found = self.share.map_or(String::new(), |share| format!(", {:.1} % of the samples", 100.0 * share));
        format!("<Plane at {point:?} with normal {normal:?}, margin {:?}{found}>", self.plane.margin())
    }
}

fn of_points<'py, T: numpy::Element>(
    points: &Bound<'py, PyAny>,
    answer: impl Fn(DVec3) -> T,
) -> PyResult<Bound<'py, PyArray1<T>>> {
    let (coordinates, _) = arrays::floats(points, "points", &[None, Some(3)])?;
    let answers: Vec<T> = guarded(|| Ok(arrays::vectors(coordinates).into_iter().map(answer).collect()))?;
    Ok(PyArray1::from_vec(points.py(), answers))
}
