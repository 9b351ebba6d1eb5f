//! ESRI ASCII grids: `ncols`, `nrows`, the lower left corner or centre, `cellsize`, `nodata_value`, then the heights row
//! by row from the north.

use super::super::file::{Input, reserve};
use super::super::scan::{Content, FileScan};
use super::super::text::Lines;
use super::bounds::stored_pixels;
use super::content::{Numbers, Place, Raster};
use base::error::Result;
use base::progress::Progress;

pub(in super::super) fn sniff(start: &[u8]) -> bool {
    let start = start.trim_ascii_start();
    let begins = |word: &[u8]| {
        start.get(..word.len()).is_some_and(|s| s.eq_ignore_ascii_case(word))
            && start.get(word.len()).is_none_or(u8::is_ascii_whitespace)
    };
    begins(b"ncols") || begins(b"nrows")
}

pub(in super::super) fn parse(
    input: &mut dyn Input,
    length: u64,
    scan: &FileScan,
    _: &Progress<'_>,
) -> Result<Content> {
    let mut lines = Lines::new(input, length, &scan.path);
    let (mut size, mut first, mut step, mut no_data) = ([None; 2], [None; 2], [None; 2], -9999.0);
    loop {
        if !lines.next_content()? {
            return Err(lines.ends("heights"));
        }
        let key = String::from_utf8_lossy(lines.word()).to_ascii_lowercase();
        match key.as_str() {
            "ncols" => size[0] = Some(lines.count("the number of columns")?),
            "nrows" => size[1] = Some(lines.count("the number of rows")?),
            "xllcorner" => first[0] = Some((lines.f64("x of the lower left corner")?, 0.5)),
            "yllcorner" => first[1] = Some((lines.f64("y of the lower left corner")?, 0.5)),
            "xllcenter" => first[0] = Some((lines.f64("x of the lower left centre")?, 0.0)),
            "yllcenter" => first[1] = Some((lines.f64("y of the lower left centre")?, 0.0)),
            "cellsize" => step = [Some(lines.f64("the cell size")?); 2],
            "dx" => step[0] = Some(lines.f64("the cell size")?),
            "dy" => step[1] = Some(lines.f64("the cell size")?),
            "nodata_value" => no_data = lines.f64("the value without data")?,
            _ => {
                lines.rewind();
                break;
            }
        }
    }
    let ([Some(cols), Some(rows)], [Some(dx), Some(dy)]) = (size, step) else {
        return Err(lines.fail("the header needs ncols, nrows and cellsize"));
    };
    if !(dx > 0.0 && dy > 0.0 && dx.is_finite() && dy.is_finite()) {
        return Err(lines.fail(format!("cellsize must be finite and > 0, got {dx} and {dy}")));
    }
    // A height and a blank each; the first line is already behind.
    let left = lines.left()? + lines.rest().len() as u64 + 1;
    let count = stored_pixels(rows, cols, 2, left, scan, "header")?;
    let mut values: Vec<f64> = reserve(count, &scan.path)?;
    while values.len() < count {
        while lines.is_done() {
            let what = format!("height {} of {count}", values.len());
            lines.expect_line(&what)?;
        }
        let height = lines.f64("a height")?;
        values.push(if height == no_data { f64::NAN } else { height });
    }
    if !lines.is_done() || lines.next_content()? {
        return Err(lines.expected("the end: there are more heights than ncols x nrows"));
    }
    let place = match first {
        [Some((x, half_x)), Some((y, half_y))] => Some(Place {
            first: [x + half_x * dx, y + half_y * dy + dy * (rows - 1) as f64],
            step: [dx, -dy],
            degrees: false,
        }),
        _ => Some(Place { first: [0.0, dy * (rows - 1) as f64], step: [dx, -dy], degrees: false }),
    };
    let (rows, cols) = (rows as usize, cols as usize);
    Raster { rows, cols, values, numbers: Numbers::Metres, place }.into_content(scan)
}
