//! Masks of TIFF, as GDAL writes them: a further image of the same size, of one bit a pixel, which is 0 where the first image has
//! no value.
//!
//! The crate `tiff` decodes images of grey and none that say to be masks, though the bits are stored alike. So an [`Overlay`] makes
//! one say that it is grey.

use std::io::{Read, Result as IoResult, Seek, SeekFrom};

use ::tiff::decoder::{Decoder, DecodingResult};
use ::tiff::tags::{ByteOrder, Tag};

use super::super::super::Scan;
use super::super::super::file::decoding_error;
use base::error::{Error, Result};
use base::progress::Progress;

/// What `PhotometricInterpretation` is of masks, and of grey.
const MASK: u16 = 4;
const GREY: u16 = 1;
/// The bit of `NewSubfileType` of images that are reduced copies.
const REDUCED: u32 = 1;
/// Images that are looked at, and entries of one's directory.
const MOST: u32 = 256;
const MOST_ENTRIES: u64 = 4096;
/// The type of numbers of 16 bits.
const SHORT: u16 = 3;

/// A file in which two bytes in one place are read as others.
pub(super) struct Overlay<R> {
    input: R,
    at: u64,
    other: Option<(u64, [u8; 2])>,
}

impl<R> Overlay<R> {
    /// The file as it is, from its start on.
    pub(super) fn new(input: R) -> Self {
        Overlay { input, at: 0, other: None }
    }
}

impl<R: Read> Read for Overlay<R> {
    fn read(&mut self, buffer: &mut [u8]) -> IoResult<usize> {
        let count = self.input.read(buffer)?;
        if let Some((place, bytes)) = self.other {
            for (place, byte) in (place..).zip(bytes) {
                let read = place.checked_sub(self.at).and_then(|at| buffer[..count].get_mut(usize::try_from(at).ok()?));
                read.into_iter().for_each(|read| *read = byte);
            }
        }
        self.at += count as u64;
        Ok(count)
    }
}

impl<R: Seek> Seek for Overlay<R> {
    fn seek(&mut self, to: SeekFrom) -> IoResult<u64> {
        self.at = self.input.seek(to)?;
        Ok(self.at)
    }
}

/// Makes the values of a file's first image NaN where its mask, if it has one, says that there are none.
pub(super) fn apply<R: Read + Seek>(
    decoder: &mut Decoder<Overlay<R>>,
    values: &mut [f64],
    cols: usize,
    scan: &Scan,
    progress: &Progress<'_>,
) -> Result<()> {
    for index in 1..MOST {
        // Images behind the first that can't be read are none of its masks.
        if !decoder.more_images() || decoder.next_image().is_err() {
            return Ok(());
        }
        let mut number = |tag| decoder.find_tag_unsigned::<u32>(tag).ok().flatten();
        let (kind, meaning) = (number(Tag::NewSubfileType).unwrap_or(0), number(Tag::PhotometricInterpretation));
        let Ok((width, height)) = decoder.dimensions() else { return Ok(()) };
        let is_whole = kind & REDUCED == 0 && [width as usize, height as usize] == [cols, values.len() / cols];
        if meaning != Some(MASK.into()) || !is_whole {
            continue;
        }
        let order = decoder.byte_order();
        let Some(place) = decoder.ifd_pointer().and_then(|at| place_of_meaning(decoder.inner(), at.0, order).ok()?)
        else {
            return Ok(());
        };
        let grey = if order == ByteOrder::LittleEndian { GREY.to_le_bytes() } else { GREY.to_be_bytes() };
        decoder.inner().other = Some((place, grey));
        decoder.seek_to_image(index as usize).map_err(|error| decoding_error(scan, &error))?;
        return cut_out(decoder, values, cols, scan, progress);
    }
    Ok(())
}

/// Where an image's directory says what its pixels mean.
fn place_of_meaning(input: &mut (impl Read + Seek), directory: u64, order: ByteOrder) -> IoResult<Option<u64>> {
    let mut bytes = [0; 8];
    input.seek(SeekFrom::Start(0))?;
    input.read_exact(&mut bytes[..4])?;
    let number = |bytes: &[u8]| {
        let digit = |sum: u64, byte: &u8| (sum << 8) | u64::from(*byte);
        if order == ByteOrder::LittleEndian { bytes.iter().rev().fold(0, digit) } else { bytes.iter().fold(0, digit) }
    };
    // Files of BigTIFF have longer counts.
    let is_big = number(&bytes[2..4]) == 43;
    let (count_size, entry_size, value) = if is_big { (8, 20, 12) } else { (2, 12, 8) };
    input.seek(SeekFrom::Start(directory))?;
    input.read_exact(&mut bytes[..count_size])?;
    let mut entry = [0; 20];
    for k in 0..number(&bytes[..count_size]).min(MOST_ENTRIES) {
        input.read_exact(&mut entry[..entry_size])?;
        if number(&entry[..2]) == u64::from(Tag::PhotometricInterpretation.to_u16()) {
            let is_short = number(&entry[2..4]) == u64::from(SHORT);
            let place = directory + count_size as u64 + k * entry_size as u64 + value;
            return Ok(is_short.then_some(place));
        }
    }
    Ok(None)
}

/// Decodes the mask at which the decoder stands.
fn cut_out<R: Read + Seek>(
    decoder: &mut Decoder<Overlay<R>>,
    values: &mut [f64],
    cols: usize,
    scan: &Scan,
    progress: &Progress<'_>,
) -> Result<()> {
    let wrong = |error: ::tiff::TiffError| decoding_error(scan, &error);
    let fail = |problem: String| Err(Error::format(&scan.path, "mask", problem));
    let colour = decoder.colortype().map_err(wrong)?;
    let bits = colour.bit_depth() as usize;
    if colour.num_samples() != 1 || !matches!(bits, 1 | 8) {
        return fail(format!("{} channels of {bits} bits; a mask has one, of 1 or 8 bits", colour.num_samples()));
    }
    let (wide, high) = decoder.chunk_dimensions();
    if wide == 0 || high == 0 {
        return fail("tiles or strips without pixels".to_owned());
    }
    let across = cols.div_ceil(wide as usize);
    let chunks = across * (values.len() / cols).div_ceil(high as usize);
    for chunk in 0..chunks {
        progress.check()?;
        let Ok(index) = u32::try_from(chunk) else { return fail("too many tiles".to_owned()) };
        let (used_cols, used_rows) = decoder.chunk_data_dimensions(index);
        let (used_cols, used_rows) = (used_cols as usize, used_rows as usize);
        let DecodingResult::U8(data) = decoder.read_chunk(index).map_err(wrong)? else {
            return fail("its pixels are not whole numbers without a sign".to_owned());
        };
        let row_size = (used_cols * bits).div_ceil(8);
        if data.len() < row_size * used_rows {
            return fail(format!("tile or strip {chunk} has too few pixels"));
        }
        let corner = (chunk / across * high as usize) * cols + chunk % across * wide as usize;
        for (row, data) in data.chunks_exact(row_size).take(used_rows).enumerate() {
            let row = &mut values[corner + row * cols..][..used_cols];
            for (col, value) in row.iter_mut().enumerate() {
                let is_set = if bits == 1 { data[col / 8] & (0x80 >> (col % 8)) != 0 } else { data[col] != 0 };
                if !is_set {
                    *value = f64::NAN;
                }
            }
        }
    }
    Ok(())
}
