//! The bytes of a frame's images to numbers and colours.

use std::io::{ErrorKind, Read};
use std::path::Path;
use std::sync::Arc;

use flate2::read::ZlibDecoder;
use lzfse_rust::LzfseRingDecoder;
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use super::super::file;
use super::super::options::ReadOptions;
use super::super::raster::{self, Numbers, Raster};
use super::super::scan::FileScan;
use base::error::{Error, Result};
use base::progress::Progress;

/// Whether it is the fault of an image that it can't be read, not that of the disk.
pub(super) fn is_damage(error: &Error) -> bool {
    match error {
        Error::Format { .. } => true,
        Error::Io { source, .. } => source.kind() == ErrorKind::NotFound,
        _ => false,
    }
}

/// Coding of an image of depths or confidences.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coding {
    /// As an image file that says what it is.
    Image,
    /// Floats of four bytes, row by row, in LZFSE.
    LzfseFloats([usize; 2]),
    /// Bytes, row by row, in LZFSE.
    LzfseBytes([usize; 2]),
    /// Numbers of two bytes, row by row, in zlib.
    ZlibNumbers([usize; 2]),
    /// Numbers of two bytes, row by row.
    Numbers([usize; 2]),
    /// COLMAP's maps: `width&height&channels&`, then floats row by row.
    Colmap,
    /// Numbers in text, row by row.
    Text([usize; 2]),
}

/// Reads the numbers of an image.
pub(super) fn numbers(
    bytes: &[u8],
    coding: Coding,
    path: &Path,
    options: &Arc<ReadOptions>,
    progress: &Progress<'_>,
) -> Result<Raster> {
    let most = options.max_decoded_bytes();
    let raster =
        |[cols, rows]: [usize; 2], values: Vec<f64>, numbers| Raster { rows, cols, values, numbers, place: None };
    let floats = |bytes: &[u8]| bytes.as_chunks::<4>().0.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect();
    let whole = |bytes: &[u8]| bytes.as_chunks::<2>().0.iter().map(|b| f64::from(u16::from_le_bytes(*b))).collect();
    Ok(match coding {
        Coding::Image => {
            if raster::png::sniff(bytes)
                && let Some(raster) = raster::png::numbers(bytes, path, most)?
            {
                return Ok(raster);
            }
            let scan = FileScan { options: options.clone(), ..FileScan::new(path) };
            raster::numbers(bytes, &scan, progress)?
        }
        Coding::LzfseFloats(size) => raster(size, floats(&unpacked_lzfse(bytes, size, 4, most, path)?), Numbers::Real),
        Coding::LzfseBytes(size) => {
            let levels = unpacked_lzfse(bytes, size, 1, most, path)?;
            raster(size, levels.into_iter().map(f64::from).collect(), Numbers::Whole(255))
        }
        Coding::ZlibNumbers(size) => {
            let wanted = bytes_of(size, 2, most, path)?;
            let unpacked = unpacked(ZlibDecoder::new(bytes), wanted, path)?;
            raster(size, whole(&unpacked), Numbers::Whole(u16::MAX.into()))
        }
        Coding::Numbers(size) => {
            let wanted = bytes_of(size, 2, most, path)?;
            raster(size, whole(&unpacked(bytes, wanted, path)?), Numbers::Whole(u16::MAX.into()))
        }
        Coding::Colmap => {
            let (size, bytes) = colmap_header(bytes, path)?;
            let wanted = bytes_of(size, 4, most, path)?;
            raster(size, floats(&unpacked(bytes, wanted, path)?), Numbers::Real)
        }
        Coding::Text(size) => raster(size, text(bytes, size, path)?, Numbers::Real),
    })
}

/// Columns, rows and levels of an image of whole numbers below 256.
pub(super) fn levels(
    bytes: &[u8],
    coding: Coding,
    path: &Path,
    options: &Arc<ReadOptions>,
    progress: &Progress<'_>,
) -> Result<([usize; 2], Vec<u8>)> {
    let most = options.max_decoded_bytes();
    if let Coding::LzfseBytes(size) = coding {
        return Ok((size, unpacked_lzfse(bytes, size, 1, most, path)?));
    }
    if raster::png::sniff(bytes)
        && let Some(levels) = raster::png::levels(bytes, path, most)?
    {
        return Ok(levels);
    }
    let raster = numbers(bytes, coding, path, options, progress)?;
    Ok(([raster.cols, raster.rows], raster.values.iter().map(|&level| level as u8).collect()))
}

/// Bytes that pixels take, refused if that is more than allowed.
fn bytes_of([cols, rows]: [usize; 2], each: usize, most: u64, path: &Path) -> Result<usize> {
    let bytes = cols.checked_mul(rows).and_then(|pixels| pixels.checked_mul(each));
    match bytes {
        Some(bytes) if bytes > 0 && bytes as u64 <= most => Ok(bytes),
        _ => Err(Error::format(
            path,
            "header",
            format!("{cols} x {rows} pixels are none, or more than max_decoded_gib allows"),
        )),
    }
}

/// Reads as many bytes as wanted. Neither fewer nor more.
fn unpacked(from: impl Read, wanted: usize, path: &Path) -> Result<Vec<u8>> {
    let mut bytes: Vec<u8> = file::reserve(wanted, path)?;
    from.take(wanted as u64 + 1).read_to_end(&mut bytes).map_err(|error| {
        Error::format(path, "while decoding", format!("it can't be unpacked: {error}: it is damaged or cut off"))
    })?;
    if bytes.len() == wanted {
        return Ok(bytes);
    }
    let problem = match bytes.len() > wanted {
        true => format!("it holds more than the {wanted} bytes of its pixels"),
        false => format!("it holds {} of the {wanted} bytes of its pixels: it is damaged or cut off", bytes.len()),
    };
    Err(Error::format(path, "while decoding", problem))
}

fn unpacked_lzfse(bytes: &[u8], size: [usize; 2], each: usize, most: u64, path: &Path) -> Result<Vec<u8>> {
    let wanted = bytes_of(size, each, most, path)?;
    // Through a ring of its own size: a block that claims to be huge takes no memory.
    let mut decoder = LzfseRingDecoder::default();
    unpacked(decoder.reader_bytes(bytes), wanted, path)
}

/// Columns and rows of one of COLMAP's maps, and what follows them.
fn colmap_header<'a>(bytes: &'a [u8], path: &Path) -> Result<([usize; 2], &'a [u8])> {
    let fail = |problem: &str| Err(Error::format(path, "header", problem));
    let mut rest = bytes;
    let mut numbers = [0_usize; 3];
    for number in &mut numbers {
        let Some(end) = rest.iter().take(20).position(|&b| b == b'&') else {
            return fail("expected width&height&channels& and floats, as COLMAP writes its maps");
        };
        let text = std::str::from_utf8(&rest[..end]).ok().and_then(|text| text.trim().parse().ok());
        let Some(value) = text else { return fail("width, height and channels must be whole numbers") };
        *number = value;
        rest = &rest[end + 1..];
    }
    match numbers {
        [cols, rows, 1] => Ok(([cols, rows], rest)),
        _ => fail("a map of depths must have one channel"),
    }
}

/// As many numbers as there are pixels.
fn text(bytes: &[u8], size: [usize; 2], path: &Path) -> Result<Vec<f64>> {
    // A number takes two bytes at least, its blank with it.
    let count = bytes_of(size, 1, bytes.len() as u64 / 2 + 1, path)?;
    let fail = |problem: String| Error::format(path, "whole file", problem);
    let text = std::str::from_utf8(bytes).map_err(|_| fail("this is not text (UTF-8)".to_owned()))?;
    let mut values: Vec<f64> = file::reserve(count, path)?;
    for word in text.split_ascii_whitespace() {
        let value = word.parse().map_err(|_| {
            let shown: String = word.chars().take(40).collect();
            fail(format!("expected number {} of {count}, found `{shown}`", values.len() + 1))
        })?;
        if values.len() == count {
            return Err(fail(format!("it holds more than the {count} numbers of its pixels")));
        }
        values.push(value);
    }
    if values.len() < count {
        return Err(fail(format!("it holds {} of the {count} numbers of its pixels: it was cut off", values.len())));
    }
    Ok(values)
}

/// Columns, rows and colours of an image.
pub(super) type Colours = ([usize; 2], Vec<[u8; 3]>);

/// Reads the colours of a JPEG or PNG file.
pub(super) fn colours(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<Colours> {
    let fail = |problem: String| Error::format(path, "while decoding", problem);
    let most = options.max_decoded_bytes();
    if raster::png::sniff(bytes) {
        return raster::png::colours(bytes, path, most);
    }
    if !is_jpeg(bytes) {
        return Err(no_image(bytes, path));
    }
    let mut decoder = jpeg(bytes);
    let size = jpeg_size(&mut decoder, path)?;
    // The decoder fills what is missing with grey. Behind the end phones write what they like; before the scan there may be another
    // image, a small one.
    let last = |marker: &[u8]| memchr::memmem::rfind(bytes, marker);
    if last(&[0xFF, 0xD9]) < last(&[0xFF, 0xDA]) {
        return Err(fail("the image ends too early".to_owned()));
    }
    // Of our own: so that it is foreseen and counted.
    let wanted = bytes_of(size, 3, most, path)?;
    let mut pixels: Vec<u8> = file::reserve(wanted, path)?;
    pixels.resize(wanted, 0);
    decoder.decode_into(&mut pixels).map_err(|error| fail(error.to_string()))?;
    let pixels = raster::png::triples(pixels);
    if pixels.len() != size[0] * size[1] {
        return Err(fail("the image ends too early".to_owned()));
    }
    Ok((size, pixels))
}

/// Columns and rows of a JPEG or PNG file.
pub(super) fn size(bytes: &[u8], path: &Path) -> Result<[usize; 2]> {
    if is_jpeg(bytes) { jpeg_size(&mut jpeg(bytes), path) } else { raster::png::size(bytes, path) }
}

/// Way in which EXIF says that an image is to be turned before it is looked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Turn {
    #[default]
    None,
    /// EXIF's number of it, 2 to 8.
    Exif(u16),
}

impl Turn {
    /// Columns and rows after it.
    pub(super) fn size(self, [cols, rows]: [usize; 2]) -> [usize; 2] {
        if matches!(self, Turn::Exif(5..)) { [rows, cols] } else { [cols, rows] }
    }

    /// An image after it.
    pub(super) fn of(self, size: [usize; 2], pixels: Vec<[u8; 3]>) -> Colours {
        let Turn::Exif(number) = self else { return (size, pixels) };
        let ([cols, rows], turned) = (size, self.size(size));
        let places = (0..turned[1]).flat_map(|row| (0..turned[0]).map(move |col| [col, row]));
        let from = |[x, y]: [usize; 2]| match number {
            2 => [cols - 1 - x, y],
            3 => [cols - 1 - x, rows - 1 - y],
            4 => [x, rows - 1 - y],
            5 => [y, x],
            6 => [y, rows - 1 - x],
            7 => [cols - 1 - y, rows - 1 - x],
            _ => [cols - 1 - y, x],
        };
        (turned, places.map(from).map(|[col, row]| pixels[row * cols + col]).collect())
    }
}

/// Columns and rows of a JPEG or PNG file as they are stored, and how they are to be turned. Its head is enough.
pub(super) fn size_and_turn(bytes: &[u8], path: &Path) -> Result<([usize; 2], Turn)> {
    if !is_jpeg(bytes) {
        return if raster::png::sniff(bytes) {
            Ok((size(bytes, path)?, Turn::None))
        } else {
            Err(no_image(bytes, path))
        };
    }
    let mut decoder = jpeg(bytes);
    let size = jpeg_size(&mut decoder, path)?;
    let number = decoder.exif().and_then(|exif| orientation(exif));
    Ok((size, number.filter(|number| (2..=8).contains(number)).map_or(Turn::None, Turn::Exif)))
}

/// The orientation that EXIF says.
fn orientation(exif: &[u8]) -> Option<u16> {
    const ORIENTATION: u16 = 0x0112;
    let is_little = exif.starts_with(b"II");
    let short = |at: usize| {
        let bytes = *exif.get(at..)?.first_chunk::<2>()?;
        Some(if is_little { u16::from_le_bytes(bytes) } else { u16::from_be_bytes(bytes) })
    };
    let [a, b] = if is_little { [short(6)?, short(4)?] } else { [short(4)?, short(6)?] };
    let list = (usize::from(a) << 16) | usize::from(b);
    let entries = (0..usize::from(short(list)?)).map(|k| list + 2 + 12 * k);
    entries.filter(|&at| short(at) == Some(ORIENTATION)).find_map(|at| short(at + 8))
}

/// The error for a file that is no image that is read.
fn no_image(bytes: &[u8], path: &Path) -> Error {
    let problem = match bytes.get(4..8) {
        Some(b"ftyp") => "HEIC images and videos are not read: convert it to JPEG or PNG",
        _ => "a colour image must be a JPEG or PNG file",
    };
    Error::format(path, "start of file", problem)
}

fn is_jpeg(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xFF, 0xD8, 0xFF])
}

fn jpeg(bytes: &[u8]) -> JpegDecoder<ZCursor<&[u8]>> {
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB).set_strict_mode(true);
    JpegDecoder::new_with_options(ZCursor::new(bytes), options)
}

fn jpeg_size(decoder: &mut JpegDecoder<ZCursor<&[u8]>>, path: &Path) -> Result<[usize; 2]> {
    decoder.decode_headers().map_err(|error| Error::format(path, "header", error.to_string()))?;
    decoder
        .dimensions()
        .map(|(cols, rows)| [cols, rows])
        .ok_or_else(|| Error::format(path, "header", "the image must say its size"))
}
