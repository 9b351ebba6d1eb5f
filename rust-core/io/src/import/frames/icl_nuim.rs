//! ICL-NUIM, rendered rooms with a camera whose y runs up: fy is negative, and keeps its sign.
//!
//! As its authors rendered it: `scene_00_0000.depth` (a text of distances along the rays), `.png`, `.txt` (the camera
//! of POV-Ray). In TUM's form: `depth/0.png` (5000 to the metre), `rgb/0.png`, and poses by number in a `.gt.freiburg`.

use glam::{DAffine3, DMat3, DVec3};

use super::asked::{Asked, counted};
use super::decode::Coding;
use super::recording::{Entry, Recording, in_order, stem};
use super::store::{Place, Store};
use crate::import::text::{Lines, lines_of};
use crate::import::trajectory;
use base::error::{Error, Result};
use image::frame::Camera;
use image::range_image::DepthKind;

const SIZE: [usize; 2] = [640, 480];
const CAMERA: Camera = Camera { focal: [481.2, -480.0], centre: [319.5, 239.5], size: Some(SIZE) };
const RENDERED: &str = ".depth";
const POSES: &str = ".gt.freiburg";

pub(super) fn recognize(store: &Store) -> bool {
    is_rendered(store) || (poses_of(store).is_some() && store.has("depth"))
}

fn is_rendered(store: &Store) -> bool {
    store.top().any(|name| name.starts_with("scene_") && name.ends_with(RENDERED))
}

fn poses_of(store: &Store) -> Option<&str> {
    store.top().find(|name| name.ends_with(POSES))
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    if is_rendered(&store) { rendered(store, layout, asked) } else { in_form_of_tum(store, layout, asked) }
}

fn rendered(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let depths: Vec<String> = store.top().filter(|name| name.ends_with(RENDERED)).map(str::to_owned).collect();
    let mut entries = Vec::new();
    for depth in &depths {
        asked.progress.check()?;
        let (pose, image) = (format!("{}.txt", stem(depth)), format!("{}.png", stem(depth)));
        if store.has(&pose) {
            let colour = store.has(&image).then(|| Place::Named(image.into()));
            entries.push(entry(depth, colour, pov_pose(&store, &pose, asked)?));
        }
    }
    let lost = counted(depths.len() - entries.len(), depths.len(), "have no pose and are passed over");
    let mut recording = Recording::new(store, layout);
    recording.depth.coding = Coding::Text(SIZE);
    recording.depth.unit = 1.0;
    recording.depth.kind = DepthKind::Ray;
    recording.notes.extend(lost);
    Ok(Recording { entries, ..recording })
}

fn in_form_of_tum(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let name = poses_of(&store).unwrap_or_default();
    let (text, path) = (store.text(name, asked.progress)?, store.path_of(name));
    let poses = trajectory::parse(Lines::new(text.as_bytes(), text.len() as u64, &path))?;
    let depths = in_order(store.list("depth", asked.progress)?);
    let colours = store.list("rgb", asked.progress)?;
    let mut entries = Vec::new();
    for depth in &depths {
        let number: Option<f64> = stem(depth).parse().ok();
        if let Some(pose) = number.and_then(|number| poses.at(number)) {
            let colour = colours.contains(depth).then(|| Place::Named(format!("rgb/{depth}").into()));
            entries.push(entry(&format!("depth/{depth}"), colour, pose));
        }
    }
    let lost = counted(depths.len() - entries.len(), depths.len(), "have no pose and are passed over");
    let mut recording = Recording::new(store, layout);
    recording.depth.unit = 1.0 / 5000.0;
    recording.notes.extend(lost);
    Ok(Recording { entries, ..recording })
}

fn entry(depth: &str, colour: Option<Place>, world_from_sensor: DAffine3) -> Entry {
    Entry {
        name: stem(depth).into(),
        depth: Place::Named(depth.into()),
        colour,
        confidence: None,
        depth_camera: CAMERA,
        colour_camera: CAMERA,
        world_from_sensor,
    }
}

/// The pose of POV-Ray's camera: its axes are right, up and the direction of view.
fn pov_pose(store: &Store, name: &str, asked: &Asked<'_, '_>) -> Result<DAffine3> {
    let text = store.text(name, asked.progress)?;
    let vector = |wanted: &str| {
        let line = lines_of(&text).find(|line| line.trim_start().starts_with(wanted));
        let numbers = line.and_then(|line| line.split_once('[')?.1.split_once(']')).map(|(numbers, _)| numbers);
        let parsed: Option<Vec<f64>> =
            numbers.and_then(|n| n.split(',').map(|word| word.trim().parse().ok()).collect());
        match parsed.as_deref() {
            Some(&[x, y, z]) if [x, y, z].iter().all(|x| x.is_finite()) => Ok(DVec3::new(x, y, z)),
            _ => Err(Error::format(&store.path_of(name), wanted, "expected three numbers in brackets")),
        }
    };
    let (place, ahead, up) = (vector("cam_pos")?, vector("cam_dir")?, vector("cam_up")?);
    let z = ahead.normalize_or_zero();
    let x = up.cross(z).normalize_or_zero();
    if x == DVec3::ZERO {
        return Err(Error::format(&store.path_of(name), "cam_up", "it runs along cam_dir, or one of them is zero"));
    }
    Ok(DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: place })
}
