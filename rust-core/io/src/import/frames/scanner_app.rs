//! 3D Scanner App's export of all data: `frame_00000.json` (camera, pose camera to world), `depth_00000.png`
//! (millimetres), `conf_00000.png` (0, 1, 2), and `frame_00000.jpg` for some frames only.

use std::collections::BTreeSet;

use serde_json::Value;

use super::asked::{Asked, counted};
use super::decode;
use super::recording::{Entry, Lone, Recording, flat, json, photo_of, pose};
use super::store::{Place, Store};
use base::error::{Error, Result};
use image::frame::{Camera, TURNED};

/// Columns and rows that cameras are given for where no colour image says it: those of the phones' video.
const PHOTO: [usize; 2] = [1920, 1440];

/// The number of a frame out of the name of its depth image.
fn number(name: &str) -> Option<&str> {
    name.strip_prefix("depth_")?.strip_suffix(".png")
}

/// The number of a frame out of the name of its photo.
fn number_of_photo(name: &str) -> Option<&str> {
    name.strip_prefix("frame_")?.strip_suffix(".jpg")
}

pub(super) fn recognize(store: &Store) -> bool {
    let mut numbers = store.top().filter_map(number);
    numbers.any(|number| store.has(&format!("frame_{number}.json")))
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let size = photo_size(&store, asked)?;
    let mut numbers: BTreeSet<String> = store.top().filter_map(number).map(str::to_owned).collect();
    if asked.photos {
        // They need no depth.
        numbers.extend(store.top().filter_map(number_of_photo).map(str::to_owned));
    }
    let (mut entries, mut photos, mut lost) = (Vec::new(), Vec::new(), 0);
    for number in &numbers {
        asked.progress.check()?;
        let name = format!("frame_{number}.json");
        let fail = |problem: String| Error::format(&store.path_of(&name), "whole file", problem);
        let file = if store.has(&name) { Some(json(&store, &name, asked.progress)?) } else { None };
        let matrix = |key: &str| file.as_ref().and_then(|file: &Value| file.get(key)).and_then(flat);
        let rows: Option<[f64; 16]> = matrix("cameraPoseARFrame").and_then(|rows| rows.try_into().ok());
        let pose = match rows {
            Some(rows) => pose(&rows).map_err(fail)?,
            None => None,
        };
        let Some(pose) = pose else {
            lost += 1;
            continue;
        };
        let intrinsics = matrix("intrinsics").unwrap_or_default();
        let &[fx, _, cx, _, fy, cy, _, _, _] = intrinsics.as_slice() else {
            return Err(fail("`intrinsics` must be nine numbers".to_owned()));
        };
        let camera = Camera::sized([fx, fy], [cx, cy], size);
        camera.validate().map_err(|error| fail(error.to_string()))?;
        let place = |name: String| store.has(&name).then(|| Place::Named(name.into()));
        let colour = photo_of(&format!("frame_{number}"), |name| store.has(name)).map(|name| Place::Named(name.into()));
        let world_from_sensor = pose * TURNED;
        let Some(depth) = place(format!("depth_{number}.png")) else {
            photos.extend(colour.map(|place| Lone { place, camera, lens: None, world_from_camera: world_from_sensor }));
            continue;
        };
        entries.push(Entry {
            name: format!("frame_{number}").into(),
            depth,
            colour,
            confidence: place(format!("conf_{number}.png")),
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor,
        });
    }
    let mut recording = Recording::of_phone(store, layout);
    recording.notes.extend(counted(lost, numbers.len(), "have no pose and are passed over"));
    Ok(Recording { entries, photos, ..recording })
}

/// The size of the colour images, which the cameras are given for.
fn photo_size(store: &Store, asked: &Asked<'_, '_>) -> Result<[usize; 2]> {
    let photo = |number| photo_of(&format!("frame_{number}"), |name| store.has(name));
    let Some(name) = store.top().filter_map(number).find_map(photo) else { return Ok(PHOTO) };
    let bytes = store.bytes(&Place::Named(name.as_str().into()), asked.options.max_decoded_bytes(), asked.progress)?;
    decode::size(&bytes, &store.path_of(&name))
}
