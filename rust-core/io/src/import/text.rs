//! Text in lines, through a window: numbers, words and the number of the line for messages.

use std::io::{ErrorKind, Read};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::ply::number::{self, is_blank};
use super::scan::Begin;
use super::window::Window;
use base::error::{Error, Result, known_as};

/// Longest line. A longer one is no line of text.
const LONGEST: usize = 1 << 22;

/// The lines of a text in memory. They end as those of a file do.
pub(super) fn lines_of(text: &str) -> impl Iterator<Item = &str> {
    // CR LF would make an empty line more, which would be counted: treat it as one line end first.
    text.split('\n').flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
}

/// The start of a text up to the end of its last line that is surely whole.
pub(super) fn whole_lines(start: &[u8]) -> &[u8] {
    &start[..memchr::memrchr2(b'\n', b'\r', start).unwrap_or(start.len())]
}

/// A text file that is read line by line. Lines end with LF, CR LF or CR.
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
    /// Whether any line end in the window may have a CR. Most texts have none.
    has_cr: bool,
}

impl<'a> Lines<'a> {
    /// The lines of an input of `length` bytes.
    pub(super) fn new(input: impl Read + 'a, length: u64, path: &Path) -> Self {
        Lines::over(Window::new(input, length), path)
    }

    /// The lines from where a window stands.
    pub(super) fn over(window: Window<'a>, path: &Path) -> Self {
        let mut lines = Lines { window, path: path.to_owned(), before: 0, number: 0, line: 0..0, at: 0, has_cr: false };
        lines.look_for_cr();
        lines
    }

    fn look_for_cr(&mut self) {
        self.has_cr = memchr::memchr(b'\r', self.window.rest()).is_some();
    }

    /// Goes to the next line. False at the end of the file.
    #[inline(always)]
    pub(super) fn next_line(&mut self) -> Result<bool> {
        match self.line_end(0) {
            Some((length, used)) => {
                self.take(length, used);
                Ok(true)
            }
            None => self.next_line_beyond(0),
        }
    }

    /// Joins the next line to this one if it ends with a backslash, and goes on so.
    pub(super) fn join(&mut self) -> Result<()> {
        while self.rest().ends_with(b"\\") {
            let (start, used, at) = (self.line.start, self.window.at - self.line.start, self.at - self.line.start);
            self.window.blank(self.line.end - 1..self.window.at);
            // Back to where the line begins: the window lets go only of what lies before that.
            self.window.at = start;
            match self.line_end(used) {
                Some((length, used)) => self.take(length, used),
                None => drop(self.next_line_beyond(used)?),
            }
            self.at = self.line.start + at;
        }
        Ok(())
    }

    /// The first line end from `from` on: bytes of the line before it, and with it. `None` if the next byte may belong to it.
    #[inline(always)]
    fn line_end(&self, from: usize) -> Option<(usize, usize)> {
        let text = self.window.rest();
        if !self.has_cr {
            return memchr::memchr(b'\n', &text[from..]).map(|length| (from + length, from + length + 1));
        }
        let length = from + memchr::memchr2(b'\n', b'\r', &text[from..])?;
        match (text[length], text.get(length + 1)) {
            (b'\n', _) => Some((length, length + 1)),
            (_, Some(b'\n')) => Some((length, length + 2)),
            (_, Some(_)) => Some((length, length + 1)),
            (_, None) => None,
        }
    }

    #[inline(always)]
    fn take(&mut self, length: usize, used: usize) {
        let start = self.window.at;
        self.line = start..start + length;
        self.at = start;
        self.window.at += used;
        self.number += 1;
    }

    /// The next line, whose first `known` bytes have no line end, where it goes beyond the window.
    #[cold]
    #[inline(never)]
    fn next_line_beyond(&mut self, known: usize) -> Result<bool> {
        loop {
            let held = self.window.rest().len();
            if let Some((length, used)) = self.line_end(known).filter(|end| end.0 <= LONGEST) {
                self.take(length, used);
                return Ok(true);
            }
            if held > LONGEST {
                self.number += 1;
                return Err(self.fail("the line is longer than 4 MiB: this is not text with line ends"));
            }
            if self.window.is_last() {
                if let Some(error) = self.window.failure() {
                    return Err(Error::io(&self.path, error));
                }
                // No count in the text might tell.
                if self.window.is_shorter() {
                    let cut = "the file became shorter while it was read";
                    return Err(Error::io(&self.path, std::io::Error::new(ErrorKind::UnexpectedEof, cut)));
                }
                if held == 0 {
                    self.line = self.window.at..self.window.at;
                    self.at = self.window.at;
                    return Ok(false);
                }
                // A CR at the very end is a line end; what comes after it was looked for.
                self.take(held - usize::from(self.window.rest().ends_with(b"\r")), held);
                return Ok(true);
            }
            self.window.refill();
            // A file that has become shorter ends here: seen in the next round.
            if self.window.rest().len() == held && !self.window.is_last() && !self.window.grow() {
                return Err(match self.window.failure() {
                    Some(error) => Error::io(&self.path, error),
                    None => Error::OutOfMemory(format!("{}: a line of it takes {held} bytes", known_as(&self.path))),
                });
            }
            self.look_for_cr();
        }
    }

    /// Goes to the next line that isn't blank. False at the end of the file.
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
        self.fail(format!("expected {what}, but the file ends"))
    }

    /// Goes past blanks. True if nothing is left on the line.
    #[inline(always)]
    pub(super) fn is_done(&mut self) -> bool {
        let text = self.window.padded();
        while self.at < self.line.end && is_blank(text[self.at]) {
            self.at += 1;
        }
        self.at >= self.line.end
    }

    /// The next number of the line. `None` if there is none: the line has ended, or something else stands there.
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

    /// The rest of the line.
    pub(super) fn rest(&self) -> &[u8] {
        &self.window.padded()[self.at..self.line.end]
    }

    /// Goes back to the start of the line.
    pub(super) fn rewind(&mut self) {
        self.at = self.line.start;
    }

    /// The beginning of the next line.
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

    /// The window that the file is read through, standing after the current line.
    pub(super) fn into_window(self) -> Window<'a> {
        self.window
    }

    /// The error that something else was expected where the line is at.
    #[cold]
    #[inline(never)]
    pub(super) fn expected(&mut self, what: &str) -> Error {
        if self.is_done() {
            return self.fail(format!("expected {what}, but the line ends"));
        }
        let shown: String = String::from_utf8_lossy(self.word()).chars().take(40).collect();
        self.fail(format!("expected {what}, found `{shown}`"))
    }

    /// An error on the current line.
    #[cold]
    pub(super) fn fail(&self, problem: impl Into<String>) -> Error {
        self.fail_at(self.number, problem)
    }

    /// An error on a line, which may lie before the current one.
    #[cold]
    pub(super) fn fail_at(&self, number: u64, problem: impl Into<String>) -> Error {
        // An empty file has no line; what is missing belongs on its first.
        Error::format(&self.path, format!("line {}", number.max(1)), problem)
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
            assert_eq!(
                lines.f64("a number").unwrap_err().to_string(),
                "t: line 1: expected a number, but the line ends"
            );
            assert!(lines.next_content().unwrap());
            assert_eq!((lines.number, lines.word().len()), (4, 5000));
            assert_eq!(lines.count("c").unwrap(), 7);
            assert!(lines.next_content().unwrap());
            assert_eq!(lines.f64("x").unwrap_err().to_string(), "t: line 5: expected x, found `last`");
            assert_eq!(lines.f64("f").unwrap(), 3.0);
            assert!(!lines.next_content().unwrap() && lines.is_done() && lines.left().unwrap() == 0);
        }
    }

    /// Theorem: wherever windows end, LF, CR LF and CR end a line, and a CR LF ends one.
    #[test]
    fn line_ends_of_every_kind() {
        let mut text = Vec::new();
        let mut expected = Vec::new();
        for i in 0..3000_usize {
            let line = vec![b'a' + (i % 26) as u8; i * 7919 % 23];
            text.extend(&line);
            text.extend([&b"\n"[..], b"\r", b"\r\n"][i * 31 % 3]);
            // CR and then an empty line with LF would be one line end.
            if !(expected.last().is_some_and(|_| line.is_empty()) && i * 31 % 3 == 0 && (i - 1) * 31 % 3 == 1) {
                expected.push(line);
            }
        }
        for window in [Window::new(&text[..], text.len() as u64), Window::tiny(&text[..], text.len() as u64)] {
            let mut lines = Lines::over(window, Path::new("t"));
            for (i, line) in expected.iter().enumerate() {
                assert!(lines.next_line().unwrap(), "line {i}");
                assert_eq!((lines.rest(), lines.number), (&line[..], i as u64 + 1));
            }
            assert!(!lines.next_line().unwrap());
        }
        let joined = String::from_utf8(text).unwrap();
        assert_eq!(lines_of(&joined).map(str::as_bytes).collect::<Vec<_>>()[..expected.len()], expected);
    }

    /// A file that is cut while it is read is said to be so. Memory is not what is short.
    #[test]
    fn a_file_that_becomes_shorter_is_named() {
        let text = b"v 1 2 3\nv 4 5 6\nv 7 8".repeat(100);
        let mut lines = Lines::new(&text[..], 1 << 40, Path::new("t"));
        let error = loop {
            match lines.next_line() {
                Ok(more) => assert!(more, "the file ends as if it were whole"),
                Err(error) => break error,
            }
        };
        assert!(matches!(&error, Error::Io { .. }) && error.to_string().contains("became shorter"), "{error}");
    }

    #[test]
    fn no_line_is_endless() {
        let text = vec![b'x'; LONGEST + 2];
        let mut lines = Lines::new(&text[..], text.len() as u64, Path::new("t"));
        assert!(lines.next_line().unwrap_err().to_string().starts_with("t: line 1: the line is longer"));
    }
}
