//! Folders of depth and colour images, as Open3D's, Redwood's and RealSense's: `depth/`, `color/` (or `rgb/`, `image/`), a camera's file,
//! and poses camera to world. Poses are in a `.log`, a TUM list or a text of `tx ty tz qx qy qz qw` or 4 x 4 numbers per line. Without a
//! list of poses frames have none. Millimetres.

use std::collections::{BTreeMap, BTreeSet};

use glam::DAffine3;

use super::asked::{Asked, counted};
use super::poses;
use super::recording::{Convention, Entry, Recording, in_order, stem};
use super::store::{Place, Store};
use crate::import::numbering::{keys_of, order_of};
use crate::import::placing_by_numbers::{Places, Placing};
use crate::import::trajectory::Trajectory;
use base::error::{Error, Result};

pub(super) const DEPTHS: &str = "depth";
pub(super) const COLOURS: [&str; 6] = ["color", "rgb", "colour", "image", "images", "color_images"];
const POSES: [&str; 6] = ["trajectory.log", "pose.txt", "poses.txt", "traj.txt", "traj_w_c.txt", "trajectory.txt"];

pub(super) fn recognize(store: &Store) -> bool {
    let is_camera = |name: &str| name.ends_with(".json") && name.contains("cam");
    store.has(DEPTHS)
        && (poses_of(store).is_some()
            || COLOURS.into_iter().any(|folder| store.has(folder))
            || store.top().any(is_camera))
}

/// The file of poses: one of the usual names, else the only trajectory.
fn poses_of(store: &Store) -> Option<&str> {
    let usual = POSES.into_iter().find(|name| store.has(name));
    let is_list = |name: &&str| name.ends_with(".log") || name.ends_with(".freiburg");
    let mut others = store.top().filter(is_list);
    usual.or_else(|| others.next().filter(|_| others.next().is_none()))
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let usual = ". Open3D's and Redwood's usual one is (525, 525, 319.5, 239.5)";
    let camera = match asked.camera_of(&store)? {
        Some(camera) => camera,
        None => asked.camera(&store, layout, usual)?,
    };
    let depths = images(&store, DEPTHS, asked)?;
    let (poses, told) = match poses_of(&store) {
        Some(list) => poses::listed(&store, list, asked).map_err(poses::or_without)?,
        None => (vec![Some(DAffine3::IDENTITY); depths.len()], None),
    };
    let is_sure = told.is_some() || poses_of(&store).is_none();
    let folder = COLOURS.into_iter().find(|folder| store.has(folder));
    let colours = folder.map_or(Ok(Vec::new()), |folder| images(&store, folder, asked))?;
    let pairs = pairs(&depths, &colours);
    let places = match poses_of(&store) {
        Some(list) => places(&depths, poses.len(), told.as_ref())
            .map_err(|problem| poses::or_without(Error::format(&store.path_of(list), "whole file", problem)))?,
        None => Some((0..depths.len()).map(Some).collect()),
    };
    let Some(places) = places else {
        let problem = format!(
            "there are {} poses and {} images in depth, and the names of the images do not number them: give each frame both",
            poses.len(),
            depths.len()
        );
        return Err(Error::format(&store.path, "poses", problem));
    };
    let places_taken = places.iter().flatten().count();
    let mut entries = Vec::with_capacity(depths.len());
    for ((name, place), pair) in depths.iter().zip(places).zip(pairs) {
        let Some(world_from_sensor) = place.and_then(|place| poses[place]) else { continue };
        entries.push(Entry {
            name: stem(name).into(),
            depth: Place::Named(format!("{DEPTHS}/{name}").into()),
            colour: pair.map(|k| Place::Named(format!("{}/{}", folder.unwrap_or_default(), colours[k]).into())),
            confidence: None,
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor,
        });
    }
    let lost = depths.len() - entries.len();
    let mut notes: Vec<String> = counted(lost, depths.len(), "have no pose and are passed over").into_iter().collect();
    let unused = poses.len() - places_taken;
    notes.extend(counted(unused, poses.len(), "have no depth image and are skipped"));
    let convention = Convention { is_sure, ..Convention::FORWARD };
    let listed = poses_of(&store).is_some();
    let no_poses = (!listed).then(|| format!("no list of poses lies beside the images ({})", POSES.join(", ")));
    Ok(Recording { entries, notes, convention, no_poses, ..Recording::new(store, layout) })
}

/// The pose of each image, by its place in their list. Times and numbers of the list decide, if names have them, too. Else images that are
/// as many follow each other as the poses do. Of fewer the numbers at the front of their names decide, if these count from 0, or if the
/// first and the last pose have an image. `None` where none of them does.
///
/// # Errors
/// Names whose numbers may give an image another one's pose.
fn places(depths: &[String], poses: usize, told: Option<&Trajectory>) -> Result<Option<Places>, String> {
    let names: Vec<&str> = depths.iter().map(|name| stem(name)).collect();
    let keys = match keys_of(&names) {
        Err(_) if names.len() == 1 && poses == 1 => Vec::new(),
        keys => keys?,
    };
    if let Some(Placing::Times(places) | Placing::Numbers(places)) =
        told.map(|told| told.placing(&keys, &names)).transpose()?
    {
        return Ok(Some(places));
    }
    if depths.len() != poses {
        return Ok(in_front(depths, poses).map(|places| places.into_iter().map(Some).collect()));
    }
    let mut places = vec![None; poses];
    for (place, image) in order_of(&keys, &names)?.into_iter().enumerate() {
        places[image] = Some(place);
    }
    Ok(Some(places))
}

/// The pose of each image by the number at the front of its name.
fn in_front(depths: &[String], poses: usize) -> Option<Vec<usize>> {
    let numbers: Vec<usize> = depths.iter().map(|name| KEYS[2](stem(name)).parse().ok()).collect::<Option<_>>()?;
    let (first, last) = (*numbers.first()?, *numbers.last()?);
    let is_decided = first == 0 || last.checked_sub(first)? + 1 == poses;
    let are_in_order = numbers.is_sorted_by(|a, b| a < b) && last - first < poses;
    (is_decided && are_in_order).then(|| numbers.iter().map(|number| number - first).collect())
}

/// Parts of an image's name that may say which frame it is of.
const KEYS: [fn(&str) -> &str; 4] = [
    |stem| stem,
    // frame-000001.depth and frame-000001.color.
    |stem| stem.split('.').next().unwrap_or(stem),
    // Redwood puts a time behind the number, which differs between depth and colour.
    |stem| &stem[..stem.find(|c: char| !c.is_ascii_digit()).unwrap_or(stem.len())],
    |stem| {
        let end = stem.rfind(|c: char| c.is_ascii_digit()).map_or(0, |last| last + 1);
        let start = stem[..end].rfind(|c: char| !c.is_ascii_digit()).map_or(0, |before| before + 1);
        stem[..end].get(start..).unwrap_or("")
    },
];

/// The colour image, or the file of the pose, of each depth image. It is found by the first key that finds one for all of the fewer, else
/// by their places if they are as many, else by the key that finds most.
pub(super) fn pairs(depths: &[String], colours: &[String]) -> Vec<Option<usize>> {
    let by = |key: fn(&str) -> &str| {
        let keys = |names: &[String]| names.iter().map(|name| key(stem(name)).to_owned()).collect::<Vec<_>>();
        let (of_depths, of_colours) = (keys(depths), keys(colours));
        let index_of: BTreeMap<&String, usize> = of_colours.iter().zip(0..).collect();
        let are_unique =
            index_of.len() == colours.len() && of_depths.iter().collect::<BTreeSet<_>>().len() == depths.len();
        of_depths.iter().map(|key| index_of.get(key).copied().filter(|_| are_unique)).collect()
    };
    let found = |pairs: &Vec<Option<usize>>| pairs.iter().flatten().count();
    let tried = KEYS.map(by);
    let fewer = depths.len().min(colours.len());
    match tried.iter().find(|pairs| found(pairs) == fewer) {
        Some(all) => all.clone(),
        None if depths.len() == colours.len() => (0..depths.len()).map(Some).collect(),
        None => tried.into_iter().rev().max_by_key(found).unwrap_or_default(),
    }
}

/// Images of a folder, in their order.
pub(super) fn images(store: &Store, folder: &str, asked: &Asked<'_, '_>) -> Result<Vec<String>> {
    const ENDINGS: [&str; 9] = ["png", "jpg", "jpeg", "tif", "tiff", "exr", "pgm", "pfm", "npy"];
    let is_image = |name: &String| {
        let ending = name.rsplit_once('.').map_or("", |(_, ending)| ending);
        ENDINGS.iter().any(|known| ending.eq_ignore_ascii_case(known))
    };
    Ok(in_order(store.list(folder, asked.progress)?.into_iter().filter(is_image)))
}
