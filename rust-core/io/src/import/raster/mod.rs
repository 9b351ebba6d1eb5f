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
//!
//! *Depth images.* With a camera a pixel is a depth. A stored 0, and 65535 of 16 bit, mean that nothing was measured. Whole numbers are
//! millimetres unless a scale is given.
//!
//! *Height maps.* Without a camera a pixel is a height, rows run from north to south. The lower left pixel lies at the origin of the
//! sensor's frame, and the place on earth, if the file has one, is in the pose, in double precision. Degrees become metres along the
//! parallel and the meridian in the middle of the map (WGS 84).
//!
//! Cost: one pass. The result (8 bytes per pixel) and one row or chunk beside it.

pub(super) mod esri;
pub(super) mod exr;
pub(super) mod hgt;
pub(super) mod npy;
pub(super) mod pfm;
pub(super) mod pgm;
pub(super) mod png;
pub(super) mod tiff;

use std::io::Cursor;

use glam::{DAffine3, DVec3};

use super::file::{self, watched};
use super::options::ReadOptions;
use super::scan::{Content, FileScan};
use super::window::Window;
use base::error::{Error, Result};
use base::log::{self, Level};
use base::progress::Progress;
use image::range_image::{Projection, RangeImage, far, repeats};

/// An image of numbers as its file has them, row by row from the top. NaN where the file has none.
pub(super) struct Raster {
    pub(super) rows: usize,
    pub(super) cols: usize,
    pub(super) values: Vec<f64>,
    pub(super) numbers: Numbers,
    pub(super) place: Option<Place>,
}

/// The kind of numbers that a file holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Numbers {
    /// Whole, up to this one, which from 65535 on is no depth.
    Whole(u32),
    /// Floats.
    Real,
    /// Heights in metres, whatever stored them.
    Metres,
}

/// The place of a height map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    /// x and y of the centre of the upper left pixel.
    first: [f64; 2],
    /// x from column to column, y from row to row, as the file has them: y is negative for maps with north up.
    step: [f64; 2],
    /// Whether they are degrees.
    degrees: bool,
}

/// Bytes of an image that say how many bits it has.
const HEADER: usize = 256;

/// A note where images of 16 bits, as depth cameras write them, were opened without a camera. One alone is a height map more often.
pub(super) fn note_without_camera(scans: &[FileScan]) -> Result<Option<String>> {
    let of_kind = |ending: &str| -> Vec<&FileScan> {
        let is_one = |scan: &&FileScan| {
            let own = scan.path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending));
            own && scan.options.camera.is_none() && !scan.is_frame()
        };
        scans.iter().filter(is_one).collect()
    };
    for ending in ["png", "pgm"] {
        let images = of_kind(ending);
        if let [first, _, ..] = images.as_slice()
            && has_sixteen_bits(&file::read_start(&first.path, HEADER)?.0)
        {
            return Ok(Some(format!(
                "{} images of 16 bits are read as height maps, since no camera is given. If they are depth images, \
                    give it as camera = (fx, fy, cx, cy). Or put a camera.json with fx, fy, cx, cy beside them.",
                images.len()
            )));
        }
    }
    Ok(None)
}

/// Whether the start of a PNG or PGM is of grey of 16 bits.
fn has_sixteen_bits(start: &[u8]) -> bool {
    if png::sniff(start) {
        return start.get(24..26) == Some(&[16, 0]);
    }
    let text = String::from_utf8_lossy(start);
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let most = lines.flat_map(str::split_ascii_whitespace).nth(3).and_then(|most| most.parse::<u32>().ok());
    text.starts_with("P5") && most.is_some_and(|most| most > 255)
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

impl Raster {
    /// The image as the scan's options understand it.
    fn into_content(mut self, scan: &FileScan) -> Result<Content> {
        let options: &ReadOptions = &scan.options;
        let fail = |problem: String| Err(Error::format(&scan.path, "whole image", problem));
        let whole = matches!(self.numbers, Numbers::Whole(_));
        let scale = options.scale.unwrap_or(if whole && options.camera.is_some() { 0.001 } else { 1.0 });
        let invalid = options.invalid.unwrap_or(f64::NAN);
        let saturated = match (self.numbers, options.camera) {
            (Numbers::Whole(most), Some(_)) if most >= 65535 => f64::from(most),
            _ => f64::NAN,
        };
        let offset = options.offset;
        let as_stored = scale == 1.0 && offset == 0.0 && invalid.is_nan() && saturated.is_nan();
        if !as_stored {
            for value in &mut self.values {
                let is_mark = (*value == invalid) | (*value == saturated);
                *value = if is_mark { f64::NAN } else { *value * scale + offset };
            }
        }
        let (rows, cols) = (self.rows, self.cols);
        let mut translation = DVec3::ZERO;
        let projection = if let Some(camera) = options.camera {
            if camera.size.is_some_and(|size| size != [cols, rows]) {
                let [width, height] = camera.size.unwrap_or_default();
                return fail(format!("{cols} x {rows} pixels, but the camera's images have {width} x {height}"));
            }
            camera.projection(options.depth)
        } else {
            let place = self.place.map(|place| if place.degrees { place.in_metres(rows) } else { place });
            let step = match (options.step, place) {
                (Some(step), _) => [step, -step],
                (None, Some(place)) => place.step,
                (None, None) => [1.0, -1.0],
            };
            // The lower left pixel of a map with north up is the origin; others keep their upper left one there.
            let last = (rows.max(1) - 1) as f64;
            let first = [0.0, if step[1] < 0.0 { -step[1] * last } else { 0.0 }];
            if let Some(place) = place {
                translation = DVec3::new(place.first[0] - first[0], place.first[1] - first[1], 0.0);
            }
            Projection::Orthographic { first, step }
        };
        if !translation.is_finite() {
            return fail("the map's place is not a finite number".to_owned());
        }
        let mut image = RangeImage::from_values(rows, cols, self.values, projection)
            .map_err(|error| Error::format(&scan.path, "whole image", error.to_string()))?;
        if let Some(own_size) = repeats::undone(&image) {
            let words = repeats::in_words(&image, [own_size.cols(), own_size.rows()]);
            log::tell(Level::Info, &format!("{}: {words}", scan.name));
            image = own_size;
        }
        if let Some(far) = far::leave_out(&mut image) {
            log::tell(Level::Warning, &format!("{}: {}", scan.name, far.in_words()));
        }
        image.name = scan.name.clone();
        image.world_from_sensor = scan.world_from_sensor * DAffine3::from_translation(translation);
        Ok(Content::RangeImage(image))
    }
}

impl Place {
    /// Degrees as metres from the map's own corner: its place on earth is then no plane one, so it starts at 0.
    fn in_metres(self, rows: usize) -> Place {
        let latitude = self.first[1] + self.step[1] * (rows.max(1) - 1) as f64 / 2.0;
        let [east, north] = metres_per_degree(latitude);
        let step = [self.step[0] * east, self.step[1] * north];
        Place { first: [0.0, (-step[1]).max(0.0) * (rows.max(1) - 1) as f64], step, degrees: false }
    }
}

/// Metres per degree of longitude and of latitude on the WGS 84 ellipsoid.
fn metres_per_degree(latitude: f64) -> [f64; 2] {
    const AXIS: f64 = 6_378_137.0;
    const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;
    let (sin, cos) = latitude.to_radians().sin_cos();
    let w = 1.0 - ECCENTRICITY_SQUARED * sin * sin;
    [AXIS * cos / w.sqrt(), AXIS * (1.0 - ECCENTRICITY_SQUARED) / (w * w.sqrt())].map(f64::to_radians)
}

/// The pixels of an image, refused where a file of so many bytes can't hold them, each of `bytes`.
fn stored_pixels(rows: u64, cols: u64, bytes: u64, left: u64, scan: &FileScan, at: &str) -> Result<usize> {
    let needed = rows.checked_mul(cols).and_then(|pixels| pixels.checked_mul(bytes));
    match needed {
        Some(needed) if needed <= left && needed > 0 => Ok((needed / bytes) as usize),
        Some(0) => {
            Err(Error::format(&scan.path, at, format!("an image of {cols} x {rows} pixels must have at least one")))
        }
        _ => {
            let problem = format!("{cols} x {rows} pixels of {bytes} bytes are more than the {left} bytes that follow");
            Err(Error::format(&scan.path, at, problem))
        }
    }
}

/// The pixels of a compressed image, refused where they unpack to more than the options allow.
fn packed_pixels(rows: u64, cols: u64, scan: &FileScan) -> Result<usize> {
    let limit = scan.options.max_decoded_bytes();
    let bytes = rows.checked_mul(cols).and_then(|pixels| pixels.checked_mul(8));
    match bytes {
        Some(bytes) if bytes <= limit && bytes > 0 => Ok((bytes / 8) as usize),
        Some(0) => Err(Error::format(
            &scan.path,
            "header",
            format!("an image of {cols} x {rows} pixels must have at least one"),
        )),
        _ => Err(Error::format(
            &scan.path,
            "header",
            format!(
                "{cols} x {rows} pixels would take more than max_decoded_gib = {} GiB: raise it if the file is to be trusted",
                scan.options.max_decoded_gib
            ),
        )),
    }
}

/// Refuses an image that can't be in a file of so many bytes: `most` is what one of them can become by the compression, and
/// `bytes` what the pixels take unpacked.
fn can_be_in(length: u64, bytes: u64, most: u64, scan: &FileScan) -> Result<()> {
    if bytes <= length.saturating_mul(most) {
        return Ok(());
    }
    let problem = format!("its {bytes} bytes of pixels can't be in a file of {length} bytes: it is damaged or cut off");
    Err(Error::format(&scan.path, "header", problem))
}

/// Bytes that one byte can become by deflate: 258 bytes for two bits.
const DEFLATED: u64 = 1032;

#[cfg(test)]
mod tests;
