//! Numbers of an image as a range image: heights seen from above, or depths seen by a camera.

use glam::{DAffine3, DVec3};

use super::super::options::ReadOptions;
use super::super::scan::{Content, FileScan};
use base::error::{Error, Result};
use base::log::{self, Level};
use image::range_image::{Projection, RangeImage, far, repeats};

/// An image of numbers as its file has them, row by row from the top. NaN where the file has none.
pub(in crate::import) struct Raster {
    pub(in crate::import) rows: usize,
    pub(in crate::import) cols: usize,
    pub(in crate::import) values: Vec<f64>,
    pub(in crate::import) numbers: Numbers,
    pub(in crate::import) place: Option<Place>,
}

/// The kind of numbers that a file holds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in crate::import) enum Numbers {
    /// Whole, up to this one, which from 65535 on is no depth.
    Whole(u32),
    /// Floats.
    Real,
    /// Heights in metres, whatever stored them.
    Metres,
}

/// The place of a height map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::import) struct Place {
    /// x and y of the centre of the upper left pixel.
    pub(super) first: [f64; 2],
    /// x from column to column, y from row to row, as the file has them: y is negative for maps with north up.
    pub(super) step: [f64; 2],
    /// Whether they are degrees.
    pub(super) degrees: bool,
}

impl Raster {
    /// The image as the scan's options understand it.
    pub(super) fn into_content(mut self, scan: &FileScan) -> Result<Content> {
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
                return fail(format!(
                    "{cols} x {rows} pixels, but the camera's images have {width} x {height}: open it apart from them, \
                        with a camera of its own"
                ));
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
