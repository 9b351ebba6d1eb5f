//! Files as the readers need them, of the system or of folders in memory. Of the system only regular files are read: a device or a
//! pipe could go on for ever.

use std::borrow::Cow;
use std::cell::Cell;
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::set::ScanSet;
use crate::memory_folder::{Reading, explained, place_of};
use base::error::{Error, Result, known_as};
use base::memory;
use base::progress::Progress;

/// Most bytes that are read between two looks at the progress.
const MOST: usize = 4 << 20;

/// Bytes by which [`open`] tells text from numbers.
const LOOKED_AT: usize = 1 << 10;

/// The byte order mark of UTF-8.
const MARK: &[u8] = b"\xEF\xBB\xBF";

/// An opened regular file. Every reader gets its bytes through this one type, so that a test can make any read fail.
pub(super) struct Regular {
    file: Opened,
    /// Bytes of a byte order mark, which are no part of the content.
    mark: u64,
}

enum Opened {
    File(File),
    InMemory(Reading),
}

impl Regular {
    fn read_once(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        #[cfg(test)]
        let buffer = super::faults::read(buffer)?;
        match &mut self.file {
            Opened::File(file) => file.read(buffer),
            Opened::InMemory(file) => file.read(buffer),
        }
    }

    fn seek_once(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        match &mut self.file {
            Opened::File(file) => file.seek(to),
            Opened::InMemory(file) => file.seek(to),
        }
    }
}

impl Read for Regular {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        // An interrupted read is no failure, but not every decoder tries again.
        loop {
            match self.read_once(buffer) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                outcome => return outcome,
            }
        }
    }
}

impl Seek for Regular {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let place = match to {
            SeekFrom::Start(at) => self.seek_once(SeekFrom::Start(at.saturating_add(self.mark))),
            other => self.seek_once(other),
        };
        place?.checked_sub(self.mark).ok_or_else(|| ErrorKind::InvalidInput.into())
    }
}

/// Ending of files of numbers of two bytes that nothing else tells from text: low land reads as letters.
const NUMBERS: &str = "hgt";

/// Opens a regular file whose start says what it holds. Also returns the length of its content. The byte order mark of a text is no part of
/// that, wherever text is read.
///
/// # Errors
/// As [`open_bytes`]. A text in UTF-16, which no reader knows.
pub(super) fn open(path: &Path) -> Result<(Regular, u64)> {
    let (mut file, length) = open_bytes(path)?;
    let io = |e| Error::io(path, e);
    let mut start = Vec::with_capacity(LOOKED_AT);
    // Most files begin otherwise: two bytes tell.
    (&mut file).take(2).read_to_end(&mut start).map_err(io)?;
    if start.contains(&0) || matches!(*start, [0xEF, 0xBB] | [0xFF, 0xFE] | [0xFE, 0xFF]) {
        (&mut file).take((LOOKED_AT - 2) as u64).read_to_end(&mut start).map_err(io)?;
        let is_numbers = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(NUMBERS));
        if !is_numbers && is_utf16(&start) {
            return Err(Error::format(path, "start of file", "this is UTF-16 text: save it as UTF-8"));
        }
        if start.starts_with(MARK) && !start.iter().any(|&b| is_control(b.into())) {
            file.mark = MARK.len() as u64;
        }
    }
    file.seek(SeekFrom::Start(0)).map_err(io)?;
    let length = length - file.mark;
    Ok((file, length))
}

/// Whether a character is none of text.
fn is_control(c: u16) -> bool {
    c == 0x7F || (c < 0x20 && !(0x09..=0x0D).contains(&c))
}

/// Whether a file that starts like this is UTF-16. Numbers can have its byte order mark, or every other byte zero, but nearly all of them
/// are no letters of a language that files are written in.
fn is_utf16(start: &[u8]) -> bool {
    let (marked, little) = match *start {
        [0xFF, 0xFE, ..] => (true, true),
        [0xFE, 0xFF, ..] => (true, false),
        [_, 0, ..] => (false, true),
        _ => (false, false),
    };
    let units: Vec<u16> = start[if marked { 2 } else { 0 }..]
        .as_chunks::<2>()
        .0
        .iter()
        .map(|&unit| if little { u16::from_le_bytes(unit) } else { u16::from_be_bytes(unit) })
        .collect();
    let ascii = units.iter().filter(|&&unit| unit < 0x80).count();
    let enough = if marked { ascii * 8 >= units.len() * 7 } else { ascii == units.len() && units.len() >= 4 };
    !units.is_empty() && enough && !units.iter().any(|&unit| is_control(unit))
}

/// Opens a regular file of which every byte is content. Also returns its length.
pub(super) fn open_bytes(path: &Path) -> Result<(Regular, u64)> {
    if path.as_os_str().is_empty() {
        return Err(Error::input("the name of a file must not be empty"));
    }
    let is_folder = || {
        let remedy = "this is a folder: choose its files, or the .conf file that places them";
        Error::input(format!("{}: {remedy}", known_as(path)))
    };
    if let Some(place) = place_of(path) {
        if place.is_dir() {
            return Err(is_folder());
        }
        let file = place.open().map_err(|e| Error::io(path, e))?;
        let length = file.length();
        return Ok((Regular { file: Opened::InMemory(file), mark: 0 }, length));
    }
    // Asked before opening: opening a pipe waits for its other end.
    let metadata = std::fs::metadata(path).map_err(|e| Error::io(path, explained(path, e)))?;
    if metadata.is_dir() {
        return Err(is_folder());
    }
    if !metadata.is_file() {
        return Err(Error::input(format!(
            "{}: this is a device, a pipe or the like, but must be a regular file",
            known_as(path)
        )));
    }
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    Ok((Regular { file: Opened::File(file), mark: 0 }, metadata.len()))
}

/// Whether there is a file of this name.
pub(super) fn is_file(path: &Path) -> bool {
    place_of(path).map_or_else(|| path.is_file(), |place| place.is_file())
}

/// Whether there is a folder of this name.
pub(super) fn is_dir(path: &Path) -> bool {
    place_of(path).map_or_else(|| path.is_dir(), |place| place.is_dir())
}

/// The names of what lies in a folder, in any order, each found when it is asked for.
pub(super) fn names_in(folder: &Path) -> Result<Box<dyn Iterator<Item = Result<OsString>> + '_>> {
    if let Some(place) = place_of(folder) {
        return Ok(Box::new(place.children().into_iter().map(|name| Ok(name.into()))));
    }
    let failed = move |e| Error::io(folder, e);
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    Ok(Box::new(entries.map(move |entry| entry.map(|entry| entry.file_name()).map_err(failed))))
}

/// Reads a whole file of text.
pub(super) fn read(path: &Path) -> Result<Vec<u8>> {
    whole(open(path)?, path)
}

/// Reads all bytes of a file.
pub(super) fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    whole(open_bytes(path)?, path)
}

fn whole((file, length): (Regular, u64), path: &Path) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let wanted = usize::try_from(length).ok();
    if wanted.is_none_or(|wanted| bytes.try_reserve_exact(wanted).is_err()) {
        return Err(Error::OutOfMemory(format!("{}: reading it takes {length} bytes", known_as(path))));
    }
    // A file that grows meanwhile is read no further.
    file.take(length).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok(bytes)
}

/// So many bytes of a file from one of them on, read piece by piece.
pub(super) fn taken(mut file: Regular, at: u64, count: u64, path: &Path, progress: &Progress<'_>) -> Result<Vec<u8>> {
    let mut bytes = reserve(usize::try_from(count).unwrap_or(usize::MAX), path)?;
    if at > 0 {
        file.seek(SeekFrom::Start(at)).map_err(|e| Error::io(path, e))?;
    }
    let mut file = file.take(count);
    while (bytes.len() as u64) < count {
        progress.check()?;
        let read = file.by_ref().take(MOST as u64).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
        if read == 0 {
            break;
        }
    }
    Ok(bytes)
}

/// The text that a file starts with. Text after a zero byte is none.
pub(super) fn start_of_text(start: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(&start[..memchr::memchr(0, start).unwrap_or(start.len())])
}

/// The first bytes of a file, at most `count`, and its length.
pub(super) fn read_start(path: &Path, count: usize) -> Result<(Vec<u8>, u64)> {
    let (file, length) = open(path)?;
    let mut bytes = Vec::new();
    file.take(count as u64).read_to_end(&mut bytes).map_err(|e| Error::io(path, e))?;
    Ok((bytes, length))
}

/// The file's own name, for notes.
pub(super) fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Input of readers: a file, or bytes in memory under test.
pub(super) trait Input: Read + Seek {}

impl<T: Read + Seek> Input for T {}

/// An input that remembers a failure: decoding crates don't all hand it on.
pub(super) struct Watched<'a> {
    input: &'a mut dyn Input,
    failure: &'a Cell<Option<std::io::Error>>,
}

impl Watched<'_> {
    fn note<T>(&self, outcome: std::io::Result<T>) -> std::io::Result<T> {
        if let Err(error) = &outcome
            && error.kind() != ErrorKind::Interrupted
        {
            self.failure.set(Some(copied(error)));
        }
        outcome
    }
}

/// The same error once more, with the system's number where it has one.
fn copied(error: &std::io::Error) -> std::io::Error {
    match error.raw_os_error() {
        Some(number) => std::io::Error::from_raw_os_error(number),
        None => std::io::Error::new(error.kind(), error.to_string()),
    }
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let outcome = self.input.read(buffer);
        self.note(outcome)
    }
}

impl Seek for Watched<'_> {
    // A place before the start comes out of the file's content, not out of the disk.
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.input.seek(to)
    }
}

/// Lets a decoding crate read a file. If reading fails, that is the error, whatever the crate makes of it.
pub(super) fn watched<T>(
    input: &mut dyn Input,
    path: &Path,
    decode: impl FnOnce(BufReader<Watched<'_>>) -> Result<T>,
) -> Result<T> {
    let failure = Cell::new(None);
    let outcome = decode(BufReader::with_capacity(1 << 16, Watched { input, failure: &failure }));
    match failure.take() {
        Some(error) => Err(Error::io(path, error)),
        None => outcome,
    }
}

/// The error of a decoding crate about the file's content.
pub(super) fn decoding_error(scan: &FileScan, error: &dyn std::fmt::Display) -> Error {
    // The standard library's words for an end of the file that comes too early.
    let text = error.to_string().replace("failed to fill whole buffer", "the file ends too early");
    Error::format(&scan.path, "while decoding", text)
}

/// The error that a text is no JSON, or none that can be read.
pub(super) fn no_json(path: &Path, error: &serde_json::Error) -> Error {
    let problem = match error.to_string().starts_with("number out of range") {
        true => "a number is too large: at most 1.8e308 is read",
        false => "this is not JSON",
    };
    too_deep(path, error).unwrap_or_else(|| Error::format(path, place_in_json(error), problem))
}

fn place_in_json(error: &serde_json::Error) -> String {
    format!("line {}, column {}", error.line(), error.column())
}

/// The error that JSON is nested too deeply, which it may be and be JSON all the same.
pub(super) fn too_deep(path: &Path, error: &serde_json::Error) -> Option<Error> {
    // The crate has no other name for it.
    error.to_string().starts_with("recursion limit exceeded").then(|| {
        let problem = "JSON is nested more than 127 deep, which is the most: write it with fewer lists in lists";
        Error::format(path, place_in_json(error), problem)
    })
}

/// Reads a scan out of an input of so many bytes, whose path is the scan's.
pub(super) type Parse = fn(&mut dyn Input, u64, &FileScan, &Progress<'_>) -> Result<Content>;

/// Opens a file of one scan without looking into it.
pub(super) fn single(path: &Path, options: &Arc<ReadOptions>) -> Result<ScanSet> {
    Ok(ScanSet { scans: vec![FileScan::with(path, options)], notes: Vec::new() })
}

/// Reads a scan with `parse`.
pub(super) fn parsed(scan: &FileScan, progress: &Progress<'_>, parse: Parse) -> Result<Content> {
    let (mut file, length) = counted(&scan.path, progress)?;
    parse(&mut file, length, scan, progress)
}

/// A file whose bytes are counted as they are read. Once the call is cancelled, reading fails.
pub(super) struct Counted<'a, 'p> {
    file: Regular,
    progress: &'a Progress<'p>,
}

/// Opens a regular file that is the whole work of a call. Also returns its length.
pub(super) fn counted<'a, 'p>(path: &Path, progress: &'a Progress<'p>) -> Result<(Counted<'a, 'p>, u64)> {
    let (file, length) = open(path)?;
    progress.stage(0, length);
    Ok((Counted { file, progress }, length))
}

impl Read for Counted<'_, '_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        // So that reading a large file in one piece can be cancelled too.
        let most = buffer.len().min(MOST);
        let count = self.file.read(&mut buffer[..most])?;
        self.progress.advance(count as u64).map_err(std::io::Error::other)?;
        Ok(count)
    }
}

impl Seek for Counted<'_, '_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(to)
    }
}

/// About `count` points of a scan, spread over it, by reading all of it.
pub(super) fn thinned(scan: &FileScan, parse: Parse, count: usize) -> Result<Vec<DVec3>> {
    fn every<T>(all: impl Iterator<Item = T>, length: usize, count: usize) -> Vec<T> {
        all.step_by((length / count.max(1)).max(1)).collect()
    }
    Ok(match parsed(scan, &Progress::none(), parse)? {
        Content::RangeImage(image) => {
            let valid = (0..image.len()).filter(|&i| image.is_valid(i));
            every(valid.map(|i| image.point_in_sensor(i)), image.valid_count(), count)
        }
        Content::Mesh(mesh) => every(mesh.positions.iter().copied(), mesh.positions.len(), count),
        Content::Points(cloud) => every(cloud.positions.iter().copied(), cloud.positions.len(), count),
    })
}

/// Room for `count` elements that the file was seen to hold or the limit of decoded sizes allows.
pub(super) fn reserve<T>(count: usize, path: &Path) -> Result<Vec<T>> {
    memory::reserved(count, || format!("reading {}", known_as(path)))
}
