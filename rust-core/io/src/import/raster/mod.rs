//! Images of numbers: height maps seen from above, depth images seen by a camera.
//!
//! | file | what |
//! |---|---|
//! | `hgt` | SRTM tiles: big-endian metres, -32768 for voids |
//! | `png` | 8 and 16 bit grey, terrain RGB |
//! | `pgm`, `pfm` | portable grey and float maps |
//! | `tiff` | whole numbers and floats, any layout the decoder knows; GeoTIFF's place and no-data value |
//! | `exr` | the depth channel, Blender's Z pass |
//! | `esri` | ESRI ASCII grids |
//! | `npy` | NumPy arrays of two dimensions; of points |
//! | `content` | numbers of any of them as a range image |
//! | `bounds` | sizes that no file can have |
//!
//! *Depth images.* With a camera a pixel is a depth. A stored 0, and 65535 of 16 bit, mean that nothing was measured. Whole numbers are
//! millimetres unless a scale is given.
//!
//! *Height maps.* Without a camera a pixel is a height, rows run from north to south. The lower left pixel lies at the origin of the
//! sensor's frame, and the place on earth, if the file has one, is in the pose, in double precision. Degrees become metres along the
//! parallel and the meridian in the middle of the map (WGS 84).
//!
//! Cost: one pass. The result (8 bytes per pixel) and one row or chunk beside it.

mod bounds;
mod content;
pub(super) mod esri;
pub(super) mod exr;
pub(super) mod hgt;
pub(super) mod npy;
pub(super) mod pfm;
pub(super) mod pgm;
pub(super) mod png;
pub(super) mod tiff;

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use super::file::{self, watched};
use super::scan::FileScan;
use super::window::Window;
use base::error::{Error, Result};
use base::progress::Progress;

pub(super) use content::{Numbers, Raster};

/// Bytes of an image that hold its header.
const HEADER: usize = 256;

/// A note where images of 16 bits, as depth cameras write them, were opened without a camera. One alone is a height map more often.
/// Whoever gives the distance of their pixels knows that they are height maps. Otherwise they can't be aligned.
pub(super) fn note_without_camera(scans: &mut [FileScan]) -> Result<Option<String>> {
    let is_of = |scan: &FileScan, ending: &str| {
        let own = scan.path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
        own && scan.options.camera.is_none() && scan.options.step.is_none() && !scan.is_frame()
    };
    for ending in ["png", "pgm"] {
        let images: Vec<usize> = (0..scans.len()).filter(|&k| is_of(&scans[k], ending)).collect();
        if let [first, _, ..] = *images
            && header_of(&scans[first].path).is_some_and(|header| header.is_grey && header.bits == 16)
        {
            let count = images.len();
            let remedy = "If they are depth images, give it as camera = (fx, fy, cx, cy). Or put a camera.json with fx, \
                fy, cx, cy beside them";
            let doubt: Arc<str> = format!(
                "{count} images of 16 bits may be depth images or height maps, since no camera is given. {remedy}. If \
                    they are height maps, give the distance of their pixels as step."
            )
            .into();
            images.into_iter().for_each(|k| scans[k].doubt = Some(doubt.clone()));
            return Ok(Some(format!(
                "{count} images of 16 bits are read as height maps, since no camera is given. {remedy}."
            )));
        }
    }
    Ok(None)
}

/// Header of a PNG or PGM.
pub(super) struct Header {
    /// Columns and rows.
    pub(super) size: [usize; 2],
    /// Bits of a number.
    pub(super) bits: u8,
    pub(super) is_grey: bool,
}

/// The header of a PNG or PGM. `None` for other files, and for one that can't be read.
pub(super) fn header_of(path: &Path) -> Option<Header> {
    let start = file::read_start(path, HEADER).ok()?.0;
    if png::sniff(&start) {
        let side = |at: usize| Some(u32::from_be_bytes(start.get(at..at + 4)?.try_into().ok()?) as usize);
        let (bits, colour) = (*start.get(24)?, *start.get(25)?);
        return Some(Header { size: [side(16)?, side(20)?], bits, is_grey: matches!(colour, 0 | 4) });
    }
    if !pgm::sniff(&start) {
        return None;
    }
    let text = String::from_utf8_lossy(&start);
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let mut numbers = lines.flat_map(str::split_ascii_whitespace).skip(1).map_while(|word| word.parse::<usize>().ok());
    let (size, most) = ([numbers.next()?, numbers.next()?], numbers.next()?);
    Some(Header { size, bits: if most > 255 { 16 } else { 8 }, is_grey: true })
}

/// The numbers of an image of a frame, in any of the formats that cameras write.
pub(super) fn numbers(bytes: &[u8], scan: &FileScan, progress: &Progress<'_>) -> Result<Raster> {
    let length = bytes.len() as u64;
    let input = &mut Cursor::new(bytes);
    if png::sniff(bytes) {
        watched(input, &scan.path, |input| png::read(input, length, scan, progress))
    } else if exr::sniff(bytes) {
        watched(input, &scan.path, |input| exr::read(input, length, scan, progress))
    } else if tiff::sniff(bytes) {
        watched(input, &scan.path, |input| tiff::read(input, length, scan, progress))
    } else if pgm::sniff(bytes) {
        pgm::read(&mut Window::new(input, length), scan)
    } else if npy::sniff(bytes) {
        npy::raster(&mut Window::new(input, length), scan)
    } else {
        let problem = "an image of depths must be a PNG, OpenEXR, TIFF, PGM or NumPy file";
        Err(Error::format(&scan.path, "start of file", problem))
    }
}

#[cfg(test)]
mod tests;
