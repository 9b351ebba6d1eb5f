//! A recording: its frames, listed and not yet decoded. Layouts fill it. Here each frame is read as that says.

use std::hash::{Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use glam::{DAffine3, DVec3};
use rustc_hash::{FxHashMap, FxHasher};

use super::super::file::no_json;
use super::super::options::ReadOptions;
use super::super::raster::{Numbers, Raster};
use super::super::scan::Frames;
use super::super::trajectory::Trajectory;
use super::decode::{self, Coding, is_damage};
use super::lens::Lens;
use super::store::{Place, Store};
use base::error::{Error, Result};
use base::progress::Progress;
use image::frame::{Camera, ColourImage, ConfidenceImage, Frame};
use image::range_image::{DepthKind, RangeImage};

/// Two shapes of an image differ by no more than what rounding a side to whole pixels does.
const SAME_SHAPE: f64 = 1.25;

/// Poses with times, and the time of each frame.
#[derive(Debug)]
pub(super) struct Timed {
    pub(super) poses: Trajectory,
    pub(super) times: Vec<f64>,
}

/// Frames of one recording, in their order. Memory: some hundred bytes per frame.
#[derive(Debug)]
pub(super) struct Recording {
    pub(super) store: Store,
    /// The programs that write such recordings, for people.
    pub(super) layout: &'static str,
    pub(super) entries: Vec<Entry>,
    /// Photos with cameras and poses, but without depths. Only if photos were asked for.
    pub(super) photos: Vec<Lone>,
    /// Whether frames without depths leave their photos.
    pub(super) keeps_photos: bool,
    /// Names of photos that lists name but that are not there.
    pub(super) missing: Vec<String>,
    /// Whether the entries are in the order in which they were taken.
    pub(super) is_in_time: bool,
    pub(super) depth: DepthForm,
    pub(super) confidence: ConfidenceForm,
    /// Takes points of the depth sensor's frame into that of the colour camera.
    pub(super) colour_from_depth: DAffine3,
    /// Furthest depth that is no guess.
    pub(super) reach: Option<f64>,
    /// Whether colour images have a rim of undistorting.
    pub(super) black_rim: bool,
    /// Meaning of the layout's poses.
    pub(super) convention: Convention,
    /// Reason why no frame has a pose, if that is so: each camera is the origin then, and the frames are to be aligned.
    pub(super) no_poses: Option<String>,
    /// Direction of up in the world of the poses, where the recorder measured gravity.
    pub(super) up: Option<DVec3>,
    /// The times of poses and frames, where a layout brings them together by these alone.
    pub(super) timed: Option<Timed>,
    /// For people to know.
    pub(super) notes: Vec<String>,
    /// Damage that reading met, by frame: each is told to the log once.
    pub(super) damages: Mutex<FxHashMap<usize, String>>,
}

/// One frame.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub(super) name: Box<str>,
    pub(super) depth: Place,
    pub(super) colour: Option<Place>,
    pub(super) confidence: Option<Place>,
    /// Of the depth image, at any size.
    pub(super) depth_camera: Camera,
    /// Of the colour image, at any size.
    pub(super) colour_camera: Camera,
    pub(super) world_from_sensor: DAffine3,
}

/// A photo without depths.
#[derive(Clone, Debug)]
pub(super) struct Lone {
    pub(super) place: Place,
    /// Of the photo, at any size.
    pub(super) camera: Camera,
    /// Distortion of its lens.
    pub(super) lens: Option<Lens>,
    pub(super) world_from_camera: DAffine3,
}

/// Form of stored depths.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthForm {
    pub(super) coding: Coding,
    /// Factor of a stored whole number.
    pub(super) unit: f64,
    /// Factor of a stored float.
    pub(super) unit_of_floats: f64,
    pub(super) kind: DepthKind,
}

/// Form of stored confidences.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConfidenceForm {
    pub(super) coding: Coding,
    /// Lower levels than this are left out.
    pub(super) least: u8,
}

/// Convention of the poses of a layout, and whether all that write it agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Convention {
    /// Cameras have y up and look along -z, as OpenGL's. Else y down, along z.
    pub(super) looks_along_minus_z: bool,
    /// The files have poses world to camera. Entries have them inverted.
    pub(super) world_to_camera: bool,
    /// Whether the layout leaves no doubt.
    pub(super) is_sure: bool,
}

impl Convention {
    /// y down, looking along z.
    pub(super) const FORWARD: Convention =
        Convention { looks_along_minus_z: false, world_to_camera: false, is_sure: true };
    /// y up, looking along -z, as ARKit's and OpenGL's cameras.
    pub(super) const BACKWARD: Convention =
        Convention { looks_along_minus_z: true, world_to_camera: false, is_sure: true };
}

impl Recording {
    /// A recording of Kinects and the like: images of millimetres beside colour images that are registered to them.
    pub(super) fn new(store: Store, layout: &'static str) -> Recording {
        Recording {
            store,
            layout,
            entries: Vec::new(),
            photos: Vec::new(),
            keeps_photos: false,
            missing: Vec::new(),
            is_in_time: true,
            depth: DepthForm { coding: Coding::Image, unit: 1e-3, unit_of_floats: 1.0, kind: DepthKind::Planar },
            confidence: ConfidenceForm { coding: Coding::Image, least: 1 },
            colour_from_depth: DAffine3::IDENTITY,
            reach: None,
            black_rim: false,
            convention: Convention::FORWARD,
            no_poses: None,
            up: None,
            timed: None,
            notes: Vec::new(),
            damages: Mutex::default(),
        }
    }

    /// A recording of a phone's LiDAR, whose depth comes with ARKit's poses: their world has y up, by gravity.
    pub(super) fn of_phone(store: Store, layout: &'static str) -> Recording {
        // The LiDAR's reach; what ARKit says beyond is guessed from the colours.
        let new = Recording::new(store, layout);
        Recording { reach: Some(5.0), convention: Convention::BACKWARD, up: Some(DVec3::Y), ..new }
    }

    /// The file that holds the depth of a frame.
    pub(super) fn path_of(&self, index: usize) -> PathBuf {
        self.store.path_at(&self.entries[index].depth)
    }

    /// Reads depth and confidence of a frame.
    pub(super) fn without_colour(
        &self,
        index: usize,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Frame> {
        let entry = &self.entries[index];
        let mut frame = Frame { reach: self.reach, ..Frame::new(self.depth(entry, options, progress)?) };
        frame.depth.name = entry.name.to_string();
        frame.confidence = self.confidence(index, options, progress)?;
        Ok(frame)
    }

    /// Cameras that say no size are those of the depth images: of the size of two among the first, the middle and the last, else of the
    /// first's. Images of another size, and of colour, have them scaled.
    pub(super) fn give_cameras_a_size(&mut self, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<()> {
        let lacking: Vec<&Entry> = self.entries.iter().filter(|entry| entry.depth_camera.size.is_none()).collect();
        let [first, .., last] = lacking.as_slice() else {
            let Some(only) = lacking.first() else { return Ok(()) };
            let size = self.size(only, options, progress)?;
            self.size_cameras(size);
            return Ok(());
        };
        let size = self.size(first, options, progress)?;
        let other = |entry: &Entry| match self.size(entry, options, progress) {
            Err(error) if is_damage(&error) => Ok(None),
            size => size.map(Some),
        };
        let size = match (other(lacking[lacking.len() / 2])?, other(last)?) {
            (Some(middle), Some(last)) if middle == last => middle,
            _ => size,
        };
        self.size_cameras(size);
        Ok(())
    }

    fn size(&self, entry: &Entry, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<[usize; 2]> {
        let raster = self.decoded(entry, options, progress)?;
        Ok([raster.cols, raster.rows])
    }

    fn size_cameras(&mut self, size: [usize; 2]) {
        for entry in &mut self.entries {
            for camera in [&mut entry.depth_camera, &mut entry.colour_camera] {
                camera.size.get_or_insert(size);
            }
        }
    }

    fn depth(&self, entry: &Entry, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<RangeImage> {
        let path = self.shown(entry, &entry.depth);
        let raster = self.decoded(entry, options, progress)?;
        let size = [raster.cols, raster.rows];
        let camera = camera_for(&entry.depth_camera, size, &path)?;
        let unit = if raster.numbers == Numbers::Real { self.depth.unit_of_floats } else { self.depth.unit };
        let values = in_units(raster, unit, options);
        RangeImage::from_values(size[1], size[0], values, camera.projection(self.depth.kind))
            .map_err(|error| Error::format(&path, "whole image", error.to_string()))
    }

    /// The numbers of a frame's depth image.
    pub(super) fn decoded(&self, entry: &Entry, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<Raster> {
        let bytes = self.store.bytes(&entry.depth, options.max_decoded_bytes(), progress)?;
        decode::numbers(&bytes, self.depth.coding, &self.shown(entry, &entry.depth), options, progress)
    }

    /// The name of an image in errors: its file. Within one file of all frames the name of its frame.
    fn shown(&self, entry: &Entry, place: &Place) -> PathBuf {
        match place {
            Place::Named(name) => self.store.path_of(name),
            Place::Span { .. } => self.store.path.join(format!("frame {}", entry.name)),
        }
    }
}

impl Frames for Recording {
    fn is_in_time(&self) -> bool {
        self.is_in_time
    }

    fn up(&self, index: usize) -> Option<DVec3> {
        let sensor_from_world = self.entries.get(index)?.world_from_sensor.inverse();
        Some(sensor_from_world.transform_vector3(self.up?).normalize())
    }

    fn print_of(&self, index: usize) -> Option<u64> {
        let entry = self.entries.get(index)?;
        let forms = (self.layout, self.depth, self.confidence, self.colour_from_depth, self.reach, self.black_rim);
        let mut hasher = FxHasher::default();
        format!("{entry:?} {forms:?}").hash(&mut hasher);
        Some(hasher.finish())
    }

    fn frame(
        &self,
        index: usize,
        world_from_sensor: DAffine3,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Frame> {
        let mut frame = self.without_colour(index, options, progress)?;
        frame.depth.world_from_sensor = world_from_sensor;
        progress.check()?;
        frame.colour = self.colour(index, options, progress)?;
        Ok(frame)
    }

    fn preview(&self, index: usize, count: usize, options: &Arc<ReadOptions>) -> Result<Vec<DVec3>> {
        let none = Progress::none();
        let (image, _) = self.without_colour(index, options, &none)?.into_range_image(&none)?;
        let step = (image.valid_count() / count.max(1)).max(1);
        let valid = (0..image.len()).filter(|&i| image.is_valid(i));
        Ok(valid.step_by(step).map(|i| image.point_in_sensor(i)).collect())
    }

    fn confidence(
        &self,
        index: usize,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Option<ConfidenceImage>> {
        let entry = &self.entries[index];
        let Some(place) = &entry.confidence else { return Ok(None) };
        let bytes = self.store.bytes(place, options.max_decoded_bytes(), progress)?;
        let path = self.shown(entry, place);
        let (size, levels) = decode::levels(&bytes, self.confidence.coding, &path, options, progress)?;
        Ok(Some(ConfidenceImage { size, levels, least: self.confidence.least }))
    }

    fn has_colour(&self, index: usize) -> bool {
        self.entries[index].colour.is_some()
    }

    fn colour(&self, index: usize, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<Option<ColourImage>> {
        let entry = &self.entries[index];
        let Some(place) = &entry.colour else { return Ok(None) };
        let path = self.shown(entry, place);
        let bytes = self.store.bytes(place, options.max_decoded_bytes(), progress)?;
        let (size, pixels) = decode::colours(&bytes, &path, options)?;
        Ok(Some(ColourImage {
            camera: camera_for(&entry.colour_camera, size, &path)?,
            pixels,
            colour_from_depth: self.colour_from_depth,
            black_rim: self.black_rim,
        }))
    }

    fn undamaged_parts(
        &self,
        index: usize,
        world_from_sensor: DAffine3,
        options: &Arc<ReadOptions>,
        progress: &Progress<'_>,
    ) -> Result<Frame> {
        Recording::undamaged_parts(self, index, world_from_sensor, options, progress)
    }

    fn damage(&self, index: usize) -> Option<String> {
        Recording::damage(self, index)
    }
}

/// The camera of an image, whose size it may not have been given for, but whose shape.
pub(super) fn camera_for(camera: &Camera, size: [usize; 2], path: &Path) -> Result<Camera> {
    if let Some(of) = camera.size {
        let factor = [0, 1].map(|axis| size[axis] as f64 / of[axis] as f64);
        if !(factor[0].max(factor[1]) <= SAME_SHAPE * factor[0].min(factor[1])) {
            let ([cols, rows], [width, height]) = (size, of);
            let problem = format!(
                "an image of {cols} x {rows} pixels must have the shape of its camera's, {width} x {height}: one of \
                    them was turned or cropped"
            );
            return Err(Error::format(path, "header", problem));
        }
    }
    Ok(camera.scaled_to(size))
}

/// Stored numbers as lengths. NaN where they mark that nothing was measured.
fn in_units(raster: Raster, unit: f64, options: &ReadOptions) -> Vec<f64> {
    let unit = options.scale.unwrap_or(unit);
    let (offset, invalid) = (options.offset, options.invalid.unwrap_or(f64::NAN));
    // Of 16 bits the largest is a mark: 7-Scenes writes it where nothing came back.
    let saturated = match raster.numbers {
        Numbers::Whole(most) if most >= 65535 => f64::from(most),
        _ => f64::NAN,
    };
    let mut values = raster.values;
    if offset == 0.0 && invalid.is_nan() {
        // A range image takes no depth that is not > 0.
        for value in &mut values {
            *value = if *value == saturated { f64::NAN } else { *value * unit };
        }
        return values;
    }
    for value in &mut values {
        let is_mark = (*value == invalid) | (*value == saturated) | (*value <= 0.0);
        *value = if is_mark { f64::NAN } else { *value * unit + offset };
    }
    values
}

/// Reads JSON. Python writes NaN and Infinity, which JSON has not: they are read as `null`.
pub(super) fn json(store: &Store, name: &str, progress: &Progress<'_>) -> Result<serde_json::Value> {
    let text = store.text(name, progress)?;
    serde_json::from_str(&text).or_else(|error| {
        let finite = with_null(&text).and_then(|text| serde_json::from_str(&text).ok());
        finite.ok_or_else(|| no_json(&store.path_of(name), &error))
    })
}

/// JSON with `null` for each number that is none. `None` if there is no such number.
fn with_null(text: &str) -> Option<String> {
    let mut found = String::new();
    let (mut rest, mut is_inside) = (text, false);
    while let Some(c) = rest.chars().next() {
        let none = ["-Infinity", "Infinity", "NaN"].into_iter().find(|none| !is_inside && rest.starts_with(none));
        let taken = match (none, c) {
            (Some(none), _) => {
                found.push_str("null");
                none.len()
            }
            (None, '\\') if is_inside => 1 + rest[1..].chars().next().map_or(0, char::len_utf8),
            (None, c) => {
                is_inside ^= c == '"';
                c.len_utf8()
            }
        };
        if none.is_none() {
            found.push_str(&rest[..taken]);
        }
        rest = &rest[taken..];
    }
    (found != text).then_some(found)
}

/// The numbers of an array, which may be nested once. NaN for `null`. `None` if it holds anything else.
pub(super) fn flat(value: &serde_json::Value) -> Option<Vec<f64>> {
    let number = |value: &serde_json::Value| if value.is_null() { Some(f64::NAN) } else { value.as_f64() };
    let mut all = Vec::new();
    for entry in value.as_array()? {
        match entry.as_array() {
            Some(inner) => inner.iter().try_for_each(|n| number(n).map(|n| all.push(n)))?,
            None => all.push(number(entry)?),
        }
    }
    Some(all)
}

/// A number of an object, if it has it. Anything else in its place is refused.
pub(super) fn number(object: &serde_json::Value, key: &str) -> Result<Option<f64>, String> {
    let Some(value) = object.get(key).filter(|value| !value.is_null()) else { return Ok(None) };
    let number = value.as_f64().filter(|number| number.is_finite());
    number.map(Some).ok_or_else(|| format!("`{key}` must be a number, not {}", shown(value)))
}

/// A text of an object, if it has it. Anything else in its place is refused.
pub(super) fn text<'v>(object: &'v serde_json::Value, key: &str) -> Result<Option<&'v str>, String> {
    let Some(value) = object.get(key).filter(|value| !value.is_null()) else { return Ok(None) };
    value.as_str().map(Some).ok_or_else(|| format!("`{key}` must be text, not {}", shown(value)))
}

/// The beginning of a value, for errors.
fn shown(value: &serde_json::Value) -> String {
    value.to_string().chars().take(40).collect()
}

/// The part of a file's name that says which frame it is: without folder and ending.
pub(super) fn stem(name: &str) -> &str {
    let name = file_name(name);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// The photo of that name without its ending, which is any of a photo's.
pub(super) fn photo_of(stem: &str, is_there: impl Fn(&str) -> bool) -> Option<String> {
    let endings = ["jpg", "jpeg", "png", "JPG", "JPEG", "PNG"];
    endings.into_iter().map(|ending| format!("{stem}.{ending}")).find(|name| is_there(name))
}

fn file_name(name: &str) -> &str {
    name.rsplit('/').next().unwrap_or(name)
}

/// Names in the order of the numbers in them: `2` before `10`.
pub(super) fn in_order(names: impl IntoIterator<Item = String>) -> Vec<String> {
    let mut all: Vec<(Vec<(String, u128)>, String)> = names.into_iter().map(|name| (file_order(&name), name)).collect();
    all.sort();
    all.into_iter().map(|(_, name)| name).collect()
}

fn file_order(name: &str) -> Vec<(String, u128)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let words = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (word, after) = rest.split_at(words);
        let digits = after.find(|c: char| !c.is_ascii_digit()).unwrap_or(after.len());
        // Longer ones than any number of frames or time: their start is enough.
        let number = after[..digits.min(30)].parse().unwrap_or(0);
        parts.push((word.to_owned(), number));
        rest = &after[digits..];
    }
    parts
}

/// A pose of 16 numbers, or `None` where the recorder lost track, which numbers that are not finite say.
pub(super) fn pose(rows: &[f64; 16]) -> Result<Option<DAffine3>, String> {
    if rows.iter().any(|x| !x.is_finite()) || rows[..12].iter().all(|x| *x == 0.0) {
        return Ok(None);
    }
    super::super::pose::from_rows(rows).map(Some)
}

/// A pose of a quaternion x y z w and a place.
pub(super) fn pose_of([x, y, z, w]: [f64; 4], place: [f64; 3]) -> Result<DAffine3, String> {
    let rotation = glam::DQuat::from_xyzw(x, y, z, w);
    if !((rotation.length_squared() - 1.0).abs() < 0.02) || place.iter().any(|x| !x.is_finite()) {
        return Err("the quaternion does not have unit length, or the place is not finite".to_owned());
    }
    Ok(DAffine3::from_rotation_translation(rotation.normalize(), DVec3::from_array(place)))
}
