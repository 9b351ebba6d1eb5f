//! A scene that is recorded virtually: what each frame's depths and colours truly are.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};

use base::progress::Progress;
use geom::bvh::Bvh;
use image::frame::Camera;
use image::range_image::{DepthKind, RangeImage};
use mesh::shapes::Shape;
use mesh::{Attribute, TriMesh};
use scan::ScanParams;

/// Frames of a recording.
pub(super) const FRAMES: usize = 6;

/// Frames with their truth.
pub(super) struct Twin {
    /// Depth with the true pose: x right, y down, z forward.
    pub(super) depths: Vec<RangeImage>,
    /// Colour images.
    pub(super) colours: Vec<Vec<[u8; 3]>>,
    /// Of the depth images.
    pub(super) camera: Camera,
    /// Of the colour images.
    pub(super) photo: Camera,
}

/// The true colour of a place.
pub(super) fn colour(at: DVec3) -> [u8; 3] {
    let channel = |x: f64| (128.0 + 90.0 * x).clamp(0.0, 255.0).round() as u8;
    [channel(at.x), channel(at.y), channel(at.z)]
}

/// Things of different size, none of them where another orientation would look the same.
fn scene() -> TriMesh {
    let things = [
        (Shape::Cuboid { half: DVec3::new(1.2, 0.9, 0.1) }, DVec3::new(0.1, 0.0, -0.6)),
        (Shape::Sphere { radius: 0.45 }, DVec3::new(-0.4, 0.2, 0.0)),
        (Shape::Cuboid { half: DVec3::new(0.2, 0.3, 0.5) }, DVec3::new(0.55, -0.3, 0.0)),
        (Shape::Sphere { radius: 0.2 }, DVec3::new(0.2, 0.55, -0.3)),
    ];
    let mut all = TriMesh::default();
    for (shape, place) in things {
        let part = shape.mesh(24);
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions.iter().map(|p| *p + place));
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let colours = all.positions.iter().map(|p| colour(*p)).map(|[r, g, b]| [r, g, b, 255]).collect();
    all.vertex_attributes = vec![Attribute::colour("colour", colours)];
    all
}

impl Twin {
    /// Recorded with a depth camera and a camera of colours at the same place, which may have more pixels.
    pub(super) fn new(camera: Camera, photo: [usize; 2]) -> Twin {
        let photo = camera.scaled_to(photo);
        let mesh = scene();
        let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 1).unwrap();
        let seen = |camera: &Camera, world_from_sensor: DAffine3| {
            let [cols, rows] = camera.size.unwrap();
            let projection = camera.projection(DepthKind::Planar);
            let place = scan::VirtualCamera { rows, cols, projection, world_from_sensor };
            scan::scan(&mesh, &bvh, &place, &ScanParams::default(), &Progress::none()).unwrap()
        };
        let mut twin = Twin { depths: Vec::new(), colours: Vec::new(), camera, photo };
        for k in 0..FRAMES {
            let angle = 0.35 * k as f64 - 0.9;
            let eye = DVec3::new(2.4 * angle.sin(), 0.3 * (2.0 * angle).cos() + 0.1, 2.4 * angle.cos());
            let roll = DVec3::new(0.3 * angle, 1.0, 0.1);
            let pose = scan::VirtualCamera::pinhole(2, 2, 1.0, eye, DVec3::ZERO, roll).unwrap().world_from_sensor;
            // A camera whose y runs up stands on its feet as well.
            let upright = if camera.focal[1] < 0.0 {
                DAffine3::from_rotation_z(std::f64::consts::PI)
            } else {
                DAffine3::IDENTITY
            };
            let mut depth = seen(&camera, pose * upright);
            depth.colour = None;
            let colours = seen(&photo, pose * upright).colour.unwrap();
            twin.depths.push(depth);
            // A place that shows no thing is grey, not the black of a rim.
            twin.colours.push(colours.iter().map(|&[r, g, b, a]| if a == 0 { [90; 3] } else { [r, g, b] }).collect());
        }
        twin
    }

    /// A depth camera like a phone's, with more pixels of colour.
    pub(super) fn phone() -> Twin {
        Twin::new(Camera::sized([44.0, 44.0], [31.2, 23.9], [64, 48]), [256, 192])
    }

    /// Colours registered to depth, by a camera that is given for images of another size.
    pub(super) fn kinect(camera: Camera) -> Twin {
        Twin::new(camera.scaled_to([64, 48]), [64, 48])
    }

    pub(super) fn size(&self) -> [usize; 2] {
        self.camera.size.unwrap()
    }

    /// The pose of a frame.
    pub(super) fn pose(&self, k: usize) -> DAffine3 {
        self.depths[k].world_from_sensor
    }

    /// The pose of a frame for cameras with y up that look along -z.
    pub(super) fn pose_backward(&self, k: usize) -> DAffine3 {
        self.pose(k) * DAffine3::from_scale(DVec3::new(1.0, -1.0, -1.0))
    }

    /// Depths in units of `per_metre`, 0 where there is none.
    pub(super) fn whole(&self, k: usize, per_metre: f64) -> Vec<u16> {
        let depth = &self.depths[k];
        let stored = |i: usize| if depth.is_valid(i) { (depth.range(i) * per_metre).round() as u16 } else { 0 };
        (0..depth.len()).map(stored).collect()
    }

    /// Depths in metres, 0 where there is none.
    pub(super) fn floats(&self, k: usize) -> Vec<f32> {
        let depth = &self.depths[k];
        (0..depth.len()).map(|i| if depth.is_valid(i) { depth.range(i) as f32 } else { 0.0 }).collect()
    }

    /// The colour image as JPEG.
    pub(super) fn jpeg(&self, k: usize) -> Vec<u8> {
        jpeg(self.photo.size.unwrap(), &self.colours[k])
    }

    /// The colour image as PNG.
    pub(super) fn png(&self, k: usize) -> Vec<u8> {
        png(self.photo.size.unwrap(), png::ColorType::Rgb, png::BitDepth::Eight, self.colours[k].as_flattened())
    }

    /// The depth image as PNG.
    pub(super) fn depth_png(&self, k: usize, per_metre: f64) -> Vec<u8> {
        grey16(self.size(), &self.whole(k, per_metre))
    }
}

/// A JPEG file.
pub(super) fn jpeg(size: [usize; 2], pixels: &[[u8; 3]]) -> Vec<u8> {
    let none = Progress::none();
    crate::export::jpeg::encoded(size.map(|side| side as u32), 3, pixels.as_flattened(), 95, &none).unwrap()
}

/// A PNG file.
pub(super) fn png([cols, rows]: [usize; 2], colour: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, cols as u32, rows as u32);
    encoder.set_color(colour);
    encoder.set_depth(depth);
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

/// A PNG file of 16 bits per pixel.
pub(super) fn grey16(size: [usize; 2], values: &[u16]) -> Vec<u8> {
    let data: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    png(size, png::ColorType::Grayscale, png::BitDepth::Sixteen, &data)
}

/// A PNG file of 8 bits per pixel.
pub(super) fn grey8(size: [usize; 2], values: &[u8]) -> Vec<u8> {
    png(size, png::ColorType::Grayscale, png::BitDepth::Eight, values)
}

/// The rows of a matrix as JSON or, without commas, as text.
pub(super) fn rows(pose: DAffine3, between: &str) -> String {
    let m = glam::DMat4::from(pose).transpose().to_cols_array();
    m.map(|x| format!("{x:.9}")).join(between)
}

/// Files of a recording, to be put into a folder or an archive.
#[derive(Default)]
pub(super) struct Files(pub(super) Vec<(String, Vec<u8>)>);

impl Files {
    pub(super) fn put(&mut self, name: impl Into<String>, content: impl Into<Vec<u8>>) {
        self.0.push((name.into(), content.into()));
    }

    pub(super) fn write(&self, folder: &Path) {
        for (name, content) in &self.0 {
            let path = folder.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, content).unwrap();
        }
    }

    /// In a folder of its own.
    pub(super) fn folder(&self) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recording");
        self.write(&path);
        (folder, path)
    }

    /// As an archive.
    pub(super) fn archive(&self) -> Vec<u8> {
        use std::io::Write;
        let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        for (name, content) in &self.0 {
            zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
            zip.write_all(content).unwrap();
        }
        zip.finish().unwrap().into_inner()
    }

    /// Replaces the content of a file.
    pub(super) fn change(&mut self, name: &str, change: impl FnOnce(&mut Vec<u8>)) {
        change(&mut self.0.iter_mut().find(|file| file.0 == name).unwrap_or_else(|| panic!("no file {name}")).1);
    }

    /// Takes out files whose name contains this.
    pub(super) fn without(mut self, part: &str) -> Files {
        self.0.retain(|(name, _)| !name.contains(part));
        self
    }
}
