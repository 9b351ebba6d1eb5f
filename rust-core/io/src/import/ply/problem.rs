//! Faults of a PLY file, with the place.

use std::fmt;
use std::io::Read;
use std::path::Path;

use base::error::{Error, known_as};

/// Result while parsing. The path is added at the end.
pub(super) type Parsed<T> = Result<T, Box<Problem>>;

/// A fault and its place.
#[derive(Debug)]
pub(super) struct Problem {
    /// Line or element. Empty until the line of `byte` is known.
    pub(super) at: String,
    pub(super) text: String,
    /// A byte of the line that the problem is on.
    byte: Option<u64>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    /// The file is at fault.
    Format,
    /// Memory was refused.
    Memory,
    /// Reading failed.
    Io(std::io::Error),
}

impl Problem {
    pub(super) fn new(at: impl Into<String>, text: impl Into<String>) -> Box<Self> {
        Box::new(Problem { at: at.into(), text: text.into(), byte: None, kind: Kind::Format })
    }

    /// A problem on the line of that byte of a text file.
    pub(super) fn on_line_of(byte: u64, text: impl Into<String>) -> Box<Self> {
        Box::new(Problem { at: String::new(), text: text.into(), byte: Some(byte), kind: Kind::Format })
    }

    pub(super) fn memory(what: impl Into<String>) -> Box<Self> {
        Box::new(Problem { at: String::new(), text: what.into(), byte: None, kind: Kind::Memory })
    }

    pub(super) fn io(error: std::io::Error) -> Box<Self> {
        Box::new(Problem { at: String::new(), text: error.to_string(), byte: None, kind: Kind::Io(error) })
    }

    /// Finds the line, if there is one to find, by reading the file again up to it.
    pub(super) fn locate(mut self: Box<Self>, file: &mut dyn Read) -> Box<Self> {
        if let Some(byte) = self.byte.take() {
            self.at = match line_number(file, byte) {
                Ok(line) => format!("line {line}"),
                Err(_) => format!("byte {byte}"),
            };
        }
        self
    }

    pub(super) fn into_error(self, path: &Path) -> Error {
        match self.kind {
            Kind::Memory => Error::OutOfMemory(format!("{}: {}", known_as(path), self.text)),
            Kind::Io(error) => Error::io(path, error),
            Kind::Format => Error::format(path, self.at, self.text),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.text)
    }
}

/// Number of the line that holds byte `at`, counted from 1. LF, CR LF and CR all end lines.
fn line_number(file: &mut dyn Read, at: u64) -> std::io::Result<u64> {
    let mut line = 1;
    let mut before = 0;
    let mut buffer = vec![0; 1 << 16];
    let mut file = file.take(at);
    loop {
        let count = file.read(&mut buffer)?;
        if count == 0 {
            return Ok(line);
        }
        for &byte in &buffer[..count] {
            line += u64::from(byte == b'\r' || (byte == b'\n' && before != b'\r'));
            before = byte;
        }
    }
}
