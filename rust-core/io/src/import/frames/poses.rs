//! Poses in text, as folders of frames have them: a matrix a file, or a pose per line.

use glam::DAffine3;

use super::asked::Asked;
use super::recording::{pose, pose_of};
use super::store::Store;
use crate::import::text::{Lines, lines_of};
use crate::import::trajectory::{self, Trajectory};
use base::error::{Error, Result};

/// The pose of a file that holds a 4 x 4 matrix. `None` if the recorder lost track.
pub(super) fn of_file(store: &Store, name: &str, asked: &Asked<'_, '_>) -> Result<Option<DAffine3>> {
    let text = store.text(name, asked.progress)?;
    let fail = |problem: &str| Error::format(&store.path_of(name), "whole file", problem);
    let numbers: Option<Vec<f64>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
    let rows =
        numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| fail("a pose must be a 4 x 4 matrix"))?;
    pose(&rows).map_err(|problem| fail(&problem))
}

/// The poses of a list in their order. With the list, where its form leaves no doubt of what they mean.
pub(super) fn listed(
    store: &Store,
    name: &str,
    asked: &Asked<'_, '_>,
) -> Result<(Vec<Option<DAffine3>>, Option<Trajectory>)> {
    let text = store.text(name, asked.progress)?;
    let has_own_form = lines_of(&text)
        .map(str::trim)
        .find(|line| !line.is_empty() && !line.starts_with('#'))
        .is_some_and(|line| matches!(line.split_ascii_whitespace().count(), 3 | 8));
    if has_own_form && trajectory::sniff(text.as_bytes()) {
        let path = store.path_of(name);
        let found = trajectory::parse(Lines::new(text.as_bytes(), text.len() as u64, &path))?;
        return Ok((found.poses().iter().map(|pose| Some(*pose)).collect(), Some(found)));
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
    if poses.is_empty() {
        let problem =
            "the list has no pose: fill it, or take it out of the folder, so that the frames open without poses";
        return Err(Error::format(&store.path_of(name), "whole file", problem));
    }
    Ok((poses, None))
}

/// The error of poses that frames also open without.
pub(super) fn or_without(error: Error) -> Error {
    match error {
        Error::Format { path, at, problem } if !problem.contains("take it out of the folder") => {
            let remedy = "Mend it, or take the poses out of the folder. Then the frames open without poses.";
            Error::format(&path, at, format!("{}. {remedy}", problem.trim_end_matches('.')))
        }
        other => other,
    }
}

/// The pose of a line: seven numbers, or the rows of a matrix with or without the last.
fn one_line(numbers: &[f64]) -> Result<Option<DAffine3>, String> {
    match *numbers {
        [x, y, z, qx, qy, qz, qw] => pose_of([qx, qy, qz, qw], [x, y, z]).map(Some),
        _ => match trajectory::matrix(numbers) {
            Some(rows) => pose(&rows),
            None => Err("expected tx ty tz qx qy qz qw, or 12 or 16 numbers of a matrix".to_owned()),
        },
    }
}

/// From the depth sensor to the colour camera, each placed in the device. Files without calibration have zeros.
pub(super) fn between(device_from_colour: &[f64; 16], device_from_depth: &[f64; 16]) -> DAffine3 {
    match (pose(device_from_colour), pose(device_from_depth)) {
        (Ok(Some(colour)), Ok(Some(depth))) => colour.inverse() * depth,
        _ => DAffine3::IDENTITY,
    }
}
