//! TIFF: one channel of whole numbers or floats, in strips or tiles, plain, LZW, deflate or Zstandard. Of GeoTIFF the place
//! (`ModelPixelScale` with `ModelTiepoint`), its coordinate reference system, and GDAL's no-data value are read. A pixel has no value
//! where a second channel that is alpha is 0, or where a mask in the file is ([`mask`]).

mod mask;
mod overlay;
mod zstd;

use std::io::{BufReader, Read, Seek};

use ::tiff::ColorType;
use ::tiff::decoder::{Decoder, DecodingResult, Limits};
use ::tiff::tags::{ExtraSamples, Tag};

use self::overlay::Overlay;
use self::zstd::Packed;
use super::super::file::{self, Input, Watched, decoding_error, reserve, watched};
use super::super::geo_keys::GeoKeys;
use super::super::scan::{Content, FileScan};
use super::bounds::{can_be_in, packed_pixels};
use super::content::{Numbers, Place, Raster};
use base::error::{Error, Result, known_as};
use base::memory;
use base::progress::Progress;
use mesh::Crs;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    matches!(start, [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..])
}

pub(in super::super) fn parse(
    input: &mut dyn Input,
    length: u64,
    scan: &FileScan,
    progress: &Progress<'_>,
) -> Result<Content> {
    watched(input, &scan.path, |input| read(input, length, scan, progress))?.into_content(scan)
}

/// Bytes that any strip or tile may have, packed or not.
const LITTLE: usize = 32 << 20;
/// Bytes that one byte can become by any of the compressions: LZW makes 4,096 bytes of twelve bits.
const MOST: u64 = 2731;

pub(super) fn read(
    input: BufReader<Watched<'_>>,
    length: u64,
    scan: &FileScan,
    progress: &Progress<'_>,
) -> Result<Raster> {
    let wrong = |e: ::tiff::TiffError| decoding_error(scan, &e);
    let fail = |problem: String| Err(Error::format(&scan.path, "header", problem));
    let mut limits = Limits::default();
    limits.decoding_buffer_size = LITTLE;
    // Packed bytes are in the file.
    limits.intermediate_buffer_size = usize::try_from(length).unwrap_or(usize::MAX).max(LITTLE);
    limits.ifd_value_size = 4 << 20;
    let mut decoder = Decoder::new(Overlay::new(input, length)).map_err(wrong)?.with_limits(limits.clone());
    let (width, height) = decoder.dimensions().map_err(wrong)?;
    let (cols, rows) = (width as usize, height as usize);
    let colour = decoder.colortype().map_err(wrong)?;
    let channels = usize::from(colour.num_samples());
    if channels != 1 && !has_alpha(&mut decoder, colour) {
        return fail(format!(
            "{channels} channels a pixel, but a height map or depth image has one, of whole numbers or floats, and may have alpha besides"
        ));
    }
    let place = place(&mut decoder, scan);
    let no_data = decoder
        .find_tag(Tag::GdalNodata)
        .ok()
        .flatten()
        .and_then(|value| value.into_string().ok())
        .and_then(|text| text.trim_matches(['\0', ' ']).parse::<f64>().ok());
    let count = packed_pixels(rows as u64, cols as u64, scan)?;
    let pixel_bits = u64::from(colour.bit_depth()) * channels as u64;
    let packed = Packed::of(&mut decoder, 0, colour, scan)?;
    can_be_in(length, count as u64 * pixel_bits / 8, if packed.is_some() { zstd::MOST } else { MOST }, scan)?;
    let mut values = reserve(count, &scan.path)?;
    values.resize(rows * cols, f64::NAN);
    // The whole image may be one strip, whose pixels take no more than the result's.
    limits.decoding_buffer_size = (values.len() * channels * size_of::<f64>()).max(LITTLE);
    let unpacked = packed.as_ref().map_or(0, Packed::size);
    limits.intermediate_buffer_size = limits.intermediate_buffer_size.max(unpacked);
    decoder = decoder.with_limits(limits);
    let (chunk_cols, chunk_rows) = decoder.chunk_dimensions();
    if chunk_cols == 0 || chunk_rows == 0 {
        return fail("tiles or strips must have pixels".to_owned());
    }
    let chunk = f64::from(chunk_cols) * f64::from(chunk_rows) * pixel_bits as f64 / 8.0;
    memory::expect(
        chunk + unpacked as f64,
        || format!("decoding {}", known_as(&scan.path)),
        "use smaller strips or tiles",
    )?;
    let across = cols.div_ceil(chunk_cols as usize);
    let chunks = across * rows.div_ceil(chunk_rows as usize);
    // Of a file that keeps its channels apart, alpha has as many tiles or strips of its own.
    let apart = channels > 1 && decoder.find_tag_unsigned::<u32>(Tag::PlanarConfiguration).ok().flatten() == Some(2);
    let mut numbers = Numbers::Real;
    for chunk in 0..chunks {
        // A few bytes of the file may be many chunks.
        progress.check()?;
        let [index, index_of_alpha] = [chunk, chunk + chunks].map(u32::try_from);
        let (Ok(index), Ok(index_of_alpha)) = (index, index_of_alpha) else {
            return fail("too many tiles".to_owned());
        };
        let (used_cols, used_rows) = decoder.chunk_data_dimensions(index);
        packed.iter().try_for_each(|packed| packed.unpack(&mut decoder, chunk, scan))?;
        let data = decoder.read_chunk(index).map_err(wrong)?;
        let mut alpha = None;
        if apart {
            packed.iter().try_for_each(|packed| packed.unpack(&mut decoder, chunk + chunks, scan))?;
            alpha = Some(decoder.read_chunk(index_of_alpha).map_err(wrong)?);
        }
        let corner = (chunk / across * chunk_rows as usize) * cols + chunk % across * chunk_cols as usize;
        let size = [used_rows as usize, used_cols as usize];
        let mut place = |data: &mut dyn ExactSizeIterator<Item = f64>| -> bool {
            let enough = data.len() >= size[0] * size[1];
            for row in 0..if enough { size[0] } else { 0 } {
                let start = corner + row * cols;
                for (value, item) in values[start..start + size[1]].iter_mut().zip(&mut *data) {
                    *value = if no_data == Some(item) { f64::NAN } else { item };
                }
            }
            enough
        };
        let complete = match (&alpha, channels) {
            (None, 1) => place(&mut *each(&data)),
            (None, _) => place(&mut Opaque { values: each(&data), alpha: None }),
            (Some(alpha), _) => place(&mut Opaque { values: each(&data), alpha: Some(each(alpha)) }),
        };
        if !complete {
            return Err(Error::format(&scan.path, format!("tile or strip {chunk}"), "it has too few pixels"));
        }
        numbers = match data {
            DecodingResult::F16(_) | DecodingResult::F32(_) | DecodingResult::F64(_) => Numbers::Real,
            DecodingResult::U16(_) => Numbers::Whole(65535),
            _ => Numbers::Whole(255),
        };
    }
    mask::apply(&mut decoder, &mut values, cols, scan, progress)?;
    Ok(Raster { rows, cols, values, numbers, place })
}

/// Whether an image has one channel of numbers and one of alpha.
fn has_alpha<R: Read + Seek>(decoder: &mut Decoder<R>, colour: ColorType) -> bool {
    let extra = decoder.get_tag_u16_vec(Tag::ExtraSamples).unwrap_or_default();
    let kinds = [ExtraSamples::AssociatedAlpha, ExtraSamples::UnassociatedAlpha];
    colour.num_samples() == 2 && kinds.iter().any(|kind| extra == [kind.to_u16()])
}

/// The numbers of a tile or strip, channel by channel of each pixel.
fn each(data: &DecodingResult) -> Box<dyn ExactSizeIterator<Item = f64> + '_> {
    match data {
        DecodingResult::U8(v) => Box::new(v.iter().map(|&x| f64::from(x))),
        DecodingResult::U16(v) => Box::new(v.iter().map(|&x| f64::from(x))),
        DecodingResult::U32(v) => Box::new(v.iter().map(|&x| f64::from(x))),
        DecodingResult::U64(v) => Box::new(v.iter().map(|&x| x as f64)),
        DecodingResult::I8(v) => Box::new(v.iter().map(|&x| f64::from(x))),
        DecodingResult::I16(v) => Box::new(v.iter().map(|&x| f64::from(x))),
        DecodingResult::I32(v) => Box::new(v.iter().map(|&x| f64::from(x))),
        DecodingResult::I64(v) => Box::new(v.iter().map(|&x| x as f64)),
        DecodingResult::F16(v) => Box::new(v.iter().map(|&x| f64::from(f32::from(x)))),
        DecodingResult::F32(v) => Box::new(v.iter().map(|&x| f64::from(x))),
        DecodingResult::F64(v) => Box::new(v.iter().copied()),
    }
}

/// Values, NaN where alpha is 0. Alpha follows each value unless it is kept apart.
struct Opaque<'a> {
    values: Box<dyn ExactSizeIterator<Item = f64> + 'a>,
    alpha: Option<Box<dyn ExactSizeIterator<Item = f64> + 'a>>,
}

impl Iterator for Opaque<'_> {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let value = self.values.next()?;
        let alpha = self.alpha.as_mut().unwrap_or(&mut self.values).next()?;
        Some(if alpha == 0.0 { f64::NAN } else { value })
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let count = self.alpha.as_ref().map_or(self.values.len() / 2, |alpha| alpha.len().min(self.values.len()));
        (count, Some(count))
    }
}

impl ExactSizeIterator for Opaque<'_> {}

/// The place of a GeoTIFF, if it says so plainly.
fn place<R: Read + Seek>(decoder: &mut Decoder<R>, scan: &FileScan) -> Option<Place> {
    if scan.options.camera.is_some() {
        return None;
    }
    let scale = decoder.get_tag_f64_vec(Tag::ModelPixelScaleTag).ok()?;
    let tie = decoder.get_tag_f64_vec(Tag::ModelTiepointTag).ok()?;
    let (&[dx, dy, ..], &[col, row, _, x, y, ..]) = (scale.as_slice(), tie.as_slice()) else { return None };
    let directory = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap_or_default();
    let keys = GeoKeys { directory: &directory, text: &[] };
    // GTRasterType 1: the tie point is a corner of a pixel, not its centre.
    let half = if keys.value(1025) == Some(2) { 0.0 } else { 0.5 };
    let place =
        Place { first: [x + (half - col) * dx, y - (half - row) * dy], step: [dx, -dy], degrees: keys.are_degrees() };
    let usable = dx > 0.0 && dy > 0.0 && dx.is_finite() && dy.is_finite() && place.first.iter().all(|x| x.is_finite());
    usable.then_some(place)
}

/// The coordinate reference system of a map that says where it lies.
///
/// # Errors
/// The file can't be read.
pub(in super::super) fn named(scan: &FileScan) -> Result<std::result::Result<Option<Crs>, String>> {
    watched(&mut file::open(&scan.path)?.0, &scan.path, |input| {
        let Ok(mut decoder) = Decoder::new(input) else { return Ok(Ok(None)) };
        let Some(place) = place(&mut decoder, scan) else { return Ok(Ok(None)) };
        let directory = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap_or_default();
        let text = decoder.get_tag_ascii_string(Tag::GeoAsciiParamsTag).unwrap_or_default();
        let keys = GeoKeys { directory: &directory, text: text.as_bytes() };
        Ok(match keys.crs() {
            Ok(Some(crs)) if place.degrees => Err(format!(
                "places in degrees ({crs}) are not lengths: they become metres from the corner of the map, which are in no system"
            )),
            named => named,
        })
    })
}

#[cfg(test)]
mod tests;
