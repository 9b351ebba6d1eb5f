//! Images of meshes, made of photos.

use std::sync::Arc;

use glam::DMat4;
use numpy::{Element, PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::error::counted;
use surfrecon::mesh::Tile;
use surfrecon::texture::{TextureParams, Textured as Core};
use surfrecon::{Progress, TriMesh};

use crate::arrays;
use crate::background::{Background, made_class};
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::params;
use crate::photo::{AnyPhoto, photos};
use crate::progress::Watch;
use crate::report;

// types:
// @final
// class Textured:
//     @property
//     def size(self) -> int: ...
//     @property
//     def tiles(self) -> list[TextureTile]: ...
//     @property
//     def world_from_camera(self) -> NDArray[np.float64]: ...
//     @property
//     def report(self) -> TextureReport: ...
//
// @final
// class TextureTile:
//     @property
//     def colour(self) -> NDArray[np.uint8]: ...
//     @property
//     def mask(self) -> NDArray[np.uint8]: ...
//     @property
//     def normal(self) -> NDArray[np.uint8] | None: ...
//     @property
//     def height(self) -> NDArray[np.uint16] | None: ...
//     @property
//     def occlusion(self) -> NDArray[np.uint8] | None: ...
//
// def texture(
//     mesh: Mesh,
//     detail: Mesh,
//     photos: Iterable[Photo] | None = None,
//     *,
//     # options: texture
//     # end
//     progress: _Progress | None = None,
// ) -> Textured: ...

// types of Job:
// @staticmethod
// def texture(
//     mesh: Mesh,
//     detail: Mesh,
//     photos: Iterable[Photo] | None = None,
//     *,
//     # options: texture
//     # end
// ) -> Job: ...

/// Makes the images of a mesh, from photos and from the detailed surface that it stands for.
///
/// A texel shows the place of the detailed surface behind it. Its colour is the mean, as light, of all photos that see this place. Places
/// that no photo sees take the colour of the detailed surface's vertices, or else of the nearest place seen. The images are the same for
/// any order of the photos. One photo is in memory at a time. Options that are ``None`` take their defaults.
///
/// >>> unwrapped = surfrecon.unwrap(light, size=256)
/// >>> textured = surfrecon.texture(unwrapped.mesh, detail, photos, size=256)
/// >>> textured.tiles[0].colour.shape, textured.report.seen > 0
/// ((256, 256, 3), True)
///
/// Args:
///     mesh: a mesh with texture coordinates, as ``unwrap`` gives them.
///     detail: the detailed surface that it stands for, in the same frame. Its vertex attribute ``colour`` is used where no photo sees.
///     photos: photos with known cameras. ``None`` takes all colours of the vertices of ``detail``.
#[doc = include_str!("params/texture.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Returns:
///     A ``Textured`` with the images, the cameras as they were used and a report.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: a mesh without texture coordinates, photos that can't be used, neither photos nor colours. The text says what to do.
///     FileError: a photo that can't be read.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: texture
#[pyo3(signature = (mesh, detail, photos = None, *, progress = None, **options), text_signature = "(mesh, detail, photos = None, *, size=2048, refine_cameras=True, match_exposure=True, drop_highlights=True, normal_map=False, height_map=False, occlusion_rays=0, threads=0, progress=None)")]
pub fn texture(
    py: Python<'_>,
    mesh: &Mesh,
    detail: &Mesh,
    photos: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Textured> {
    let call = TextureCall::new(mesh, detail, photos, options)?;
    Ok(Textured::from(Watch::new(progress).run(py, |progress| call.run(progress))?))
}

/// A call whose arguments are checked, to be run on any thread.
pub struct TextureCall {
    mesh: Arc<TriMesh>,
    detail: Arc<TriMesh>,
    photos: Vec<AnyPhoto>,
    params: TextureParams,
}

impl TextureCall {
    /// Checks and takes the arguments.
    pub fn new(
        mesh: &Mesh,
        detail: &Mesh,
        given: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let params = params("texture", options)?;
        Ok(TextureCall { mesh: mesh.mesh.clone(), detail: detail.mesh.clone(), photos: photos(given)?, params })
    }

    /// Runs it.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        let photos: Vec<&dyn surfrecon::photo::Photo> = self.photos.iter().map(|photo| &**photo as _).collect();
        surfrecon::texture::run(&self.mesh, &self.detail, &photos, &self.params, progress)
    }
}

/// The images of a mesh, in square tiles of one size.
///
/// >>> textured = surfrecon.texture(surfrecon.unwrap(light, size=128).mesh, detail, photos, size=128)
/// >>> textured.size, len(textured.tiles), textured.world_from_camera.shape == (len(photos), 4, 4)
/// (128, 1, True)
#[pyclass(frozen, module = "surfrecon")]
pub struct Textured {
    core: Arc<Core>,
}

impl From<Core> for Textured {
    fn from(core: Core) -> Self {
        Textured { core: Arc::new(core) }
    }
}

#[pymethods]
impl Textured {
    /// Columns and rows of a tile.
    #[getter]
    fn size(&self) -> u32 {
        self.core.images.size
    }

    /// The tiles. Tile ``k`` fills the unit square at ``(k % 10, k // 10)``.
    #[getter]
    fn tiles(&self) -> Vec<TextureTile> {
        (0..self.core.images.tiles.len()).map(|number| TextureTile { core: self.core.clone(), number }).collect()
    }

    /// (n, 4, 4) float64: the poses of the cameras as they were used, in the order in which the photos were given.
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = |pose: &glam::DAffine3| DMat4::from(*pose).transpose().to_cols_array();
        let numbers: Vec<f64> = self.core.world_from_camera.iter().flat_map(rows).collect();
        Ok(PyArray1::from_vec(py, numbers).reshape([self.core.world_from_camera.len(), 4, 4])?.into_any())
    }

    /// Figures of the run: a ``TextureReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.core.report)
    }

    fn __repr__(&self) -> String {
        let tiles = counted(self.core.images.tiles.len() as u64, "tile", "tiles");
        format!("<Textured {tiles} of {} texels>", self.core.images.size)
    }
}

/// The images of a tile. Row 0 is at the top, where ``t`` is largest. All are read-only views.
///
/// >>> textured = surfrecon.texture(
/// ...     surfrecon.unwrap(light, size=128).mesh, detail, photos, size=128, occlusion_rays=4
/// ... )
/// >>> tile = textured.tiles[0]
/// >>> tile.mask.shape, tile.occlusion.dtype, tile.normal
/// ((128, 128), dtype('uint8'), None)
#[pyclass(frozen, module = "surfrecon")]
pub struct TextureTile {
    core: Arc<Core>,
    number: usize,
}

impl TextureTile {
    /// A view of one of the images, of so many numbers a texel.
    fn view<'py, T: Element + 'static>(
        &self,
        py: Python<'py>,
        select: for<'a> fn(&'a Tile) -> Option<&'a [T]>,
        numbers: Option<usize>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let (number, size) = (self.number, self.core.images.size as usize);
        if select(&self.core.images.tiles[number]).is_none() {
            return Ok(None);
        }
        let shape: Vec<usize> = [size, size].into_iter().chain(numbers).collect();
        arrays::view(py, &self.core, |core| select(&core.images.tiles[number]).unwrap_or_default(), shape).map(Some)
    }
}

#[pymethods]
impl TextureTile {
    /// (size, size, 3) uint8 sRGB: base colour.
    #[getter]
    fn colour<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.view(py, |tile| Some(tile.colour.as_flattened()), Some(3))
    }

    /// (size, size) uint8: 255 where a photo sees the place, 128 where none does, 0 where no triangle is.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.view(py, |tile| tile.mask.as_deref(), None)
    }

    /// (size, size, 3) uint8: normals in the tangent space of MikkTSpace, y up, of which 128 is 0. ``None`` unless asked for.
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.view(py, |tile| tile.normal.as_ref().map(|normal| normal.as_flattened()), Some(3))
    }

    /// (size, size) uint16: heights of the detailed surface over the mesh, between the two ``heights`` of the report. ``None`` unless
    /// asked for.
    #[getter]
    fn height<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.view(py, |tile| tile.height.as_deref(), None)
    }

    /// (size, size) uint8, as light: 255 where all directions are open. ``None`` unless asked for.
    #[getter]
    fn occlusion<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.view(py, |tile| tile.occlusion.as_deref(), None)
    }

    fn __repr__(&self) -> String {
        format!("<TextureTile {} of {} texels>", self.number, self.core.images.size)
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.texture`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``texture``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: texture
    #[pyo3(signature = (mesh, detail, photos = None, **options), text_signature = "(mesh, detail, photos = None, *, size=2048, refine_cameras=True, match_exposure=True, drop_highlights=True, normal_map=False, height_map=False, occlusion_rays=0, threads=0)")]
    fn texture(
        mesh: &Mesh,
        detail: &Mesh,
        photos: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = TextureCall::new(mesh, detail, photos, options)?;
        Job::of(Background::start(move |progress| made_class(Textured::from(call.run(progress)?))))
    }
}
