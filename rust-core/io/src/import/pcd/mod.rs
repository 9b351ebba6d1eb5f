//! PCD, the format of the Point Cloud Library: text, binary, and compressed binary (LZF, one field after the other).
//!
//! A file with a `HEIGHT` above 1 is organized: a range image whose rays start at `VIEWPOINT`; points with a coordinate
//! that isn't finite, and those at exactly (0, 0, 0), are invalid pixels. Otherwise it is a cloud. Besides x, y, z are
//! read: `rgb` or `rgba` (packed into a float or a whole number), `intensity`, and normals of clouds.
//!
//! *What is refused*: sizes that the bytes of the file can't hold, also after unpacking (LZF makes at most 88 bytes out
//! of one), and unpacked sizes above the limit of the options.
//!
//! Cost: one pass; memory for the result and a window, compressed or not.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::file::{self, Input, reserve};
use super::grid::PointGrid;
use super::text::{Lines, lines_of};
use super::window::Window;
use super::{Content, Scan};
use base::error::{Error, Result};
use base::progress::Progress;
use mesh::point_cloud::PointCloud;

/// Most bytes that LZF makes out of one: three bytes name a run of 264.
const LZF_RATIO: u64 = 88;

/// Farthest that LZF looks back.
const LZF_HISTORY: usize = 1 << 13;

/// Most bytes of a point.
const LARGEST_POINT: u64 = 1 << 16;

pub(super) fn sniff(start: &[u8]) -> bool {
    let text = file::start_of_text(start);
    let mut lines = lines_of(&text).map(str::trim);
    let first = lines.find(|line| !line.is_empty() && !line.starts_with('#'));
    let begins = |word: &str| first.is_some_and(|line| line.split_ascii_whitespace().next() == Some(word));
    begins("VERSION") && (text.contains("FIELDS") || text.contains("COLUMNS")) || begins("FIELDS")
}

/// Where a value goes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Target {
    Position(usize),
    Normal(usize),
    Colour,
    Intensity,
    Nowhere,
}

/// A field of a point.
struct Field {
    target: Target,
    kind: u8,
    size: usize,
    count: usize,
}

impl Field {
    /// The value in bytes of it; for a colour its bits.
    #[inline(always)]
    fn value(&self, bytes: &[u8]) -> f64 {
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

    /// What a number of a text means; for a colour its bits.
    fn number(&self, number: f64) -> f64 {
        match (self.target, self.kind) {
            (Target::Colour, b'F') => f64::from((number as f32).to_bits()),
            _ => number,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Data {
    Ascii,
    Binary,
    Compressed,
}

struct Header {
    fields: Vec<Field>,
    width: u64,
    height: u64,
    viewpoint: DVec3,
    data: Data,
}

fn header(lines: &mut Lines<'_>) -> Result<Header> {
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
                        _ => return Err(lines.fail("a type is F, I or U")),
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
                _ => return Err(lines.fail("the data is ascii, binary or binary_compressed")),
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

/// Where the values of a file go.
enum Sink {
    Grid(PointGrid),
    Cloud {
        positions: Vec<DVec3>,
        normals: Option<Vec<[f32; 3]>>,
        colour: Option<Vec<[u8; 4]>>,
        intensity: Option<Vec<f32>>,
    },
}

impl Sink {
    fn new(header: &Header, points: usize, path: &Path) -> Result<Self> {
        let has = |target| header.fields.iter().any(|f| f.target == target);
        if header.height > 1 {
            let (rows, cols) = (header.height as usize, header.width as usize);
            return Ok(Sink::Grid(PointGrid::new(rows, cols, has(Target::Intensity), has(Target::Colour), path)?));
        }
        fn filled<T: Clone>(wanted: bool, count: usize, with: T, path: &Path) -> Result<Option<Vec<T>>> {
            if !wanted {
                return Ok(None);
            }
            let mut list = reserve(count, path)?;
            list.resize(count, with);
            Ok(Some(list))
        }
        Ok(Sink::Cloud {
            positions: filled(true, points, DVec3::NAN, path)?.unwrap_or_default(),
            normals: filled((0..3).all(|axis| has(Target::Normal(axis))), points, [0.0; 3], path)?,
            colour: filled(has(Target::Colour), points, [0; 4], path)?,
            intensity: filled(has(Target::Intensity), points, 0.0, path)?,
        })
    }

    #[inline(always)]
    fn set(&mut self, point: usize, target: Target, value: f64) {
        // Packed as 0xAARRGGBB; most writers leave alpha 0.
        let unpacked = |bits: f64| {
            let [b, g, r, _] = (bits as u32).to_le_bytes();
            [r, g, b, 255]
        };
        match (self, target) {
            (Sink::Grid(grid), Target::Position(axis)) => grid.set_coordinate(point, axis, value),
            (
                Sink::Grid(PointGrid { colour: Some(list), .. }) | Sink::Cloud { colour: Some(list), .. },
                Target::Colour,
            ) => {
                list[point] = unpacked(value);
            }
            (
                Sink::Grid(PointGrid { intensity: Some(list), .. }) | Sink::Cloud { intensity: Some(list), .. },
                Target::Intensity,
            ) => list[point] = value as f32,
            (Sink::Cloud { positions, .. }, Target::Position(axis)) => positions[point][axis] = value,
            (Sink::Cloud { normals: Some(list), .. }, Target::Normal(axis)) => list[point][axis] = value as f32,
            _ => {}
        }
    }

    fn into_content(self, header: &Header, scan: &Scan) -> Result<Content> {
        let (mut positions, mut normals, mut colour, mut intensity) = match self {
            Sink::Grid(grid) => return grid.into_content(header.viewpoint, scan),
            Sink::Cloud { positions, normals, colour, intensity } => (positions, normals, colour, intensity),
        };
        if positions.iter().any(|p| !p.is_finite()) {
            fn retain<T>(list: &mut Vec<T>, kept: &[bool]) {
                let mut kept = kept.iter();
                list.retain(|_| kept.next() == Some(&true));
            }
            let kept: Vec<bool> = positions.iter().map(|p| p.is_finite()).collect();
            retain(&mut positions, &kept);
            normals.iter_mut().for_each(|list| retain(list, &kept));
            colour.iter_mut().for_each(|list| retain(list, &kept));
            intensity.iter_mut().for_each(|list| retain(list, &kept));
        }
        let world_from_cloud: DAffine3 = scan.world_from_sensor;
        Ok(Content::Points(PointCloud { positions, normals, colour, intensity, world_from_cloud }))
    }
}

pub(super) fn parse(input: &mut dyn Input, length: u64, scan: &Scan, _: &Progress<'_>) -> Result<Content> {
    let path = &scan.path;
    let mut lines = Lines::new(input, length, path);
    let header = header(&mut lines)?;
    let stride: u64 = header.fields.iter().map(|f| f.size as u64 * f.count as u64).sum();
    let numbers: u64 = header.fields.iter().map(|f| f.count as u64).sum();
    if stride > LARGEST_POINT {
        return Err(lines.fail(format!("a point of {stride} bytes is more than {LARGEST_POINT}")));
    }
    let points = header.width * header.height;
    let too_many = |lines: &Lines<'_>, held: u64| {
        let problem = format!("{} x {} points don't fit the {held} bytes that follow", header.width, header.height);
        Err(lines.fail(problem))
    };
    let left = lines.left()?;
    let content = match header.data {
        Data::Ascii => {
            // A digit and a blank a number; the last needs none.
            if points.checked_mul(2 * numbers).is_none_or(|bytes| bytes > left + 1) {
                return too_many(&lines, left);
            }
            let mut sink = Sink::new(&header, points as usize, path)?;
            for point in 0..points as usize {
                if !lines.next_content()? {
                    return Err(lines.ends(&format!("point {point} of {points}")));
                }
                for field in &header.fields {
                    for _ in 0..field.count {
                        let value = field.number(lines.f64("a number")?);
                        sink.set(point, field.target, value);
                    }
                }
                if !lines.is_done() {
                    return Err(lines.expected("the end of the line: a point has one"));
                }
            }
            return sink.into_content(&header, scan);
        }
        Data::Binary => {
            if points.checked_mul(stride).is_none_or(|bytes| bytes > left) {
                return too_many(&lines, left);
            }
            let mut bytes = Plain(lines.into_window());
            let mut sink = Sink::new(&header, points as usize, path)?;
            let mut read = || -> Result<(), usize> {
                let mut record = vec![0; stride as usize];
                for point in 0..points as usize {
                    bytes.take(&mut record).ok_or(point)?;
                    let mut at = 0;
                    for field in &header.fields {
                        if field.target != Target::Nowhere {
                            sink.set(point, field.target, field.value(&record[at..]));
                        }
                        at += field.size * field.count;
                    }
                }
                Ok(())
            };
            let outcome = read();
            finish(outcome, bytes.0, points, scan).map(|()| sink)
        }
        Data::Compressed => {
            let mut window = lines.into_window();
            if !window.ensure(8) {
                return finish(Err(0), window, points, scan).and(Err(Error::format(path, "data", "the file ends")));
            }
            let size = |at: usize| {
                let bytes = &window.rest()[at..at + 4];
                u64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
            };
            let (packed, unpacked) = (size(0), size(4));
            window.at += 8;
            let fail = |problem: String| Err(Error::format(path, "data", problem));
            if points.checked_mul(stride) != Some(unpacked) {
                return fail(format!(
                    "{points} points of {stride} bytes aren't the {unpacked} bytes that it unpacks to"
                ));
            }
            if packed > window.left() || unpacked > packed * LZF_RATIO {
                let left = window.left();
                return fail(format!("{packed} bytes, of the {left} that follow, can't unpack to {unpacked}"));
            }
            if unpacked > scan.options.max_decoded_bytes() {
                let limit = scan.options.max_decoded_gib;
                return fail(format!(
                    "it unpacks to {unpacked} bytes, more than max_decoded_gib = {limit} GiB; raise it"
                ));
            }
            let mut bytes = Lzf { window, packed, out: Vec::with_capacity(4 * LZF_HISTORY), at: 0 };
            let mut sink = Sink::new(&header, points as usize, path)?;
            let mut read = || -> Result<(), usize> {
                let mut value = [0; 8];
                for field in &header.fields {
                    for point in 0..points as usize {
                        for _ in 0..field.count {
                            bytes.take(&mut value[..field.size]).ok_or(point)?;
                            sink.set(point, field.target, field.value(&value));
                        }
                    }
                }
                Ok(())
            };
            let outcome = read();
            finish(outcome, bytes.window, points, scan).map(|()| sink)
        }
    };
    content?.into_content(&header, scan)
}

/// The error of data that ends or can't be unpacked at a point, or of reading that failed.
fn finish(outcome: Result<(), usize>, mut window: Window<'_>, points: u64, scan: &Scan) -> Result<()> {
    if let Some(error) = window.failure() {
        return Err(Error::io(&scan.path, error));
    }
    outcome
        .map_err(|point| Error::format(&scan.path, format!("point {point} of {points}"), "the data ends or is damaged"))
}

/// Bytes as they lie in the file.
struct Plain<'a>(Window<'a>);

impl Plain<'_> {
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

/// Bytes packed by LZF: runs of plain bytes, and runs that repeat bytes up to 8 KiB back.
struct Lzf<'a> {
    window: Window<'a>,
    /// Packed bytes that are left.
    packed: u64,
    /// The last bytes unpacked: at least the history, if there are as many.
    out: Vec<u8>,
    /// The next byte of `out` to be used.
    at: usize,
}

impl Lzf<'_> {
    #[inline(always)]
    fn take(&mut self, into: &mut [u8]) -> Option<()> {
        while self.out.len() - self.at < into.len() {
            self.unpack()?;
        }
        into.copy_from_slice(&self.out[self.at..self.at + into.len()]);
        self.at += into.len();
        Some(())
    }

    /// Unpacks one run.
    fn unpack(&mut self) -> Option<()> {
        if self.at > 3 * LZF_HISTORY {
            // What was used and is out of reach goes.
            let kept = self.at - LZF_HISTORY;
            self.out.drain(..kept);
            self.at = LZF_HISTORY;
        }
        let control = usize::from(self.byte()?);
        if control < 32 {
            for _ in 0..=control {
                let byte = self.byte()?;
                self.out.push(byte);
            }
            return Some(());
        }
        let mut length = control >> 5;
        if length == 7 {
            length += usize::from(self.byte()?);
        }
        let back = ((control & 31) << 8) + usize::from(self.byte()?) + 1;
        let from = self.out.len().checked_sub(back)?;
        // One by one: a run may repeat itself.
        for i in 0..length + 2 {
            self.out.push(self.out[from + i]);
        }
        Some(())
    }

    #[inline(always)]
    fn byte(&mut self) -> Option<u8> {
        if self.packed == 0 || !self.window.ensure(1) {
            return None;
        }
        self.packed -= 1;
        let byte = self.window.padded()[self.window.at];
        self.window.at += 1;
        Some(byte)
    }
}

#[cfg(test)]
mod tests;
