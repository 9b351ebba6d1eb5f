//! Files that appear whole or not at all.

use std::fs::{File, Metadata, Permissions};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::names;
use super::temporary::Temporary;
use crate::memory_folder::{self, Writing};
use base::error::{Error, Result, known_as};
use base::progress::Progress;

/// The temporary file, or one in memory. Every writer hands its bytes through this one type, so that a test can make any write fail.
pub(crate) enum Output<'a> {
    File(&'a File),
    InMemory(&'a mut Writing),
}

impl Output<'_> {
    /// Takes so many bytes of the disk for the file, which then has that length, where the system can do that: a full disk is found out
    /// before the work. Elsewhere the file has that length alone.
    pub(crate) fn reserve(&self, bytes: u64) -> std::io::Result<()> {
        match self {
            Output::File(file) => reserve(file, bytes),
            Output::InMemory(_) => Ok(()),
        }
    }
}

#[cfg(target_os = "linux")]
fn reserve(file: &File, bytes: u64) -> std::io::Result<()> {
    use rustix::fs::{FallocateFlags, fallocate};
    let taken = rustix::io::retry_on_intr(|| fallocate(file, FallocateFlags::empty(), 0, bytes));
    match taken.map_err(std::io::Error::from) {
        Err(error) if matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded) => Err(error),
        // Not every file system takes room beforehand.
        Err(_) => file.set_len(bytes),
        Ok(()) => Ok(()),
    }
}

#[cfg(not(target_os = "linux"))]
fn reserve(file: &File, bytes: u64) -> std::io::Result<()> {
    file.set_len(bytes)
}

impl Write for Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        #[cfg(test)]
        let bytes = super::faults::write(bytes)?;
        match self {
            Output::File(file) => file.write(bytes),
            Output::InMemory(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        match self {
            Output::File(file) => file.flush(),
            Output::InMemory(file) => file.flush(),
        }
    }
}

impl Read for Output<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Output::File(file) => file.read(buffer),
            Output::InMemory(file) => file.read(buffer),
        }
    }
}

impl Seek for Output<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        match self {
            Output::File(file) => file.seek(to),
            Output::InMemory(file) => file.seek(to),
        }
    }
}

/// A file that is written but doesn't have its name yet. Dropped, it is gone.
pub(crate) struct Staged {
    file: Unnamed,
    path: PathBuf,
}

enum Unnamed {
    Temporary(Temporary),
    InMemory(Writing),
}

impl Staged {
    /// Gives the file its name, replacing one that has it.
    pub(crate) fn keep(self) -> Result<()> {
        let Staged { file, path } = self;
        match file {
            Unnamed::Temporary(file) => file.persist(&path, folder_of(&path)).map_err(open_elsewhere),
            Unnamed::InMemory(file) => file.keep(),
        }
        .map_err(|e| Error::io(&path, e))
    }

    /// Closes the file: a set of files may be larger than the number of files that may be open.
    pub(crate) fn closed(self) -> Result<Self> {
        let Staged { file, path } = self;
        let file = match file {
            Unnamed::Temporary(file) => {
                Unnamed::Temporary(file.closed(folder_of(&path)).map_err(|e| Error::io(&path, e))?)
            }
            in_memory => in_memory,
        };
        Ok(Staged { file, path })
    }
}

/// Files of a set that are kept open until all are written, which leaves nothing of them if the writer is killed: many
/// fewer than a process may have open.
const OPEN: usize = 100;

/// Files that get their names together.
#[derive(Default)]
pub(crate) struct StagedSet(Vec<Staged>);

impl StagedSet {
    pub(crate) fn add(&mut self, file: Staged) -> Result<()> {
        self.0.push(if self.0.len() < OPEN { file } else { file.closed()? });
        Ok(())
    }

    /// Gives the files their names, in the order in which they were added.
    pub(crate) fn keep(self) -> Result<()> {
        self.0.into_iter().try_for_each(Staged::keep)
    }
}

/// On Windows a file that a program has open can't be replaced, and the system does not say why.
fn open_elsewhere(error: std::io::Error) -> std::io::Error {
    if cfg!(windows) && error.kind() == ErrorKind::PermissionDenied {
        let words = format!("{error}: if another program has the file open, close it there, or choose another name");
        return std::io::Error::new(ErrorKind::PermissionDenied, words);
    }
    error
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Lets `write` fill a temporary file in the folder of `path` and gives it that name at the end, replacing a file that has it. `progress`
/// is reported meanwhile. On any error (a cancelled call among them) nothing is left and a file that was there is untouched.
///
/// A link is followed, and the replaced file's permissions are kept. A file with other names (hard links) is refused: they
/// would keep the old content, or lose it to a write that fails halfway.
///
/// The data is handed to the system but not forced to the disk: after a crash of the machine the file may be short.
///
/// # Errors
/// [`Error::Io`] if the file can't be made, or is there and read-only. [`Error::Input`] for a folder, a device or a file with several
/// names. Or the error that `write` returns.
pub(crate) fn write_atomically(
    path: &Path,
    progress: &Progress<'_>,
    write: impl FnOnce(&mut Output<'_>) -> Result<()> + Send,
) -> Result<()> {
    stage(path, progress, write)?.keep()
}

/// As [`write_atomically`], up to the name: for files that appear together.
pub(crate) fn stage(
    path: &Path,
    progress: &Progress<'_>,
    write: impl FnOnce(&mut Output<'_>) -> Result<()> + Send,
) -> Result<Staged> {
    staged(path, false, progress, write)
}

/// As [`write_atomically`], where `write` goes back in what it has written.
pub(crate) fn write_atomically_back_and_forth(
    path: &Path,
    progress: &Progress<'_>,
    write: impl FnOnce(&mut Output<'_>) -> Result<()> + Send,
) -> Result<()> {
    stage_back_and_forth(path, progress, write)?.keep()
}

/// As [`stage`], where `write` goes back in what it has written.
pub(crate) fn stage_back_and_forth(
    path: &Path,
    progress: &Progress<'_>,
    write: impl FnOnce(&mut Output<'_>) -> Result<()> + Send,
) -> Result<Staged> {
    staged(path, true, progress, write)
}

fn staged(
    path: &Path,
    goes_back: bool,
    progress: &Progress<'_>,
    write: impl FnOnce(&mut Output<'_>) -> Result<()> + Send,
) -> Result<Staged> {
    if let Some(place) = memory_folder::place_of(path) {
        if place.is_dir() {
            return Err(is_folder(path));
        }
        let mut file = place.write(goes_back)?;
        progress.watch(|| write(&mut Output::InMemory(&mut file)))?;
        return Ok(Staged { file: Unnamed::InMemory(file), path: path.to_owned() });
    }
    if path.file_name().is_none() || path.is_dir() {
        return Err(is_folder(path));
    }
    // The file that a link leads to is what gets written, as with any program.
    let place = if path.is_symlink() { linked(path)? } else { path.to_owned() };
    if cfg!(windows)
        && let Some(why) = place.file_name().and_then(|name| name.to_str()).and_then(names::forbidden)
    {
        return Err(Error::input(format!("{}: {why}: choose another name", known_as(path))));
    }
    let older = older(path, &place)?;
    let folder = folder_of(&place);
    if !folder.is_dir() {
        let problem = format!("there is no folder {}: make it first", known_as(folder));
        let error = std::io::Error::new(ErrorKind::NotFound, problem);
        return Err(Error::io(path, memory_folder::explained(path, error)));
    }
    let temporary = Temporary::new(folder, older).map_err(|e| Error::io(path, e))?;
    if let Some(file) = temporary.file() {
        progress.watch(|| write(&mut Output::File(file)))?;
    }
    Ok(Staged { file: Unnamed::Temporary(temporary), path: place })
}

fn is_folder(path: &Path) -> Error {
    Error::input(format!("{}: this is a folder: give the name of a file in it", known_as(path)))
}

/// The end of a link: it leads to a file, or to where one will be.
fn linked(path: &Path) -> Result<PathBuf> {
    match path.canonicalize() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let target = std::fs::read_link(path).map_err(|e| Error::io(path, e))?;
            let target = path.parent().unwrap_or(Path::new("")).join(target);
            // One that leads to another one that leads nowhere is nobody's wish.
            if target.is_symlink() {
                return Err(Error::io(path, error));
            }
            Ok(target)
        }
        real => real.map_err(|e| Error::io(path, e)),
    }
}

/// Permissions of the file that is going to be replaced, if there is one.
fn older(path: &Path, place: &Path) -> Result<Option<Permissions>> {
    let Ok(metadata) = std::fs::metadata(place) else { return Ok(None) };
    if !metadata.is_file() {
        let path = known_as(path);
        return Err(Error::input(format!(
            "{path}: this is no file but a device, a pipe or the like, and is left alone"
        )));
    }
    if metadata.permissions().readonly() {
        return Err(Error::io(path, std::io::Error::new(ErrorKind::PermissionDenied, "the file is read-only")));
    }
    let names = names_of(place, &metadata);
    if names > 1 {
        return Err(Error::input(format!(
            "{}: this file has {names} names (hard links), which writing would part: remove this name first, or write to \
             another",
            known_as(path)
        )));
    }
    Ok(Some(metadata.permissions()))
}

/// Number of names that a file has.
#[cfg(unix)]
fn names_of(_: &Path, metadata: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(metadata)
}

/// Number of names that a file has. 1 if its folder's system does not say.
#[cfg(windows)]
fn names_of(place: &Path, _: &Metadata) -> u64 {
    let asked = winapi_util::Handle::from_path_any(place).and_then(winapi_util::file::information);
    asked.map_or(1, |of_file| of_file.number_of_links())
}

#[cfg(not(any(unix, windows)))]
fn names_of(_: &Path, _: &Metadata) -> u64 {
    1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.bin");
        let files = || std::fs::read_dir(folder.path()).unwrap().count();
        let fail = write_atomically(&path, &Progress::none(), |file| {
            file.write_all(b"half").unwrap();
            Err(Error::Cancelled)
        });
        assert!(matches!(fail, Err(Error::Cancelled)));
        assert_eq!(files(), 0);
        for content in [&b"first"[..], b"second"] {
            write_atomically(&path, &Progress::none(), |file| file.write_all(content).map_err(|e| Error::io(&path, e)))
                .unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), content);
        }
        assert!(write_atomically(&path, &Progress::none(), |_| Err(Error::Cancelled)).is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"second");
        assert_eq!(files(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn what_is_there_stays_what_it_is() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let write = |path: &Path| {
            write_atomically(path, &Progress::none(), |file| file.write_all(b"new").map_err(|e| Error::io(path, e)))
        };
        std::fs::write(at("file"), "old").unwrap();
        std::fs::set_permissions(at("file"), Permissions::from_mode(0o640)).unwrap();
        symlink("file", at("link")).unwrap();
        write(&at("link")).unwrap();
        assert!(at("link").is_symlink());
        assert_eq!(std::fs::read(at("file")).unwrap(), b"new");
        assert_eq!(std::fs::metadata(at("file")).unwrap().permissions().mode() & 0o777, 0o640);

        symlink("made", at("ahead")).unwrap();
        write(&at("ahead")).unwrap();
        assert!(at("ahead").is_symlink() && std::fs::read(at("made")).unwrap() == b"new");

        let socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        symlink("socket", at("to socket")).unwrap();
        for name in ["socket", "to socket"] {
            let text = write(&at(name)).unwrap_err().to_string();
            assert!(text.ends_with("this is no file but a device, a pipe or the like, and is left alone"), "{text}");
        }
        drop(socket);

        // Neither name changes, nor what they are names of.
        std::fs::write(at("first"), "old").unwrap();
        std::fs::hard_link(at("first"), at("second")).unwrap();
        symlink("second", at("to second")).unwrap();
        for name in ["first", "second", "to second"] {
            let text = write(&at(name)).unwrap_err().to_string();
            assert!(
                text.starts_with(&at(name).display().to_string()) && text.contains("2 names (hard links)"),
                "{text}"
            );
            assert!(text.ends_with("remove this name first, or write to another"), "{text}");
        }
        let same = |name: &str| std::os::unix::fs::MetadataExt::ino(&std::fs::metadata(at(name)).unwrap());
        assert!(same("first") == same("second") && std::fs::read(at("first")).unwrap() == b"old");
        for name in ["first", "to second"] {
            std::fs::remove_file(at(name)).unwrap();
        }
        write(&at("second")).unwrap();

        std::fs::write(at("kept"), "old").unwrap();
        std::fs::set_permissions(at("kept"), Permissions::from_mode(0o444)).unwrap();
        assert!(write(&at("kept")).unwrap_err().to_string().ends_with("the file is read-only"));
        assert_eq!(std::fs::read(at("kept")).unwrap(), b"old");
        symlink("round", at("round")).unwrap();
        assert!(matches!(write(&at("round")), Err(Error::Io { .. })));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 9);
    }

    #[test]
    fn places_that_can_not_be_written_to() {
        let folder = tempfile::tempdir().unwrap();
        let text = |path: &Path| write_atomically(path, &Progress::none(), |_| Ok(())).unwrap_err().to_string();
        assert!(text(folder.path()).ends_with("this is a folder: give the name of a file in it"));
        assert!(text(&folder.path().join("no/x.ply")).contains("there is no folder"));
        assert!(text(Path::new("")).contains("give the name of a file"));
        // Nobody knows the temporary file's name.
        #[cfg(target_os = "linux")]
        {
            let error = write_atomically(Path::new("/proc/x.ply"), &Progress::none(), |_| Ok(())).unwrap_err();
            assert!(!error.to_string().contains(".surfrecon-"), "{error}");
            // The system's own number is kept.
            assert!(matches!(&error, Error::Io { source, .. } if source.raw_os_error().is_some()), "{error:?}");
        }
    }
}
