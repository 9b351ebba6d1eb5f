//! Quad grids: a range image to a regular grid of quads.

use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::RangeImage as CoreImage;
use surfrecon::export::{Holding, PlyOptions, Polygons, Provenance, write_obj_polygons, write_quads_ply};
use surfrecon::mesh::QuadMesh;
use surfrecon::quads::{Fit, QuadGrid as Core, QuadParams, SplineParams};

use crate::arrays;
use crate::background::{Background, made_class};
use crate::errors::{detached, guarded, input_error};
use crate::job::Job;
use crate::memory_folder::Place;
use crate::mesh::{Mesh, ending_of, provenance_of};
use crate::params::{count, no_others, params};
use crate::progress::Watch;
use crate::range_image::RangeImage;
use crate::report;

/// A call with its arguments checked.
pub struct QuadCall {
    image: Arc<CoreImage>,
    params: QuadParams,
}

impl QuadCall {
    pub fn new(image: &RangeImage, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let params = params("adaptive_quads", options)?;
        Ok(QuadCall { image: image.image(), params })
    }

    pub fn run(&self, progress: &surfrecon::Progress<'_>) -> surfrecon::Result<Core> {
        surfrecon::quads::run(&self.image, &self.params, progress)
    }
}

/// Makes a regular grid of quads of a range image, dense where the surface bends.
///
/// Every vertex lies on a pixel of its own. Seen on the pixels no quad folds over. The grid covers the whole image. Quads on
/// the background are left out of ``QuadGrid.quads``. Its mean error is at most that of the uniform grid of the same size.
/// Options that are ``None`` take their defaults.
///
/// >>> grid = surfrecon.adaptive_quads(image, max_error=1.0)
/// >>> grid.report.max_error <= 1.0
/// True
/// >>> grid.write("grid.obj")
///
/// Args:
///     image: the range image.
#[doc = include_str!("params/quads.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``QuadGrid``.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: fewer pixels than vertices along a side, no valid pixel, both errors given.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: quads
#[pyo3(signature = (image, *, progress = None, **options), text_signature = "(image, *, tiles_down=None, tiles_across=None, rows=9, columns=9, max_error=None, rms_error=None, gap_passes=1, gap_neighbours=8, curvature_unit=0.001, curvature_limit=255, exponent=0.7, floor=2.0, smoothing=2.0, background_curvature=None, coverage=0.5, threads=0, progress=None)")]
pub fn adaptive_quads(
    py: Python<'_>,
    image: &RangeImage,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<QuadGrid> {
    let call = QuadCall::new(image, options)?;
    let made = Watch::new(progress).run(py, |progress| call.run(progress))?;
    Ok(QuadGrid::from(made))
}

/// A regular grid of quads over a range image. It never changes. Its arrays are read-only views without copying.
///
/// Quads turn counter-clockwise seen from the sensor. Quads that touch in a vertex only have a vertex each, so
/// ``positions`` may hold a place twice. ``grid`` holds every vertex of the grid once, those on the background as well.
///
/// >>> grid = surfrecon.adaptive_quads(image)
/// >>> grid.grid.shape == (grid.rows, grid.columns, 3)
/// True
/// >>> mesh = grid.triangles()
#[pyclass(frozen, module = "surfrecon")]
pub struct QuadGrid {
    core: Arc<Core>,
    mesh: Arc<QuadMesh>,
}

impl From<Core> for QuadGrid {
    fn from(core: Core) -> Self {
        QuadGrid { mesh: Arc::new(core.mesh()), core: Arc::new(core) }
    }
}

#[pymethods]
impl QuadGrid {
    /// Rows of vertices of the grid.
    #[getter]
    fn rows(&self) -> usize {
        self.core.rows
    }

    /// Columns of vertices of the grid.
    #[getter]
    fn columns(&self) -> usize {
        self.core.cols
    }

    /// (rows, columns, 3) float64: every vertex of the grid in the sensor's frame. On the background, a continuation of the
    /// surface. A read-only view.
    #[getter]
    fn grid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = (self.core.rows, self.core.cols, 3);
        arrays::view(py, &self.core, |g| arrays::coordinates(&g.positions), shape)
    }

    /// (rows, columns, 2) uint32: row and column of each vertex's pixel. Rising strictly along both. A read-only view.
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::view(py, &self.core, |g| g.pixels.as_flattened(), (self.core.rows, self.core.cols, 2))
    }

    /// (rows, columns) bool: vertices on pixels without a sample. A read-only view.
    #[getter]
    fn background<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::view(py, &self.core, |g| &g.background[..], (self.core.rows, self.core.cols))
    }

    /// (n, 3) float64: the vertices that the quads use, in the sensor's frame. A read-only view.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let count = self.mesh.positions.len();
        arrays::view(py, &self.mesh, |m| arrays::coordinates(&m.positions), (count, 3))
    }

    /// The positions as one flat float32 array (3 n,), newly made: what hosts' meshes take.
    ///
    /// Raises:
    ///     InputError: a coordinate that float32 can't hold.
    fn positions_f32<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let exact = arrays::coordinates(&self.mesh.positions);
        let flat: Vec<f32> = exact.iter().map(|&x| x as f32).collect();
        arrays::check_single(exact, &flat, 0, "positions")?;
        Ok(PyArray1::from_vec(py, flat))
    }

    /// (m, 4) uint32: corners of the quads that are not on the background. A read-only view.
    #[getter]
    fn quads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::view(py, &self.mesh, |m| m.quads.as_flattened(), (self.mesh.quads.len(), 4))
    }

    /// (n, 2) float32: image coordinates of the vertices, 0 to 1 from the left and from the bottom. A read-only view.
    #[getter]
    fn uvs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::view(py, &self.mesh, |m| m.uvs.as_flattened(), (self.mesh.uvs.len(), 2))
    }

    /// Attributes of the vertices by name: ``range_row``, ``range_col`` (the pixel), ``grid_row``, ``grid_col``, and
    /// ``colour``, ``intensity``, ``confidence`` where the image has them. Read-only views.
    #[getter]
    fn vertex_attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        crate::mesh::attributes(py, &self.mesh, |m| &m.vertex_attributes)
    }

    /// Attributes of the quads by name: ``error``, the largest distance of the samples in each. Read-only views.
    #[getter]
    fn face_attributes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        crate::mesh::attributes(py, &self.mesh, |m| &m.face_attributes)
    }

    /// The quads as a ``Mesh`` of triangles, each quad cut along the diagonal that lies nearer to the image.
    fn triangles(&self) -> PyResult<Mesh> {
        guarded(|| Ok(Mesh::from(self.core.triangles())))
    }

    /// Fits a B-spline surface to the whole grid.
    ///
    /// >>> spline = surfrecon.adaptive_quads(image).spline(rows=8, columns=8)
    /// >>> spline.control.shape
    /// (8, 8, 3)
    ///
    /// Args:
    #[doc = include_str!("params/spline.txt")]
    ///     progress: called with the stage's name and the share of the call that is done. ``False`` cancels.
    ///
    /// Raises:
    ///     ParameterError: an option out of its range.
    ///     InputError: fewer control points than the order, more than vertices.
    // options: $self spline
    #[pyo3(signature = (*, progress = None, **options), text_signature = "($self, *, order=4, rows=None, columns=None, progress=None)")]
    fn spline(
        &self,
        py: Python<'_>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Spline> {
        let params: SplineParams = params("QuadGrid.spline", options)?;
        let core = self.core.clone();
        let fit = Watch::new(progress).run(py, move |progress| core.spline(&params, progress))?;
        Ok(Spline { fit: Arc::new(fit), mirrored: self.core.mirrored })
    }

    /// Writes the quads as ``.obj``, with colours, or as ``.ply``, with all attributes and texture coordinates.
    ///
    /// >>> surfrecon.adaptive_quads(image).write("grid.ply")
    ///
    /// Args:
    ///     path: its ending decides on the format.
    ///     provenance: what the file says of where it is from: as for ``Mesh.write``.
    ///
    /// Raises:
    ///     InputError: another ending.
    ///     FileError: writing failed. No file is left, and one that was there is untouched.
    #[pyo3(signature = (path, *, provenance = None, **others), text_signature = "($self, path, *, provenance=None)")]
    fn write(
        &self,
        py: Python<'_>,
        path: Place,
        provenance: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        no_others("QuadGrid.write", others)?;
        write_quads(py, path, self.mesh.clone(), provenance_of(provenance)?)
    }

    /// Figures of the run: a ``QuadReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.core.report)
    }

    fn __repr__(&self) -> String {
        let (core, report) = (&self.core, &self.core.report);
        format!(
            "<QuadGrid {} x {} vertices, {} quads, relative error {:.4} % (uniform {:.4} %)>",
            core.rows,
            core.cols,
            report.quads,
            100.0 * report.relative_error,
            100.0 * report.uniform_relative_error
        )
    }
}

fn write_quads(py: Python<'_>, path: Place, mesh: Arc<QuadMesh>, provenance: Option<Provenance>) -> PyResult<()> {
    let watch = Watch::new(None);
    if ending_of(&path, Holding::Quads)? == "ply" {
        let options = PlyOptions { provenance, ..PlyOptions::default() };
        return watch.run(py, move |progress| write_quads_ply(&path, &mesh, options, progress));
    }
    watch.run(py, move |progress| {
        let colour = mesh.vertex_attributes.iter().find_map(|a| match &a.data {
            surfrecon::mesh::AttributeData::Colour(colour) if a.name == "colour" => Some(&colour[..]),
            _ => None,
        });
        let (provenance, crs) = (provenance.as_ref(), mesh.crs.as_ref());
        let polygons =
            Polygons { positions: &mesh.positions, colour, quads: &mesh.quads, triangles: &[], provenance, crs };
        write_obj_polygons(&path, &polygons, progress)
    })
}

/// A tensor-product B-spline surface over 0..1 x 0..1: u runs along columns, v down rows. Knots are uniform and clamped.
///
/// >>> spline = surfrecon.adaptive_quads(image).spline()
/// >>> spline.evaluate([0.0, 0.5], [0.5, 0.5]).shape  # at the left border, and in the middle
/// (2, 3)
#[pyclass(frozen, module = "surfrecon")]
pub struct Spline {
    fit: Arc<Fit>,
    mirrored: bool,
}

#[pymethods]
impl Spline {
    /// Order in both directions, the degree plus one.
    #[getter]
    fn order(&self) -> usize {
        self.fit.spline.order
    }

    /// (rows, columns, 3) float64: control points in the sensor's frame. A read-only view.
    #[getter]
    fn control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let shape = (self.fit.spline.rows, self.fit.spline.cols, 3);
        arrays::view(py, &self.fit, |f| arrays::coordinates(&f.spline.control), shape)
    }

    /// Whether the sensor sees the surface mirrored: u x v points toward it then, else away from it.
    #[getter]
    fn mirrored(&self) -> bool {
        self.mirrored
    }

    /// Knots along u and along v: two float64 arrays, newly made.
    #[getter]
    fn knots<'py>(&self, py: Python<'py>) -> (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>) {
        let [u, v] = self.fit.spline.knots();
        (PyArray1::from_vec(py, u), PyArray1::from_vec(py, v))
    }

    /// Largest distance of a vertex of the grid from the surface at the vertex's parameters.
    #[getter]
    fn max_residual(&self) -> f64 {
        self.fit.max_residual
    }

    /// Root of the mean square of these distances.
    #[getter]
    fn rms_residual(&self) -> f64 {
        self.fit.rms_residual
    }

    /// Points of the surface at parameters (n,) and (n,), each taken into 0 to 1: (n, 3) float64, newly made.
    ///
    /// >>> spline = surfrecon.adaptive_quads(image).spline()
    /// >>> spline.evaluate([0.5], [0.5]).shape
    /// (1, 3)
    ///
    /// Raises:
    ///     InputError: ``u`` and ``v`` of different lengths, or not numbers.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        u: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (u, _) = arrays::floats(u, "u", &[None])?;
        let (v, _) = arrays::floats(v, "v", &[None])?;
        if u.len() != v.len() {
            return Err(input_error(format!("u and v must be as long as each other, got {} and {}", u.len(), v.len())));
        }
        if let Some(i) = (0..u.len()).find(|&i| u[i].is_nan() || v[i].is_nan()) {
            return Err(input_error(format!("parameters {i} must be numbers, got u = {} and v = {}", u[i], v[i])));
        }
        let fit = self.fit.clone();
        let points = detached(py, move || {
            let at = |(u, v): (&f64, &f64)| fit.spline.at(*u, *v);
            Ok(u.iter().zip(&v).map(at).collect::<Vec<_>>())
        })?;
        let count = points.len();
        Ok(PyArray1::from_slice(py, arrays::coordinates(&points)).reshape([count, 3])?.into_any())
    }

    /// Writes the surface, sampled at rows x columns evenly spread parameters, as quads: ``.obj`` or ``.ply``.
    ///
    /// >>> spline = surfrecon.adaptive_quads(image).spline()
    /// >>> spline.write("smooth.obj", 100, 100)
    ///
    /// Raises:
    ///     InputError: fewer than 2 x 2 or more than 67,108,864 points, another ending.
    ///     FileError: writing failed. No file is left, and one that was there is untouched.
    fn write(&self, py: Python<'_>, path: Place, rows: &Bound<'_, PyAny>, columns: &Bound<'_, PyAny>) -> PyResult<()> {
        let points =
            |name: &str, given: &Bound<'_, PyAny>| count(name, given, 2, "Give the number of points along it.");
        let (rows, columns) = (points("rows", rows)?, points("columns", columns)?);
        let (fit, mirrored) = (self.fit.clone(), self.mirrored);
        let mesh = detached(py, move || fit.spline.sample(rows, columns, mirrored))?;
        write_quads(py, path, Arc::new(mesh), None)
    }

    fn __repr__(&self) -> String {
        let spline = &self.fit.spline;
        let (rows, cols, order) = (spline.rows, spline.cols, spline.order);
        format!("<Spline of order {order}, {rows} x {cols} control points, max residual {:.6}>", self.fit.max_residual)
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.adaptive_quads`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, InputError, TypeError: an option out of its range, both errors given, no such option, all at once.
    ///     Other errors are raised by ``result``.
    #[staticmethod]
    // options: quads
    #[pyo3(signature = (image, **options), text_signature = "(image, *, tiles_down=None, tiles_across=None, rows=9, columns=9, max_error=None, rms_error=None, gap_passes=1, gap_neighbours=8, curvature_unit=0.001, curvature_limit=255, exponent=0.7, floor=2.0, smoothing=2.0, background_curvature=None, coverage=0.5, threads=0)")]
    fn adaptive_quads(image: &RangeImage, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = QuadCall::new(image, options)?;
        Job::of(Background::start(move |progress| made_class(QuadGrid::from(call.run(progress)?))))
    }
}
