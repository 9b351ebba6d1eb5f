//! Damage that every reader must survive, tried on small files of every format: any prefix, any byte changed, any read failing.

use std::io::Cursor;
#[cfg(test)]
use std::io::{self, Read, Seek, SeekFrom};

#[cfg(test)]
use super::file::Input;
use super::file::Parse;
use super::scan::{Content, FileScan};
use base::error::{Error, Result};
use base::progress::Progress;

#[cfg(test)]
/// An input whose reads fail from the `good`-th on.
struct Failing<'a> {
    bytes: Cursor<&'a [u8]>,
    good: usize,
}

#[cfg(test)]
impl Read for Failing<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.good == 0 {
            return Err(io::Error::other("broken disk"));
        }
        self.good -= 1;
        // Few bytes at a time: so that there are many reads to fail.
        let count = buffer.len().min(97);
        self.bytes.read(&mut buffer[..count])
    }
}

#[cfg(test)]
impl Seek for Failing<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

/// Checks that content is valid, or that the error says where.
pub(super) fn sound(outcome: &Result<Content>, scan: &FileScan) {
    match outcome {
        Ok(Content::RangeImage(image)) => assert!(image.validate().is_ok() && image.world_from_sensor.is_finite()),
        Ok(Content::Mesh(mesh)) => assert!(mesh.validate().is_ok(), "{:?}", mesh.validate()),
        Ok(Content::Points(cloud)) => {
            assert!(cloud.positions.iter().all(|p| p.is_finite()));
            assert!(cloud.colour.as_ref().is_none_or(|c| c.len() == cloud.positions.len()));
            assert!(cloud.normals.as_ref().is_none_or(|n| n.len() == cloud.positions.len()));
        }
        Err(Error::Format { path, at, problem }) => {
            assert!(*path == scan.path && !at.is_empty() && !problem.is_empty(), "{at}: {problem}");
        }
        Err(Error::OutOfMemory(text)) => assert!(text.contains(&*scan.path.to_string_lossy()), "{text}"),
        Err(other) => panic!("{other:?}"),
    }
}

/// Reads bytes as a scan.
pub(super) fn read(parse: Parse, bytes: &[u8], scan: &FileScan) -> Result<Content> {
    parse(&mut Cursor::new(bytes), bytes.len() as u64, scan, &Progress::none())
}

#[cfg(test)]
/// Tries all damage on a file that can be read. The format decides whether a file cut short must be refused.
pub(super) fn endure(parse: Parse, bytes: &[u8], scan: &FileScan) {
    let good = read(parse, bytes, scan);
    sound(&good, scan);
    assert!(good.is_ok(), "{good:?}");
    let stride = 1 + bytes.len() / 400;
    for end in (0..bytes.len()).step_by(stride) {
        sound(&read(parse, &bytes[..end], scan), scan);
    }
    let mut damaged = bytes.to_vec();
    for at in (0..bytes.len()).step_by(1 + bytes.len() / 600) {
        for value in [0, 0xFF, bytes[at] ^ 1, bytes[at] ^ 0x80, b'9', b'-', b'\n'] {
            damaged[at] = value;
            sound(&read(parse, &damaged, scan), scan);
        }
        damaged[at] = bytes[at];
    }
    let mut failures = 0;
    for good in 0.. {
        let mut input = Failing { bytes: Cursor::new(bytes), good };
        match parse(&mut input as &mut dyn Input, bytes.len() as u64, scan, &Progress::none()) {
            Err(Error::Io { path, source }) => {
                assert!(path == scan.path && source.to_string().contains("broken disk"), "{source}");
                failures += 1;
            }
            Err(other) => panic!("read {good} failing gives {other:?}"),
            // Past the last read.
            Ok(_) if input.good > 0 => break,
            Ok(_) => {}
        }
    }
    assert!(failures > 0);
}
