//! Values out of the body of a PLY file, from text or from either binary encoding, always within its bounds.

use super::body::Position;
use super::fault::{Fault, line_number};
use super::header::{Kind, Property, ScalarType};
use super::number::{self, is_blank};

/// Where an element's values come from.
pub(super) trait Source {
    /// Starts an entry of an element.
    fn begin(&mut self) -> Result<(), Fault>;
    /// The next number; whole-number types are checked to hold one.
    fn number(&mut self, scalar: ScalarType) -> Result<f64, Fault>;
    /// The next whole number of a whole-number type.
    fn whole(&mut self, scalar: ScalarType) -> Result<i64, Fault>;
    /// Skips numbers.
    fn skip(&mut self, scalar: ScalarType, count: u64) -> Result<(), Fault>;
    /// Ends an entry.
    fn end(&mut self) -> Result<(), Fault>;
    /// Bytes left.
    fn left(&self) -> usize;
    /// The file, if it is text.
    fn text(&self) -> Option<&[u8]>;
    /// The number of the line now being read, if the file is text.
    fn line(&self) -> Option<usize>;
    /// Skips fillers after the last element; true if nothing else is left.
    fn at_end(&mut self) -> bool;

    /// The length of a list, checked against what the file can still hold.
    fn length(&mut self, length: ScalarType, item: ScalarType) -> Result<u64, Fault> {
        let count = self.whole(length)?;
        let count = u64::try_from(count).map_err(|_| Fault::Range(count, length))?;
        let smallest = if self.text().is_some() { 1 } else { item.size() as u64 };
        if count > self.left() as u64 / smallest { Err(Fault::End) } else { Ok(count) }
    }

    /// Adds positions while the entries are three floats written in the commonest way; stops before the first that
    /// isn't, or at `count`.
    fn plain_positions<P: Position>(&mut self, count: usize, positions: &mut Vec<P>);

    /// Adds cells of a range grid while they are lists, written in the commonest way, of no vertex or one below
    /// `vertex_count`; stops before the first that isn't, or at `count`.
    fn plain_cells<G: Grid>(&mut self, types: [ScalarType; 2], vertex_count: u64, count: usize, grid: &mut G);

    /// Adds triangles while faces are lists, written in the commonest way, of three vertices below `vertex_count`; stops
    /// before the first that isn't, or at `count`.
    fn plain_triangles(
        &mut self,
        types: [ScalarType; 2],
        vertex_count: u64,
        count: usize,
        triangles: &mut Vec<[u32; 3]>,
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

/// A cell of a range grid without a sample.
pub(super) const NO_VERTEX: u32 = u32::MAX;

/// What the cells of a range grid are put into: their vertices, or the points of their vertices.
pub(super) trait Grid {
    fn len(&self) -> usize;
    /// The next cell has this vertex, which exists, or none.
    fn add(&mut self, vertex: u32);
    /// The next `N` cells have none.
    fn add_empty<const N: usize>(&mut self);
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
    fn add_empty<const N: usize>(&mut self) {
        self.extend_from_slice(&[NO_VERTEX; N]);
    }
}

/// Empty cells looked for at once, in text.
const RUN: usize = 8;

/// Text: numbers between blanks, one line an element, empty lines ignored.
pub(super) struct Ascii<'a> {
    /// The file and [`number::PAD`] line ends after it.
    pub(super) text: &'a [u8],
    /// Length without the padding.
    pub(super) length: usize,
    pub(super) at: usize,
}

impl Ascii<'_> {
    /// Goes to the next value on this line.
    #[inline(always)]
    pub(super) fn value(&mut self) -> Result<usize, Fault> {
        // After most numbers comes one blank.
        while let Some(&byte) = self.text.get(self.at) {
            if !is_blank(byte) {
                return Ok(self.at);
            }
            if byte == b'\n' || byte == b'\r' {
                break;
            }
            self.at += 1;
        }
        Err(if self.at >= self.length { Fault::End } else { Fault::LineEnd(self.at) })
    }

    /// The start of the next line if this one ends at `at`, with or without a blank before its end.
    #[inline(always)]
    fn next_line(&self, at: usize) -> Option<usize> {
        let at = at + usize::from(*self.text.get(at)? == b' ');
        (*self.text.get(at)? == b'\n').then_some(at + 1)
    }

    /// Three floats of the commonest shape on a line, and the start of the next.
    #[inline(always)]
    fn plain_position(&self, at: usize) -> Option<([f32; 3], usize)> {
        let (x, end) = number::read_plain_f32(self.text, at)?;
        let (y, end) = number::read_plain_f32(self.text, self.past_blank(end)?)?;
        let (z, end) = number::read_plain_f32(self.text, self.past_blank(end)?)?;
        Some(([x, y, z], self.next_line(end)?))
    }

    #[inline(always)]
    fn past_blank(&self, at: usize) -> Option<usize> {
        (*self.text.get(at)? == b' ').then_some(at + 1)
    }

    /// A list of three vertices on a line, and the start of the next.
    #[inline(always)]
    fn plain_triangle(&self, at: usize) -> Option<([u64; 3], usize)> {
        let at = self.past_blank(at + usize::from(*self.text.get(at)? == b'3'))?;
        let (a, end) = number::read_plain_index(self.text, at)?;
        let (b, end) = number::read_plain_index(self.text, self.past_blank(end)?)?;
        let (c, end) = number::read_plain_index(self.text, self.past_blank(end)?)?;
        Some(([a, b, c], self.next_line(end)?))
    }

    /// A number of type float, rounded to that type.
    #[inline(always)]
    pub(super) fn float(&mut self) -> Result<f32, Fault> {
        let start = self.value()?;
        if let Some((value, end)) = number::read_plain_f32(self.text, start)
            && self.text.get(end).is_some_and(|&b| is_blank(b))
        {
            self.at = end;
            return Ok(value);
        }
        let (value, end) = number::read_f32(self.text, start).ok_or(Fault::NoNumber(start))?;
        self.at = end;
        Ok(value)
    }
}

impl Source for Ascii<'_> {
    #[inline(always)]
    fn begin(&mut self) -> Result<(), Fault> {
        while let Some(&byte) = self.text.get(self.at) {
            if !is_blank(byte) {
                return Ok(());
            }
            self.at += 1;
        }
        Err(Fault::End)
    }

    #[inline(always)]
    fn number(&mut self, scalar: ScalarType) -> Result<f64, Fault> {
        match scalar {
            ScalarType::F32 => Ok(self.float()?.into()),
            ScalarType::F64 => {
                let start = self.value()?;
                let (value, end) = number::read_f64(self.text, start).ok_or(Fault::NoNumber(start))?;
                self.at = end;
                Ok(value)
            }
            _ => Ok(self.whole(scalar)? as f64),
        }
    }

    #[inline(always)]
    fn whole(&mut self, scalar: ScalarType) -> Result<i64, Fault> {
        let start = self.value()?;
        let (value, end) = number::read_integer(self.text, start).ok_or(Fault::NoWhole(start))?;
        self.at = end;
        match scalar.whole_range() {
            Some((low, high)) if (low..=high).contains(&value) => Ok(value),
            _ => Err(Fault::Range(value, scalar)),
        }
    }

    #[inline]
    fn plain_positions<P: Position>(&mut self, count: usize, positions: &mut Vec<P>) {
        // To the start of a line; that there is none is for others to say.
        let _ = self.begin();
        while positions.len() < count {
            let Some((position, next)) = self.plain_position(self.at) else { return };
            positions.push(P::from_single(position));
            self.at = next;
        }
    }

    fn plain_cells<G: Grid>(&mut self, _: [ScalarType; 2], vertex_count: u64, count: usize, grid: &mut G) {
        const EMPTY: &[u8; 3 * RUN] = b"0 \n0 \n0 \n0 \n0 \n0 \n0 \n0 \n";
        let _ = self.begin();
        while grid.len() < count {
            let Some(rest) = self.text.get(self.at..) else { return };
            if rest.first_chunk() == Some(EMPTY) && count - grid.len() >= RUN {
                grid.add_empty::<RUN>();
                self.at += EMPTY.len();
                continue;
            }
            let (cell, end) = match rest {
                [b'0', ..] => (NO_VERTEX, self.at + 1),
                [b'1', b' ', ..] => match number::read_plain_index(self.text, self.at + 2) {
                    Some((vertex, end)) if vertex < vertex_count => (vertex as u32, end),
                    _ => return,
                },
                _ => return,
            };
            let Some(next) = self.next_line(end) else { return };
            grid.add(cell);
            self.at = next;
        }
    }

    fn plain_triangles(&mut self, _: [ScalarType; 2], vertex_count: u64, count: usize, triangles: &mut Vec<[u32; 3]>) {
        let _ = self.begin();
        while triangles.len() < count {
            let Some((triangle, next)) = self.plain_triangle(self.at) else { return };
            if triangle.iter().any(|&vertex| vertex >= vertex_count) {
                return;
            }
            triangles.push(triangle.map(|vertex| vertex as u32));
            self.at = next;
        }
    }

    fn skip(&mut self, _: ScalarType, count: u64) -> Result<(), Fault> {
        for _ in 0..count {
            let start = self.value()?;
            self.at = number::token_end(self.text, start);
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

    fn left(&self) -> usize {
        self.length.saturating_sub(self.at)
    }

    fn text(&self) -> Option<&[u8]> {
        Some(&self.text[..self.length])
    }

    fn line(&self) -> Option<usize> {
        Some(line_number(self.text, self.at))
    }

    fn at_end(&mut self) -> bool {
        self.begin().is_err()
    }
}

/// Binary, most significant byte first if `BIG`.
pub(super) struct Binary<'a, const BIG: bool> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    #[inline(always)]
    pub(super) fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let bytes = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk::<N>()).ok_or(Fault::End)?;
        self.at += N;
        Ok(*bytes)
    }

    /// The next `count` bytes.
    pub(super) fn slice(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let end = self.at.checked_add(count).ok_or(Fault::End)?;
        let bytes = self.bytes.get(self.at..end).ok_or(Fault::End)?;
        self.at = end;
        Ok(bytes)
    }
}

/// A number of a fixed size out of its bytes.
macro_rules! decode {
    ($source:expr, $kind:ty) => {{
        let bytes = $source.take::<{ size_of::<$kind>() }>()?;
        if BIG { <$kind>::from_be_bytes(bytes) } else { <$kind>::from_le_bytes(bytes) }
    }};
}

impl<const BIG: bool> Source for Binary<'_, BIG> {
    #[inline(always)]
    fn begin(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    #[inline(always)]
    fn number(&mut self, scalar: ScalarType) -> Result<f64, Fault> {
        Ok(match scalar {
            ScalarType::I8 => decode!(self, i8).into(),
            ScalarType::U8 => decode!(self, u8).into(),
            ScalarType::I16 => decode!(self, i16).into(),
            ScalarType::U16 => decode!(self, u16).into(),
            ScalarType::I32 => decode!(self, i32).into(),
            ScalarType::U32 => decode!(self, u32).into(),
            ScalarType::F32 => decode!(self, f32).into(),
            ScalarType::F64 => decode!(self, f64),
        })
    }

    #[inline(always)]
    fn whole(&mut self, scalar: ScalarType) -> Result<i64, Fault> {
        // Exact: f64 holds every 32-bit whole number. Float types never get here, but would be cut.
        Ok(self.number(scalar)? as i64)
    }

    fn plain_positions<P: Position>(&mut self, count: usize, positions: &mut Vec<P>) {
        let Some(rest) = self.bytes.get(self.at..) else { return };
        let (entries, _) = rest.as_chunks::<12>();
        let entries = &entries[..entries.len().min(count - positions.len())];
        positions.extend(entries.iter().map(|[a, b, c, d, e, f, g, h, i, j, k, l]| {
            let float = |bytes| if BIG { f32::from_be_bytes(bytes) } else { f32::from_le_bytes(bytes) };
            P::from_single([float([*a, *b, *c, *d]), float([*e, *f, *g, *h]), float([*i, *j, *k, *l])])
        }));
        self.at += entries.len() * 12;
    }

    fn plain_cells<G: Grid>(&mut self, types: [ScalarType; 2], vertex_count: u64, count: usize, grid: &mut G) {
        if types[0].size() != 1 || types[1].size() != 4 {
            return;
        }
        while grid.len() < count {
            match self.bytes.get(self.at..) {
                Some([0, ..]) => {
                    grid.add(NO_VERTEX);
                    self.at += 1;
                }
                Some([1, a, b, c, d, ..]) => {
                    let bytes = [*a, *b, *c, *d];
                    let vertex = if BIG { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
                    // A negative int is larger than any number of vertices, too.
                    if u64::from(vertex) >= vertex_count {
                        return;
                    }
                    grid.add(vertex);
                    self.at += 5;
                }
                _ => return,
            }
        }
    }

    fn plain_triangles(
        &mut self,
        types: [ScalarType; 2],
        vertex_count: u64,
        count: usize,
        triangles: &mut Vec<[u32; 3]>,
    ) {
        if types[0].size() != 1 || types[1].size() != 4 {
            return;
        }
        let Some(rest) = self.bytes.get(self.at..) else { return };
        for [length, a, b, c, d, e, f, g, h, i, j, k, l] in
            rest.as_chunks::<13>().0.iter().take(count - triangles.len())
        {
            let vertex = |bytes| if BIG { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
            let triangle = [vertex([*a, *b, *c, *d]), vertex([*e, *f, *g, *h]), vertex([*i, *j, *k, *l])];
            if *length != 3 || triangle.iter().any(|&vertex| u64::from(vertex) >= vertex_count) {
                return;
            }
            triangles.push(triangle);
            self.at += 13;
        }
    }

    fn skip(&mut self, scalar: ScalarType, count: u64) -> Result<(), Fault> {
        let bytes = usize::try_from(count).ok().and_then(|n| n.checked_mul(scalar.size())).ok_or(Fault::End)?;
        self.slice(bytes).map(|_| ())
    }

    #[inline(always)]
    fn end(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn text(&self) -> Option<&[u8]> {
        None
    }

    fn line(&self) -> Option<usize> {
        None
    }

    fn at_end(&mut self) -> bool {
        // Some writers end binary files with a line end or zeros.
        self.bytes[self.at..].iter().all(|&b| is_blank(b) || b == 0x1A)
    }
}
