//! Recordings of depth cameras and phones: frames with depth, colour, confidence, camera and pose.
//!
//! | file | what |
//! |---|---|
//! | `seven_scenes`, `tum`, `icl_nuim`, `scannet`, `replica`, `arkit_scenes` | data sets |
//! | `folders` | Open3D's and Redwood's: folders of images, a list of poses |
//! | `polycam`, `record3d`, `scanner_app`, `stray`, `rtabmap` | exports of phones and robots |
//! | `nerfstudio`, `colmap`, `sens` | `transforms.json`; dense workspaces; ScanNet's and BundleFusion's one file |
//! | `asked` | what the caller asked for, as layouts need it |
//! | `recording` | a recording: its frames listed, each read as its layout says |
//! | `store` | storage of its files: a folder, a zip archive, one file |
//! | `decode` | images to numbers and colours |
//! | `photos`, `lens` | photos at their full size, and distortion undone |
//! | `poses` | lists of poses, and a pose a file |
//! | `whole` | depth images that are gone or damaged |
//! | `pairs` | frames that surely overlap, and how far apart they lie |
//! | `axes`, `clock` | whether poses mean what the layout says and are of the images' time, by the overlap of the frames |
//!
//! A layout is a module and a line here. It lists frames and decodes none: opening a recording reads its lists, and depths of a few frames
//! to see how they overlap. Frames without a pose are passed over. The notes say how many. Of a recording without any list of poses all
//! frames are there, and the notes say that they are to be aligned.

mod arkit_scenes;
mod asked;
mod axes;
mod clock;
mod colmap;
mod decode;
mod folders;
mod icl_nuim;
mod lens;
mod nerfstudio;
mod pairs;
mod photos;
mod polycam;
mod poses;
mod record3d;
mod recording;
mod replica;
mod rtabmap;
mod scanner_app;
mod scannet;
pub(super) mod sens;
mod seven_scenes;
mod store;
mod stray;
mod tum;
mod whole;

#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::options::ReadOptions;
use super::scan::FileScan;
use super::set::{OpenNamed, ScanSet};
use super::{archive, file};
use asked::Asked;
use base::error::{Error, Result};
use base::log::{self, Level};
use base::progress::Progress;
use image::range_image::DepthKind;
pub use photos::{PhotoOptions, PhotoSet, RecordedPhoto};
use recording::Recording;
use store::Store;

/// A way in which recordings are laid out.
struct Layout {
    /// The programs that write it, for people.
    name: &'static str,
    /// Whether the files are laid out so.
    recognize: fn(&Store) -> bool,
    /// Lists the frames.
    list: fn(Store, &'static str, &Asked<'_, '_>) -> Result<Recording>,
}

/// Bytes of a file that it is recognized by: the keys of JSON come in any order.
const SNIFFED: usize = 1 << 20;

/// The layouts. If files fit several, the stricter comes first.
static LAYOUTS: &[Layout] = &[
    Layout { name: "Polycam", recognize: polycam::recognize, list: polycam::list },
    Layout { name: "Record3D", recognize: record3d::recognize, list: record3d::list },
    Layout { name: "3D Scanner App", recognize: scanner_app::recognize, list: scanner_app::list },
    Layout { name: "Stray Scanner", recognize: stray::recognize, list: stray::list },
    Layout { name: "COLMAP", recognize: colmap::recognize, list: colmap::list },
    Layout { name: "nerfstudio", recognize: nerfstudio::recognize, list: nerfstudio::list },
    Layout { name: "ARKitScenes", recognize: arkit_scenes::recognize, list: arkit_scenes::list },
    Layout { name: "Replica", recognize: replica::recognize, list: replica::list },
    Layout { name: "RTAB-Map", recognize: rtabmap::recognize, list: rtabmap::list },
    Layout { name: "7-Scenes", recognize: seven_scenes::recognize, list: seven_scenes::list },
    Layout { name: "ICL-NUIM", recognize: icl_nuim::recognize, list: icl_nuim::list },
    Layout { name: "TUM RGB-D", recognize: tum::recognize, list: tum::list },
    Layout { name: "ScanNet", recognize: scannet::recognize, list: scannet::list },
    Layout { name: "Open3D, Redwood or RealSense", recognize: folders::recognize, list: folders::list },
];

/// A folder that is laid out as a recording.
pub(super) struct Found {
    layout: &'static Layout,
    path: PathBuf,
}

/// Looks whether a folder is a recording: by names alone.
pub(super) fn find(path: &Path, progress: &Progress<'_>) -> Result<Option<Found>> {
    let found = recognized(Store::folder(path, progress)?, progress)?.ok();
    Ok(found.map(|(layout, store)| Found { layout, path: store.path }))
}

/// The layout of files, or of those in their only folder. The files themselves where there is none.
fn recognized(store: Store, progress: &Progress<'_>) -> Result<Result<(&'static Layout, Store), Store>> {
    let layout_of = |store: &Store| LAYOUTS.iter().find(|layout| (layout.recognize)(store));
    if let Some(layout) = layout_of(&store) {
        return Ok(Ok((layout, store)));
    }
    let inner = store.only_folder(progress)?.and_then(|inner| Some((layout_of(&inner)?, inner)));
    Ok(inner.ok_or(store))
}

impl Found {
    /// The folder where its files begin.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Lists the frames.
    pub(super) fn open(&self, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<ScanSet> {
        open(self.layout, Store::folder(&self.path, progress)?, &Asked { options, progress, photos: false })
    }
}

/// Opens an archive as a recording.
pub(super) fn open_archive(path: &Path, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<ScanSet> {
    match recognized(Store::archive(path, progress)?, progress)? {
        Ok((layout, store)) => open(layout, store, &Asked { options, progress, photos: false }),
        Err(store) => Err(unknown(&store, path, "this archive is no recording that is known")),
    }
}

fn unknown(store: &Store, path: &Path, what: &str) -> Error {
    let known: Vec<&str> = LAYOUTS.iter().map(|layout| layout.name).collect();
    let hidden = store.hidden().map(|hidden| format!(": {hidden}")).unwrap_or_default();
    let problem = format!("{what}: {}{hidden}", known.join(", "));
    Error::format(path, "list of files", problem)
}

/// The photos of a recording: its colour images at their full size, with cameras and poses. A recording is a folder, an archive, a
/// `transforms.json` or a `.sens` file. Poses are in the frame of the scans that [`open_with`](super::open_with) gives of it.
///
/// Photos need no depths: those of a `transforms.json` without depth images are taken, and those of a model of COLMAP without depth maps. The
/// distortion of their lenses is undone, which cuts the image to the part that all of its rows and columns have. Where depths were measured
/// beside a photo, they come with it. Photos of another size than their camera have it scaled. Pixels are taken as they are stored. Only
/// where they fit the camera after the rotation of EXIF alone, they are turned. The black rim of images that were undistorted is cut off.
///
/// Photos that are missing or damaged, or have another shape than their camera, are left out, and a note names them. HEIC images and videos
/// are not read.
///
/// # Cost
/// Memory holds names, cameras and poses. The head of each file is read, and of an archive's all.
///
/// # Errors
/// [`Error::Parameter`]. A path that is no recording. A recording that can't be read, or has no photo. A camera that is no pinhole's.
/// [`Error::Cancelled`].
pub fn photos(path: &Path, wanted: &PhotoOptions, options: &ReadOptions, progress: &Progress<'_>) -> Result<PhotoSet> {
    options.validate()?;
    wanted.validate()?;
    let options = Arc::new(options.clone());
    progress.watch(|| {
        let asked = Asked { options: &options, progress, photos: true };
        let (recording, notes) = prepared(listed(path, &asked)?, &asked)?;
        photos::of(recording, notes, wanted, &options, progress)
    })
}

/// The recording of a path.
fn listed(path: &Path, asked: &Asked<'_, '_>) -> Result<Recording> {
    let of_files = |store: Store, unlike: &str| match recognized(store, asked.progress)? {
        Ok((layout, store)) => (layout.list)(store, layout.name, asked),
        Err(store) if colmap::has_model(&store) => colmap::list(store, "COLMAP", asked),
        Err(store) => Err(unknown(&store, path, unlike)),
    };
    if file::is_dir(path) {
        return of_files(Store::folder(path, asked.progress)?, "this folder is no recording that is known");
    }
    let (start, _) = file::read_start(path, SNIFFED)?;
    if archive::sniff(&start) {
        of_files(Store::archive(path, asked.progress)?, "this archive is no recording that is known")
    } else if sniff_transforms(&start) {
        transforms(path, asked)
    } else if sens::sniff(&start) {
        sens::list(path, asked)
    } else {
        let problem = "it is no recording: give its folder, its archive, its transforms.json or its .sens file";
        Err(Error::format(path, "start of file", problem))
    }
}

/// Opens the recording that a `transforms.json` lists. Its frames lie in images, so that it needs no opener of scans.
pub(super) fn open_transforms(
    path: &Path,
    options: &Arc<ReadOptions>,
    _: OpenNamed,
    progress: &Progress<'_>,
) -> Result<ScanSet> {
    frames_of_transforms(path, options, progress)
}

fn frames_of_transforms(path: &Path, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<ScanSet> {
    let asked = Asked { options, progress, photos: false };
    scans(transforms(path, &asked)?, &asked)
}

/// The recording that a file of frames lists.
fn transforms(path: &Path, asked: &Asked<'_, '_>) -> Result<Recording> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = file::name(path);
    nerfstudio::listed(Store::folder(folder, asked.progress)?, &name, "nerfstudio", asked)
}

/// Whether a file that starts like this lists frames.
pub(super) fn sniff_transforms(start: &[u8]) -> bool {
    let text = file::start_of_text(start);
    text.trim_start().starts_with('{') && text.contains("\"transform_matrix\"") && text.contains("\"frames\"")
}

/// Opens a file of ScanNet's.
pub(super) fn open_sens(path: &Path, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<ScanSet> {
    let asked = Asked { options, progress, photos: false };
    scans(sens::list(path, &asked)?, &asked)
}

fn open(layout: &Layout, store: Store, asked: &Asked<'_, '_>) -> Result<ScanSet> {
    scans((layout.list)(store, layout.name, asked)?, asked)
}

/// The end of the note on a recording without poses.
pub(super) const WITHOUT_POSES: &str = "the frames have no poses: align them before they are merged";

/// A recording whose frames are there and are placed as their poses are meant, with notes on that.
fn prepared(mut recording: Recording, asked: &Asked<'_, '_>) -> Result<(Recording, Vec<String>)> {
    let &Asked { options, progress, photos } = asked;
    recording.keeps_photos = photos;
    let mut doubts: Vec<String> = recording.skip_damaged(options, progress)?.into_iter().collect();
    refuse_empty(&recording, &doubts)?;
    if let Some(camera) = options.camera {
        for entry in &mut recording.entries {
            if entry.colour_camera == entry.depth_camera {
                entry.colour_camera = camera;
            }
            entry.depth_camera = camera;
        }
    }
    recording.give_cameras_a_size(options, progress)?;
    if options.depth == DepthKind::Ray {
        recording.depth.kind = DepthKind::Ray;
    }
    let mut without_poses = None;
    let found = match &recording.no_poses {
        None => axes::check(&mut recording, options, progress)?,
        Some(why) => {
            without_poses = Some(format!("{why}, so {WITHOUT_POSES}"));
            axes::Found::default()
        }
    };
    doubts.extend(found.doubts);
    refuse_empty(&recording, &doubts)?;
    let name = file::name(&recording.store.path);
    for doubt in &doubts {
        log::tell(Level::Warning, &format!("{name}: {doubt}"));
    }
    let mut notes = doubts;
    // Not told the log: a list that is opened with the recording may have them.
    notes.extend(without_poses);
    notes.append(&mut recording.notes);
    notes.extend(found.notes);
    Ok((recording, notes))
}

/// The frames of a recording as scans.
fn scans(recording: Recording, asked: &Asked<'_, '_>) -> Result<ScanSet> {
    let (recording, others) = prepared(recording, asked)?;
    let name = file::name(&recording.store.path);
    let coloured = recording.entries.iter().filter(|entry| entry.colour.is_some()).count();
    let count = recording.entries.len();
    let mut notes = vec![match count {
        1 => format!("1 frame of {}, {coloured} with colour", recording.layout),
        _ => format!("{count} frames of {}, {coloured} with colour", recording.layout),
    }];
    notes.extend(others);
    let recording = Arc::new(recording);
    let scan = |part: usize| {
        let entry = &recording.entries[part];
        FileScan {
            name: entry.name.to_string(),
            part,
            world_from_sensor: entry.world_from_sensor,
            options: asked.options.clone(),
            recording: Some(recording.clone()),
            ..FileScan::new(&recording.path_of(part))
        }
    };
    let scans = (0..count).map(scan).collect();
    Ok(ScanSet { scans, notes: notes.into_iter().map(|note| format!("{name}: {note}")).collect() })
}

fn refuse_empty(recording: &Recording, doubts: &[String]) -> Result<()> {
    if !recording.entries.is_empty() || !recording.photos.is_empty() {
        return Ok(());
    }
    let notes: Vec<String> = recording.notes.iter().chain(doubts).map(|note| format!(": {note}")).collect();
    let problem =
        format!("this recording of {} needs a frame that has both depth and pose{}", recording.layout, notes.concat());
    Err(Error::format(&recording.store.path, "whole recording", problem))
}

/// For tests and fuzzing: any bytes, as a file of frames and as each kind of a frame's images, are read or refused.
#[cfg(any(test, fuzzing))]
pub(super) fn examine(bytes: &[u8], folder: &Path) {
    use decode::Coding;
    // Little, so that what unpacks to much is refused.
    let options = Arc::new(ReadOptions { max_decoded_gib: 0.0625, ..ReadOptions::default() });
    let none = Progress::none();
    type Open = fn(&Path, &Arc<ReadOptions>, &Progress<'_>) -> Result<ScanSet>;
    let opens: [(&str, Open); 3] =
        [("a.sens", open_sens), ("a.zip", open_archive), ("transforms.json", frames_of_transforms)];
    for (name, open) in opens {
        let path = folder.join(name);
        std::fs::write(&path, bytes).expect("a scratch folder");
        if let Ok(set) = photos(&path, &PhotoOptions::default(), &options, &none) {
            set.photos.iter().take(3).for_each(RecordedPhoto::examine);
        }
        let Ok(set) = open(&path, &options, &none) else { continue };
        for scan in set.scans.iter().take(3) {
            assert!(scan.world_from_sensor.is_finite());
            if let Ok(super::Content::RangeImage(image)) = scan.read() {
                assert!(image.validate().is_ok());
            }
        }
    }
    let path = folder.join("image");
    let size = [5, 3];
    let codings = [
        Coding::Image,
        Coding::LzfseFloats(size),
        Coding::LzfseBytes(size),
        Coding::ZlibNumbers(size),
        Coding::Numbers(size),
        Coding::Colmap,
        Coding::Text(size),
    ];
    for coding in codings {
        if let Ok((size, levels)) = decode::levels(bytes, coding, &path, &options, &none) {
            assert_eq!(levels.len(), size[0] * size[1]);
        }
        if let Ok(raster) = decode::numbers(bytes, coding, &path, &options, &none) {
            assert_eq!(raster.values.len(), raster.rows * raster.cols);
        }
    }
    if let Ok((size, pixels)) = decode::colours(bytes, &path, &options) {
        assert_eq!(pixels.len(), size[0] * size[1]);
    }
}

/// Columns, rows and colours of a JPEG or PNG file, for tests of what is written.
#[cfg(test)]
pub(crate) fn colours_of(bytes: &[u8]) -> Result<([usize; 2], Vec<[u8; 3]>)> {
    decode::colours(bytes, Path::new("image"), &ReadOptions::default())
}
