//! ScanNet's frames in folders, as its own tool and many since write them: `depth/N.png` (millimetres), `color/N.jpg`,
//! `pose/N.txt` (camera to world, minus infinity where it was lost), `intrinsic/intrinsic_depth.txt` and `_color.txt`,
//! `extrinsic_depth.txt` and `_color.txt` beside them. Some write the intrinsics to the top.

use super::asked::{Asked, counted};
use super::folders::{COLOURS, DEPTHS, images, pairs};
use super::recording::{Entry, Recording, stem};
use super::store::{Place, Store};
use super::{decode, poses};
use base::error::Result;
use image::frame::Camera;

/// Folders with a pose per frame.
const POSES: [&str; 3] = ["pose", "poses", "camera_poses"];

/// Folders of the cameras. The top is the last.
const CAMERAS: [&str; 3] = ["intrinsic", "intrinsics", ""];

/// Columns and rows of the data set's images, which its cameras are given for even where images were made smaller.
const DEPTH: [usize; 2] = [640, 480];
const COLOUR: [usize; 2] = [1296, 968];

/// Least and largest place of the centre of an image, as a share of its size.
const MIDDLE: std::ops::Range<f64> = 0.35..0.65;

fn poses_of(store: &Store) -> Option<&'static str> {
    POSES.into_iter().find(|folder| store.has(folder))
}

pub(super) fn recognize(store: &Store) -> bool {
    store.has(DEPTHS) && poses_of(store).is_some()
}

pub(super) fn list(store: Store, layout: &'static str, asked: &Asked<'_, '_>) -> Result<Recording> {
    let depths = images(&store, DEPTHS, asked)?;
    let folder = COLOURS.into_iter().find(|folder| store.has(folder)).unwrap_or(COLOURS[0]);
    let colours = images(&store, folder, asked)?;
    let poses_in = poses_of(&store).unwrap_or(POSES[0]);
    let names = store.list(poses_in, asked.progress)?;
    let files = super::recording::in_order(names.into_iter().filter(|name| name.ends_with(".txt")));
    let Cameras { depth, colour, colour_from_depth } = Cameras::of(&store, asked)?;
    let depth = match depth {
        Some(depth) => sized(depth, DEPTH, &store, DEPTHS, &depths, asked)?,
        None => asked.camera(&store, layout, " or intrinsic/intrinsic_depth.txt, the 4 x 4 matrix")?,
    };
    let colour = match colour {
        Some(colour) => sized(colour, COLOUR, &store, folder, &colours, asked)?,
        None => depth,
    };
    let (mut entries, mut lost) = (Vec::new(), 0);
    let (of_poses, of_colours) = (pairs(&depths, &files), pairs(&depths, &colours));
    for ((name, pose), photo) in depths.iter().zip(of_poses).zip(of_colours) {
        asked.progress.check()?;
        let pose = match pose {
            Some(k) => poses::of_file(&store, &format!("{poses_in}/{}", files[k]), asked)?,
            None => None,
        };
        let Some(world_from_sensor) = pose else {
            lost += 1;
            continue;
        };
        entries.push(Entry {
            name: stem(name).into(),
            depth: Place::Named(format!("{DEPTHS}/{name}").into()),
            colour: photo.map(|k| Place::Named(format!("{folder}/{}", colours[k]).into())),
            confidence: None,
            depth_camera: depth,
            colour_camera: colour,
            world_from_sensor,
        });
    }
    let notes = counted(lost, depths.len(), "have no pose and are passed over").into_iter().collect();
    Ok(Recording { entries, notes, colour_from_depth, ..Recording::new(store, layout) })
}

/// Values that the files give of the cameras.
struct Cameras {
    depth: Option<Camera>,
    colour: Option<Camera>,
    colour_from_depth: glam::DAffine3,
}

impl Cameras {
    fn of(store: &Store, asked: &Asked<'_, '_>) -> Result<Cameras> {
        let is_of_colour = |name: &str| ["color", "colour", "rgb"].iter().any(|word| name.contains(word));
        let mut cameras = Cameras { depth: None, colour: None, colour_from_depth: glam::DAffine3::IDENTITY };
        let mut placed = [[0.0; 16]; 2];
        for folder in CAMERAS {
            let mut either = None;
            for name in store.list(folder, asked.progress)? {
                let at = if folder.is_empty() { name.clone() } else { format!("{folder}/{name}") };
                let name = name.to_ascii_lowercase();
                if name.starts_with("extrinsic") && name.ends_with(".txt") {
                    let text = store.text(&at, asked.progress)?;
                    let numbers: Option<Vec<f64>> =
                        text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
                    let rows = numbers.and_then(|numbers| numbers.try_into().ok());
                    placed[usize::from(is_of_colour(&name))] = rows.unwrap_or([0.0; 16]);
                }
                let is_one = (name.ends_with(".txt") || name.ends_with(".json")) && name.contains("intrinsic");
                if !is_one || asked.options.camera.is_some() {
                    continue;
                }
                let text = store.text(&at, asked.progress)?;
                let camera = crate::import::camera::parse(text.as_bytes(), &store.path_of(&at))?;
                let kind = match (name.contains("depth"), is_of_colour(&name)) {
                    (true, _) => &mut cameras.depth,
                    (false, true) => &mut cameras.colour,
                    (false, false) => &mut either,
                };
                kind.get_or_insert(camera);
            }
            cameras.depth = cameras.depth.or(either);
        }
        if cameras.depth.is_none() {
            cameras.depth = asked.camera_of(store)?.filter(|_| cameras.colour.is_none());
        }
        cameras.colour_from_depth = poses::between(&placed[1], &placed[0]);
        Ok(cameras)
    }
}

/// The camera with the size of the first of its images, or of the data set's where the camera's centre is in the middle of that alone.
fn sized(
    camera: Camera,
    usual: [usize; 2],
    store: &Store,
    folder: &str,
    names: &[String],
    asked: &Asked<'_, '_>,
) -> Result<Camera> {
    let is_readable =
        |name: &&String| [".png", ".jpg", ".jpeg"].iter().any(|ending| name.to_ascii_lowercase().ends_with(ending));
    let (None, Some(name)) = (camera.size, names.iter().find(is_readable)) else { return Ok(camera) };
    let name = format!("{folder}/{name}");
    let bytes = store.bytes(&Place::Named(name.as_str().into()), asked.options.max_decoded_bytes(), asked.progress)?;
    // A damaged one is passed over later.
    let Ok(size) = decode::size(&bytes, &store.path_of(&name)) else { return Ok(camera) };
    let is_in_middle =
        |size: [usize; 2]| (0..2).all(|axis| MIDDLE.contains(&(camera.centre[axis] / size[axis] as f64)));
    let size = if !is_in_middle(size) && is_in_middle(usual) { usual } else { size };
    Ok(Camera { size: Some(size), ..camera })
}
