//! Values out of the body of a PLY file, from text or from either binary encoding, always within its bounds.

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

    /// A number of type float, rounded to that type.
    #[inline(always)]
    pub(super) fn float(&mut self) -> Result<f32, Fault> {
        let start = self.value()?;
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
