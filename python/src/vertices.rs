//! `GridCamera`, and images of the vertices that a host keeps.

use glam::DAffine3;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::RangeImage;
use surfrecon::vertices::{Anchor, GridCamera as Core, Vertices, from_vertices};

use crate::arrays;
use crate::errors::{guarded, input_error, to_python};
use crate::params::count;
use crate::progress::Watch;
use crate::projection;

/// The data that a host keeps of a range image beside its vertices: how pixels see, and by anchors where some of the vertices were,
/// from which ``RangeImage.from_vertices`` tells how all of them were moved. Made by ``RangeImage.grid_camera``, or from what
/// a host stored. It never changes.
///
/// >>> camera = image.grid_camera()
/// >>> kept = camera.rows, camera.cols, camera.projection, camera.anchors
/// >>> surfrecon.GridCamera(*kept) == camera
/// True
///
/// Args:
///     rows, cols: size of the grid.
///     projection: a dict as ``RangeImage.projection``.
///     anchors: (k, 5) real numbers, k at most 256: row, column, and x, y, z in the sensor's frame. ``None``: vertices are
///         taken to lie in the sensor's frame.
///
/// Raises:
///     InputError: a projection that isn't usable, anchors outside of the grid.
///     TypeError: entries of another type.
#[pyclass(frozen, module = "surfrecon")]
pub struct GridCamera {
    camera: Core,
}

impl From<Core> for GridCamera {
    fn from(camera: Core) -> Self {
        GridCamera { camera }
    }
}

#[pymethods]
impl GridCamera {
    #[new]
    #[pyo3(signature = (rows, cols, projection, anchors = None))]
    fn new(
        rows: &Bound<'_, PyAny>,
        cols: &Bound<'_, PyAny>,
        projection: &Bound<'_, PyDict>,
        anchors: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let camera = Core {
            rows: count("rows", rows, 0, GRID)?,
            cols: count("cols", cols, 0, GRID)?,
            projection: projection::parsed(projection)?,
            anchors: anchors.map(of_rows).transpose()?.unwrap_or_default(),
        };
        camera.validate().map_err(|e| to_python(&e))?;
        Ok(camera.into())
    }

    /// Number of rows.
    #[getter]
    fn rows(&self) -> usize {
        self.camera.rows
    }

    /// Number of columns.
    #[getter]
    fn cols(&self) -> usize {
        self.camera.cols
    }

    /// How pixels see: a dict with ``kind`` and its parameters, as ``RangeImage.projection``.
    #[getter]
    fn projection<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        projection::described(py, &self.camera.projection)
    }

    /// (k, 5) float64: row, column, and x, y, z in the sensor's frame, newly computed.
    #[getter]
    fn anchors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let anchors = &self.camera.anchors;
        let row = |a: &Anchor| [a.row as f64, a.col as f64, a.point.x, a.point.y, a.point.z];
        let numbers: Vec<f64> = anchors.iter().flat_map(row).collect();
        Ok(PyArray1::from_vec(py, numbers).reshape([anchors.len(), 5])?.into_any())
    }

    /// For vertices whose coordinates are multiplied by ``scale``, > 0, where the host's unit of length is another.
    ///
    /// Raises:
    ///     InputError: a scale that is not above 0, or with which lengths become too large or too small.
    fn scaled(&self, scale: f64) -> PyResult<Self> {
        Ok(self.camera.scaled(scale).map_err(|e| to_python(&e))?.into())
    }

    /// The arguments that a copy, or one unpickled, is made of.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(usize, usize, Bound<'py, PyDict>, Bound<'py, PyAny>)> {
        Ok((self.camera.rows, self.camera.cols, self.projection(py)?, self.anchors(py)?))
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.camera == other.camera
    }

    fn __repr__(&self) -> String {
        let Core { rows, cols, anchors, .. } = &self.camera;
        format!("<GridCamera {rows} x {cols} pixels, {} anchors>", anchors.len())
    }
}

const GRID: &str = "Give the size of the grid.";

fn of_rows(anchors: &Bound<'_, PyAny>) -> PyResult<Vec<Anchor>> {
    let (numbers, _) = arrays::floats(anchors, "anchors", &[None, Some(5)])?;
    let whole = |i: usize, x: f64| {
        if x >= 0.0 && x.fract() == 0.0 && x < 2.0_f64.powi(53) {
            return Ok(x as usize);
        }
        Err(input_error(format!("row and column of anchor {i} must be whole numbers >= 0, got {x:?}")))
    };
    let rows = numbers.chunks_exact(5).enumerate();
    rows.map(|(i, a)| Ok(Anchor { row: whole(i, a[0])?, col: whole(i, a[1])?, point: glam::dvec3(a[2], a[3], a[4]) }))
        .collect()
}

/// Arrays that Python hands over, one entry a vertex.
pub struct PerVertex<'a, 'py> {
    pub row: &'a Bound<'py, PyAny>,
    pub col: &'a Bound<'py, PyAny>,
    pub positions: &'a Bound<'py, PyAny>,
    pub colour: Option<&'a Bound<'py, PyAny>>,
    pub intensity: Option<&'a Bound<'py, PyAny>>,
    pub confidence: Option<&'a Bound<'py, PyAny>>,
}

/// The image of a host's vertices, without a name.
///
/// # Errors
/// Those of [`from_vertices`], and wrong shapes and types.
pub fn image(
    camera: &GridCamera,
    given: &PerVertex<'_, '_>,
    world_from_host: Option<&Bound<'_, PyAny>>,
) -> PyResult<RangeImage> {
    let py = given.positions.py();
    guarded(|| {
        let world_from_host = world_from_host.map(|m| arrays::any_affine(m, "world_from_host")).transpose()?;
        let (coordinates, shape) = arrays::floats(given.positions, "positions", &[None, Some(3)])?;
        let positions = arrays::vectors(coordinates);
        let vertices = [Some(shape[0])];
        let (row, col) = (places(given.row, "row", vertices)?, places(given.col, "col", vertices)?);
        py.check_signals()?;
        let colour = given.colour.map(|c| arrays::colours(c, "colour", &vertices)).transpose()?;
        let scalar = |value: Option<&Bound<'_, PyAny>>, what: &str| -> PyResult<Option<Vec<f32>>> {
            Ok(value.map(|v| arrays::floats32(v, what, &vertices)).transpose()?.map(|(entries, _)| entries))
        };
        let intensity = scalar(given.intensity, "intensity")?;
        let confidence = scalar(given.confidence, "confidence")?;
        Watch::new(None).run(py, |progress| {
            let vertices = Vertices {
                row: &row,
                col: &col,
                positions: &positions,
                colour: colour.as_deref(),
                intensity: intensity.as_deref(),
                confidence: confidence.as_deref(),
            };
            from_vertices(&camera.camera, &vertices, world_from_host.unwrap_or(DAffine3::IDENTITY), progress)
        })
    })
}

/// Rows or columns. Numbers that 32 bits can't hold lie outside of any grid and stay so.
fn places(value: &Bound<'_, PyAny>, what: &str, vertices: [Option<usize>; 1]) -> PyResult<Vec<i32>> {
    let (places, _) = arrays::integers(value, what, &vertices)?;
    Ok(places.into_iter().map(|place| place.clamp(i32::MIN.into(), i32::MAX.into()) as i32).collect())
}
