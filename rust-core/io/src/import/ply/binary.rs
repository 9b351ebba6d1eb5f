//! Values out of a binary body.

use super::columns::{Position, Row};
use super::fault::Fault;
use super::header::ScalarType;
use super::number::is_blank;
use super::source::{Grid, Layout, NO_VERTEX, Source};
use crate::import::window::{SMALLEST, Window};

/// Binary, most significant byte first if `BIG`.
pub(super) struct Binary<'w, 'r, const BIG: bool> {
    pub(super) window: &'w mut Window<'r>,
}

impl<const BIG: bool> Binary<'_, '_, BIG> {
    #[inline(always)]
    fn u32(bytes: [u8; 4]) -> u32 {
        if BIG { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) }
    }

    /// The wanted values of an entry.
    #[inline(always)]
    fn fill(entry: &[u8], layout: &Layout, row: &mut Row) {
        for &(at, scalar, slot) in &layout.wanted {
            row[slot] = value::<BIG>(&entry[at..], scalar);
        }
    }
}

/// The number that bytes start with. 0 if they are too few.
#[inline(always)]
fn value<const BIG: bool>(bytes: &[u8], scalar: ScalarType) -> f64 {
    macro_rules! decode {
        ($kind:ty) => {{
            let bytes = bytes.first_chunk().copied().unwrap_or_default();
            if BIG { <$kind>::from_be_bytes(bytes) } else { <$kind>::from_le_bytes(bytes) }
        }};
    }
    match scalar {
        ScalarType::I8 => decode!(i8).into(),
        ScalarType::U8 => decode!(u8).into(),
        ScalarType::I16 => decode!(i16).into(),
        ScalarType::U16 => decode!(u16).into(),
        ScalarType::I32 => decode!(i32).into(),
        ScalarType::U32 => decode!(u32).into(),
        ScalarType::F32 => decode!(f32).into(),
        ScalarType::F64 => decode!(f64),
    }
}

impl<const BIG: bool> Source for Binary<'_, '_, BIG> {
    const TEXT: bool = false;

    #[inline(always)]
    fn begin(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    #[inline(always)]
    fn number(&mut self, scalar: ScalarType) -> Result<f64, Fault> {
        let size = scalar.size();
        self.window.ensure(size);
        let bytes = self.window.rest().get(..size).ok_or(Fault::End)?;
        let value = value::<BIG>(bytes, scalar);
        self.window.at += size;
        Ok(value)
    }

    #[inline(always)]
    fn whole(&mut self, scalar: ScalarType) -> Result<i64, Fault> {
        // Exact: f64 holds every 32-bit whole number. Float types never get here, but would be cut.
        Ok(self.number(scalar)? as i64)
    }

    fn plain_positions<P: Position>(&mut self, count: usize, positions: &mut Vec<P>) {
        while positions.len() < count && self.window.ensure(12) {
            let (entries, _) = self.window.rest().as_chunks::<12>();
            let entries = &entries[..entries.len().min(count - positions.len())];
            positions.extend(entries.iter().map(|[a, b, c, d, e, f, g, h, i, j, k, l]| {
                let float = |bytes| f32::from_bits(Self::u32(bytes));
                P::from_single([float([*a, *b, *c, *d]), float([*e, *f, *g, *h]), float([*i, *j, *k, *l])])
            }));
            let used = entries.len() * 12;
            self.window.at += used;
        }
    }

    fn plain_cells<G: Grid>(&mut self, types: [ScalarType; 2], vertex_count: u64, count: usize, grid: &mut G) {
        if types[0].size() != 1 || types[1].size() != 4 {
            return;
        }
        while grid.len() < count {
            self.window.ensure(5);
            let mut rest = self.window.rest();
            let before = rest.len();
            while grid.len() < count {
                match rest {
                    [0, after @ ..] => {
                        grid.add(NO_VERTEX);
                        rest = after;
                    }
                    [1, a, b, c, d, after @ ..] => {
                        let vertex = Self::u32([*a, *b, *c, *d]);
                        // A negative int is larger than any number of vertices, too.
                        if u64::from(vertex) >= vertex_count {
                            break;
                        }
                        grid.add(vertex);
                        rest = after;
                    }
                    _ => break,
                }
            }
            let used = before - rest.len();
            self.window.at += used;
            if used == 0 {
                return;
            }
        }
    }

    fn rows(&mut self, layout: &Layout, count: usize, row: &mut Row, mut each: impl FnMut(&Row)) {
        if layout.size == 0 || layout.size > SMALLEST {
            return;
        }
        let mut left = count;
        while left > 0 && self.window.ensure(layout.size) {
            let entries = self.window.rest().chunks_exact(layout.size).take(left);
            let read = entries.len();
            for entry in entries {
                Self::fill(entry, layout, row);
                each(row);
            }
            self.window.at += read * layout.size;
            left -= read;
        }
    }

    fn plain_triangles(
        &mut self,
        layout: &Layout,
        vertex_count: u64,
        count: usize,
        triangles: &mut Vec<[u32; 3]>,
        row: &mut Row,
        mut each: impl FnMut(&Row),
    ) {
        if layout.list_types.map(ScalarType::size) != [1, 4] || layout.size > SMALLEST {
            return;
        }
        while triangles.len() < count && self.window.ensure(layout.size) {
            let before = triangles.len();
            for entry in self.window.rest().chunks_exact(layout.size).take(count - before) {
                let Some([3, a, b, c, d, e, f, g, h, i, j, k, l]) = entry[layout.list..].first_chunk() else { break };
                let triangle = [Self::u32([*a, *b, *c, *d]), Self::u32([*e, *f, *g, *h]), Self::u32([*i, *j, *k, *l])];
                if triangle.iter().any(|&vertex| u64::from(vertex) >= vertex_count) {
                    break;
                }
                triangles.push(triangle);
                Self::fill(entry, layout, row);
                each(row);
            }
            let read = triangles.len() - before;
            self.window.at += read * layout.size;
            if read == 0 {
                return;
            }
        }
    }

    fn skip(&mut self, scalar: ScalarType, count: u64) -> Result<(), Fault> {
        let mut bytes = count.checked_mul(scalar.size() as u64).ok_or(Fault::End)?;
        while bytes > 0 {
            if !self.window.ensure(1) {
                return Err(Fault::End);
            }
            let here = bytes.min(self.window.rest().len() as u64);
            self.window.at += here as usize;
            bytes -= here;
        }
        Ok(())
    }

    #[inline(always)]
    fn end(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn window(&self) -> &Window<'_> {
        self.window
    }

    fn at_end(&mut self) -> bool {
        // Some writers end binary files with a line end or zeros.
        while self.window.ensure(1) {
            let fillers = self.window.rest().iter().take_while(|&&b| is_blank(b) || b == 0x1A).count();
            if fillers == 0 {
                return false;
            }
            self.window.at += fillers;
        }
        true
    }
}
