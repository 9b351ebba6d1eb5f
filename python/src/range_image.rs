//! `RangeImage`: a grid of samples with its projection and pose.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::DVec3;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::RangeImage as Core;
use surfrecon::export::{
    Holding, PlyEncoding, Provenance, tell_left_out, write_e57, write_ptx, write_range_grid_ply, write_scan_list,
};
use surfrecon::memory;
use surfrecon::range_image::{DepthKind, Projection, Samples};
use surfrecon::triangulate::{TriangulateParams, triangulate};
use surfrecon::vertices::{GridCamera as CoreCamera, to_mesh};

use crate::arrays;
use crate::crs;
use crate::edit::Edit;
use crate::errors::{guarded, input_error, parameter_error, to_python};
use crate::memory_folder::Place;
use crate::mesh::{Mesh, ending_of, provenance_of};
use crate::params::{no_others, params};
use crate::pickling::{self, Reduced, crs_part, reduced};
use crate::point_cloud::PointCloud;
use crate::progress::Watch;
use crate::projection;
use crate::similarity::Given;
use crate::vertices::{self, GridCamera, PerVertex};

/// A range image: rows x cols pixels, each measured or not, each with a viewing ray, placed in the world.
///
/// Made by ``from_points``, ``orthographic``, ``pinhole`` or ``spherical``, or by reading a file. Lengths are in the unit
/// of the samples, angles in radians. Pixels that are not finite are invalid. Arrays it returns are read-only views
/// without copying where the text says so. Setting an attribute never changes an array given out before.
///
/// >>> depths = np.full((48, 64), 2.0)
/// >>> image = surfrecon.RangeImage.pinhole(depths, focal=(50, 50), centre=(31.5, 23.5))
/// >>> image.points.shape, int(image.valid.sum())
/// ((48, 64, 3), 3072)
/// >>> image.world_from_sensor = np.eye(4)  # where it stands
#[pyclass(frozen, module = "surfrecon")]
pub struct RangeImage {
    /// Locked no longer than it takes to look or to change: a call works on what it found, whatever callbacks and other
    /// threads change meanwhile.
    image: Mutex<Arc<Core>>,
}

impl From<Core> for RangeImage {
    fn from(image: Core) -> Self {
        Arc::new(image).into()
    }
}

impl From<Arc<Core>> for RangeImage {
    fn from(image: Arc<Core>) -> Self {
        RangeImage { image: Mutex::new(image) }
    }
}

impl RangeImage {
    /// The image as it is now. Later changes don't reach it.
    pub fn image(&self) -> Arc<Core> {
        self.locked().clone()
    }

    fn locked(&self) -> MutexGuard<'_, Arc<Core>> {
        self.image.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn edited(&self, py: Python<'_>, edit: &Edit) -> PyResult<Self> {
        let image = self.image();
        Ok(Watch::new(None).run(py, |progress| edit.of_image(&image, progress))?.into())
    }

    fn pixels(&self) -> [Option<usize>; 2] {
        let image = self.image();
        [Some(image.rows()), Some(image.cols())]
    }

    fn change(&self, change: impl FnOnce(&mut Core)) {
        // Copies if an array or a running call still shares the image.
        change(Arc::make_mut(&mut self.locked()));
    }
}

fn made(image: surfrecon::Result<Core>, name: Option<String>) -> PyResult<RangeImage> {
    let mut image = image.map_err(|e| to_python(&e))?;
    image.name = name.unwrap_or_default();
    image.leave_out_what_is_no_measurement();
    Ok(image.into())
}

/// Largest share of the distance of neighbouring samples by which single precision may move a point.
const DETAIL: f64 = 0.05;

/// Refuses points that single precision would move by more than [`DETAIL`].
fn keeps_detail(exact: &[f64], rounded: &[f32], cols: usize) -> PyResult<()> {
    let moved = exact.iter().zip(rounded).map(|(&x, &y)| (x - f64::from(y)).abs()).filter(|d| !d.is_nan());
    let moved = moved.fold(0.0, f64::max);
    if moved == 0.0 {
        return Ok(());
    }
    let points = arrays::vectors(exact.to_vec());
    let rows = points.chunks_exact(cols.max(1));
    let mut steps: Vec<f64> = rows.flat_map(|row| row.windows(2).map(|p| p[0].distance(p[1]))).collect();
    steps.retain(|d| d.is_finite());
    if steps.is_empty() {
        return Ok(());
    }
    let middle = steps.len() / 2;
    let step = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    if moved <= DETAIL * step {
        return Ok(());
    }
    Err(input_error(format!(
        "points are kept as float32, which moves some by {moved:.3e} where samples are {step:.3e} apart: subtract an \
         offset and put it into world_from_sensor"
    )))
}

/// Writes images with their poses: as PTX, as E57, or as Stanford range grids and the list of that ending.
///
/// # Errors
/// Those of the writers.
pub fn write_together(
    py: Python<'_>,
    path: Place,
    ending: &str,
    images: &[Arc<Core>],
    provenance: Option<Provenance>,
    progress: Option<Py<PyAny>>,
) -> PyResult<()> {
    Watch::new(progress).run(py, move |progress| {
        let images: Vec<&Core> = images.iter().map(Arc::as_ref).collect();
        match ending {
            "ptx" => write_ptx(&path, &images, progress),
            "conf" => write_scan_list(&path, &images, PlyEncoding::default(), progress),
            _ => write_e57(&path, &images, provenance.as_ref(), progress),
        }?;
        tell_left_out(&path, Holding::Images, images.iter().find_map(|image| image.crs.as_ref()));
        Ok(())
    })
}

#[pymethods]
impl RangeImage {
    /// A range image of one point a pixel.
    ///
    /// >>> x, y = np.meshgrid(np.arange(64.0), np.arange(48.0))
    /// >>> points = np.stack([x, y, np.where(x < 60, 9.0, np.nan)], axis=-1)  # the last columns see nothing
    /// >>> image = surfrecon.RangeImage.from_points(points, name="wall")
    /// >>> int(image.valid.sum())
    /// 2880
    ///
    /// Args:
    ///     points: (rows, cols, 3) real numbers in the sensor's frame, kept as float32. Not finite or masked: invalid
    ///         pixel. Large offsets belong into ``world_from_sensor``.
    ///     viewing: ``("parallel", direction)`` or ``("from", origin)`` in the sensor's frame. By default parallel along
    ///         -z, the sensor at +z.
    ///     name: for messages and reports.
    ///
    /// Raises:
    ///     InputError: wrong shape, a viewing direction that isn't usable, or points so far from the origin that float32
    ///         would lose their detail.
    ///     TypeError: entries that aren't real numbers.
    #[staticmethod]
    #[pyo3(signature = (points, *, viewing = None, name = None, **others),
        text_signature = "(points, *, viewing=None, name=None)")]
    fn from_points(
        points: &Bound<'_, PyAny>,
        viewing: Option<&Bound<'_, PyAny>>,
        name: Option<String>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("RangeImage.from_points", others)?;
        let viewing = projection::viewing(viewing)?;
        guarded(|| {
            let (exact, shape) = arrays::floats(points, "points", &[None, None, Some(3)])?;
            points.py().check_signals()?;
            let coordinates: Vec<f32> = exact.iter().map(|&x| x as f32).collect();
            arrays::check_single(&exact, &coordinates, 0, "points")?;
            keeps_detail(&exact, &coordinates, shape[1])?;
            drop(exact);
            points.py().check_signals()?;
            let points: Vec<[f32; 3]> = bytemuck::cast_slice(&coordinates).to_vec();
            drop(coordinates);
            made(Core::from_points(shape[0], shape[1], points, viewing), name)
        })
    }

    /// A height map: rays along -z, ``values`` are z.
    ///
    /// >>> heights = np.random.default_rng(0).random((100, 80))
    /// >>> terrain = surfrecon.RangeImage.orthographic(heights, step=(0.5, -0.5), first=(1000, 2000))
    /// >>> terrain.points[0, 0, :2]  # x and y of row 0, column 0
    /// array([1000., 2000.])
    ///
    /// Args:
    ///     values: (rows, cols) real numbers. Not finite or masked: invalid pixel.
    ///     step: x from column to column and y from row to row. Negative y puts row 0 at the top.
    ///     first: x and y of pixel (0, 0).
    ///     name: for messages and reports.
    ///
    /// Raises:
    ///     InputError: wrong shape or a step of 0.
    #[staticmethod]
    #[pyo3(signature = (values, *, step, first = (0.0, 0.0), name = None, **others),
        text_signature = "(values, *, step, first=(0.0, 0.0), name=None)")]
    fn orthographic(
        values: &Bound<'_, PyAny>,
        step: (f64, f64),
        first: (f64, f64),
        name: Option<String>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("RangeImage.orthographic", others)?;
        let projection = Projection::Orthographic { first: first.into(), step: step.into() };
        from_values(values, projection, name)
    }

    /// A depth camera's image: x to the right, y down, z forward.
    ///
    /// >>> depths = np.array([[500, 510], [0, 505]])
    /// >>> image = surfrecon.RangeImage.pinhole(
    /// ...     np.where(depths > 0, depths / 1000, np.nan), focal=(525, 525), centre=(0.5, 0.5)
    /// ... )
    /// >>> int(image.valid.sum())
    /// 3
    ///
    /// Args:
    ///     values: (rows, cols) real numbers. Not finite or masked: invalid pixel.
    ///     focal: fx and fy in pixels.
    ///     centre: cx and cy in pixels, pixel centres at whole numbers.
    ///     depth: what values measure: ``"planar"`` (z) or ``"ray"`` (distance along the ray).
    ///     name: for messages and reports.
    ///
    /// Raises:
    ///     InputError: wrong shape, or a focal length of 0.
    #[staticmethod]
    #[pyo3(signature = (values, *, focal, centre, depth = "planar", name = None, **others),
        text_signature = "(values, *, focal, centre, depth='planar', name=None)")]
    fn pinhole(
        values: &Bound<'_, PyAny>,
        focal: (f64, f64),
        centre: (f64, f64),
        depth: &str,
        name: Option<String>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("RangeImage.pinhole", others)?;
        let depth = DepthKind::named(depth)
            .ok_or_else(|| parameter_error(format!("depth must be \"planar\" or \"ray\", got {depth:?}")))?;
        from_values(values, Projection::Pinhole { focal: focal.into(), centre: centre.into(), depth }, name)
    }

    /// A terrestrial scan: ``values`` are distances along the rays.
    ///
    /// >>> distances = np.full((90, 360), 5.0)
    /// >>> step = np.radians(1.0)
    /// >>> room = surfrecon.RangeImage.spherical(distances, step=(step, -step), first=(0, 45 * step))
    ///
    /// Args:
    ///     values: (rows, cols) real numbers. Not finite or masked: invalid pixel.
    ///     step: azimuth from column to column and elevation from row to row, radians.
    ///     first: azimuth and elevation of pixel (0, 0), radians. Azimuth turns from +x toward +y, elevation toward +z.
    ///     name: for messages and reports.
    ///
    /// Raises:
    ///     InputError: wrong shape or a step of 0.
    #[staticmethod]
    #[pyo3(signature = (values, *, step, first = (0.0, 0.0), name = None, **others),
        text_signature = "(values, *, step, first=(0.0, 0.0), name=None)")]
    fn spherical(
        values: &Bound<'_, PyAny>,
        step: (f64, f64),
        first: (f64, f64),
        name: Option<String>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("RangeImage.spherical", others)?;
        let projection = Projection::Spherical { first: first.into(), step: step.into() };
        from_values(values, projection, name)
    }

    /// The image that a host's vertices are, however its user moved them: what ``to_mesh`` gave, less deleted vertices.
    ///
    /// If all were moved, turned, scaled and mirrored alike, in single precision, and each lies on its pixel's ray, the
    /// projection stays of its kind, with parameters scaled and mirrored. If they were stretched or edited one by one,
    /// it becomes a grid of points seen from where it was. Samples lie in the world where the vertices do.
    ///
    /// >>> mesh, camera = image.to_mesh(), image.grid_camera()  # what a host keeps
    /// >>> row, col = mesh.vertex_attributes["range_row"], mesh.vertex_attributes["range_col"]
    /// >>> again = surfrecon.RangeImage.from_vertices(camera, row, col, mesh.positions)
    /// >>> np.array_equal(again.valid, image.valid)
    /// True
    ///
    /// Args:
    ///     camera: what ``grid_camera`` gave, scaled as the vertices are if the host has another unit.
    ///     row, col: (n,) integers, the pixel of each vertex.
    ///     positions: (n, 3) real numbers in the host's frame.
    ///     world_from_host: 4 x 4, any affine matrix. By default the identity.
    ///     colour: (n, 3) or (n, 4), uint8 or floats of 0 to 1, sRGB.
    ///     intensity: (n,) real numbers.
    ///     confidence: (n,) real numbers >= 0.
    ///     name: for messages and reports.
    ///
    /// Raises:
    ///     InputError: a pixel outside of the grid or there twice, positions that are not finite, vertices scaled by 0, wrong
    ///         shapes, a grid far too large for its vertices.
    ///     TypeError: entries of another type.
    #[staticmethod]
    #[pyo3(signature = (camera, row, col, positions, *, world_from_host = None, colour = None, intensity = None, confidence = None, name = None, **others),
        text_signature = "(camera, row, col, positions, *, world_from_host=None, colour=None, intensity=None, confidence=None, name=None)")]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn from_vertices(
        camera: &GridCamera,
        row: &Bound<'_, PyAny>,
        col: &Bound<'_, PyAny>,
        positions: &Bound<'_, PyAny>,
        world_from_host: Option<&Bound<'_, PyAny>>,
        colour: Option<&Bound<'_, PyAny>>,
        intensity: Option<&Bound<'_, PyAny>>,
        confidence: Option<&Bound<'_, PyAny>>,
        name: Option<String>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("RangeImage.from_vertices", others)?;
        let given = PerVertex { row, col, positions, colour, intensity, confidence };
        let mut image = vertices::image(camera, &given, world_from_host)?;
        image.name = name.unwrap_or_default();
        Ok(image.into())
    }

    /// Name for messages and reports.
    #[getter]
    fn name(&self) -> String {
        self.image().name.clone()
    }

    #[setter]
    fn set_name(&self, name: String) {
        self.change(|image| image.name = name);
    }

    /// The coordinate reference system of the world that it is placed in, as files name it: well-known text, or a code as
    /// ``EPSG:25832``. ``None`` where that is not known.
    #[getter]
    fn crs(&self) -> Option<String> {
        crs::text_of(self.image().crs.as_ref())
    }

    #[setter]
    fn set_crs(&self, crs: Option<crs::CrsText>) -> PyResult<()> {
        let crs = crs::crs_of(crs)?;
        self.change(|image| image.crs = crs);
        Ok(())
    }

    /// Number of rows.
    #[getter]
    fn rows(&self) -> usize {
        self.image().rows()
    }

    /// Number of columns.
    #[getter]
    fn cols(&self) -> usize {
        self.image().cols()
    }

    /// How pixels see: a dict with ``kind`` and its parameters.
    #[getter]
    fn projection<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        projection::described(py, self.image().projection())
    }

    /// (rows, cols, 3) in the sensor's frame, NaN where invalid: a read-only float32 view for images made from points,
    /// otherwise newly computed as float64.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let image = self.image();
        let (rows, cols) = (image.rows(), image.cols());
        if let Samples::Points(_) = image.samples() {
            return arrays::view(py, &image, flat_points, (rows, cols, 3));
        }
        let points = all_points(py, image.clone(), Core::point_in_sensor)?;
        Ok(PyArray1::from_vec(py, points).reshape([rows, cols, 3])?.into_any())
    }

    /// (3,) float64: where its rays start, in the world. ``None`` where they are parallel.
    #[getter]
    fn sensor<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.image().sensor().map(|sensor| PyArray1::from_slice(py, &sensor.to_array()).into_any())
    }

    /// (rows, cols, 3) float64 in the world, NaN where invalid, newly computed.
    fn world_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let image = self.image();
        let (rows, cols) = (image.rows(), image.cols());
        let points = all_points(py, image, Core::point_in_world)?;
        Ok(PyArray1::from_vec(py, points).reshape([rows, cols, 3])?.into_any())
    }

    /// (rows, cols) float64 as the projection measures them, NaN where invalid, a read-only view. ``None`` for images made
    /// from points.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let image = self.image();
        match image.samples() {
            Samples::Values(_) => arrays::view(py, &image, flat_values, (image.rows(), image.cols())).map(Some),
            Samples::Points(_) => Ok(None),
        }
    }

    /// (rows, cols) bool: which pixels were measured, newly computed.
    #[getter]
    fn valid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let image = self.image();
        let valid: Vec<bool> = guarded(|| Ok((0..image.len()).map(|i| image.is_valid(i)).collect()))?;
        let array = PyArray1::from_vec(py, valid).reshape([image.rows(), image.cols()])?;
        Ok(array.into_any())
    }

    /// 4 x 4 float64, rigid: places the sensor's frame in the world. Set from a matrix whose axes are orthonormal within
    /// 0.02: it becomes the nearest rotation, as the poses of files do.
    #[getter]
    fn world_from_sensor<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::matrix(py, &self.image().world_from_sensor)
    }

    #[setter]
    fn set_world_from_sensor(&self, pose: &Bound<'_, PyAny>) -> PyResult<()> {
        let pose = arrays::rigid(pose, "world_from_sensor")?;
        self.change(|image| image.world_from_sensor = pose);
        Ok(())
    }

    /// (rows, cols, 4) uint8 sRGB with alpha, a read-only view, or ``None``. Set from (rows, cols, 3 or 4), uint8 or floats
    /// of 0 to 1.
    #[getter]
    fn colour<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let image = self.image();
        if image.colour.is_none() {
            return Ok(None);
        }
        arrays::view(py, &image, flat_colour, (image.rows(), image.cols(), 4)).map(Some)
    }

    #[setter]
    fn set_colour(&self, colour: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let colour = colour.map(|c| arrays::colours(c, "colour", &self.pixels())).transpose()?;
        self.change(|image| image.colour = colour);
        Ok(())
    }

    /// (rows, cols) float32, a read-only view, or ``None``: strength of the returned signal in the sensor's unit.
    #[getter]
    fn intensity<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let image = self.image();
        if image.intensity.is_none() {
            return Ok(None);
        }
        arrays::view(py, &image, flat_intensity, (image.rows(), image.cols())).map(Some)
    }

    #[setter]
    fn set_intensity(&self, intensity: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let intensity = intensity.map(|i| arrays::floats32(i, "intensity", &self.pixels())).transpose()?;
        self.change(|image| image.intensity = intensity.map(|i| i.0));
        Ok(())
    }

    /// (rows, cols) float32 >= 0, a read-only view, or ``None``: computed from the geometry when needed.
    #[getter]
    fn confidence<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let image = self.image();
        if image.confidence.is_none() {
            return Ok(None);
        }
        arrays::view(py, &image, flat_confidence, (image.rows(), image.cols())).map(Some)
    }

    #[setter]
    fn set_confidence(&self, confidence: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let confidence = confidence.map(|c| arrays::floats32(c, "confidence", &self.pixels())).transpose()?;
        if let Some((confidence, _)) = &confidence {
            let image = self.image();
            let bad =
                (0..image.len()).find(|&i| image.is_valid(i) && !(confidence[i] >= 0.0 && confidence[i].is_finite()));
            if let Some(i) = bad {
                let (row, col, value) = (i / image.cols(), i % image.cols(), confidence[i]);
                return Err(input_error(format!(
                    "confidence of pixel ({row}, {col}) must be a finite number >= 0, got {value}"
                )));
            }
        }
        self.change(|image| image.confidence = confidence.map(|c| c.0));
        Ok(())
    }

    /// Writes the image: ``.ply`` as a Stanford range grid (binary, without its pose: see ``write_scans``),
    /// ``.ptx`` or ``.e57`` with its pose.
    ///
    /// >>> image.write("scan.ply")
    /// >>> np.array_equal(surfrecon.read("scan.ply").valid, image.valid)
    /// True
    ///
    /// Args:
    ///     path: the file.
    ///     provenance: what an ``.e57`` says of where it is from: as for ``write_scans``.
    ///     progress: called with the stage's name and the share of the call that is done. ``False`` cancels.
    ///
    /// Raises:
    ///     InputError: a name that ends otherwise. For ``.ply`` rays that go round more than half a sphere, for the
    ///         others parallel rays.
    ///     FileError: writing failed. No file is left, and one that was there is untouched.
    ///     Cancelled: the callback said so. Files are as after a failure.
    #[pyo3(signature = (path, *, provenance = None, progress = None, **others),
        text_signature = "($self, path, *, provenance=None, progress=None)")]
    fn write(
        &self,
        py: Python<'_>,
        path: Place,
        provenance: Option<&Bound<'_, PyAny>>,
        progress: Option<Py<PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<()> {
        no_others("RangeImage.write", others)?;
        let image = self.image();
        let ending = ending_of(&path, Holding::Image)?;
        if ending != "ply" {
            return write_together(py, path, ending, &[image], provenance_of(provenance)?, progress);
        }
        Watch::new(progress).run(py, move |progress| {
            write_range_grid_ply(&path, &image, PlyEncoding::default(), progress)?;
            tell_left_out(&path, Holding::Image, image.crs.as_ref());
            Ok(())
        })
    }

    /// Triangulates the grid, leaving out jumps.
    ///
    /// The mesh is in the sensor's frame, with the vertex attributes ``confidence``, ``range_row``, ``range_col`` and, where
    /// the image has them, ``colour`` and ``intensity``. Each vertex is a valid pixel that has a triangle.
    ///
    /// >>> mesh = image.triangulate()
    /// >>> certain = image.triangulate(grazing_limit=np.radians(60))
    /// >>> len(certain.triangles) < len(mesh.triangles)
    /// True
    ///
    /// Args:
    #[doc = include_str!("params/triangulate.txt")]
    ///
    /// Raises:
    ///     ParameterError: a limit out of its range.
    ///     InputError: an image that gives no triangle, or one that can't be used.
    // options: $self triangulate
    #[pyo3(signature = (**options), text_signature = "($self, *, edge_limit=None, grazing_limit=1.5707963267948966)")]
    fn triangulate(&self, py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Mesh> {
        let params: TriangulateParams = params("RangeImage.triangulate", options)?;
        let image = self.image();
        let made = Watch::new(None)
            .run(py, move |progress| triangulate(&image, &params, progress)?.into_mesh(&image, progress));
        made.map(Mesh::from)
    }

    /// The valid pixels as the vertices of a mesh, row by row, in the sensor's frame: how hosts keep a range image.
    ///
    /// With the vertex attributes ``range_row``, ``range_col`` and, where the image has them, ``colour``, ``intensity`` and
    /// ``confidence``. ``from_vertices`` makes an image of them again, ``grid_camera`` is what it needs besides.
    ///
    /// Args:
    ///     faces: also the triangles of ``triangulate`` with its defaults, over the same vertices.
    ///
    /// Raises:
    ///     InputError: coordinates too large to be computed with.
    #[pyo3(signature = (faces = true))]
    fn to_mesh(&self, py: Python<'_>, faces: bool) -> PyResult<Mesh> {
        let image = self.image();
        Watch::new(None).run(py, move |progress| to_mesh(&image, faces, progress)).map(Mesh::from)
    }

    /// The valid pixels as a ``PointCloud``, row after row, in the sensor's frame: with normals, colours, the pose, and where the rays
    /// start, by which ``reconstruct`` tells jumps.
    ///
    /// Raises:
    ///     InputError: coordinates too large to be computed with.
    fn to_cloud(&self, py: Python<'_>) -> PyResult<PointCloud> {
        let image = self.image();
        let cloud = Watch::new(None).run(py, move |progress| image.to_point_cloud(progress))?;
        Ok(PointCloud { cloud: Arc::new(cloud) })
    }

    /// The data that a host keeps beside the vertices of ``to_mesh``: how pixels see, and where some of the vertices were.
    fn grid_camera(&self, py: Python<'_>) -> PyResult<GridCamera> {
        let image = self.image();
        Watch::new(None).run(py, move |progress| CoreCamera::of(&image, progress)).map(GridCamera::from)
    }

    /// The image with what a region holds: see ``surfrecon.keep``.
    ///
    /// Args:
    ///     region: a ``Box``, a ``Plane`` or a mask, (rows, cols) bool.
    ///
    /// Raises:
    ///     InputError: a mask of another size.
    ///     TypeError: what is no region.
    fn keep(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.edited(py, &Edit::select(region, true)?)
    }

    /// The image without what a region holds. Works as ``keep``.
    fn remove(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.edited(py, &Edit::select(region, false)?)
    }

    /// The image in another size and place, its pose still rigid: see ``surfrecon.transformed``.
    fn transformed(&self, py: Python<'_>, similarity: Given) -> PyResult<Self> {
        self.edited(py, &Edit::transform(&similarity.0))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let image = self.image();
        let samples = if let Samples::Points(_) = image.samples() { "points" } else { "values" };
        let names = ["name", "rows", "cols", "projection", "world_from_sensor", "colour", "intensity", "confidence"];
        // As it is now, whatever other threads change meanwhile.
        let now = Bound::new(py, RangeImage::from(image.clone()))?;
        let parts = pickling::attributes(&now, &names)?;
        parts.set_item(samples, now.getattr(samples)?)?;
        parts.set_item("crs", crs_part(image.crs.as_ref()))?;
        reduced("image", parts)
    }

    /// An image of its own: setting an attribute of one changes nothing of the other.
    fn __copy__(&self) -> Self {
        self.image().into()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.image().into()
    }

    fn __repr__(&self) -> String {
        let image = self.image();
        let name = if image.name.is_empty() { String::new() } else { format!(" {:?}", image.name) };
        format!("<RangeImage{name} {} x {} pixels, {} valid>", image.rows(), image.cols(), image.valid_count())
    }
}

fn from_values(values: &Bound<'_, PyAny>, projection: Projection, name: Option<String>) -> PyResult<RangeImage> {
    guarded(|| {
        let (values, shape) = arrays::floats(values, "values", &[None, None])?;
        made(Core::from_values(shape[0], shape[1], values, projection), name)
    })
}

/// A point a pixel, three numbers each.
fn all_points(py: Python<'_>, image: Arc<Core>, point: fn(&Core, usize) -> DVec3) -> PyResult<Vec<f64>> {
    Watch::new(None).run(py, move |progress| {
        let bytes = size_of::<DVec3>() as f64;
        memory::foresee(image.len(), bytes, "the points of", "pixels")?;
        progress.watch(|| {
            let mut points = Vec::with_capacity(image.len());
            for block in progress.ranges(image.len()) {
                points.extend(block?.map(|pixel| point(&image, pixel).to_array()));
            }
            Ok(points.into_flattened())
        })
    })
}

fn flat_points(image: &Core) -> &[f32] {
    if let Samples::Points(points) = image.samples() { points.as_flattened() } else { &[] }
}

fn flat_values(image: &Core) -> &[f64] {
    if let Samples::Values(values) = image.samples() { values } else { &[] }
}

fn flat_colour(image: &Core) -> &[u8] {
    image.colour.as_deref().unwrap_or_default().as_flattened()
}

fn flat_intensity(image: &Core) -> &[f32] {
    image.intensity.as_deref().unwrap_or_default()
}

fn flat_confidence(image: &Core) -> &[f32] {
    image.confidence.as_deref().unwrap_or_default()
}
