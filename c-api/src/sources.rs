//! Scans as merges and alignments take them: range images, placed meshes, scans of files, images that the caller makes.

use std::borrow::Cow;
use std::ffi::c_char;
use std::path::Path;

use glam::{DAffine3, DVec3};
use surfrecon::align::{Moment, OrientedPoints, PlacedCloud};
use surfrecon::import::Scan;
use surfrecon::merge::{Loading, OrientedSurface, PlacedMesh, ScanSource};
use surfrecon::mesh::Crs;
use surfrecon::select::Places;
use surfrecon::triangulate::TriangulateParams;
use surfrecon::{PointCloud, Progress, RangeImage};

use crate::cloud::srf_cloud;
use crate::files::srf_scans;
use crate::handle::Shared;
use crate::image::{Image, srf_image};
use crate::image_source::{MadeScan, srf_image_source};
use crate::mesh::{Mesh, srf_mesh};
use crate::pose::{self, srf_pose};
use crate::status::{Failure, srf_status::SRF_ERR_PARAMETER};
use crate::{handle, pointer};

/// A scan that was added to a merge or an alignment; those of a set are read, and those of a source made, when their turn comes.
#[derive(Clone)]
pub enum Source {
    Image(Shared<Image>),
    Mesh(NamedMesh),
    Cloud {
        name: String,
        cloud: Shared<PointCloud>,
    },
    /// As it was in its set when it was added.
    Scan(Box<Scan>),
    Made(MadeScan),
}

/// A mesh as it was when it was added, placed and named by the caller.
#[derive(Clone)]
pub struct NamedMesh {
    name: String,
    mesh: Shared<Mesh>,
    world_from_mesh: DAffine3,
}

impl NamedMesh {
    fn borrowed(&self) -> PlacedMesh<'_> {
        PlacedMesh { name: self.name.clone(), mesh: &self.mesh.mesh, world_from_mesh: self.world_from_mesh }
    }
}

impl Source {
    /// The image behind a handle, as it is now.
    pub fn of_image(image: *const srf_image) -> Result<Self, Failure> {
        Ok(Source::Image(handle::get("image", image)?))
    }

    /// The mesh behind a handle, as it is now, placed and named by the caller.
    pub fn of_mesh(
        mesh: *const srf_mesh,
        world_from_mesh: *const srf_pose,
        name: *const c_char,
    ) -> Result<Self, Failure> {
        let mesh = handle::get("mesh", mesh)?;
        let world_from_mesh = pose::read("world_from_mesh", world_from_mesh)?;
        let name = pointer::text("name", name)?.to_owned();
        Ok(Source::Mesh(NamedMesh { name, mesh, world_from_mesh }))
    }

    /// The cloud behind a handle, which knows its place, named by the caller.
    pub fn of_cloud(cloud: *const srf_cloud, name: *const c_char) -> Result<Self, Failure> {
        let cloud = handle::get("cloud", cloud)?;
        Ok(Source::Cloud { name: pointer::text("name", name)?.to_owned(), cloud })
    }

    /// All scans of a set.
    pub fn of_scans(scans: *const srf_scans) -> Result<Vec<Self>, Failure> {
        let set = handle::get("scans", scans)?;
        Ok(set.set.scans.iter().map(|scan| Source::Scan(scan.clone().into())).collect())
    }

    /// A scan of a set; `name` is the argument's that says which.
    pub fn of_scan(scans: *const srf_scans, name: &str, index: usize) -> Result<Self, Failure> {
        let set = handle::get("scans", scans)?;
        let scan = set.set.scans.get(index).ok_or_else(|| {
            let count = set.set.scans.len();
            let text = format!("{name} must be < {count}, the number of scans in the set, got {index}");
            Failure::new(SRF_ERR_PARAMETER, text)
        })?;
        Ok(Source::Scan(scan.clone().into()))
    }

    /// A scan whose image the caller makes, placed and named by the caller.
    pub fn of_source(
        source: *const srf_image_source,
        world_from_sensor: *const srf_pose,
        name: *const c_char,
    ) -> Result<Self, Failure> {
        MadeScan::of(source, world_from_sensor, name).map(Source::Made)
    }

    /// Its pose as it was added.
    pub fn world_from_scan(&self) -> DAffine3 {
        match self {
            Source::Image(image) => image.image.world_from_sensor,
            Source::Mesh(mesh) => mesh.world_from_mesh,
            Source::Cloud { cloud, .. } => cloud.world_from_cloud,
            Source::Scan(scan) => scan.world_from_sensor,
            Source::Made(scan) => scan.world_from_sensor,
        }
    }
}

/// A cloud as the core takes it.
fn placed<'c>(name: &str, cloud: &'c PointCloud) -> PlacedCloud<'c> {
    PlacedCloud { name: name.to_owned(), cloud, world_from_cloud: cloud.world_from_cloud }
}

/// As the core takes them.
pub fn borrowed(sources: &[Source]) -> Vec<&dyn ScanSource> {
    sources.iter().map(|source| source as &dyn ScanSource).collect()
}

impl ScanSource for Source {
    fn name(&self) -> &str {
        match self {
            Source::Image(image) => image.image.name(),
            Source::Mesh(mesh) => &mesh.name,
            Source::Cloud { name, .. } => name,
            Source::Scan(scan) => scan.name(),
            Source::Made(scan) => &scan.name,
        }
    }

    fn crs(&self) -> surfrecon::Result<Option<Crs>> {
        match self {
            Source::Image(image) => image.image.crs(),
            Source::Mesh(mesh) => mesh.borrowed().crs(),
            Source::Cloud { name, cloud } => placed(name, cloud).crs(),
            Source::Scan(scan) => ScanSource::crs(scan.as_ref()),
            // Its image alone could tell, which is made when it is needed.
            Source::Made(_) => Ok(None),
        }
    }

    fn file(&self) -> Option<&Path> {
        match self {
            Source::Scan(scan) => scan.file(),
            _ => None,
        }
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> surfrecon::Result<OrientedSurface> {
        match self {
            Source::Image(image) => image.image.load(loading, progress),
            Source::Mesh(mesh) => mesh.borrowed().load(loading, progress),
            Source::Cloud { name, cloud } => placed(name, cloud).load(loading, progress),
            Source::Scan(scan) => scan.load(loading, progress),
            Source::Made(scan) => scan.image(progress)?.load(loading, progress),
        }
    }

    fn image(&self, progress: &Progress<'_>) -> surfrecon::Result<Option<Cow<'_, RangeImage>>> {
        match self {
            Source::Image(image) => image.image.image(progress),
            Source::Mesh(_) | Source::Cloud { .. } => Ok(None),
            Source::Scan(scan) => scan.image(progress),
            Source::Made(scan) => Ok(Some(Cow::Owned(scan.image(progress)?))),
        }
    }

    fn oriented_points(&self, progress: &Progress<'_>) -> surfrecon::Result<OrientedPoints> {
        match self {
            Source::Image(image) => image.image.oriented_points(progress),
            Source::Mesh(mesh) => mesh.borrowed().oriented_points(progress),
            Source::Cloud { name, cloud } => placed(name, cloud).oriented_points(progress),
            Source::Scan(scan) => scan.oriented_points(progress),
            Source::Made(scan) => scan.image(progress)?.oriented_points(progress),
        }
    }

    fn moment(&self) -> Option<Moment<'_>> {
        match self {
            Source::Scan(scan) => scan.moment(),
            _ => None,
        }
    }

    fn up(&self) -> Option<DVec3> {
        match self {
            Source::Scan(scan) => scan.up(),
            _ => None,
        }
    }

    fn damage(&self) -> Option<String> {
        match self {
            Source::Scan(scan) => scan.damage(),
            _ => None,
        }
    }

    fn places(&self, progress: &Progress<'_>) -> surfrecon::Result<Places> {
        match self {
            Source::Image(image) => image.image.places(progress),
            Source::Mesh(mesh) => mesh.borrowed().places(progress),
            Source::Cloud { name, cloud } => placed(name, cloud).places(progress),
            Source::Scan(scan) => scan.places(progress),
            Source::Made(scan) => scan.image(progress)?.places(progress),
        }
    }

    fn content(&self, triangulation: &TriangulateParams, progress: &Progress<'_>) -> surfrecon::Result<u64> {
        match self {
            Source::Image(image) => image.image.content(triangulation, progress),
            Source::Mesh(mesh) => mesh.borrowed().content(triangulation, progress),
            Source::Cloud { name, cloud } => placed(name, cloud).content(triangulation, progress),
            Source::Scan(scan) => scan.content(triangulation, progress),
            Source::Made(scan) => scan.image(progress)?.content(triangulation, progress),
        }
    }
}
