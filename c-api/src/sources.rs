//! Scans as merges and alignments take them: range images, placed meshes, scans of files, images that the caller makes.

use std::borrow::Borrow;
use std::ffi::c_char;

use glam::DAffine3;
use surfrecon::source::{PlacedCloud, PlacedMesh, Read, Scan, ScanSource};
use surfrecon::{PointCloud, RangeImage, TriMesh, import};

use crate::cloud::srf_cloud;
use crate::files::srf_scans;
use crate::handle::Shared;
use crate::image::{Image, srf_image};
use crate::image_source::{MadeScan, srf_image_source};
use crate::mesh::{Mesh, srf_mesh};
use crate::pose::{self, srf_pose};
use crate::status::{Failure, srf_status::SRF_ERR_PARAMETER};
use crate::{handle, pointer};

/// An image as it was when its handle was looked up.
#[derive(Clone)]
pub struct KeptImage(pub Shared<Image>);

impl Borrow<RangeImage> for KeptImage {
    fn borrow(&self) -> &RangeImage {
        &self.0.image
    }
}

/// A mesh as it was when its handle was looked up.
#[derive(Clone)]
pub struct KeptMesh(Shared<Mesh>);

impl Borrow<TriMesh> for KeptMesh {
    fn borrow(&self) -> &TriMesh {
        &self.0.mesh
    }
}

/// A scan that was added to a merge or an alignment.
pub type Source = Scan<KeptImage, KeptMesh, Shared<PointCloud>, Later>;

/// A scan that is read or made when its turn comes.
#[derive(Clone)]
pub enum Later {
    /// As it was in its set when it was added.
    File(Box<import::FileScan>),
    Made(MadeScan),
}

/// The image behind a handle, as it is now.
pub fn of_image(image: *const srf_image) -> Result<Source, Failure> {
    Ok(Source::Image(KeptImage(handle::get("image", image)?)))
}

/// The mesh behind a handle, as it is now, placed and named by the caller.
pub fn of_mesh(
    mesh: *const srf_mesh,
    world_from_mesh: *const srf_pose,
    name: *const c_char,
) -> Result<Source, Failure> {
    let mesh = handle::get("mesh", mesh)?;
    let world_from_mesh = pose::read("world_from_mesh", world_from_mesh)?;
    let name = pointer::text("name", name)?.to_owned();
    Ok(Source::Mesh(PlacedMesh { name, mesh: KeptMesh(mesh), world_from_mesh }))
}

/// The cloud behind a handle, which knows its place, named by the caller.
pub fn of_cloud(cloud: *const srf_cloud, name: *const c_char) -> Result<Source, Failure> {
    let cloud = handle::get("cloud", cloud)?;
    let (name, world_from_cloud) = (pointer::text("name", name)?.to_owned(), cloud.world_from_cloud);
    Ok(Source::Cloud(PlacedCloud { name, cloud, world_from_cloud }))
}

/// All scans of a set.
pub fn of_scans(scans: *const srf_scans) -> Result<Vec<Source>, Failure> {
    let set = handle::get("scans", scans)?;
    Ok(set.set.scans.iter().map(file).collect())
}

/// A scan of a set. `name` is the argument's that says which.
pub fn of_scan(scans: *const srf_scans, name: &str, index: usize) -> Result<Source, Failure> {
    let set = handle::get("scans", scans)?;
    let scan = set.set.scans.get(index).ok_or_else(|| {
        let count = set.set.scans.len();
        let text = format!("{name} must be < {count}, the number of scans in the set, got {index}");
        Failure::new(SRF_ERR_PARAMETER, text)
    })?;
    Ok(file(scan))
}

/// A scan whose image the caller makes, placed and named by the caller.
pub fn of_source(
    source: *const srf_image_source,
    world_from_sensor: *const srf_pose,
    name: *const c_char,
) -> Result<Source, Failure> {
    MadeScan::of(source, world_from_sensor, name).map(|made| Source::Read(Later::Made(made)))
}

fn file(scan: &import::FileScan) -> Source {
    Source::Read(Later::File(scan.clone().into()))
}

impl Read for Later {
    fn as_source(&self) -> &dyn ScanSource {
        match self {
            Later::File(scan) => scan.as_ref(),
            Later::Made(scan) => scan,
        }
    }

    fn world_from_scan(&self) -> DAffine3 {
        match self {
            Later::File(scan) => scan.world_from_sensor,
            Later::Made(scan) => scan.world_from_sensor,
        }
    }
}

/// As the core takes them.
pub fn borrowed(sources: &[Source]) -> Vec<&dyn ScanSource> {
    sources.iter().map(Source::as_source).collect()
}
