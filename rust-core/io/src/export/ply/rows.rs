//! The rows of a PLY element: columns in, bytes out, in chunks that are encoded in parallel and written in order.

use std::io::Write;
use std::ops::Range;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::super::atomic::Output;
use super::options::PlyEncoding;
use base::error::{Error, Result};
use base::progress::Progress;

/// Bytes of one chunk, about.
pub(super) const CHUNK: usize = 1 << 18;

/// A cell of a range grid without a vertex.
pub(super) const NO_VERTEX: u32 = u32::MAX;

/// Data that a column writes in each row.
pub(super) enum Data<'a> {
    /// Three floats.
    Single(&'a [DVec3]),
    /// Three doubles.
    Double(&'a [DVec3]),
    /// Three floats that already are.
    Floats(&'a [[f32; 3]]),
    /// Two floats.
    Pairs(&'a [[f32; 2]]),
    F32(&'a [f32]),
    I32(&'a [i32]),
    Bool(&'a [bool]),
    Colour(&'a [[u8; 4]]),
    /// A list of three vertices.
    Triangle(&'a [[u32; 3]]),
    /// A list of four.
    Quad(&'a [[u32; 4]]),
    /// A list of one vertex or none. The only column of its element.
    Cell(&'a [u32]),
}

/// A column with the lines that declare it.
pub(super) struct Column<'a> {
    pub(super) declaration: String,
    pub(super) data: Data<'a>,
}

/// An element: a row a entry.
pub(super) struct Element<'a> {
    pub(super) name: &'static str,
    pub(super) count: usize,
    pub(super) columns: Vec<Column<'a>>,
    /// Whether lines of text end with a blank, as those of Stanford's range grids do.
    pub(super) blank_at_end: bool,
}

impl Data<'_> {
    /// Bytes in a binary row. Of cells the most.
    fn size(&self) -> usize {
        match self {
            Data::Single(_) | Data::Floats(_) => 12,
            Data::Double(_) => 24,
            Data::Pairs(_) => 8,
            Data::F32(_) | Data::I32(_) | Data::Colour(_) => 4,
            Data::Bool(_) => 1,
            Data::Triangle(_) => 13,
            Data::Quad(_) => 17,
            Data::Cell(_) => 5,
        }
    }
}

impl Element<'_> {
    /// Bytes of a binary row. Of cells the most.
    pub(super) fn row_size(&self) -> usize {
        self.columns.iter().map(|c| c.data.size()).sum()
    }

    /// Declares the element in the header.
    pub(super) fn declare(&self, header: &mut String) {
        *header += &format!("element {} {}\n", self.name, self.count);
        for column in &self.columns {
            *header += &column.declaration;
        }
    }

    /// Writes all rows. Within one of our pools the chunks are encoded in parallel.
    pub(super) fn write(
        &self,
        file: &mut Output<'_>,
        path: &Path,
        encoding: PlyEncoding,
        progress: &Progress<'_>,
    ) -> Result<()> {
        let rows = (CHUNK / self.row_size().max(1)).max(1);
        // Outside a pool the calling thread does it alone: the global pool is not ours.
        let threads = if rayon::current_thread_index().is_some() { rayon::current_num_threads().max(1) } else { 1 };
        let mut buffers = vec![Vec::new(); threads.min(self.count.div_ceil(rows))];
        let mut first = 0;
        while first < self.count {
            let encode = |(i, buffer): (usize, &mut Vec<u8>)| {
                buffer.clear();
                let start = (first + i * rows).min(self.count);
                self.encode(start..(start + rows).min(self.count), encoding, buffer);
            };
            if threads == 1 {
                buffers.iter_mut().enumerate().for_each(encode);
            } else {
                buffers.par_iter_mut().enumerate().for_each(encode);
            }
            progress.advance((rows * buffers.len()).min(self.count - first) as u64)?;
            for buffer in &buffers {
                progress.check()?;
                file.write_all(buffer).map_err(|e| Error::io(path, e))?;
            }
            first += rows * buffers.len();
        }
        Ok(())
    }

    /// Appends rows to `out`, which holds none.
    pub(super) fn encode(&self, rows: Range<usize>, encoding: PlyEncoding, out: &mut Vec<u8>) {
        match encoding {
            PlyEncoding::Ascii => self.text(rows, out),
            PlyEncoding::BinaryLittleEndian => self.binary::<false>(rows, out),
            PlyEncoding::BinaryBigEndian => self.binary::<true>(rows, out),
        }
    }

    /// Column by column into rows of fixed size: each column is one tight loop.
    fn binary<const BIG: bool>(&self, rows: Range<usize>, out: &mut Vec<u8>) {
        if let [Column { data: Data::Cell(cells), .. }] = &self.columns[..] {
            for &cell in &cells[rows] {
                if cell == NO_VERTEX {
                    out.push(0);
                } else {
                    let [a, b, c, d] = if BIG { cell.to_be_bytes() } else { cell.to_le_bytes() };
                    out.extend_from_slice(&[1, a, b, c, d]);
                }
            }
            return;
        }
        let size = self.row_size();
        out.resize(rows.len() * size, 0);
        let mut at = 0;
        for column in &self.columns {
            match &column.data {
                Data::Single(v) => scatter(out, size, at, &v[rows.clone()], |v| floats::<BIG>(v.as_vec3().to_array())),
                Data::Floats(v) => scatter(out, size, at, &v[rows.clone()], |v| floats::<BIG>(*v)),
                Data::Double(v) => scatter(out, size, at, &v[rows.clone()], |v| doubles::<BIG>(v.to_array())),
                Data::F32(v) => scatter(out, size, at, &v[rows.clone()], |v| word::<BIG>(v.to_bits())),
                Data::I32(v) => scatter(out, size, at, &v[rows.clone()], |v| word::<BIG>(*v as u32)),
                Data::Bool(v) => scatter(out, size, at, &v[rows.clone()], |v| [u8::from(*v)]),
                Data::Colour(v) => scatter(out, size, at, &v[rows.clone()], |v| *v),
                Data::Triangle(v) => scatter(out, size, at, &v[rows.clone()], |v| {
                    let ([a, b, c, d], [e, f, g, h], [i, j, k, l]) =
                        (word::<BIG>(v[0]), word::<BIG>(v[1]), word::<BIG>(v[2]));
                    [3, a, b, c, d, e, f, g, h, i, j, k, l]
                }),
                Data::Quad(v) => scatter(out, size, at, &v[rows.clone()], |v| {
                    let mut bytes = [4; 17];
                    for (field, corner) in bytes[1..].chunks_exact_mut(4).zip(v) {
                        field.copy_from_slice(&word::<BIG>(*corner));
                    }
                    bytes
                }),
                Data::Pairs(v) => scatter(out, size, at, &v[rows.clone()], |v| {
                    let ([a, b, c, d], [e, f, g, h]) = (word::<BIG>(v[0].to_bits()), word::<BIG>(v[1].to_bits()));
                    [a, b, c, d, e, f, g, h]
                }),
                Data::Cell(_) => {}
            }
            at += column.data.size();
        }
    }

    fn text(&self, rows: Range<usize>, out: &mut Vec<u8>) {
        for row in rows {
            let start = out.len();
            for column in &self.columns {
                // Writing to memory can't fail.
                let _ = match &column.data {
                    Data::Single(v) => {
                        let [x, y, z] = v[row].as_vec3().to_array();
                        write!(out, "{} {} {} ", Shown(x), Shown(y), Shown(z))
                    }
                    Data::Floats(v) => write!(out, "{} {} {} ", Shown(v[row][0]), Shown(v[row][1]), Shown(v[row][2])),
                    Data::Double(v) => write!(out, "{} {} {} ", Shown(v[row].x), Shown(v[row].y), Shown(v[row].z)),
                    Data::F32(v) => write!(out, "{} ", Shown(v[row])),
                    Data::I32(v) => write!(out, "{} ", v[row]),
                    Data::Bool(v) => write!(out, "{} ", u8::from(v[row])),
                    Data::Colour(v) => write!(out, "{} {} {} {} ", v[row][0], v[row][1], v[row][2], v[row][3]),
                    Data::Triangle(v) => write!(out, "3 {} {} {} ", v[row][0], v[row][1], v[row][2]),
                    Data::Quad(v) => write!(out, "4 {} {} {} {} ", v[row][0], v[row][1], v[row][2], v[row][3]),
                    Data::Pairs(v) => write!(out, "{} {} ", Shown(v[row][0]), Shown(v[row][1])),
                    Data::Cell(v) if v[row] == NO_VERTEX => write!(out, "0 "),
                    Data::Cell(v) => write!(out, "1 {} ", v[row]),
                };
            }
            if out.len() > start && !self.blank_at_end {
                out.pop();
            }
            out.push(b'\n');
        }
    }
}

/// Puts one field into each row.
#[inline(always)]
fn scatter<T, const N: usize>(out: &mut [u8], size: usize, at: usize, values: &[T], bytes: impl Fn(&T) -> [u8; N]) {
    for (row, value) in out.chunks_exact_mut(size).zip(values) {
        if let Some(field) = row.get_mut(at..at + N) {
            field.copy_from_slice(&bytes(value));
        }
    }
}

#[inline(always)]
fn word<const BIG: bool>(value: u32) -> [u8; 4] {
    if BIG { value.to_be_bytes() } else { value.to_le_bytes() }
}

#[inline(always)]
fn floats<const BIG: bool>(v: [f32; 3]) -> [u8; 12] {
    let ([a, b, c, d], [e, f, g, h], [i, j, k, l]) =
        (word::<BIG>(v[0].to_bits()), word::<BIG>(v[1].to_bits()), word::<BIG>(v[2].to_bits()));
    [a, b, c, d, e, f, g, h, i, j, k, l]
}

#[inline(always)]
fn doubles<const BIG: bool>(v: [f64; 3]) -> [u8; 24] {
    let mut bytes = [0; 24];
    for (field, value) in bytes.chunks_exact_mut(8).zip(v) {
        field.copy_from_slice(&if BIG { value.to_be_bytes() } else { value.to_le_bytes() });
    }
    bytes
}

/// Fewest digits that read back as the same number. Very large and small ones with an exponent.
struct Shown<T>(T);

macro_rules! shown {
    ($kind:ty) => {
        impl std::fmt::Display for Shown<$kind> {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                let magnitude = self.0.abs();
                if magnitude == 0.0 || (1e-5..1e16).contains(&magnitude) || !magnitude.is_finite() {
                    write!(f, "{}", self.0)
                } else {
                    write!(f, "{:e}", self.0)
                }
            }
        }
    };
}

shown!(f32);
shown!(f64);
