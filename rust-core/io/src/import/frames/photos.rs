//! The photos of a recording: its colour images at their full size, with cameras and poses. Pixels are decoded when they are asked for.

use std::sync::Arc;

use glam::DAffine3;

use super::super::options::ReadOptions;
use super::decode::{self, Turn, is_damage};
use super::lens::{Lens, Part};
use super::recording::{Lone, Recording, camera_for};
use super::store::Place;
use base::error::{Error, Result};
use base::log::{self, Level};
use base::params::count;
use base::progress::Progress;
use image::frame::{self, Camera, ColourImage};
use image::photo::{Depths, Photo, Pixels};
use image::range_image::RangeImage;

/// Bytes of an image in which its size is looked for first.
const HEAD: u64 = 1 << 17;
/// Photos that are shown by name.
const SHOWN: usize = 3;

base::params! {
    /// The photos of a recording that are taken.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PhotoOptions of "photos" {
        /// Of a recording each so many photos one is taken. Larger values take fewer.
        every: u32 = count("Every").default(1.0).at_least(1.0),
        /// Largest number of photos. Of more they are taken evenly.
        most: u32 = count("Photos").off("all are taken"),
    }
}

/// Photos of a recording, in its order.
#[derive(Clone, Debug, Default)]
pub struct PhotoSet {
    /// The photos.
    pub photos: Vec<RecordedPhoto>,
    /// Facts about them for people, as photos that were left out.
    pub notes: Vec<String>,
}

/// A photo of a recording. It holds its name, camera and pose. Memory: some hundred bytes.
#[derive(Clone, Debug)]
pub struct RecordedPhoto {
    name: String,
    /// The part that is shown, of the turned image.
    part: Part,
    turn: Turn,
    world_from_camera: DAffine3,
    source: Source,
    recording: Arc<Recording>,
    options: Arc<ReadOptions>,
}

/// Frames with depth, and photos without, by their numbers in the recording.
#[derive(Clone, Copy, Debug)]
enum Source {
    Frame(usize),
    Lone(usize),
}

impl Photo for RecordedPhoto {
    fn name(&self) -> &str {
        &self.name
    }

    fn camera(&self) -> Camera {
        self.part.camera()
    }

    fn world_from_camera(&self) -> DAffine3 {
        self.world_from_camera
    }

    fn pixels(&self) -> Result<Pixels> {
        let place = self.recording.photo_place(self.source)?;
        let path = self.recording.shown_photo(&self.name);
        let none = Progress::none();
        let bytes = self.recording.store.bytes(place, self.options.max_decoded_bytes(), &none)?;
        let (size, colours) = decode::colours(&bytes, &path, &self.options)?;
        let (size, colours) = self.turn.of(size, colours);
        let expected = self.part.whole_size();
        if size != expected {
            let problem = format!(
                "it had {} x {} pixels when the recording was opened, and has {} x {} now: open the recording again",
                expected[0], expected[1], size[0], size[1]
            );
            return Err(Error::format(&path, "header", problem));
        }
        let camera = self.part.camera();
        Ok(Pixels { size: camera.size.unwrap_or_default(), colours: self.part.pixels(colours) })
    }

    fn depths(&self) -> Result<Option<Depths>> {
        let Source::Frame(index) = self.source else { return Ok(None) };
        if self.turn != Turn::None || self.recording.colour_from_depth != DAffine3::IDENTITY {
            return Ok(None);
        }
        let none = Progress::none();
        let frame = match self.recording.without_colour(index, &self.options, &none) {
            Err(error) if is_damage(&error) => {
                self.recording.tell_damage(index, "gives its photo no depths", &error);
                return Ok(None);
            }
            frame => frame?,
        };
        let (image, _) = frame.into_range_image(&none)?;
        Ok(Some(as_seen(&image, &self.recording.entries[index].depth_camera, &self.camera())))
    }
}

/// Depths of an image as another camera at the same place sees them, as densely as they are.
fn as_seen(image: &RangeImage, of: &Camera, by: &Camera) -> Depths {
    let stored = of.scaled_to([image.cols(), image.rows()]);
    let density = [0, 1].map(|axis| (stored.focal[axis] / by.focal[axis]).abs());
    let whole = by.size.unwrap_or_default();
    let size = [0, 1].map(|axis| ((whole[axis] as f64 * density[axis]).round() as usize).max(1));
    let view = by.scaled_to(size);
    let along = |axis: usize| -> Vec<Option<usize>> {
        let count = [image.cols(), image.rows()][axis];
        let place = |k: usize| {
            let ray = (k as f64 - view.centre[axis]) / view.focal[axis];
            let at = (ray * stored.focal[axis] + stored.centre[axis]).round();
            (at >= 0.0 && at < count as f64).then_some(at as usize)
        };
        (0..size[axis]).map(place).collect()
    };
    let (columns, rows) = (along(0), along(1));
    let depth = |row: Option<usize>, column: Option<usize>| {
        let i = row? * image.cols() + column?;
        image.is_valid(i).then(|| image.point_in_sensor(i).z as f32)
    };
    let places = rows.iter().flat_map(|row| columns.iter().map(move |column| (*row, *column)));
    Depths { size, values: places.map(|(row, column)| depth(row, column).unwrap_or(0.0)).collect() }
}

#[cfg(any(test, fuzzing))]
impl RecordedPhoto {
    /// For tests and fuzzing: what is given fits together.
    pub(super) fn examine(&self) {
        assert!(self.world_from_camera.is_finite() && self.camera().validate().is_ok());
        if let Ok(pixels) = self.pixels() {
            assert_eq!(Some(pixels.size), self.camera().size);
            assert_eq!(pixels.colours.len(), pixels.size[0] * pixels.size[1]);
        }
        if let Ok(Some(depths)) = self.depths() {
            assert_eq!(depths.values.len(), depths.size[0] * depths.size[1]);
        }
    }
}

impl Recording {
    fn photo_place(&self, source: Source) -> Result<&Place> {
        let place = match source {
            Source::Frame(index) => self.entries.get(index).and_then(|entry| entry.colour.as_ref()),
            Source::Lone(index) => self.photos.get(index).map(|photo| &photo.place),
        };
        place.ok_or_else(|| Error::format(&self.store.path, "photos", "this photo is not there"))
    }

    /// The path of a photo of that name, for people.
    fn shown_photo(&self, name: &str) -> std::path::PathBuf {
        self.store.path.join(name)
    }
}

/// A photo before its file was looked at.
struct Candidate {
    name: String,
    source: Source,
    camera: Camera,
    lens: Option<Lens>,
    world_from_camera: DAffine3,
}

/// The photos of a recording whose poses are those of its scans.
pub(super) fn of(
    recording: Recording,
    mut notes: Vec<String>,
    wanted: &PhotoOptions,
    options: &Arc<ReadOptions>,
    progress: &Progress<'_>,
) -> Result<PhotoSet> {
    let candidates = candidates(&recording);
    let of = candidates.len();
    let chosen = chosen(candidates, wanted);
    if chosen.len() < of {
        notes.push(format!("{} of {of} photos are taken", chosen.len()));
    }
    let recording = Arc::new(recording);
    let (mut photos, mut left_out, mut scaled) = (Vec::new(), Vec::new(), 0);
    for candidate in chosen {
        progress.check()?;
        match looked_at(&recording, candidate, options, progress) {
            Ok((photo, is_scaled)) => {
                scaled += usize::from(is_scaled);
                photos.push(photo);
            }
            Err(error) if is_damage(&error) => left_out.push(error.to_string()),
            Err(error) => return Err(error),
        }
    }
    if recording.black_rim {
        without_rim(&mut photos)?;
    }
    left_out.extend(recording.missing.iter().map(|name| format!("{name} is not there")));
    if scaled > 0 {
        notes.push(format!("{scaled} photos have another size than their cameras say: the cameras are scaled to them"));
    }
    notes.extend(unread(&recording));
    if !left_out.is_empty() {
        let shown = left_out[..left_out.len().min(SHOWN)].join(", ");
        let more = if left_out.len() > SHOWN { ", and others" } else { "" };
        let note = format!("{} photos are left out: {shown}{more}", left_out.len());
        log::tell(Level::Warning, &note);
        notes.push(note);
    }
    if photos.is_empty() {
        let said: Vec<String> = notes.iter().map(|note| format!(": {note}")).collect();
        let problem = format!(
            "this recording of {} has no photo with a camera and a pose. Export it with its colour images{}",
            recording.layout,
            said.concat()
        );
        return Err(Error::format(&recording.store.path, "photos", problem));
    }
    notes.insert(0, format!("{} photos of {}", photos.len(), recording.layout));
    Ok(PhotoSet { photos, notes })
}

/// All colour images of a recording.
fn candidates(recording: &Recording) -> Vec<Candidate> {
    let depth_from_colour = recording.colour_from_depth.inverse();
    let frames = recording.entries.iter().enumerate().filter_map(|(index, entry)| {
        Some(Candidate {
            name: name_of(entry.colour.as_ref()?, &entry.name),
            source: Source::Frame(index),
            camera: entry.colour_camera,
            lens: None,
            world_from_camera: entry.world_from_sensor * depth_from_colour,
        })
    });
    let lone = recording.photos.iter().enumerate().map(|(index, photo)| {
        let Lone { place, camera, lens, world_from_camera } = photo;
        let source = Source::Lone(index);
        Candidate {
            name: name_of(place, ""),
            source,
            camera: *camera,
            lens: *lens,
            world_from_camera: *world_from_camera,
        }
    });
    frames.chain(lone).collect()
}

/// The name of a photo: its file's. Within one file of all frames its frame's.
fn name_of(place: &Place, frame: &str) -> String {
    match place {
        Place::Named(name) => name.to_string(),
        Place::Span { .. } => frame.to_owned(),
    }
}

/// Each n-th, then evenly as many as are wanted.
fn chosen(all: Vec<Candidate>, wanted: &PhotoOptions) -> Vec<Candidate> {
    let some: Vec<Candidate> = all.into_iter().step_by(wanted.every.max(1) as usize).collect();
    let (count, most) = (some.len(), wanted.most as usize);
    if most == 0 || count <= most {
        return some;
    }
    let before = |i: usize| i * most / count;
    some.into_iter().enumerate().filter(|(i, _)| before(i + 1) > before(*i)).map(|(_, one)| one).collect()
}

/// A photo with its size, of which the head of its file is read. Says whether its camera was scaled.
fn looked_at(
    recording: &Arc<Recording>,
    candidate: Candidate,
    options: &Arc<ReadOptions>,
    progress: &Progress<'_>,
) -> Result<(RecordedPhoto, bool)> {
    let Candidate { name, source, camera, lens, world_from_camera } = candidate;
    let path = recording.shown_photo(&name);
    let place = recording.photo_place(source)?;
    let head = recording.store.start_of(place, HEAD, options.max_decoded_bytes(), progress)?;
    let (size, turn) = match decode::size_and_turn(&head, &path) {
        Err(_) if head.len() as u64 >= HEAD => {
            let whole = recording.store.bytes(place, options.max_decoded_bytes(), progress)?;
            decode::size_and_turn(&whole, &path)?
        }
        found => found?,
    };
    // Programs that find cameras take the pixels as they are stored. Only where these fit when they are turned, they were turned.
    let (turn, size) = match camera_for(&camera, size, &path) {
        Err(error) => {
            let turned = turn.size(size);
            if turned == size || camera_for(&camera, turned, &path).is_err() {
                return Err(error);
            }
            (turn, turned)
        }
        Ok(_) => (Turn::None, size),
    };
    let is_scaled = camera.size.is_some_and(|of| of != size);
    let whole = camera_for(&camera, size, &path)?;
    let part = match lens {
        None => Part::of(whole, size.map(|side| [0, side])),
        Some(lens) => Part::undistorted(whole, lens).map_err(|problem| Error::format(&path, "camera", problem))?,
    };
    let (recording, options) = (recording.clone(), options.clone());
    Ok((RecordedPhoto { name, part, turn, world_from_camera, source, recording, options }, is_scaled))
}

/// Takes the black rim that undistorting has left off all photos: as much as has it in the first, the middle and the last of a size. Things
/// that are dark are not so in all of them.
fn without_rim(photos: &mut [RecordedPhoto]) -> Result<()> {
    let mut sizes: Vec<[usize; 2]> = photos.iter().map(|photo| photo.part.whole_size()).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for size in sizes {
        let of_size: Vec<usize> = (0..photos.len()).filter(|&i| photos[i].part.whole_size() == size).collect();
        let mut inner: Option<[[usize; 2]; 2]> = None;
        for i in [0, of_size.len() / 2, of_size.len() - 1] {
            let photo = &photos[of_size[i]];
            let pixels = match photo.pixels() {
                Err(error) if is_damage(&error) => continue,
                pixels => pixels?.colours,
            };
            let camera = photo.part.camera();
            let colour_from_depth = DAffine3::IDENTITY;
            let image = ColourImage { camera, pixels, colour_from_depth, black_rim: true };
            let [columns, rows] = frame::without_rim(&image);
            let wider = |a: [usize; 2], b: [usize; 2]| [a[0].min(b[0]), a[1].max(b[1])];
            inner = Some(inner.map_or([columns, rows], |of| [wider(of[0], columns), wider(of[1], rows)]));
        }
        let Some(inner) = inner else { continue };
        for &i in &of_size {
            photos[i].part = Part::of(photos[i].part.camera(), inner);
        }
    }
    Ok(())
}

/// A note on files that are photos or videos but are not read.
fn unread(recording: &Recording) -> Option<String> {
    let is_unread = |name: &&str| {
        let name = name.to_ascii_lowercase();
        [".heic", ".heif", ".hevc", ".mov", ".mp4"].iter().any(|ending| name.ends_with(ending))
    };
    let names: Vec<&str> = recording.store.top().filter(is_unread).collect();
    let first = names.first()?;
    Some(format!(
        "{} files such as {first} are in HEIC, HEVC or another form of video, and are not read: convert them to JPEG images",
        names.len()
    ))
}
