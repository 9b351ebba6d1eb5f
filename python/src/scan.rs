//! The virtual range scanner.

use std::sync::Arc;

use glam::DVec3;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use surfrecon::geom::bvh::Bvh;
use surfrecon::range_image::{DepthKind, Projection};
use surfrecon::scan::{self, ScanParams, TurntableViews};
use surfrecon::{Progress, TriMesh};

use crate::arrays;
use crate::background::{Background, made, part};
use crate::errors::{input_error, to_python};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::{self, count, no_others, params};
use crate::pickling::{self, Reduced, reduced};
use crate::progress::Watch;
use crate::projection;
use crate::range_image::RangeImage;

/// A virtual scanner: rows x cols pixels, how they see, and the true pose. It never changes.
///
/// Made by ``orthographic``, ``pinhole``, ``spherical`` or ``turntable``.
///
/// >>> camera = surfrecon.Camera.pinhole(120, 160, height_angle=0.8, eye=(0, -4, 2), target=(0, 0, 0))
/// >>> image = surfrecon.virtual_scan(mesh, camera)
/// >>> image.rows, image.cols
/// (120, 160)
#[pyclass(frozen, module = "surfrecon")]
pub struct Camera {
    pub camera: scan::VirtualCamera,
}

#[pymethods]
impl Camera {
    /// Parallel rays.
    ///
    /// >>> camera = surfrecon.Camera.orthographic(100, 100, spacing=0.03, target=(0, 0, 0), toward=(0, 1, 0))
    /// >>> image = surfrecon.virtual_scan(mesh, camera)
    ///
    /// Args:
    ///     rows, cols: size of the image.
    ///     spacing: distance of neighbouring pixels, in the unit of the mesh.
    ///     target: the point in the middle of the image.
    ///     toward: direction of view.
    ///     up: direction of row 0, z by default.
    ///
    /// Raises:
    ///     InputError: numbers that aren't usable.
    #[staticmethod]
    #[pyo3(signature = (rows, cols, *, spacing, target, toward, up = None, **others),
        text_signature = "(rows, cols, *, spacing, target, toward, up=None)")]
    fn orthographic(
        rows: &Bound<'_, PyAny>,
        cols: &Bound<'_, PyAny>,
        spacing: f64,
        target: &Bound<'_, PyAny>,
        toward: &Bound<'_, PyAny>,
        up: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Camera.orthographic", others)?;
        let [rows, cols] = size(rows, cols)?;
        camera_of(scan::VirtualCamera::orthographic(
            rows,
            cols,
            spacing,
            arrays::vector(target, "target")?,
            arrays::vector(toward, "toward")?,
            vertical(up, DVec3::Z)?,
        ))
    }

    /// A depth camera.
    ///
    /// >>> eye, target = (0, -4, 2), (0, 0, 0)
    /// >>> camera = surfrecon.Camera.pinhole(120, 160, height_angle=0.8, eye=eye, target=target)
    /// >>> camera.world_from_sensor[:3, 3]
    /// array([ 0., -4.,  2.])
    ///
    /// Args:
    ///     rows, cols: size of the image.
    ///     height_angle: angle between the first and the last row, radians.
    ///     eye: centre of projection.
    ///     target: the point in the middle of the image.
    ///     up: direction of row 0, z by default.
    ///
    /// Raises:
    ///     InputError: numbers that aren't usable.
    #[staticmethod]
    #[pyo3(signature = (rows, cols, *, height_angle, eye, target, up = None, **others),
        text_signature = "(rows, cols, *, height_angle, eye, target, up=None)")]
    fn pinhole(
        rows: &Bound<'_, PyAny>,
        cols: &Bound<'_, PyAny>,
        height_angle: f64,
        eye: &Bound<'_, PyAny>,
        target: &Bound<'_, PyAny>,
        up: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Camera.pinhole", others)?;
        let [rows, cols] = size(rows, cols)?;
        camera_of(scan::VirtualCamera::pinhole(
            rows,
            cols,
            height_angle,
            arrays::vector(eye, "eye")?,
            arrays::vector(target, "target")?,
            vertical(up, DVec3::Z)?,
        ))
    }

    /// A depth camera by its intrinsics and pose.
    ///
    /// >>> pose = np.diag([1.0, -1.0, -1.0, 1.0])  # it looks down
    /// >>> pose[2, 3] = 4.0
    /// >>> camera = surfrecon.Camera.intrinsic(
    /// ...     120, 160, focal=(150, 150), centre=(79.5, 59.5), world_from_sensor=pose
    /// ... )
    ///
    /// Args:
    ///     rows, cols: size of the image.
    ///     focal: focal lengths in pixels, across and down.
    ///     centre: column and row of the principal point. Pixel centres are whole numbers.
    ///     world_from_sensor: 4 x 4, rigid. The sensor looks along +z, x to the right, y down.
    ///
    /// Raises:
    ///     InputError: numbers that aren't usable, a pose that isn't rigid.
    #[staticmethod]
    #[pyo3(signature = (rows, cols, *, focal, centre, world_from_sensor, **others),
        text_signature = "(rows, cols, *, focal, centre, world_from_sensor)")]
    fn intrinsic(
        rows: &Bound<'_, PyAny>,
        cols: &Bound<'_, PyAny>,
        focal: [f64; 2],
        centre: [f64; 2],
        world_from_sensor: &Bound<'_, PyAny>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Camera.intrinsic", others)?;
        let [rows, cols] = size(rows, cols)?;
        let projection = Projection::Pinhole { focal, centre, depth: DepthKind::Planar };
        let world_from_sensor = arrays::rigid(world_from_sensor, "world_from_sensor")?;
        camera_of(Ok(scan::VirtualCamera { rows, cols, projection, world_from_sensor }))
    }

    /// A terrestrial scanner: all around, from ``lowest`` to ``highest`` elevation (radians), row 0 the highest.
    ///
    /// >>> camera = surfrecon.Camera.spherical(90, 360, lowest=-0.8, highest=0.8, eye=(0, 0, 0))
    /// >>> image = surfrecon.virtual_scan(mesh, camera)
    ///
    /// Args:
    ///     rows, cols: size of the image.
    ///     lowest, highest: elevations of the last and the first row, radians from the horizon.
    ///     eye: where it stands.
    ///     up: its vertical, z by default.
    ///
    /// Raises:
    ///     InputError: numbers that aren't usable.
    #[staticmethod]
    #[pyo3(signature = (rows, cols, *, lowest, highest, eye, up = None, **others),
        text_signature = "(rows, cols, *, lowest, highest, eye, up=None)")]
    fn spherical(
        rows: &Bound<'_, PyAny>,
        cols: &Bound<'_, PyAny>,
        lowest: f64,
        highest: f64,
        eye: &Bound<'_, PyAny>,
        up: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Camera.spherical", others)?;
        let [rows, cols] = size(rows, cols)?;
        camera_of(scan::VirtualCamera::spherical(
            rows,
            cols,
            lowest,
            highest,
            arrays::vector(eye, "eye")?,
            vertical(up, DVec3::Z)?,
        ))
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

    /// 4 x 4 float64: the true pose.
    #[getter]
    fn world_from_sensor<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::matrix(py, &self.camera.world_from_sensor)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        reduced("camera", pickling::attributes(slf, &["rows", "cols", "projection", "world_from_sensor"])?)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        format!("<Camera {} x {} pixels>", self.camera.rows, self.camera.cols)
    }
}

/// The size of an image.
fn size(rows: &Bound<'_, PyAny>, cols: &Bound<'_, PyAny>) -> PyResult<[usize; 2]> {
    let remedy = "Give the size of the image in pixels.";
    Ok([count("rows", rows, 0, remedy)?, count("cols", cols, 0, remedy)?])
}

/// The direction given as `up`, or the usual one.
fn vertical(up: Option<&Bound<'_, PyAny>>, usual: DVec3) -> PyResult<DVec3> {
    up.map_or(Ok(usual), |up| arrays::vector(up, "up"))
}

fn camera_of(camera: surfrecon::Result<scan::VirtualCamera>) -> PyResult<Camera> {
    let camera = camera.and_then(|camera| camera.validate().map(|()| camera)).map_err(|e| to_python(&e))?;
    Ok(Camera { camera })
}

/// Cameras around a mesh, each of which sees all of it: first a ring, then those above, then those below.
///
/// Options that are ``None`` take the library's default: eight around, two above, two below, z up, orthographic, 400 x 400
/// pixels.
///
/// >>> cameras = surfrecon.turntable(mesh, around=8, above=1, below=0, pixels=200)
/// >>> len(cameras), cameras[0].projection["kind"]
/// (9, 'orthographic')
///
/// Args:
///     mesh: what they look at.
///     around: cameras on a ring about the vertical.
///     above, below: cameras that look down, and up, from all sides.
///     elevation: their height over the ring, radians.
///     up: the vertical.
///     pixels: rows and columns of each image.
///     height_angle: angle between the first and the last row of a pinhole camera, radians. ``None``: orthographic.
///
/// Raises:
///     InputError: a mesh without size, a vertical without direction.
#[pyfunction]
#[pyo3(signature = (mesh, *, around = None, above = None, below = None, elevation = None, up = None, pixels = None, height_angle = None, **others),
    text_signature = "(mesh, *, around=None, above=None, below=None, elevation=None, up=None, pixels=None, height_angle=None)")]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn turntable<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    around: Option<&Bound<'_, PyAny>>,
    above: Option<&Bound<'_, PyAny>>,
    below: Option<&Bound<'_, PyAny>>,
    elevation: Option<f64>,
    up: Option<&Bound<'_, PyAny>>,
    pixels: Option<&Bound<'_, PyAny>>,
    height_angle: Option<f64>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Bound<'py, PyList>> {
    no_others("turntable", others)?;
    let default = TurntableViews::default();
    let count = |name: &str, given: Option<&Bound<'_, PyAny>>, default: usize| {
        given.map_or(Ok(default), |n| count(name, n, 0, "Leave it out for the default."))
    };
    let table = TurntableViews {
        around: count("around", around, default.around)?,
        above: count("above", above, default.above)?,
        below: count("below", below, default.below)?,
        elevation: elevation.unwrap_or(default.elevation),
        up: vertical(up, default.up)?,
        pixels: count("pixels", pixels, default.pixels)?,
        height_angle,
    };
    let Some(bounds) = scan::bounds(&mesh.mesh.positions) else {
        return Err(input_error("the mesh has no vertices, but a scan needs some".to_owned()));
    };
    let cameras = Watch::new(None).run(py, move |progress| scan::turntable(bounds, &table, progress))?;
    let list = PyList::empty(py);
    for (k, camera) in cameras.into_iter().enumerate() {
        if k % 4096 == 0 {
            py.check_signals()?;
        }
        list.append(camera_of(Ok(camera))?)?;
    }
    Ok(list)
}

/// Scans a mesh virtually: its colours come with it, and the truth is known.
///
/// Options that are ``None`` take their defaults, which add nothing to the truth. Of a list of cameras the k-th takes
/// ``seed + k``.
///
/// >>> cameras = surfrecon.turntable(mesh, pixels=100)
/// >>> images = surfrecon.virtual_scan(mesh, cameras, noise=0.001)
/// >>> surface = surfrecon.merge(images).mesh
///
/// Args:
///     mesh: what is scanned.
///     cameras: a ``Camera``, or a list of them.
#[doc = include_str!("params/scan.txt")]
///     progress: called as ``progress(stage, fraction)``. ``False`` cancels. Ctrl-C cancels as well.
///
/// Returns:
///     A ``RangeImage``, or a list of them, with the reported pose.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: scan
#[pyo3(signature = (mesh, cameras, *, progress = None, **options), text_signature = "(mesh, cameras, *, noise=0.0, noise_grazing=0.0, quantum=0.0, dropout=0.0, dropout_grazing=0.0, max_range=None, backfaces=False, pose_shift=0.0, pose_turn=0.0, seed=0, threads=0, progress=None)")]
pub fn virtual_scan<'py>(
    py: Python<'py>,
    mesh: &Mesh,
    cameras: &Bound<'py, PyAny>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let call = ScanCall::new(mesh, cameras, options)?;
    let images = Watch::new(progress).run_parts(py, |watch| call.run(|k, count| watch.part(k, count)))?;
    scanned(py, images, call.single)
}

/// The result of `virtual_scan`: an image, or a list of them.
///
/// # Errors
/// None but of Python itself.
pub fn scanned(py: Python<'_>, images: Vec<surfrecon::RangeImage>, single: bool) -> PyResult<Bound<'_, PyAny>> {
    let images =
        images.into_iter().map(|image| Bound::new(py, RangeImage::from(image))).collect::<PyResult<Vec<_>>>()?;
    match (single, images.into_iter()) {
        (true, mut images) => Ok(images.next().expect("an image a camera").into_any()),
        (false, images) => Ok(PyList::new(py, images)?.into_any()),
    }
}

/// Virtual scans with all they need, free of Python.
pub struct ScanCall {
    mesh: Arc<TriMesh>,
    cameras: Vec<scan::VirtualCamera>,
    params: ScanParams,
    /// Whether one camera was given, not a list.
    pub single: bool,
}

impl ScanCall {
    /// Checks and takes the arguments of Python's `virtual_scan`.
    ///
    /// # Errors
    /// `ParameterError`, `TypeError`.
    pub fn new(mesh: &Mesh, cameras: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let params = params("virtual_scan", options)?;
        let single = cameras.cast::<Camera>().is_ok();
        let cameras = if single {
            vec![cameras.cast::<Camera>()?.get().camera]
        } else {
            cameras.extract::<Vec<Bound<'_, Camera>>>()?.iter().map(|c| c.get().camera).collect()
        };
        Ok(ScanCall { mesh: mesh.mesh.clone(), cameras, params, single })
    }

    /// Scans with one camera after the other. `part` gives the progress of scan k of so many.
    ///
    /// # Errors
    /// See [`scan::scan`].
    pub fn run<'a>(
        &self,
        part: impl Fn(usize, usize) -> Progress<'a>,
    ) -> surfrecon::Result<Vec<surfrecon::RangeImage>> {
        let (positions, triangles) = (&self.mesh.positions, &self.mesh.triangles);
        let bvh = Bvh::build_with(positions, triangles, self.params.threads, &part(0, self.cameras.len().max(1)))?;
        let scan = |(k, camera)| {
            let params = ScanParams { seed: self.params.seed.wrapping_add(k as u64), ..self.params };
            scan::scan(&self.mesh, &bvh, camera, &params, &part(k, self.cameras.len()))
        };
        self.cameras.iter().enumerate().map(scan).collect()
    }
}

/// The rich shape of the demo: a horned serpent around a fluted column, 234 mm high, closed, with colours.
///
/// >>> shape = surfrecon.sculpture(cell=8)
/// >>> shape.check().is_closed, sorted(shape.vertex_attributes)
/// (True, ['colour'])
///
/// Args:
///     cell: edge of the lattice it is made with, mm. By default 1.8, which gives about 400,000 triangles.
///     threads: worker threads, 0 for one a core. The result is the same for any number.
///     progress: called with the stage's name and the share of the call that is done. ``False`` cancels.
///
/// Raises:
///     InputError: a cell below 0.5 or above 20.
///     Cancelled: the callback said so.
#[pyfunction]
#[pyo3(signature = (*, cell = None, threads = None, progress = None, **others),
    text_signature = "(*, cell=None, threads=None, progress=None)")]
pub fn sculpture(
    py: Python<'_>,
    cell: Option<f64>,
    threads: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    others: Option<&Bound<'_, PyDict>>,
) -> PyResult<Mesh> {
    no_others("sculpture", others)?;
    let threads = params::threads(threads)?;
    let cell = cell.unwrap_or(scan::sculpture::CELL);
    Watch::new(progress).run(py, move |progress| scan::sculpture::sculpture(cell, threads, progress)).map(Mesh::from)
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.virtual_scan`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``virtual_scan``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: scan
    #[pyo3(signature = (mesh, cameras, **options), text_signature = "(mesh, cameras, *, noise=0.0, noise_grazing=0.0, quantum=0.0, dropout=0.0, dropout_grazing=0.0, max_range=None, backfaces=False, pose_shift=0.0, pose_turn=0.0, seed=0, threads=0)")]
    fn virtual_scan(mesh: &Mesh, cameras: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = ScanCall::new(mesh, cameras, options)?;
        Job::of(Background::start(move |progress| {
            progress.plan(&[("scanning", 1.0)]);
            let images = call.run(|index, count| part(progress, index, count))?;
            let single = call.single;
            made(images, move |py, images| scanned(py, images, single))
        }))
    }
}
