//! Scans as Python hands them over.

use std::borrow::{Borrow, Cow};
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use surfrecon::align::{Moment, OrientedPoints, PlacedCloud};
use surfrecon::merge::{Loading, OrientedSurface, PlacedMesh, ScanSource};
use surfrecon::mesh::Crs;
use surfrecon::select::Places;
use surfrecon::triangulate::TriangulateParams;
use surfrecon::{PointCloud as CoreCloud, Progress, RangeImage as CoreImage, TriMesh, import};

use crate::arrays;
use crate::errors::reworded;
use crate::frame::{self, Scan};
use crate::mesh::Mesh;
use crate::point_cloud::PointCloud;
use crate::range_image::RangeImage;

/// The scans as the core takes them.
pub fn as_dyn<S: Borrow<Source>>(sources: &[S]) -> Vec<&dyn ScanSource> {
    sources.iter().map(|source| source.borrow() as &dyn ScanSource).collect()
}

/// One scan, owned: the caller's objects may change or vanish while the work runs.
pub enum Source {
    File(import::Scan),
    Image(Arc<CoreImage>),
    Mesh { name: String, mesh: Arc<TriMesh>, world_from_mesh: DAffine3 },
    Cloud { name: String, cloud: Arc<CoreCloud> },
}

/// Whether clouds are scans, too.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Clouds {
    Taken,
    Refused,
}

impl ScanSource for Source {
    fn name(&self) -> &str {
        match self {
            Source::File(scan) => &scan.name,
            Source::Image(image) => &image.name,
            Source::Mesh { name, .. } | Source::Cloud { name, .. } => name,
        }
    }

    fn crs(&self) -> surfrecon::Result<Option<Crs>> {
        match self {
            Source::File(scan) => ScanSource::crs(scan),
            Source::Image(image) => Ok(image.crs.clone()),
            Source::Mesh { name, mesh, world_from_mesh } => {
                PlacedMesh { name: name.clone(), mesh, world_from_mesh: *world_from_mesh }.crs()
            }
            Source::Cloud { cloud, .. } => Ok(cloud.crs.clone()),
        }
    }

    fn file(&self) -> Option<&Path> {
        match self {
            Source::File(scan) => scan.file(),
            _ => None,
        }
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> surfrecon::Result<OrientedSurface> {
        match self {
            Source::File(scan) => scan.load(loading, progress),
            Source::Image(image) => image.load(loading, progress),
            Source::Mesh { name, mesh, world_from_mesh } => {
                PlacedMesh { name: name.clone(), mesh, world_from_mesh: *world_from_mesh }.load(loading, progress)
            }
            Source::Cloud { name, cloud } => {
                PlacedCloud { name: name.clone(), cloud, world_from_cloud: cloud.world_from_cloud }
                    .load(loading, progress)
            }
        }
    }

    fn image(&self, progress: &Progress<'_>) -> surfrecon::Result<Option<Cow<'_, CoreImage>>> {
        match self {
            Source::File(scan) => scan.image(progress),
            Source::Image(image) => image.image(progress),
            Source::Mesh { .. } | Source::Cloud { .. } => Ok(None),
        }
    }

    fn content(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> surfrecon::Result<u64> {
        match self {
            Source::File(scan) => scan.content(triangulation, progress),
            Source::Image(image) => image.content(triangulation, progress),
            Source::Mesh { name, mesh, world_from_mesh } => {
                PlacedMesh { name: name.clone(), mesh, world_from_mesh: *world_from_mesh }
                    .content(triangulation, progress)
            }
            Source::Cloud { name, cloud } => {
                PlacedCloud { name: name.clone(), cloud, world_from_cloud: cloud.world_from_cloud }
                    .content(triangulation, progress)
            }
        }
    }

    fn version(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> surfrecon::Result<u64> {
        match self {
            Source::File(scan) => scan.version(triangulation, progress),
            _ => self.content(triangulation, progress),
        }
    }

    fn moment(&self) -> Option<Moment<'_>> {
        match self {
            Source::File(scan) => scan.moment(),
            _ => None,
        }
    }

    fn up(&self) -> Option<DVec3> {
        match self {
            Source::File(scan) => scan.up(),
            _ => None,
        }
    }

    fn damage(&self) -> Option<String> {
        match self {
            Source::File(scan) => ScanSource::damage(scan),
            _ => None,
        }
    }

    fn places(&self, progress: &Progress<'_>) -> surfrecon::Result<Places> {
        match self {
            Source::File(scan) => scan.places(progress),
            Source::Image(image) => image.places(progress),
            Source::Mesh { name, mesh, world_from_mesh } => {
                PlacedMesh { name: name.clone(), mesh, world_from_mesh: *world_from_mesh }.places(progress)
            }
            Source::Cloud { name, cloud } => {
                PlacedCloud { name: name.clone(), cloud, world_from_cloud: cloud.world_from_cloud }.places(progress)
            }
        }
    }

    fn oriented_points(&self, progress: &Progress<'_>) -> surfrecon::Result<OrientedPoints> {
        match self {
            Source::File(scan) => scan.oriented_points(progress),
            Source::Image(image) => image.oriented_points(progress),
            Source::Mesh { name, mesh, world_from_mesh } => {
                PlacedMesh { name: name.clone(), mesh, world_from_mesh: *world_from_mesh }.oriented_points(progress)
            }
            Source::Cloud { name, cloud } => {
                PlacedCloud { name: name.clone(), cloud, world_from_cloud: cloud.world_from_cloud }
                    .oriented_points(progress)
            }
        }
    }
}

impl Source {
    /// The pose that it has.
    pub fn world_from_scan(&self) -> DAffine3 {
        match self {
            Source::File(scan) => scan.world_from_sensor,
            Source::Image(image) => image.world_from_sensor,
            Source::Mesh { world_from_mesh, .. } => *world_from_mesh,
            Source::Cloud { cloud, .. } => cloud.world_from_cloud,
        }
    }

    /// The scan as a Python object, which shares its samples.
    ///
    /// # Errors
    /// None but of Python itself.
    pub fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Source::Image(image) => Ok(Bound::new(py, RangeImage::from(image.clone()))?.into_any()),
            _ => self.placed(py, self.world_from_scan()),
        }
    }

    /// The same scan elsewhere, as a Python object.
    ///
    /// # Errors
    /// None but of Python itself.
    pub fn placed<'py>(&self, py: Python<'py>, world_from_scan: DAffine3) -> PyResult<Bound<'py, PyAny>> {
        Ok(match self {
            Source::File(scan) => {
                let mut scan = scan.clone();
                scan.world_from_sensor = world_from_scan;
                frame::to_object(py, scan)?.into_bound(py).into_any()
            }
            Source::Image(image) => {
                let mut image = CoreImage::clone(image);
                image.world_from_sensor = world_from_scan;
                Bound::new(py, RangeImage::from(image))?.into_any()
            }
            Source::Mesh { name, mesh, .. } => {
                let mesh = Bound::new(py, Mesh { mesh: mesh.clone() })?;
                (mesh, arrays::matrix(py, &world_from_scan), name).into_pyobject(py)?.into_any()
            }
            Source::Cloud { cloud, .. } => {
                let mut cloud = CoreCloud::clone(cloud);
                cloud.world_from_cloud = world_from_scan;
                Bound::new(py, PointCloud { cloud: cloud.into() })?.into_any()
            }
        })
    }
}

/// The scans of a Python argument.
///
/// # Errors
/// `TypeError` naming what is no scan.
pub fn sources(scans: &Bound<'_, PyAny>, clouds: Clouds) -> PyResult<Vec<Source>> {
    let iterator = scans.try_iter().map_err(|error| {
        reworded(error, || PyTypeError::new_err(format!("scans must be a ScanSet or a list, got {}", scans.get_type())))
    })?;
    iterator.enumerate().map(|(i, item)| source(i, &item?, clouds)).collect()
}

/// A scan of Python; `index` is what a mesh without a name is called by.
///
/// # Errors
/// `TypeError` naming what is no scan.
pub fn source(index: usize, item: &Bound<'_, PyAny>, clouds: Clouds) -> PyResult<Source> {
    if let Ok(scan) = item.cast::<Scan>() {
        return Ok(Source::File(scan.get().scan.clone()));
    }
    if let Ok(image) = item.cast::<RangeImage>() {
        return Ok(Source::Image(image.get().image()));
    }
    if clouds == Clouds::Taken
        && let Ok(cloud) = item.cast::<PointCloud>()
    {
        return Ok(Source::Cloud { name: format!("cloud {index:06}"), cloud: cloud.get().cloud.clone() });
    }
    let mesh_source = |mesh: &Bound<'_, Mesh>, world_from_mesh, name: Option<String>| Source::Mesh {
        name: name.unwrap_or_else(|| format!("mesh {index:06}")),
        mesh: mesh.get().mesh.clone(),
        world_from_mesh,
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
    Err(PyTypeError::new_err(format!(
        "scan {index} must be a Scan, RangeImage, Mesh, (Mesh, matrix) or (Mesh, matrix, name), got {}",
        item.get_type()
    )))
}
