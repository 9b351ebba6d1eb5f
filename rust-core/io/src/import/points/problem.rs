//! Faults of a file of points, with their lines.

use std::path::Path;

use base::error::{Error, known_as};

/// A fault, and its line.
#[derive(Debug)]
pub(super) struct Problem {
    pub(super) line: u64,
    pub(super) kind: Kind,
}

#[derive(Debug)]
pub(super) enum Kind {
    Text(String),
    Memory(usize),
    Io(std::io::Error),
}

impl Problem {
    pub(super) fn text(line: u64, text: impl Into<String>) -> Self {
        Problem { line, kind: Kind::Text(text.into()) }
    }

    pub(super) fn into_error(self, path: &Path) -> Error {
        match self.kind {
            Kind::Text(text) => Error::format(path, format!("line {}", self.line), text),
            Kind::Memory(points) => Error::OutOfMemory(format!("{}: more than {points} points", known_as(path))),
            Kind::Io(error) => Error::io(path, error),
        }
    }
}

/// Text for a message, not too long.
pub(super) fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(40).collect();
    if short.len() < text.len() {
        short.push('…');
    }
    short
}
