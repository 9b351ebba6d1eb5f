//! A folder of scans: its only list, or all of its scans.

use std::path::{Path, PathBuf};

use super::file;
use super::registry::{Role, format_of, is_known_by_content, is_sure, scan_endings};
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
    // Of frames the list alone says which images are depths.
    let is_of_frames = |path: &PathBuf| file::name(path).ends_with(".json");
    if unplaced && lists.len() > 1 && !scans.is_empty() && !lists.iter().any(is_of_frames) {
        lists.clear();
        scans.retain(|path| is_sure(path));
    }
    match lists.as_slice() {
        [list] => {
            scans.retain(|path| !is_of_frames(list) && is_sure(path));
            Ok(FolderFiles { list: Some(list.clone()), files: lists, beside: scans })
        }
        [] if scans.is_empty() => Err(no_scan(folder)),
        [] => {
            if unplaced {
                poses.clear();
            }
            let list = if let [list] = poses.as_slice() { Some(list.clone()) } else { None };
            let beside = if list.is_some() { scans.clone() } else { Vec::new() };
            let mut files: Vec<PathBuf> = [scans, others, poses].concat();
            files.sort();
            Ok(FolderFiles { files, list, beside })
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
    let named: Vec<String> = unlisted.iter().take(MOST_NAMED).map(|path| file::name(path)).collect();
    let (list, named) = (file::name(list), named.join(", "));
    let folder = unlisted.first()?.parent().map(|folder| known_as(folder).to_string()).unwrap_or_default();
    Some(match unlisted.len() {
        1 => format!("{folder}: 1 file of this folder is not in its list {list}: {named}"),
        count @ ..=MOST_NAMED => format!("{folder}: {count} files of this folder are not in its list {list}: {named}"),
        count => {
            let more = count - MOST_NAMED;
            format!("{folder}: {count} files of this folder are not in its list {list}: {named}, and {more} more")
        }
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
