//! Lines of a text file as numbers, names or comments.

use std::io::{BufRead, BufReader, Read};

use super::{Kind, Problem, shorten};

/// No line of points is this long.
const LONGEST: u64 = 1 << 16;

/// One line that isn't empty.
pub(super) enum Line<'a> {
    /// Words of a comment, without its mark.
    Comment(Vec<String>),
    /// Only numbers.
    Numbers(&'a [f64]),
    /// Starts with a word that isn't a number.
    Names(Vec<String>),
    /// Starts with a number and goes on with something else.
    Strange {
        /// The first thing that isn't a number.
        found: String,
    },
}

/// Reads a file line by line.
pub(super) struct Lines<R> {
    reader: BufReader<R>,
    number: u64,
    bytes: Vec<u8>,
    numbers: Vec<f64>,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Lines { reader: BufReader::with_capacity(1 << 18, source), number: 0, bytes: Vec::new(), numbers: Vec::new() }
    }

    /// The next line that isn't empty, with its number counted from 1; `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<(u64, Line<'_>)>, Problem> {
        loop {
            self.bytes.clear();
            let mut limited = (&mut self.reader).take(LONGEST);
            let read = limited.read_until(b'\n', &mut self.bytes);
            let count = read.map_err(|e| Problem { line: self.number.max(1), kind: Kind::Io(e) })?;
            if count == 0 {
                return Ok(None);
            }
            self.number += 1;
            if count as u64 == LONGEST && self.bytes.last() != Some(&b'\n') {
                return Err(Problem::text(self.number, "longer than 65,536 bytes; a point has one line"));
            }
            if self.number == 1 && self.bytes.starts_with(b"\xEF\xBB\xBF") {
                self.bytes.drain(..3);
            }
            if self.bytes.iter().any(|b| !b.is_ascii_whitespace()) {
                break;
            }
        }
        let start = self.bytes.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(0);
        for mark in [&b"#"[..], b"//", b"%", b"!"] {
            if self.bytes[start..].starts_with(mark) {
                return Ok(Some((self.number, Line::Comment(words(&self.bytes[start + mark.len()..])))));
            }
        }
        Ok(Some((self.number, self.split())))
    }

    fn split(&mut self) -> Line<'_> {
        // A comma between semicolons can only be a decimal point.
        let decimal_comma = self.bytes.contains(&b';') && self.bytes.contains(&b',');
        for byte in &mut self.bytes {
            match *byte {
                b',' if decimal_comma => *byte = b'.',
                b',' | b';' | b'\t' | b'\r' | b'\n' => *byte = b' ',
                _ => {}
            }
        }
        self.numbers.clear();
        let mut strange = None;
        for word in self.bytes.split(|b| *b == b' ').filter(|word| !word.is_empty()) {
            match number(word) {
                Some(value) => self.numbers.push(value),
                None => {
                    strange = Some(shorten(&String::from_utf8_lossy(word)));
                    break;
                }
            }
        }
        match strange {
            None => Line::Numbers(&self.numbers),
            Some(_) if self.numbers.is_empty() => Line::Names(words(&self.bytes)),
            Some(found) => Line::Strange { found },
        }
    }
}

fn words(bytes: &[u8]) -> Vec<String> {
    String::from_utf8_lossy(bytes)
        .split(|c: char| c.is_whitespace() || ",;".contains(c))
        .filter(|word| !word.is_empty())
        .take(64)
        .map(str::to_owned)
        .collect()
}

/// A number as people and programs write it, `nan` and `-inf` among them.
fn number(word: &[u8]) -> Option<f64> {
    // Plain decimal numbers start so; `infinity` and its kind are left to names unless they have a sign or are short.
    if !matches!(word[0], b'0'..=b'9' | b'-' | b'+' | b'.') && !is_special(word) {
        return None;
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}

fn is_special(word: &[u8]) -> bool {
    [&b"nan"[..], b"inf"].iter().any(|special| word.eq_ignore_ascii_case(special))
}
