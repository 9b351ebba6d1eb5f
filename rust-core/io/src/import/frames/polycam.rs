//! Polycam's raw export: `keyframes/` with `depth/` (millimetres), `confidence/` (0, 127, 255), `images/` and `cameras/`, files of a frame
//! named alike by its time. `corrected_images` and `corrected_cameras` come with better poses and without distortion, but with a black rim
//! around the images. Long sessions have none, or some alone. Corrected poses are of another frame of reference than the others, so that
//! all are taken from one of them.

use std::collections::BTreeMap;

use serde_json::Value;

use super::asked::{Asked, counted};
use super::recording::{self, Entry, Lone, Recording, json, photo_of, pose, stem};
use super::store::{Place, Store};
use base::error::{Error, Result};
use image::frame::{Camera, TURNED};

const FRAMES: &str = "keyframes";

const LOST: &str = "have no pose and are passed over";

/// The share of the frames from which on corrected poses are taken, and frames without them are passed over.
const MOST: f64 = 0.9;

/// The folder that holds a kind of files, from the top.
fn within(store: &Store, folder: &str) -> String {
    if store.has(FRAMES) { format!("{FRAMES}/{folder}") } else { folder.to_owned() }
}

pub(super) fn recognize(store: &Store) -> bool {
    let has = |folder: &str| store.has(&within(store, folder));
    (has("cameras") && has("images")) || (has("corrected_cameras") && has("corrected_images"))
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let kinds = ["depth", "confidence", "corrected_images", "corrected_cameras", "images", "cameras"];
    let [depth, confidence, corrected_images, corrected_cameras, images, cameras] =
        kinds.map(|folder| within(&store, folder));
    let depths = store.list(&depth, asked.progress)?;
    // Photos need no depth.
    let mut frames: BTreeMap<String, Option<&str>> = BTreeMap::new();
    for folder in [&images, &corrected_images].into_iter().filter(|_| asked.photos) {
        frames.extend(store.list(folder, asked.progress)?.iter().map(|name| (stem(name).to_owned(), None)));
    }
    frames.extend(depths.iter().map(|name| (stem(name).to_owned(), Some(name.as_str()))));
    let having = |cameras: &str| -> Result<usize> {
        let listed = store.list(cameras, asked.progress)?;
        // Photos are in the frame of reference that the scans have, which those with depth decide.
        let deciding = frames.iter().filter(|(_, depth)| depth.is_some() || depths.is_empty());
        Ok(deciding.filter(|(stem, _)| listed.contains(&format!("{stem}.json"))).count())
    };
    let (of_corrected, of_all) = (having(&corrected_cameras)?, having(&cameras)?);
    let is_corrected = store.has(&corrected_images) && of_corrected > 0 && of_corrected as f64 >= MOST * of_all as f64;
    let (images, cameras) = if is_corrected { (corrected_images, corrected_cameras) } else { (images, cameras) };
    if frames.is_empty() {
        let problem = "there are no depth images: only sessions of LiDAR or room mode have them, exported as raw data \
            with developer mode on before scanning";
        return Err(Error::format(&store.path_of(&depth), "whole folder", problem));
    }
    let colours = store.list(&images, asked.progress)?;
    let confidences = store.list(&confidence, asked.progress)?;
    let (mut entries, mut photos, mut lost) = (Vec::new(), Vec::new(), 0);
    for stem in recording::in_order(frames.keys().cloned()) {
        asked.progress.check()?;
        let camera_name = format!("{cameras}/{stem}.json");
        if !store.has(&camera_name) {
            lost += 1;
            continue;
        }
        let fail = |problem: String| Error::format(&store.path_of(&camera_name), "whole file", problem);
        let file = json(&store, &camera_name, asked.progress)?;
        let Some(pose) = pose(&rows(&file).map_err(fail)?).map_err(fail)? else {
            lost += 1;
            continue;
        };
        let camera = camera(&file).map_err(fail)?;
        let colour = photo_of(&stem, |name| colours.contains(name));
        let colour = colour.map(|name| Place::Named(format!("{images}/{name}").into()));
        let Some(name) = frames[&stem] else {
            let world_from_camera = pose * TURNED;
            photos.extend(colour.map(|place| Lone { place, camera, lens: None, world_from_camera }));
            continue;
        };
        entries.push(Entry {
            name: stem.as_str().into(),
            depth: Place::Named(format!("{depth}/{name}").into()),
            colour,
            confidence: confidences.contains(name).then(|| Place::Named(format!("{confidence}/{name}").into())),
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor: pose * TURNED,
        });
    }
    let mut recording = Recording::of_phone(store, layout);
    recording.black_rim = is_corrected;
    let count = frames.len();
    if is_corrected {
        let why = "have no corrected pose and are passed over: others are of another frame of reference";
        recording.notes.extend(counted(lost, count, if of_all > of_corrected { why } else { LOST }));
    } else {
        recording.notes.extend(counted(lost, count, LOST));
        recording.notes.push(match of_corrected {
            0 => "poses and images are those that were not corrected: the session has no corrected ones".to_owned(),
            some => format!(
                "poses and images are those that were not corrected. The session has corrected ones for {some} of \
                    {count} frames alone, which are of another frame of reference."
            ),
        });
    }
    Ok(Recording { entries, photos, ..recording })
}

fn number(file: &Value, key: &str) -> Result<f64, String> {
    recording::number(file, key)?.ok_or_else(|| format!("`{key}` is missing"))
}

fn rows(file: &Value) -> Result<[f64; 16], String> {
    let mut rows = [0.0; 16];
    rows[15] = 1.0;
    for (k, entry) in rows.iter_mut().take(12).enumerate() {
        *entry = number(file, &format!("t_{}{}", k / 4, k % 4))?;
    }
    Ok(rows)
}

fn camera(file: &Value) -> Result<Camera, String> {
    let [fx, fy, cx, cy, width, height] = [
        number(file, "fx")?,
        number(file, "fy")?,
        number(file, "cx")?,
        number(file, "cy")?,
        number(file, "width")?,
        number(file, "height")?,
    ];
    if !((1.0..1e9).contains(&width) && (1.0..1e9).contains(&height)) {
        return Err(format!("an image of {width} x {height} pixels can't be"));
    }
    let camera = Camera::sized([fx, fy], [cx, cy], [width as usize, height as usize]);
    camera.validate().map_err(|error| error.to_string())?;
    Ok(camera)
}
