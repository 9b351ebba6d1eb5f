//! Values out of the body of a PLY file, always within its bounds. Here from text, in `binary` from either binary encoding.

use super::columns::{Position, Row};
use super::fault::Fault;
use super::header::{Kind, Property, ScalarType};
use super::number::{self, is_blank};
use crate::import::window::{SMALLEST, Window};

/// The source of an element's values.
pub(super) trait Source {
    /// Whether this is text, where errors have lines.
    const TEXT: bool;
    /// Starts an entry of an element.
    fn begin(&mut self) -> Result<(), Fault>;
    /// The next number. Whole-number types are checked to hold one.
    fn number(&mut self, scalar: ScalarType) -> Result<f64, Fault>;
    /// The next whole number of a whole-number type.
    fn whole(&mut self, scalar: ScalarType) -> Result<i64, Fault>;
    /// Skips numbers.
    fn skip(&mut self, scalar: ScalarType, count: u64) -> Result<(), Fault>;
    /// Ends an entry.
    fn end(&mut self) -> Result<(), Fault>;
    /// The window that is being read.
    fn window(&self) -> &Window<'_>;
    /// Skips fillers after the last element. True if nothing else is left.
    fn at_end(&mut self) -> bool;

    /// The length of a list, checked against what the file can still hold.
    fn length(&mut self, length: ScalarType, item: ScalarType) -> Result<u64, Fault> {
        let count = self.whole(length)?;
        let count = u64::try_from(count).map_err(|_| Fault::Range(count, length))?;
        let smallest = if Self::TEXT { 1 } else { item.size() as u64 };
        if count > self.window().left() / smallest { Err(Fault::End) } else { Ok(count) }
    }

    /// Adds positions while the entries are three floats written in the commonest way. Stops before the first that isn't, or at `count`.
    fn plain_positions<P: Position>(&mut self, count: usize, positions: &mut Vec<P>);

    /// Adds cells of a range grid while they are lists, written in the commonest way, of no vertex or one below `vertex_count`. Stops
    /// before the first that isn't, or at `count`.
    fn plain_cells<G: Grid>(&mut self, types: [ScalarType; 2], vertex_count: u64, count: usize, grid: &mut G);

    /// Reads up to `count` entries of a fixed size, and hands each to `each` as far as it can here.
    fn rows(&mut self, layout: &Layout, count: usize, row: &mut Row, each: impl FnMut(&Row));

    /// Adds triangles while faces are lists, written in the commonest way, of three vertices below `vertex_count`. Stops before the first
    /// that isn't, or at `count`. Other values of the faces, laid out for three vertices, go to `each`.
    fn plain_triangles(
        &mut self,
        layout: &Layout,
        vertex_count: u64,
        count: usize,
        triangles: &mut Vec<[u32; 3]>,
        row: &mut Row,
        each: impl FnMut(&Row),
    );

    /// Skips a property, list or not.
    fn skip_property(&mut self, property: &Property) -> Result<(), Fault> {
        match property.kind {
            Kind::Scalar(scalar) => self.skip(scalar, 1),
            Kind::List { length, item } => {
                let count = self.length(length, item)?;
                self.skip(item, count)
            }
        }
    }
}

/// Places of the values of a binary entry if all entries have the same size.
pub(super) struct Layout {
    pub(super) size: usize,
    pub(super) properties: usize,
    /// Place of the list of a face, types of its length and its items.
    pub(super) list: usize,
    pub(super) list_types: [ScalarType; 2],
    /// Wanted values: place in the entry, type, slot of the row.
    pub(super) wanted: Vec<(usize, ScalarType, usize)>,
}

/// A cell of a range grid without a sample.
pub(super) const NO_VERTEX: u32 = u32::MAX;

/// Targets of the cells of a range grid: their vertices, or the points of their vertices.
pub(super) trait Grid {
    fn len(&self) -> usize;
    /// The next cell has this vertex, which exists, or none.
    fn add(&mut self, vertex: u32);
    /// The next `count` cells have none.
    fn add_empty(&mut self, count: usize);
}

impl Grid for Vec<u32> {
    fn len(&self) -> usize {
        self.len()
    }

    #[inline(always)]
    fn add(&mut self, vertex: u32) {
        self.push(vertex);
    }

    #[inline(always)]
    fn add_empty(&mut self, count: usize) {
        self.resize(self.len() + count, NO_VERTEX);
    }
}

/// Empty cells looked for at once, in text.
const RUN: usize = 8;

/// Longest number in text. A longer one is not taken for a number.
const LONGEST: usize = 512;
const _: () = assert!(LONGEST < SMALLEST);

/// Text: numbers between blanks, one line an element, empty lines ignored.
pub(super) struct Ascii<'w, 'r> {
    pub(super) window: &'w mut Window<'r>,
}

impl Ascii<'_, '_> {
    /// Goes to the next value on this line.
    #[inline(always)]
    fn value(&mut self) -> Result<usize, Fault> {
        loop {
            // After most numbers comes one blank; past the end of the window come line ends.
            let byte = self.window.padded()[self.window.at];
            if !is_blank(byte) {
                self.window.ensure(LONGEST + 1);
                return Ok(self.window.at);
            }
            if byte == b'\n' || byte == b'\r' {
                if self.window.at < self.window.end() {
                    return Err(Fault::LineEnd(self.window.at));
                }
                if !self.window.ensure(1) {
                    return Err(Fault::End);
                }
                continue;
            }
            self.window.at += 1;
        }
    }

    /// Ends the value that starts at `start`.
    #[inline(always)]
    fn finish<T>(&mut self, start: usize, read: Option<(T, usize)>, fault: fn(usize) -> Fault) -> Result<T, Fault> {
        match read {
            // Judged by its length alone: not by where the window happens to end.
            Some((value, end)) if end - start <= LONGEST => {
                self.window.at = end;
                Ok(value)
            }
            _ => Err(fault(start)),
        }
    }

    /// A number of type float, rounded to that type.
    #[inline(always)]
    fn float(&mut self) -> Result<f32, Fault> {
        let start = self.value()?;
        let text = self.window.padded();
        if let Some((value, end)) = number::read_plain_f32(text, start)
            && is_blank(text[end])
        {
            self.window.at = end;
            return Ok(value);
        }
        let read = number::read_f32(text, start);
        self.finish(start, read, Fault::NoNumber)
    }

    /// Reads line after line with `line`, which gets the window's text and the start of a line, and returns the start of the next. Stops
    /// where it returns none.
    #[inline(always)]
    fn plain_lines(&mut self, mut line: impl FnMut(&[u8], usize) -> Option<usize>) {
        // A line longer than this is none of the commonest.
        const MARGIN: usize = 256;
        while self.begin().is_ok() {
            let end = self.window.end();
            let safe = if self.window.is_last() { end } else { end.saturating_sub(MARGIN) };
            let text = self.window.padded();
            let mut at = self.window.at;
            let mut stopped = false;
            while at < safe && !stopped {
                match line(text, at) {
                    Some(next) => at = next,
                    None => stopped = true,
                }
            }
            self.window.at = at.min(end);
            if stopped {
                return;
            }
        }
    }
}

/// The start of the next line if this one ends at `at`, with or without a blank before its end.
#[inline(always)]
fn next_line(text: &[u8], at: usize) -> Option<usize> {
    let at = at + usize::from(*text.get(at)? == b' ');
    (*text.get(at)? == b'\n').then_some(at + 1)
}

#[inline(always)]
fn past_blank(text: &[u8], at: usize) -> Option<usize> {
    (*text.get(at)? == b' ').then_some(at + 1)
}

/// Three floats of the commonest shape on a line, and the start of the next.
#[inline(always)]
fn plain_position(text: &[u8], at: usize) -> Option<([f32; 3], usize)> {
    let (x, end) = number::read_plain_f32(text, at)?;
    let (y, end) = number::read_plain_f32(text, past_blank(text, end)?)?;
    let (z, end) = number::read_plain_f32(text, past_blank(text, end)?)?;
    Some(([x, y, z], next_line(text, end)?))
}

/// A list of three vertices on a line, and the start of the next.
#[inline(always)]
fn plain_triangle(text: &[u8], at: usize) -> Option<([u64; 3], usize)> {
    let at = past_blank(text, at + usize::from(*text.get(at)? == b'3'))?;
    let (a, end) = number::read_plain_index(text, at)?;
    let (b, end) = number::read_plain_index(text, past_blank(text, end)?)?;
    let (c, end) = number::read_plain_index(text, past_blank(text, end)?)?;
    Some(([a, b, c], next_line(text, end)?))
}

impl Source for Ascii<'_, '_> {
    const TEXT: bool = true;

    #[inline(always)]
    fn begin(&mut self) -> Result<(), Fault> {
        loop {
            while self.window.at < self.window.end() {
                if !is_blank(self.window.padded()[self.window.at]) {
                    self.window.ensure(LONGEST + 1);
                    return Ok(());
                }
                self.window.at += 1;
            }
            if !self.window.ensure(1) {
                return Err(Fault::End);
            }
        }
    }

    #[inline(always)]
    fn number(&mut self, scalar: ScalarType) -> Result<f64, Fault> {
        match scalar {
            ScalarType::F32 => Ok(self.float()?.into()),
            ScalarType::F64 => {
                let start = self.value()?;
                let read = number::read_f64(self.window.padded(), start);
                self.finish(start, read, Fault::NoNumber)
            }
            _ => Ok(self.whole(scalar)? as f64),
        }
    }

    #[inline(always)]
    fn whole(&mut self, scalar: ScalarType) -> Result<i64, Fault> {
        let start = self.value()?;
        let read = number::read_integer(self.window.padded(), start);
        let value = self.finish(start, read, Fault::NoWhole)?;
        match scalar.whole_range() {
            Some((low, high)) if (low..=high).contains(&value) => Ok(value),
            _ => Err(Fault::Range(value, scalar)),
        }
    }

    fn plain_positions<P: Position>(&mut self, count: usize, positions: &mut Vec<P>) {
        self.plain_lines(|text, at| {
            if positions.len() == count {
                return None;
            }
            let (position, next) = plain_position(text, at)?;
            positions.push(P::from_single(position));
            Some(next)
        });
    }

    fn plain_cells<G: Grid>(&mut self, _: [ScalarType; 2], vertex_count: u64, count: usize, grid: &mut G) {
        const EMPTY: &[u8; 3 * RUN] = b"0 \n0 \n0 \n0 \n0 \n0 \n0 \n0 \n";
        self.plain_lines(|text, at| {
            if grid.len() == count {
                return None;
            }
            match text.get(at..)? {
                [b'1', b' ', ..] => {
                    let (vertex, end) = number::read_plain_index(text, at + 2)?;
                    let next = next_line(text, end)?;
                    if vertex >= vertex_count {
                        return None;
                    }
                    grid.add(vertex as u32);
                    Some(next)
                }
                rest @ [b'0', ..] => {
                    let most = (count - grid.len()) / RUN;
                    let runs = rest.as_chunks().0.iter().take(most).take_while(|run| *run == EMPTY).count();
                    if runs > 0 {
                        grid.add_empty(runs * RUN);
                        return Some(at + runs * EMPTY.len());
                    }
                    let next = next_line(text, at + 1)?;
                    grid.add(NO_VERTEX);
                    Some(next)
                }
                _ => None,
            }
        });
    }

    fn rows(&mut self, _: &Layout, _: usize, _: &mut Row, _: impl FnMut(&Row)) {}

    fn plain_triangles(
        &mut self,
        layout: &Layout,
        vertex_count: u64,
        count: usize,
        triangles: &mut Vec<[u32; 3]>,
        _: &mut Row,
        _: impl FnMut(&Row),
    ) {
        if layout.properties != 1 {
            return;
        }
        self.plain_lines(|text, at| {
            if triangles.len() == count {
                return None;
            }
            let (triangle, next) = plain_triangle(text, at)?;
            if triangle.iter().any(|&vertex| vertex >= vertex_count) {
                return None;
            }
            triangles.push(triangle.map(|vertex| vertex as u32));
            Some(next)
        });
    }

    fn skip(&mut self, _: ScalarType, count: u64) -> Result<(), Fault> {
        for _ in 0..count {
            let start = self.value()?;
            let end = number::token_end(self.window.padded(), start);
            self.finish(start, Some(((), end.min(self.window.end()))), Fault::NoNumber)?;
        }
        Ok(())
    }

    #[inline(always)]
    fn end(&mut self) -> Result<(), Fault> {
        match self.value() {
            Ok(start) => Err(Fault::LineGoesOn(start)),
            Err(_) => Ok(()),
        }
    }

    fn window(&self) -> &Window<'_> {
        self.window
    }

    fn at_end(&mut self) -> bool {
        self.begin().is_err()
    }
}
