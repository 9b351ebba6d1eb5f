//! Files as the readers need them. Only regular files are read: a device or a pipe could go on for ever.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::error::{Error, Result};

/// Opens a regular file; also its length.
pub(super) fn open(path: &Path) -> Result<(File, u64)> {
    // Asked before opening: opening a pipe waits for its other end.
    let metadata = std::fs::metadata(path).map_err(|e| Error::io(path, e))?;
    if metadata.is_dir() {
        let remedy = "this is a folder; choose its files, or the .conf file that places them";
        return Err(Error::input(format!("{}: {remedy}", path.display())));
    }
    if !metadata.is_file() {
        return Err(Error::input(format!("{}: not a regular file", path.display())));
    }
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    Ok((file, metadata.len()))
}

/// Reads a whole file.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    let (file, length) = open(path)?;
    let mut bytes = Vec::new();
    let wanted = usize::try_from(length).ok();
    if wanted.is_none_or(|wanted| bytes.try_reserve_exact(wanted).is_err()) {
        return Err(Error::OutOfMemory(format!("{}: {length} bytes", path.display())));
    }
    // A file that grows meanwhile is read no further.
    file.take(length).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes)
}

/// The first bytes of a file, at most `count`.
pub(super) fn read_start(path: &Path, count: usize) -> Result<Vec<u8>> {
    let (file, _) = open(path)?;
    let mut bytes = Vec::new();
    file.take(count as u64).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes)
}

/// The file's own name, for notes.
pub(super) fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
