//! Lines of a text file as numbers, names or comments.

use std::io::{BufRead, BufReader, ErrorKind, Read};

use super::problem::{Kind, Problem, shorten};

/// No line of points is this long.
const LONGEST: usize = 1 << 16;

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
    /// Whether the line before ended with CR: an LF now belongs to that.
    after_cr: bool,
    bytes: Vec<u8>,
    numbers: Vec<f64>,
    /// Whether commas between digits were taken as decimal points on any line so far.
    pub(super) decimal_commas: bool,
    /// Whether commas stood between the numbers of any line so far.
    pub(super) comma_separated: bool,
}

/// The role of a comma of a line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Comma {
    /// There is none.
    None,
    /// It stands between numbers.
    Separator,
    /// It stands between the digits of one.
    Point,
    /// Each second one is a point, as it seems, and the others are separators.
    Both,
}

impl<R: Read> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        let reader = BufReader::with_capacity(1 << 18, source);
        Lines {
            reader,
            number: 0,
            after_cr: false,
            bytes: Vec::new(),
            numbers: Vec::new(),
            decimal_commas: false,
            comma_separated: false,
        }
    }

    /// Reads a line without its end. False at the end of the file. What is longer than [`LONGEST`] comes in parts.
    fn read_line(&mut self) -> std::io::Result<bool> {
        self.bytes.clear();
        loop {
            let held = match self.reader.fill_buf() {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                held => held?,
            };
            if held.is_empty() {
                return Ok(!self.bytes.is_empty());
            }
            if std::mem::take(&mut self.after_cr) && held[0] == b'\n' {
                self.reader.consume(1);
                continue;
            }
            let held = &held[..held.len().min(LONGEST - self.bytes.len())];
            match memchr::memchr2(b'\n', b'\r', held) {
                Some(length) => {
                    self.bytes.extend_from_slice(&held[..length]);
                    self.after_cr = held[length] == b'\r';
                    self.reader.consume(length + 1);
                    return Ok(true);
                }
                None => {
                    let length = held.len();
                    self.bytes.extend_from_slice(held);
                    self.reader.consume(length);
                    if self.bytes.len() == LONGEST {
                        return Ok(true);
                    }
                }
            }
        }
    }

    /// The next line that isn't empty, with its number counted from 1. `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<(u64, Line<'_>)>, Problem> {
        loop {
            let read = self.read_line();
            if !read.map_err(|e| Problem { line: self.number.max(1), kind: Kind::Io(e) })? {
                return Ok(None);
            }
            self.number += 1;
            if self.bytes.len() == LONGEST {
                return Err(Problem::text(self.number, "longer than 65,536 bytes: a point has one line"));
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
        let comma = if self.bytes.contains(&b',') { comma(&self.bytes) } else { Comma::None };
        if comma == Comma::Both {
            return Err(Problem::text(self.number, REMEDY));
        }
        Ok(Some((self.number, self.split(comma))))
    }

    fn split(&mut self, comma: Comma) -> Line<'_> {
        // Between semicolons nothing else was possible.
        self.decimal_commas |= comma == Comma::Point && !self.bytes.contains(&b';');
        for byte in &mut self.bytes {
            match *byte {
                b',' if comma == Comma::Point => *byte = b'.',
                b',' | b';' | b'\t' => *byte = b' ',
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
            None => {
                self.comma_separated |= comma == Comma::Separator;
                Line::Numbers(&self.numbers)
            }
            Some(_) if self.numbers.is_empty() => Line::Names(words(&self.bytes)),
            Some(found) => Line::Strange { found },
        }
    }
}

/// The fault and the remedy of numbers whose decimal commas also separate them.
pub(super) const REMEDY: &str = "decimal commas can't be told from commas between the numbers: write decimal points, or \
                                 semicolons between the numbers";

/// The role of the commas of a line.
fn comma(line: &[u8]) -> Comma {
    if line.contains(&b';') {
        return Comma::Point;
    }
    if memchr::memchr2(b' ', b'\t', line).is_some() {
        // Blanks separate three numbers or more, and each comma stands within one of them.
        let words = || line.split(|b| matches!(b, b' ' | b'\t')).filter(|word| !word.is_empty());
        if words().all(|word| !word.contains(&b',') || is_number_with_comma(word)) && words().nth(2).is_some() {
            return Comma::Point;
        }
    }
    if line.contains(&b'.') {
        return Comma::Separator;
    }
    // Pairs of whole numbers, of which the second begins with a zero now and then, as fractions do, and the first never.
    let (mut count, mut padded) = (0, [false; 2]);
    for part in line.split(|b| *b == b',') {
        let part = part.trim_ascii();
        let digits = if count % 2 == 0 { part.strip_prefix(b"-").unwrap_or(part) } else { part };
        if digits.is_empty() || !digits.iter().all(u8::is_ascii_digit) {
            return Comma::Separator;
        }
        padded[count % 2] |= digits.len() > 1 && digits[0] == b'0';
        count += 1;
    }
    if count >= 6 && count % 2 == 0 && padded == [false, true] { Comma::Both } else { Comma::Separator }
}

/// Whether a word is a number whose decimal point is a comma.
fn is_number_with_comma(word: &[u8]) -> bool {
    let Some(at) = word.iter().position(|&b| b == b',') else { return false };
    let (whole, fraction) = (&word[..at], &word[at + 1..]);
    let whole = whole.strip_prefix(b"-").or_else(|| whole.strip_prefix(b"+")).unwrap_or(whole);
    let digits = fraction.iter().take_while(|b| b.is_ascii_digit()).count();
    let is_end = |rest: &[u8]| match rest {
        [] => true,
        [b'e' | b'E', exponent @ ..] => {
            let exponent = exponent.strip_prefix(b"-").or_else(|| exponent.strip_prefix(b"+")).unwrap_or(exponent);
            !exponent.is_empty() && exponent.iter().all(u8::is_ascii_digit)
        }
        _ => false,
    };
    !whole.is_empty() && whole.iter().all(u8::is_ascii_digit) && digits > 0 && is_end(&fraction[digits..])
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
