//! Images packed by Zstandard, which the crate `tiff` unpacks through a library in C alone. Tiles and strips are unpacked here, one at a
//! time, to behind the end of the file ([`Overlay`]). There the image is said to have them, plain.

use std::io::{Read, Seek, SeekFrom};

use ::tiff::ColorType;
use ::tiff::decoder::{ChunkType, Decoder};
use ::tiff::tags::Tag;
use ruzstd::decoding::StreamingDecoder;

use super::overlay::{As, Overlay, read_as};
use crate::import::file::{decoding_error, reserve};
use crate::import::scan::FileScan;
use base::error::{Error, Result};

/// The number of the compression, and that of none.
const ZSTD: u16 = 50000;
const PLAIN: u16 = 1;

/// Bytes that one byte can become: blocks of the same byte, 128 KiB of four.
pub(super) const MOST: u64 = 1 << 15;

/// Places of the tiles or strips of an image.
pub(super) struct Packed {
    chunks: Vec<(u64, u64)>,
    /// The place behind the file at which the unpacked one begins, and its bytes.
    begin: usize,
    size: usize,
}

impl Packed {
    /// Of the image of this number, at which the decoder stands. `None` if it is not packed so.
    pub(super) fn of<R: Read + Seek>(
        decoder: &mut Decoder<Overlay<R>>,
        image: usize,
        colour: ColorType,
        scan: &FileScan,
    ) -> Result<Option<Packed>> {
        if decoder.find_tag_unsigned::<u16>(Tag::Compression).ok().flatten() != Some(ZSTD) {
            return Ok(None);
        }
        let wrong = |error: ::tiff::TiffError| decoding_error(scan, &error);
        let (places, sizes) = match decoder.get_chunk_type() {
            ChunkType::Strip => (Tag::StripOffsets, Tag::StripByteCounts),
            ChunkType::Tile => (Tag::TileOffsets, Tag::TileByteCounts),
        };
        let chunks: Vec<(u64, u64)> = decoder
            .get_tag_u64_vec(places)
            .and_then(|all| Ok(all.into_iter().zip(decoder.get_tag_u64_vec(sizes)?).collect()))
            .map_err(wrong)?;
        let (cols, rows) = decoder.chunk_dimensions();
        let rows = rows.min(decoder.dimensions().map_err(wrong)?.1);
        let row = (u64::from(cols) * u64::from(colour.bit_depth()) * u64::from(colour.num_samples())).div_ceil(8);
        let size = row.saturating_mul(rows.into());
        let count = chunks.len() as u64;
        // The lists of places and sizes, of eight bytes a number at most, come first.
        let file = decoder.inner();
        let begin = file.length + file.behind.len() as u64 + 16 * count;
        let tags =
            [(Tag::Compression, As::Short(PLAIN)), (places, As::Times(count, begin)), (sizes, As::Times(count, size))];
        let is_said = read_as(decoder, &tags).map_err(|error| Error::io(&scan.path, error))?;
        let (begin, size) = (begin - decoder.inner().length, usize::try_from(size));
        let (true, Ok(size)) = (is_said, size) else {
            let problem = "tiles or strips packed by Zstandard are too large beside the file: write it as BigTIFF";
            return Err(Error::format(&scan.path, "header", problem));
        };
        decoder.seek_to_image(image).map_err(wrong)?;
        Ok(Some(Packed { chunks, begin: begin as usize, size }))
    }

    /// Bytes of the largest tile or strip.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// Unpacks a tile or strip: it is what the decoder reads next.
    pub(super) fn unpack<R: Read + Seek>(
        &self,
        decoder: &mut Decoder<Overlay<R>>,
        chunk: usize,
        scan: &FileScan,
    ) -> Result<()> {
        let fail = |problem: String| Err(Error::format(&scan.path, format!("tile or strip {chunk}"), problem));
        let file = decoder.inner();
        let Some(&(place, length)) = self.chunks.get(chunk) else { return fail("the file has fewer".to_owned()) };
        if place.checked_add(length).is_none_or(|end| end > file.length) {
            return fail(format!("its {length} bytes go beyond the end of the file"));
        }
        let io = |error| Error::io(&scan.path, error);
        let mut packed = reserve(length as usize, &scan.path)?;
        file.input.seek(SeekFrom::Start(place)).map_err(io)?;
        (&mut file.input).take(length).read_to_end(&mut packed).map_err(io)?;
        let lists = file.behind.len().min(self.begin);
        let most = self.size.min(usize::try_from(length.saturating_mul(MOST)).unwrap_or(usize::MAX));
        let mut behind = reserve(self.begin.saturating_add(most), &scan.path)?;
        behind.extend_from_slice(&file.behind[..lists]);
        behind.resize(self.begin, 0);
        let unpacked = match StreamingDecoder::new(&packed[..]) {
            Ok(unpacking) => unpacking.take(most as u64).read_to_end(&mut behind).map_err(|error| error.to_string()),
            Err(error) => Err(error.to_string()),
        };
        if let Err(problem) = unpacked {
            return fail(format!("it can't be unpacked: {problem}"));
        }
        file.behind = behind;
        Ok(())
    }
}
