//! Text in lines, through a window: numbers, words and the number of the line for messages.

use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::Begin;
use super::ply::number::{self, is_blank};
use super::window::Window;
use crate::error::{Error, Result};

/// Longest line; what is longer is no line of text.
const LONGEST: usize = 1 << 22;

/// A text file that is read line by line. Lines end with LF or CR LF.
pub(super) struct Lines<'a> {
    window: Window<'a>,
    path: PathBuf,
    /// Bytes of the file before the window's.
    before: u64,
    /// Number of the current line, counted from 1.
    pub(super) number: u64,
    /// The current line in the window, without its end.
    line: Range<usize>,
    /// The next byte of the current line to be used.
    at: usize,
}

impl<'a> Lines<'a> {
    /// The lines of an input of `length` bytes.
    pub(super) fn new(input: impl Read + 'a, length: u64, path: &Path) -> Self {
        Lines::over(Window::new(input, length), path)
    }

    /// The lines from where a window stands.
    pub(super) fn over(window: Window<'a>, path: &Path) -> Self {
        Lines { window, path: path.to_owned(), before: 0, number: 0, line: 0..0, at: 0 }
    }

    /// Goes to the next line; false at the end of the file.
    #[inline(always)]
    pub(super) fn next_line(&mut self) -> Result<bool> {
        let rest = self.window.rest();
        if let Some(length) = memchr::memchr(b'\n', rest) {
            self.take(length, length + 1);
            return Ok(true);
        }
        self.next_line_beyond()
    }

    #[inline(always)]
    fn take(&mut self, length: usize, used: usize) {
        let start = self.window.at;
        self.line = start..start + length;
        self.at = start;
        self.window.at += used;
        self.number += 1;
    }

    #[cold]
    #[inline(never)]
    fn next_line_beyond(&mut self) -> Result<bool> {
        loop {
            let held = self.window.rest().len();
            if let Some(length) = memchr::memchr(b'\n', self.window.rest()).filter(|&length| length <= LONGEST) {
                self.take(length, length + 1);
                return Ok(true);
            }
            if held > LONGEST {
                self.number += 1;
                return Err(self.fail("the line is longer than 4 MiB; this is not text with line ends"));
            }
            if self.window.is_last() {
                if let Some(error) = self.window.failure() {
                    return Err(Error::io(&self.path, error));
                }
                if held == 0 {
                    self.line = self.window.at..self.window.at;
                    self.at = self.window.at;
                    return Ok(false);
                }
                self.take(held, held);
                return Ok(true);
            }
            self.window.refill();
            if self.window.rest().len() == held && !self.window.grow() {
                return Err(match self.window.failure() {
                    Some(error) => Error::io(&self.path, error),
                    None => Error::OutOfMemory(format!("{}: a line of {held} bytes", self.path.display())),
                });
            }
        }
    }

    /// Goes to the next line that isn't blank; false at the end of the file.
    #[inline(always)]
    pub(super) fn next_content(&mut self) -> Result<bool> {
        while self.next_line()? {
            if !self.is_done() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Goes to the next line, which must be there.
    #[inline(always)]
    pub(super) fn expect_line(&mut self, what: &str) -> Result<()> {
        if self.next_line()? { Ok(()) } else { Err(self.ends(what)) }
    }

    /// The error of a file that ends too early.
    #[cold]
    pub(super) fn ends(&self, what: &str) -> Error {
        self.fail(format!("the file ends; expected {what}"))
    }

    /// Goes past blanks; true if nothing is left on the line.
    #[inline(always)]
    pub(super) fn is_done(&mut self) -> bool {
        let text = self.window.padded();
        while self.at < self.line.end && is_blank(text[self.at]) {
            self.at += 1;
        }
        self.at >= self.line.end
    }

    /// The next number of the line; `None` if there is none: the line has ended, or something else stands there.
    #[inline(always)]
    pub(super) fn try_f64(&mut self) -> Option<f64> {
        if self.is_done() {
            return None;
        }
        let (value, end) = number::read_f64(self.window.padded(), self.at)?;
        self.at = end;
        Some(value)
    }

    /// The next number of the line.
    #[inline(always)]
    pub(super) fn f64(&mut self, what: &str) -> Result<f64> {
        match self.try_f64() {
            Some(value) => Ok(value),
            None => Err(self.expected(what)),
        }
    }

    /// The next whole number of the line, not negative.
    #[inline(always)]
    pub(super) fn count(&mut self, what: &str) -> Result<u64> {
        if !self.is_done()
            && let Some((value, end)) = number::read_integer(self.window.padded(), self.at)
            && let Ok(value) = u64::try_from(value)
        {
            self.at = end;
            return Ok(value);
        }
        Err(self.expected(what))
    }

    /// The next word of the line, empty at its end.
    #[inline(always)]
    pub(super) fn word(&mut self) -> &[u8] {
        self.is_done();
        let (start, line_end) = (self.at, self.line.end);
        let text = self.window.padded();
        let length = text[start..line_end].iter().position(|&b| is_blank(b)).unwrap_or(line_end - start);
        self.at = start + length;
        &self.window.padded()[start..start + length]
    }

    /// What is left of the line.
    pub(super) fn rest(&self) -> &[u8] {
        &self.window.padded()[self.at..self.line.end]
    }

    /// Goes back to the start of the line.
    pub(super) fn rewind(&mut self) {
        self.at = self.line.start;
    }

    /// Where the next line begins.
    pub(super) fn begin(&self) -> Begin {
        Begin { byte: self.before + self.window.offset(self.window.at), line: self.number }
    }

    /// The input stands there already: counts on from it.
    pub(super) fn continue_from(&mut self, begin: Begin) {
        (self.before, self.number) = (begin.byte, begin.line);
    }

    /// Bytes of the file after the current line.
    pub(super) fn left(&mut self) -> Result<u64> {
        // A read that failed looks like the end of the file.
        match self.window.failure() {
            Some(error) => Err(Error::io(&self.path, error)),
            None => Ok(self.window.left()),
        }
    }

    /// What the file is read through, standing after the current line.
    pub(super) fn into_window(self) -> Window<'a> {
        self.window
    }

    /// The error that something else was expected where the line is at.
    #[cold]
    #[inline(never)]
    pub(super) fn expected(&mut self, what: &str) -> Error {
        if self.is_done() {
            return self.fail(format!("the line ends; expected {what}"));
        }
        let shown: String = String::from_utf8_lossy(self.word()).chars().take(40).collect();
        self.fail(format!("expected {what}, found `{shown}`"))
    }

    /// An error on the current line.
    #[cold]
    pub(super) fn fail(&self, problem: impl Into<String>) -> Error {
        // An empty file has no line; what is missing belongs on its first.
        Error::format(&self.path, format!("line {}", self.number.max(1)), problem)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_words_and_numbers_whatever_the_window() {
        let mut text = b"a 1 -2.5\r\n\r\n  \n".to_vec();
        text.extend(std::iter::repeat_n(b'x', 5000));
        text.extend(b" 7\nlast 3");
        for window in [Window::new(&text[..], text.len() as u64), Window::tiny(&text[..], text.len() as u64)] {
            let mut lines = Lines::over(window, Path::new("t"));
            assert!(lines.next_content().unwrap());
            assert_eq!((lines.number, lines.word()), (1, &b"a"[..]));
            assert_eq!((lines.count("c").unwrap(), lines.f64("f").unwrap()), (1, -2.5));
            assert_eq!(lines.f64("a number").unwrap_err().to_string(), "t: line 1: the line ends; expected a number");
            assert!(lines.next_content().unwrap());
            assert_eq!((lines.number, lines.word().len()), (4, 5000));
            assert_eq!(lines.count("c").unwrap(), 7);
            assert!(lines.next_content().unwrap());
            assert_eq!(lines.f64("x").unwrap_err().to_string(), "t: line 5: expected x, found `last`");
            assert_eq!(lines.f64("f").unwrap(), 3.0);
            assert!(!lines.next_content().unwrap() && lines.is_done() && lines.left().unwrap() == 0);
        }
    }

    #[test]
    fn no_line_is_endless() {
        let text = vec![b'x'; LONGEST + 2];
        let mut lines = Lines::new(&text[..], text.len() as u64, Path::new("t"));
        assert!(lines.next_line().unwrap_err().to_string().starts_with("t: line 1: the line is longer"));
    }
}
