//! Opening: files and folders as one set of scans.

use std::collections::{HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::options::ReadOptions;
use super::registry::{Role, format_of};
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
    open_as(paths, options, false, progress)
}

/// Opens files as [`open_with`] does, to be aligned: of a folder all scans, whatever list of poses lies in it.
///
/// # Errors
/// As [`open_with`].
pub fn open_unplaced<P: AsRef<Path>>(paths: &[P], options: &ReadOptions, progress: &Progress<'_>) -> Result<ScanSet> {
    open_as(paths, options, true, progress)
}

fn open_as<P: AsRef<Path>>(
    paths: &[P],
    options: &ReadOptions,
    unplaced: bool,
    progress: &Progress<'_>,
) -> Result<ScanSet> {
    options.validate()?;
    let paths: Vec<&Path> = paths.iter().map(AsRef::as_ref).collect();
    progress.watch(|| open_listed(&listed(&paths, unplaced, progress)?, options, progress))
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
    File(PathBuf),
    /// The list in a folder, and scans of this that it may lack.
    List {
        path: PathBuf,
        beside: Vec<PathBuf>,
        /// Whether those that it lacks are opened, too.
        with_others: bool,
    },
}

pub(super) fn listed(paths: &[&Path], unplaced: bool, progress: &Progress<'_>) -> Result<Vec<Listed>> {
    let mut listed = Vec::new();
    for &path in paths {
        if !file::is_dir(path) {
            listed.push(Listed::File(path.to_owned()));
        } else if let Some(found) = frames::find(path, progress)? {
            listed.push(Listed::Recording(found));
        } else {
            let folder::FolderFiles { files, list, mut beside } = folder::files_of(path, unplaced)?;
            listed.extend(files.into_iter().map(|path| match &list {
                Some(list) if *list == path => {
                    Listed::List { path, beside: std::mem::take(&mut beside), with_others: unplaced }
                }
                _ => Listed::File(path),
            }));
        }
    }
    Ok(listed)
}

pub(super) fn open_listed(listed: &[Listed], options: &ReadOptions, progress: &Progress<'_>) -> Result<ScanSet> {
    let mut all = ScanSet::default();
    let mut options = options.clone();
    let mut poses: Option<(&Path, trajectory::Trajectory)> = None;
    let mut opens: Vec<Opening<'_>> = Vec::new();
    for one in listed {
        progress.check()?;
        let path = match one {
            Listed::Recording(found) => {
                opens.push(Opening::Recording(found));
                continue;
            }
            Listed::File(path) | Listed::List { path, .. } => path.as_path(),
        };
        let role = &format_of(path)?.role;
        match role {
            Role::Camera(read) => {
                let camera = read(path)?;
                if options.camera.is_some_and(|other| other != camera) {
                    return Err(Error::input(format!("{}: there is another camera already: give one", known_as(path))));
                }
                options.camera = Some(camera);
            }
            Role::Trajectory(read) => {
                let mut found = read(path)?;
                found.as_told(&options);
                if let Some((other, _)) = poses.replace((path, found)) {
                    let problem = format!("{} is a trajectory too: give one", known_as(other));
                    return Err(Error::input(format!("{}: {problem}", known_as(path))));
                }
            }
            Role::Scans { .. } | Role::List(_) | Role::Recording(_) => opens.push(Opening::File(path, role)),
        }
    }
    if opens.is_empty() {
        return Err(Error::input(match listed {
            [Listed::File(first) | Listed::List { path: first, .. }, ..] => {
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
            opens.push_front(Opening::File(path, &format_of(path)?.role));
        }
        all.scans.append(&mut set.scans);
        all.notes.append(&mut set.notes);
    }
    name_within_files(&mut all.scans);
    let is_of_no_poses = |note: &String| note.ends_with(frames::WITHOUT_POSES);
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
    give_camera_a_size(&mut all.scans, progress)?;
    make_names_unique(&mut all.scans);
    all.notes.extend(notes_on_crs(&all.scans, progress)?);
    Ok(all)
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

/// A camera of unknown size is of the size of the first depth image, by its path: so an image of another size is told from the others.
fn give_camera_a_size(scans: &mut [FileScan], progress: &Progress<'_>) -> Result<()> {
    let lacks = |scan: &FileScan| {
        !scan.is_frame() && scan.is_depth_image() && scan.options.camera.is_some_and(|camera| camera.size.is_none())
    };
    let mut order: Vec<usize> = (0..scans.len()).filter(|&k| lacks(&scans[k])).collect();
    if order.len() < 2 {
        return Ok(());
    }
    order.sort_by(|&a, &b| scans[a].path.cmp(&scans[b].path));
    let mut given: Option<Arc<ReadOptions>> = None;
    for &k in &order {
        progress.check()?;
        let size = match scans[k].read_with(&progress.unseen()) {
            Ok(Content::RangeImage(image)) if matches!(image.projection(), Projection::Pinhole { .. }) => {
                [image.cols(), image.rows()]
            }
            Ok(_) | Err(Error::Format { .. }) => continue,
            Err(other) => return Err(other),
        };
        let camera = scans[k].options.camera.map(|camera| Camera { size: Some(size), ..camera });
        given = Some(Arc::new(ReadOptions { camera, ..scans[k].options.as_ref().clone() }));
        break;
    }
    let Some(given) = given else { return Ok(()) };
    for k in order {
        scans[k].options = given.clone();
    }
    Ok(())
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
    File(&'a Path, &'static Role),
}

impl Opening<'_> {
    fn open(&self, options: &Arc<ReadOptions>, progress: &Progress<'_>) -> Result<ScanSet> {
        match self {
            Opening::Recording(found) => found.open(options, progress),
            Opening::File(path, Role::Scans { open, .. }) => open(path, options),
            Opening::File(path, Role::List(open)) => open(path, options, open_named, progress),
            Opening::File(path, Role::Recording(open)) => open(path, options, progress),
            Opening::File(..) => Ok(ScanSet::default()),
        }
    }

    fn path(&self) -> &Path {
        match self {
            Opening::Recording(found) => found.path(),
            Opening::File(path, _) => path,
        }
    }

    fn is_of(&self, scan: &Path) -> bool {
        matches!(self, Opening::File(path, _) if *path == scan)
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
        let unplaced = || open_unplaced(&[folder.path()], &ReadOptions::default(), &Progress::none()).unwrap();
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
