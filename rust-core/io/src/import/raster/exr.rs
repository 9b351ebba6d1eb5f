//! OpenEXR: the depth channel of an image, Blender's Z pass among them. Taken is `Z`, else `Depth`, else `V`, else the only channel, also
//! inside a layer (`ViewLayer.Depth.Z`). Of an image of three equal colours the first.
//!
//! Blender's background, 1e10 (65504 in half precision), is no sample. Its Z pass measures along the ray of orthographic
//! cameras and planar depth of others.

use std::io::BufReader;

use ::exr::block::reader::ChunksReader;
use ::exr::compression::Compression;
use ::exr::meta::attribute::SampleType;
use ::exr::prelude::f16;

use super::super::file::{Input, Watched, decoding_error, reserve, watched};
use super::super::scan::{Content, FileScan};
use super::bounds::{DEFLATED, can_be_in, packed_pixels};
use super::content::{Numbers, Raster};
use base::error::{Error, Result};
use base::progress::Progress;

/// From here on a depth is Blender's background.
const BACKGROUND: f64 = 1e10;
const BACKGROUND_HALF: f64 = 65504.0;

/// Bytes that one byte can become by the other compressions, generously.
const WAVELETS: u64 = 1 << 16;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(&[0x76, 0x2f, 0x31, 0x01])
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
    let wrong = |e: ::exr::error::Error| decoding_error(scan, &e);
    let fail = |problem: String| Err(Error::format(&scan.path, "header", problem));
    let reader = ::exr::block::read(input, false).map_err(wrong)?;
    let Some((layer, channel)) = depth_channel(reader.headers()) else {
        let names: Vec<String> = reader
            .headers()
            .iter()
            .flat_map(|header| header.channels.list.iter().map(|channel| channel.name.to_string()))
            .take(20)
            .collect();
        return fail(format!("no channel is a depth (Z, Depth or V): there are {}", names.join(", ")));
    };
    let header = &reader.headers()[layer];
    if header.deep {
        return fail("deep images are not read".to_owned());
    }
    let description = &header.channels.list[channel];
    if (description.sampling.0, description.sampling.1) != (1, 1) {
        return fail("the depth channel is not sampled at every pixel".to_owned());
    }
    let half = description.sample_type == SampleType::F16;
    let background = if half { BACKGROUND_HALF } else { BACKGROUND };
    let sample_type = description.sample_type;
    let (cols, rows) = (header.layer_size.0, header.layer_size.1);
    let count = packed_pixels(rows as u64, cols as u64, scan)?;
    let most = match header.compression {
        Compression::Uncompressed | Compression::RLE | Compression::ZIP1 | Compression::ZIP16 | Compression::PXR24 => {
            DEFLATED
        }
        _ => WAVELETS,
    };
    can_be_in(length, (count * sample_type.bytes_per_sample()) as u64, most, scan)?;
    let channels = header.channels.clone();
    let mut values: Vec<f64> = reserve(count, &scan.path)?;
    values.resize(count, f64::NAN);
    let first_level = |_: &::exr::meta::MetaData, _, block: ::exr::block::BlockIndex| {
        block.layer == layer && (block.level.0, block.level.1) == (0, 0)
    };
    let mut blocks = reader.filter_chunks(false, first_level).map_err(wrong)?.sequential_decompressor(false);
    while let Some(block) = blocks.decompress_next_block() {
        // A few bytes of the file may be many blocks.
        progress.check()?;
        let block = block.map_err(wrong)?;
        for line in block.lines(&channels) {
            if line.location.channel != channel {
                continue;
            }
            let start =
                line.location.position.1.checked_mul(cols).and_then(|s| s.checked_add(line.location.position.0));
            let place = start.and_then(|start| values.get_mut(start..start.checked_add(line.location.sample_count)?));
            let Some(place) = place else { return fail("a line lies outside of the image".to_owned()) };
            let keep = |value: f64| if value >= background { f64::NAN } else { value };
            match sample_type {
                SampleType::F16 => {
                    for (value, sample) in place.iter_mut().zip(line.read_samples::<f16>()) {
                        *value = keep(sample.map_err(wrong)?.to_f64());
                    }
                }
                SampleType::F32 => {
                    for (value, sample) in place.iter_mut().zip(line.read_samples::<f32>()) {
                        *value = keep(sample.map_err(wrong)?.into());
                    }
                }
                SampleType::U32 => {
                    for (value, sample) in place.iter_mut().zip(line.read_samples::<u32>()) {
                        *value = sample.map_err(wrong)?.into();
                    }
                }
            }
        }
    }
    Ok(Raster { rows, cols, values, numbers: Numbers::Real, place: None })
}

/// Layer and number of the channel that is a depth.
fn depth_channel(headers: &[::exr::meta::header::Header]) -> Option<(usize, usize)> {
    let all = || {
        headers.iter().enumerate().flat_map(|(layer, header)| {
            header.channels.list.iter().enumerate().map(move |(k, channel)| (layer, k, channel.name.to_string()))
        })
    };
    for wanted in ["Z", "Depth", "V"] {
        if let Some((layer, k, _)) = all().find(|(_, _, name)| name.rsplit('.').next() == Some(wanted)) {
            return Some((layer, k));
        }
    }
    let names: Vec<(usize, usize, String)> = all().collect();
    let colours = names.iter().all(|(_, _, name)| matches!(name.rsplit('.').next(), Some("R" | "G" | "B" | "A")));
    match names.as_slice() {
        [(layer, k, _)] => Some((*layer, *k)),
        _ if colours => names.iter().find(|(_, _, name)| name.ends_with('R')).map(|(layer, k, _)| (*layer, *k)),
        _ => None,
    }
}
