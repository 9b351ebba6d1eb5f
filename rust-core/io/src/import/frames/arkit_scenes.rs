//! ARKitScenes: `lowres_depth/VIDEO_TIME.png` (millimetres), `lowres_wide/` (colours), `confidence/` (0, 1, 2),
//! `lowres_wide_intrinsics/VIDEO_TIME.pincam` (width height fx fy cx cy), and `lowres_wide.traj`: times with world to camera.

use super::asked::{Asked, counted};
use super::recording::{Convention, Entry, Recording, in_order, photo_of, stem};
use super::store::{Place, Store};
use crate::import::text::Lines;
use crate::import::trajectory::{self, AXIS_ANGLE};
use base::error::{Error, Result};
use image::frame::Camera;

const DEPTHS: &str = "lowres_depth";

/// Most seconds between an image and its pose: times are written in whole milliseconds.
const APART: f64 = 0.006;

/// The folder that has the frames: this one, or that in which the data set's 3D boxes have them.
fn folder(store: &Store) -> Option<String> {
    let mut folders = store.top().filter(|name| name.ends_with("_frames")).map(|name| format!("{name}/"));
    if store.has(DEPTHS) { Some(String::new()) } else { folders.find(|folder| store.has(&format!("{folder}{DEPTHS}"))) }
}

pub(super) fn recognize(store: &Store) -> bool {
    folder(store).is_some()
}

/// The time in the name of a file.
fn time_of(name: &str) -> Option<f64> {
    stem(name).rsplit('_').next()?.parse().ok()
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let within = folder(&store).unwrap_or_default();
    let files = |name: &str| store.list(format!("{within}{name}").trim_end_matches('/'), asked.progress);
    let lists: Vec<String> = files("")?.into_iter().filter(|name| name.ends_with(&format!(".{AXIS_ANGLE}"))).collect();
    let [poses] = lists.as_slice() else {
        let problem = format!(
            "there are {} lists of poses ({}) beside {DEPTHS}, and one is needed: download the asset lowres_wide.traj",
            lists.len(),
            lists.join(", ")
        );
        return Err(Error::format(&store.path_of(&within), "poses", problem));
    };
    let name = format!("{within}{poses}");
    let (text, path) = (store.text(&name, asked.progress)?, store.path_of(&name));
    let poses = trajectory::parse_axis_angle(Lines::new(text.as_bytes(), text.len() as u64, &path))?;
    let (depths, colours, confidences) = (in_order(files(DEPTHS)?), files("lowres_wide")?, files("confidence")?);
    let cameras = cameras(&store, &format!("{within}lowres_wide_intrinsics"), asked)?;
    let place = |folder: &str, name: &str| Place::Named(format!("{within}{folder}/{name}").into());
    let (mut entries, mut lost) = (Vec::new(), 0);
    for depth in &depths {
        asked.progress.check()?;
        let found = time_of(depth).and_then(|time| Some((time, poses.within(time, APART)?)));
        let Some((time, world_from_sensor)) = found else {
            lost += 1;
            continue;
        };
        let camera = match nearest(&cameras, time) {
            Some(camera) => camera,
            None => asked.camera(&store, layout, ", or download the asset lowres_wide_intrinsics")?,
        };
        entries.push(Entry {
            name: stem(depth).into(),
            depth: place(DEPTHS, depth),
            colour: photo_of(stem(depth), |name| colours.contains(name)).map(|name| place("lowres_wide", &name)),
            confidence: confidences.contains(depth).then(|| place("confidence", depth)),
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor,
        });
    }
    let mut recording = Recording::of_phone(store, layout);
    recording.convention = Convention { world_to_camera: true, ..Convention::FORWARD };
    // The worlds of its trajectories were turned after recording.
    recording.up = None;
    let why = format!("have no pose within {APART} s and are passed over");
    recording.notes.extend(counted(lost, depths.len(), &why));
    Ok(Recording { entries, ..recording })
}

/// Cameras with their times, in order.
fn cameras(store: &Store, folder: &str, asked: &Asked<'_, '_>) -> Result<Vec<(f64, Camera)>> {
    let mut cameras = Vec::new();
    for name in store.list(folder, asked.progress)? {
        asked.progress.check()?;
        let Some(time) = time_of(&name).filter(|_| name.ends_with(".pincam")) else { continue };
        let name = format!("{folder}/{name}");
        let text = store.text(&name, asked.progress)?;
        let numbers: Option<Vec<f64>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
        let fail = |problem: String| Error::format(&store.path_of(&name), "whole file", problem);
        let Some(&[width, height, fx, fy, cx, cy]) = numbers.as_deref() else {
            return Err(fail("expected six numbers: width height fx fy cx cy".to_owned()));
        };
        if !((1.0..1e9).contains(&width) && (1.0..1e9).contains(&height)) {
            return Err(fail(format!("an image of {width} x {height} pixels can't be")));
        }
        let camera = Camera::sized([fx, fy], [cx, cy], [width as usize, height as usize]);
        camera.validate().map_err(|error| fail(error.to_string()))?;
        cameras.push((time, camera));
    }
    cameras.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(cameras)
}

fn nearest(cameras: &[(f64, Camera)], time: f64) -> Option<Camera> {
    let after = cameras.partition_point(|(of, _)| *of < time);
    let near = [after.wrapping_sub(1), after].into_iter().filter_map(|i| cameras.get(i));
    near.min_by(|a, b| (a.0 - time).abs().total_cmp(&(b.0 - time).abs())).map(|(_, camera)| *camera)
}
