//! Files without their names yet: they appear under these at once, and are gone however their writer ends.
//!
//! If the system has files without a name (Linux, on most file systems), that is what they are: a writer that is killed leaves nothing.
//! Elsewhere, and in the instant in which one takes the place of another, they are called `.surfrecon-XXXXXXXXXXXX.part`. A killed writer
//! may leave a file under such a name. The next writer in the folder removes it, if it is the same user's, a day old and not locked.
//! Whoever still writes it holds a lock on it, also on another machine.

use std::fs::{File, Permissions};
use std::io::{Result, Seek};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use tempfile::{NamedTempFile, TempPath};

const PREFIX: &str = ".surfrecon-";
const SUFFIX: &str = ".part";
/// Letters and digits between the two.
const RANDOM: usize = 12;
/// Time for which a file that nobody has locked is left alone: systems without locks, and files of a set that wait for the others.
const LEFT_ALONE: Duration = Duration::from_secs(24 * 60 * 60);
/// Names of a folder that are looked at, so that folders of a hundred thousand files don't slow down writing.
const LOOKED_AT: usize = 10_000;

/// A file that is being written or waits for its name. Dropped, it is gone.
pub(super) enum Temporary {
    /// Freed by the system when it is closed.
    Nameless(File),
    /// Open, under a temporary name.
    Named(NamedTempFile),
    /// Closed, under a temporary name.
    Closed(TempPath),
}

impl Temporary {
    /// An empty one in a folder, with these permissions or those of any new file.
    pub(super) fn new(folder: &Path, permissions: Option<Permissions>) -> Result<Self> {
        let folder = &of_any_length(folder);
        let made = match nameless(folder) {
            Some(file) => Temporary::Nameless(file),
            None => Temporary::named(folder)?,
        };
        if let Some(file) = made.file() {
            // Not every file system has locks.
            let _ = file.try_lock();
            if let Some(permissions) = permissions {
                file.set_permissions(permissions)?;
            }
            sweep_once(folder, file);
        }
        Ok(made)
    }

    fn named(folder: &Path) -> Result<Self> {
        builder().make_in(folder, create).map(Temporary::Named)
    }

    /// The file, while it is open.
    pub(super) fn file(&self) -> Option<&File> {
        match self {
            Temporary::Nameless(file) => Some(file),
            Temporary::Named(file) => Some(file.as_file()),
            Temporary::Closed(_) => None,
        }
    }

    /// Closes the file: only so many may be open. It waits under a temporary name then.
    pub(super) fn closed(self, folder: &Path) -> Result<Self> {
        let folder = &of_any_length(folder);
        Ok(Temporary::Closed(match self {
            Temporary::Nameless(file) => name(&file, folder)?,
            Temporary::Named(file) => file.into_temp_path(),
            Temporary::Closed(path) => path,
        }))
    }

    /// Gives the file its name, replacing one in the same folder that has it.
    pub(super) fn persist(self, path: &Path, folder: &Path) -> Result<()> {
        let folder = &of_any_length(folder);
        let path = &path.file_name().map_or_else(|| path.to_owned(), |name| folder.join(name));
        let replace = |temporary: TempPath| temporary.persist(path).map_err(|e| e.error);
        match self {
            // Only a name can take the place of another.
            Temporary::Nameless(file) => link(&file, path).or_else(|_| replace(name(&file, folder)?)),
            Temporary::Named(file) => file.persist(path).map(drop).map_err(|e| e.error),
            Temporary::Closed(temporary) => replace(temporary),
        }
    }
}

/// The folder, on Windows by the name that its functions take whatever the length of what is in it: else 260 characters are all.
fn of_any_length(folder: &Path) -> PathBuf {
    let long = if cfg!(windows) { folder.canonicalize().ok() } else { None };
    long.unwrap_or_else(|| folder.to_owned())
}

fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX).rand_bytes(RANDOM);
    builder
}

fn create(path: &Path) -> Result<File> {
    File::options().read(true).write(true).create_new(true).open(path)
}

/// Gives a nameless file a temporary name.
fn name(file: &File, folder: &Path) -> Result<TempPath> {
    if let Ok(named) = builder().make_in(folder, |path| link(file, path)) {
        return Ok(named.into_temp_path());
    }
    // A file system that has nameless files but never names them.
    let mut copy = builder().make_in(folder, create)?;
    copy.as_file().set_permissions(file.metadata()?.permissions())?;
    let mut from = file;
    from.rewind()?;
    std::io::copy(&mut from, copy.as_file_mut())?;
    Ok(copy.into_temp_path())
}

/// A file without a name, if the system has these and can name them later.
#[cfg(target_os = "linux")]
fn nameless(folder: &Path) -> Option<File> {
    use rustix::fs::{Mode, OFlags, open};
    let flags = OFlags::RDWR | OFlags::TMPFILE | OFlags::CLOEXEC;
    let file = File::from(open(folder, flags, Mode::from_raw_mode(0o666)).ok()?);
    descriptor(&file).exists().then_some(file)
}

#[cfg(target_os = "linux")]
fn link(file: &File, path: &Path) -> Result<()> {
    use rustix::fs::{AtFlags, CWD, linkat};
    Ok(linkat(CWD, descriptor(file), CWD, path, AtFlags::SYMLINK_FOLLOW)?)
}

/// The place where the system shows an open file.
#[cfg(target_os = "linux")]
fn descriptor(file: &File) -> PathBuf {
    use std::os::fd::AsRawFd;
    format!("/proc/self/fd/{}", file.as_raw_fd()).into()
}

#[cfg(not(target_os = "linux"))]
fn nameless(_: &Path) -> Option<File> {
    None
}

#[cfg(not(target_os = "linux"))]
fn link(_: &File, _: &Path) -> Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

/// Sweeps a folder unless it was the last one that this process wrote to.
fn sweep_once(folder: &Path, fresh: &File) {
    static LAST: Mutex<Option<PathBuf>> = Mutex::new(None);
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if last.as_deref() != Some(folder) {
        *last = Some(folder.to_owned());
        drop(last);
        sweep(folder, fresh);
    }
}

/// Removes what killed writers have left in a folder. `fresh` is a file just made there. What can't be removed stays.
fn sweep(folder: &Path, fresh: &File) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.take(LOOKED_AT).flatten() {
        if entry.file_name().to_str().is_some_and(is_temporary) {
            let _ = remove_if_left(&entry.path(), fresh);
        }
    }
}

fn is_temporary(name: &str) -> bool {
    let random = name.strip_prefix(PREFIX).and_then(|rest| rest.strip_suffix(SUFFIX));
    random.is_some_and(|random| random.len() == RANDOM && random.bytes().all(|b| b.is_ascii_alphanumeric()))
}

fn remove_if_left(path: &Path, fresh: &File) -> Result<()> {
    let (seen, own) = (std::fs::symlink_metadata(path)?, fresh.metadata()?);
    // By the clock of the file system, which may be another machine's.
    let age = own.modified()?.duration_since(seen.modified()?).unwrap_or_default();
    if !seen.is_file() || age < LEFT_ALONE || !same_owner(&seen, &own) {
        return Ok(());
    }
    let file = File::options().read(true).write(true).open(path)?;
    if file.try_lock().is_ok() {
        std::fs::remove_file(path)?;
    }
    Ok(())
}

#[cfg(unix)]
fn same_owner(a: &std::fs::Metadata, b: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    a.uid() == b.uid()
}

#[cfg(not(unix))]
fn same_owner(_: &std::fs::Metadata, _: &std::fs::Metadata) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Theorem: named, nameless or closed meanwhile, a file appears whole under its name, whether that is free or taken,
    /// and dropped it is gone.
    #[test]
    fn every_kind_appears_and_vanishes() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let path = folder.join("out");
        let make: [fn(&Path) -> Temporary; 2] =
            [|folder| Temporary::new(folder, None).unwrap(), |folder| Temporary::named(folder).unwrap()];
        for make in make {
            for (round, close) in [false, true, false, true].into_iter().enumerate() {
                let write = |temporary: &Temporary| {
                    temporary.file().unwrap().write_all(format!("content {round}").as_bytes()).unwrap();
                };
                let gone = make(folder);
                write(&gone);
                let before = names(folder);
                if close {
                    drop(gone.closed(folder).unwrap())
                } else {
                    drop(gone)
                }
                assert!(before.len() <= 2 && names(folder).iter().all(|name| name == "out"));
                let kept = make(folder);
                write(&kept);
                let kept = if close { kept.closed(folder).unwrap() } else { kept };
                kept.persist(&path, folder).unwrap();
                assert_eq!(std::fs::read_to_string(&path).unwrap(), format!("content {round}"));
                assert_eq!(names(folder), ["out"]);
            }
            std::fs::remove_file(&path).unwrap();
        }
        // Nothing takes the place of a folder, and nothing stays.
        std::fs::create_dir(&path).unwrap();
        assert!(make[0](folder).persist(&path, folder).is_err() && names(folder) == ["out"]);
    }

    /// A file without a name needs no sweeping.
    #[cfg(target_os = "linux")]
    #[test]
    fn nothing_is_seen_while_it_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let temporary = Temporary::new(folder.path(), None).unwrap();
        temporary.file().unwrap().write_all(b"half").unwrap();
        let is_nameless = matches!(temporary, Temporary::Nameless(_));
        assert!(is_nameless == names(folder.path()).is_empty());
    }

    /// Theorem: only what is ours by its name, old and nobody's is removed.
    #[test]
    fn only_what_a_dead_writer_left_is_swept() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let put = |name: &str, age: Duration| {
            let file = File::create(folder.join(name)).unwrap();
            file.set_modified(std::time::SystemTime::now() - age).unwrap();
            file
        };
        let old = LEFT_ALONE + Duration::from_secs(3600);
        put(".surfrecon-Dead00000000.part", old);
        put(".surfrecon-Young0000000.part", Duration::from_secs(3600));
        let live = put(".surfrecon-Live00000000.part", old);
        live.try_lock().unwrap();
        for name in [".surfrecon-config", ".surfrecon-Short.part", ".surfrecon-Dead0000-000.part", "scan.part"] {
            put(name, old);
        }
        std::fs::create_dir(folder.join(".surfrecon-Folder000000.part")).unwrap();
        let kept = [
            ".surfrecon-Dead0000-000.part",
            ".surfrecon-Folder000000.part",
            ".surfrecon-Live00000000.part",
            ".surfrecon-Short.part",
            ".surfrecon-Young0000000.part",
            ".surfrecon-config",
            "scan.part",
        ];
        drop(Temporary::new(folder, None).unwrap());
        assert_eq!(names(folder), kept);
        drop(live);
        sweep(folder, &put("fresh", Duration::ZERO));
        assert!(!names(folder).iter().any(|name| name.contains("Live")));
    }
}
