//! Zip archives, written front to back: the lengths of a member follow it, so that nothing is gone back to.
//!
//! Members are deflated. All have the same date: equal content makes equal bytes. Nothing is written or taken when a value is dropped,
//! because memory may be refused in the middle of a member.

use std::io::{Error, Result, Write};

use flate2::{Compress, Compression, Crc, FlushCompress, Status};

/// Lengths and places from here on have no room in four bytes. They stand in eight (ZIP64).
const LARGE: u64 = u32::MAX as u64;
/// Bytes that are deflated at once, and bytes that are written at once.
const PIECE: usize = 1 << 16;
/// Flag of members whose checksum and lengths follow them.
const LENGTHS_FOLLOW: u16 = 1 << 3;
/// Method of deflated members.
const DEFLATED: u16 = 8;
/// The first day that the format knows, 1 January 1980, at midnight.
const DATE: u32 = 0x21 << 16;
/// Versions that readers must know: of the format, and of ZIP64.
const VERSION: u16 = 20;
const VERSION_OF_LARGE: u16 = 45;
/// Number of ZIP64's extra fields.
const EXTRA_OF_LARGE: u16 = 1;

/// An archive that is being written.
pub(super) struct Archive<W> {
    out: W,
    /// Bytes written so far.
    at: u64,
    members: Vec<Member>,
    deflate: Compress,
    /// Bytes that wait for being deflated.
    waiting: Vec<u8>,
    deflated: Vec<u8>,
}

/// A member that is written.
struct Member {
    name: &'static str,
    at: u64,
    crc: u32,
    packed: u64,
    unpacked: u64,
    /// Whether its own header has room for lengths of eight bytes.
    is_large: bool,
}

impl<W: Write> Archive<W> {
    pub(super) fn new(out: W, level: Compression) -> Self {
        Archive {
            out,
            at: 0,
            members: Vec::new(),
            deflate: Compress::new(level, false),
            waiting: Vec::with_capacity(PIECE),
            deflated: vec![0; PIECE],
        }
    }

    /// Adds a member of the bytes that `write` writes, which are at most `most`. Its name is in ASCII.
    pub(super) fn add<E: From<Error>>(
        &mut self,
        name: &'static str,
        most: u64,
        write: impl FnOnce(&mut Packing<'_, W>) -> std::result::Result<(), E>,
    ) -> std::result::Result<(), E> {
        // Deflate adds five bytes to each block that it can't pack, which has thousands.
        let is_large = most.saturating_add(most / 1000).saturating_add(1000) >= LARGE;
        let at = self.at;
        self.put(&member_header(name, is_large))?;
        let (begin, crc) = (self.at, Crc::new());
        self.deflate.reset();
        let mut packing = Packing { archive: self, crc, unpacked: 0 };
        write(&mut packing)?;
        packing.deflate(FlushCompress::Finish)?;
        let (crc, unpacked) = (packing.crc.sum(), packing.unpacked);
        assert!(unpacked <= most, "{name} has {unpacked} bytes, more than the {most} that were said");
        let member = Member { name, at, crc, packed: self.at - begin, unpacked, is_large };
        self.put(&member.lengths())?;
        self.members.push(member);
        Ok(())
    }

    /// Writes the list of members, which ends the archive.
    pub(super) fn finish(mut self) -> Result<()> {
        let (list, members) = (self.at, std::mem::take(&mut self.members));
        for member in &members {
            self.put(&member.entry())?;
        }
        self.put(&end(members.len(), list, self.at - list))?;
        self.out.flush()
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes)?;
        self.at += bytes.len() as u64;
        Ok(())
    }
}

/// Takes the bytes of a member.
pub(super) struct Packing<'a, W> {
    archive: &'a mut Archive<W>,
    crc: Crc,
    unpacked: u64,
}

impl<W: Write> Packing<'_, W> {
    /// Deflates the bytes that wait. `Finish` ends the member.
    fn deflate(&mut self, flush: FlushCompress) -> Result<()> {
        let Archive { out, at, deflate, waiting, deflated, .. } = &mut *self.archive;
        self.crc.update(waiting);
        self.unpacked += waiting.len() as u64;
        let mut rest = waiting.as_slice();
        loop {
            let (before_in, before_out) = (deflate.total_in(), deflate.total_out());
            let status = deflate.compress(rest, deflated, flush).map_err(Error::other)?;
            rest = &rest[(deflate.total_in() - before_in) as usize..];
            let count = deflate.total_out() - before_out;
            out.write_all(&deflated[..count as usize])?;
            *at += count;
            let is_done = match flush {
                FlushCompress::Finish => status == Status::StreamEnd,
                _ => rest.is_empty(),
            };
            if is_done {
                waiting.clear();
                return Ok(());
            }
        }
    }
}

impl<W: Write> Write for Packing<'_, W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        if self.archive.waiting.len() == PIECE {
            self.deflate(FlushCompress::None)?;
        }
        let count = bytes.len().min(PIECE - self.archive.waiting.len());
        self.archive.waiting.extend_from_slice(&bytes[..count]);
        Ok(count)
    }

    /// Does nothing: a member is deflated in whole pieces.
    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

/// Numbers of a header, least byte first.
#[derive(Default)]
struct Header(Vec<u8>);

impl Header {
    fn of(signature: u32) -> Self {
        Header::default().four(signature)
    }

    fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    fn two(self, number: u16) -> Self {
        self.bytes(&number.to_le_bytes())
    }

    fn four(self, number: u32) -> Self {
        self.bytes(&number.to_le_bytes())
    }

    fn eight(self, number: u64) -> Self {
        self.bytes(&number.to_le_bytes())
    }

    /// Four bytes that a number from [`LARGE`] on fills.
    fn at_most_four(self, number: u64) -> Self {
        self.four(number.min(LARGE) as u32)
    }
}

/// The version that a reader of a member must know.
fn version(is_large: bool) -> u16 {
    if is_large { VERSION_OF_LARGE } else { VERSION }
}

/// The header before a member, with no lengths.
fn member_header(name: &str, is_large: bool) -> Vec<u8> {
    let unknown = if is_large { u32::MAX } else { 0 };
    let header = Header::of(0x0403_4b50).two(version(is_large)).two(LENGTHS_FOLLOW).two(DEFLATED).four(DATE);
    let header = header.four(0).four(unknown).four(unknown);
    let header = header.two(name.len() as u16).two(if is_large { 20 } else { 0 }).bytes(name.as_bytes());
    match is_large {
        true => header.two(EXTRA_OF_LARGE).two(16).eight(0).eight(0).0,
        false => header.0,
    }
}

impl Member {
    /// The record behind the member.
    fn lengths(&self) -> Vec<u8> {
        let header = Header::of(0x0807_4b50).four(self.crc);
        match self.is_large {
            true => header.eight(self.packed).eight(self.unpacked).0,
            false => header.at_most_four(self.packed).at_most_four(self.unpacked).0,
        }
    }

    /// The member in the list.
    fn entry(&self) -> Vec<u8> {
        let Member { name, at, crc, packed, unpacked, is_large } = *self;
        let numbers = [unpacked, packed, at];
        let longer: Vec<u64> = numbers.into_iter().filter(|&number| number >= LARGE).collect();
        let extra = if longer.is_empty() { 0 } else { 4 + 8 * longer.len() as u16 };
        let needed = version(is_large || !longer.is_empty());
        let header = Header::of(0x0201_4b50).two(needed).two(needed).two(LENGTHS_FOLLOW).two(DEFLATED).four(DATE);
        let header = header.four(crc).at_most_four(packed).at_most_four(unpacked).two(name.len() as u16).two(extra);
        // No comment, the first disk, no attributes.
        let header = header.two(0).two(0).two(0).four(0).at_most_four(at).bytes(name.as_bytes());
        if longer.is_empty() {
            return header.0;
        }
        longer.into_iter().fold(header.two(EXTRA_OF_LARGE).two(extra - 4), Header::eight).0
    }
}

/// The end of an archive whose list of so many members begins at a place and has so many bytes.
fn end(members: usize, list: u64, length: u64) -> Vec<u8> {
    let count = u16::try_from(members).ok().filter(|&count| count < u16::MAX).expect("an archive has few members");
    let mut header = Header::default();
    if list >= LARGE {
        let end_of_list = list + length;
        let count = u64::from(count);
        header = header.four(0x0606_4b50).eight(44).two(VERSION_OF_LARGE).two(VERSION_OF_LARGE).four(0).four(0);
        header = header.eight(count).eight(count).eight(length).eight(list);
        header = header.four(0x0706_4b50).four(0).eight(end_of_list).four(1);
    }
    let header = header.four(0x0605_4b50).two(0).two(0).two(count).two(count);
    header.at_most_four(length).at_most_four(list).two(0).0
}

#[cfg(test)]
mod tests;
