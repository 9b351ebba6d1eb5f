//! PCD, the format of the Point Cloud Library: text, binary, and compressed binary (LZF, one field after the other).
//!
//! A file with a `HEIGHT` above 1 is organized: a range image whose rays start at `VIEWPOINT`. Points with a coordinate that isn't finite,
//! and those at exactly (0, 0, 0), are invalid pixels. Otherwise it is a cloud, whose sensor is `VIEWPOINT` unless that is the origin:
//! writers put that there where they know none. Besides x, y, z are read: `rgb` or `rgba` (packed into a float or a whole number),
//! `intensity`, and normals of clouds.
//!
//! *What is refused*: sizes that the bytes of the file can't hold, also after unpacking (LZF makes at most 88 bytes out
//! of one), and unpacked sizes above the limit of the options.
//!
//! Cost: one pass. Memory for the result and a window, compressed or not.
//!
//! | file | what |
//! |---|---|
//! | `header` | the lines ahead of the points |
//! | `data` | the points in each way that they are written; `lzf` unpacks |
//! | `sink` | values to the grid or the cloud |

mod data;
mod header;
mod lzf;
mod sink;

use super::file::{self, Input};
use super::scan::{Content, FileScan};
use super::text::{Lines, lines_of};
use base::error::Result;
use base::progress::Progress;
use header::{Data, LARGEST_POINT};

pub(super) fn sniff(start: &[u8]) -> bool {
    let text = file::start_of_text(start);
    let mut lines = lines_of(&text).map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'));
    let begins = |word: &str| first.is_some_and(|line| line.split_ascii_whitespace().next() == Some(word));
    begins("VERSION") && (text.contains("FIELDS") || text.contains("COLUMNS")) || begins("FIELDS")
}
pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &FileScan, _: &Progress<'_>) -> Result<Content> {
    let mut lines = Lines::new(input, length, &scan.path);
    let header = header::header(&mut lines)?;
    let sum = |of: fn(&header::Field) -> usize| header.fields.iter().map(|field| of(field) as u64).sum();
    let stride: u64 = sum(|field| field.size * field.count);
    if stride > LARGEST_POINT {
        return Err(lines.fail(format!("a point of {stride} bytes is more than {LARGEST_POINT}")));
    }
    let (numbers, count) = (sum(|field| field.count), header.width * header.height);
    let points = data::Points { header: &header, stride, numbers, count, left: lines.left()?, scan };
    let sink = match header.data {
        Data::Ascii => points.of_text(lines),
        Data::Binary => points.of_bytes(lines),
        Data::Compressed => points.of_packed(lines),
    };
    sink?.into_content(&header, scan)
}

#[cfg(test)]
mod tests;
