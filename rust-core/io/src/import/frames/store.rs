//! Storage of a recording's files: in a folder, or in an archive that is never unpacked. Names are those within it, with `/` between
//! folders. A name that is not UTF-8 is none of a layout's and stays unseen.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use super::super::options::ReadOptions;
use super::super::{conf, file};
use crate::import::archive::Archive;
use base::error::{Error, Result};
use base::progress::Progress;

/// Longest text that a layout has: poses of a hundred thousand frames.
const LONGEST_TEXT: u64 = 1 << 27;

/// Entries of a folder between two looks at the progress.
const ENTRIES: usize = 1000;

/// Files of a recording.
#[derive(Debug)]
pub(super) struct Store {
    /// The folder, the archive, or the one file.
    pub(super) path: PathBuf,
    archive: Option<Archive>,
    /// Names of files and folders at the top.
    top: BTreeSet<String>,
}

/// Places of the bytes of an image.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Place {
    /// A file of the store.
    Named(Box<str>),
    /// So many bytes from here on in the one file.
    Span { at: u64, bytes: u64 },
}

/// Whether a file of this name only says something of others: `README.md`, `LICENSE`.
fn is_about(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default().to_ascii_lowercase();
    ["readme", "license", "licence", "copying"].contains(&stem.as_str())
}

/// Whether a system put a file of this name there, not who recorded.
fn is_of_system(name: &str) -> bool {
    name.starts_with('.') || ["__MACOSX", "Thumbs.db", "desktop.ini"].contains(&name)
}

impl Store {
    /// The files of a folder.
    pub(super) fn folder(path: &Path, progress: &Progress<'_>) -> Result<Store> {
        let mut store = Store { path: path.to_owned(), archive: None, top: BTreeSet::new() };
        store.top = store.list("", progress)?;
        Ok(store)
    }

    /// The files of a zip archive.
    pub(super) fn archive(path: &Path, progress: &Progress<'_>) -> Result<Store> {
        let archive = Archive::open(path, progress)?;
        let store = Store { path: path.to_owned(), archive: Some(archive), top: BTreeSet::new() };
        Ok(Store { top: store.list("", progress)?, ..store })
    }

    /// The content of the only folder at the top, if there is one. Programs that pack or unpack a recording put it there, and people put
    /// their notes beside it.
    pub(super) fn only_folder(&self, progress: &Progress<'_>) -> Result<Option<Store>> {
        let mut names = self.top().filter(|name| !is_about(name));
        let (Some(name), None) = (names.next(), names.next()) else { return Ok(None) };
        match &self.archive {
            Some(archive) => {
                let archive = archive.inner(name);
                let top = archive.list("");
                Ok((!top.is_empty()).then(|| Store { path: self.path.join(name), archive: Some(archive), top }))
            }
            None if file::is_dir(&self.path.join(name)) => Store::folder(&self.path.join(name), progress).map(Some),
            None => Ok(None),
        }
    }

    /// The reason that keeps files from being seen, with the remedy.
    pub(super) fn hidden(&self) -> Option<String> {
        self.archive.as_ref().and_then(Archive::hidden)
    }

    /// One file that holds all.
    pub(super) fn file(path: &Path) -> Store {
        Store { path: path.to_owned(), archive: None, top: BTreeSet::new() }
    }

    /// Whether there is a file or a folder of this name, which may lead through folders.
    pub(super) fn has(&self, name: &str) -> bool {
        match &self.archive {
            Some(archive) => archive.has(name),
            None if name.contains('/') => {
                let path = self.path.join(name);
                file::is_file(&path) || file::is_dir(&path)
            }
            None => self.top.contains(name),
        }
    }

    /// Files and folders at the top.
    pub(super) fn top(&self) -> impl Iterator<Item = &str> {
        self.top.iter().map(String::as_str)
    }

    /// The files and folders of a folder. None if it is not there.
    pub(super) fn list(&self, folder: &str, progress: &Progress<'_>) -> Result<BTreeSet<String>> {
        if let Some(archive) = &self.archive {
            return Ok(archive.list(folder).into_iter().filter(|name| !is_of_system(name)).collect());
        }
        let path = self.path_of(folder);
        let mut names = BTreeSet::new();
        if !file::is_dir(&path) {
            return Ok(names);
        }
        for (i, name) in file::names_in(&path)?.enumerate() {
            if i % ENTRIES == 0 {
                progress.check()?;
            }
            let name = name?.into_string().ok();
            names.extend(name.filter(|name| !is_of_system(name)));
        }
        Ok(names)
    }

    /// The file for people and for errors.
    pub(super) fn path_of(&self, name: &str) -> PathBuf {
        if name.is_empty() { self.path.clone() } else { self.path.join(name) }
    }

    /// The file that holds a place.
    pub(super) fn path_at(&self, place: &Place) -> PathBuf {
        match place {
            Place::Named(name) => self.path_of(name),
            Place::Span { .. } => self.path.clone(),
        }
    }

    /// The last bytes of a file, at most so many, and its length. `None` if it is not there. Of an archive's file only the length is known:
    /// its sum is checked when it is unpacked.
    pub(super) fn end_of(
        &self,
        name: &str,
        count: u64,
        progress: &Progress<'_>,
    ) -> Result<Option<(Option<Vec<u8>>, u64)>> {
        if let Some(archive) = &self.archive {
            return Ok(archive.length(name).map(|length| (None, length)));
        }
        let path = self.path_of(name);
        if !file::is_file(&path) {
            return Ok(None);
        }
        let (file, length) = file::open_bytes(&path)?;
        let count = count.min(length);
        Ok(Some((Some(file::taken(file, length - count, count, &path, progress)?), length)))
    }

    /// The bytes of a place, at most `most`.
    pub(super) fn bytes(&self, place: &Place, most: u64, progress: &Progress<'_>) -> Result<Vec<u8>> {
        match (place, &self.archive) {
            (Place::Named(name), Some(archive)) => archive.read(name, most, progress),
            (Place::Named(name), None) => {
                let path = self.path_of(name);
                let (file, length) = file::open_bytes(&path)?;
                file::taken(file, 0, length, &path, progress)
            }
            (&Place::Span { at, bytes }, _) => {
                let (file, length) = file::open_bytes(&self.path)?;
                if at.checked_add(bytes).is_none_or(|end| end > length) {
                    return Err(Error::format(&self.path, format!("byte {at}"), "the file ends within a frame"));
                }
                file::taken(file, at, bytes, &self.path, progress)
            }
        }
    }

    /// The first bytes of a place, at most `count`. Of an archive's file all: its sum is checked when it is unpacked.
    pub(super) fn start_of(&self, place: &Place, count: u64, most: u64, progress: &Progress<'_>) -> Result<Vec<u8>> {
        match (place, &self.archive) {
            (Place::Named(name), None) => {
                let path = self.path_of(name);
                let (file, length) = file::open_bytes(&path)?;
                file::taken(file, 0, length.min(count), &path, progress)
            }
            (&Place::Span { at, bytes }, None) => {
                self.bytes(&Place::Span { at, bytes: bytes.min(count) }, most, progress)
            }
            _ => self.bytes(place, most, progress),
        }
    }

    /// The text of a file.
    pub(super) fn text(&self, name: &str, progress: &Progress<'_>) -> Result<String> {
        let bytes = self.bytes(&Place::Named(name.into()), LONGEST_TEXT, progress)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| Error::format(&self.path_of(name), "whole file", "this is not text (UTF-8)"))?;
        Ok(match text.strip_prefix('\u{feff}') {
            Some(rest) => rest.to_owned(),
            None => text,
        })
    }

    /// The text of a file beside the folder, if it is there, and its path. Beside an archive lies nothing of it.
    pub(super) fn beside(&self, name: &str) -> Result<(Option<String>, PathBuf)> {
        let path = self.path.join("..").join(name);
        if self.archive.is_some() || !file::is_file(&path) {
            return Ok((None, path));
        }
        let text = String::from_utf8(file::read(&path)?)
            .map_err(|_| Error::format(&path, "whole file", "this is not text (UTF-8)"))?;
        Ok((Some(text), path))
    }

    /// The name within the store of a file that a list at the top names. Refused where it leads out.
    pub(super) fn inside(&self, name: &str, options: &ReadOptions) -> Result<Box<str>, String> {
        let name = name.strip_prefix("./").unwrap_or(name);
        // Some programs write where it lay when they wrote.
        let below = Path::new(name).strip_prefix(&self.path).ok().and_then(Path::to_str);
        let name = below.filter(|below| !below.is_empty()).unwrap_or(name);
        if self.archive.is_none() {
            conf::named(&self.path, name, options)?;
        }
        Ok(name.replace('\\', "/").into())
    }
}
