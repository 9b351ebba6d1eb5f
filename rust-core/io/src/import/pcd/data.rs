//! The points of a PCD file, in each way that they are written.

use super::header::{Header, Target};
use super::lzf::{self, Lzf};
use super::sink::Sink;
use crate::import::scan::FileScan;
use crate::import::text::Lines;
use crate::import::window::Window;
use base::error::{Error, Result};

/// Data that all ways of writing need.
pub(super) struct Points<'a> {
    pub header: &'a Header,
    /// Bytes of a point.
    pub stride: u64,
    /// Numbers of a point.
    pub numbers: u64,
    /// Points of the file.
    pub count: u64,
    /// Bytes that follow the header.
    pub left: u64,
    pub scan: &'a FileScan,
}

impl Points<'_> {
    /// A line of text a point.
    pub fn of_text(&self, mut lines: Lines<'_>) -> Result<Sink> {
        // A digit and a blank a number; the last needs none.
        if self.count.checked_mul(2 * self.numbers).is_none_or(|bytes| bytes > self.left + 1) {
            return Err(self.too_many(&lines));
        }
        let mut sink = self.sink()?;
        for point in 0..self.count as usize {
            if !lines.next_content()? {
                return Err(lines.ends(&format!("point {point} of {}", self.count)));
            }
            for field in &self.header.fields {
                for _ in 0..field.count {
                    sink.set(point, field.target, field.number(lines.f64("a number")?));
                }
            }
            if !lines.is_done() {
                return Err(lines.expected("the end of the line: a point has one"));
            }
        }
        Ok(sink)
    }

    /// One point after the other.
    pub fn of_bytes(&self, lines: Lines<'_>) -> Result<Sink> {
        if self.count.checked_mul(self.stride).is_none_or(|bytes| bytes > self.left) {
            return Err(self.too_many(&lines));
        }
        let mut bytes = Plain(lines.into_window());
        let mut sink = self.sink()?;
        let mut record = vec![0; self.stride as usize];
        let ended = (0..self.count as usize).find(|&point| {
            if bytes.take(&mut record).is_none() {
                return true;
            }
            let mut at = 0;
            for field in &self.header.fields {
                if field.target != Target::Nowhere {
                    sink.set(point, field.target, field.value(&record[at..]));
                }
                at += field.size * field.count;
            }
            false
        });
        self.finish(ended, bytes.0).map(|()| sink)
    }

    /// All values of a field after those of the one before, packed.
    pub fn of_packed(&self, lines: Lines<'_>) -> Result<Sink> {
        let mut window = lines.into_window();
        if !window.ensure(8) {
            return self.finish(Some(0), window).and(Err(self.fail("the file ends".to_owned())));
        }
        let packed = self.room_of_packed(&mut window)?;
        let mut bytes = Lzf::new(window, packed);
        let mut sink = self.sink()?;
        let ended = self.header.fields.iter().find_map(|field| {
            let mut value = [0; 8];
            (0..self.count as usize).find(|&point| {
                (0..field.count).any(|_| {
                    let is_end = bytes.take(&mut value[..field.size]).is_none();
                    if !is_end {
                        sink.set(point, field.target, field.value(&value));
                    }
                    is_end
                })
            })
        });
        self.finish(ended, bytes.window).map(|()| sink)
    }

    /// Number of packed bytes that follow, by the two sizes ahead of them. Refuses sizes that can't be.
    fn room_of_packed(&self, window: &mut Window<'_>) -> Result<u64> {
        let size = |at: usize| {
            let bytes = &window.rest()[at..at + 4];
            u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        };
        let (packed, unpacked) = (size(0), size(4));
        window.at += 8;
        if self.count.checked_mul(self.stride) != Some(unpacked) {
            let wanted = format!("{} points of {} bytes", self.count, self.stride);
            return Err(self.fail(format!("{wanted}, but it unpacks to {unpacked} bytes")));
        }
        if packed > window.left() || unpacked > packed * lzf::RATIO {
            let left = window.left();
            return Err(self.fail(format!("{packed} bytes, of the {left} that follow, can't unpack to {unpacked}")));
        }
        if unpacked > self.scan.options.max_decoded_bytes() {
            let limit = self.scan.options.max_decoded_gib;
            return Err(
                self.fail(format!("it unpacks to {unpacked} bytes, more than max_decoded_gib = {limit} GiB: raise it"))
            );
        }
        Ok(packed)
    }

    fn sink(&self) -> Result<Sink> {
        Sink::new(self.header, self.count as usize, &self.scan.path)
    }

    fn fail(&self, problem: String) -> Error {
        Error::format(&self.scan.path, "data", problem)
    }

    fn too_many(&self, lines: &Lines<'_>) -> Error {
        let Header { width, height, .. } = self.header;
        lines.fail(format!("{width} x {height} points don't fit the {} bytes that follow", self.left))
    }

    /// The error of reading that failed, or of data that ends or can't be unpacked at a point.
    fn finish(&self, ended: Option<usize>, mut window: Window<'_>) -> Result<()> {
        let path = &self.scan.path;
        if let Some(error) = window.failure() {
            return Err(Error::io(path, error));
        }
        let Some(point) = ended else { return Ok(()) };
        Err(Error::format(path, format!("point {point} of {}", self.count), "the data ends or is damaged"))
    }
}

/// Bytes as they lie in the file.
struct Plain<'a>(Window<'a>);

impl Plain<'_> {
    /// The next bytes. `None` if the file ends.
    #[inline(always)]
    fn take(&mut self, into: &mut [u8]) -> Option<()> {
        let mut done = 0;
        while done < into.len() {
            if !self.0.ensure(1) {
                return None;
            }
            let some = self.0.rest().len().min(into.len() - done);
            into[done..done + some].copy_from_slice(&self.0.rest()[..some]);
            self.0.at += some;
            done += some;
        }
        Some(())
    }
}
