//! 7-Scenes, and what fusion programs made of its form: `frame-000000.depth.png` (millimetres, 65535 for none), `.color.png` or `.jpg`,
//! `.pose.txt` (camera to world), all in one folder. If no frame has a pose file, frames have no poses.
//!
//! Depth and colour of this Kinect are not registered, and no file says by how much: both are taken by the depth's
//! camera.

use glam::DAffine3;

use super::asked::{Asked, counted};
use super::poses;
use super::recording::{Entry, Recording, photo_of};
use super::store::{Place, Store};
use base::error::Result;
use image::frame::Camera;

const DEPTH: &str = ".depth.png";
const POSE: &str = ".pose.txt";

/// The depth camera as the data set's authors give it.
const CAMERA: Camera = Camera { focal: [585.0, 585.0], centre: [320.0, 240.0], size: Some([640, 480]) };

pub(super) fn recognize(store: &Store) -> bool {
    store.top().any(|name| frame_of(name).is_some())
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let camera = asked.camera_of(&store)?;
    let depths: Vec<String> = store.top().filter(|name| frame_of(name).is_some()).map(str::to_owned).collect();
    let has_poses = store.top().any(|name| name.ends_with(POSE));
    let (mut entries, mut lost) = (Vec::new(), 0);
    for depth in &depths {
        asked.progress.check()?;
        let Some(frame) = frame_of(depth) else { continue };
        let name = format!("{frame}{POSE}");
        let pose = match (has_poses, store.has(&name)) {
            (false, _) => Some(DAffine3::IDENTITY),
            (true, true) => poses::of_file(&store, &name, asked).map_err(poses::or_without)?,
            (true, false) => None,
        };
        let Some(world_from_sensor) = pose else {
            lost += 1;
            continue;
        };
        entries.push(Entry {
            name: frame.into(),
            depth: Place::Named(depth.as_str().into()),
            colour: photo_of(&format!("{frame}.color"), |name| store.has(name)).map(|name| Place::Named(name.into())),
            confidence: None,
            depth_camera: camera.unwrap_or(CAMERA),
            colour_camera: camera.unwrap_or(CAMERA),
            world_from_sensor,
        });
    }
    let notes = counted(lost, depths.len(), "have no pose and are passed over").into_iter().collect();
    let no_poses = (!has_poses).then(|| format!("there are no files {POSE}"));
    Ok(Recording { entries, notes, no_poses, ..Recording::new(store, layout) })
}

/// The frame that a depth image is of, by its name.
fn frame_of(name: &str) -> Option<&str> {
    name.strip_suffix(DEPTH)
        .or_else(|| name.strip_suffix(".depth.PNG"))
        .filter(|frame| frame.ends_with(|c: char| c.is_ascii_digit()))
}
