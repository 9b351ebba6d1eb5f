//! RTAB-Map's export: `NAME_depth/` (millimetres), `NAME_rgb/`, `NAME_confidence/`, `NAME_calib/` with a YAML file of OpenCV's a frame,
//! and the poses of the camera in `NAME_camera_poses.txt` or of the robot in `NAME_poses.txt`. Extracted by its database viewer the
//! folders are `depth/`, `rgb/`, `calib/`. Images are named by their time or by their number in the map.
//!
//! The calibration's `local_transform` places the camera on the robot. Images are rectified: the lens is that of its
//! `projection_matrix`.

use glam::{DAffine3, DMat3, DVec3};

use super::asked::{Asked, counted};
use super::recording::{Entry, Recording, in_order, photo_of, stem};
use super::store::{Place, Store};
use crate::import::pose;
use crate::import::text::{Lines, lines_of};
use crate::import::trajectory::{self, Trajectory};
use base::error::{Error, Result};
use image::frame::Camera;

/// The camera of a robot that does not say where it is: looking ahead, along the robot's x.
const AHEAD: DAffine3 =
    DAffine3 { matrix3: DMat3::from_cols(DVec3::NEG_Y, DVec3::NEG_Z, DVec3::X), translation: DVec3::ZERO };

/// The files of an export.
struct Form {
    depth: String,
    colour: String,
    confidence: String,
    calibration: String,
    /// The list of poses, and whether these are the robot's.
    poses: Option<(String, bool)>,
}

fn form(store: &Store) -> Option<Form> {
    let base = store.top().find_map(|name| {
        let base = name.strip_suffix("_depth")?;
        let has = |ending: &str| store.has(&format!("{base}_{ending}"));
        (has("calib") || has("poses.txt") || has("camera_poses.txt")).then(|| format!("{base}_"))
    });
    let base = base.or_else(|| (store.has("depth") && store.has("calib")).then(String::new))?;
    let folder = |kind: &str| format!("{base}{kind}");
    let lists = [
        (folder("camera_poses.txt"), false),
        (folder("poses.txt"), true),
        ("camera_poses.txt".to_owned(), false),
        ("poses.txt".to_owned(), true),
    ];
    Some(Form {
        depth: folder("depth"),
        colour: folder("rgb"),
        confidence: folder("confidence"),
        calibration: folder("calib"),
        poses: lists.into_iter().find(|(name, _)| store.has(name)),
    })
}

pub(super) fn recognize(store: &Store) -> bool {
    form(store).is_some()
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let Some(form) = form(&store) else { return Ok(Recording::new(store, layout)) };
    let Some((name, is_robot)) = &form.poses else {
        let problem =
            "there is no list of the camera's poses: export it beside the images with rtabmap-export --poses_camera";
        return Err(Error::format(&store.path, "poses", problem));
    };
    let (text, path) = (store.text(name, asked.progress)?, store.path_of(name));
    let poses = trajectory::parse(Lines::new(text.as_bytes(), text.len() as u64, &path))?;
    let depths = in_order(store.list(&form.depth, asked.progress)?.into_iter().filter(|name| name.ends_with(".png")));
    let colours = store.list(&form.colour, asked.progress)?;
    let confidences = store.list(&form.confidence, asked.progress)?;
    let calibrations = store.list(&form.calibration, asked.progress)?;
    if let Some(name) = depths.iter().find(|name| calibrations.contains(&format!("{}_0.yaml", stem(name)))) {
        let problem = "this export is of several cameras, whose images lie side by side in one. That is not read: \
            export the images of each camera by itself.";
        return Err(Error::format(
            &store.path_of(&format!("{}/{}_0.yaml", form.calibration, stem(name))),
            "cameras",
            problem,
        ));
    }
    let of_frames = in_the_order_of(&depths, &poses, &path)?;
    let mut usual: Option<Calibration> = None;
    let (mut entries, mut lost) = (Vec::new(), 0);
    for (depth, pose) in depths.iter().zip(of_frames) {
        asked.progress.check()?;
        let Some(pose) = pose else {
            lost += 1;
            continue;
        };
        let own = format!("{}.yaml", stem(depth));
        let calibration = match (calibrations.contains(&own), &usual) {
            (true, _) => calibration(&store, &format!("{}/{own}", form.calibration), asked)?,
            (false, Some(usual)) => *usual,
            (false, None) => for_all(&store, &form, layout, asked)?,
        };
        usual = Some(calibration);
        let place = |folder: &str, name: String| Place::Named(format!("{folder}/{name}").into());
        let has_confidence = confidences.contains(depth);
        entries.push(Entry {
            name: stem(depth).into(),
            depth: place(&form.depth, depth.clone()),
            colour: photo_of(stem(depth), |name| colours.contains(name)).map(|name| place(&form.colour, name)),
            confidence: has_confidence.then(|| place(&form.confidence, depth.clone())),
            depth_camera: calibration.camera,
            colour_camera: calibration.camera,
            world_from_sensor: if *is_robot { pose * calibration.robot_from_camera } else { pose },
        });
    }
    let mut recording = Recording::new(store, layout);
    recording.notes.extend(counted(lost, depths.len(), "have no pose and are passed over"));
    if *is_robot {
        recording
            .notes
            .push(format!("{name} has the poses of the robot, and the calibration says where its camera is"));
    }
    Ok(Recording { entries, ..recording })
}

/// The pose of each image: by its number in the map, by its time, or where lines have neither by its place in the list.
fn in_the_order_of(depths: &[String], poses: &Trajectory, path: &std::path::Path) -> Result<Vec<Option<DAffine3>>> {
    let by_name = |name: &String| {
        let of_id = stem(name).parse::<i64>().ok().and_then(|id| poses.of_id(id));
        of_id.or_else(|| poses.at(stem(name).parse().ok()?))
    };
    let found: Vec<Option<DAffine3>> = depths.iter().map(by_name).collect();
    if found.iter().any(Option::is_some) {
        return Ok(found);
    }
    if poses.poses().len() != depths.len() {
        let problem = format!(
            "its {} lines name neither the time nor the number of any of the {} images: export poses with \
                --poses_format 11, which has both",
            poses.poses().len(),
            depths.len()
        );
        return Err(Error::format(path, "poses", problem));
    }
    Ok(poses.poses().iter().copied().map(Some).collect())
}

/// Values of a calibration.
#[derive(Clone, Copy)]
struct Calibration {
    camera: Camera,
    robot_from_camera: DAffine3,
}

/// The calibration of all frames: the only one of the folder, or one at the top. Else it is the caller's camera.
fn for_all(store: &Store, form: &Form, layout: &str, asked: &Asked<'_, '_>) -> Result<Calibration> {
    let is_yaml = |name: &&String| name.ends_with(".yaml");
    let listed = store.list(&form.calibration, asked.progress)?;
    let top: Vec<String> = store.top().map(str::to_owned).collect();
    let in_folder = listed.iter().find(is_yaml).map(|name| format!("{}/{name}", form.calibration));
    let at_top = || top.iter().filter(is_yaml).find(|name| name.contains("calib") || name.contains("camera")).cloned();
    if let Some(name) = in_folder.or_else(at_top) {
        return calibration(store, &name, asked);
    }
    let camera = match asked.camera_of(store)? {
        Some(camera) => camera,
        None => asked.camera(store, layout, ", or export the images with their calibration (--images)")?,
    };
    Ok(Calibration { camera, robot_from_camera: AHEAD })
}

/// Reads a calibration file.
fn calibration(store: &Store, name: &str, asked: &Asked<'_, '_>) -> Result<Calibration> {
    let text = store.text(name, asked.progress)?;
    let fail = |at: &str, problem: String| Error::format(&store.path_of(name), at, problem);
    let matrix = |key: &str| numbers(&text, key).map_err(|problem| fail(key, problem));
    let focal = match (matrix("projection_matrix")?.as_deref(), matrix("camera_matrix")?.as_deref()) {
        (Some(&[fx, _, cx, _, _, fy, cy, ..]), _) | (_, Some(&[fx, _, cx, _, fy, cy, ..])) => [fx, fy, cx, cy],
        _ => {
            let problem = "`projection_matrix` or `camera_matrix` must be there with its numbers";
            return Err(fail("whole file", problem.to_owned()));
        }
    };
    let side =
        |key: &str| value(&text, key).and_then(|side| side.parse::<usize>().ok()).filter(|n| (1..1 << 30).contains(n));
    let size = side("image_width").zip(side("image_height")).map(|(width, height)| [width, height]);
    let [fx, fy, cx, cy] = focal;
    let camera = Camera { focal: [fx, fy], centre: [cx, cy], size };
    camera.validate().map_err(|error| fail("camera", error.to_string()))?;
    let robot_from_camera = match matrix("local_transform")?.as_deref().and_then(trajectory::matrix) {
        Some(rows) => pose::from_rows(&rows).map_err(|problem| fail("local_transform", problem))?,
        None => AHEAD,
    };
    Ok(Calibration { camera, robot_from_camera })
}

/// The text behind a key at the start of a line.
fn value<'t>(text: &'t str, key: &str) -> Option<&'t str> {
    lines_of(text).find_map(|line| line.strip_prefix(key)?.strip_prefix(':')).map(str::trim)
}

/// The numbers of a matrix of OpenCV's: `key:`, then indented lines, one with `data: [ ... ]`, which may go on over lines.
fn numbers(text: &str, key: &str) -> Result<Option<Vec<f64>>, String> {
    let mut lines = lines_of(text).skip_while(|line| line.strip_prefix(key).is_none_or(|rest| !rest.starts_with(':')));
    if lines.next().is_none() {
        return Ok(None);
    }
    let inner: Vec<&str> = lines.take_while(|line| line.starts_with([' ', '\t'])).collect();
    let inner = inner.join(" ");
    let data = inner.split_once("data:").and_then(|(_, rest)| rest.split_once('[')?.1.split_once(']'));
    let Some((data, _)) = data else { return Err("expected `data: [ numbers ]` below it".to_owned()) };
    let words = data.split([',', ' ', '\t']).filter(|word| !word.is_empty());
    let all: Option<Vec<f64>> = words.map(|word| word.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    all.map(Some).ok_or_else(|| {
        format!("expected numbers between commas, found `{}`", data.trim().chars().take(60).collect::<String>())
    })
}
