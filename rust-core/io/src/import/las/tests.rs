use std::io::Cursor;
use std::path::Path;

use glam::DVec3;
use laz::{LasZipCompressor, LazItemRecordBuilder, LazVlr, LazVlrBuilder};

use super::super::damage;
use super::header::{RECORD, SIZES};
use super::points::COLOUR;
use super::*;
use mesh::point_cloud::PointCloud;

const POINTS: u32 = 60;

/// Point `i` of a file: whole numbers of centimetres around (4e6, 5e6, 100).
fn record(format: usize, i: u32, wide: bool) -> Vec<u8> {
    let mut bytes = vec![0; usize::from(SIZES[format]) + 2];
    let numbers = [10 * i, 4_000_000 - 7 * i, i * i % 100];
    numbers.iter().enumerate().for_each(|(k, x)| bytes[4 * k..4 * k + 4].copy_from_slice(&x.to_le_bytes()));
    bytes[12..14].copy_from_slice(&(i as u16 * 3).to_le_bytes());
    // The first return of one.
    bytes[14] = if format < 6 { 0b00_001_001 } else { 0b0001_0001 };
    if i == 5 {
        bytes[15] = if format < 6 { 0x80 | 2 } else { 0x04 };
    }
    if let Some(at) = COLOUR[format] {
        let by = if wide { 257 } else { 1 };
        let colour = [i as u16, 2 * i as u16, 255].map(|c| c * by);
        colour
            .iter()
            .enumerate()
            .for_each(|(k, c)| bytes[at + 2 * k..at + 2 * k + 2].copy_from_slice(&c.to_le_bytes()));
    }
    bytes
}

/// A file of version 1.4 with two extra bytes per point. `chunk` points a chunk if it is compressed, 0 for any number.
fn file(format: usize, wide: bool, chunk: Option<u32>) -> Vec<u8> {
    let size = SIZES[format] + 2;
    let mut bytes = vec![0; 375];
    let mut put = |at: usize, content: &[u8]| bytes[at..at + content.len()].copy_from_slice(content);
    put(0, b"LASF");
    put(24, &[1, 4]);
    put(94, &375_u16.to_le_bytes());
    put(104, &[format as u8 | if chunk.is_some() { 0x80 } else { 0 }]);
    put(105, &size.to_le_bytes());
    for (k, (scale, offset)) in [(0.01, 4e6), (0.01, 5e6), (0.5, 100.25)].into_iter().enumerate() {
        put(131 + 8 * k, &f64::to_le_bytes(scale));
        put(155 + 8 * k, &f64::to_le_bytes(offset));
    }
    put(247, &u64::from(POINTS).to_le_bytes());
    let records: Vec<u8> = (0..POINTS).flat_map(|i| record(format, i, wide)).collect();
    let Some(chunk) = chunk else {
        put(96, &375_u32.to_le_bytes());
        bytes.extend(records);
        return bytes;
    };
    let items = LazItemRecordBuilder::default_for_point_format_id(format as u8, 2).unwrap();
    let builder = LazVlrBuilder::new(items);
    let packing = match chunk {
        0 => builder.with_variable_chunk_size().build(),
        points => builder.with_fixed_chunk_size(points).build(),
    };
    let mut vlr = Vec::new();
    packing.write_to(&mut vlr).unwrap();
    // Another record comes first.
    let begin = 375 + 2 * RECORD as u32 + 3 + vlr.len() as u32;
    put(96, &begin.to_le_bytes());
    put(100, &2_u32.to_le_bytes());
    let head = |user: &str, id: u16, length: usize| {
        let mut head = [0; RECORD as usize];
        head[2..2 + user.len()].copy_from_slice(user.as_bytes());
        head[18..20].copy_from_slice(&id.to_le_bytes());
        head[20..22].copy_from_slice(&(length as u16).to_le_bytes());
        head
    };
    bytes.extend(head("somebody", 7, 3));
    bytes.extend(b"abc");
    bytes.extend(head(LazVlr::USER_ID, LazVlr::RECORD_ID, vlr.len()));
    bytes.extend(vlr);
    let mut out = Cursor::new(bytes);
    out.set_position(begin.into());
    let mut compressor = LasZipCompressor::new(&mut out, packing).unwrap();
    let per_chunk = if chunk == 0 { 17 } else { POINTS as usize };
    for part in records.chunks(per_chunk * usize::from(size)) {
        compressor.compress_many(part).unwrap();
        if chunk == 0 {
            compressor.finish_current_chunk().unwrap();
        }
    }
    compressor.done().unwrap();
    drop(compressor);
    out.into_inner()
}

fn cloud(bytes: &[u8]) -> PointCloud {
    match damage::read(parse, bytes, &FileScan::new(Path::new("x.las"))) {
        Ok(Content::Points(cloud)) => cloud,
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_format_packed_or_not() {
    for format in 0..SIZES.len() {
        let plain = cloud(&file(format, true, None));
        assert_eq!(plain.positions.len(), POINTS as usize - 1, "one is withheld");
        assert_eq!(plain.positions[4], DVec3::new(4e6 + 0.4, 5e6 + 4e4 - 0.28, 108.25));
        assert_eq!(plain.positions[5].x, 4e6 + 0.6);
        assert_eq!(plain.intensity.as_ref().unwrap()[5], 18.0);
        assert_eq!(plain.colour.is_some(), COLOUR[format].is_some());
        if let Some(colour) = &plain.colour {
            assert_eq!((colour[0], colour[4]), ([0, 0, 255, 255], [4, 8, 255, 255]));
        }
        assert_eq!(cloud(&file(format, false, None)).colour, plain.colour, "8 bits");
        for chunk in [50_000, 16, 0] {
            assert!(cloud(&file(format, true, Some(chunk))) == plain, "format {format}, chunks of {chunk}");
        }
    }
}

#[test]
fn colours_turn_out_to_have_16_bits_late() {
    let mut bytes = file(2, false, None);
    let last = bytes.len() - 8;
    bytes[last..last + 2].copy_from_slice(&0x1234_u16.to_le_bytes());
    let colour = cloud(&bytes).colour.unwrap();
    assert_eq!(colour[POINTS as usize - 2], [0x12, 0, 0, 255]);
    assert!(colour[..POINTS as usize - 2].iter().all(|c| *c == [0, 0, 0, 255]));
}

#[test]
fn what_is_wrong_is_said() {
    let scan = FileScan::new(Path::new("x.las"));
    let told = |change: &dyn Fn(&mut Vec<u8>), chunk: Option<u32>| {
        let mut bytes = file(7, true, chunk);
        change(&mut bytes);
        damage::read(parse, &bytes, &scan).unwrap_err().to_string()
    };
    assert!(told(&|b| b.truncate(100), None).ends_with("header: 100 bytes are fewer than a header has, 227"));
    assert!(told(&|b| b[25] = 9, None).ends_with("version 1.9 is not known: known are 1.0 to 1.4"));
    assert!(told(&|b| b[104] = 11, None).contains("points of format 11 with 38 bytes are not known"));
    assert!(told(&|b| b.truncate(b.len() - 1), None).contains("60 points of 38 bytes don't fit the 2279 bytes left"));
    assert!(told(&|b| b[131..139].fill(0xFF), None).contains("is not usable"));
    assert!(told(&|b| b[252] = 1, None).contains("points of 38 bytes don't fit"));
    assert!(told(&|b| b[252] = 1, Some(16)).contains("unpack to more than max_decoded_gib, 4"));
    assert!(told(&|b| b[249] = 1, Some(16)).contains("the chunks hold 64 of 65596 points"));
    assert!(told(&|b| b[250] = 1, Some(16)).contains("16777276 points can't be in "));
    assert!(told(&|b| b[375 + 57 + 2] = b'x', Some(16)).ends_with("but the record that says how is missing"));
    assert!(told(&|b| b.truncate(b.len() - 4), Some(16)).contains("table of chunks"));
}

#[test]
fn endures_all_damage() {
    let scan = FileScan::new(Path::new("x.las"));
    let little = super::super::ReadOptions { max_decoded_gib: 1e-4, ..Default::default() };
    let scan = FileScan { options: std::sync::Arc::new(little), ..scan };
    for (format, chunk) in [(3, None), (7, None), (3, Some(50_000)), (7, Some(50_000))] {
        damage::endure(parse, &file(format, true, chunk), &scan);
    }
}

#[test]
fn withheld_points_are_counted_aloud() {
    use std::sync::{Arc, Mutex};

    use base::context::{Context, choose};
    use base::log::{Level, Log};

    let heard = Arc::new(Mutex::new(Vec::new()));
    let listener = heard.clone();
    let context = Context::new().unwrap();
    context
        .set_log(Log::To(Arc::new(move |level, text: &str| listener.lock().unwrap().push((level, text.to_owned())))));
    choose(Some(context));
    for chunk in [None, Some(16)] {
        let read = || damage::read(parse, &file(6, false, chunk), &FileScan::new(Path::new("x.las")));
        base::memory::guarded(read).unwrap();
    }
    choose(None);
    let expected = (Level::Info, "x.las: 1 of 60 points are marked as withheld and left out".to_owned());
    assert_eq!(*heard.lock().unwrap(), [expected.clone(), expected]);
}
