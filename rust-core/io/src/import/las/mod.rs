//! LAS 1.0 to 1.4 and LAZ: scattered points of aerial and mobile scanners, georeferenced, with intensity and colour.
//!
//! | file | what |
//! |---|---|
//! | `header` | what a file says of its points |
//! | `points` | points out of their records |
//! | `bytes` | numbers of a file, and what is wrong with it |
//! | `chunks` | LAZ: compressed points, chunk by chunk, through the crate `laz` |
//!
//! Coordinates are whole numbers times a scale plus an offset, in double precision: nothing is lost far from the origin. Points marked as
//! withheld are left out, as the format asks, and the log is told how many. An intensity or a colour that is zero for all points is none.
//! Colours have 16 bits. Files whose colours all stay below 256 have them in 8.
//!
//! Cost: one pass, memory for the result and a window. LAZ is decoded by all cores, a few chunks at a time.

mod bytes;
mod chunks;
mod header;
mod points;

use self::bytes::{fail, seek};
use self::header::Header;
use self::points::Points;
use super::file::Input;
use super::scan::{Content, FileScan};
use super::window::Window;
use base::error::{Error, Result};
use base::progress::Progress;

/// Points that a byte can hold at most. Each takes three symbols or more, and the likeliest of n symbols the n - 1 others'
/// share of 2^15 at least: some 1,100 points a byte.
const MOST_IN_A_BYTE: u64 = 4096;

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"LASF")
}

pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &FileScan, _: &Progress<'_>) -> Result<Content> {
    let mut header = Header::read(input, length, scan)?;
    let (count, size) = (header.count, header.size);
    if let Some(packing) = header.packing.take() {
        let decoded = count.checked_mul(size.max(40) as u64);
        if decoded.is_none_or(|bytes| bytes > scan.options.max_decoded_bytes()) {
            let problem =
                format!("{count} points unpack to more than max_decoded_gib, {}", scan.options.max_decoded_gib);
            return fail(scan, "header", problem);
        }
        let begin = header.begin;
        if count > (length - begin).saturating_mul(MOST_IN_A_BYTE) {
            let problem = format!("{count} points can't be in {} bytes: it is damaged or cut off", length - begin);
            return fail(scan, "header", problem);
        }
        let mut points = Points::new(header, scan)?;
        chunks::read(input, [begin, length], &packing, &mut points, scan)?;
        return Ok(points.finish(&scan.path));
    }
    if count.checked_mul(size as u64).is_none_or(|bytes| bytes > length - header.begin) {
        let problem = format!("{count} points of {size} bytes don't fit the {} bytes left", length - header.begin);
        return fail(scan, "header", problem);
    }
    seek(input, header.begin, &scan.path)?;
    let bytes = count * size as u64;
    let mut points = Points::new(header, scan)?;
    // A point is never larger than the smallest window but for extra bytes.
    let mut window = Window::new(input, bytes);
    for point in 0..count {
        while !window.ensure(size) && window.grow() {}
        if !window.ensure(size) {
            return match window.failure() {
                Some(error) => Err(Error::io(&scan.path, error)),
                None => fail(scan, format!("point {point} of {count}"), "the file ends"),
            };
        }
        points.add(&window.rest()[..size]);
        window.at += size;
    }
    Ok(points.finish(&scan.path))
}

#[cfg(test)]
mod tests;
