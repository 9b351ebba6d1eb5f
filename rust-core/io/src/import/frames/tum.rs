//! TUM RGB-D: `depth.txt`, `rgb.txt` and `groundtruth.txt` say times. Each depth image takes the colour image and the pose that are nearest
//! in time. It is checked whether the lists are of one clock. Depths are 5000 to the metre. Lists may name images that are not there.
//! Without `groundtruth.txt` frames have no poses.

use glam::DAffine3;

use super::asked::{Asked, counted};
use super::poses;
use super::recording::{Entry, Recording, Timed};
use super::store::{Place, Store};
use crate::import::text::{Lines, lines_of};
use crate::import::trajectory::{self, APART, Trajectory};
use base::error::{Error, Result};
use image::frame::Camera;

const DEPTHS: &str = "depth.txt";
const COLOURS: &str = "rgb.txt";
const POSES: &str = "groundtruth.txt";

/// Cameras of the data set's three Kinects, by the folder's name.
const CAMERAS: [([&str; 2], Camera); 3] = [
    (["freiburg1", "fr1"], kinect([517.3, 516.5], [318.6, 255.3])),
    (["freiburg2", "fr2"], kinect([520.9, 521.0], [325.1, 249.7])),
    (["freiburg3", "fr3"], kinect([535.4, 539.2], [320.1, 247.6])),
];

const fn kinect(focal: [f64; 2], centre: [f64; 2]) -> Camera {
    Camera { focal, centre, size: Some([640, 480]) }
}

pub(super) fn recognize(store: &Store) -> bool {
    store.has(DEPTHS) && store.has("depth")
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let (camera, note) = camera(&store, layout, asked)?;
    let (depths, gone) = listed(&store, DEPTHS, asked)?;
    if depths.is_empty() && gone == 0 {
        let problem = "the list names no image: fill it with lines of a time and the name of a depth image";
        return Err(Error::format(&store.path_of(DEPTHS), "whole file", problem));
    }
    let colours = if store.has(COLOURS) { listed(&store, COLOURS, asked)?.0 } else { Vec::new() };
    let path = store.path_of(POSES);
    let poses = match store.has(POSES) {
        false => None,
        true => {
            let text = store.text(POSES, asked.progress)?;
            let lines = Lines::new(text.as_bytes(), text.len() as u64, &path);
            Some(trajectory::parse(lines).map_err(poses::or_without)?)
        }
    };
    let (mut entries, mut times, mut lost) = (Vec::new(), Vec::new(), 0);
    for (time, name) in &depths {
        asked.progress.check()?;
        let Some(world_from_sensor) = poses.as_ref().map_or(Some(DAffine3::IDENTITY), |poses| poses.at(*time)) else {
            lost += 1;
            continue;
        };
        times.push(*time);
        entries.push(Entry {
            name: super::recording::stem(name).into(),
            depth: Place::Named(name.as_str().into()),
            colour: nearest(&colours, *time).map(|name| Place::Named(name.into())),
            confidence: None,
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor,
        });
    }
    if let (Some([first, last]), [(begin, _), ..], true) =
        (poses.as_ref().and_then(Trajectory::span), depths.as_slice(), entries.is_empty())
    {
        let end = depths.last().map_or(*begin, |(time, _)| *time);
        let problem = format!(
            "no depth image has a pose within {APART} s: {DEPTHS} lists times from {begin:.3} to {end:.3} s, {POSES} \
                from {first:.3} to {last:.3} s. Bring both to one clock, for example by adding {:.3} to all times of \
                the one list.",
            first - begin
        );
        return Err(Error::format(&path, "times", problem));
    }
    let why = format!("have no pose within {APART} s and are passed over");
    let mut recording = Recording::new(store, layout);
    recording.depth.unit = 1.0 / 5000.0;
    recording.notes.extend(note);
    recording.notes.extend(counted(lost, depths.len(), &why));
    recording.notes.extend(counted(
        gone,
        depths.len() + gone,
        "that depth.txt lists are not there and are passed over",
    ));
    recording.no_poses = poses.is_none().then(|| format!("{POSES} is missing"));
    Ok(Recording { entries, timed: poses.map(|poses| Timed { poses, times }), ..recording })
}

/// The camera, and a note where no file says it.
fn camera(store: &Store, layout: &str, asked: &Asked<'_, '_>) -> Result<(Camera, Option<String>)> {
    if let Some(camera) = asked.camera_of(store)? {
        return Ok((camera, None));
    }
    // Of the data set's own folder, whatever the folders above are called.
    let path = store.path.canonicalize().unwrap_or_else(|_| store.path.clone());
    let folder = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let mut words = folder.split(|c: char| !c.is_ascii_alphanumeric());
    let known = words
        .find_map(|word| CAMERAS.iter().find(|(names, _)| names.contains(&word)).map(|(_, camera)| (word, camera)));
    match known.filter(|_| asked.options.camera.is_none()) {
        Some((name, camera)) => {
            let ([fx, fy], [cx, cy]) = (camera.focal, camera.centre);
            let note = format!(
                "no file says the camera: taken for the data set's by `{name}` in the folder's name, ({fx}, {fy}, {cx}, {cy})"
            );
            Ok((*camera, Some(note)))
        }
        None => {
            let usual = ". The data set's tools use (525, 525, 319.5, 239.5)";
            asked.camera(store, layout, usual).map(|camera| (camera, None))
        }
    }
}

/// Times and names of the images of a list that are there, by time. Returns how many are not.
fn listed(store: &Store, list: &str, asked: &Asked<'_, '_>) -> Result<(Vec<(f64, String)>, usize)> {
    let (mut found, mut gone) = (Vec::new(), 0);
    for (number, line) in lines_of(&store.text(list, asked.progress)?).enumerate() {
        let fail = |problem: String| Error::format(&store.path_of(list), format!("line {}", number + 1), problem);
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let entry =
            line.split_once([' ', '\t']).and_then(|(time, name)| Some((time.parse::<f64>().ok()?, name.trim())));
        let Some((time, name)) = entry.filter(|(time, _)| time.is_finite()) else {
            return Err(fail("expected a time and the name of an image".to_owned()));
        };
        let name = store.inside(name, asked.options).map_err(fail)?;
        if store.has(&name) {
            found.push((time, String::from(name)));
        } else {
            gone += 1;
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok((found, gone))
}

/// The image nearest in time, if it is near.
fn nearest(images: &[(f64, String)], time: f64) -> Option<&str> {
    let after = images.partition_point(|image| image.0 < time);
    let near = [after.wrapping_sub(1), after].into_iter().filter_map(|i| images.get(i));
    let nearest = near.min_by(|a, b| (a.0 - time).abs().total_cmp(&(b.0 - time).abs()))?;
    ((nearest.0 - time).abs() <= APART).then_some(nearest.1.as_str())
}
