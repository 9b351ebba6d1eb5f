//! What can be wrong with a PLY file, put into words with the place where it is.

use std::fmt;

use super::header::{Element, ScalarType};
use super::number;

/// Result while parsing; the path is added at the end.
pub(super) type Parsed<T> = Result<T, Box<Problem>>;

/// What is wrong where.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Problem {
    pub(super) at: String,
    pub(super) text: String,
    /// Memory was refused: not the file's fault.
    pub(super) memory: bool,
}

impl Problem {
    pub(super) fn new(at: impl Into<String>, text: impl Into<String>) -> Box<Self> {
        Box::new(Problem { at: at.into(), text: text.into(), memory: false })
    }

    pub(super) fn memory(what: impl Into<String>) -> Box<Self> {
        Box::new(Problem { at: String::new(), text: what.into(), memory: true })
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.text)
    }
}

/// What can go wrong reading one value; small, since it comes out of the innermost loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    /// The file ends.
    End,
    /// The line ends at this byte though the element doesn't.
    LineEnd(usize),
    /// At this byte there is no number.
    NoNumber(usize),
    /// At this byte there is no whole number.
    NoWhole(usize),
    /// The line goes on at this byte after the element.
    LineGoesOn(usize),
    /// The value doesn't fit its type.
    Range(i64, ScalarType),
}

impl Fault {
    /// In words, at entry `index` of `element`, reading its property number `property`. `text`: the file if it is text.
    #[cold]
    pub(super) fn at(
        self,
        element: &Element,
        index: u64,
        property: Option<usize>,
        text: Option<&[u8]>,
    ) -> Box<Problem> {
        let entry = place(element, index);
        let entry = match property.and_then(|p| element.properties.get(p)) {
            Some(property) => format!("{entry}, property {}", property.name),
            None => entry,
        };
        let (byte, problem) = match self {
            Fault::End => return Problem::new(entry, "the file ends"),
            Fault::Range(value, scalar) => {
                return Problem::new(entry, format!("{value} is out of range (the type is {})", scalar.name()));
            }
            Fault::LineEnd(byte) => (byte, "the line ends too early; an element has one line".to_owned()),
            Fault::NoNumber(byte) => (byte, format!("expected a number, found `{}`", token(text, byte))),
            Fault::NoWhole(byte) => (byte, format!("expected a whole number, found `{}`", token(text, byte))),
            Fault::LineGoesOn(byte) => {
                (byte, format!("expected the end of the line, found `{}`; an element has one line", token(text, byte)))
            }
        };
        Problem::new(format!("line {}", line_number(text.unwrap_or(&[]), byte)), format!("{entry}: {problem}"))
    }
}

/// An entry of an element, as messages name it.
pub(super) fn place(element: &Element, index: u64) -> String {
    format!("{} {index} of {} (counted from 0)", element.name, element.count)
}

fn token(text: Option<&[u8]>, at: usize) -> String {
    let Some(text) = text else { return String::new() };
    let end = number::token_end(text, at);
    let mut shown: String = String::from_utf8_lossy(&text[at..end.min(at + 160)]).chars().take(40).collect();
    if end - at > shown.len() {
        shown.push('…');
    }
    shown
}

/// Number of the line that holds byte `at`, counted from 1; LF, CR LF and CR all end lines.
pub(super) fn line_number(text: &[u8], at: usize) -> usize {
    let before = &text[..at.min(text.len())];
    let ends = (0..before.len())
        .filter(|&i| before[i] == b'\n' || (before[i] == b'\r' && text.get(i + 1) != Some(&b'\n')))
        .count();
    ends + 1
}
