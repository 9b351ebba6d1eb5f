//! Stray Scanner: `depth/000000.png` (millimetres), `confidence/000000.png` (0, 1, 2), poses in `odometry.csv`, a
//! camera in `camera_matrix.csv`, in newer versions one a row of the odometry. Its colours are a video, `rgb.mp4`,
//! which is not read.
//!
//! Nobody wrote down the axes of its cameras for all versions: how the frames overlap decides.

use super::asked::{Asked, counted};
use super::recording::{Convention, Entry, Recording, in_order, pose_of, stem};
use super::store::{Place, Store};
use crate::import::text::lines_of;
use base::error::{Error, Result};
use glam::DAffine3;
use image::frame::Camera;
use std::collections::BTreeMap;

const POSES: &str = "odometry.csv";
const CAMERA: &str = "camera_matrix.csv";

/// Columns and rows of the video, which cameras are given for.
const VIDEO: [usize; 2] = [1920, 1440];

pub(super) fn recognize(store: &Store) -> bool {
    store.has(POSES)
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let depths = in_order(store.list("depth", asked.progress)?);
    if depths.is_empty() {
        let problem = "there are no depth images: this export has poses, and its video at most, but no depth. Scan \
            with a device that has LiDAR and export the folder depth with it.";
        return Err(Error::format(&store.path_of("depth"), "whole folder", problem));
    }
    let camera = camera(&store, asked)?;
    let rows = rows(&store, camera, asked)?;
    let confidences = store.list("confidence", asked.progress)?;
    let mut entries = Vec::new();
    for name in &depths {
        let Some(&(world_from_sensor, camera)) = stem(name).parse().ok().and_then(|number: u64| rows.get(&number))
        else {
            continue;
        };
        entries.push(Entry {
            name: stem(name).into(),
            depth: Place::Named(format!("depth/{name}").into()),
            colour: None,
            confidence: confidences.contains(name).then(|| Place::Named(format!("confidence/{name}").into())),
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor,
        });
    }
    let lost = counted(depths.len() - entries.len(), depths.len(), "have no pose and are passed over");
    let has_video = store.has("rgb.mp4");
    let mut recording = Recording::of_phone(store, layout);
    recording.convention = Convention { is_sure: false, ..Convention::FORWARD };
    recording.notes.extend(lost);
    if has_video {
        recording.notes.push("colours are in a video, rgb.mp4, which is not read".to_owned());
    }
    Ok(Recording { entries, ..recording })
}

/// The matrix of the whole recording, which older versions have alone.
fn camera(store: &Store, asked: &Asked<'_, '_>) -> Result<Option<Camera>> {
    if !store.has(CAMERA) {
        return Ok(None);
    }
    let text = store.text(CAMERA, asked.progress)?;
    let camera = crate::import::camera::parse(text.as_bytes(), &store.path_of(CAMERA))?;
    Ok(Some(Camera { size: Some(VIDEO), ..camera }))
}

/// Pose and camera by the number of the frame.
fn rows(store: &Store, camera: Option<Camera>, asked: &Asked<'_, '_>) -> Result<BTreeMap<u64, (DAffine3, Camera)>> {
    let text = store.text(POSES, asked.progress)?;
    let fail = |line: usize, problem: &str| Error::format(&store.path_of(POSES), format!("line {}", line + 1), problem);
    let mut lines = lines_of(&text).enumerate().filter(|(_, line)| !line.trim().is_empty());
    let header: Vec<&str> = lines.next().map(|(_, line)| line.split(',').map(str::trim).collect()).unwrap_or_default();
    let column = |name: &str| header.iter().position(|found| *found == name);
    let columns = |names: [&str; 4]| -> Option<[usize; 4]> {
        let found: Vec<usize> = names.into_iter().map(column).collect::<Option<_>>()?;
        found.try_into().ok()
    };
    let (Some(frame), Some([x, y, z, qx]), Some([_, qy, qz, qw])) =
        (column("frame"), columns(["x", "y", "z", "qx"]), columns(["qx", "qy", "qz", "qw"]))
    else {
        return Err(fail(0, "expected the columns frame, x, y, z, qx, qy, qz, qw"));
    };
    let own = columns(["fx", "fy", "cx", "cy"]);
    let mut rows = BTreeMap::new();
    for (number, line) in lines {
        let words: Vec<&str> = line.split(',').map(str::trim).collect();
        let value = |column: usize| words.get(column).and_then(|word| word.parse::<f64>().ok());
        let all = |columns: [usize; 4]| -> Option<[f64; 4]> {
            let found: Vec<f64> = columns.into_iter().map(value).collect::<Option<_>>()?;
            found.try_into().ok()
        };
        let frame: Option<u64> = words.get(frame).and_then(|word| word.parse().ok());
        let (Some(frame), Some([x, y, z, _]), Some(turn)) = (frame, all([x, y, z, qx]), all([qx, qy, qz, qw])) else {
            return Err(fail(number, "a number of the pose is missing"));
        };
        let camera = match own.and_then(all) {
            Some([fx, fy, cx, cy]) => Camera::sized([fx, fy], [cx, cy], VIDEO),
            None => camera.ok_or_else(|| fail(number, "there is no camera: camera_matrix.csv is missing"))?,
        };
        camera.validate().map_err(|error| fail(number, &error.to_string()))?;
        let pose = pose_of(turn, [x, y, z]).map_err(|problem| fail(number, &problem))?;
        rows.insert(frame, (pose, camera));
    }
    Ok(rows)
}
