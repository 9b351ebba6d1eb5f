//! Masks of TIFF, as GDAL writes them: a further image of the same size, of one bit per pixel, which is 0 where the first image has no
//! value.
//!
//! The crate `tiff` decodes images of grey and none that say to be masks, though the bits are stored alike. So an [`Overlay`] makes
//! one say that it is grey.

use std::io::{Read, Seek};

use ::tiff::decoder::{Decoder, DecodingResult};
use ::tiff::tags::Tag;

use super::overlay::{As, Overlay, read_as};
use super::zstd::Packed;
use crate::import::file::decoding_error;
use crate::import::scan::FileScan;
use base::error::{Error, Result};
use base::log::{self, Level};
use base::progress::Progress;

/// Values of `PhotometricInterpretation` for masks, and for grey.
const MASK: u16 = 4;
const GREY: u16 = 1;
/// The bit of `NewSubfileType` of images that are reduced copies.
const REDUCED: u32 = 1;
/// Images that are looked at.
const MOST: u32 = 256;

/// Makes the values of a file's first image NaN where its mask, if it has one, says that there are none.
pub(super) fn apply<R: Read + Seek>(
    decoder: &mut Decoder<Overlay<R>>,
    values: &mut [f64],
    cols: usize,
    scan: &FileScan,
    progress: &Progress<'_>,
) -> Result<()> {
    let mut is_behind_a_page = false;
    for index in 1..MOST {
        if !decoder.more_images() {
            return Ok(());
        }
        let Some((width, height)) = decoder.next_image().and_then(|()| decoder.dimensions()).ok() else {
            let words = format!(
                "{}: image {} of the file cannot be read. If it is a mask, nothing is masked.",
                scan.name,
                index + 1
            );
            log::tell(Level::Warning, &words);
            return Ok(());
        };
        let mut number = |tag| decoder.find_tag_unsigned::<u32>(tag).ok().flatten();
        let (kind, meaning) = (number(Tag::NewSubfileType).unwrap_or(0), number(Tag::PhotometricInterpretation));
        let is_reduced = kind & REDUCED != 0;
        if is_reduced || meaning != Some(MASK.into()) {
            is_behind_a_page |= !is_reduced;
            continue;
        }
        let (rows, size) = (values.len() / cols, [width as usize, height as usize]);
        if size != [cols, rows] {
            // The mask of a further page.
            if is_behind_a_page {
                continue;
            }
            let problem =
                format!("{} x {} pixels, but the image has {rows} x {cols}: they must be the same", size[1], size[0]);
            return Err(Error::format(&scan.path, "mask", problem));
        }
        let is_grey = read_as(decoder, &[(Tag::PhotometricInterpretation, As::Short(GREY))]);
        if is_grey.map_err(|error| Error::io(&scan.path, error))? {
            decoder.seek_to_image(index as usize).map_err(|error| decoding_error(scan, &error))?;
            return cut_out(decoder, values, [cols, index as usize], scan, progress);
        }
    }
    Ok(())
}

/// Decodes the mask at which the decoder stands, the image of this number, of an image of so many columns.
fn cut_out<R: Read + Seek>(
    decoder: &mut Decoder<Overlay<R>>,
    values: &mut [f64],
    [cols, image]: [usize; 2],
    scan: &FileScan,
    progress: &Progress<'_>,
) -> Result<()> {
    let wrong = |error: ::tiff::TiffError| decoding_error(scan, &error);
    let fail = |problem: String| Err(Error::format(&scan.path, "mask", problem));
    let colour = decoder.colortype().map_err(wrong)?;
    let bits = colour.bit_depth() as usize;
    if colour.num_samples() != 1 || !matches!(bits, 1 | 8) {
        return fail(format!("{} channels of {bits} bits, but a mask has one, of 1 or 8 bits", colour.num_samples()));
    }
    let packed = Packed::of(decoder, image, colour, scan)?;
    let (wide, high) = decoder.chunk_dimensions();
    if wide == 0 || high == 0 {
        return fail("tiles or strips must have pixels".to_owned());
    }
    let across = cols.div_ceil(wide as usize);
    let chunks = across * (values.len() / cols).div_ceil(high as usize);
    for chunk in 0..chunks {
        progress.check()?;
        let Ok(index) = u32::try_from(chunk) else { return fail("too many tiles".to_owned()) };
        let (used_cols, used_rows) = decoder.chunk_data_dimensions(index);
        let (used_cols, used_rows) = (used_cols as usize, used_rows as usize);
        packed.iter().try_for_each(|packed| packed.unpack(decoder, chunk, scan))?;
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
