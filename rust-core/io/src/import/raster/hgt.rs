//! SRTM tiles: 1201 x 1201 or 3601 x 3601 heights in metres over one degree, big-endian, -32768 for voids. Size and place
//! are in no header: the number of bytes gives the one, a name like `N37E014` the other.

use super::super::file::{Input, reserve};
use super::super::scan::{Content, FileScan};
use super::super::window::Window;
use super::content::{Numbers, Place, Raster};
use base::error::{Error, Result};
use base::progress::Progress;

/// Nothing marks such a file but its name's ending.
pub(in super::super) fn sniff(_: &[u8]) -> bool {
    false
}

pub(in super::super) fn parse(
    input: &mut dyn Input,
    length: u64,
    scan: &FileScan,
    _: &Progress<'_>,
) -> Result<Content> {
    let side = (length / 2).isqrt();
    if !length.is_multiple_of(2) || side * side * 2 != length || side < 2 {
        let problem = format!("{length} bytes must be a square of 2-byte heights (1201 x 1201 or 3601 x 3601)");
        return Err(Error::format(&scan.path, "whole file", problem));
    }
    let mut window = Window::new(input, length);
    let side = side as usize;
    let mut values = reserve(side * side, &scan.path)?;
    while values.len() < side * side {
        if !window.ensure(2) {
            let problem = "the file became shorter while it was read";
            let at = format!("byte {}", window.offset(window.at));
            return Err(window
                .failure()
                .map_or_else(|| Error::format(&scan.path, at, problem), |e| Error::io(&scan.path, e)));
        }
        let (heights, _) = window.rest().as_chunks::<2>();
        let count = heights.len().min(side * side - values.len());
        values.extend(heights[..count].iter().map(|&h| match i16::from_be_bytes(h) {
            i16::MIN => f64::NAN,
            height => f64::from(height),
        }));
        window.at += 2 * count;
    }
    let step = 1.0 / (side - 1) as f64;
    let (latitude, longitude) = corner(&scan.name).unwrap_or((0.0, 0.0));
    let place = Place { first: [longitude, latitude + 1.0], step: [step, -step], degrees: true };
    Raster { rows: side, cols: side, values, numbers: Numbers::Metres, place: Some(place) }.into_content(scan)
}

/// Latitude and longitude of the south-west corner, out of a name like `N37E014`.
fn corner(name: &str) -> Option<(f64, f64)> {
    let signed = |text: &str, positive: char, negative: char| -> Option<f64> {
        let sign = match text.chars().next()?.to_ascii_uppercase() {
            c if c == positive => 1.0,
            c if c == negative => -1.0,
            _ => return None,
        };
        text.get(1..)?.parse::<u16>().ok().map(|degrees| sign * f64::from(degrees))
    };
    let latitude = signed(name.get(..3)?, 'N', 'S').filter(|l| l.abs() <= 90.0)?;
    let longitude = signed(name.get(3..7)?, 'E', 'W').filter(|l| l.abs() <= 180.0)?;
    Some((latitude, longitude))
}

#[cfg(test)]
mod tests {
    #[test]
    fn names_have_corners() {
        assert_eq!(super::corner("N37E014"), Some((37.0, 14.0)));
        assert_eq!(super::corner("s05w110 (2)"), Some((-5.0, -110.0)));
        for name in ["", "N37", "X37E014", "N3é", "N99E014", "N37E999", "etna1201"] {
            assert_eq!(super::corner(name), None, "{name}");
        }
    }
}
