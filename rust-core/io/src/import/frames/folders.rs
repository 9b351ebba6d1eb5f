//! Folders of depth and colour images with a trajectory, as Open3D's and Redwood's: `depth/`, `color/` (or `rgb/`,
//! `image/`), a camera's file, and poses camera to world in a `.log`, a TUM list or a text of `tx ty tz qx qy qz qw` or
//! 4 x 4 numbers a line. Millimetres.

use std::collections::BTreeMap;

use glam::DAffine3;

use super::recording::{Convention, Entry, Recording, in_order, pose, pose_of, stem};
use super::store::{Place, Store};
use super::{Asked, counted};
use crate::import::text::{Lines, lines_of};
use crate::import::trajectory;
use base::error::{Error, Result};

const DEPTHS: &str = "depth";
const COLOURS: [&str; 6] = ["color", "rgb", "colour", "image", "images", "color_images"];
const POSES: [&str; 3] = ["trajectory.log", "pose.txt", "poses.txt"];

pub(super) fn recognize(store: &Store) -> bool {
    store.has(DEPTHS) && (poses_of(store).is_some() || COLOURS.into_iter().any(|folder| store.has(folder)))
}

/// The file of poses: one of the usual names, else the only trajectory.
fn poses_of(store: &Store) -> Option<&str> {
    let usual = POSES.into_iter().find(|name| store.has(name));
    let is_list = |name: &&str| name.ends_with(".log") || name.ends_with(".freiburg");
    let mut others = store.top().filter(is_list);
    usual.or_else(|| others.next().filter(|_| others.next().is_none()))
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let Some(poses) = poses_of(&store) else {
        let problem = format!(
            "there are images of depth and colour, but no list of poses beside them ({}); open the folder depth with a camera \
             and align its images",
            POSES.join(", ")
        );
        return Err(Error::format(&store.path, "poses", problem));
    };
    let usual = "; Open3D's and Redwood's usual one is (525, 525, 319.5, 239.5)";
    let camera = match asked.camera_of(&store)? {
        Some(camera) => camera,
        None => asked.camera(&store, layout, usual)?,
    };
    let (poses, is_sure) = read_poses(&store, poses, asked)?;
    let depths = in_order(store.list(DEPTHS, asked.progress)?);
    let folder = COLOURS.into_iter().find(|folder| store.has(folder));
    let colours = Colours::of(&store, folder, asked)?;
    if poses.len() != depths.len() {
        let problem =
            format!("there are {} poses and {} images in depth: one a frame is needed", poses.len(), depths.len());
        return Err(Error::format(&store.path, "poses", problem));
    }
    let mut entries = Vec::with_capacity(depths.len());
    for (k, (name, pose)) in depths.iter().zip(poses).enumerate() {
        let Some(world_from_sensor) = pose else { continue };
        entries.push(Entry {
            name: stem(name).into(),
            depth: Place::Named(format!("{DEPTHS}/{name}").into()),
            colour: colours.beside(name, k, depths.len()),
            confidence: None,
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor,
        });
    }
    let lost = depths.len() - entries.len();
    let notes = counted(lost, depths.len(), "have no pose and are passed over").into_iter().collect();
    let convention = Convention { is_sure, ..Convention::FORWARD };
    Ok(Recording { entries, notes, convention, ..Recording::new(store, layout) })
}

/// Colour images by what their names begin with.
struct Colours {
    folder: &'static str,
    all: Vec<String>,
    by_stem: BTreeMap<String, usize>,
}

impl Colours {
    fn of(store: &Store, folder: Option<&'static str>, asked: &Asked<'_, '_>) -> Result<Colours> {
        let Some(folder) = folder else {
            return Ok(Colours { folder: "", all: Vec::new(), by_stem: BTreeMap::new() });
        };
        let all = in_order(store.list(folder, asked.progress)?);
        let by_stem = all.iter().enumerate().map(|(k, name)| (number_of(name).to_owned(), k)).collect();
        Ok(Colours { folder, all, by_stem })
    }

    /// That of a depth image: of the same number, else of the same place where there are as many.
    fn beside(&self, depth: &str, index: usize, count: usize) -> Option<Place> {
        let in_order = (self.all.len() == count).then_some(index);
        let index = self.by_stem.get(number_of(depth)).copied().or(in_order)?;
        Some(Place::Named(format!("{}/{}", self.folder, self.all[index]).into()))
    }
}

/// What says which frame an image is of: Redwood puts a time behind the number, which differs between depth and colour.
fn number_of(name: &str) -> &str {
    let stem = stem(name);
    stem.split_once('-').map_or(stem, |(number, _)| number)
}

/// The poses of a file in their order, and whether its form leaves no doubt of what they mean.
fn read_poses(store: &Store, name: &str, asked: &Asked<'_, '_>) -> Result<(Vec<Option<DAffine3>>, bool)> {
    let text = store.text(name, asked.progress)?;
    if trajectory::sniff(text.as_bytes()) {
        let path = store.path_of(name);
        let found = trajectory::parse(Lines::new(text.as_bytes(), text.len() as u64, &path))?;
        return Ok((found.poses().iter().map(|pose| Some(*pose)).collect(), true));
    }
    let mut poses = Vec::new();
    for (number, line) in lines_of(&text).enumerate() {
        let fail = |problem: &str| Error::format(&store.path_of(name), format!("line {}", number + 1), problem);
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let numbers: Vec<f64> = line
            .split_ascii_whitespace()
            .map(|word| word.parse().ok())
            .collect::<Option<_>>()
            .ok_or_else(|| fail("expected numbers"))?;
        poses.push(one_line(&numbers).map_err(|problem| fail(&problem))?);
    }
    Ok((poses, false))
}

/// The pose of a line: seven numbers, or the rows of a matrix with or without the last.
fn one_line(numbers: &[f64]) -> Result<Option<DAffine3>, String> {
    let mut rows = [0.0; 16];
    rows[15] = 1.0;
    match *numbers {
        [x, y, z, qx, qy, qz, qw] => pose_of([qx, qy, qz, qw], [x, y, z]).map(Some),
        _ if matches!(numbers.len(), 12 | 16) => {
            rows[..numbers.len()].copy_from_slice(numbers);
            pose(&rows)
        }
        _ => Err("expected tx ty tz qx qy qz qw, or 12 or 16 numbers of a matrix".to_owned()),
    }
}
