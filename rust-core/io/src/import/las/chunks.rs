//! LAZ: points in chunks, each decoded on its own.
//!
//! The crate allocates what a chunk's header claims and indexes with what it decodes. So chunks are cut out here by the
//! table at the end of the file, their claims are compared with their bytes, and a decoder that stumbles is an error.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use laz::laszip::{ChunkTable, CompressorType};
use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use laz::{LazItem, LazItemType, LazVlr};
use rayon::prelude::*;

use super::bytes::{fail, read_exact, seek, u32_at, u64_at};
use super::points::Points;
use crate::import::file::{Input, reserve};
use crate::import::scan::FileScan;
use base::error::{Error, Result};
use base::memory;
use base::threads;

/// Bytes of decoded points held at once, unless one chunk has more.
const HELD: usize = 16 << 20;
/// Most extra bytes per point: the models of each take some kilobytes.
const EXTRA: u64 = 1024;

/// A chunk as it lies in the file.
struct Chunk {
    bytes: Vec<u8>,
    /// Number of its first point, and how many it has.
    first: u64,
    count: usize,
}

/// Reads all points of a file that has them from byte `begin` on and ends at `length`.
pub(super) fn read(
    input: &mut dyn Input,
    [begin, length]: [u64; 2],
    packing: &LazVlr,
    points: &mut Points,
    scan: &FileScan,
) -> Result<()> {
    let (count, size) = (points.header.count, points.header.size);
    check_items(packing.items(), size, scan)?;
    if count == 0 {
        return Ok(());
    }
    let chunks = match kind(packing) {
        Kind::Whole => vec![(begin, length - begin, count)],
        Kind::Chunked => table(input, [begin, length], packing, points, scan)?,
    };
    let pool = threads::pool(0)?;
    let (mut first, mut next) = (0, chunks.into_iter().peekable());
    while next.peek().is_some() {
        let (mut group, mut held) = (Vec::new(), 0);
        while let Some((at, bytes, count)) = next.next_if(|chunk| held == 0 || held + chunk.2 as usize * size <= HELD) {
            let mut content: Vec<u8> = reserve(bytes as usize, &scan.path)?;
            content.resize(bytes as usize, 0);
            seek(input, at, &scan.path)?;
            read_exact(input, &mut content, scan, &format!("points from {first}"))?;
            held += (count as usize * size).max(1);
            group.push(Chunk { bytes: content, first, count: count as usize });
            first += count;
        }
        let decoded: Vec<Result<Vec<u8>>> =
            pool.install(|| group.par_iter().map(|chunk| decode(chunk, packing.items(), size, scan)).collect());
        for records in decoded {
            records?.chunks_exact(size).for_each(|record| points.add(record));
        }
    }
    Ok(())
}

enum Kind {
    /// All points in one piece, without a table.
    Whole,
    Chunked,
}

fn kind(packing: &LazVlr) -> Kind {
    // The crate does not tell; its text form begins with these two bytes.
    let mut bytes = Vec::new();
    let written = packing.write_to(&mut bytes).is_ok();
    if written && bytes.starts_with(&(CompressorType::PointWise as u16).to_le_bytes()) {
        Kind::Whole
    } else {
        Kind::Chunked
    }
}

/// Whether the items make up a point of `size` bytes.
fn check_items(items: &[LazItem], size: usize, scan: &FileScan) -> Result<()> {
    let total: u64 = items.iter().map(|item| u64::from(item.size())).sum();
    let extra: u64 = items.iter().filter(|item| is_extra(item)).map(|item| u64::from(item.size())).sum();
    let starts = matches!(items.first().map(LazItem::item_type), Some(LazItemType::Point10 | LazItemType::Point14));
    let layered = items.iter().map(|item| item.version() >= 3);
    let mixed = layered.clone().any(|l| l) && !layered.clone().all(|l| l);
    let fixed = items.iter().all(|item| item.size() == expected(item));
    if !starts || mixed || !fixed || items.len() > 8 || total != size as u64 || extra > EXTRA {
        let problem = format!(
            "{} items of {total} bytes, {extra} of them extra, don't make up a point of {size} bytes: at most \
                {EXTRA} extra bytes can be read",
            items.len()
        );
        return fail(scan, "record of LASzip", problem);
    }
    Ok(())
}

fn is_extra(item: &LazItem) -> bool {
    matches!(item.item_type(), LazItemType::Byte(_) | LazItemType::Byte14(_))
}

/// Bytes that an item has in a point.
fn expected(item: &LazItem) -> u16 {
    match item.item_type() {
        LazItemType::Byte(size) | LazItemType::Byte14(size) => size,
        LazItemType::Point10 => 20,
        LazItemType::GpsTime => 8,
        LazItemType::RGB12 | LazItemType::RGB14 => 6,
        LazItemType::RGBNIR14 => 8,
        LazItemType::WavePacket13 | LazItemType::WavePacket14 => 29,
        LazItemType::Point14 => 30,
    }
}

/// Place, bytes and points of each chunk.
fn table(
    input: &mut dyn Input,
    [begin, length]: [u64; 2],
    packing: &LazVlr,
    points: &Points,
    scan: &FileScan,
) -> Result<Vec<(u64, u64, u64)>> {
    let (count, size) = (points.header.count, points.header.size);
    let missing = "the table of chunks is missing: the file was cut short or never finished";
    let number = |input: &mut dyn Input, at: u64| -> Result<u64> {
        let mut bytes = [0; 8];
        seek(input, at, &scan.path)?;
        read_exact(input, &mut bytes, scan, "table of chunks")?;
        Ok(u64_at(&bytes, 0))
    };
    if length - begin < 16 {
        return fail(scan, "table of chunks", missing);
    }
    let fits = |at: u64| at > begin && at <= length - 8;
    let mut at = number(input, begin)?;
    if !fits(at) {
        // Programs that could not go back wrote it at the end.
        at = number(input, length - 8)?;
    }
    if !fits(at) {
        return fail(scan, "table of chunks", missing);
    }
    // Version, then the number of chunks; each begins with a whole point.
    let chunks = number(input, at)? >> 32;
    if chunks > (length - begin) / size as u64 || chunks > count {
        let problem = format!("{chunks} chunks don't fit {count} points in {length} bytes");
        return fail(scan, "table of chunks", problem);
    }
    seek(input, begin, &scan.path)?;
    let entries = match catch_unwind(AssertUnwindSafe(|| ChunkTable::read_from(&mut *input, packing))) {
        Ok(Ok(entries)) => entries,
        Ok(Err(laz::LasZipError::IoError(error))) if error.kind() != std::io::ErrorKind::UnexpectedEof => {
            return Err(Error::io(&scan.path, error));
        }
        Ok(Err(problem)) => return fail(scan, "table of chunks", problem.to_string()),
        Err(panic) => return stumbled(&*panic, || fail(scan, "table of chunks", "damaged")),
    };
    let (mut place, mut left) = (begin + 8, count);
    let mut chunks = Vec::with_capacity(entries.len());
    for entry in entries.as_ref() {
        let inside = entry.byte_count <= length && place + entry.byte_count <= length;
        if !inside || packing.uses_variable_size_chunks() && entry.point_count > left {
            let problem = format!(
                "chunk {} of {} bytes and {} points doesn't fit",
                chunks.len(),
                entry.byte_count,
                entry.point_count
            );
            return fail(scan, "table of chunks", problem);
        }
        let points = entry.point_count.min(left);
        chunks.push((place, entry.byte_count, points));
        (place, left) = (place + entry.byte_count, left - points);
    }
    if left > 0 {
        let problem = format!("the chunks hold {} of {count} points: the file is damaged", count - left);
        return fail(scan, "table of chunks", problem);
    }
    Ok(chunks)
}

/// The records of a chunk, one after the other.
fn decode(chunk: &Chunk, items: &Vec<LazItem>, size: usize, scan: &FileScan) -> Result<Vec<u8>> {
    let at = || format!("points {} to {}", chunk.first, chunk.first + chunk.count as u64);
    if chunk.count == 0 {
        return Ok(Vec::new());
    }
    let layered = items[0].version() >= 3;
    if layered {
        check_layers(chunk, items, size, scan)?;
    }
    let mut records: Vec<u8> = reserve(chunk.count * size, &scan.path)?;
    records.resize(chunk.count * size, 0);
    let input = std::io::Cursor::new(chunk.bytes.as_slice());
    let work = || -> std::result::Result<(), laz::LasZipError> {
        if layered {
            let mut decoder = LayeredPointRecordDecompressor::new(input);
            decoder.set_fields_from(items)?;
            decoder.decompress_many(&mut records)?;
        } else {
            let mut decoder = SequentialPointRecordDecompressor::new(input);
            decoder.set_fields_from(items)?;
            decoder.decompress_many(&mut records)?;
        }
        Ok(())
    };
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(())) => Ok(records),
        Ok(Err(problem)) => fail(scan, at(), format!("damaged: {problem}")),
        Err(panic) => stumbled(&*panic, || fail(scan, at(), "damaged: they can't be decoded")),
    }
}

/// Meaning of a panic of the decoder: `damaged`, but for memory that could not be had.
fn stumbled<T>(panic: &(dyn Any + Send), damaged: impl FnOnce() -> Result<T>) -> Result<T> {
    memory::refused(panic).map_or_else(damaged, Err)
}

/// Whether the layers that a chunk claims are in it: a whole point, the number of points, the size of each layer, these.
fn check_layers(chunk: &Chunk, items: &[LazItem], size: usize, scan: &FileScan) -> Result<()> {
    let layers: usize = items
        .iter()
        .map(|item| match item.item_type() {
            LazItemType::Point14 => 9,
            LazItemType::RGBNIR14 => 2,
            LazItemType::Byte14(count) => count.into(),
            _ => 1,
        })
        .sum();
    let sizes = chunk.bytes.get(size + 4..size + 4 + 4 * layers);
    let claimed = sizes.map(|sizes| (0..layers).map(|i| u64::from(u32_at(sizes, 4 * i))).sum::<u64>());
    let there = chunk.bytes.len().saturating_sub(size + 4 + 4 * layers) as u64;
    if claimed.is_none_or(|claimed| claimed > there) {
        let problem = format!("its layers of {} bytes don't fit its {}", claimed.unwrap_or(0), chunk.bytes.len());
        return fail(scan, format!("chunk at point {}", chunk.first), problem);
    }
    Ok(())
}
