//! Sculpting: a range image to few triangles within a tolerance.

use std::sync::Arc;

use numpy::PyArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::sculpt::{SculptParams, Sculpted as Core, Sculptor as CoreSculptor, Tolerance};
use surfrecon::{Progress, RangeImage as CoreImage};

use crate::background::{Background, made, made_class};
use crate::errors::{parameter_error, reworded, to_python};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::{no_others, params, params_but};
use crate::progress::Watch;
use crate::range_image::RangeImage;
use crate::report;

/// Meshes a range image with few triangles, none farther from any sample than a tolerance.
///
/// Distances are measured along each sample's own ray. The mesh covers what ``RangeImage.triangulate`` covers: nothing
/// over invalid pixels, nothing across jumps. One exception: triangles that hide behind others, as seen along the rays
/// (``report.hidden_triangles``), are left out, and the tolerance does not hold for samples that have only such triangles.
/// These count as ``isolated_pixels``. The certificate does not measure them. Options that are ``None`` take their
/// defaults.
///
/// >>> sculpted = surfrecon.sculpt(image, tolerance=0.5)
/// >>> sculpted.max_error <= 0.5
/// True
/// >>> sculpted.mesh.write("scan.glb")
///
/// Args:
///     image: the range image.
#[doc = include_str!("params/sculpt.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``Sculpted`` with the mesh and its certificate.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: both tolerances given, an image that gives no triangle, or one that can't be used.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: sculpt
#[pyo3(signature = (image, *, progress = None, **options), text_signature = "(image, *, tolerance=None, relative_tolerance=0.001, effort=1, interpolate=True, min_angle=0.0, simplify_borders=False, edge_limit=None, grazing_limit=1.5707963267948966, threads=0, progress=None)")]
pub fn sculpt(
    py: Python<'_>,
    image: &RangeImage,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Sculpted> {
    let params: SculptParams = params("sculpt", options)?;
    let image = image.image();
    let (rows, cols) = (image.rows(), image.cols());
    let made = Watch::new(progress).run(py, |progress| surfrecon::sculpt::run(&image, &params, progress))?;
    Sculpted::new(py, made, rows, cols)
}

/// A number of triangles. More than there can be are as good as any.
fn number_of_triangles(given: &Bound<'_, PyAny>) -> PyResult<usize> {
    let given = given.call_method0("__index__").map_err(|error| {
        let kind = given.get_type().name().map_or_else(|_| "something else".to_owned(), |name| name.to_string());
        reworded(error, || {
            pyo3::exceptions::PyTypeError::new_err(format!("triangles must be a whole number, got {kind}"))
        })
    })?;
    if given.lt(0)? {
        return Err(parameter_error(format!("triangles must be a whole number >= 0, got {given}")));
    }
    Ok(given.extract().unwrap_or(usize::MAX))
}

/// A length in few digits.
fn shown(x: f64) -> String {
    if x == 0.0 || (1e-3..1e9).contains(&x.abs()) { format!("{x:.6}") } else { format!("{x:.6e}") }
}

/// A range image ready to be sculpted to one tolerance after the other.
///
/// Finds once where the mesh may be. The result of a tolerance does not depend on the tolerances before.
///
/// >>> sculptor = surfrecon.Sculptor(image)
/// >>> small = sculptor.at_most(1000)
/// >>> len(small.mesh.triangles) <= 1000
/// True
/// >>> fine, coarse = sculptor.levels([0.1, 1.0])
///
/// Args:
///     image: the range image. Changing it later does not change the sculptor.
///     effort, interpolate, min_angle, simplify_borders, edge_limit, grazing_limit, threads: as for ``sculpt``.
///
/// Raises:
///     ParameterError, InputError: as ``sculpt``.
#[pyclass(frozen, module = "surfrecon")]
pub struct Sculptor {
    sculptor: Arc<CoreSculptor<Arc<CoreImage>>>,
    rows: usize,
    cols: usize,
}

/// A sculptor to be made, free of Python.
pub struct PrepareCall {
    image: Arc<CoreImage>,
    params: SculptParams,
}

impl PrepareCall {
    /// Checks and takes the arguments of Python's `Sculptor`.
    ///
    /// # Errors
    /// `ParameterError`.
    pub fn new(image: &RangeImage, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let params = params_but(&["tolerance", "relative_tolerance"], "Sculptor", options)?;
        Ok(PrepareCall { image: image.image(), params })
    }

    /// Finds where the mesh may be.
    ///
    /// # Errors
    /// As [`CoreSculptor::prepare`].
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Sculptor> {
        let (rows, cols) = (self.image.rows(), self.image.cols());
        let sculptor = CoreSculptor::prepare(self.image.clone(), &self.params, progress)?;
        Ok(Sculptor { sculptor: Arc::new(sculptor), rows, cols })
    }
}

/// A call of ``Sculptor.refine`` with its arguments, to be run on any thread.
pub struct RefineCall {
    sculptor: Arc<CoreSculptor<Arc<CoreImage>>>,
    tolerance: Tolerance,
    size: [usize; 2],
}

impl RefineCall {
    pub fn new(sculptor: &Sculptor, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let tolerance = params("Sculptor.refine", options)?;
        Ok(RefineCall { sculptor: sculptor.sculptor.clone(), tolerance, size: [sculptor.rows, sculptor.cols] })
    }

    /// The result with the numbers of rows and columns.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<(Core, [usize; 2])> {
        Ok((self.sculptor.refine(self.tolerance, progress)?, self.size))
    }
}

#[pymethods]
impl Sculptor {
    #[new]
    // options: sculpt but tolerance relative_tolerance
    #[pyo3(signature = (image, *, progress = None, **options), text_signature = "(image, *, effort=1, interpolate=True, min_angle=0.0, simplify_borders=False, edge_limit=None, grazing_limit=1.5707963267948966, threads=0, progress=None)")]
    fn new(
        py: Python<'_>,
        image: &RangeImage,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = PrepareCall::new(image, options)?;
        Watch::new(progress).run(py, |progress| call.run(progress))
    }

    /// Difference between the farthest and the nearest range of the covered samples.
    #[getter]
    fn depth_extent(&self) -> f64 {
        self.sculptor.depth_extent()
    }

    /// The mesh within a tolerance, finer or coarser than any before. Arguments and errors as of ``sculpt``.
    ///
    /// >>> sculptor = surfrecon.Sculptor(image)
    /// >>> sculptor.refine(tolerance=0.2).tolerance
    /// 0.2
    // options: $self sculpt only tolerance relative_tolerance
    #[pyo3(signature = (*, progress = None, **options), text_signature = "($self, *, tolerance=None, relative_tolerance=0.001, progress=None)")]
    fn refine(
        &self,
        py: Python<'_>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Sculpted> {
        let tolerance: Tolerance = params("Sculptor.refine", options)?;
        let made = Watch::new(progress).run(py, |progress| self.sculptor.refine(tolerance, progress))?;
        Sculpted::new(py, made, self.rows, self.cols)
    }

    /// The mesh of the smallest tolerance found that has at most this many triangles.
    ///
    /// >>> found = surfrecon.Sculptor(image).at_most(1000)
    /// >>> len(found.mesh.triangles) <= 1000
    /// True
    ///
    /// Raises:
    ///     ParameterError: a number of triangles below 0.
    ///     InputError: no mesh that covers the image has so few.
    ///     Cancelled: ``progress`` returned ``False``.
    #[pyo3(signature = (triangles, *, progress = None, **others),
        text_signature = "($self, triangles, *, progress=None)")]
    fn at_most(
        &self,
        py: Python<'_>,
        triangles: &Bound<'_, PyAny>,
        progress: Option<Py<PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Sculpted> {
        no_others("Sculptor.at_most", others)?;
        let triangles = number_of_triangles(triangles)?;
        let made = Watch::new(progress).run(py, |progress| self.sculptor.at_most(triangles, progress))?;
        Sculpted::new(py, made, self.rows, self.cols)
    }

    /// A chain of levels of detail: a list of ``Sculpted``, one a tolerance (in the unit of the samples).
    ///
    /// >>> fine, coarse = surfrecon.Sculptor(image).levels([0.1, 1.0])
    /// >>> fine.mesh.write("levels.glb", coarser=[coarse.mesh])
    ///
    /// Raises:
    ///     ParameterError: a tolerance out of its range.
    ///     Cancelled: ``progress`` returned ``False``.
    #[pyo3(signature = (tolerances, *, progress = None, **others),
        text_signature = "($self, tolerances, *, progress=None)")]
    fn levels(
        &self,
        py: Python<'_>,
        tolerances: Vec<f64>,
        progress: Option<Py<PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Vec<Sculpted>> {
        no_others("Sculptor.levels", others)?;
        let absolute = |t: f64| Tolerance::Absolute(t).validate().map(|()| Tolerance::Absolute(t));
        let tolerances = tolerances.into_iter().map(absolute).collect::<surfrecon::Result<Vec<_>>>();
        let tolerances = tolerances.map_err(|e| to_python(&e))?;
        let made = Watch::new(progress).run_parts(py, |watch| {
            let refine = |(i, &t)| self.sculptor.refine(t, &watch.part(i, tolerances.len()));
            tolerances.iter().enumerate().map(refine).collect::<surfrecon::Result<Vec<_>>>()
        })?;
        made.into_iter().map(|made| Sculpted::new(py, made, self.rows, self.cols)).collect()
    }

    fn __repr__(&self) -> String {
        format!("<Sculptor of {} x {} pixels, depth extent {}>", self.rows, self.cols, shown(self.depth_extent()))
    }
}

/// A sculpted mesh with the certificate of its error, measured on the result by code of its own.
///
/// >>> sculpted = surfrecon.sculpt(image)
/// >>> bool(np.nanmax(abs(sculpted.error_image)) >= sculpted.max_error)
/// True
#[pyclass(frozen, module = "surfrecon")]
pub struct Sculpted {
    /// The surface, in the sensor's frame. Vertex attributes: ``range_row``, ``range_col``, ``error`` (largest of the
    /// vertex's triangles), and ``colour``, ``intensity``, ``confidence`` where the image has them. Attribute of the
    /// triangles: ``error``, the largest distance of the samples seen in it.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    core: Core,
    rows: usize,
    cols: usize,
}

impl Sculpted {
    pub fn new(py: Python<'_>, mut core: Core, rows: usize, cols: usize) -> PyResult<Self> {
        let mesh = Py::new(py, Mesh::from(std::mem::take(&mut core.mesh)))?;
        Ok(Sculpted { mesh, core, rows, cols })
    }
}

#[pymethods]
impl Sculpted {
    /// Tolerance used, in the unit of the samples.
    #[getter]
    fn tolerance(&self) -> f64 {
        self.core.report.tolerance
    }

    /// Largest distance between a sample and the mesh along the sample's ray.
    #[getter]
    fn max_error(&self) -> f64 {
        self.core.certificate.max_error
    }

    /// No sample lies farther from the mesh once its coordinates are rounded to single precision, as Blender, STL and glTF
    /// hold them. ``Mesh.write`` takes double precision where single precision would break the tolerance and the format
    /// has it (PLY, OBJ).
    #[getter]
    fn max_error_single(&self) -> f64 {
        self.core.certificate.max_error_single
    }

    /// Root of the mean square of the distances.
    #[getter]
    fn rms_error(&self) -> f64 {
        self.core.certificate.rms_error
    }

    /// 95 % of the samples lie at most this far from the mesh.
    #[getter]
    fn p95_error(&self) -> f64 {
        self.core.certificate.p95_error
    }

    /// (row, col) of the sample farthest from the mesh, ``None`` for an empty mesh.
    #[getter]
    fn worst_pixel(&self) -> Option<(usize, usize)> {
        self.core.certificate.worst_pixel.map(Into::into)
    }

    /// (rows, cols) float32: signed distance a pixel, positive where the mesh lies behind the sample, rounded away from 0. NaN
    /// where there is no mesh. Newly copied.
    #[getter]
    fn error_image<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let errors = numpy::PyArray1::from_slice(py, &self.core.certificate.error_image);
        Ok(errors.reshape([self.rows, self.cols])?.into_any())
    }

    /// Figures of the run: a ``SculptReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of_both(py, &self.core.report, &self.core.certificate)
    }

    fn __repr__(&self) -> String {
        let (report, worst) = (&self.core.report, self.core.certificate.max_error);
        let (triangles, full) = (report.triangles, report.full_triangles);
        let [worst, tolerance] = [worst, report.tolerance].map(shown);
        format!("<Sculpted {triangles} of {full} triangles, max error {worst}, tolerance {tolerance}>")
    }
}

#[pymethods]
impl Job {
    /// Starts ``Sculptor`` with the same arguments: the result is one.
    ///
    /// Raises:
    ///     ParameterError: like ``Sculptor``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: sculpt but tolerance relative_tolerance
    #[pyo3(signature = (image, **options), text_signature = "(image, *, effort=1, interpolate=True, min_angle=0.0, simplify_borders=False, edge_limit=None, grazing_limit=1.5707963267948966, threads=0)")]
    fn sculptor(image: &RangeImage, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = PrepareCall::new(image, options)?;
        Job::of(Background::start(move |progress| {
            progress.plan(&[("preparing", 1.0)]);
            made_class(call.run(progress)?)
        }))
    }

    /// Starts ``Sculptor.refine`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, InputError: like ``Sculptor.refine``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: sculpt only tolerance relative_tolerance
    #[pyo3(signature = (sculptor, **options), text_signature = "(sculptor, *, tolerance=None, relative_tolerance=0.001)")]
    fn refine(sculptor: &Sculptor, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = RefineCall::new(sculptor, options)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, (core, [rows, cols])| {
                Ok(Bound::new(py, Sculpted::new(py, core, rows, cols)?)?.into_any())
            })
        }))
    }
}
