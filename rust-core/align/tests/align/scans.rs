//! Scans made by the virtual scanner, whose poses are known, and how far an alignment is from them.

use std::borrow::Cow;
use std::path::Path;

use base::error::Result;
use base::progress::Progress;
use geom::bvh::Bvh;
use glam::{DAffine3, DQuat, DVec3};
use image::RangeImage;
use image::source::{Loading, OrientedSurface};
use mesh::TriMesh;
use scan::{ScanParams, VirtualCamera, scan, sculpture::sculpture};
use surfrecon_align::{AlignParams, Alignment, Constraints, Moment, ScanSource, ScanState, run};

pub const PIXELS: usize = 140;

/// A pinhole camera that looks at all of a mesh from a direction.
pub fn camera(mesh: &TriMesh, from: DVec3, roll: f64) -> VirtualCamera {
    let (lo, hi) = mesh::measure::bounds(&mesh.positions).unwrap();
    let direction = from.normalize();
    let up = DQuat::from_axis_angle(direction, roll) * direction.any_orthonormal_vector();
    let eye = lo.midpoint(hi) + 2.5 * (hi - lo).length() * direction;
    VirtualCamera::pinhole(PIXELS, PIXELS, 2.0 * 0.2_f64.atan(), eye, lo.midpoint(hi), up).unwrap()
}

/// The image of a camera, with noise in spacings. The samples are in the sensor's frame.
pub fn seen(mesh: &TriMesh, camera: &VirtualCamera, noise: f64, seed: u64) -> RangeImage {
    let (lo, hi) = mesh::measure::bounds(&mesh.positions).unwrap();
    let noise = noise * (hi - lo).length() / PIXELS as f64;
    let params = ScanParams { noise, seed, threads: 1, ..ScanParams::default() };
    let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).unwrap();
    scan(mesh, &bvh, camera, &params, &Progress::none()).unwrap()
}

/// The image of a pinhole camera from a direction.
pub fn look(mesh: &TriMesh, from: DVec3, roll: f64, noise: f64) -> RangeImage {
    let mut image = seen(mesh, &camera(mesh, from, roll), noise, (roll * 1000.0) as _);
    let DVec3 { x, y, z } = from.normalize();
    image.name = format!("from {x:.2} {y:.2} {z:.2}");
    image
}

pub fn around(mesh: &TriMesh, count: usize, noise: f64) -> Vec<RangeImage> {
    let from = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / count as f64;
        look(
            mesh,
            DVec3::new(turn.cos(), turn.sin(), if k.is_multiple_of(2) { 0.2 } else { 0.9 }),
            0.3 * k as f64 + 0.1,
            noise,
        )
    };
    (0..count).map(from).collect()
}

/// About 1 high.
pub fn statue() -> &'static TriMesh {
    static STATUE: std::sync::OnceLock<TriMesh> = std::sync::OnceLock::new();
    STATUE.get_or_init(|| {
        let TriMesh { positions, triangles, .. } = sculpture(2.0, 0, &Progress::none()).unwrap();
        let (lo, hi) = mesh::measure::bounds(&positions).unwrap();
        let (middle, scale) = (lo.midpoint(hi), 1.0 / (hi - lo).max_element());
        TriMesh {
            positions: positions.iter().map(|&p| scale * (p - middle)).collect(),
            triangles,
            ..TriMesh::default()
        }
    })
}

pub fn sources(images: &[RangeImage]) -> Vec<&dyn ScanSource> {
    images.iter().map(|image| image as &dyn ScanSource).collect()
}

pub fn aligned(images: &[RangeImage], constraints: &Constraints) -> Alignment {
    run(&sources(images), &AlignParams::default(), constraints, &Progress::none()).unwrap()
}

pub fn placed(image: &RangeImage, world_from_sensor: DAffine3) -> RangeImage {
    let mut image = image.clone();
    image.world_from_sensor = world_from_sensor;
    image
}

/// Throws the poses away, all but how the sensor looks at things: each scan lies where its sensor was the origin.
pub fn without_poses(images: &[RangeImage]) -> Vec<RangeImage> {
    images.iter().map(|image| placed(image, DAffine3::IDENTITY)).collect()
}

/// Largest distance of a sample of each placed scan from where it belongs, in the distances of samples, where the scan that was kept
/// is right.
pub fn errors(images: &[RangeImage], alignment: &Alignment) -> Vec<Option<f64>> {
    let kept = alignment.report.scans.iter().position(|scan| scan.state == ScanState::Kept).unwrap();
    let truth_from_found = images[kept].world_from_sensor * alignment.world_from_scan[kept].unwrap().inverse();
    let error = |(image, found): (&RangeImage, &Option<DAffine3>)| {
        found.map(|found| {
            let points = image.oriented_points(&Progress::none()).unwrap();
            let off = |p: &DVec3| {
                (truth_from_found * found).transform_point3(*p).distance(image.world_from_sensor.transform_point3(*p))
            };
            points.positions.iter().map(off).fold(0.0, f64::max) / points.spacing
        })
    };
    images.iter().zip(&alignment.world_from_scan).map(error).collect()
}

/// A scan of which more is known than its samples.
pub struct Known {
    pub image: RangeImage,
    /// The recording, and the number in it.
    pub moment: Option<(&'static str, f64)>,
    /// Up in the sensor's frame.
    pub up: Option<DVec3>,
}

impl ScanSource for Known {
    fn name(&self) -> &str {
        &self.image.name
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
        self.image.load(loading, progress)
    }

    fn image(&self, _: &Progress<'_>) -> Result<Option<Cow<'_, RangeImage>>> {
        Ok(Some(Cow::Borrowed(&self.image)))
    }

    fn moment(&self) -> Option<Moment<'_>> {
        self.moment.map(|(recording, at)| Moment { recording: Path::new(recording), at })
    }

    fn up(&self) -> Option<DVec3> {
        self.up
    }
}
