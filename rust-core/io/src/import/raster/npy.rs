//! NumPy arrays (`.npy`, versions 1 to 3): numbers. Of shape (rows, cols) they are an image, of (n, 3) points. Of (rows, cols, 3) they are
//! a grid of points, seen from the origin with a camera, else along -z.

use ::exr::prelude::f16;
use glam::DVec3;

use super::super::file::{Input, reserve};
use super::super::scan::{Content, FileScan};
use super::super::window::Window;
use super::bounds::stored_pixels;
use super::content::{Numbers, Raster};
use base::error::{Error, Result};
use base::progress::Progress;
use image::range_image::{RangeImage, Viewing};
use mesh::point_cloud::PointCloud;

/// Longest header: NumPy writes some hundred bytes.
const LONGEST_HEADER: usize = 1 << 16;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    start.starts_with(b"\x93NUMPY")
}

pub(in super::super) fn parse(
    input: &mut dyn Input,
    length: u64,
    scan: &FileScan,
    _: &Progress<'_>,
) -> Result<Content> {
    let mut window = Window::new(input, length);
    let content = read(&mut window, scan);
    window.failure().map_or(content, |error| Err(Error::io(&scan.path, error)))
}

/// Reads an array of two dimensions as the image that it is.
pub(super) fn raster(window: &mut Window<'_>, scan: &FileScan) -> Result<Raster> {
    let array = array(window, scan)?;
    let (&[rows, cols] | &[rows, cols, 1] | &[1, rows, cols]) = array.shape.as_slice() else {
        let problem = format!("an image of depths must have the shape (rows, cols), not {:?}", array.shape);
        return Err(Error::format(&scan.path, "header", problem));
    };
    let count = stored_pixels(rows, cols, array.item.size() as u64, window.left(), scan, "header")?;
    let values = values(window, scan, &array, [rows as usize, cols as usize], count)?;
    Ok(Raster { rows: rows as usize, cols: cols as usize, values, numbers: array.item.numbers(), place: None })
}

/// The array of the header, with the window behind it.
fn array(window: &mut Window<'_>, scan: &FileScan) -> Result<Array> {
    let header = header(window, scan)?;
    Array::parse(&header).ok_or_else(|| {
        let problem = match descr(&header) {
            Some(descr) if Item::parse(descr).is_none() => format!(
                "its numbers are of the type {descr}, but must be floats of 2, 4 or 8 bytes, whole numbers up to 8 \
                    bytes, or bool. Convert it with array.astype('f4')."
            ),
            _ => {
                let shown: String = header.chars().take(120).collect();
                format!("expected {{'descr': ..., 'fortran_order': ..., 'shape': (...)}}, found `{}`", shown.trim_end())
            }
        };
        Error::format(&scan.path, "header", problem)
    })
}

/// The numbers of an image, row by row.
fn values(
    window: &mut Window<'_>,
    scan: &FileScan,
    array: &Array,
    [rows, cols]: [usize; 2],
    count: usize,
) -> Result<Vec<f64>> {
    let mut values: Vec<f64> = reserve(count, &scan.path)?;
    if array.fortran_order {
        values.resize(count, f64::NAN);
        let mut k = 0;
        numbers(window, scan, array.item, count, |value| {
            values[k % rows * cols + k / rows] = value;
            k += 1;
        })?;
    } else {
        numbers(window, scan, array.item, count, |value| values.push(value))?;
    }
    Ok(values)
}

fn read(window: &mut Window<'_>, scan: &FileScan) -> Result<Content> {
    let fail = |problem: String| Err(Error::format(&scan.path, "header", problem));
    let array = array(window, scan)?;
    let (rows, cols, depth) = match *array.shape.as_slice() {
        [rows, cols] | [rows, cols, 1] => (rows, cols, 1),
        [rows, cols, 3] => (rows, cols, 3),
        _ => {
            return fail(format!(
                "an image must have the shape (rows, cols), points (n, 3) or (rows, cols, 3), not {:?}",
                array.shape
            ));
        }
    };
    if depth == 3 && array.fortran_order {
        return fail("points in Fortran order: save numpy.ascontiguousarray(points)".to_owned());
    }
    let size = array.item.size() as u64;
    let count = stored_pixels(rows, cols, size * depth, window.left(), scan, "header")? * depth as usize;
    let (rows, cols) = (rows as usize, cols as usize);
    if depth == 3 {
        let mut points: Vec<[f32; 3]> = reserve(rows * cols, &scan.path)?;
        let mut point = [0.0; 3];
        let mut k = 0;
        numbers(window, scan, array.item, count, |value| {
            point[k % 3] = value as f32;
            k += 1;
            if k % 3 == 0 {
                points.push(point);
            }
        })?;
        let viewing = if scan.options.camera.is_some() { Viewing::From(DVec3::ZERO) } else { Viewing::ALONG_MINUS_Z };
        let mut image = RangeImage::from_points(rows, cols, points, viewing)?;
        image.name = scan.name.clone();
        image.world_from_sensor = scan.world_from_sensor;
        return Ok(Content::RangeImage(image));
    }
    if array.shape.len() == 2
        && cols == 3
        && !array.fortran_order
        && scan.options.camera.is_none()
        && array.item.is_real()
    {
        let mut positions: Vec<DVec3> = reserve(rows, &scan.path)?;
        let mut point = DVec3::ZERO;
        let mut k = 0;
        numbers(window, scan, array.item, count, |value| {
            point[k % 3] = value;
            k += 1;
            if k % 3 == 0 && point.is_finite() {
                positions.push(point);
            }
        })?;
        return Ok(Content::Points(PointCloud {
            positions,
            world_from_cloud: scan.world_from_sensor,
            ..PointCloud::default()
        }));
    }
    let values = values(window, scan, &array, [rows, cols], count)?;
    Raster { rows, cols, values, numbers: array.item.numbers(), place: None }.into_content(scan)
}

/// The header's text.
fn header(window: &mut Window<'_>, scan: &FileScan) -> Result<String> {
    let fail = |problem: &str| Err(Error::format(&scan.path, "header", problem));
    if !window.ensure(12) || !sniff(window.rest()) {
        return fail("a NumPy array must start with \\x93NUMPY and the length of its header");
    }
    let start = window.rest();
    let (before, length) = match start[6] {
        1 => (10, usize::from(u16::from_le_bytes([start[8], start[9]]))),
        2 | 3 => (12, u32::from_le_bytes([start[8], start[9], start[10], start[11]]) as usize),
        version => return fail(&format!("version {version} is unknown: known are 1, 2 and 3")),
    };
    if length > LONGEST_HEADER {
        return fail(&format!("its length, {length} bytes, is more than {LONGEST_HEADER}"));
    }
    window.at += before;
    while window.rest().len() < length && window.grow() {}
    if window.rest().len() < length {
        return fail("the file ends");
    }
    let text = String::from_utf8_lossy(&window.rest()[..length]).into_owned();
    window.at += length;
    Ok(text)
}

/// Calls `take` for so many numbers.
fn numbers(
    window: &mut Window<'_>,
    scan: &FileScan,
    item: Item,
    count: usize,
    mut take: impl FnMut(f64),
) -> Result<()> {
    let size = item.size();
    let mut done = 0;
    while done < count {
        if !window.ensure(size) {
            return Err(Error::format(&scan.path, format!("number {done} of {count}"), "the file ends"));
        }
        let some = (window.rest().len() / size).min(count - done);
        window.rest()[..some * size].chunks_exact(size).for_each(|bytes| take(item.value(bytes)));
        window.at += some * size;
        done += some;
    }
    Ok(())
}

/// The text behind a key of a header.
fn after<'h>(header: &'h str, key: &str) -> Option<&'h str> {
    let at = header.find(&format!("'{key}'")).or_else(|| header.find(&format!("\"{key}\"")))?;
    Some(header[at + key.len() + 2..].trim_start().strip_prefix(':')?.trim_start())
}

/// The type of the numbers as NumPy writes it, where it is one.
fn descr(header: &str) -> Option<&str> {
    let descr = after(header, "descr")?;
    let quote = descr.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    descr[1..].split(quote).next()
}

/// The values of a header.
struct Array {
    item: Item,
    fortran_order: bool,
    shape: Vec<u64>,
}

impl Array {
    /// Reads Python's literal of a dict.
    fn parse(header: &str) -> Option<Self> {
        let item = Item::parse(descr(header)?)?;
        let order = after(header, "fortran_order")?;
        let fortran_order = order.starts_with("True");
        if !fortran_order && !order.starts_with("False") {
            return None;
        }
        let shape = after(header, "shape")?.strip_prefix('(')?.split(')').next()?;
        let sizes = shape.split(',').map(str::trim).filter(|size| !size.is_empty());
        let shape = sizes.map(|size| size.trim_end_matches('L').parse().ok()).collect::<Option<Vec<u64>>>()?;
        Some(Array { item, fortran_order, shape })
    }
}

/// Type of the numbers.
#[derive(Clone, Copy)]
struct Item {
    kind: u8,
    size: u8,
    big_endian: bool,
}

impl Item {
    fn parse(descr: &str) -> Option<Self> {
        let bytes = descr.as_bytes();
        let (big_endian, rest) = match bytes.first()? {
            b'<' | b'|' | b'=' => (false, &bytes[1..]),
            b'>' => (true, &bytes[1..]),
            _ => (false, bytes),
        };
        let &[kind, size] = rest else { return None };
        let size = size.wrapping_sub(b'0');
        let known = matches!((kind, size), (b'f', 2 | 4 | 8) | (b'u' | b'i', 1 | 2 | 4 | 8) | (b'b', 1));
        known.then_some(Item { kind, size, big_endian })
    }

    fn size(self) -> usize {
        self.size.into()
    }

    fn is_real(self) -> bool {
        self.kind == b'f'
    }

    fn numbers(self) -> Numbers {
        match (self.kind, self.size) {
            (b'f', _) => Numbers::Real,
            (b'u', 2) => Numbers::Whole(65535),
            _ => Numbers::Whole(255),
        }
    }

    #[inline(always)]
    fn value(self, bytes: &[u8]) -> f64 {
        let mut raw = [0; 8];
        raw[..bytes.len()].copy_from_slice(bytes);
        if self.big_endian {
            raw[..bytes.len()].reverse();
        }
        let bits = u64::from_le_bytes(raw);
        match (self.kind, self.size) {
            (b'f', 2) => f16::from_bits(bits as u16).to_f64(),
            (b'f', 4) => f32::from_bits(bits as u32).into(),
            (b'f', _) => f64::from_bits(bits),
            (b'i', 1) => f64::from(bits as u8 as i8),
            (b'i', 2) => f64::from(bits as u16 as i16),
            (b'i', 4) => f64::from(bits as u32 as i32),
            (b'i', _) => bits as i64 as f64,
            _ => bits as f64,
        }
    }
}
