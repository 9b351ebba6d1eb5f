//! `Photo`: a photo whose camera is known.

use std::path::Path;
use std::sync::Arc;

use glam::DAffine3;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::frame::Camera;
use surfrecon::photo::{self, Depths, Photo as Core, PhotoInMemory, Pixels};

use crate::arrays;
use crate::calling;
use crate::errors::to_python;
use crate::params::no_others;
use crate::progress::Watch;

// types:
// @final
// class Photo:
//     def __new__(
//         cls,
//         name: str,
//         pixels: ArrayLike | Callable[[], ArrayLike],
//         focal: tuple[float, float],
//         centre: tuple[float, float],
//         world_from_camera: ArrayLike,
//         depths: ArrayLike | None = None,
//         *,
//         shape: tuple[int, int] | None = None,
//     ) -> Photo: ...
//     @property
//     def name(self) -> str: ...
//     @property
//     def shape(self) -> tuple[int, int]: ...
//     @property
//     def focal(self) -> tuple[float, float]: ...
//     @property
//     def centre(self) -> tuple[float, float]: ...
//     @property
//     def world_from_camera(self) -> _Matrix: ...
//     def read(self) -> NDArray[np.uint8]: ...
//     def read_depths(self) -> NDArray[np.float32] | None: ...

/// A photo, wherever its pixels lie.
pub type AnyPhoto = Arc<dyn Core + Send + Sync>;

/// A photo whose camera is known, without distortion.
///
/// >>> frame = scans[0]
/// >>> camera = frame.camera
/// >>> focal, centre = camera.projection["focal"], camera.projection["centre"]
/// >>> photo = surfrecon.Photo(frame.name, frame.colour, focal, centre, camera.world_from_sensor)
/// >>> photo.shape == frame.colour.shape[:2]
/// True
///
/// A function can give the pixels whenever they are needed, so that they need not stay in memory:
///
/// >>> rows_and_cols = frame.colour.shape[:2]
/// >>> lazy = surfrecon.Photo(
/// ...     "lazy", lambda: frame.colour, focal, centre, camera.world_from_sensor, shape=rows_and_cols
/// ... )
/// >>> bool((lazy.read() == photo.read()).all())
/// True
///
/// Args:
///     name: for reports. Photos that are used together have different names.
///     pixels: (rows, cols, 3) or (rows, cols, 4) uint8 sRGB, row 0 at the top, or a function that returns this. Alpha is passed over. The
///         function is called on any thread, never on two at once, several times in a call, and must return the same each time. An
///         exception of it comes out of the call that needs the pixels.
///     focal: focal lengths in pixels, across and down.
///     centre: column and row of the principal point. Pixel centres are whole numbers.
///     world_from_camera: 4 x 4, rigid. The camera looks along +z, x to the right, y down.
///     depths: (rows, cols) of the photo or of a smaller image of the same view: what the camera measured along z, in the unit of the
///         mesh. 0 or NaN where nothing was measured.
///     shape: rows and columns that ``focal`` and ``centre`` are of. Those of the array by default, and needed with a function.
///
/// Raises:
///     InputError: numbers that aren't usable, a pose that isn't rigid.
///     TypeError: pixels that are neither an array nor a function, or a function without ``shape``.
#[pyclass(frozen, module = "surfrecon")]
pub struct Photo {
    pub photo: AnyPhoto,
}

/// A photo whose pixels a function of Python gives.
struct Called {
    name: String,
    camera: Camera,
    world_from_camera: DAffine3,
    pixels: Py<PyAny>,
    depths: Option<Depths>,
}

impl Core for Called {
    fn name(&self) -> &str {
        &self.name
    }

    fn camera(&self) -> Camera {
        self.camera
    }

    fn world_from_camera(&self) -> DAffine3 {
        self.world_from_camera
    }

    fn pixels(&self) -> surfrecon::Result<Pixels> {
        calling::attached(|py| pixels_of(&self.pixels.bind(py).call0()?, &self.name))
            .map_err(|error| surfrecon::Error::Io { path: Path::new(&self.name).to_owned(), source: error })
    }

    fn depths(&self) -> surfrecon::Result<Option<Depths>> {
        Ok(self.depths.clone())
    }
}

fn pixels_of(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Pixels> {
    let (size, colours) = arrays::image(value, &format!("the pixels of {name}"))?;
    Ok(Pixels { size, colours })
}

#[pymethods]
impl Photo {
    #[new]
    #[pyo3(signature = (name, pixels, focal, centre, world_from_camera, depths = None, *, shape = None, **others),
        text_signature = "(name, pixels, focal, centre, world_from_camera, depths=None, *, shape=None)")]
    #[expect(clippy::too_many_arguments, reason = "a camera has as many parts")]
    fn new(
        name: String,
        pixels: &Bound<'_, PyAny>,
        focal: [f64; 2],
        centre: [f64; 2],
        world_from_camera: &Bound<'_, PyAny>,
        depths: Option<&Bound<'_, PyAny>>,
        shape: Option<[usize; 2]>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Photo", others)?;
        let world_from_camera = arrays::rigid(world_from_camera, "world_from_camera")?;
        let depths = depths.map(depths_of).transpose()?;
        let size = shape.map(|[rows, cols]| [cols, rows]);
        let photo: AnyPhoto = if pixels.is_callable() {
            let Some(size) = size else {
                return Err(PyTypeError::new_err("shape must be (rows, cols) if a function gives the pixels"));
            };
            let camera = Camera::sized(focal, centre, size);
            Arc::new(Called { name, camera, world_from_camera, pixels: pixels.clone().unbind(), depths })
        } else {
            let pixels = pixels_of(pixels, &name)?;
            let camera = Camera::sized(focal, centre, size.unwrap_or(pixels.size));
            let photo = PhotoInMemory { name, camera, world_from_camera, pixels, depths };
            photo::pixels(&photo).map_err(|error| to_python(&error))?;
            Arc::new(photo)
        };
        photo::check(&*photo).and_then(|()| photo::depths(&*photo)).map_err(|error| to_python(&error))?;
        Ok(Photo { photo })
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        self.photo.name()
    }

    /// Rows and columns.
    #[getter]
    fn shape(&self) -> (usize, usize) {
        let [cols, rows] = self.photo.camera().size.unwrap_or_default();
        (rows, cols)
    }

    /// Focal lengths in pixels, across and down.
    #[getter]
    fn focal(&self) -> (f64, f64) {
        self.photo.camera().focal.into()
    }

    /// Column and row of the principal point. Pixel centres are whole numbers.
    #[getter]
    fn centre(&self) -> (f64, f64) {
        self.photo.camera().centre.into()
    }

    /// 4 x 4 float64: places the camera in the world.
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::matrix(py, &self.photo.world_from_camera())
    }

    /// Reads the pixels: (rows, cols, 3) uint8 sRGB.
    ///
    /// Raises:
    ///     FileError: a file that can't be read.
    ///     InputError: pixels of another size than the camera's.
    fn read<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Pixels { size: [cols, rows], colours } =
            Watch::new(None).run(py, |progress| progress.watch(|| photo::pixels(&*self.photo)))?;
        Ok(PyArray1::from_vec(py, colours.into_flattened()).reshape([rows, cols, 3])?.into_any())
    }

    /// Reads the depths: (rows, cols) float32 along the axis of the camera, or ``None``.
    ///
    /// Raises:
    ///     FileError: a file that can't be read.
    fn read_depths<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let depths = Watch::new(None).run(py, |progress| progress.watch(|| photo::depths(&*self.photo)))?;
        let Some(Depths { size: [cols, rows], values }) = depths else { return Ok(None) };
        Ok(Some(PyArray1::from_vec(py, values).reshape([rows, cols])?.into_any()))
    }

    fn __repr__(&self) -> String {
        let (rows, cols) = self.shape();
        format!("<Photo {:?} {rows} x {cols}>", self.name())
    }
}

fn depths_of(value: &Bound<'_, PyAny>) -> PyResult<Depths> {
    let (values, shape) = arrays::floats32(value, "depths", &[None, None])?;
    Ok(Depths { size: [shape[1], shape[0]], values })
}

/// The photos of a Python argument.
///
/// # Errors
/// `TypeError` naming what is no photo.
pub fn photos(given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<AnyPhoto>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    let one = |(i, item): (usize, PyResult<Bound<'_, PyAny>>)| {
        let item = item?;
        let photo = item.cast::<Photo>().map_err(|_| {
            PyTypeError::new_err(format!("photo {i} must be a surfrecon.Photo, got {}", item.get_type()))
        })?;
        Ok(photo.get().photo.clone())
    };
    given.try_iter()?.enumerate().map(one).collect()
}
