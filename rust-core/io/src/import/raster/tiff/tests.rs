//! Pixels without a value: masks and alpha.

use std::io::{Cursor, Write as _};
use std::path::Path;
use std::sync::{Arc, Mutex};

use ::tiff::encoder::{TiffEncoder, TiffKind, colortype};
use ::tiff::tags::Tag;

use super::super::super::damage::{endure, read};
use super::super::super::{Content, FileScan};
use super::*;
use base::context::{Context, choose};
use base::log::Log;

const NAN: f64 = f64::NAN;
const DEFLATE: u16 = 8;
const ZSTD: u16 = 50000;

fn scan() -> FileScan {
    FileScan::new(Path::new("x.tif"))
}

fn values(bytes: &[u8]) -> Vec<f64> {
    let Content::RangeImage(image) = read(parse, bytes, &scan()).unwrap() else { panic!("no image") };
    let image::range_image::Samples::Values(values) = image.samples() else { panic!("no values") };
    values.clone()
}

/// As [`values`], where NaN is none.
fn some(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().map(|value| Some(*value).filter(|value| !value.is_nan())).collect()
}

/// One image of a file: its channels one after the other in each pixel, or of all pixels where they are kept apart.
#[derive(Clone, Copy)]
struct Stored<'a> {
    size: [u32; 2],
    kind: u32,
    meaning: u16,
    bits: &'a [u16],
    format: u16,
    /// Strips of bytes, and their rows.
    strips: &'a [&'a [u8]],
    rows_per_strip: u32,
    more: &'a [(Tag, u16)],
}

impl Stored<'_> {
    fn write<K: TiffKind>(&self, encoder: &mut TiffEncoder<&mut Cursor<Vec<u8>>, K>) {
        let mut tags = encoder.image_directory().unwrap();
        let is_packed = |by: u16| self.more.contains(&(Tag::Compression, by));
        let (mut places, mut lengths) = (Vec::new(), Vec::new());
        for strip in self.strips {
            let bytes = if is_packed(DEFLATE) {
                let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
                packed.write_all(strip).unwrap();
                packed.finish().unwrap()
            } else if is_packed(ZSTD) {
                ruzstd::encoding::compress_to_vec(*strip, ruzstd::encoding::CompressionLevel::Fastest)
            } else {
                strip.to_vec()
            };
            places.push(tags.write_data(&bytes[..]).unwrap() as u32);
            lengths.push(bytes.len() as u32);
        }
        tags.write_tag(Tag::NewSubfileType, self.kind).unwrap();
        tags.write_tag(Tag::ImageWidth, self.size[0]).unwrap();
        tags.write_tag(Tag::ImageLength, self.size[1]).unwrap();
        tags.write_tag(Tag::BitsPerSample, self.bits).unwrap();
        tags.write_tag(Tag::SampleFormat, &vec![self.format; self.bits.len()][..]).unwrap();
        tags.write_tag(Tag::SamplesPerPixel, self.bits.len() as u16).unwrap();
        tags.write_tag(Tag::PhotometricInterpretation, self.meaning).unwrap();
        tags.write_tag(Tag::RowsPerStrip, self.rows_per_strip).unwrap();
        tags.write_tag(Tag::StripOffsets, &places[..]).unwrap();
        tags.write_tag(Tag::StripByteCounts, &lengths[..]).unwrap();
        self.more.iter().for_each(|&(tag, value)| tags.write_tag(tag, value).unwrap());
        tags.finish().unwrap();
    }
}

/// Heights 0 to 29 in ten columns, then the images behind them.
fn with_behind(behind: &[Stored<'_>], is_big: bool) -> Vec<u8> {
    fn write<K: TiffKind>(mut encoder: TiffEncoder<&mut Cursor<Vec<u8>>, K>, behind: &[Stored<'_>]) {
        let heights: Vec<f32> = (0..30_u8).map(f32::from).collect();
        encoder.write_image::<colortype::Gray32Float>(10, 3, &heights).unwrap();
        behind.iter().for_each(|image| image.write(&mut encoder));
    }
    let mut bytes = Cursor::new(Vec::new());
    if is_big {
        write(TiffEncoder::new_big(&mut bytes).unwrap(), behind);
    } else {
        write(TiffEncoder::new(&mut bytes).unwrap(), behind);
    }
    bytes.into_inner()
}

const BITS: Stored<'_> = Stored {
    size: [10, 3],
    kind: 4,
    meaning: 4,
    bits: &[1],
    format: 1,
    // All, none, and all but the second and the last.
    strips: &[&[0xFF, 0xC0, 0, 0], &[0xBF, 0x80]],
    rows_per_strip: 2,
    more: &[],
};

fn masked() -> Vec<f64> {
    let is_set = |i: usize| i < 10 || (i >= 20 && i != 21 && i != 29);
    (0..30).map(|i| if is_set(i) { i as f64 } else { NAN }).collect()
}

#[test]
fn masks_in_the_file_are_applied() {
    let whole: Vec<f64> = (0..30).map(f64::from).collect();
    assert_eq!(values(&with_behind(&[], false)), whole);
    let bytes = [[1; 10], [0; 10], [1, 0, 255, 1, 1, 1, 1, 1, 1, 0]].concat();
    let of_bytes = Stored { bits: &[8], strips: &[&bytes], rows_per_strip: 3, ..BITS };
    let small = Stored { size: [5, 2], kind: 5, strips: &[&[0, 0]], ..BITS };
    let packed = Stored { more: &[(Tag::Compression, DEFLATE)], ..BITS };
    let zstd = Stored { more: &[(Tag::Compression, ZSTD)], ..BITS };
    for is_big in [false, true] {
        for behind in [vec![BITS], vec![packed], vec![zstd], vec![of_bytes], vec![small, BITS]] {
            let file = with_behind(&behind, is_big);
            assert_eq!(some(&values(&file)), some(&masked()));
        }
        // Overviews, pages and masks of overviews mask nothing.
        let grey = Stored { kind: 0, meaning: 1, ..BITS };
        let of_overview = Stored { kind: 5, size: [5, 3], strips: &[&[0, 0], &[0]], ..BITS };
        let of_page = Stored { size: [5, 3], ..of_overview };
        assert_eq!(values(&with_behind(&[grey, of_overview, Stored { kind: 4, ..of_page }], is_big)), whole);
    }
    let other = Stored { size: [5, 3], strips: &[&[0, 0], &[0]], ..BITS };
    let error = read(parse, &with_behind(&[other], false), &scan()).unwrap_err().to_string();
    assert!(error.ends_with("mask: 3 x 5 pixels, but the image has 3 x 10: they must be the same"), "{error}");
    let deep = Stored { bits: &[16], strips: &[&[0; 60]], rows_per_strip: 3, ..BITS };
    let error = read(parse, &with_behind(&[deep], false), &scan()).unwrap_err().to_string();
    assert!(error.ends_with("mask: 1 channels of 16 bits, but a mask has one, of 1 or 8 bits"), "{error}");
    endure(parse, &with_behind(&[BITS], false), &scan());
    endure(parse, &with_behind(&[BITS], true), &scan());
}

/// Numbers of big-endian files, too.
#[test]
fn an_image_behind_that_is_gone_is_told() {
    let mut file = with_behind(&[], false);
    let number = |at: usize, file: &[u8]| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let first = number(4, &file);
    let next = first + 2 + 12 * (number(first, &file) & 0xFFFF);
    file[next..next + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    let heard = Arc::new(Mutex::new(Vec::new()));
    let listener = heard.clone();
    let context = Context::new().unwrap();
    context.set_log(Log::To(Arc::new(move |_, text: &str| listener.lock().unwrap().push(text.to_owned()))));
    choose(Some(context));
    let found = memory::guarded(|| Ok::<_, Error>(values(&file)));
    choose(None);
    assert_eq!(found.unwrap(), (0..30).map(f64::from).collect::<Vec<f64>>());
    assert_eq!(*heard.lock().unwrap(), ["x: image 2 of the file cannot be read. If it is a mask, nothing is masked."]);
}

#[test]
fn masks_of_either_byte_order() {
    let mut bytes = b"MM\0*\0\0\0\x08".to_vec();
    let entries = |kind: u32, meaning: u16, bits: u16, data: u32, length: u32| -> Vec<[u32; 4]> {
        let short = |value: u16| u32::from(value) << 16;
        vec![
            [254, 4, 1, kind],
            [256, 4, 1, 2],
            [257, 4, 1, 1],
            [258, 3, 1, short(bits)],
            [259, 3, 1, short(1)],
            [262, 3, 1, short(meaning)],
            [273, 4, 1, data],
            [279, 4, 1, length],
        ]
    };
    let size = 2 + 8 * 12 + 4;
    let data = 8 + 2 * size;
    let images = [entries(0, 1, 16, data, 4), entries(4, 4, 1, data + 4, 1)];
    for (entries, next) in images.iter().zip([8 + size, 0]) {
        bytes.extend(8_u16.to_be_bytes());
        for &[tag, kind, count, value] in entries {
            bytes.extend((tag as u16).to_be_bytes());
            bytes.extend((kind as u16).to_be_bytes());
            bytes.extend(count.to_be_bytes());
            bytes.extend(value.to_be_bytes());
        }
        bytes.extend(next.to_be_bytes());
    }
    bytes.extend([0x01, 0x02, 0x03, 0x04, 0x40]);
    assert_eq!(some(&values(&bytes)), [None, Some(772.0)]);
}

/// A file of one image alone.
fn alone(image: &Stored<'_>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write(&mut TiffEncoder::new(&mut bytes).unwrap());
    bytes.into_inner()
}

#[test]
fn alpha_is_applied() {
    let pixels = [7_u8, 255, 8, 0, 9, 1, 10, 0];
    let words: Vec<u8> = pixels.iter().flat_map(|&x| u16::from(x).to_le_bytes()).collect();
    let floats: Vec<u8> = pixels.iter().flat_map(|&x| f32::from(x).to_le_bytes()).collect();
    let expected = [Some(7.0), None, Some(9.0), None];
    for (bits, format, data) in [(8, 1, &pixels[..]), (16, 1, &words), (32, 3, &floats)] {
        let strips = data.split_at(data.len() / 2);
        for kind in [1, 2] {
            let image = Stored {
                size: [2, 2],
                kind: 0,
                meaning: 1,
                bits: &[bits, bits],
                format,
                strips: &[strips.0, strips.1],
                rows_per_strip: 1,
                more: &[(Tag::ExtraSamples, kind)],
            };
            let file = alone(&image);
            assert_eq!(some(&values(&file)), expected, "{bits} bits");
            endure(parse, &file, &scan());
        }
    }
    let apart = Stored {
        size: [2, 2],
        kind: 0,
        meaning: 1,
        bits: &[8, 8],
        format: 1,
        strips: &[&[7, 8], &[9, 10], &[255, 0], &[1, 0]],
        rows_per_strip: 1,
        more: &[(Tag::ExtraSamples, 2), (Tag::PlanarConfiguration, 2)],
    };
    assert_eq!(some(&values(&alone(&apart))), expected);
    // The sense of a second channel must be said.
    let unknown = Stored { more: &[(Tag::ExtraSamples, 0)], strips: &[&pixels], rows_per_strip: 2, ..apart };
    let error = read(parse, &alone(&unknown), &scan()).unwrap_err().to_string();
    assert!(error.contains("2 channels a pixel, but a height map or depth image has one"), "{error}");
}

/// Theorem: Zstandard gives what plain files do, by strips of any size, in any predictor, with channels apart or not.
#[test]
fn zstandard_is_unpacked() {
    let whole: Vec<u16> = (0..6000_u32).map(|i| (i * i % 977) as u16).collect();
    let bytes: Vec<u8> = whole.iter().flat_map(|x| x.to_le_bytes()).collect();
    let differences: Vec<u8> = whole
        .chunks(60)
        .flat_map(|row| row.iter().scan(0_u16, |before, &x| Some(x.wrapping_sub(std::mem::replace(before, x)))))
        .flat_map(u16::to_le_bytes)
        .collect();
    let expected: Vec<f64> = whole.iter().map(|&x| f64::from(x)).collect();
    for rows in [100, 7, 1] {
        let plain: Vec<&[u8]> = bytes.chunks(120 * rows).collect();
        let predicted: Vec<&[u8]> = differences.chunks(120 * rows).collect();
        let stored = Stored {
            size: [60, 100],
            kind: 0,
            meaning: 1,
            bits: &[16],
            format: 1,
            strips: &plain,
            rows_per_strip: rows as u32,
            more: &[(Tag::Compression, ZSTD)],
        };
        let more = [(Tag::Compression, ZSTD), (Tag::Predictor, 2)];
        for image in [stored, Stored { strips: &predicted, more: &more, ..stored }] {
            assert_eq!(values(&alone(&image)), expected, "{rows} rows a strip");
            let mut bytes = Cursor::new(Vec::new());
            image.write(&mut TiffEncoder::new_big(&mut bytes).unwrap());
            assert_eq!(values(&bytes.into_inner()), expected, "{rows} rows a strip, BigTIFF");
        }
        endure(parse, &alone(&stored), &scan());
    }
    let apart = Stored {
        size: [2, 2],
        kind: 0,
        meaning: 1,
        bits: &[8, 8],
        format: 1,
        strips: &[&[7, 8], &[9, 10], &[255, 0], &[1, 0]],
        rows_per_strip: 1,
        more: &[(Tag::ExtraSamples, 2), (Tag::PlanarConfiguration, 2), (Tag::Compression, ZSTD)],
    };
    assert_eq!(some(&values(&alone(&apart))), [Some(7.0), None, Some(9.0), None]);
}
