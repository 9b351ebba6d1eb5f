//! A folder of scans: its only list, or all of its scans.

use std::path::{Path, PathBuf};

use super::file;
use super::registry::{Role, format_of, is_known_by_content, scan_endings};
use base::error::{Error, Result, known_as};

/// Most names in a folder that are looked at for the words of an error.
const MOST_BELOW: usize = 100;

/// The files of a folder that open as one set: its only list, else all scans and what describes them, by name.
pub(super) fn files_of(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for name in file::names_in(folder)? {
        let path = folder.join(name?);
        if file::is_file(&path) {
            files.push(path);
        }
    }
    files.sort();
    let (mut lists, mut scans, mut any_scan) = (Vec::new(), Vec::new(), false);
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
            Ok(role) => {
                any_scan |= matches!(role, Role::Scans { .. } | Role::Recording(_));
                scans.push(path);
            }
            Err(Error::Format { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    match lists.len() {
        1 => Ok(lists),
        0 if any_scan => Ok(scans),
        0 => Err(no_scan(folder)),
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

/// Whether a folder has a file that is a scan, a list or a recording. What can't be read is none.
fn has_scan(folder: &Path) -> bool {
    let mut paths =
        file::names_in(folder).into_iter().flatten().flatten().take(MOST_BELOW).map(|name| folder.join(name));
    paths.any(|path| {
        let role = || format_of(&path).map(|format| &format.role);
        file::is_file(&path) && matches!(role(), Ok(Role::Scans { .. } | Role::Recording(_)))
    })
}
