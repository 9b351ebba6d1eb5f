//! Files that appear whole or not at all.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use tempfile::TempPath;

use crate::error::{Error, Result};
use crate::progress::Progress;

/// The temporary file. Every writer hands its bytes through this one type, so that a test can make any write fail.
pub(crate) struct Output<'a>(&'a File);

impl Write for Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        #[cfg(test)]
        let bytes = super::faults::write(bytes)?;
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

impl Read for Output<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.0.read(buffer)
    }
}

impl Seek for Output<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

/// A file that is written but doesn't have its name yet; dropped, it is gone.
pub(crate) struct Staged {
    temporary: TempPath,
    path: PathBuf,
}

impl Staged {
    /// Gives the file its name, replacing one that has it.
    pub(crate) fn keep(self) -> Result<()> {
        self.temporary.persist(&self.path).map_err(|e| Error::io(&self.path, e.error))
    }
}

/// Lets `write` fill a temporary file in the folder of `path` and gives it that name at the end, replacing a file that
/// has it; `progress` is reported meanwhile. On any error (a cancelled call among them) nothing is left and a file that was there is untouched.
///
/// The data is handed to the system but not forced to the disk: after a crash of the machine the file may be short.
///
/// # Errors
/// [`Error::Io`] if the file can't be made, or what `write` returns.
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
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if path.file_name().is_none() || path.is_dir() {
        return Err(Error::input(format!("{}: this is a folder, not the name of a file", path.display())));
    }
    if !folder.is_dir() {
        return Err(Error::input(format!("{}: there is no folder {}", path.display(), folder.display())));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".surfrecon-");
    #[cfg(unix)]
    {
        // As any new file: what the process's mask leaves of this.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.tempfile_in(folder).map_err(|e| Error::io(path, plain(e)))?;
    progress.watch(|| write(&mut Output(file.as_file())))?;
    // Closed: a set of files may be larger than the number of files that may be open.
    Ok(Staged { temporary: file.into_temp_path(), path: path.to_owned() })
}

/// The system's own answer: the name of the temporary file, which the error carries, says nobody anything.
fn plain(error: std::io::Error) -> std::io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((answer, _)) => std::io::Error::new(error.kind(), answer),
        None => error,
    }
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

    #[test]
    fn places_that_can_not_be_written_to() {
        let folder = tempfile::tempdir().unwrap();
        let text = |path: &Path| write_atomically(path, &Progress::none(), |_| Ok(())).unwrap_err().to_string();
        assert!(text(folder.path()).ends_with("this is a folder, not the name of a file"));
        assert!(text(&folder.path().join("no/x.ply")).contains("there is no folder"));
        assert!(text(Path::new("")).contains("not the name of a file"));
        // Nobody knows the temporary file's name.
        #[cfg(target_os = "linux")]
        assert!(!text(Path::new("/proc/x.ply")).contains(".surfrecon-"));
    }
}
