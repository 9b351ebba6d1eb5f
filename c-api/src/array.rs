//! Arrays across the border: borrowed ones in, views of our own out.

use std::ffi::c_void;

use bytemuck::{AnyBitPattern, NoUninit};
use glam::DVec3;
use surfrecon::mesh::AttributeData;

use crate::pointer;
use crate::status::{Failure, srf_status::*};

/// Type of the numbers of an array.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum srf_type {
    /// float
    SRF_TYPE_F32 = 1,
    /// double
    SRF_TYPE_F64 = 2,
    /// int32_t
    SRF_TYPE_I32 = 3,
    /// uint32_t
    SRF_TYPE_U32 = 4,
    /// uint8_t
    SRF_TYPE_U8 = 5,
    /// uint16_t, of the depths of frames and of height maps
    SRF_TYPE_U16 = 6,
}

use srf_type::*;

/// An array of `count` elements of `components` numbers each.
///
/// Handed in it is borrowed for the call and copied. Handed out it is a view that copies nothing: it stays until the handle
/// it came from is freed or changed, and must not be written to.
#[allow(non_camel_case_types)]
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct srf_array {
    /// The first number of the first element. May be NULL if count is 0. Needs no alignment.
    pub data: *const c_void,
    /// Number of elements.
    pub count: usize,
    /// Bytes from one element to the next. 0 for elements without gaps. At least the size of an element.
    pub stride: usize,
    /// A value of srf_type.
    pub r#type: u32,
    /// Numbers an element: 3 for points and triangles, 4 for colours, 1 for plain values.
    pub components: u32,
}

fn size_of_type(name: &str, type_: u32) -> Result<usize, Failure> {
    match type_ {
        t if t == SRF_TYPE_F32 as u32 || t == SRF_TYPE_I32 as u32 || t == SRF_TYPE_U32 as u32 => Ok(4),
        t if t == SRF_TYPE_F64 as u32 => Ok(8),
        t if t == SRF_TYPE_U16 as u32 => Ok(2),
        t if t == SRF_TYPE_U8 as u32 => Ok(1),
        other => Err(Failure::new(
            SRF_ERR_PARAMETER,
            format!("{name}: type must be a value of srf_type, 1 to 6, got {other}"),
        )),
    }
}

fn name_of_type(type_: u32) -> &'static str {
    match type_ {
        1 => "SRF_TYPE_F32",
        2 => "SRF_TYPE_F64",
        3 => "SRF_TYPE_I32",
        4 => "SRF_TYPE_U32",
        6 => "SRF_TYPE_U16",
        _ => "SRF_TYPE_U8",
    }
}

/// Layout of an image in memory.
#[derive(Clone, Copy)]
pub struct Rows {
    pub rows: usize,
    pub cols: usize,
    /// Bytes from one row to the next. 0 for rows without gaps.
    pub stride: usize,
}

/// A borrowed array whose extent is checked.
pub struct Borrowed<'a> {
    name: &'a str,
    bytes: &'a [u8],
    /// Elements. Those of a row follow each other at `stride` bytes.
    count: usize,
    stride: usize,
    row: Row,
    type_: u32,
}

/// Elements of a row, and bytes from its first one to that of the next.
struct Row {
    count: usize,
    stride: usize,
}

impl<'a> Borrowed<'a> {
    /// Takes an array of elements of `components` numbers.
    pub fn new(name: &'a str, array: *const srf_array, components: u32) -> Result<Self, Failure> {
        Self::take(name, array, components, None)
    }

    /// Number of elements.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Takes an image of elements of `components` numbers.
    pub fn image(name: &'a str, array: *const srf_array, components: u32, rows: Rows) -> Result<Self, Failure> {
        Self::take(name, array, components, Some(rows))
    }

    fn take(name: &'a str, array: *const srf_array, components: u32, rows: Option<Rows>) -> Result<Self, Failure> {
        let array = pointer::read_struct(array)
            .ok_or_else(|| Failure::new(SRF_ERR_NULL, format!("{name} must not be NULL")))?;
        let wrong = |text: String| Failure::new(SRF_ERR_PARAMETER, format!("{name}: {text}"));
        let size = size_of_type(name, array.r#type)? * components as usize;
        if array.components != components {
            return Err(wrong(format!("components must be {components}, got {}", array.components)));
        }
        let stride = if array.stride == 0 { size } else { array.stride };
        if stride < size {
            return Err(wrong(format!("a stride must be 0 or at least the {size} bytes of an element, got {stride}")));
        }
        let too_many = || wrong(format!("{} elements are more than there can be", array.count));
        let spanned = |count: usize, stride: usize, last: usize| match count {
            0 => Some(0),
            n => (n - 1).checked_mul(stride).and_then(|bytes| bytes.checked_add(last)),
        };
        let Rows { rows, cols, stride: row_stride } = rows.unwrap_or(Rows { rows: 1, cols: array.count, stride: 0 });
        if rows.checked_mul(cols) != Some(array.count) {
            let text = format!("{name}: an image of {cols} x {rows} pixels has not {} elements", array.count);
            return Err(Failure::new(SRF_ERR_INPUT, text));
        }
        let a_row = spanned(cols, stride, size).ok_or_else(too_many)?;
        let row_stride = if row_stride == 0 { cols.checked_mul(stride).ok_or_else(too_many)? } else { row_stride };
        if row_stride < a_row {
            return Err(wrong(format!(
                "a row stride must be 0 or at least the {a_row} bytes of a row, got {row_stride}"
            )));
        }
        let length = spanned(if cols == 0 { 0 } else { rows }, row_stride, a_row).ok_or_else(too_many)?;
        let bytes = pointer::bytes(&format!("{name}.data"), array.data.cast(), length)?;
        let row = Row { count: cols, stride: row_stride };
        Ok(Borrowed { name, bytes, count: array.count, stride, row, type_: array.r#type })
    }

    /// Like [`Borrowed::new`], `None` for NULL.
    pub fn optional(name: &'a str, array: *const srf_array, components: u32) -> Result<Option<Self>, Failure> {
        if array.is_null() { Ok(None) } else { Self::new(name, array, components).map(Some) }
    }

    fn wrong_type(&self, wanted: &str) -> Failure {
        let got = name_of_type(self.type_);
        Failure::new(SRF_ERR_PARAMETER, format!("{}: type must be {wanted}, got {got}", self.name))
    }

    fn collect<T: AnyBitPattern, R>(&self, mut convert: impl FnMut(T) -> R) -> Result<Vec<R>, Failure> {
        let mut all = Vec::new();
        all.try_reserve_exact(self.count).map_err(|_| {
            Failure::new(
                SRF_ERR_OUT_OF_MEMORY,
                format!(
                    "not enough memory for the {} elements of {}: give fewer, or free memory",
                    self.count, self.name
                ),
            )
        })?;
        let size = size_of::<T>();
        let mut element = |bytes: &[u8]| convert(bytemuck::pod_read_unaligned(&bytes[..size]));
        let of_row = (self.row.count.saturating_sub(1)) * self.stride + size;
        for row in self.bytes.chunks(self.row.stride.max(1)) {
            let row = &row[..of_row];
            if self.stride == size {
                // The compiler makes one copy of this.
                all.extend(row.chunks_exact(size).map(&mut element));
            } else {
                all.extend(row.chunks(self.stride).map(&mut element));
            }
        }
        Ok(all)
    }

    /// Points as doubles.
    pub fn points(&self) -> Result<Vec<DVec3>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_F64 as u32 => self.collect(|p: [f64; 3]| DVec3::from_array(p)),
            t if t == SRF_TYPE_F32 as u32 => self.collect(|p: [f32; 3]| DVec3::from_array(p.map(f64::from))),
            _ => Err(self.wrong_type("SRF_TYPE_F64 or SRF_TYPE_F32")),
        }
    }

    /// Points as floats.
    pub fn points_f32(&self) -> Result<Vec<[f32; 3]>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_F32 as u32 => self.collect(|p: [f32; 3]| p),
            t if t == SRF_TYPE_F64 as u32 => {
                let mut overflow = None;
                let points = self.collect(|p: [f64; 3]| p.map(|x| single(x, &mut overflow)))?;
                self.fits(overflow).map(|()| points)
            }
            _ => Err(self.wrong_type("SRF_TYPE_F32 or SRF_TYPE_F64")),
        }
    }

    /// Plain values as doubles.
    pub fn values(&self) -> Result<Vec<f64>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_F64 as u32 => self.collect(|x: [f64; 1]| x[0]),
            t if t == SRF_TYPE_F32 as u32 => self.collect(|x: [f32; 1]| f64::from(x[0])),
            _ => Err(self.wrong_type("SRF_TYPE_F64 or SRF_TYPE_F32")),
        }
    }

    /// Plain values as floats.
    pub fn values_f32(&self) -> Result<Vec<f32>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_F32 as u32 => self.collect(|x: [f32; 1]| x[0]),
            t if t == SRF_TYPE_F64 as u32 => {
                let mut overflow = None;
                let values = self.collect(|x: [f64; 1]| single(x[0], &mut overflow))?;
                self.fits(overflow).map(|()| values)
            }
            _ => Err(self.wrong_type("SRF_TYPE_F32 or SRF_TYPE_F64")),
        }
    }

    /// Refuses a number that single precision can't hold.
    fn fits(&self, overflow: Option<f64>) -> Result<(), Failure> {
        let Some(number) = overflow else { return Ok(()) };
        let text = format!("{}: {number:e} is more than single precision can hold", self.name);
        Err(Failure::new(SRF_ERR_INPUT, text))
    }

    /// Triples of vertices.
    pub fn triangles(&self) -> Result<Vec<[u32; 3]>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_U32 as u32 => self.collect(|t: [u32; 3]| t),
            // A negative index becomes one that no mesh has, and is refused as out of range.
            t if t == SRF_TYPE_I32 as u32 => {
                self.collect(|t: [i32; 3]| t.map(|v| u32::try_from(v).unwrap_or(u32::MAX)))
            }
            _ => Err(self.wrong_type("SRF_TYPE_U32 or SRF_TYPE_I32")),
        }
    }

    /// Rows or columns of pixels. A number that 31 bits can't hold lies outside of any grid, and stays so.
    pub fn places(&self) -> Result<Vec<i32>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_I32 as u32 => self.collect(|[place]: [i32; 1]| place),
            t if t == SRF_TYPE_U32 as u32 => self.collect(|[place]: [u32; 1]| i32::try_from(place).unwrap_or(i32::MAX)),
            _ => Err(self.wrong_type("SRF_TYPE_I32 or SRF_TYPE_U32")),
        }
    }

    /// Colours.
    pub fn colours(&self) -> Result<Vec<[u8; 4]>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_U8 as u32 => self.collect(|c: [u8; 4]| c),
            _ => Err(self.wrong_type("SRF_TYPE_U8")),
        }
    }

    /// Flags: bytes that are not 0.
    pub fn marks(&self) -> Result<Vec<bool>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_U8 as u32 => self.collect(|mark: [u8; 1]| mark[0] != 0),
            _ => Err(self.wrong_type("SRF_TYPE_U8")),
        }
    }

    /// Depths as doubles. NaN where one of 16 bits is the largest, which marks that nothing was measured.
    pub fn depths(&self) -> Result<Vec<f64>, Failure> {
        let whole = |[depth]: [u16; 1]| if depth == u16::MAX { f64::NAN } else { f64::from(depth) };
        match self.type_ {
            t if t == SRF_TYPE_U16 as u32 => self.collect(whole),
            t if t == SRF_TYPE_F64 as u32 || t == SRF_TYPE_F32 as u32 => self.values(),
            _ => Err(self.wrong_type("SRF_TYPE_U16, SRF_TYPE_F32 or SRF_TYPE_F64")),
        }
    }

    /// The colours of an image of 3 or 4 numbers a pixel. Of 4 the last is passed over.
    pub fn opaque_image(name: &'a str, array: *const srf_array, rows: Rows) -> Result<Vec<[u8; 3]>, Failure> {
        match pointer::read_struct(array).map_or(3, |array| array.components) {
            3 => Self::image(name, array, 3, rows)?.opaque::<3>(),
            4 => Self::image(name, array, 4, rows)?.opaque::<4>(),
            other => Err(Failure::new(SRF_ERR_PARAMETER, format!("{name}: components must be 3 or 4, got {other}"))),
        }
    }

    /// The first three of the `N` numbers of a colour.
    fn opaque<const N: usize>(&self) -> Result<Vec<[u8; 3]>, Failure>
    where
        [u8; N]: AnyBitPattern,
    {
        match self.type_ {
            t if t == SRF_TYPE_U8 as u32 => self.collect(|c: [u8; N]| [c[0], c[1], c[2]]),
            _ => Err(self.wrong_type("SRF_TYPE_U8")),
        }
    }

    /// Levels of confidence.
    pub fn levels(&self) -> Result<Vec<u8>, Failure> {
        match self.type_ {
            t if t == SRF_TYPE_U8 as u32 => self.collect(|[level]: [u8; 1]| level),
            _ => Err(self.wrong_type("SRF_TYPE_U8")),
        }
    }

    /// The entries of an attribute, by type and components: floats, integers, flags (one byte), colours (four bytes).
    pub fn attribute(array: *const srf_array, name: &'a str) -> Result<AttributeData, Failure> {
        let given = pointer::read_struct(array)
            .ok_or_else(|| Failure::new(SRF_ERR_NULL, format!("{name} must not be NULL")))?;
        let borrowed = Borrowed::new(name, array, given.components)?;
        match (given.r#type, given.components) {
            (t, 1) if t == SRF_TYPE_F32 as u32 || t == SRF_TYPE_F64 as u32 => {
                Ok(AttributeData::F32(borrowed.values_f32()?))
            }
            (t, 1) if t == SRF_TYPE_I32 as u32 => Ok(AttributeData::I32(borrowed.collect(|x: [i32; 1]| x[0])?)),
            (t, 1) if t == SRF_TYPE_U8 as u32 => Ok(AttributeData::Bool(borrowed.marks()?)),
            (t, 4) if t == SRF_TYPE_U8 as u32 => Ok(AttributeData::Colour(borrowed.colours()?)),
            (t, n) => Err(Failure::new(
                SRF_ERR_PARAMETER,
                format!(
                    "{name}: an attribute must have one SRF_TYPE_F32, SRF_TYPE_I32 or SRF_TYPE_U8 (a flag) or four \
                        SRF_TYPE_U8 (a colour) per element, got {n} {}",
                    name_of_type(t)
                ),
            )),
        }
    }
}

/// A number in single precision. A finite one that becomes infinite is kept in `overflow`.
fn single(number: f64, overflow: &mut Option<f64>) -> f32 {
    let rounded = number as f32;
    if rounded.is_infinite() && number.is_finite() {
        *overflow = Some(number);
    }
    rounded
}

/// A view of a slice of ours.
fn view<T: NoUninit>(values: &[T], type_: srf_type, components: u32) -> srf_array {
    let data = if values.is_empty() { std::ptr::null() } else { values.as_ptr().cast() };
    srf_array { data, count: values.len(), stride: size_of::<T>(), r#type: type_ as u32, components }
}

/// A view of points.
pub fn points(values: &[DVec3]) -> srf_array {
    view(bytemuck::cast_slice::<DVec3, [f64; 3]>(values), SRF_TYPE_F64, 3)
}

/// A view of triples of floats.
pub fn points_f32(values: &[[f32; 3]]) -> srf_array {
    view(values, SRF_TYPE_F32, 3)
}

/// A view of doubles.
pub fn values(values: &[f64]) -> srf_array {
    view(values, SRF_TYPE_F64, 1)
}

/// A view of floats.
pub fn values_f32(values: &[f32]) -> srf_array {
    view(values, SRF_TYPE_F32, 1)
}

/// A view of triangles.
pub fn triangles(values: &[[u32; 3]]) -> srf_array {
    view(values, SRF_TYPE_U32, 3)
}

/// A view of the corners of quads.
pub fn quads(values: &[[u32; 4]]) -> srf_array {
    view(values, SRF_TYPE_U32, 4)
}

/// A view of rows and columns.
pub fn pixels(values: &[[u32; 2]]) -> srf_array {
    view(values, SRF_TYPE_U32, 2)
}

/// A view of texture coordinates.
pub fn uvs(values: &[[f32; 2]]) -> srf_array {
    view(values, SRF_TYPE_F32, 2)
}

/// A view of flags.
pub fn flags(values: &[bool]) -> srf_array {
    view(values, SRF_TYPE_U8, 1)
}

/// A view of colours.
pub fn colours(values: &[[u8; 4]]) -> srf_array {
    view(values, SRF_TYPE_U8, 4)
}

/// A view of colours without alpha, or of normals in bytes.
pub fn opaque(values: &[[u8; 3]]) -> srf_array {
    view(values, SRF_TYPE_U8, 3)
}

/// A view of bytes.
pub fn bytes(values: &[u8]) -> srf_array {
    view(values, SRF_TYPE_U8, 1)
}

/// A view of whole numbers of 16 bits.
pub fn words(values: &[u16]) -> srf_array {
    view(values, SRF_TYPE_U16, 1)
}

/// A view of an attribute.
pub fn attribute(data: &AttributeData) -> srf_array {
    match data {
        AttributeData::F32(v) => view(v, SRF_TYPE_F32, 1),
        AttributeData::I32(v) => view(v, SRF_TYPE_I32, 1),
        AttributeData::Bool(v) => view(v, SRF_TYPE_U8, 1),
        AttributeData::Colour(v) => view(v, SRF_TYPE_U8, 4),
    }
}
