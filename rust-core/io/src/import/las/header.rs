//! Header of a file: what it says of its points, and how they are compressed.

use std::io::Read as _;

use glam::DVec3;
use laz::LazVlr;

use super::super::file::Input;
use super::super::scan::FileScan;
use super::bytes::{fail, read_exact, seek, u16_at, u32_at, u64_at};
use base::error::{Error, Result};

/// Shortest header, and the one with a count of 64 bits.
const HEADER: usize = 227;
const HEADER_1_4: usize = 255;
/// Bytes before the content of a variable-length record.
pub(super) const RECORD: u64 = 54;
/// Bytes of a point by format, without extra bytes.
pub(super) const SIZES: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// The file's own words on its points.
pub(super) struct Header {
    pub(super) format: usize,
    /// Bytes of a point.
    pub(super) size: usize,
    pub(super) count: u64,
    pub(super) scale: DVec3,
    pub(super) offset: DVec3,
    /// The beginning of the points.
    pub(super) begin: u64,
    /// Compression of them.
    pub(super) packing: Option<LazVlr>,
}

impl Header {
    pub(super) fn read(input: &mut dyn Input, length: u64, scan: &FileScan) -> Result<Header> {
        let mut bytes = [0; HEADER_1_4];
        let known = usize::try_from(length).unwrap_or(usize::MAX).min(HEADER_1_4);
        if known < HEADER {
            return fail(scan, "header", format!("{length} bytes are fewer than a header has, {HEADER}"));
        }
        read_exact(input, &mut bytes[..known], scan, "header")?;
        let version = [bytes[24], bytes[25]];
        if version[0] != 1 || version[1] > 4 {
            let problem = format!("version {}.{} is not known: known are 1.0 to 1.4", version[0], version[1]);
            return fail(scan, "header", problem);
        }
        let own = u64::from(u16_at(&bytes, 94));
        let begin = u64::from(u32_at(&bytes, 96));
        if own < HEADER as u64 || begin < own || begin > length {
            let problem = format!("a header of {own} bytes and points from byte {begin} don't fit a file of {length}");
            return fail(scan, "header", problem);
        }
        // Bit 7 says compressed; old programs set bit 6 as well.
        let (compressed, format) = (bytes[104] & 0x80 != 0, usize::from(bytes[104] & 0x3F));
        let size = u16_at(&bytes, 105);
        if SIZES.get(format).is_none_or(|least| size < *least) {
            let problem =
                format!("points of format {format} with {size} bytes are not known: known are formats 0 to 10");
            return fail(scan, "header", problem);
        }
        let count = match version[1] {
            4 if own >= HEADER_1_4 as u64 && known == HEADER_1_4 => u64_at(&bytes, 247),
            _ => u64::from(u32_at(&bytes, 107)),
        };
        let number = |at: usize| f64::from_bits(u64_at(&bytes, at));
        let scale = DVec3::new(number(131), number(139), number(147));
        let offset = DVec3::new(number(155), number(163), number(171));
        if !(scale.is_finite() && offset.is_finite() && (offset.abs() + scale.abs() * 2_147_483_648.0).is_finite()) {
            return fail(scan, "header", format!("the scale {scale} or the offset {offset} is not usable"));
        }
        let packing = if compressed {
            let records = u32_at(&bytes, 100);
            Some(packing(input, own, begin, records, scan)?)
        } else {
            None
        };
        Ok(Header { format, size: size.into(), count, scale, offset, begin, packing })
    }
}

/// The record that says how the points are compressed, among those between header and points.
fn packing(input: &mut dyn Input, first: u64, end: u64, records: u32, scan: &FileScan) -> Result<LazVlr> {
    let mut at = first;
    for _ in 0..records {
        if at + RECORD > end {
            break;
        }
        seek(input, at, &scan.path)?;
        let mut head = [0; RECORD as usize];
        read_exact(input, &mut head, scan, "variable-length records")?;
        let length = u16_at(&head, 20);
        if head[2..18].starts_with(LazVlr::USER_ID.as_bytes()) && u16_at(&head, 18) == LazVlr::RECORD_ID {
            let mut content = Vec::new();
            input.take(length.into()).read_to_end(&mut content).map_err(|e| Error::io(&scan.path, e))?;
            return match LazVlr::from_buffer(&content) {
                Ok(packing) => Ok(packing),
                Err(problem) => fail(scan, "record of LASzip", problem.to_string()),
            };
        }
        at += RECORD + u64::from(length);
    }
    fail(scan, "header", "the points are compressed, but the record that says how is missing")
}
