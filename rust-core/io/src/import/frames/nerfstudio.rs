//! `transforms.json` of nerfstudio and instant-ngp: cameras to world with y up, looking along -z. Intrinsics are for all frames or for
//! each. Depth images, also as arrays of NumPy, are where `depth_file_path` or `depth_path` names them. Their unit is
//! `depth_unit_scale_factor` or `integer_depth_scale` (0.001).
//!
//! Pixel centres lie at halves there. Lenses that distort are refused by name: the images must be undistorted first. Of photos alone the
//! distortion is undone.

use serde_json::Value;

use super::asked::Asked;
use super::lens::Lens;
use super::recording::{Convention, Entry, Lone, Recording, flat, json, number, pose, stem, text};
use super::store::{Place, Store};
use crate::import::trajectory;
use base::error::{Error, Result};
use image::frame::{Camera, TURNED};

const NAME: &str = "transforms.json";

/// Keys of a frame's depth image, and of what its numbers are multiplied with: nerfstudio's, then instant-ngp's.
const DEPTHS: [&str; 2] = ["depth_file_path", "depth_path"];
const UNITS: [&str; 2] = ["depth_unit_scale_factor", "integer_depth_scale"];

pub(super) fn recognize(store: &Store) -> bool {
    store.has(NAME)
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    listed(store, NAME, layout, asked)
}

/// Lists the frames of a file of any name.
pub(super) fn listed(store: Store, name: &str, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let file = json(&store, name, asked.progress)?;
    let path = store.path_of(name);
    let frames = file.get("frames").and_then(Value::as_array);
    let frames = frames.ok_or_else(|| Error::format(&path, "whole file", "the list `frames` is missing"))?;
    let (mut entries, mut photos, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    let (mut without, mut lost) = (0, 0);
    for (k, frame) in frames.iter().enumerate() {
        asked.progress.check()?;
        let fail = |problem: String| Error::format(&path, format!("frame {k}"), problem);
        let named = |key: &str| -> Result<Option<Place>> {
            let Some(given) = text(frame, key).map_err(fail)? else { return Ok(None) };
            let inside = store.inside(given, asked.options).map_err(fail)?;
            Ok(Some(Place::Named(inside)))
        };
        let depth = match named(DEPTHS[0])? {
            None => named(DEPTHS[1])?,
            depth => depth,
        };
        without += usize::from(depth.is_none());
        if depth.is_none() && !asked.photos {
            continue;
        }
        let rows = frame.get("transform_matrix").and_then(flat).and_then(|all| trajectory::matrix(&all));
        let rows = rows.ok_or_else(|| fail("`transform_matrix` must be a 4 x 4 matrix".to_owned()))?;
        let Some(pose) = pose(&rows).map_err(fail)? else {
            lost += 1;
            continue;
        };
        let given = named("file_path")?;
        let colour = given.as_ref().and_then(|place| there(&store, place));
        if let (Some(Place::Named(name)), None) = (given, &colour) {
            missing.push(name.into());
        }
        let (camera, lens) = camera(frame, &file).map_err(fail)?;
        if let Some(lens) = lens.filter(|_| !asked.photos) {
            return Err(fail(format!(
                "the lens distorts ({}), which is not undone: undistort the images first",
                lens.shown()
            )));
        }
        let world_from_camera = pose * TURNED;
        // Depths of a lens that distorts are no depths of the photo without distortion.
        let Some(depth) = depth.filter(|_| lens.is_none()) else {
            photos.extend(colour.map(|place| Lone { place, camera, lens, world_from_camera }));
            continue;
        };
        let Place::Named(depth_name) = &depth else { continue };
        entries.push(Entry {
            name: frame.get("file_path").and_then(Value::as_str).map_or(stem(depth_name), stem).into(),
            depth,
            colour,
            confidence: None,
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor: world_from_camera,
        });
    }
    if without == frames.len() && !asked.photos {
        let problem = format!(
            "none of its {} frames has a `depth_file_path` or a `depth_path`. Colour images alone give no surface: export it with depth.",
            frames.len()
        );
        return Err(Error::format(&path, "frames", problem));
    }
    let mut recording = Recording::new(store, layout);
    recording.depth.unit = unit(&file).map_err(|problem| Error::format(&path, "unit of depths", problem))?;
    recording.depth.unit_of_floats = recording.depth.unit;
    recording.convention = Convention::BACKWARD;
    if !asked.photos {
        recording.notes.extend(super::asked::counted(without, frames.len(), "have no depth and are passed over"));
    }
    recording.notes.extend(super::asked::counted(lost, frames.len(), "have no pose and are passed over"));
    Ok(Recording { entries, photos, missing, ..recording })
}

/// The file of an image, which some name without its ending.
fn there(store: &Store, place: &Place) -> Option<Place> {
    let Place::Named(name) = place else { return None };
    let names = ["", ".png", ".jpg", ".jpeg"].map(|ending| format!("{name}{ending}"));
    names.into_iter().find(|name| store.has(name)).map(|name| Place::Named(name.into()))
}

/// Metres of a number of the depth images.
fn unit(file: &Value) -> Result<f64, String> {
    let unit = number(file, UNITS[0])?.or(number(file, UNITS[1])?).unwrap_or(1e-3);
    if unit > 0.0 { Ok(unit) } else { Err(format!("depths are multiplied by {unit}, which must be > 0")) }
}

/// The camera of a frame and its lens: what it says itself, else what the file says for all.
fn camera(frame: &Value, file: &Value) -> Result<(Camera, Option<Lens>), String> {
    let number = |key: &str| Ok::<_, String>(number(frame, key)?.or(number(file, key)?));
    let model = text(frame, "camera_model")?.or(text(file, "camera_model")?).unwrap_or("OPENCV");
    if !matches!(model, "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "PERSPECTIVE") {
        return Err(format!("the camera model {model} is no pinhole camera: undistort the images first"));
    }
    let of = |key: &str| number(key).map(Option::unwrap_or_default);
    let radial = [of("k1")?, of("k2")?, of("k3")?, of("k4")?];
    let lens = Lens { radial, tangential: [of("p1")?, of("p2")?] };
    let need = |key: &str| number(key)?.ok_or_else(|| format!("`{key}` is missing, for the frame and for all frames"));
    let (width, height) = (need("w")?, need("h")?);
    if !((1.0..1e9).contains(&width) && (1.0..1e9).contains(&height)) {
        return Err(format!("an image of {width} x {height} pixels can't be"));
    }
    let fx = match number("fl_x")? {
        Some(fx) => fx,
        None => width / 2.0 / (need("camera_angle_x")? / 2.0).tan(),
    };
    let fy = match (number("fl_y")?, number("camera_angle_y")?) {
        (Some(fy), _) => fy,
        (None, Some(angle)) => height / 2.0 / (angle / 2.0).tan(),
        (None, None) => fx,
    };
    let centre = [number("cx")?.unwrap_or(width / 2.0) - 0.5, number("cy")?.unwrap_or(height / 2.0) - 0.5];
    let camera = Camera::sized([fx, fy], centre, [width as usize, height as usize]);
    camera.validate().map_err(|error| error.to_string())?;
    Ok((camera, lens.if_any()))
}
