//! Record3D: `.r3d` archives, also unpacked (`metadata`, `rgbd/0.jpg`, `.depth`, `.conf`, the last two in LZFSE), and
//! the export as EXR and JPEG (`metadata.json`, `depth/0.exr`, `rgb/0.jpg`). The number of a file is its place in the
//! list of poses.

use serde_json::Value;

use super::asked::{Asked, counted};
use super::decode::Coding;
use super::recording::{Entry, Recording, flat, in_order, json, pose_of, stem};
use super::store::{Place, Store};
use base::error::{Error, Result};
use image::frame::{Camera, TURNED};

/// Places of a recording's files.
struct Form {
    metadata: &'static str,
    depth: &'static str,
    depth_ending: &'static str,
    colour: &'static str,
}

const FORMS: [Form; 3] = [
    Form { metadata: "metadata", depth: "rgbd", depth_ending: ".depth", colour: "rgbd" },
    Form { metadata: "metadata.json", depth: "depth", depth_ending: ".exr", colour: "rgb" },
    Form { metadata: "EXR_RGBD/metadata.json", depth: "EXR_RGBD/depth", depth_ending: ".exr", colour: "EXR_RGBD/rgb" },
];

/// Columns and rows of depth where the metadata says none: those of the LiDAR, upright.
const LIDAR: [usize; 2] = [192, 256];

fn form(store: &Store) -> Option<&'static Form> {
    FORMS.iter().find(|form| store.has(form.metadata) && store.has(form.depth))
}

pub(super) fn recognize(store: &Store) -> bool {
    form(store).is_some()
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let Some(form) = form(&store) else { return Ok(Recording::of_phone(store, layout)) };
    let metadata = json(&store, form.metadata, asked.progress)?;
    let fail = |at: &str, problem: String| Error::format(&store.path_of(form.metadata), at, problem);
    let camera = camera(&metadata).map_err(|problem| fail("K", problem))?;
    let poses = metadata.get("poses").and_then(Value::as_array).filter(|poses| !poses.is_empty());
    let Some(poses) = poses else {
        let problem =
            "there are no poses: only recordings with the LiDAR have them. Open the depth images with a camera.";
        return Err(fail("poses", problem.to_owned()));
    };
    let each = metadata.get("perFrameIntrinsicCoeffs").and_then(Value::as_array);
    let names = store.list(form.depth, asked.progress)?;
    let colours = if form.colour == form.depth { names.clone() } else { store.list(form.colour, asked.progress)? };
    let depths = in_order(names.iter().filter(|name| name.ends_with(form.depth_ending)).cloned());
    let mut entries = Vec::new();
    for name in &depths {
        let Some(number) = stem(name).parse::<usize>().ok() else { continue };
        let Some(numbers) = poses.get(number).and_then(flat) else { continue };
        let &[x, y, z, w, a, b, c] = numbers.as_slice() else {
            return Err(fail(&format!("pose {number}"), "expected qx qy qz qw tx ty tz".to_owned()));
        };
        let pose = pose_of([x, y, z, w], [a, b, c]).map_err(|problem| fail(&format!("pose {number}"), problem))?;
        let own = each.and_then(|each| each.get(number)).and_then(flat);
        let camera = match own.as_deref() {
            Some(&[fx, fy, cx, cy]) => Camera { focal: [fx, fy], centre: [cx, cy], ..camera },
            None if each.is_none() => camera,
            _ => return Err(fail(&format!("camera {number}"), "expected fx fy cx cy".to_owned())),
        };
        camera.validate().map_err(|error| fail(&format!("camera {number}"), error.to_string()))?;
        let place = |folder: &str, ending: &str, among: &std::collections::BTreeSet<String>| {
            let name = format!("{number}.{ending}");
            among.contains(&name).then(|| Place::Named(format!("{folder}/{name}").into()))
        };
        entries.push(Entry {
            name: format!("{number:06}").into(),
            depth: Place::Named(format!("{}/{name}", form.depth).into()),
            colour: place(form.colour, "jpg", &colours),
            confidence: place(form.depth, "conf", &names),
            depth_camera: camera,
            colour_camera: camera,
            world_from_sensor: pose * TURNED,
        });
    }
    let lost = counted(depths.len() - entries.len(), depths.len(), "have no pose and are passed over");
    let size = depth_size(&metadata);
    let mut recording = Recording::of_phone(store, layout);
    recording.depth.unit = 1.0;
    if form.depth_ending == ".depth" {
        recording.depth.coding = Coding::LzfseFloats(size);
        recording.confidence.coding = Coding::LzfseBytes(size);
    }
    recording.notes.extend(lost);
    Ok(Recording { entries, ..recording })
}

fn size_of(metadata: &Value, keys: [&str; 2]) -> Option<[usize; 2]> {
    let number = |key: &str| metadata.get(key)?.as_u64().filter(|n| (1..1 << 30).contains(n));
    Some([number(keys[0])? as usize, number(keys[1])? as usize])
}

fn depth_size(metadata: &Value) -> [usize; 2] {
    size_of(metadata, ["dw", "dh"]).unwrap_or(LIDAR)
}

/// The camera of the first frame. The matrix is written column by column.
fn camera(metadata: &Value) -> Result<Camera, String> {
    let matrix = metadata.get("K").and_then(flat).unwrap_or_default();
    let &[fx, _, _, _, fy, _, cx, cy, _] = matrix.as_slice() else {
        return Err("the camera is missing: expected nine numbers".to_owned());
    };
    let size = size_of(metadata, ["w", "h"]).ok_or("w and h, the size of the colour images, are missing")?;
    let camera = Camera::sized([fx, fy], [cx, cy], size);
    camera.validate().map_err(|error| error.to_string())?;
    Ok(camera)
}
