//! LAS 1.0 to 1.4 and LAZ: scattered points of aerial and mobile scanners, georeferenced, with intensity and colour.
//!
//! | file | what |
//! |---|---|
//! | `chunks` | LAZ: compressed points, chunk by chunk, through the crate `laz` |
//!
//! Coordinates are whole numbers times a scale plus an offset, in double precision: nothing is lost far from the origin. Points marked as
//! withheld are left out, as the format asks, and the log is told how many. An intensity or a colour that is zero for all points is none.
//! Colours have 16 bits. Files whose colours all stay below 256 have them in 8.
//!
//! Cost: one pass, memory for the result and a window. LAZ is decoded by all cores, a few chunks at a time.

mod chunks;

use std::io::{Read, SeekFrom};
use std::path::Path;

use glam::DVec3;
use laz::LazVlr;

use super::file::{Input, reserve};
use super::scan::{Content, FileScan};
use super::window::Window;
use base::error::{Error, Result, counted, known_as};
use base::log::{self, Level};
use base::progress::Progress;
use mesh::point_cloud::PointCloud;

/// Points that a byte can hold at most. Each takes three symbols or more, and the likeliest of n symbols the n - 1 others'
/// share of 2^15 at least: some 1,100 points a byte.
const MOST_IN_A_BYTE: u64 = 4096;

/// Shortest header, and the one with a count of 64 bits.
const HEADER: usize = 227;
const HEADER_1_4: usize = 255;
/// Bytes before the content of a variable-length record.
const RECORD: u64 = 54;
/// Bytes of a point by format, without extra bytes.
const SIZES: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
/// Place of its red, by format.
const COLOUR: [Option<usize>; 11] =
    [None, None, Some(20), Some(28), None, Some(28), None, Some(30), Some(30), None, Some(30)];

/// Whether a file that starts like this is one.
pub(super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"LASF")
}

/// The file's own words on its points.
struct Header {
    format: usize,
    /// Bytes of a point.
    size: usize,
    count: u64,
    scale: DVec3,
    offset: DVec3,
    /// The beginning of the points.
    begin: u64,
    /// Compression of them.
    packing: Option<LazVlr>,
}

fn fail<T>(scan: &FileScan, at: impl Into<String>, problem: impl Into<String>) -> Result<T> {
    Err(Error::format(&scan.path, at, problem))
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from(u16_at(bytes, at)) | u32::from(u16_at(bytes, at + 2)) << 16
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from(u32_at(bytes, at)) | u64::from(u32_at(bytes, at + 4)) << 32
}

/// Fills `bytes`. The file ending is the file's fault, everything else the disk's.
fn read_exact(input: &mut dyn Input, bytes: &mut [u8], scan: &FileScan, what: &str) -> Result<()> {
    input.read_exact(bytes).map_err(|error| match error.kind() {
        std::io::ErrorKind::UnexpectedEof => Error::format(&scan.path, what, "the file ends"),
        _ => Error::io(&scan.path, error),
    })
}

fn seek(input: &mut dyn Input, to: u64, path: &Path) -> Result<()> {
    input.seek(SeekFrom::Start(to)).map(|_| ()).map_err(|error| Error::io(path, error))
}

impl Header {
    fn read(input: &mut dyn Input, length: u64, scan: &FileScan) -> Result<Header> {
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

/// The points so far.
struct Points {
    header: Header,
    cloud: PointCloud,
    intensity: Vec<f32>,
    colour: Vec<[u8; 4]>,
    /// Bits that were set in any intensity, and in any colour.
    seen: [u16; 2],
    /// Points that are left out as the format asks.
    withheld: u64,
}

impl Points {
    /// For points whose number was checked against the file or the limit.
    fn new(header: Header, scan: &FileScan) -> Result<Points> {
        let count = header.count as usize;
        let cloud = PointCloud {
            positions: reserve(count, &scan.path)?,
            world_from_cloud: scan.world_from_sensor,
            ..PointCloud::default()
        };
        let colours = if COLOUR[header.format].is_some() { count } else { 0 };
        Ok(Points {
            header,
            cloud,
            intensity: reserve(count, &scan.path)?,
            colour: reserve(colours, &scan.path)?,
            seen: [0; 2],
            withheld: 0,
        })
    }

    #[inline]
    fn add(&mut self, record: &[u8]) {
        let withheld = if self.header.format < 6 { record[15] & 0x80 } else { record[15] & 0x04 };
        if withheld != 0 {
            self.withheld += 1;
            return;
        }
        let number = |axis: usize| f64::from(u32_at(record, 4 * axis).cast_signed());
        self.cloud.positions.push(DVec3::new(number(0), number(1), number(2)) * self.header.scale + self.header.offset);
        let intensity = u16_at(record, 12);
        self.seen[0] |= intensity;
        self.intensity.push(intensity.into());
        if let Some(at) = COLOUR[self.header.format] {
            let colour = [0, 2, 4].map(|channel| u16_at(record, at + channel));
            let bits = colour[0] | colour[1] | colour[2];
            if self.seen[1] < 256 && bits > 255 {
                // All before were below 256 as well, which is nothing in 16 bits.
                self.colour.fill([0, 0, 0, 255]);
            }
            self.seen[1] |= bits;
            let shift = if self.seen[1] > 255 { 8 } else { 0 };
            let [r, g, b] = colour.map(|channel| (channel >> shift) as u8);
            self.colour.push([r, g, b, 255]);
        }
    }

    fn finish(mut self, path: &Path) -> Content {
        if self.withheld > 0 {
            let of = counted(self.header.count, "point is", "points are");
            let text = format!("{}: {} of {of} marked as withheld and left out", known_as(path), self.withheld);
            log::tell(Level::Info, &text);
        }
        self.cloud.intensity = (self.seen[0] != 0).then_some(self.intensity);
        self.cloud.colour = (self.seen[1] != 0).then_some(self.colour);
        Content::Points(self.cloud)
    }
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
