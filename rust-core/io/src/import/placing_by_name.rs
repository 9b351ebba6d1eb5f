//! The pose of each scan that a list names. Files decide where they can, else names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DAffine3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::file;
use super::listed_scan::ListedScan;
use super::scan::FileScan;
use base::error::{Error, Result, counted, known_as};
use base::log::{self, Level};

/// Places scans by a list whose poses are of those scans. Notes that say how. Scans without a pose are passed over.
///
/// # Errors
/// A name that several poses or scans have where files do not decide. Two poses of one scan. No scan that has a pose.
pub(super) fn by_names(
    poses: &[DAffine3],
    listed: &[ListedScan],
    scans: &mut Vec<FileScan>,
    path: &Path,
) -> Result<Vec<String>> {
    let fail = |problem: String| Err(Error::format(path, "whole file", problem));
    let files = Files::of(listed, scans, path);
    let mut pose_of: FxHashMap<usize, DAffine3> = FxHashMap::default();
    // Those that names place.
    let mut rest: Vec<usize> = Vec::new();
    if files.decide {
        let mut scan_of: FxHashMap<(&Path, &str), usize> = FxHashMap::default();
        for (number, scan) in scans.iter().enumerate() {
            scan_of.insert((&files.opened[number], scan.own_name()), number);
        }
        for (pose, scan) in listed.iter().enumerate() {
            let Some(named) = &files.named[pose] else {
                rest.push(pose);
                continue;
            };
            let Some(&number) = scan_of.get(&(named.as_path(), scan.name.as_str())) else { continue };
            if pose_of.insert(number, poses[pose]).is_some() {
                return fail(format!("{} has two poses: take one of them out", scan.comment()));
            }
        }
    } else {
        rest.extend(0..listed.len());
    }
    let mut first: Option<[usize; 2]> = None;
    let mut groups: BTreeMap<&str, [Vec<usize>; 2]> = BTreeMap::new();
    for pose in rest {
        groups.entry(&listed[pose].name).or_default()[0].push(pose);
    }
    for (number, scan) in scans.iter().enumerate().filter(|(number, _)| !pose_of.contains_key(number)) {
        if let Some(group) = groups.get_mut(scan.own_name()) {
            group[1].push(number);
        }
    }
    for (name, [of_name, named]) in &groups {
        match (of_name.as_slice(), named.as_slice()) {
            ([pose], [scan]) => {
                pose_of.insert(*scan, poses[*pose]);
                first = first.or_else(|| files.named[*pose].is_some().then_some([*pose, *scan]));
            }
            (_, []) => {}
            _ => {
                return fail(format!(
                    "{:?} is the name of {} and of {}, and no file tells which belong together. Open the files that \
                        the list names, such as {}.",
                    name,
                    counted(of_name.len() as u64, "pose", "poses"),
                    counted(named.len() as u64, "scan", "scans"),
                    shown(&listed[of_name[0]])
                ));
            }
        }
    }
    if pose_of.is_empty() {
        let (list, opened) = (shown(&listed[0]), known_as(&scans[0].path));
        let problem = format!("no scan that is opened has a pose here: the list is of {list}, but {opened} is opened");
        return fail(if files.decide {
            format!("{problem}. Its files are found from its own folder: if it was moved, put it back.")
        } else {
            problem
        });
    }
    let elsewhere = first.map(|[pose, scan]| {
        let there = files.named[pose].as_deref().filter(|named| is_there(named));
        let opened = known_as(&scans[scan].path).to_string();
        there.map(|_| (known_as(&file_of(path, &listed[pose])).to_string(), opened))
    });
    let all = scans.len();
    let [placed, lost] = keep(scans, &pose_of);
    let said = format!("{}: placed {} by name", file::name(path), counted(placed as u64, "scan", "scans"));
    let mut notes = vec![match lost {
        0 => said,
        1 => format!("{said}, and 1 of {all} has no pose and is passed over"),
        _ => format!("{said}, and {lost} of {all} have no pose and are passed over"),
    }];
    let list = file::name(path);
    match elsewhere {
        None => {}
        Some(None) => {
            notes.push(format!("{list}: the files that the list names are not there: poses are matched by name alone"))
        }
        Some(Some((listed, opened))) => {
            let told = format!(
                "{list}: the list is of {listed}, and the scans of the same names are of {opened}: check that these are the same"
            );
            log::tell(Level::Warning, &told);
            notes.push(told);
        }
    }
    Ok(notes)
}

/// Leaves the scans that have a pose, with it. How many these are, and how many have none.
pub(super) fn keep(scans: &mut Vec<FileScan>, pose_of: &FxHashMap<usize, DAffine3>) -> [usize; 2] {
    let (all, mut number) = (scans.len(), 0);
    scans.retain_mut(|scan| {
        let pose = pose_of.get(&number);
        number += 1;
        scan.world_from_sensor = pose.copied().unwrap_or_default();
        pose.is_some()
    });
    [scans.len(), all - scans.len()]
}

/// The files of a list and of scans.
struct Files {
    /// That of each pose.
    named: Vec<Option<PathBuf>>,
    /// That of each scan.
    opened: Vec<PathBuf>,
    /// Whether a pose is of the scan of its file alone: of another file the same name may be another scan's.
    decide: bool,
}

impl Files {
    fn of(listed: &[ListedScan], scans: &[FileScan], list: &Path) -> Files {
        let mut whole = Whole::default();
        let named: Vec<Option<PathBuf>> =
            listed.iter().map(|scan| (!scan.file.is_empty()).then(|| whole.path(&file_of(list, scan)))).collect();
        let opened: Vec<PathBuf> = scans.iter().map(|scan| whole.path(&scan.path)).collect();
        let is_opened: FxHashSet<&Path> = opened.iter().map(PathBuf::as_path).collect();
        let of_poses = || named.iter().flatten().map(PathBuf::as_path);
        let files: FxHashSet<&Path> = of_poses().collect();
        let folders: FxHashSet<Option<&Path>> = files.iter().map(|file| file.parent()).collect();
        // Files of one scan each are one recording. Files of many are several.
        let are_several = folders.len() > 1 || (files.len() > 1 && files.len() < of_poses().count());
        let decide = are_several || files.iter().any(|file| is_opened.contains(file));
        Files { named, opened, decide }
    }
}

/// Absolute paths without links. Each folder is asked for once: recordings have many files.
#[derive(Default)]
struct Whole(FxHashMap<PathBuf, PathBuf>);

impl Whole {
    fn path(&mut self, file: &Path) -> PathBuf {
        let (Some(folder), Some(name)) = (file.parent(), file.file_name()) else { return file.to_owned() };
        if let Some(known) = self.0.get(folder) {
            return known.join(name);
        }
        let whole = whole(folder);
        let path = whole.join(name);
        self.0.insert(folder.to_owned(), whole);
        path
    }
}

/// The absolute path without links, as far as the path is there: names in archives are not.
fn whole(folder: &Path) -> PathBuf {
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let there = absolute.ancestors().find_map(|above| Some((above, above.canonicalize().ok()?)));
    there.map_or_else(
        || absolute.clone(),
        |(above, known)| known.join(absolute.strip_prefix(above).unwrap_or(Path::new(""))),
    )
}

/// The file that a line names: within the list's folder, or absolute.
fn file_of(list: &Path, listed: &ListedScan) -> PathBuf {
    list.parent().unwrap_or(Path::new("")).join(&*listed.plain_file())
}

/// Whether there is a file, or the archive that it is in.
fn is_there(path: &Path) -> bool {
    path.ancestors().any(file::is_file)
}

/// A scan as an error names it.
fn shown(listed: &ListedScan) -> String {
    listed.comment().trim_start_matches("# ").to_owned()
}
