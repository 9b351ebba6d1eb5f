//! Portable float maps: `Pf`, width, height, a scale whose sign is the byte order. Rows go from the bottom up.

use super::super::file::{Input, reserve};
use super::super::scan::{Content, FileScan};
use super::super::text::Lines;
use super::bounds::stored_pixels;
use super::content::{Numbers, Raster};
use base::error::{Error, Result};
use base::progress::Progress;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    matches!(start, [b'P', b'f' | b'F', next, ..] if next.is_ascii_whitespace())
}

pub(in super::super) fn parse(
    input: &mut dyn Input,
    length: u64,
    scan: &FileScan,
    _: &Progress<'_>,
) -> Result<Content> {
    let path = &scan.path;
    let mut lines = Lines::new(input, length, path);
    // Word after word: they may share lines.
    let mut words = Vec::new();
    while words.len() < 4 {
        if lines.is_done() && !lines.next_line()? {
            return Err(lines.ends("Pf, width, height and scale"));
        }
        let word: String = String::from_utf8_lossy(lines.word()).chars().take(40).collect();
        if !word.is_empty() {
            words.push(word);
        }
    }
    match words[0].as_str() {
        "Pf" => {}
        "PF" => return Err(lines.fail("a float map of three colours: only grey ones (Pf) hold heights or depths")),
        _ => return Err(lines.fail("a float map must start with Pf")),
    }
    let (Ok(cols), Ok(rows)) = (words[1].parse::<u32>(), words[2].parse::<u32>()) else {
        return Err(lines.fail(format!("expected width and height, found `{}` and `{}`", words[1], words[2])));
    };
    let scale: f64 =
        words[3].parse().ok().filter(|s: &f64| s.is_finite() && *s != 0.0).ok_or_else(|| {
            lines.fail(format!("expected the scale, negative for little-endian, found `{}`", words[3]))
        })?;
    let (rows, cols) = (rows as usize, cols as usize);
    let count = stored_pixels(rows as u64, cols as u64, 4, lines.left()?, scan, "header")?;
    let mut window = lines.into_window();
    let mut values: Vec<f64> = reserve(count, path)?;
    while values.len() < count {
        if !window.ensure(4) {
            let at = format!("pixel {} of {count}", values.len());
            return Err(window
                .failure()
                .map_or_else(|| Error::format(path, at, "the file ends"), |e| Error::io(path, e)));
        }
        let before = values.len();
        let floats = window.rest().as_chunks::<4>().0.iter().take(count - before);
        // The magnitude of the scale is a unit that few writers mean; it is 1 in most files.
        let unit = scale.abs();
        if scale < 0.0 {
            values.extend(floats.map(|&v| f64::from(f32::from_le_bytes(v)) * unit));
        } else {
            values.extend(floats.map(|&v| f64::from(f32::from_be_bytes(v)) * unit));
        }
        window.at += 4 * (values.len() - before);
    }
    for row in 0..rows / 2 {
        let (upper, lower) = values.split_at_mut((rows - 1 - row) * cols);
        upper[row * cols..(row + 1) * cols].swap_with_slice(&mut lower[..cols]);
    }
    Raster { rows, cols, values, numbers: Numbers::Real, place: None }.into_content(scan)
}
