//! Sizes of images that files can have: others are refused before anything is taken for them.

use super::super::scan::FileScan;
use base::error::{Error, Result};

/// The pixels of an image, refused where a file of so many bytes can't hold them, each of `bytes`.
pub(super) fn stored_pixels(rows: u64, cols: u64, bytes: u64, left: u64, scan: &FileScan, at: &str) -> Result<usize> {
    let needed = rows.checked_mul(cols).and_then(|pixels| pixels.checked_mul(bytes));
    match needed {
        Some(needed) if needed <= left && needed > 0 => Ok((needed / bytes) as usize),
        Some(0) => {
            Err(Error::format(&scan.path, at, format!("an image of {cols} x {rows} pixels must have at least one")))
        }
        _ => {
            let problem = format!("{cols} x {rows} pixels of {bytes} bytes are more than the {left} bytes that follow");
            Err(Error::format(&scan.path, at, problem))
        }
    }
}

/// The pixels of a compressed image, refused where they unpack to more than the options allow.
pub(super) fn packed_pixels(rows: u64, cols: u64, scan: &FileScan) -> Result<usize> {
    let limit = scan.options.max_decoded_bytes();
    let bytes = rows.checked_mul(cols).and_then(|pixels| pixels.checked_mul(8));
    match bytes {
        Some(bytes) if bytes <= limit && bytes > 0 => Ok((bytes / 8) as usize),
        Some(0) => Err(Error::format(
            &scan.path,
            "header",
            format!("an image of {cols} x {rows} pixels must have at least one"),
        )),
        _ => Err(Error::format(
            &scan.path,
            "header",
            format!(
                "{cols} x {rows} pixels would take more than max_decoded_gib = {} GiB: raise it if the file is to be trusted",
                scan.options.max_decoded_gib
            ),
        )),
    }
}

/// Refuses an image that can't be in a file of so many bytes: `most` is what one of them can become by the compression, and
/// `bytes` what the pixels take unpacked.
pub(super) fn can_be_in(length: u64, bytes: u64, most: u64, scan: &FileScan) -> Result<()> {
    if bytes <= length.saturating_mul(most) {
        return Ok(());
    }
    let problem = format!("its {bytes} bytes of pixels can't be in a file of {length} bytes: it is damaged or cut off");
    Err(Error::format(&scan.path, "header", problem))
}

/// Bytes that one byte can become by deflate: 258 bytes for two bits.
pub(super) const DEFLATED: u64 = 1032;
