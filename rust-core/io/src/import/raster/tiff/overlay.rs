//! A file of which some bytes are read as others, and behind whose end more follow: what the crate `tiff` does not decode looks like
//! what it does.

use std::io::{Read, Result, Seek, SeekFrom};

use ::tiff::decoder::Decoder;
use ::tiff::tags::{ByteOrder, Tag};

/// Entries of a directory that are looked at.
const MOST_ENTRIES: u64 = 4096;
/// The types of numbers of 16, 32 and 64 bits.
const SHORT: u16 = 3;
const LONG: u16 = 4;
const LONG8: u16 = 16;

pub(super) struct Overlay<R> {
    pub(super) input: R,
    at: u64,
    /// Bytes of the file.
    pub(super) length: u64,
    /// Places where the file has other bytes, and these.
    others: Vec<(u64, Vec<u8>)>,
    /// Follows the file.
    pub(super) behind: Vec<u8>,
}

impl<R> Overlay<R> {
    /// The file of so many bytes as it is, from its start on.
    pub(super) fn new(input: R, length: u64) -> Self {
        Overlay { input, at: 0, length, others: Vec::new(), behind: Vec::new() }
    }

    fn behind_at(&self) -> &[u8] {
        let past = usize::try_from(self.at.saturating_sub(self.length)).unwrap_or(usize::MAX);
        self.behind.get(past..).unwrap_or_default()
    }
}

impl<R: Read> Read for Overlay<R> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let count = if self.at < self.length {
            let most = usize::try_from(self.length - self.at).unwrap_or(usize::MAX).min(buffer.len());
            self.input.read(&mut buffer[..most])?
        } else {
            self.behind_at().read(buffer)?
        };
        for (place, bytes) in &self.others {
            for (place, &byte) in (*place..).zip(bytes) {
                let read = place.checked_sub(self.at).and_then(|at| buffer[..count].get_mut(usize::try_from(at).ok()?));
                read.into_iter().for_each(|read| *read = byte);
            }
        }
        self.at += count as u64;
        Ok(count)
    }
}

impl<R: Seek> Seek for Overlay<R> {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let end = self.length + self.behind.len() as u64;
        let place = match to {
            SeekFrom::Start(at) => Some(at),
            SeekFrom::Current(by) => self.at.checked_add_signed(by),
            SeekFrom::End(by) => end.checked_add_signed(by),
        };
        self.at = place.ok_or(std::io::ErrorKind::InvalidInput)?;
        self.input.seek(SeekFrom::Start(self.at.min(self.length)))?;
        Ok(self.at)
    }
}

/// A number's bytes in a file of this order.
fn bytes_of(number: u64, size: usize, order: ByteOrder) -> Vec<u8> {
    match order {
        ByteOrder::LittleEndian => number.to_le_bytes()[..size].to_vec(),
        ByteOrder::BigEndian => number.to_be_bytes()[8 - size..].to_vec(),
    }
}

fn number_of(bytes: &[u8], order: ByteOrder) -> u64 {
    let digit = |sum: u64, byte: &u8| (sum << 8) | u64::from(*byte);
    match order {
        ByteOrder::LittleEndian => bytes.iter().rev().fold(0, digit),
        ByteOrder::BigEndian => bytes.iter().fold(0, digit),
    }
}

/// The sort that a tag is to be read as.
pub(super) enum As {
    /// One number of 16 bits.
    Short(u16),
    /// As many times the same number.
    Times(u64, u64),
}

/// Reads tags of the image at which the decoder stands as others from now on, numbers that there are many of from behind the file.
/// The image is then to be decoded anew. False if the file has no such tag, or no room for numbers so large.
pub(super) fn read_as<R: Read + Seek>(decoder: &mut Decoder<Overlay<R>>, tags: &[(Tag, As)]) -> Result<bool> {
    let order = decoder.byte_order();
    let Some(directory) = decoder.ifd_pointer().map(|pointer| pointer.0) else { return Ok(false) };
    let file = decoder.inner();
    let mut bytes = [0; 8];
    file.seek(SeekFrom::Start(0))?;
    file.read_exact(&mut bytes[..4])?;
    // Files of BigTIFF have longer numbers.
    let is_big = number_of(&bytes[2..4], order) == 43;
    let (size, entry_size, count_size) = if is_big { (8, 20, 8) } else { (4, 12, 2) };
    file.seek(SeekFrom::Start(directory))?;
    file.read_exact(&mut bytes[..count_size])?;
    let mut places = Vec::new();
    let mut entry = [0; 20];
    for k in 0..number_of(&bytes[..count_size], order).min(MOST_ENTRIES) {
        file.read_exact(&mut entry[..entry_size])?;
        places.push((number_of(&entry[..2], order), directory + count_size as u64 + k * entry_size as u64));
    }
    for (tag, wanted) in tags {
        let Some(&(id, place)) = places.iter().find(|(id, _)| *id == u64::from(tag.to_u16())) else { return Ok(false) };
        let (kind, count, value) = match *wanted {
            As::Short(value) => (SHORT, 1, bytes_of(value.into(), 2, order)),
            As::Times(count, number) => {
                let one = bytes_of(number, size, order);
                if number_of(&one, order) != number {
                    return Ok(false);
                }
                let value = if count == 1 {
                    one
                } else {
                    let place = file.length + file.behind.len() as u64;
                    file.behind.extend((0..count).flat_map(|_| one.iter().copied()));
                    bytes_of(place, size, order)
                };
                (if is_big { LONG8 } else { LONG }, count, value)
            }
        };
        let head = [bytes_of(id, 2, order), bytes_of(kind.into(), 2, order), bytes_of(count, size, order)];
        let mut other = [head.concat(), value].concat();
        other.resize(entry_size, 0);
        file.others.push((place, other));
    }
    Ok(true)
}
