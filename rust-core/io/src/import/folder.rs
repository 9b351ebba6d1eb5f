//! A folder of scans: its only list, or all of its scans.

use std::path::{Path, PathBuf};

use super::registry::{Role, format_of, has_numbers, is_known_by_content, is_merged, is_sure, scan_endings};
use super::{file, trajectory};
use base::error::{Error, Result, known_as};

/// Most names in a folder that are looked at for the words of an error.
const MOST_BELOW: usize = 100;

/// Most names of files in a note.
const MOST_NAMED: usize = 10;

/// The files of a folder that open as one set.
pub(super) struct FolderFiles {
    pub(super) files: Vec<PathBuf>,
    /// The list or the trajectory among them.
    pub(super) list: Option<PathBuf>,
    /// Scans that the list may lack.
    pub(super) beside: Vec<PathBuf>,
    /// Notes on files that are passed over.
    pub(super) notes: Vec<String>,
}

/// The files of a folder: its only list, else all scans and what describes them, by name. With `unplaced` no list of poses keeps a scan
/// out, and of several lists none counts.
pub(super) fn files_of(folder: &Path, unplaced: bool) -> Result<FolderFiles> {
    let mut files = Vec::new();
    for name in file::names_in(folder)? {
        let path = folder.join(name?);
        if file::is_file(&path) {
            files.push(path);
        }
    }
    files.sort();
    let (mut lists, mut scans, mut others, mut poses) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for path in files {
        // Poses belong to their scans.
        let name = file::name(&path);
        if name.starts_with('.') || [".xf", ".tf", ".pose.txt"].iter().any(|ending| name.ends_with(ending)) {
            continue;
        }
        match format_of(&path).map(|format| &format.role) {
            // Programs keep notes of their own as JSON: only what it holds makes it a list.
            Ok(Role::List(_)) if name.ends_with(".json") && !is_known_by_content(&path)? => {}
            Ok(Role::List(_)) => lists.push(path),
            Ok(Role::Scans { .. } | Role::Recording(_)) => scans.push(path),
            Ok(Role::Trajectory(_)) => poses.push(path),
            Ok(Role::Camera(_)) => others.push(path),
            Err(Error::Format { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    let merged = merged_among(&mut scans)?;
    let mut notes: Vec<String> = note_merged(folder, &merged).into_iter().collect();
    // Of frames the list alone says which images are depths.
    let is_of_frames = |path: &PathBuf| file::name(path).ends_with(".json");
    if unplaced && lists.len() > 1 && !scans.is_empty() && !lists.iter().any(is_of_frames) {
        lists.clear();
        scans.retain(|path| is_sure(path));
    }
    match lists.as_slice() {
        [list] => {
            scans.retain(|path| !is_of_frames(list) && is_sure(path));
            Ok(FolderFiles { list: Some(list.clone()), files: lists, beside: scans, notes })
        }
        [] if scans.is_empty() => Err(no_scan(folder)),
        [] => {
            notes.extend(note_strays(folder, &strays_among(&mut scans, &mut poses)));
            if unplaced {
                poses.clear();
            }
            let list = if let [list] = poses.as_slice() { Some(list.clone()) } else { None };
            let beside = if list.is_some() { scans.clone() } else { Vec::new() };
            let mut files: Vec<PathBuf> = [scans, others, poses].concat();
            files.sort();
            Ok(FolderFiles { files, list, beside, notes })
        }
        _ => {
            let names: Vec<String> = lists.iter().map(|path| file::name(path)).collect();
            let names = names.join(", ");
            Err(Error::input(format!(
                "{}: this folder has several lists of scans ({names}): choose one of them",
                known_as(folder)
            )))
        }
    }
}

/// Takes surfaces that were merged out of the scans: a merge into the folder of its scans would else be one of them the next time. Where
/// all are such surfaces, they are what is meant.
fn merged_among(scans: &mut Vec<PathBuf>) -> Result<Vec<PathBuf>> {
    let mut merged = Vec::new();
    for path in scans.iter() {
        if is_merged(path)? {
            merged.push(path.clone());
        }
    }
    if merged.len() == scans.len() {
        merged.clear();
    }
    scans.retain(|path| !merged.contains(path));
    Ok(merged)
}

/// Takes texts out that end like scans or lists of poses and hold none: notes of people, logs of programs. One of numbers stays, whatever is
/// wrong with it, and scans stay where nothing else is there: their readers say what is wrong.
fn strays_among(scans: &mut Vec<PathBuf>, poses: &mut Vec<PathBuf>) -> Vec<PathBuf> {
    let is_stray = |path: &PathBuf| !is_sure(path) && !has_numbers(path);
    let mut strays: Vec<PathBuf> = scans.iter().filter(|path| is_stray(path)).cloned().collect();
    if strays.len() == scans.len() {
        return Vec::new();
    }
    let is_log = |path: &&PathBuf| {
        let is_known = trajectory::is_named_so(path) || is_known_by_content(path).unwrap_or(true);
        !is_known && !has_numbers(path)
    };
    strays.extend(poses.iter().filter(is_log).cloned());
    scans.retain(|path| !strays.contains(path));
    poses.retain(|path| !strays.contains(path));
    strays.sort();
    strays
}

fn note_strays(folder: &Path, strays: &[PathBuf]) -> Option<String> {
    let (shown, named) = (known_as(folder), named(strays)?);
    Some(match strays.len() {
        1 => format!("{shown}: 1 file of this folder holds neither a scan nor poses, and is passed over: {named}"),
        count => {
            format!("{shown}: {count} files of this folder hold neither scans nor poses, and are passed over: {named}")
        }
    })
}

fn note_merged(folder: &Path, merged: &[PathBuf]) -> Option<String> {
    let (shown, named) = (known_as(folder), named(merged)?);
    Some(match merged.len() {
        1 => format!(
            "{shown}: 1 file of this folder is a surface that was merged from scans, and is passed over: {named}. To open \
                it too, name the files one by one."
        ),
        count => format!(
            "{shown}: {count} files of this folder are surfaces that were merged from scans, and are passed over: {named}. To \
                open them too, name the files one by one."
        ),
    })
}

/// The names of files, for a note. `None` of none.
pub(super) fn named<P: AsRef<Path>>(files: &[P]) -> Option<String> {
    let first: Vec<String> = files.iter().take(MOST_NAMED).map(|path| file::name(path.as_ref())).collect();
    let first = first.join(", ");
    match files.len() {
        0 => None,
        1..=MOST_NAMED => Some(first),
        count => Some(format!("{first}, and {} more", count - MOST_NAMED)),
    }
}

/// The error of a folder without a scan: endings that are read, and folders below it that hold scans.
fn no_scan(folder: &Path) -> Error {
    let shown = known_as(folder);
    let endings: Vec<&str> = scan_endings().collect();
    let known = format!("{shown}: there is no scan in this folder: names of scans end in .{}", endings.join(", ."));
    let mut below: Vec<String> = file::names_in(folder)
        .into_iter()
        .flatten()
        .flatten()
        .take(MOST_BELOW)
        .filter(|name| has_scan(&folder.join(name)))
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    below.sort();
    Error::input(match below.as_slice() {
        [] => known,
        [first, others @ ..] => {
            let more = if others.is_empty() { String::new() } else { format!(" and {} more", others.len()) };
            format!("{known}. The folder {first:?}{more} below it has some: open that one.")
        }
    })
}

/// The note that a list in a folder lacks scans of it.
pub(super) fn note_unlisted(list: &Path, unlisted: &[&Path]) -> Option<String> {
    let (list, named) = (file::name(list), named(unlisted)?);
    let folder = unlisted.first()?.parent().map(|folder| known_as(folder).to_string()).unwrap_or_default();
    Some(match unlisted.len() {
        1 => format!("{folder}: 1 file of this folder is not in its list {list}: {named}"),
        count => format!("{folder}: {count} files of this folder are not in its list {list}: {named}"),
    })
}

/// Whether a folder has a file that is a scan, a list or a recording. What can't be read is none.
fn has_scan(folder: &Path) -> bool {
    let mut paths =
        file::names_in(folder).into_iter().flatten().flatten().take(MOST_BELOW).map(|name| folder.join(name));
    paths.any(|path| {
        let role = || format_of(&path).map(|format| &format.role);
        file::is_file(&path) && matches!(role(), Ok(Role::Scans { .. } | Role::Recording(_)))
    })
}
