//! A file seen through a window that moves along it: reading takes the memory of the window, not that of the file.

use std::io::{ErrorKind, Read};

/// Line ends kept after the bytes in the window, so that a few bytes may be looked at past their end.
pub(super) const PAD: usize = 32;

/// Fewest bytes held at once, unless the file has fewer.
pub(super) const SMALLEST: usize = 1 << 10;

/// Bytes held at once, while nothing asks for more: fits the cache next to what is made of it.
const SIZE: usize = 1 << 18;

/// A window on bytes that come from a reader.
pub(super) struct Window<'a> {
    reader: Box<dyn Read + 'a>,
    /// Bytes the reader still has to give.
    unread: u64,
    /// The bytes in the window, [`PAD`] line ends after them, and room.
    buffer: Vec<u8>,
    /// End of the bytes in the window.
    end: usize,
    /// The next byte to be used.
    pub(super) at: usize,
    /// Bytes of the file before the window.
    before: u64,
    /// Reason why reading stopped early. The window then looks as if the file ended.
    failure: Option<std::io::Error>,
    /// Whether the file has become shorter since its length was asked.
    is_shorter: bool,
}

impl<'a> Window<'a> {
    /// A window on the `length` bytes that `reader` gives.
    pub(super) fn new(reader: impl Read + 'a, length: u64) -> Self {
        Self::sized(reader, length, SIZE)
    }

    /// A small one, for the start of a file. It can grow.
    pub(super) fn small(reader: impl Read + 'a, length: u64) -> Self {
        Self::sized(reader, length, 1 << 12)
    }

    /// The smallest that readers can work with.
    #[cfg(any(test, fuzzing))]
    pub(super) fn tiny(reader: impl Read + 'a, length: u64) -> Self {
        Self::sized(reader, length, SMALLEST)
    }

    fn sized(reader: impl Read + 'a, length: u64, size: usize) -> Self {
        let size = usize::try_from(length).map_or(size, |length| length.min(size));
        let buffer = vec![b'\n'; size + PAD];
        let mut window = Window {
            reader: Box::new(reader),
            unread: length,
            buffer,
            end: 0,
            at: 0,
            before: 0,
            failure: None,
            is_shorter: false,
        };
        window.refill();
        window
    }

    /// The bytes in the window with [`PAD`] line ends after them.
    #[inline(always)]
    pub(super) fn padded(&self) -> &[u8] {
        &self.buffer
    }

    /// The bytes in the window that are still to be used.
    #[inline(always)]
    pub(super) fn rest(&self) -> &[u8] {
        &self.buffer[self.at.min(self.end)..self.end]
    }

    /// The end of the bytes in the window.
    #[inline(always)]
    pub(super) fn end(&self) -> usize {
        self.end
    }

    /// Whether the file ends with the window.
    #[inline(always)]
    pub(super) fn is_last(&self) -> bool {
        self.unread == 0
    }

    /// Bytes of the file still to be used.
    pub(super) fn left(&self) -> u64 {
        self.unread + (self.end - self.at.min(self.end)) as u64
    }

    /// Place in the file of a byte of the window.
    pub(super) fn offset(&self, at: usize) -> u64 {
        self.before + at as u64
    }

    /// Moves the window on if it has fewer than `wanted` unused bytes, at most [`SMALLEST`]. True if it has them then.
    #[inline(always)]
    pub(super) fn ensure(&mut self, wanted: usize) -> bool {
        if self.end.saturating_sub(self.at) >= wanted {
            return true;
        }
        if !self.is_last() {
            self.refill();
        }
        self.end.saturating_sub(self.at) >= wanted
    }

    /// Moves the window to the next unused byte.
    #[cold]
    #[inline(never)]
    pub(super) fn refill(&mut self) {
        let used = self.at.min(self.end);
        self.buffer.copy_within(used..self.end, 0);
        self.before += used as u64;
        self.end -= used;
        self.at -= used;
        self.fill();
    }

    /// Makes bytes of the window blanks.
    pub(super) fn blank(&mut self, bytes: std::ops::Range<usize>) {
        self.buffer[bytes].fill(b' ');
    }

    /// Makes room for more without letting go of anything. False if there is no more or no memory.
    pub(super) fn grow(&mut self) -> bool {
        let more = (self.buffer.len() * 3).min(usize::try_from(self.unread).unwrap_or(usize::MAX));
        if self.is_last() || self.buffer.try_reserve_exact(more).is_err() {
            return false;
        }
        self.buffer.resize(self.buffer.len() + more, b'\n');
        self.fill();
        true
    }

    fn fill(&mut self) {
        while self.unread > 0 && self.end + PAD < self.buffer.len() {
            let room = (self.buffer.len() - PAD - self.end).min(usize::try_from(self.unread).unwrap_or(usize::MAX));
            match self.reader.read(&mut self.buffer[self.end..self.end + room]) {
                Ok(0) => {
                    self.is_shorter = true;
                    self.unread = 0;
                }
                Ok(count) => {
                    self.end += count;
                    self.unread -= count as u64;
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => {
                    self.failure = Some(error);
                    self.unread = 0;
                }
            }
        }
        self.buffer[self.end..self.end + PAD].fill(b'\n');
    }

    /// Whether there were fewer bytes than were announced.
    pub(super) fn is_shorter(&self) -> bool {
        self.is_shorter
    }

    /// Reason why reading stopped early, if it did.
    pub(super) fn failure(&mut self) -> Option<std::io::Error> {
        self.failure.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a few bytes at a time, and an interruption now and then.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            self.1 += 1;
            if self.1.is_multiple_of(3) {
                return Err(ErrorKind::Interrupted.into());
            }
            let count = buffer.len().min(1 + self.1 * 7919 % 5000).min(self.0.len());
            buffer[..count].copy_from_slice(&self.0[..count]);
            self.0 = &self.0[count..];
            Ok(count)
        }
    }

    #[test]
    fn all_bytes_come_in_order() {
        let bytes: Vec<u8> = (0..3 * SIZE + 17).map(|i| (i * 31 % 251) as u8).collect();
        let mut reader = Slow(&bytes, 0);
        let mut window = Window::new(&mut reader, bytes.len() as u64);
        let mut seen = Vec::new();
        while window.ensure(1) {
            assert_eq!(window.offset(window.at), seen.len() as u64);
            assert_eq!(window.left(), (bytes.len() - seen.len()) as u64);
            let taken = window.rest().len().min(1000 + seen.len() % 777);
            seen.extend_from_slice(&window.rest()[..taken]);
            window.at += taken;
            assert_eq!(window.padded()[window.end()..window.end() + PAD], [b'\n'; PAD]);
        }
        assert!(seen == bytes && window.is_last() && window.left() == 0 && window.failure().is_none());
    }

    #[test]
    fn a_shorter_file_and_a_failing_one_end() {
        let mut short = &b"abc"[..];
        let mut window = Window::new(&mut short, 1 << 40);
        assert!(window.ensure(3) && !window.ensure(4) && window.is_last());
        struct Failing;
        impl Read for Failing {
            fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
                Err(std::io::Error::other("broken disk"))
            }
        }
        let mut failing = Failing;
        let mut window = Window::new(&mut failing, 10);
        assert!(!window.ensure(1));
        assert_eq!(window.failure().unwrap().to_string(), "broken disk");
    }

    #[test]
    fn grows_to_the_whole_file() {
        let bytes = vec![7; 5 * SIZE];
        let mut reader = &bytes[..];
        let mut window = Window::new(&mut reader, bytes.len() as u64);
        while window.grow() {}
        assert_eq!(window.rest(), &bytes[..]);
    }
}
