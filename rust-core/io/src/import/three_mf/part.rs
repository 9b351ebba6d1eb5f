//! A part of a package, read as a stream of XML of which one tag or text is in memory at a time.

use std::io::{BufRead, Error as IoError, Read, Result as IoResult};

use quick_xml::events::{BytesStart, Event};
use quick_xml::{Error as XmlError, Reader, XmlVersion};

use crate::import::scan::FileScan;
use base::error::{Error, Result};

/// Mebibytes of one tag or text, at most.
const LONGEST: u64 = 16;
/// Deepest nesting of elements.
const DEEPEST: usize = 256;

/// A part while it is read.
pub(super) struct Part<'a> {
    scan: &'a FileScan,
    name: &'a str,
    xml: Reader<Text<'a>>,
    /// Elements that are open.
    depth: usize,
}

impl<'a> Part<'a> {
    pub(super) fn new(scan: &'a FileScan, name: &'a str, from: &'a mut dyn BufRead) -> Self {
        Part { scan, name, xml: Reader::from_reader(Text { from, line: 1, left: 0 }), depth: 0 }
    }

    /// Reads the next tag or text into a buffer.
    ///
    /// # Errors
    /// It is no XML, or XML that 3MF excludes, or longer or deeper than is read.
    pub(super) fn next<'b>(&mut self, buffer: &'b mut Vec<u8>) -> Result<Event<'b>> {
        buffer.clear();
        self.xml.get_mut().left = LONGEST << 20;
        let event = self.xml.read_event_into(buffer).map_err(|error| match error {
            XmlError::Encoding(_) => self.fail("it is not UTF-8, as XML of 3MF must be"),
            other => self.fail(other.to_string()),
        })?;
        match &event {
            Event::Start(_) if self.depth == DEEPEST => {
                return Err(self.fail(format!("elements are nested more than {DEEPEST} deep, which is the most")));
            }
            Event::Start(_) => self.depth += 1,
            Event::End(_) => self.depth -= 1,
            Event::DocType(_) => {
                return Err(self.fail("3MF files have no DTD, but this one has: export the model again"));
            }
            Event::Eof if self.depth > 0 => {
                return Err(self.fail("it ends within an element: export the model again"));
            }
            _ => {}
        }
        Ok(event)
    }

    /// Bytes read so far.
    pub(super) fn position(&self) -> u64 {
        self.xml.buffer_position()
    }

    /// An error where the reader is.
    pub(super) fn fail(&self, problem: impl Into<String>) -> Error {
        Error::format(&self.scan.path, format!("{}, line {}", self.name, self.xml.get_ref().line), problem)
    }

    /// An attribute of a tag by its local name, unescaped.
    pub(super) fn attribute(&self, tag: &BytesStart<'_>, name: &str) -> Result<Option<String>> {
        for attribute in tag.attributes().with_checks(false) {
            let attribute = attribute.map_err(|e| self.fail(e.to_string()))?;
            if attribute.key.local_name().into_inner() == name {
                let value = attribute.normalized_value(XmlVersion::Implicit1_0);
                return value.map(|value| Some(value.into_owned())).map_err(|e| self.fail(e.to_string()));
            }
        }
        Ok(None)
    }
}

/// Text that counts its lines, and gives no more than a tag may have.
struct Text<'a> {
    from: &'a mut dyn BufRead,
    line: usize,
    left: u64,
}

impl BufRead for Text<'_> {
    fn fill_buf(&mut self) -> IoResult<&[u8]> {
        if self.left == 0 {
            let problem =
                format!("a tag or a text is longer than {LONGEST} MiB, which is the most: export the model again");
            return Err(IoError::other(problem));
        }
        let bytes = self.from.fill_buf()?;
        Ok(&bytes[..bytes.len().min(usize::try_from(self.left).unwrap_or(usize::MAX))])
    }

    fn consume(&mut self, count: usize) {
        // These bytes are there already: nothing is read.
        if let Ok(bytes) = self.from.fill_buf() {
            self.line += memchr::memchr_iter(b'\n', &bytes[..count.min(bytes.len())]).count();
        }
        self.left -= count as u64;
        self.from.consume(count);
    }
}

impl Read for Text<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> IoResult<usize> {
        let count = self.fill_buf()?.read(buffer)?;
        self.consume(count);
        Ok(count)
    }
}
