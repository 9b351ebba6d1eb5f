//! Header of a PCD file: what it says of its points before they follow.

use glam::DVec3;

use crate::import::text::Lines;
use base::error::Result;

/// Most bytes of a point.
pub(super) const LARGEST_POINT: u64 = 1 << 16;

/// Target of a value.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Target {
    Position(usize),
    Normal(usize),
    Colour,
    Intensity,
    Nowhere,
}

/// A field of a point.
pub(super) struct Field {
    pub target: Target,
    pub kind: u8,
    pub size: usize,
    pub count: usize,
}

impl Field {
    /// The value in bytes of it. For a colour its bits.
    #[inline(always)]
    pub fn value(&self, bytes: &[u8]) -> f64 {
        let mut raw = [0; 8];
        raw[..self.size].copy_from_slice(&bytes[..self.size]);
        let bits = u64::from_le_bytes(raw);
        match (self.kind, self.size) {
            _ if self.target == Target::Colour => bits as u32 as f64,
            (b'F', 4) => f32::from_bits(bits as u32).into(),
            (b'F', _) => f64::from_bits(bits),
            (b'I', 1) => f64::from(bits as u8 as i8),
            (b'I', 2) => f64::from(bits as u16 as i16),
            (b'I', 4) => f64::from(bits as u32 as i32),
            (b'I', _) => bits as i64 as f64,
            _ => bits as f64,
        }
    }

    /// The value that a number of a text means. For a colour its bits.
    pub fn number(&self, number: f64) -> f64 {
        match (self.target, self.kind) {
            (Target::Colour, b'F') => f64::from((number as f32).to_bits()),
            _ => number,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Data {
    Ascii,
    Binary,
    Compressed,
}

pub(super) struct Header {
    pub fields: Vec<Field>,
    pub width: u64,
    pub height: u64,
    pub viewpoint: DVec3,
    pub data: Data,
}

/// Reads the lines up to `DATA`.
pub(super) fn header(lines: &mut Lines<'_>) -> Result<Header> {
    let (mut names, mut sizes, mut kinds, mut counts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut width, mut height, mut points, mut viewpoint) = (None, 1, None, DVec3::ZERO);
    let data = loop {
        if !lines.next_content()? {
            return Err(lines.ends("a line `DATA`"));
        }
        if lines.number > 100 {
            return Err(lines.fail("the header has more than 100 lines"));
        }
        let key = String::from_utf8_lossy(lines.word()).into_owned();
        match key.as_str() {
            _ if key.starts_with('#') => {}
            "VERSION" => {}
            "FIELDS" | "COLUMNS" => {
                while !lines.is_done() {
                    names.push(String::from_utf8_lossy(lines.word()).to_ascii_lowercase());
                }
            }
            "SIZE" => sizes = list(lines, "a size")?,
            "COUNT" => counts = list(lines, "a count")?,
            "TYPE" => {
                while !lines.is_done() {
                    kinds.push(match lines.word() {
                        b"F" => b'F',
                        b"I" => b'I',
                        b"U" => b'U',
                        _ => return Err(lines.fail("a type must be F, I or U")),
                    });
                }
            }
            "WIDTH" => width = Some(lines.count("the width")?),
            "HEIGHT" => height = lines.count("the height")?,
            "POINTS" => points = Some(lines.count("the number of points")?),
            "VIEWPOINT" => viewpoint = DVec3::new(lines.f64("tx")?, lines.f64("ty")?, lines.f64("tz")?),
            "DATA" => match lines.word() {
                b"ascii" => break Data::Ascii,
                b"binary" => break Data::Binary,
                b"binary_compressed" => break Data::Compressed,
                _ => return Err(lines.fail("the data must be ascii, binary or binary_compressed")),
            },
            _ => {
                let shown: String = key.chars().take(40).collect();
                return Err(lines.fail(format!("`{shown}` is unknown")));
            }
        }
    };
    let Some(width) = width else { return Err(lines.fail("the header needs a line WIDTH")) };
    if counts.is_empty() {
        counts = vec![1; names.len()];
    }
    if names.is_empty() || [sizes.len(), kinds.len(), counts.len()] != [names.len(); 3] {
        return Err(lines.fail("FIELDS, SIZE, TYPE and COUNT need as many entries each"));
    }
    if width.checked_mul(height).is_none_or(|all| points.is_some_and(|points| points != all)) {
        return Err(lines.fail(format!("POINTS is not WIDTH x HEIGHT = {width} x {height}")));
    }
    if !viewpoint.is_finite() {
        return Err(lines.fail("VIEWPOINT is not finite"));
    }
    let mut fields = Vec::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        let (size, kind, count) = (sizes[i], kinds[i], counts[i]);
        if !matches!((kind, size), (b'F', 4 | 8) | (b'I' | b'U', 1 | 2 | 4 | 8)) || count > LARGEST_POINT {
            return Err(lines.fail(format!("field {name}: type {} of {size} bytes is unknown", kind as char)));
        }
        let target = match name.as_str() {
            "x" | "y" | "z" => Target::Position(usize::from(name.as_bytes()[0] - b'x')),
            "normal_x" | "nx" => Target::Normal(0),
            "normal_y" | "ny" => Target::Normal(1),
            "normal_z" | "nz" => Target::Normal(2),
            "rgb" | "rgba" if size == 4 => Target::Colour,
            "intensity" | "i" => Target::Intensity,
            _ => Target::Nowhere,
        };
        let target = if count == 1 { target } else { Target::Nowhere };
        fields.push(Field { target, kind, size: size as usize, count: count as usize });
    }
    for axis in 0..3 {
        if fields.iter().filter(|f| f.target == Target::Position(axis)).count() != 1 {
            return Err(lines.fail("a cloud needs the fields x, y and z, once each"));
        }
    }
    Ok(Header { fields, width, height, viewpoint, data })
}

fn list(lines: &mut Lines<'_>, what: &str) -> Result<Vec<u64>> {
    let mut all = Vec::new();
    while !lines.is_done() {
        all.push(lines.count(what)?);
    }
    Ok(all)
}
