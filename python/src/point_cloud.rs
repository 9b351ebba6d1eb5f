//! `PointCloud`: what a file of points without a grid reads as.

use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays;
use crate::crs;
use crate::edit::Edit;
use crate::pickling::{self, Reduced, crs_part, reduced};
use crate::progress::Watch;
use crate::similarity::Given;

/// Scattered points with optional normals and colours. It never changes. Its arrays are read-only views.
///
/// >>> cloud = image.to_cloud()
/// >>> cloud.positions.shape == cloud.normals.shape
/// True
/// >>> surface = surfrecon.reconstruct(cloud)
#[pyclass(frozen, module = "surfrecon")]
pub struct PointCloud {
    pub cloud: Arc<surfrecon::PointCloud>,
}

impl PointCloud {
    fn edited(&self, py: Python<'_>, edit: &Edit) -> PyResult<Self> {
        let cloud = Watch::new(None).run(py, |progress| edit.of_cloud(&self.cloud, progress))?;
        Ok(PointCloud { cloud: Arc::new(cloud) })
    }
}

#[pymethods]
impl PointCloud {
    /// (n, 3) float64 in the cloud's own frame, a read-only view.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let count = self.cloud.positions.len();
        arrays::view(py, &self.cloud, |c| arrays::coordinates(&c.positions), (count, 3))
    }

    /// (n, 3) float32 unit normals, a read-only view, or ``None``.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(normals) = &self.cloud.normals else { return Ok(None) };
        arrays::view(py, &self.cloud, flat_normals, (normals.len(), 3)).map(Some)
    }

    /// (n, 4) uint8 sRGB with alpha, a read-only view, or ``None``.
    #[getter]
    fn colour<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(colour) = &self.cloud.colour else { return Ok(None) };
        arrays::view(py, &self.cloud, flat_colour, (colour.len(), 4)).map(Some)
    }

    /// (n,) float32 strength of the returned signal in the file's own unit, a read-only view, or ``None``.
    #[getter]
    fn intensity<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(intensity) = &self.cloud.intensity else { return Ok(None) };
        arrays::view(py, &self.cloud, intensities, intensity.len()).map(Some)
    }

    /// (3,) float64: where all points were seen from, in the cloud's own frame. ``None`` where that is not known. Of PCD files it is their
    /// VIEWPOINT, unless that is the origin, which stands there where nobody set it.
    #[getter]
    fn sensor<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.cloud.sensor.map(|sensor| PyArray1::from_slice(py, &sensor.to_array()).into_any())
    }

    /// 4 x 4 float64: places the cloud in the world.
    #[getter]
    fn world_from_cloud<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        arrays::matrix(py, &self.cloud.world_from_cloud)
    }

    /// The coordinate reference system of the world that it is placed in, as files name it: well-known text, or a code as
    /// ``EPSG:25832``. ``None`` where that is not known.
    #[getter]
    fn crs(&self) -> Option<String> {
        crs::text_of(self.cloud.crs.as_ref())
    }

    /// The cloud with what a region holds: see ``surfrecon.keep``.
    ///
    /// Args:
    ///     region: a ``Box``, a ``Plane`` or a mask, (n,) bool.
    ///
    /// Raises:
    ///     InputError: a mask of another size.
    ///     TypeError: what is no region.
    fn keep(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.edited(py, &Edit::select(region, true)?)
    }

    /// The cloud without what a region holds. Works as ``keep``.
    fn remove(&self, py: Python<'_>, region: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.edited(py, &Edit::select(region, false)?)
    }

    /// The cloud in another size and place, its pose still rigid: see ``surfrecon.transformed``.
    fn transformed(&self, py: Python<'_>, similarity: Given) -> PyResult<Self> {
        self.edited(py, &Edit::transform(&similarity.0))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Reduced<'py>> {
        let names = ["positions", "normals", "colour", "intensity", "sensor", "world_from_cloud"];
        let parts = pickling::attributes(slf, &names)?;
        parts.set_item("crs", crs_part(slf.get().cloud.crs.as_ref()))?;
        reduced("cloud", parts)
    }

    fn __copy__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __deepcopy__<'py>(slf: PyRef<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyRef<'py, Self> {
        slf
    }

    fn __repr__(&self) -> String {
        format!("<PointCloud {} points>", self.cloud.positions.len())
    }
}

fn flat_normals(cloud: &surfrecon::PointCloud) -> &[f32] {
    cloud.normals.as_deref().unwrap_or_default().as_flattened()
}

fn intensities(cloud: &surfrecon::PointCloud) -> &[f32] {
    cloud.intensity.as_deref().unwrap_or_default()
}

fn flat_colour(cloud: &surfrecon::PointCloud) -> &[u8] {
    cloud.colour.as_deref().unwrap_or_default().as_flattened()
}
