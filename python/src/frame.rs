//! `Scan`: one of a set, still in its file. `Frame`: one that a depth camera or a phone recorded.

use std::path::PathBuf;

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use surfrecon::Progress;
use surfrecon::frame::Frame as Core;
use surfrecon::import;
use surfrecon::range_image::DepthKind;
use surfrecon::scan::VirtualCamera as Place;

use crate::arrays;
use crate::background::{Background, made, part};
use crate::crs;
use crate::edit::Edit;
use crate::errors::to_python;
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::no_others;
use crate::pickling::{self, Reduced};
use crate::point_cloud::PointCloud;
use crate::progress::Watch;
use crate::range_image::RangeImage;
use crate::report;
use crate::scan::Camera;
use crate::similarity::Given;

/// One scan of a set: where it is and where it stands. Its samples stay on disk until ``read``. Other processes are handed, by ``pickle``, the
/// path of its file and what is not in it.
///
/// >>> scan = scans[0]
/// >>> scan.name, scan.path.name, scan.world_from_sensor.shape
/// ('view0', 'view0.ply', (4, 4))
/// >>> image = scan.read()
#[pyclass(frozen, subclass, module = "surfrecon")]
pub struct Scan {
    pub scan: import::FileScan,
}

#[pymethods]
impl Scan {
    /// Name for people, unique within the set.
    #[getter]
    fn name(&self) -> &str {
        &self.scan.name
    }

    /// The file that holds the samples.
    #[getter]
    fn path(&self) -> PathBuf {
        self.scan.path.clone()
    }

    /// The number of the scan within its file, counted from 0.
    #[getter]
    fn part(&self) -> usize {
        self.scan.part
    }

    /// 4 x 4 float64: places the scan in the world.
    #[getter]
    fn world_from_sensor<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::matrix(py, &self.scan.world_from_sensor)
    }

    /// The coordinate reference system of the world that the scan lies in, as its file names it, or ``open`` was told: well-known
    /// text, or a code as ``EPSG:25832``. ``None`` where that is not known.
    ///
    /// Raises:
    ///     FileError: the file can't be read.
    #[getter]
    fn crs(&self) -> PyResult<Option<String>> {
        Ok(crs::text_of(self.scan.crs().map_err(|error| to_python(&error))?.as_ref()))
    }

    /// Whether it is left out if it is damaged, where many are read.
    #[getter]
    fn _is_one_of_many(&self) -> bool {
        self.scan.is_one_of_many()
    }

    /// Reads the samples: a ``RangeImage`` (placed in the world), a ``Mesh`` or a ``PointCloud`` (in their own frames).
    ///
    /// >>> images = [scan.read() for scan in scans]
    /// >>> len(images), images[0].name
    /// (6, 'view0')
    ///
    /// Args:
    ///     progress: called about every 30 ms as ``progress(stage, fraction)``. Returning ``False`` cancels.
    ///
    /// Raises:
    ///     FileError: the file can't be read.
    ///     FormatError: it does not hold what its format promises.
    ///     Cancelled: ``progress`` returned ``False``.
    #[pyo3(signature = (*, progress = None, **others), text_signature = "($self, *, progress=None)")]
    pub fn read<'py>(
        &self,
        py: Python<'py>,
        progress: Option<Py<PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        no_others("Scan.read", others)?;
        content_object(py, Watch::new(progress).run(py, |progress| self.scan.read_with(progress))?)
    }

    /// The scan with what a region holds, whenever it is read, merged or aligned. Nothing is read now. See ``surfrecon.keep``.
    ///
    /// Args:
    ///     region: a ``Box``, a ``Plane`` or a mask: (rows, cols) bool, or (n,) for a mesh or a cloud.
    ///
    /// Raises:
    ///     TypeError: what is no region. A mask of another size is an ``InputError`` when the scan is read.
    fn keep(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Py<Scan>> {
        to_object(py, Edit::select(region, true)?.of_scan(&self.scan)?)
    }

    /// The scan without what a region holds. Works as ``keep``.
    fn remove(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Py<Scan>> {
        to_object(py, Edit::select(region, false)?.of_scan(&self.scan)?)
    }

    /// The scan in another size and place: its pose now, its samples whenever it is read. See ``surfrecon.transformed``.
    fn transformed(&self, py: Python<'_>, similarity: Given) -> PyResult<Py<Scan>> {
        to_object(py, Edit::transform(&similarity.0).of_scan(&self.scan)?)
    }

    /// The arguments that make the scan again in a process that sees the same files. Its samples stay there.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        pickling::of_scan(py, &self.scan)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        format!("<Scan {:?} of {}>", self.scan.name, self.scan.path.display())
    }
}

/// One frame of a recording: a ``Scan`` whose colours and confidences can be had as they were recorded. Nothing is kept
/// in memory: each of its properties but ``pose`` reads the frame's files when it is asked for.
///
/// >>> frame = scans[0]
/// >>> frame.colour.shape, frame.image.points.shape  # as they were recorded
/// ((384, 512, 3), (192, 256, 3))
/// >>> surface = surfrecon.merge(scans).mesh  # frames are scans
#[pyclass(frozen, extends = Scan, module = "surfrecon")]
pub struct Frame;

/// The content of a file as a Python object.
///
/// # Errors
/// None but of Python itself.
pub fn content_object(py: Python<'_>, content: import::Content) -> PyResult<Bound<'_, PyAny>> {
    Ok(match content {
        import::Content::RangeImage(image) => Bound::new(py, RangeImage::from(image))?.into_any(),
        import::Content::Mesh(mesh) => Bound::new(py, Mesh::from(mesh))?.into_any(),
        import::Content::Points(cloud) => Bound::new(py, PointCloud { cloud: cloud.into() })?.into_any(),
    })
}

/// A scan as a Python object: a ``Frame`` if it is one.
///
/// # Errors
/// None but of Python itself.
pub fn to_object(py: Python<'_>, scan: import::FileScan) -> PyResult<Py<Scan>> {
    if !scan.is_frame() {
        return Py::new(py, Scan { scan });
    }
    let frame = PyClassInitializer::from(Scan { scan }).add_subclass(Frame);
    Ok(Bound::new(py, frame)?.into_super().unbind())
}

/// Reads something of a frame without the interpreter lock.
fn read<T: Send>(
    frame: &PyRef<'_, Frame>,
    read: impl FnOnce(&import::FileScan, &Progress<'_>) -> surfrecon::Result<T> + Send,
) -> PyResult<T> {
    let scan = &frame.as_super().scan;
    Watch::new(None).run(frame.py(), |progress| read(scan, progress))
}

/// The whole frame.
fn whole(scan: &import::FileScan, progress: &Progress<'_>) -> surfrecon::Result<Core> {
    Ok(scan.frame(progress)?.expect("a Frame is made of frames alone"))
}

#[pymethods]
impl Frame {
    /// Whether there is a colour image. It is not read.
    #[getter]
    fn has_colour(slf: PyRef<'_, Self>) -> bool {
        slf.as_super().scan.has_colour()
    }

    /// (rows, cols, 3) uint8 sRGB, the colour image at its own size, or ``None``.
    #[getter]
    fn colour<'py>(slf: PyRef<'py, Self>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(image) = read(&slf, import::FileScan::colour)? else { return Ok(None) };
        let [cols, rows] = image.size();
        let flat = PyArray1::from_vec(slf.py(), image.pixels.into_flattened());
        Ok(Some(flat.reshape([rows, cols, 3])?.into_any()))
    }

    /// (rows, cols) uint8, how far the sensor trusts its depths, in its own levels, or ``None``. Samples of the lowest
    /// level are left out of ``image``.
    #[getter]
    fn confidence<'py>(slf: PyRef<'py, Self>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(image) = read(&slf, import::FileScan::confidence)? else { return Ok(None) };
        let [cols, rows] = image.size;
        Ok(Some(PyArray1::from_vec(slf.py(), image.levels).reshape([rows, cols])?.into_any()))
    }

    /// The ``Camera`` of the colour image, placed in the world. Without a colour image, the camera of the depth image.
    #[getter]
    fn camera(slf: PyRef<'_, Self>) -> PyResult<Camera> {
        let world_from_sensor = slf.as_super().scan.world_from_sensor;
        let camera = match read(&slf, import::FileScan::colour)? {
            Some(image) => {
                let [cols, rows] = image.size();
                let projection = image.camera.projection(DepthKind::Planar);
                let world_from_colour = world_from_sensor * image.colour_from_depth.inverse();
                Place { rows, cols, projection, world_from_sensor: world_from_colour }
            }
            None => {
                let depth = read(&slf, whole)?.depth;
                Place { rows: depth.rows(), cols: depth.cols(), projection: *depth.projection(), world_from_sensor }
            }
        };
        camera.validate().map_err(|error| to_python(&error))?;
        Ok(Camera { camera })
    }

    /// 4 x 4 float64: ``world_from_sensor``, of the depth sensor.
    #[getter]
    fn pose<'py>(slf: PyRef<'py, Self>) -> Bound<'py, PyAny> {
        arrays::matrix(slf.py(), &slf.as_super().scan.world_from_sensor)
    }

    /// The depths as a ``RangeImage`` as they were recorded, nothing left out or removed, without colours, in true size.
    #[getter]
    fn depth(slf: PyRef<'_, Self>) -> PyResult<RangeImage> {
        Ok(read(&slf, whole)?.depth.into())
    }

    /// The ``RangeImage`` that ``read`` gives: depths that can be trusted, each with the colour that the colour camera
    /// sees there. Alpha is 0 where it sees none, since the sample lies outside of the colour image or behind a nearer
    /// one.
    #[getter]
    fn image(slf: PyRef<'_, Self>) -> PyResult<RangeImage> {
        match read(&slf, import::FileScan::read_with)? {
            import::Content::RangeImage(image) => Ok(image.into()),
            _ => unreachable!("a frame is a range image"),
        }
    }

    /// How many samples ``image`` leaves out: a ``LeftOutReport``.
    #[getter]
    fn left_out<'py>(slf: PyRef<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (_, out) = read(&slf, |scan, progress| whole(scan, progress)?.into_range_image(progress))?;
        report::of(slf.py(), &out)
    }

    fn __repr__(slf: PyRef<'_, Self>) -> String {
        let scan = &slf.as_super().scan;
        format!("<Frame {:?} of {}>", scan.name, scan.path.display())
    }
}

#[pymethods]
impl Job {
    /// Reads scans that ``surfrecon.open`` found, one after the other. The result is a list of what ``Scan.read`` gives.
    ///
    /// Raises:
    ///     TypeError: anything but scans. Other errors are raised by ``result``.
    #[staticmethod]
    fn read(scans: Vec<Py<Scan>>) -> PyResult<Self> {
        let scans: Vec<_> = scans.iter().map(|scan| scan.get().scan.clone()).collect();
        Job::of(Background::start(move |progress| {
            progress.plan(&[("reading", 1.0)]);
            let read = |(index, scan): (usize, &import::FileScan)| scan.read_with(&part(progress, index, scans.len()));
            let contents = scans.iter().enumerate().map(read).collect::<surfrecon::Result<Vec<_>>>()?;
            made(contents, |py, contents| {
                let objects = contents.into_iter().map(|content| content_object(py, content));
                Ok(PyList::new(py, objects.collect::<PyResult<Vec<_>>>()?)?.into_any())
            })
        }))
    }
}
