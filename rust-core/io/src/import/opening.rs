//! Opening: files and folders as one set of scans.

use std::collections::{HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::options::{PixelMeaning, ReadOptions};
use super::registry::{Role, format_of, is_any_text};
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use super::{file, folder, frames, pose, raster, trajectory};
use base::error::{Error, Result, known_as};
use base::log::{self, Level};
use base::progress::Progress;
use image::frame::Camera;
use image::range_image::Projection;
use mesh::Crs;

/// Opens a file: a single scan or a side file that places several (`.conf`). Reads headers and, for a side file, some
/// points of each scan, no more. What the file doesn't say takes its default ([`ReadOptions`]).
///
/// # Errors
/// The file can't be read, its format isn't known, or a scan it names can't be opened.
pub fn open(path: &Path) -> Result<ScanSet> {
    open_many(&[path])
}

/// Opens several files as one set, in the order given, with the default options.
///
/// # Errors
/// As [`open_with`].
pub fn open_many<P: AsRef<Path>>(paths: &[P]) -> Result<ScanSet> {
    open_with(paths, &ReadOptions::default(), &Progress::none())
}

/// Opens several files as one set, in the order given. A folder of frames of a depth camera or a phone opens as these, in one of the
/// layouts of `frames`. Another stands for its only list of scans, else for all files in it that hold or describe scans, by name. A note
/// says which scans of it the list lacks.
///
/// Side files among them apply to the others: a camera makes the images depth images, a trajectory places them, by the
/// names that it has of them, else by the numbers in their names, else in their order. A scan is also placed by a file of its own name with the
/// ending `.xf`, `.tf` or `.pose.txt` beside it. The notes say what was found.
///
/// # Errors
/// As [`open`], for the first file that can't be opened. No path given. Two cameras. A trajectory that doesn't fit. [`Error::Cancelled`].
pub fn open_with<P: AsRef<Path>>(paths: &[P], options: &ReadOptions, progress: &Progress<'_>) -> Result<ScanSet> {
    open_as(paths, options, Taking::default(), progress)
}

/// Treatment of the files that are opened together.
#[derive(Clone, Copy, Debug, Default)]
pub struct Taking {
    /// Whether they are to be aligned: of a folder all scans are opened, whatever list of poses lies in it.
    pub unplaced: bool,
    /// Whether one of several is left out where all are read for something, if it is damaged. Those of a folder always are.
    pub many: bool,
}

/// Opens files as [`open_with`] does, and as `taking` says.
///
/// # Errors
/// As [`open_with`].
pub fn open_as<P: AsRef<Path>>(
    paths: &[P],
    options: &ReadOptions,
    taking: Taking,
    progress: &Progress<'_>,
) -> Result<ScanSet> {
    options.validate()?;
    let paths: Vec<&Path> = paths.iter().map(AsRef::as_ref).collect();
    progress.watch(|| {
        let (listed, mut notes) = listed(&paths, taking, progress)?;
        let mut set = open_listed(&listed, options, progress)?;
        notes.append(&mut set.notes);
        Ok(ScanSet { notes, ..set })
    })
}

/// Folders above a file in which its recording may begin: exports put images into folders of folders.
const FOLDERS_ABOVE: usize = 3;

/// The folder of the recording that a file is of, or `None`: looks at the names in the folders above it and decodes nothing. Of
/// folders that would open one within the other, the outer one.
///
/// # Errors
/// A folder that can't be listed. [`Error::Cancelled`].
pub fn recording_of(path: &Path, progress: &Progress<'_>) -> Result<Option<PathBuf>> {
    let mut recording = None;
    for folder in path.ancestors().skip(1).take(FOLDERS_ABOVE) {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        if let Some(found) = frames::find(folder, progress)?
            && (found.path() == folder || path.starts_with(found.path()))
        {
            recording = Some(found.path().to_owned());
        }
    }
    Ok(recording)
}

/// Things that are opened: a recording's folder, or a file.
pub(super) enum Listed {
    Recording(frames::Found),
    File {
        path: PathBuf,
        /// Whether it is one of many, which go on without it if it is damaged.
        of_many: bool,
    },
    /// The list in a folder, and scans of this that it may lack.
    List {
        path: PathBuf,
        beside: Vec<PathBuf>,
        /// Whether those that it lacks are opened, too.
        with_others: bool,
    },
}

/// The things that paths stand for, and notes on what is passed over.
pub(super) fn listed(paths: &[&Path], taking: Taking, progress: &Progress<'_>) -> Result<(Vec<Listed>, Vec<String>)> {
    let Taking { unplaced, many } = taking;
    let (mut listed, mut all_notes) = (Vec::new(), Vec::new());
    for &path in paths {
        if !file::is_dir(path) {
            listed.push(Listed::File { path: path.to_owned(), of_many: many && paths.len() > 1 });
        } else if let Some(found) = frames::find(path, progress)? {
            listed.push(Listed::Recording(found));
        } else {
            let folder::FolderFiles { files, list, mut beside, notes } = folder::files_of(path, unplaced)?;
            all_notes.extend(notes);
            let of_many = files.len() > 1;
            listed.extend(files.into_iter().map(|path| match &list {
                Some(list) if *list == path => {
                    Listed::List { path, beside: std::mem::take(&mut beside), with_others: unplaced }
                }
                _ => Listed::File { path, of_many },
            }));
        }
    }
    Ok((listed, all_notes))
}

pub(super) fn open_listed(listed: &[Listed], options: &ReadOptions, progress: &Progress<'_>) -> Result<ScanSet> {
    let mut all = ScanSet::default();
    let mut options = options.clone();
    let mut poses: Option<(&Path, trajectory::Trajectory)> = None;
    let mut of_camera: Option<&Path> = None;
    let mut opens: Vec<Opening<'_>> = Vec::new();
    for one in listed {
        progress.check()?;
        let path = match one {
            Listed::Recording(found) => {
                opens.push(Opening::Recording(found));
                continue;
            }
            Listed::File { path, .. } | Listed::List { path, .. } => path.as_path(),
        };
        let role = &format_of(path)?.role;
        match role {
            Role::Camera(read) => {
                let camera = read(path)?;
                if options.camera.is_some_and(|other| other != camera) {
                    return Err(Error::input(format!("{}: there is another camera already: give one", known_as(path))));
                }
                options.camera = Some(camera);
                of_camera = Some(path);
            }
            Role::Trajectory(read) => {
                let mut found = read(path)?;
                found.as_told(&options);
                if let Some((other, _)) = poses.replace((path, found)) {
                    let problem = format!("{} is a trajectory too: give one", known_as(other));
                    return Err(Error::input(format!("{}: {problem}", known_as(path))));
                }
            }
            Role::Scans { .. } | Role::List(_) | Role::Recording(_) => {
                let of_many = matches!(one, Listed::File { of_many: true, .. });
                opens.push(Opening::File { path, role, of_many });
            }
        }
    }
    if opens.is_empty() {
        return Err(Error::input(match listed {
            [Listed::File { path: first, .. } | Listed::List { path: first, .. }, ..] => {
                format!("{}: this describes scans, so open it together with them", known_as(first))
            }
            _ => "no file was given: give at least one".to_owned(),
        }));
    }
    let options = Arc::new(options);
    let with_others: Vec<(&Path, &[PathBuf])> = listed
        .iter()
        .filter_map(|one| match one {
            Listed::List { path, beside, with_others: true } => Some((path.as_path(), beside.as_slice())),
            _ => None,
        })
        .collect();
    let mut opens = VecDeque::from(opens);
    while let Some(opening) = opens.pop_front() {
        progress.check()?;
        let mut set = opening.open(&options, progress)?;
        let opened: Arc<Path> = opening.path().into();
        for scan in set.scans.iter_mut().filter(|scan| scan.is_frame()) {
            scan.opened = Some(opened.clone());
        }
        if let [scan] = set.scans.as_mut_slice()
            && poses.is_none()
            && scan.recording.is_none()
            && opening.is_of(&scan.path)
        {
            set.notes.extend(pose::beside(scan)?);
        }
        let others = with_others.iter().filter(|(path, _)| *path == opening.path());
        for path in others.flat_map(|(_, beside)| unlisted(beside, &set.scans)).collect::<Vec<_>>().into_iter().rev() {
            opens.push_front(Opening::File { path, role: &format_of(path)?.role, of_many: true });
        }
        all.scans.append(&mut set.scans);
        all.notes.append(&mut set.notes);
    }
    all.notes.extend(leave_out_pictures(&mut all.scans));
    name_within_files(&mut all.scans);
    let is_of_no_poses = |note: &String| note.ends_with(frames::WITHOUT_POSES);
    let poses = match poses {
        Some((path, poses)) => Some((path.to_owned(), poses)),
        None => list_among(&mut all.scans, &options)?,
    };
    if let Some((path, poses)) = &poses {
        all.notes.extend(poses.place(&mut all.scans, path)?);
        all.notes.retain(|note| !is_of_no_poses(note));
    }
    for one in listed {
        if let Listed::List { path, beside, with_others: false } = one {
            all.notes.extend(folder::note_unlisted(path, &unlisted(beside, &all.scans)));
        }
    }
    all.notes.iter().filter(|note| is_of_no_poses(note)).for_each(|note| log::tell(Level::Warning, note));
    all.notes.extend(raster::note_without_camera(&mut all.scans)?);
    give_camera_a_size(&mut all.scans, of_camera, progress)?;
    make_names_unique(&mut all.scans);
    all.notes.extend(notes_on_crs(&all.scans, progress)?);
    Ok(all)
}

/// The text among scans that is the list of poses of images which have none. A list with a damaged line looks like points: without it the
/// images would all lie at one place.
///
/// # Errors
/// The list is damaged.
fn list_among(scans: &mut Vec<FileScan>, options: &ReadOptions) -> Result<Option<(PathBuf, trajectory::Trajectory)>> {
    let is_bare = |scan: &&FileScan| {
        !scan.is_frame() && scan.is_depth_image() && scan.world_from_sensor == glam::DAffine3::IDENTITY
    };
    let images = scans.iter().filter(is_bare).count();
    let is_list = |scan: &FileScan| {
        let is_text = !scan.is_frame() && !scan.is_depth_image() && is_any_text(&scan.path);
        is_text && trajectory::is_like_one(&scan.path, images)
    };
    let Some(place) = (images > 0).then(|| scans.iter().position(is_list)).flatten() else { return Ok(None) };
    let path = scans.remove(place).path;
    let mut found = trajectory::read(&path).map_err(|error| match error {
        Error::Format { path, at, problem } => {
            let remedy = "Mend this list of poses, which the images beside it lack. If it holds points, open it alone.";
            Error::format(&path, at, format!("{}. {remedy}", problem.trim_end_matches('.')))
        }
        other => other,
    })?;
    found.as_told(options);
    Ok(Some((path, found)))
}

/// Those files that none of the scans is in.
fn unlisted<'f>(files: &'f [PathBuf], scans: &[FileScan]) -> Vec<&'f Path> {
    let opened: HashSet<&Path> = scans.iter().map(|scan| scan.path.as_path()).collect();
    let rest: Vec<&Path> = files.iter().map(PathBuf::as_path).filter(|path| !opened.contains(path)).collect();
    if rest.is_empty() {
        return rest;
    }
    // A list may write a path in another way.
    let whole = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let opened: HashSet<PathBuf> = opened.into_iter().map(whole).collect();
    rest.into_iter().filter(|path| !opened.contains(&whole(path))).collect()
}

/// Takes images of colours out that lie beside grey depth images, and those of 8 bits beside more of 16. They are pictures and masks, whose
/// numbers would be taken for depths. Who says what pixels mean has none of them.
fn leave_out_pictures(scans: &mut Vec<FileScan>) -> Option<String> {
    let header = |scan: &FileScan| {
        let is_asked = scan.of_many && scan.is_depth_image() && scan.options.pixels == PixelMeaning::Auto;
        is_asked.then(|| raster::header_of(&scan.path)).flatten()
    };
    let kinds: Vec<Option<(bool, u8)>> =
        scans.iter().map(|scan| header(scan).map(|header| (header.is_grey, header.bits))).collect();
    let count = |kind: (bool, u8)| kinds.iter().filter(|own| **own == Some(kind)).count();
    let (deep, flat) = (count((true, 16)), count((true, 8)));
    let is_picture = |kind: &Option<(bool, u8)>| match kind {
        Some((true, 8)) => deep > flat,
        Some((false, _)) => deep + flat > 0,
        _ => false,
    };
    let mut kept = kinds.iter().map(|kind| !is_picture(kind));
    let mut pictures = Vec::new();
    scans.retain(|scan| {
        let stays = kept.next().unwrap_or(true);
        if !stays {
            pictures.push(scan.path.clone());
        }
        stays
    });
    let named = folder::named(&pictures)?;
    Some(match pictures.len() {
        1 => format!("1 image beside depth images holds colours or numbers of 8 bits, and is passed over: {named}"),
        count => format!(
            "{count} images beside depth images hold colours or numbers of 8 bits, and are passed over: {named}"
        ),
    })
}

/// Images that are decoded to tell which size they have, where their headers don't.
const DECODED: usize = 5;

/// A camera of unknown size is of the size of most depth images: so images of another size are told from the others.
///
/// # Errors
/// A camera's file of another size than most images.
fn give_camera_a_size(scans: &mut [FileScan], of_camera: Option<&Path>, progress: &Progress<'_>) -> Result<()> {
    let is_image = |scan: &FileScan| !scan.is_frame() && scan.is_depth_image();
    let mut order: Vec<usize> = (0..scans.len()).filter(|&k| is_image(&scans[k])).collect();
    let Some(camera) = order.first().and_then(|&k| scans[k].options.camera) else { return Ok(()) };
    let is_checked = if camera.size.is_some() { of_camera.is_some() } else { order.len() > 1 };
    if !is_checked {
        return Ok(());
    }
    order.sort_by(|&a, &b| scans[a].path.cmp(&scans[b].path));
    let Some((size, count)) = usual_size(scans, &order, progress)? else { return Ok(()) };
    if let (Some(own), Some(path)) = (camera.size, of_camera) {
        if own == size || count * 2 <= order.len() {
            return Ok(());
        }
        let problem = format!(
            "this camera has images of {} x {} pixels, but {count} of {} depth images have {} x {}. Write the camera of \
                these images here, with their width and height.",
            own[0],
            own[1],
            order.len(),
            size[0],
            size[1]
        );
        return Err(Error::format(path, "whole file", problem));
    }
    let camera = Some(Camera { size: Some(size), ..camera });
    let given = Arc::new(ReadOptions { camera, ..scans[order[0]].options.as_ref().clone() });
    for k in order {
        scans[k].options = given.clone();
    }
    Ok(())
}

/// The size that most depth images have, and how many these are. Of as many the size of the first.
fn usual_size(scans: &[FileScan], order: &[usize], progress: &Progress<'_>) -> Result<Option<([usize; 2], usize)>> {
    let (mut counts, mut decoded) = (Vec::<([usize; 2], usize)>::new(), 0);
    for &k in order {
        progress.check()?;
        let size = match raster::header_of(&scans[k].path) {
            Some(header) => header.size,
            None if decoded == DECODED => continue,
            None => {
                let Some(size) = decoded_size(&scans[k], progress)? else { continue };
                decoded += 1;
                size
            }
        };
        match counts.iter_mut().find(|(known, _)| *known == size) {
            Some((_, count)) => *count += 1,
            None => counts.push((size, 1)),
        }
    }
    let most = counts.iter().map(|(_, count)| *count).max();
    Ok(counts.into_iter().find(|(_, count)| Some(*count) == most))
}

/// The size of a depth image, by decoding it. `None` of a damaged one.
fn decoded_size(scan: &FileScan, progress: &Progress<'_>) -> Result<Option<[usize; 2]>> {
    let camera = scan.options.camera.map(|camera| Camera { size: None, ..camera });
    let options = Arc::new(ReadOptions { camera, ..scan.options.as_ref().clone() });
    match (FileScan { options, ..scan.clone() }).read_with(&progress.unseen()) {
        Ok(Content::RangeImage(image)) if matches!(image.projection(), Projection::Pinhole { .. }) => {
            Ok(Some([image.cols(), image.rows()]))
        }
        Ok(_) | Err(Error::Format { .. }) => Ok(None),
        Err(other) => Err(other),
    }
}

/// Notes on the coordinate reference systems that the files of scans name, and on those of them that can't be used.
fn notes_on_crs(scans: &[FileScan], progress: &Progress<'_>) -> Result<Vec<String>> {
    let (mut notes, mut known) = (Vec::new(), Vec::<Crs>::new());
    let mut last = None;
    for scan in scans.iter().filter(|scan| !scan.is_frame()) {
        progress.check()?;
        // Several scans of a file lie in one system.
        if last.replace(&scan.path) == Some(&scan.path) {
            continue;
        }
        match scan.named_crs() {
            Ok(Some(crs)) if !known.iter().any(|other| other.is_same(&crs)) => known.push(crs),
            Ok(_) => {}
            Err(error @ Error::Format { .. }) => notes.push(format!("{error}: it is left out")),
            Err(error) => return Err(error),
        }
    }
    let names: Vec<String> = known.iter().map(ToString::to_string).collect();
    match names.as_slice() {
        [] => {}
        [name] => notes.push(format!("coordinates are in {name}")),
        names => notes.push(format!("the scans are in different coordinate reference systems: {}", names.join(", "))),
    }
    Ok(notes)
}

/// Things that hold or list scans.
enum Opening<'a> {
    Recording(&'a frames::Found),
    File { path: &'a Path, role: &'static Role, of_many: bool },
}

impl Opening<'_> {
    fn open(&self, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<ScanSet> {
        match self {
            Opening::Recording(found) => found.open(options, progress),
            Opening::File { path, role: Role::Scans { open, .. }, of_many: false } => open(path, options),
            Opening::File { path, role: Role::Scans { open, .. }, .. } => {
                let mut set = match open(path, options) {
                    // Reading it says the same.
                    Err(Error::Format { .. }) => file::single(path, options)?,
                    opened => opened?,
                };
                set.scans.iter_mut().for_each(|scan| scan.of_many = true);
                Ok(set)
            }
            Opening::File { path, role: Role::List(open), .. } => open(path, options, open_named, progress),
            Opening::File { path, role: Role::Recording(open), .. } => open(path, options, progress),
            Opening::File { .. } => Ok(ScanSet::default()),
        }
    }

    fn path(&self) -> &Path {
        match self {
            Opening::Recording(found) => found.path(),
            Opening::File { path, .. } => path,
        }
    }

    fn is_of(&self, scan: &Path) -> bool {
        matches!(self, Opening::File { path, .. } if *path == scan)
    }
}

/// The one scan of a file that line `line` of the list `list` names.
fn open_named(
    list: &Path,
    line: usize,
    path: &Path,
    options: &Arc<ReadOptions>,
    notes: &mut Vec<String>,
) -> Result<FileScan> {
    let fail = |problem: String| Err(Error::format(list, format!("line {line}"), problem));
    // A list within a list could name itself.
    let Role::Scans { open, .. } = format_of(path)?.role else {
        return fail(format!("{} is a list of scans, but must be a scan", file::name(path)));
    };
    // Reads its header: what is wrong with a file shows now, not in the middle of a merge.
    let mut opened = open(path, options)?;
    notes.append(&mut opened.notes);
    match opened.scans.pop() {
        Some(scan) if opened.scans.is_empty() => Ok(scan),
        _ => fail(format!("{} must hold exactly one scan", known_as(path))),
    }
}

/// Gives scans of one file that have the same name one of their own within it.
fn name_within_files(scans: &mut [FileScan]) {
    let mut parts: FxHashMap<(&Path, &str), Vec<usize>> = FxHashMap::default();
    for (number, scan) in scans.iter().enumerate() {
        parts.entry((&scan.path, &scan.name)).or_default().push(number);
    }
    let mut again: Vec<(usize, usize)> = Vec::new();
    for mut same in parts.into_values().filter(|same| same.len() > 1) {
        same.sort_by_key(|&number| scans[number].part);
        again.extend(same.into_iter().enumerate().skip(1));
    }
    for (place, number) in again {
        scans[number].within = Some(format!("{} ({})", scans[number].name, place + 1));
    }
}

/// Numbers scans of the same name. The order is that of their paths and places, not of their arrival: a name is the same
/// whatever order the files are opened in.
fn make_names_unique(scans: &mut [FileScan]) {
    let mut order: Vec<usize> = (0..scans.len()).collect();
    let pose = |scan: &FileScan| scan.world_from_sensor.to_cols_array().map(f64::to_bits);
    order.sort_by(|&a, &b| {
        let (a, b) = (&scans[a], &scans[b]);
        (&a.name, &a.path, a.part).cmp(&(&b.name, &b.path, b.part)).then_with(|| pose(a).cmp(&pose(b)))
    });
    let mut taken: HashSet<String> = scans.iter().map(|scan| scan.name.clone()).collect();
    let mut same: (String, usize) = (String::new(), 0);
    for i in order {
        if same.1 == 0 || scans[i].name != same.0 {
            same = (scans[i].name.clone(), 1);
            continue;
        }
        while !taken.insert(scans[i].name.clone()) {
            same.1 += 1;
            scans[i].within.get_or_insert_with(|| same.0.clone());
            scans[i].name = format!("{} ({})", same.0, same.1);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use mesh::TriMesh;

    use super::*;
    use crate::import::scan::Content;
    use image::source::ScanSource;

    fn unplaced_in(folder: &Path) -> Result<ScanSet> {
        let taking = Taking { unplaced: true, ..Taking::default() };
        open_as(&[folder], &ReadOptions::default(), taking, &Progress::none())
    }

    const POINT: &str = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nend_header\n0 0 0\n";

    #[test]
    fn names_are_unique_and_do_not_depend_on_the_order() {
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<PathBuf> = ["b/scan.ply", "a/scan.ply", "a/scan (2).ply", "c/scan.ply", "a/other.ply"]
            .iter()
            .map(|name| {
                let path = folder.path().join(name);
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(&path, POINT).unwrap();
                path
            })
            .collect();
        let names = |files: &[PathBuf]| -> Vec<(PathBuf, String)> {
            let mut names: Vec<_> =
                open_many(files).unwrap().scans.into_iter().map(|scan| (scan.path, scan.name)).collect();
            names.sort();
            names
        };
        let expected = names(&files);
        let only: Vec<&str> = expected.iter().map(|n| n.1.as_str()).collect();
        assert_eq!(only, ["other", "scan (2)", "scan", "scan (3)", "scan (4)"]);
        let mut reversed = files.clone();
        reversed.reverse();
        assert_eq!(names(&reversed), expected);
        // The same file twice is two scans.
        let twice = [files[0].clone(), files[0].clone()];
        assert_eq!(names(&twice).iter().map(|n| n.1.as_str()).collect::<Vec<_>>(), ["scan", "scan (2)"]);
    }

    /// Theorem: of a folder with a list the note names the scans that this lacks, and all are opened to be aligned.
    #[test]
    fn a_list_in_a_folder_hides_no_scan_silently() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.ply", "b.ply", "c.ply", "d.ply"] {
            std::fs::write(folder.path().join(name), POINT).unwrap();
        }
        std::fs::write(folder.path().join("notes.txt"), "scanned in May\n").unwrap();
        let list = folder.path().join("set.conf");
        std::fs::write(&list, "bmesh ./a.ply 0 0 0 0 0 0 1\nbmesh c.ply 1 0 0 0 0 0 1\n").unwrap();
        let names = |set: &ScanSet| set.scans.iter().map(|scan| scan.name.clone()).collect::<Vec<_>>();
        let unplaced = || unplaced_in(folder.path()).unwrap();
        let set = open(folder.path()).unwrap();
        assert_eq!(names(&set), ["a", "c"]);
        let note = "2 files of this folder are not in its list set.conf: b.ply, d.ply";
        assert!(set.notes.iter().any(|said| said.ends_with(note)), "{:?}", set.notes);
        let mut all = names(&unplaced());
        all.sort();
        assert_eq!(all, ["a", "b", "c", "d"]);
        assert!(!unplaced().notes.concat().contains("not in its list"));
        // The list alone is what it says.
        assert!(!open(&list).unwrap().notes.concat().contains("not in its list"));
        std::fs::remove_file(folder.path().join("d.ply")).unwrap();
        let notes = open(folder.path()).unwrap().notes.concat();
        assert!(notes.contains("1 file of this folder is not in its list set.conf: b.ply"), "{notes}");
        // Of several lists the user has to choose one, but for aligning.
        std::fs::copy(&list, folder.path().join("again.conf")).unwrap();
        assert!(open(folder.path()).is_err());
        assert_eq!(names(&unplaced()), ["a", "b", "c"]);
        for name in ["set.conf", "again.conf", "notes.txt"] {
            std::fs::remove_file(folder.path().join(name)).unwrap();
        }
        let tum = "# scan \"a\" of \"a.ply\"\n0 1 0 0 0 0 0 1\n# scan \"c\" of \"c.ply\"\n1 1 0 0 0 0 0 1\n";
        std::fs::write(folder.path().join("set.tum"), tum).unwrap();
        let set = open(folder.path()).unwrap();
        assert_eq!(names(&set), ["a", "c"]);
        assert!(set.notes.concat().contains("1 file of this folder is not in its list set.tum: b.ply"));
        assert_eq!(names(&unplaced()), ["a", "b", "c"]);
        assert!(open_many(&[folder.path().join("a.ply"), folder.path().join("set.tum")]).unwrap().notes.len() == 1);
    }

    /// Theorem: a surface that was merged into the folder of its scans is none of them, unless it is named or nothing else is there.
    #[test]
    fn a_merged_surface_in_a_folder_is_no_scan() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a.ply", "b.ply"] {
            std::fs::write(folder.path().join(name), POINT).unwrap();
        }
        let mesh = TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
        let write = |name: &str, command: &str| {
            let said = format!(r#"{{"program": "surfrecon", "version": "1", "command": "{command}", "inputs": []}}"#);
            let provenance = Some(crate::export::Provenance::from_json(&said).unwrap());
            let options = crate::export::WriteOptions { provenance, ..Default::default() };
            crate::export::write_mesh(&folder.path().join(name), &mesh, &[], &options, &Progress::none()).unwrap();
        };
        for ending in ["ply", "obj", "glb"] {
            write(&format!("merged.{ending}"), "merge");
        }
        write("made.ply", "reconstruct");
        let names = |set: &ScanSet| set.scans.iter().map(|scan| scan.name.clone()).collect::<Vec<_>>();
        let said = "3 files of this folder are surfaces that were merged from scans, and are passed over: merged.glb, \
            merged.obj, merged.ply. To open them too, name the files one by one.";
        let unplaced = unplaced_in(folder.path()).unwrap();
        for set in [open(folder.path()).unwrap(), unplaced] {
            assert_eq!(names(&set), ["a", "b", "made"]);
            assert!(set.notes.iter().any(|note| note.ends_with(said)), "{:?}", set.notes);
        }
        assert_eq!(names(&open(&folder.path().join("merged.ply")).unwrap()), ["merged"]);
        for name in ["a.ply", "b.ply", "made.ply"] {
            std::fs::remove_file(folder.path().join(name)).unwrap();
        }
        assert_eq!(open(folder.path()).unwrap().scans.len(), 3);
    }

    /// Theorem: texts of people and logs of programs in a folder are passed over and named. Numbers that are no scan are not.
    #[test]
    fn strays_in_a_folder_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, content: &str| std::fs::write(folder.path().join(name), content).unwrap();
        let names = |set: &ScanSet| set.scans.iter().map(|scan| scan.name.clone()).collect::<Vec<_>>();
        let unplaced = || unplaced_in(folder.path());
        file("README.txt", "Scanned in May 2026.\n3 scans\n");
        // Alone it is what was meant.
        assert!(open(folder.path()).unwrap_err().to_string().contains("README.txt: line 1: expected numbers"));
        for name in ["a.ply", "b.ply"] {
            file(name, POINT);
        }
        for (name, text) in [
            ("README.md", "# Scans\n"),
            ("Thumbs.db", "\u{1}"),
            (".DS_Store", "x"),
            ("camera.log", "12:01 started\n12:02 done\n"),
            ("notes.csv", "name;day\na;May\n"),
            ("empty.xyz", ""),
        ] {
            file(name, text);
        }
        let said = "4 files of this folder hold neither scans nor poses, and are passed over: README.txt, camera.log, \
            empty.xyz, notes.csv";
        for set in [open(folder.path()).unwrap(), unplaced().unwrap()] {
            assert_eq!(names(&set), ["a", "b"]);
            assert!(set.notes.iter().any(|note| note.ends_with(said)), "{:?}", set.notes);
        }
        file("poses.txt", "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n");
        let set = open(folder.path()).unwrap();
        assert_eq!(set.scans[1].world_from_sensor.translation.x, 1.0);
        // A list with a fault is refused, since the scans would lie wrong without it.
        file("poses.log", "0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n");
        std::fs::remove_file(folder.path().join("poses.txt")).unwrap();
        assert!(open(folder.path()).unwrap_err().to_string().contains("poses.log"));
    }

    /// Theorem: of a folder, or of many files, one that is damaged is left out where all are read, at any place where it is damaged. By
    /// itself, or named with others, it is an error.
    #[test]
    fn a_damaged_file_of_many_is_left_out() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["a.ply", "b.ply", "c.ply"].map(|name| folder.path().join(name));
        names.iter().for_each(|name| std::fs::write(name, POINT).unwrap());
        let many = Taking { many: true, ..Taking::default() };
        let as_many = |paths: &[PathBuf]| open_as(paths, &ReadOptions::default(), many, &Progress::none());
        for (damaged, said) in
            [(&POINT[..POINT.len() - 4], "b.ply: "), (&POINT[..50], "the file ends before `end_header`")]
        {
            std::fs::write(&names[1], damaged).unwrap();
            for set in [open(folder.path()).unwrap(), as_many(&names).unwrap()] {
                assert_eq!(set.scans.len(), 3);
                let scan: &dyn ScanSource = &set.scans[1];
                let places = scan.places(&Progress::none()).unwrap();
                assert!(places.positions.is_empty());
                let why = scan.damage().unwrap();
                assert!(why.starts_with("is skipped: ") && why.contains(said), "{why}");
                assert!(set.scans[1].read().unwrap_err().to_string().contains(said));
                assert!(set.scans[0].read().is_ok() && set.scans[0].damage().is_none());
                // A worker would leave it out unseen.
                let kept = set.scans[1].kept().unwrap();
                let again = FileScan::of_kept(&kept, None, &Progress::none()).unwrap();
                assert!(again.places(&Progress::none()).is_err());
            }
            let strict = |opened: Result<ScanSet>| {
                opened.and_then(|set| {
                    let scan = set.scans.into_iter().find(|scan| scan.path == names[1]).unwrap();
                    ScanSource::places(&scan, &Progress::none())
                })
            };
            let failed = [strict(open_many(&names)), strict(open(&names[1])), strict(as_many(&names[1..2]))];
            for outcome in failed {
                assert!(outcome.unwrap_err().to_string().contains(said));
            }
        }
    }

    /// A grey map of 16 bits.
    fn grey(cols: usize, rows: usize) -> Vec<u8> {
        let pixels = (0..cols * rows).flat_map(|k| (1000 + k as u16).to_be_bytes());
        format!("P5\n# depths\n{cols} {rows}\n65535\n").into_bytes().into_iter().chain(pixels).collect()
    }

    /// Theorem: most images say how large the camera's are. A camera's file that says otherwise is refused. The others are skipped by name.
    #[test]
    fn most_depth_images_say_the_size_of_the_cameras() {
        let folder = tempfile::tempdir().unwrap();
        let camera = |size: &str| {
            let text = format!(r#"{{"fx": 5, "fy": 5, "cx": 2, "cy": 1.5{size}}}"#);
            std::fs::write(folder.path().join("camera.json"), text).unwrap();
        };
        for (name, cols) in [("a.pgm", 3), ("b.pgm", 6), ("c.pgm", 6)] {
            std::fs::write(folder.path().join(name), grey(cols, 4)).unwrap();
        }
        let told = |set: &ScanSet| -> Vec<Option<String>> {
            set.scans.iter().map(|scan| scan.read().err().map(|error| error.to_string())).collect()
        };
        for size in ["", r#", "width": 6, "height": 4"#] {
            camera(size);
            let [first, others @ ..] = &told(&open(folder.path()).unwrap())[..] else { panic!() };
            let said = "a.pgm: whole image: 3 x 4 pixels, but the camera's images have 6 x 4: open it apart";
            assert!(first.as_ref().unwrap().contains(said), "{first:?}");
            assert!(others.len() == 2 && others.iter().all(Option::is_none), "{others:?}");
        }
        camera(r#", "width": 640, "height": 480"#);
        let refused = open(folder.path()).unwrap_err().to_string();
        let said = "camera.json: whole file: this camera has images of 640 x 480 pixels, but 2 of 3 depth images have 6 x 4. \
            Write the camera of these images here, with their width and height.";
        assert!(refused.ends_with(said), "{refused}");
        // Of two of which neither is most, the first decides.
        camera("");
        std::fs::remove_file(folder.path().join("c.pgm")).unwrap();
        assert_eq!(told(&open(folder.path()).unwrap()).iter().map(Option::is_none).collect::<Vec<_>>(), [true, false]);
    }

    /// Theorem: pictures and masks beside depth images are passed over and named. By themselves they are what they were.
    #[test]
    fn pictures_beside_depth_images_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let png = |bits: u8, colour: u8| {
            let mut file = b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x06\0\0\0\x04".to_vec();
            file.extend([bits, colour, 0, 0, 0]);
            file
        };
        let file = |name: &str, content: Vec<u8>| std::fs::write(folder.path().join(name), content).unwrap();
        let names = |set: &ScanSet| set.scans.iter().map(|scan| scan.name.clone()).collect::<Vec<_>>();
        file("camera.json", br#"{"fx": 5, "fy": 5, "cx": 2, "cy": 1.5}"#.to_vec());
        for name in ["1.pgm", "2.pgm"] {
            file(name, grey(6, 4));
        }
        file("1_rgb.png", png(8, 2));
        file("2_rgb.png", png(8, 6));
        file("mask.png", png(8, 0));
        // A list that is of the depth images alone fits them.
        file("poses.log", "0 0 1\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n".repeat(2).into_bytes());
        let set = open(folder.path()).unwrap();
        assert_eq!(names(&set), ["1", "2"]);
        let said = "3 images beside depth images hold colours or numbers of 8 bits, and are passed over: 1_rgb.png, \
            2_rgb.png, mask.png";
        assert!(set.notes.iter().any(|note| note == said), "{:?}", set.notes);
        // Files that are named one by one are meant, and say by themselves what is wrong.
        let all = ["1.pgm", "1_rgb.png", "camera.json"].map(|name| folder.path().join(name));
        assert_eq!(open_many(&all).unwrap().scans.len(), 2);
        for name in ["1.pgm", "2.pgm", "poses.log", "1_rgb.png", "2_rgb.png"] {
            std::fs::remove_file(folder.path().join(name)).unwrap();
        }
        assert_eq!(names(&open(folder.path()).unwrap()), ["mask"]);
    }

    /// Theorem: a damaged list of poses beside images without poses is refused as a list, at its line. Alone it is points.
    #[test]
    fn a_damaged_list_beside_images_is_no_scan() {
        let folder = tempfile::tempdir().unwrap();
        let camera = folder.path().join("camera.json");
        std::fs::write(&camera, br#"{"fx": 5, "fy": 5, "cx": 2, "cy": 1.5}"#).unwrap();
        let images = ["1.pgm", "2.pgm"].map(|name| folder.path().join(name));
        images.iter().for_each(|path| std::fs::write(path, grey(6, 4)).unwrap());
        let list = folder.path().join("poses.txt");
        let good = "1 0 0 3 0 1 0 0 0 0 1 0\n";
        for (text, problem) in [
            ("1 0 0 0 0 1 0 0 0 0 -1 0\n".repeat(2), "line 1: the matrix is not a rigid transform"),
            ("2 0 0 0 0 2 0 0 0 0 2 0\n".repeat(2), "line 1: the matrix is not a rigid transform"),
            (format!("1 0 0 nan 0 1 0 0 0 0 1 0\n{good}"), "line 1: "),
            (format!("1 0 0 3 0 1 0 0 0 0 1\n{good}{good}"), "line 1: expected three whole numbers"),
            ("1 0 0 0 0 0 0 1.2\n2 0 0 0 0 0 0 1.2\n".to_owned(), "line 1: the quaternion"),
            ("1 0 0 0 0 0 0 0\n2 0 0 0 0 0 0 0\n".to_owned(), "line 1: the quaternion"),
        ] {
            std::fs::write(&list, &text).unwrap();
            let named = [images[0].clone(), images[1].clone(), camera.clone(), list.clone()];
            for refused in [open_many(&named), open(folder.path())] {
                let refused = refused.unwrap_err().to_string();
                assert!(refused.contains("poses.txt") && refused.contains(problem), "{text}: {refused}");
                assert!(refused.ends_with("If it holds points, open it alone."), "{refused}");
            }
        }
        // Almost of unit length: a list, though its first line does not say so surely.
        std::fs::write(&list, "1 0 0 0 0 0 0 1.009\n2 5 0 0 0 0 0 1\n").unwrap();
        assert_eq!(open(folder.path()).unwrap().scans[1].world_from_sensor.translation.x, 5.0);
        // Points stay what they are.
        std::fs::write(&list, "1 0 0\n2 5 0\n").unwrap();
        assert_eq!(open(folder.path()).unwrap().scans.len(), 3);
    }

    #[test]
    fn reading_counts_bytes_and_can_be_cancelled() {
        let folder = tempfile::tempdir().unwrap();
        let line = "1.5 2.5 3.5\n".repeat(200_000);
        let head = "ply\nformat ascii 1.0\nelement vertex 200000\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
        for (name, text) in [("a.ply", format!("{head}{line}")), ("a.xyz", line.clone())] {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            let scan = FileScan::new(&path);
            let progress = Progress::none();
            assert!(
                matches!(scan.read_with(&progress), Ok(Content::Points(cloud)) if cloud.positions.len() == 200_000)
            );
            assert!(progress.tick().fraction == 1.0 && progress.tick().stage == "reading");
            for checks in 0..5 {
                let outcome = scan.read_with(&Progress::cancel_after(checks));
                assert!(matches!(outcome, Err(Error::Cancelled)), "{name}, {checks}: {outcome:?}");
            }
        }
    }

    #[test]
    fn what_can_not_be_opened_says_why() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, content: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, content).unwrap();
            path
        };
        let refused = |path: &Path| open(path).unwrap_err().to_string();
        let empty = refused(folder.path());
        assert!(empty.contains("there is no scan in this folder: names of scans end in .ply, "), "{empty}");
        std::fs::create_dir(folder.path().join("below")).unwrap();
        file("below/a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n");
        let below = refused(folder.path());
        assert!(below.ends_with(". The folder \"below\" below it has some: open that one."), "{below}");
        assert!(refused(&folder.path().join("none.ply")).starts_with(&folder.path().display().to_string()));
        let unknown = refused(&file("x.bin", "MZ"));
        assert!(
            unknown.contains("known are PLY (range grid, mesh or points): .ply; VRIP list of placed scans: .conf;")
        );
        assert!(refused(&file("empty.ply", "")).contains("must start with a line `ply`"));
        assert!(refused(&file("cut.ply", "ply\nformat ascii 1.0\n")).contains("the file ends before `end_header`"));
        assert!(open_many::<&Path>(&[]).is_err());
        let list = file("s.conf", "bmesh p.ply 0 0 0 0 0 0 1");
        let error = FileScan::new(&list).read().unwrap_err().to_string();
        assert!(error.ends_with("this lists scans and isn't one itself, so open it instead"), "{error}");
        // The content decides, not the name.
        assert_eq!(open(&file("scan.dat", POINT)).unwrap().scans[0].name, "scan");
        let stl = folder.path().join("binary.ply");
        crate::export::write_stl(
            &stl,
            &TriMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], vec![[0, 1, 2]]),
            1.0,
            &Progress::none(),
        )
        .unwrap();
        assert!(matches!(open(&stl).unwrap().scans[0].read().unwrap(), Content::Mesh(_)));
        assert_eq!(refused(Path::new("")), "the name of a file must not be empty");
        let control = refused(&file("bell.ptx", "1\n1\n0 0 x\u{7f}\n"));
        assert!(!control.contains('\u{7f}') && control.contains('\u{fffd}'), "{control}");
        #[cfg(unix)]
        assert!(refused(Path::new("/dev/zero")).ends_with("must be a regular file"));
    }
}
