//! PNG: grey of 8 or 16 bits as numbers. Colours of 8 bits as heights if they are terrain RGB.

use std::io::{BufReader, Cursor};
use std::path::Path;

use ::png::{BitDepth, ColorType, Decoder, Limits, Transformations};

use super::super::file::{Input, Watched, decoding_error, reserve, watched};
use super::super::options::PixelMeaning;
use super::super::scan::{Content, FileScan};
use super::bounds::{DEFLATED, can_be_in, packed_pixels};
use super::content::{Numbers, Raster};
use base::error::{Error, Result};
use base::progress::Progress;

/// Lowest and highest ground, metres: what colours decode to if they are terrain RGB.
const GROUND: std::ops::RangeInclusive<f64> = -500.0..=9000.0;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"\x89PNG\r\n\x1a\n")
}

pub(in super::super) fn parse(
    input: &mut dyn Input,
    length: u64,
    scan: &FileScan,
    progress: &Progress<'_>,
) -> Result<Content> {
    watched(input, &scan.path, |input| read(input, length, scan, progress))?.into_content(scan)
}

pub(super) fn read(
    input: BufReader<Watched<'_>>,
    length: u64,
    scan: &FileScan,
    progress: &Progress<'_>,
) -> Result<Raster> {
    let fail = |problem: String| Err(Error::format(&scan.path, "header", problem));
    let mut decoder = Decoder::new_with_limits(input, Limits { bytes: 48 << 20 });
    decoder.set_transformations(Transformations::IDENTITY);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(|e| decoding_error(scan, &e))?;
    let (cols, rows) = (reader.info().width as usize, reader.info().height as usize);
    let (colour, depth) = reader.output_color_type();
    let channels = match (colour, depth) {
        (ColorType::Grayscale | ColorType::GrayscaleAlpha, BitDepth::Eight | BitDepth::Sixteen)
        | (ColorType::Rgb | ColorType::Rgba, BitDepth::Eight) => colour.samples(),
        _ => {
            return fail(format!(
                "{} of {} bits a channel holds no heights or depths: known are grey of 8 or 16 bits and terrain RGB",
                name(colour),
                depth as u8
            ));
        }
    };
    if reader.info().interlaced {
        return fail("an interlaced image: save it without interlacing".to_owned());
    }
    let count = packed_pixels(rows as u64, cols as u64, scan)?;
    can_be_in(length, (count * channels * depth as usize / 8) as u64, DEFLATED, scan)?;
    let mut values: Vec<f64> = reserve(count, &scan.path)?;
    let meaning = scan.options.pixels;
    while let Some(row) = reader.next_row().map_err(|e| decoding_error(scan, &e))? {
        // A few bytes of the file may be many rows.
        progress.check()?;
        let data = row.data();
        match (channels, depth) {
            (3.., _) => {
                let height = if meaning == PixelMeaning::Terrarium { terrarium } else { terrain_rgb };
                let pixels = data.chunks_exact(channels);
                values.extend(pixels.map(|p| if p.get(3) == Some(&0) { f64::NAN } else { height([p[0], p[1], p[2]]) }));
            }
            // The usual ones, of a length that the compiler knows.
            (1, BitDepth::Sixteen) => {
                values.extend(data.as_chunks::<2>().0.iter().map(|p| f64::from(u16::from_be_bytes(*p))));
            }
            (1, _) => values.extend(data.iter().map(|&p| f64::from(p))),
            (_, BitDepth::Sixteen) => {
                let shown = |p: &[u8]| u16::from_be_bytes([p[0], p[1]]);
                let pixels = data.chunks_exact(2 * channels);
                values.extend(pixels.map(|p| if p[2..] == [0, 0] { f64::NAN } else { f64::from(shown(p)) }));
            }
            _ => values.extend(data.chunks_exact(channels).map(|p| if p[1] == 0 { f64::NAN } else { f64::from(p[0]) })),
        }
    }
    if values.len() != rows * cols {
        return Err(Error::format(&scan.path, "while decoding", "the image ends too early"));
    }
    let coloured = channels >= 3;
    match meaning {
        PixelMeaning::Auto if coloured && !values.iter().all(|v| v.is_nan() || GROUND.contains(v)) => {
            return fail(
                "a colour image that holds no heights of the ground as terrain RGB. If it is another kind of height \
                    map, say pixels = terrain_rgb or terrarium."
                    .to_owned(),
            );
        }
        PixelMeaning::Number if coloured => {
            return fail("a colour image holds no numbers: pixels must be terrain_rgb or terrarium".to_owned());
        }
        PixelMeaning::TerrainRgb | PixelMeaning::Terrarium if !coloured => {
            return fail("terrain RGB needs three colours of 8 bits, but this image is grey".to_owned());
        }
        _ => {}
    }
    let numbers = match (coloured, depth) {
        (true, _) => Numbers::Metres,
        (_, BitDepth::Sixteen) => Numbers::Whole(65535),
        _ => Numbers::Whole(255),
    };
    Ok(Raster { rows, cols, values, numbers, place: None })
}

/// Columns and rows of an image, what its pixels are and their bytes.
fn pixels(
    bytes: &[u8],
    transformations: Transformations,
    path: &Path,
    most: u64,
) -> Result<([usize; 2], ColorType, Vec<u8>)> {
    let fail = |error: ::png::DecodingError| Error::format(path, "while decoding", error.to_string());
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: 48 << 20 });
    decoder.set_transformations(transformations);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(fail)?;
    let (cols, rows) = (reader.info().width as usize, reader.info().height as usize);
    let size = reader.output_buffer_size().unwrap_or(usize::MAX);
    if size as u64 > most.min((bytes.len() as u64).saturating_mul(DEFLATED)) {
        let problem =
            format!("its {cols} x {rows} pixels can't be in the file, or are more than max_decoded_gib allows");
        return Err(Error::format(path, "header", problem));
    }
    let mut buffer: Vec<u8> = reserve(size, path)?;
    buffer.resize(size, 0);
    reader.next_frame(&mut buffer).map_err(fail)?;
    Ok(([cols, rows], reader.output_color_type().0, buffer))
}

/// The colours of an image, whatever it stores. Alpha is left out.
pub(in super::super) fn colours(bytes: &[u8], path: &Path, most: u64) -> Result<([usize; 2], Vec<[u8; 3]>)> {
    let bytes_of_colours = Transformations::EXPAND | Transformations::STRIP_16;
    let ([cols, rows], stored, buffer) = pixels(bytes, bytes_of_colours, path, most)?;
    let pixels = match stored {
        ColorType::Rgb => triples(buffer),
        ColorType::Rgba => buffer.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| [r, g, b]).collect(),
        ColorType::GrayscaleAlpha => buffer.as_chunks::<2>().0.iter().map(|&[grey, _]| [grey; 3]).collect(),
        ColorType::Grayscale | ColorType::Indexed => buffer.iter().map(|&grey| [grey; 3]).collect(),
    };
    if pixels.len() != rows * cols || pixels.is_empty() {
        return Err(Error::format(path, "while decoding", "the image ends too early"));
    }
    Ok(([cols, rows], pixels))
}

/// Columns, rows and pixels of a grey image of so many bits, all at once. `None` of any other.
fn grey(bytes: &[u8], bits: BitDepth, path: &Path, most: u64) -> Result<Option<([usize; 2], Vec<u8>)>> {
    // Behind the mark and the length and name of the header: columns and rows, then bits, kind, packing, filter and interlacing.
    if bytes.get(24..29) != Some(&[bits as u8, ColorType::Grayscale as u8, 0, 0, 0]) {
        return Ok(None);
    }
    let (size, _, buffer) = pixels(bytes, Transformations::IDENTITY, path, most)?;
    if buffer.is_empty() || buffer.len() != size[0] * size[1] * (bits as usize / 8) {
        return Err(Error::format(path, "while decoding", "the image ends too early"));
    }
    Ok(Some((size, buffer)))
}

/// The bytes of a grey image of 8 bits. `None` of any other.
pub(in super::super) fn levels(bytes: &[u8], path: &Path, most: u64) -> Result<Option<([usize; 2], Vec<u8>)>> {
    grey(bytes, BitDepth::Eight, path, most)
}

/// The numbers of a grey image of 16 bits, as cameras write depths. `None` of any other.
pub(in super::super) fn numbers(bytes: &[u8], path: &Path, most: u64) -> Result<Option<Raster>> {
    let Some(([cols, rows], pixels)) = grey(bytes, BitDepth::Sixteen, path, most)? else { return Ok(None) };
    let mut values: Vec<f64> = reserve(rows * cols, path)?;
    values.extend(pixels.as_chunks::<2>().0.iter().map(|pixel| f64::from(u16::from_be_bytes(*pixel))));
    Ok(Some(Raster { rows, cols, values, numbers: Numbers::Whole(u16::MAX.into()), place: None }))
}

/// Bytes as colours, without another buffer where that fits.
pub(in super::super) fn triples(bytes: Vec<u8>) -> Vec<[u8; 3]> {
    bytemuck::allocation::try_cast_vec(bytes).unwrap_or_else(|(_, bytes)| bytes.as_chunks::<3>().0.to_vec())
}

/// Columns and rows of an image.
pub(in super::super) fn size(bytes: &[u8], path: &Path) -> Result<[usize; 2]> {
    let reader = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: 48 << 20 }).read_info();
    let reader = reader.map_err(|error| Error::format(path, "header", error.to_string()))?;
    Ok([reader.info().width as usize, reader.info().height as usize])
}

fn name(colour: ColorType) -> &'static str {
    match colour {
        ColorType::Grayscale => "grey",
        ColorType::GrayscaleAlpha => "grey with alpha",
        ColorType::Rgb => "RGB",
        ColorType::Rgba => "RGB with alpha",
        ColorType::Indexed => "a palette",
    }
}

fn terrain_rgb([r, g, b]: [u8; 3]) -> f64 {
    let steps = (u32::from(r) << 16) | (u32::from(g) << 8) | u32::from(b);
    // One division rounds once: the height is the nearest number to its decimal.
    (f64::from(steps) - 100_000.0) / 10.0
}

fn terrarium([r, g, b]: [u8; 3]) -> f64 {
    f64::from(r) * 256.0 + f64::from(g) + f64::from(b) / 256.0 - 32768.0
}
