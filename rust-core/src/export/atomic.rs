//! Files that appear whole or not at all.

use std::fs::File;
use std::path::Path;

use crate::error::{Error, Result};
use crate::progress::Progress;

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
    write: impl FnOnce(&mut File) -> Result<()> + Send,
) -> Result<()> {
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
    let mut file = builder.tempfile_in(folder).map_err(|e| Error::io(path, e))?;
    progress.watch(|| write(file.as_file_mut()))?;
    file.persist(path).map_err(|e| Error::io(path, e.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

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
    }
}
