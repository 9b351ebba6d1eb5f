//! Numbers of a file, and what is wrong with it.

use std::io::SeekFrom;
use std::path::Path;

use super::super::file::Input;
use super::super::scan::FileScan;
use base::error::{Error, Result};

pub(super) fn fail<T>(scan: &FileScan, at: impl Into<String>, problem: impl Into<String>) -> Result<T> {
    Err(Error::format(&scan.path, at, problem))
}

pub(super) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from(u16_at(bytes, at)) | u32::from(u16_at(bytes, at + 2)) << 16
}

pub(super) fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}

/// Fills `bytes`. The file ending is the file's fault, everything else the disk's.
pub(super) fn read_exact(input: &mut dyn Input, bytes: &mut [u8], scan: &FileScan, what: &str) -> Result<()> {
    input.read_exact(bytes).map_err(|error| match error.kind() {
        std::io::ErrorKind::UnexpectedEof => Error::format(&scan.path, what, "the file ends"),
        _ => Error::io(&scan.path, error),
    })
}

pub(super) fn seek(input: &mut dyn Input, to: u64, path: &Path) -> Result<()> {
    input.seek(SeekFrom::Start(to)).map(|_| ()).map_err(|error| Error::io(path, error))
}
