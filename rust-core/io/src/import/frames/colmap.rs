//! COLMAP's dense workspace: `sparse/` with cameras and images (binary or text, world to camera), `stereo/depth_maps/` with a map for each
//! image (geometric, else photometric), `images/` with the undistorted images. Lengths are the model's own.
//!
//! Pixel centres lie at halves there. Maps may be smaller than the images. 0 and less is no depth.
//!
//! Photos are also taken of a model without maps: `sparse/` or `sparse/0/` and `images/`. The distortion of their lenses is undone.

use std::collections::HashMap;

use glam::DAffine3;

use super::asked::{Asked, counted};
use super::decode::Coding;
use super::lens::Lens;
use super::recording::{Convention, Entry, Lone, Recording, in_order, pose_of};
use super::store::{Place, Store};
use crate::import::text::lines_of;
use base::error::{Error, Result};
use image::frame::Camera;

const ENDINGS: [&str; 2] = [".geometric.bin", ".photometric.bin"];

/// Depths beyond are none that any reconstruction has: what was not written at all.
const FURTHEST: f64 = 1e9;

/// Folder of the maps of depth.
const MAPS: &str = "stereo/depth_maps";

fn within(store: &Store, name: &str) -> String {
    if store.has("stereo") || !recognize(store) { name.to_owned() } else { format!("dense/{name}") }
}

/// The folder that has the model.
fn sparse(store: &Store) -> String {
    let inner = within(store, "sparse/0");
    if has_cameras(store, &inner) { inner } else { within(store, "sparse") }
}

fn has_cameras(store: &Store, folder: &str) -> bool {
    ["bin", "txt"].iter().any(|ending| store.has(&format!("{folder}/cameras.{ending}")))
}

/// Whether there is a model, with or without maps.
pub(super) fn has_model(store: &Store) -> bool {
    has_cameras(store, &sparse(store)) && store.has(&within(store, "images"))
}

pub(super) fn recognize(store: &Store) -> bool {
    store.has(MAPS) || store.has(&format!("dense/{MAPS}"))
}

/// An image of the model.
struct Posed {
    name: String,
    camera: u32,
    world_from_camera: DAffine3,
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let folder = within(&store, MAPS);
    let cameras = cameras(&store, asked)?;
    let posed = images(&store, asked)?;
    let maps = store.list(&folder, asked.progress)?;
    let mut by_name: HashMap<&str, &Posed> = posed.iter().map(|image| (image.name.as_str(), image)).collect();
    let (mut entries, mut photos, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    for name in in_order(posed.iter().map(|image| image.name.clone())) {
        let Some(image) = by_name.remove(name.as_str()) else { continue };
        let map = ENDINGS.iter().map(|ending| format!("{name}{ending}"));
        let in_folders = name.contains('/');
        let there = |map: &String| if in_folders { store.has(&format!("{folder}/{map}")) } else { maps.contains(map) };
        let map = map.into_iter().find(there);
        if map.is_none() && !asked.photos {
            continue;
        }
        let (camera, lens) = *cameras.get(&image.camera).ok_or_else(|| {
            let problem = format!("{name} names the camera {}, which is missing in the model", image.camera);
            Error::format(&store.path_of(&sparse(&store)), "images", problem)
        })?;
        let colour = within(&store, &format!("images/{name}"));
        if asked.photos && !store.has(&colour) {
            missing.push(colour);
            continue;
        }
        let Some(map) = map.filter(|_| lens.is_none()) else {
            let (place, world_from_camera) = (Place::Named(colour.into()), image.world_from_camera);
            photos.push(Lone { place, camera, lens, world_from_camera });
            continue;
        };
        entries.push(Entry {
            name: super::recording::stem(&name).into(),
            depth: Place::Named(format!("{folder}/{map}").into()),
            colour: store.has(&colour).then(|| Place::Named(colour.into())),
            confidence: None,
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor: image.world_from_camera,
        });
    }
    let without = if asked.photos { 0 } else { posed.len() - entries.len() };
    let lost = counted(without, posed.len(), "have no depth map and are passed over");
    let mut recording = Recording::new(store, layout);
    // Photos by name, taken one by one from anywhere.
    recording.is_in_time = false;
    recording.depth.coding = Coding::Colmap;
    recording.depth.unit = 1.0;
    recording.reach = Some(FURTHEST);
    recording.convention = Convention { world_to_camera: true, ..Convention::FORWARD };
    recording.notes.extend(lost);
    recording.notes.push("lengths are those of the reconstruction, which has no scale of its own".to_owned());
    Ok(Recording { entries, photos, missing, ..recording })
}

/// Text or bytes of one of the model's files.
enum Model {
    Text(String),
    Binary(Vec<u8>),
}

fn model(store: &Store, what: &str, asked: &Asked<'_, '_>) -> Result<(String, Model)> {
    let [binary, text] = ["bin", "txt"].map(|ending| format!("{}/{what}.{ending}", sparse(store)));
    if store.has(&binary) {
        let bytes =
            store.bytes(&Place::Named(binary.as_str().into()), asked.options.max_decoded_bytes(), asked.progress)?;
        return Ok((binary, Model::Binary(bytes)));
    }
    if store.has(&text) {
        let content = store.text(&text, asked.progress)?;
        return Ok((text, Model::Text(content)));
    }
    let problem = format!("it is missing, and {what}.txt as well: depth maps without the model have no poses");
    Err(Error::format(&store.path_of(&binary), "whole file", problem))
}

/// A camera with its lens.
type WithLens = (Camera, Option<Lens>);

/// Cameras by their number.
fn cameras(store: &Store, asked: &Asked<'_, '_>) -> Result<HashMap<u32, WithLens>> {
    let (name, model) = model(store, "cameras", asked)?;
    let fail = |at: String, problem: String| Error::format(&store.path_of(&name), at, problem);
    let mut cameras = HashMap::new();
    match model {
        Model::Text(text) => {
            for (number, words) in content(&text) {
                let found = (|| {
                    let size = [words.get(2)?.parse().ok()?, words.get(3)?.parse().ok()?];
                    let params: Vec<f64> = words[4..].iter().map(|word| word.parse().ok()).collect::<Option<_>>()?;
                    Some((words[0].parse().ok()?, words[1], size, params))
                })();
                let at = format!("line {number}");
                let (id, kind, size, params) =
                    found.ok_or_else(|| fail(at.clone(), "expected id, model, size and parameters".to_owned()))?;
                cameras.insert(id, camera(kind, size, &params, asked.photos).map_err(|problem| fail(at, problem))?);
            }
        }
        Model::Binary(bytes) => {
            let mut bytes = Bytes { rest: &bytes };
            let ends = || fail("whole file".to_owned(), "the file ends within a camera".to_owned());
            let count = bytes.u64().ok_or_else(ends)?;
            for _ in 0..count {
                asked.progress.check()?;
                let (id, kind) = bytes.u32().zip(bytes.u32()).ok_or_else(ends)?;
                let size = bytes.u64().zip(bytes.u64()).ok_or_else(ends)?;
                let &(kind, parameters) = MODELS.get(kind as usize).ok_or_else(|| {
                    fail(format!("camera {id}"), format!("the camera model {kind} is none of COLMAP's: the file must be written by COLMAP, or be converted by it"))
                })?;
                let params: Option<Vec<f64>> = (0..parameters).map(|_| bytes.f64()).collect();
                let size = [size.0 as usize, size.1 as usize];
                let camera = camera(kind, size, &params.ok_or_else(ends)?, asked.photos);
                cameras.insert(id, camera.map_err(|problem| fail(format!("camera {id}"), problem))?);
            }
        }
    }
    Ok(cameras)
}

/// COLMAP's models of cameras by their number, with their parameters.
const MODELS: [(&str, usize); 11] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
];

/// A camera and its lens, which is taken with distortion for photos alone.
fn camera(kind: &str, size: [usize; 2], params: &[f64], photos: bool) -> Result<WithLens, String> {
    let none = ([0.0; 4], [0.0; 2]);
    let (focal, centre, (radial, tangential)) = match (kind, params) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => ([f, f], [cx, cy], none),
        ("PINHOLE", &[fx, fy, cx, cy]) => ([fx, fy], [cx, cy], none),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) if photos => ([f, f], [cx, cy], ([k, 0.0, 0.0, 0.0], [0.0; 2])),
        ("RADIAL", &[f, cx, cy, k1, k2]) if photos => ([f, f], [cx, cy], ([k1, k2, 0.0, 0.0], [0.0; 2])),
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) if photos => ([fx, fy], [cx, cy], ([k1, k2, 0.0, 0.0], [p1, p2])),
        _ => {
            return Err(format!(
                "the camera model {kind} with {} parameters is no pinhole camera: undistort the images first \
                 (image_undistorter)",
                params.len()
            ));
        }
    };
    if !size.iter().all(|side| (1..1 << 30).contains(side)) {
        return Err(format!("an image of {} x {} pixels can't be", size[0], size[1]));
    }
    let camera = Camera::sized(focal, centre.map(|c| c - 0.5), size);
    camera.validate().map_err(|error| error.to_string())?;
    Ok((camera, Lens { radial, tangential }.if_any()))
}

/// Lines with content and their words.
fn content(text: &str) -> impl Iterator<Item = (usize, Vec<&str>)> {
    let lines = lines_of(text).enumerate().map(|(number, line)| (number + 1, line.trim()));
    lines
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .map(|(number, line)| (number, line.split_ascii_whitespace().collect()))
}

/// The images with their poses.
fn images(store: &Store, asked: &Asked<'_, '_>) -> Result<Vec<Posed>> {
    let (name, model) = model(store, "images", asked)?;
    let fail = |at: String, problem: String| Error::format(&store.path_of(&name), at, problem);
    let mut images = Vec::new();
    match model {
        Model::Text(text) => {
            let mut lines = lines_of(&text).enumerate();
            while let Some((number, line)) = lines.next() {
                if line.trim().is_empty() || line.starts_with('#') {
                    continue;
                }
                // The next one lists points, and may be empty.
                lines.next();
                let words: Vec<&str> = line.trim().splitn(10, ' ').collect();
                let numbers: Option<Vec<f64>> = words.iter().skip(1).take(7).map(|word| word.parse().ok()).collect();
                let camera = words.get(8).and_then(|word| word.parse().ok());
                let found = numbers.filter(|numbers| numbers.len() == 7).zip(camera).zip(words.get(9));
                let at = format!("line {}", number + 1);
                let ((numbers, camera), name) = found
                    .ok_or_else(|| fail(at.clone(), "expected id, qw qx qy qz, tx ty tz, camera, name".to_owned()))?;
                let numbers = [0, 1, 2, 3, 4, 5, 6].map(|k| numbers[k]);
                images.push(posed(numbers, camera, (*name).to_owned()).map_err(|problem| fail(at, problem))?);
            }
        }
        Model::Binary(bytes) => {
            let mut bytes = Bytes { rest: &bytes };
            let ends = || fail("whole file".to_owned(), "the file ends within an image".to_owned());
            let count = bytes.u64().ok_or_else(ends)?;
            for k in 0..count {
                asked.progress.check()?;
                bytes.u32().ok_or_else(ends)?;
                let numbers: Option<Vec<f64>> = (0..7).map(|_| bytes.f64()).collect();
                let numbers = numbers.ok_or_else(ends)?;
                let camera = bytes.u32().ok_or_else(ends)?;
                let name = bytes.text().ok_or_else(ends)?;
                let points = bytes.u64().ok_or_else(ends)?;
                bytes.skip(points.checked_mul(24).ok_or_else(ends)?).ok_or_else(ends)?;
                let numbers = [0, 1, 2, 3, 4, 5, 6].map(|k| numbers[k]);
                images.push(posed(numbers, camera, name).map_err(|problem| fail(format!("image {k}"), problem))?);
            }
        }
    }
    Ok(images)
}

fn posed([w, x, y, z, a, b, c]: [f64; 7], camera: u32, name: String) -> Result<Posed, String> {
    if name.starts_with('/') || name.split(['/', '\\']).any(|part| part == "..") {
        return Err(format!("{name} leads out of the folder of images: put the image there"));
    }
    Ok(Posed { name, camera, world_from_camera: pose_of([x, y, z, w], [a, b, c])?.inverse() })
}

/// Little-endian numbers one after the other.
struct Bytes<'a> {
    rest: &'a [u8],
}

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*taken)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    /// A text that ends with a zero byte.
    fn text(&mut self) -> Option<String> {
        let end = memchr::memchr(0, self.rest)?;
        let text = std::str::from_utf8(&self.rest[..end]).ok()?.to_owned();
        self.rest = &self.rest[end + 1..];
        Some(text)
    }

    fn skip(&mut self, count: u64) -> Option<()> {
        self.rest = self.rest.get(usize::try_from(count).ok()?..)?;
        Some(())
    }
}
