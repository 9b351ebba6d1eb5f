//! Replica as NICE-SLAM rendered it, and other renderings since in its form: `results/depth000000.png` and `frame000000.jpg`, `traj.txt`
//! with 16 numbers per frame (camera to world), `cam_params.json` with the camera and the number of a metre, in the folder or beside it.

use super::asked::{Asked, counted};
use super::poses;
use super::recording::{Entry, Recording, in_order, photo_of, stem};
use super::store::{Place, Store};
use base::error::{Error, Result};
use image::frame::Camera;

const POSES: &str = "traj.txt";
const FRAMES: &str = "results";
const CAMERA: &str = "cam_params.json";

/// The camera of the data set's renderers.
const USUAL: Camera = Camera { focal: [600.0, 600.0], centre: [599.5, 339.5], size: Some([1200, 680]) };
const PER_METRE: f64 = 6553.5;

pub(super) fn recognize(store: &Store) -> bool {
    store.has(POSES) && store.has(FRAMES)
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let names = store.list(FRAMES, asked.progress)?;
    let depths = in_order(names.iter().filter(|name| name.starts_with("depth")).cloned());
    let (poses, _) = poses::listed(&store, POSES, asked)?;
    let number = |name: &str| stem(name).trim_start_matches(|c: char| !c.is_ascii_digit()).parse::<usize>().ok();
    let (camera, per_metre, note) = camera(&store, asked)?;
    let (mut entries, mut lost) = (Vec::new(), 0);
    for (k, depth) in depths.iter().enumerate() {
        // If frames were taken out, numbers say which are left.
        let line = if poses.len() == depths.len() { Some(k) } else { number(depth) };
        let Some(world_from_sensor) = line.and_then(|line| *poses.get(line)?) else {
            lost += 1;
            continue;
        };
        let of_frame = stem(depth).trim_start_matches("depth");
        let colour = photo_of(&format!("frame{of_frame}"), |name| names.contains(name));
        entries.push(Entry {
            name: stem(depth).into(),
            depth: Place::Named(format!("{FRAMES}/{depth}").into()),
            colour: colour.map(|name| Place::Named(format!("{FRAMES}/{name}").into())),
            confidence: None,
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor,
        });
    }
    let mut recording = Recording::new(store, layout);
    recording.depth.unit = 1.0 / per_metre;
    recording.notes.extend(note);
    recording.notes.extend(counted(lost, depths.len(), "have no pose and are passed over"));
    Ok(Recording { entries, ..recording })
}

/// The camera, the number that a metre is stored as, and a note where no file says them.
fn camera(store: &Store, asked: &Asked<'_, '_>) -> Result<(Camera, f64, Option<String>)> {
    let (text, path) = if store.has(CAMERA) {
        (Some(store.text(CAMERA, asked.progress)?), store.path_of(CAMERA))
    } else {
        store.beside(CAMERA)?
    };
    let Some(text) = text else {
        if let Some(camera) = asked.camera_of(store)? {
            return Ok((
                camera,
                PER_METRE,
                Some(format!("no file says the depths' unit: {PER_METRE} are taken for a metre")),
            ));
        }
        let ([fx, fy], [cx, cy]) = (USUAL.focal, USUAL.centre);
        let note = format!(
            "no file says the camera: taken for the data set's, ({fx}, {fy}, {cx}, {cy}), and {PER_METRE} for a metre"
        );
        return Ok((USUAL, PER_METRE, Some(note)));
    };
    let camera = crate::import::camera::parse(text.as_bytes(), &path)?;
    let value: serde_json::Value = serde_json::from_str(&text).unwrap_or_default();
    let scale = super::recording::number(value.get("camera").unwrap_or(&value), "scale");
    match scale.map_err(|problem| Error::format(&path, "scale", problem))?.unwrap_or(PER_METRE) {
        scale if scale > 0.0 => Ok((camera, scale, None)),
        scale => Err(Error::format(&path, "scale", format!("depths are divided by {scale}, which must be > 0"))),
    }
}
