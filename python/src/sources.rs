//! Scans as Python hands them over.

use std::borrow::Borrow;
use std::sync::Arc;

use glam::DAffine3;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use surfrecon::align::PlacedCloud;
use surfrecon::merge::{PlacedMesh, ScanSource};
use surfrecon::source::Scan as HandedScan;
use surfrecon::{PointCloud as CoreCloud, RangeImage as CoreImage, TriMesh, import};

use crate::arrays;
use crate::errors::reworded;
use crate::frame::{self, Scan};
use crate::mesh::Mesh;
use crate::point_cloud::PointCloud;
use crate::range_image::RangeImage;

/// One scan, owned: the caller's objects may change or vanish while the work runs.
pub type Source = HandedScan<Arc<CoreImage>, Arc<TriMesh>, Arc<CoreCloud>, import::FileScan>;

/// The scans as the core takes them.
pub fn as_dyn<S: Borrow<Source>>(sources: &[S]) -> Vec<&dyn ScanSource> {
    sources.iter().map(|source| source.borrow().as_source()).collect()
}

/// Whether clouds are scans, too.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Clouds {
    Taken,
    Refused,
}

/// The scan as a Python object, which shares its samples.
///
/// # Errors
/// None but of Python itself.
pub fn object<'py>(py: Python<'py>, source: &Source) -> PyResult<Bound<'py, PyAny>> {
    match source {
        Source::Image(image) => Ok(Bound::new(py, RangeImage::from(image.clone()))?.into_any()),
        _ => placed(py, source, source.world_from_scan()),
    }
}

/// The same scan elsewhere, as a Python object.
///
/// # Errors
/// None but of Python itself.
pub fn placed<'py>(py: Python<'py>, source: &Source, world_from_scan: DAffine3) -> PyResult<Bound<'py, PyAny>> {
    Ok(match source {
        Source::Read(scan) => {
            let mut scan = scan.clone();
            scan.world_from_sensor = world_from_scan;
            frame::to_object(py, scan)?.into_bound(py).into_any()
        }
        Source::Image(image) => {
            let mut image = CoreImage::clone(image);
            image.world_from_sensor = world_from_scan;
            Bound::new(py, RangeImage::from(image))?.into_any()
        }
        Source::Mesh(PlacedMesh { name, mesh, .. }) => {
            let mesh = Bound::new(py, Mesh { mesh: mesh.clone() })?;
            (mesh, arrays::matrix(py, &world_from_scan), name).into_pyobject(py)?.into_any()
        }
        Source::Cloud(PlacedCloud { cloud, .. }) => {
            let mut cloud = CoreCloud::clone(cloud);
            cloud.world_from_cloud = world_from_scan;
            Bound::new(py, PointCloud { cloud: cloud.into() })?.into_any()
        }
    })
}

/// The name of an object's type.
fn kind_of(item: &Bound<'_, PyAny>) -> String {
    item.get_type().name().map_or_else(|_| item.get_type().to_string(), |name| name.to_string())
}

/// The scans of a Python argument.
///
/// # Errors
/// `TypeError` naming what is no scan.
pub fn sources(scans: &Bound<'_, PyAny>, clouds: Clouds) -> PyResult<Vec<Source>> {
    let wrong = || format!("scans must be a ScanSet or a list, got {}", kind_of(scans));
    if scans.is_instance_of::<PyString>() || scans.hasattr("__fspath__")? {
        return Err(PyTypeError::new_err(format!("{}: open files with surfrecon.open()", wrong())));
    }
    let iterator = scans.try_iter().map_err(|error| reworded(error, || PyTypeError::new_err(wrong())))?;
    iterator.enumerate().map(|(i, item)| source(i, &item?, clouds)).collect()
}

/// A scan of Python. `index` is what a mesh without a name is called by.
///
/// # Errors
/// `TypeError` naming what is no scan.
pub fn source(index: usize, item: &Bound<'_, PyAny>, clouds: Clouds) -> PyResult<Source> {
    if let Ok(scan) = item.cast::<Scan>() {
        return Ok(Source::Read(scan.get().scan.clone()));
    }
    if let Ok(image) = item.cast::<RangeImage>() {
        return Ok(Source::Image(image.get().image()));
    }
    if clouds == Clouds::Taken
        && let Ok(cloud) = item.cast::<PointCloud>()
    {
        let cloud = cloud.get().cloud.clone();
        let world_from_cloud = cloud.world_from_cloud;
        return Ok(Source::Cloud(PlacedCloud { name: format!("cloud {index:06}"), cloud, world_from_cloud }));
    }
    let mesh_source = |mesh: &Bound<'_, Mesh>, world_from_mesh, name: Option<String>| {
        let name = name.unwrap_or_else(|| format!("mesh {index:06}"));
        Source::Mesh(PlacedMesh { name, mesh: mesh.get().mesh.clone(), world_from_mesh })
    };
    if let Ok(mesh) = item.cast::<Mesh>() {
        return Ok(mesh_source(mesh, DAffine3::IDENTITY, None));
    }
    if let Ok((mesh, pose)) = item.extract::<(Bound<'_, Mesh>, Bound<'_, PyAny>)>() {
        return Ok(mesh_source(&mesh, arrays::affine(&pose, "world_from_mesh")?, None));
    }
    if let Ok((mesh, pose, name)) = item.extract::<(Bound<'_, Mesh>, Bound<'_, PyAny>, String)>() {
        return Ok(mesh_source(&mesh, arrays::affine(&pose, "world_from_mesh")?, Some(name)));
    }
    let cloud = if clouds == Clouds::Taken { " PointCloud," } else { "" };
    Err(PyTypeError::new_err(format!(
        "scan {index} must be a Scan, RangeImage,{cloud} Mesh, (Mesh, matrix) or (Mesh, matrix, name), got {}",
        kind_of(item)
    )))
}
