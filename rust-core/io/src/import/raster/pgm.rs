//! Portable grey maps: `P5` with 8 bits or big-endian 16 bits, `P2` in text. A comment starts with #.

use super::super::file::{Input, reserve};
use super::super::scan::{Content, FileScan};
use super::super::window::Window;
use super::bounds::stored_pixels;
use super::content::{Numbers, Raster};
use base::error::{Error, Result};
use base::progress::Progress;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    matches!(start, [b'P', b'5' | b'2', next, ..] if next.is_ascii_whitespace() || *next == b'#')
}

pub(in super::super) fn parse(
    input: &mut dyn Input,
    length: u64,
    scan: &FileScan,
    _: &Progress<'_>,
) -> Result<Content> {
    let mut window = Window::new(input, length);
    let raster = read(&mut window, scan);
    window.failure().map_or(raster, |error| Err(Error::io(&scan.path, error)))?.into_content(scan)
}

pub(super) fn read(window: &mut Window<'_>, scan: &FileScan) -> Result<Raster> {
    if !window.ensure(3) || !sniff(window.rest()) {
        return Err(Error::format(&scan.path, "start of file", "a grey map must start with P5 or P2"));
    }
    let text = window.rest()[1] == b'2';
    window.at += 2;
    let cols = whole(window, scan, "the width")?;
    let rows = whole(window, scan, "the height")?;
    let most = whole(window, scan, "the largest value")?;
    if !(1..=65535).contains(&most) {
        return Err(fail(window, scan, &format!("the largest value must be 1 to 65535, got {most}")));
    }
    // One blank ends the header.
    window.at += usize::from(window.ensure(1));
    let bytes = if text { 2 } else { 1 + u64::from(most > 255) };
    // The last number of a text needs no blank after it.
    let count = stored_pixels(rows, cols, bytes, window.left() + u64::from(text), scan, "header")?;
    let mut values: Vec<f64> = reserve(count, &scan.path)?;
    while values.len() < count {
        if text {
            let value = whole(window, scan, &format!("pixel {} of {count}", values.len()))?;
            if value > most {
                return Err(fail(window, scan, &format!("pixel {} is {value}, more than {most}", values.len())));
            }
            values.push(value as f64);
            continue;
        }
        if !window.ensure(bytes as usize) {
            return Err(fail(window, scan, "the file ends"));
        }
        let (rest, wanted) = (window.rest(), count - values.len());
        let before = values.len();
        if bytes == 1 {
            values.extend(rest.iter().take(wanted).map(|&v| f64::from(v)));
        } else {
            values.extend(rest.as_chunks::<2>().0.iter().take(wanted).map(|&v| f64::from(u16::from_be_bytes(v))));
        }
        window.at += (values.len() - before) * bytes as usize;
    }
    Ok(Raster { rows: rows as usize, cols: cols as usize, values, numbers: Numbers::Whole(most as u32), place: None })
}

/// The next whole number, past blanks and comments.
fn whole(window: &mut Window<'_>, scan: &FileScan, what: &str) -> Result<u64> {
    let mut in_comment = false;
    loop {
        if !window.ensure(1) {
            return Err(fail(window, scan, &format!("expected {what}, but the file ends")));
        }
        match window.rest()[0] {
            b'\n' | b'\r' => in_comment = false,
            _ if in_comment => {}
            b'#' => in_comment = true,
            byte if byte.is_ascii_whitespace() => {}
            _ => break,
        }
        window.at += 1;
    }
    window.ensure(20);
    let digits = window.rest().iter().take(10).take_while(|byte| byte.is_ascii_digit()).count();
    if digits == 0 || digits > 9 {
        return Err(fail(window, scan, &format!("expected {what}, a whole number")));
    }
    let value = window.rest()[..digits].iter().fold(0, |value, digit| 10 * value + u64::from(digit - b'0'));
    window.at += digits;
    Ok(value)
}

fn fail(window: &Window<'_>, scan: &FileScan, problem: &str) -> Error {
    Error::format(&scan.path, format!("byte {}", window.offset(window.at)), problem)
}
