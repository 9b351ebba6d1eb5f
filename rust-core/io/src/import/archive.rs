//! Zip archives, read where they lie: nothing is unpacked to the disk, so no name in them can lead anywhere.
//!
//! Only stored and deflated members are read. Links, names that lead out of the archive and encrypted members are no files of it. The size
//! that a member says it unpacks to is checked before it is unpacked, and kept to while it is.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use flate2::Crc;
use flate2::read::DeflateDecoder;
use zip::result::ZipError;
use zip::{CompressionMethod, ZipArchive};

use super::file;
use base::error::{Error, Result};
use base::progress::Progress;

/// Bytes that one byte can become by deflate: 258 bytes for two bits.
const DEFLATED: u64 = 1032;

/// Bytes that are unpacked between two looks at the progress.
const PIECE: usize = 1 << 20;

/// Bytes after a reader's error that are unpacked, to tell damage.
const LOOKED_AT: u64 = 1 << 26;

/// The files of an archive.
#[derive(Debug)]
pub(super) struct Archive {
    path: PathBuf,
    /// The folder in it whose files these are.
    inner: PathBuf,
    members: BTreeMap<Box<str>, Member>,
    /// Files that are encrypted, which are not read.
    encrypted: usize,
}

/// One file of an archive.
#[derive(Clone, Copy, Debug)]
struct Member {
    at: u64,
    packed: u64,
    unpacked: u64,
    crc: u32,
    method: Method,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Method {
    Stored,
    Deflated,
    Unknown,
}

/// Whether a file that starts like this is an archive.
pub(super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"PK\x03\x04")
}

impl Archive {
    /// Reads the list of files, and where each begins.
    pub(super) fn open(path: &Path, progress: &Progress<'_>) -> Result<Archive> {
        let (mut file, length) = file::open_bytes(path)?;
        file::watched(&mut file, path, |input| Self::read_list(input, length, path, progress))
    }

    fn read_list(input: impl Read + Seek, length: u64, path: &Path, progress: &Progress<'_>) -> Result<Archive> {
        let wrong = |at: &str, error: ZipError| Error::format(path, at, error.to_string());
        let mut zip = ZipArchive::new(input).map_err(|e| {
            let remedy = "the archive was cut off or is damaged, so copy or export it again";
            Error::format(path, "list of files", format!("it can't be read ({e}): {remedy}"))
        })?;
        let (mut members, mut encrypted) = (BTreeMap::new(), 0);
        for index in 0..zip.len() {
            progress.check()?;
            let at = format!("file {index}");
            let member = zip.by_index_raw(index).map_err(|e| wrong(&at, e))?;
            let is_inside = member.enclosed_name().is_some();
            let Ok(name) = std::str::from_utf8(member.name_raw()) else { continue };
            encrypted += usize::from(member.encrypted());
            if !member.is_file() || member.is_symlink() || member.encrypted() || !is_inside {
                continue;
            }
            let method = match member.compression() {
                CompressionMethod::Stored => Method::Stored,
                CompressionMethod::Deflated => Method::Deflated,
                _ => Method::Unknown,
            };
            let found = Member {
                at: member.data_start().unwrap_or(u64::MAX),
                packed: member.compressed_size(),
                unpacked: member.size(),
                crc: member.crc32(),
                method,
            };
            if found.at.checked_add(found.packed).is_none_or(|end| end > length) {
                return Err(Error::format(path, name, "its bytes lie beyond the end of the archive: it was cut off"));
            }
            members.insert(name.trim_start_matches("./").replace('\\', "/").into(), found);
        }
        Ok(Archive { path: path.to_owned(), inner: PathBuf::new(), members, encrypted })
    }

    /// The files of one of its folders.
    pub(super) fn inner(&self, folder: &str) -> Archive {
        let stripped = |name: &str| self.members.get_key_value(&*format!("{folder}/{name}")).map(|(_, member)| *member);
        let members = self.below(folder).filter_map(|name| Some((name.into(), stripped(name)?))).collect();
        Archive { path: self.path.clone(), inner: self.inner.join(folder), members, encrypted: self.encrypted }
    }

    /// Whether there is a file or a folder of this name.
    pub(super) fn has(&self, name: &str) -> bool {
        self.members.contains_key(name) || self.below(name).next().is_some()
    }

    /// The length of a file, unpacked.
    pub(super) fn length(&self, name: &str) -> Option<u64> {
        self.members.get(name).map(|member| member.unpacked)
    }

    fn below(&self, folder: &str) -> impl Iterator<Item = &str> {
        let start = if folder.is_empty() { String::new() } else { format!("{folder}/") };
        let range = self.members.range::<str, _>((std::ops::Bound::Included(&*start), std::ops::Bound::Unbounded));
        let length = start.len();
        range.map(|(name, _)| &**name).take_while(move |name| name.starts_with(&start)).map(move |name| &name[length..])
    }

    /// The files and folders of a folder.
    pub(super) fn list(&self, folder: &str) -> BTreeSet<String> {
        self.below(folder).filter_map(|name| name.split('/').next()).map(str::to_owned).collect()
    }

    /// The reason that keeps files of it from being seen, with the remedy.
    pub(super) fn hidden(&self) -> Option<String> {
        if self.encrypted > 0 {
            return Some(format!("{} of its files are encrypted: unpack it with its password first", self.encrypted));
        }
        let inner = self.members.keys().find(|name| [".zip", ".r3d"].iter().any(|ending| name.ends_with(ending)))?;
        Some(format!("it holds another archive, {inner}: unpack it first"))
    }

    /// Unpacks a file that becomes at most `most` bytes.
    pub(super) fn read(&self, name: &str, most: u64, progress: &Progress<'_>) -> Result<Vec<u8>> {
        let member = self.member(name, most)?;
        let mut bytes = file::reserve(member.unpacked as usize, &self.place(name))?;
        self.unpack(name, most, progress, |input| {
            // A failure is told by what unpacks.
            _ = input.read_to_end(&mut bytes);
            Ok(())
        })?;
        Ok(bytes)
    }

    /// Lets `take` read a file while it is unpacked, to at most `most` bytes. Bytes that `take` leaves are looked at, too.
    pub(super) fn unpack<T>(
        &self,
        name: &str,
        most: u64,
        progress: &Progress<'_>,
        take: impl FnOnce(&mut dyn BufRead) -> Result<T>,
    ) -> Result<T> {
        let member = self.member(name, most)?;
        let fail = |problem: String| Error::format(&self.place(name), "whole file", problem);
        let (mut file, _) = file::open_bytes(&self.path)?;
        file.seek(SeekFrom::Start(member.at)).map_err(|e| Error::io(&self.path, e))?;
        file::watched(&mut file, &self.path, |input| {
            let packed = input.take(member.packed);
            let mut deflated;
            let mut stored;
            let from: &mut dyn Read = match member.method {
                Method::Deflated => {
                    deflated = DeflateDecoder::new(packed);
                    &mut deflated
                }
                _ => {
                    stored = packed;
                    &mut stored
                }
            };
            let mut unpacking = Unpacking { from, left: member.unpacked, crc: Crc::new(), failed: None, progress };
            let mut input = BufReader::with_capacity(PIECE, &mut unpacking);
            let taken = take(&mut input);
            let rest = if taken.is_ok() { u64::MAX } else { LOOKED_AT };
            let rest = std::io::copy(&mut input.by_ref().take(rest), &mut std::io::sink());
            drop(input);
            progress.check()?;
            if let (Some(problem), _) | (None, Err(problem)) = (unpacking.failed, rest.map_err(|e| e.to_string())) {
                return Err(fail(format!("it can't be unpacked: {problem}")));
            }
            let is_whole = unpacking.left == 0;
            let is_other = unpacking.crc.sum() != member.crc;
            // Damage is the reason for what a reader finds wrong.
            let is_damaged = if taken.is_ok() { !is_whole || is_other } else { is_whole && is_other };
            if is_damaged {
                let problem = "it unpacks to something else than was packed: the archive is damaged";
                return Err(fail(problem.to_owned()));
            }
            taken
        })
    }

    fn place(&self, name: &str) -> PathBuf {
        self.path.join(&self.inner).join(name)
    }

    /// A file that can become at most `most` bytes.
    fn member(&self, name: &str, most: u64) -> Result<Member> {
        let fail = |problem: String| Err(Error::format(&self.place(name), "whole file", problem));
        let Some(&member) = self.members.get(name) else {
            return fail("there is no such file in the archive".to_owned());
        };
        let possible = match member.method {
            Method::Stored => member.packed,
            Method::Deflated => member.packed.saturating_mul(DEFLATED),
            Method::Unknown => {
                return fail("it is packed in a way that is not read: pack the archive with deflate".to_owned());
            }
        };
        if member.unpacked > most || member.unpacked > possible {
            return fail(format!(
                "{} bytes that are said to unpack to {}, which is more than they can or than max_decoded_gib allows",
                member.packed, member.unpacked
            ));
        }
        Ok(member)
    }
}

/// A file while it is unpacked.
struct Unpacking<'a, 'p> {
    from: &'a mut dyn Read,
    /// Bytes of it that are still to come. Bytes beyond are not read.
    left: u64,
    crc: Crc,
    /// The first failure, which readers may pass over.
    failed: Option<String>,
    progress: &'a Progress<'p>,
}

impl Read for Unpacking<'_, '_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.progress.check().map_err(std::io::Error::other)?;
        let most = (buffer.len() as u64).min(self.left).min(PIECE as u64) as usize;
        let read = self.from.read(&mut buffer[..most]);
        match &read {
            Ok(count) => {
                self.crc.update(&buffer[..*count]);
                self.left -= *count as u64;
            }
            Err(error) => self.failed = Some(error.to_string()),
        }
        read
    }
}
