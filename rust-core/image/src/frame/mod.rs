//! Frames: what a depth camera recorded at one moment, and the range image with colours that it becomes.
//!
//! | file | what |
//! |---|---|
//! | `camera` | pinhole cameras, and the same camera for images of another size |
//! | `colour_image` | images of such a camera |
//! | `look_up` | the colour of each sample: through its point, with a test of occlusion |
//! | `rim` | the black rim that undistorting leaves around an image |
//!
//! Depth is never resampled. A colour image keeps its own size and its own camera. A confidence image its own size.

mod camera;
mod colour_image;
mod look_up;
mod rim;

pub use camera::Camera;
pub use colour_image::ColourImage;
pub use rim::without_rim;

use glam::{DAffine3, DMat3, DVec3};

use crate::range_image::{DepthKind, Projection, RangeImage, far, repeats};
use base::error::{Error, Result};
use base::progress::Progress;

/// Turns cameras with y up that look along -z, as OpenGL's and ARKit's, into those with y down that look along z, and back:
/// put behind a pose of the one it makes one of the other.
pub const TURNED: DAffine3 =
    DAffine3 { matrix3: DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z), translation: DVec3::ZERO };

/// A recording of a depth camera at one moment: as it was recorded, nothing left out yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// The depths with their camera, pose and name. x is to the right, y down, z forward.
    pub depth: RangeImage,
    /// The image of a camera of its own.
    pub colour: Option<ColourImage>,
    /// Confidence of the sensor itself in its depths.
    pub confidence: Option<ConfidenceImage>,
    /// Samples further than this along z are guesses of the sensor's. `None` for a sensor without such a limit.
    pub reach: Option<f64>,
}

/// Confidence of a sensor in its depths, in the levels of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfidenceImage {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Levels, row by row from the upper left.
    pub levels: Vec<u8>,
    /// Samples of a lower level than this are left out.
    pub least: u8,
}

base::report! {
    /// Samples that were left out of a frame, or of several, each counted for the first reason that it has.
    #[derive(Copy, Default, Eq)]
    pub struct LeftOutReport {
        /// Samples that were measured.
        of: usize = count("Samples measured"),
        /// Those of too low a confidence.
        low_confidence: usize = count("Of low confidence"),
        /// Those beyond the reach of the sensor.
        out_of_reach: usize = count("Out of reach"),
        /// Those seen through the black rim of the colour image.
        black_rim: usize = count("In the black rim"),
        /// Those far beyond all others of their frame, which stand for no measurement.
        far: usize = count("Far beyond all others"),
    }
    besides {
        /// Columns and rows of the depth image as it was recorded and as it is taken, where it was enlarged by repeating pixels.
        enlarged: Option<[[usize; 2]; 2]>,
    }
}

/// The former name of [`LeftOutReport`].
#[deprecated(since = "0.2.0", note = "it is LeftOutReport")]
pub type LeftOut = LeftOutReport;

impl LeftOutReport {
    /// Both together.
    pub fn add(&mut self, other: &LeftOutReport) {
        self.of += other.of;
        self.low_confidence += other.low_confidence;
        self.out_of_reach += other.out_of_reach;
        self.black_rim += other.black_rim;
        self.far += other.far;
        self.enlarged = self.enlarged.or(other.enlarged);
    }

    /// A sentence for people. `None` if nothing was left out.
    pub fn in_words(&self) -> Option<String> {
        let parts = [
            (self.low_confidence, "of low confidence"),
            (self.out_of_reach, "beyond the sensor's reach"),
            (self.black_rim, "in the black rim of the colour image"),
            (self.far, "far beyond all others"),
        ];
        let share = |count: usize| format!("{:.1} %", 100.0 * count as f64 / self.of.max(1) as f64);
        let parts: Vec<String> =
            parts.iter().filter(|part| part.0 > 0).map(|(count, why)| format!("{} {why}", share(*count))).collect();
        let left_out = (!parts.is_empty()).then(|| format!("left out of the samples: {}", parts.join(", ")));
        let enlarged = self.enlarged.map(|[from, to]| {
            let ([cols, rows], [own_cols, own_rows]) = (from, to);
            format!("{cols} x {rows} pixels of depth are {own_cols} x {own_rows} pixels, repeated, and are taken in that size")
        });
        let said: Vec<String> = enlarged.into_iter().chain(left_out).collect();
        (!said.is_empty()).then(|| said.join("; "))
    }
}

impl Frame {
    /// A frame that has depths alone.
    pub fn new(depth: RangeImage) -> Self {
        Frame { depth, colour: None, confidence: None, reach: None }
    }

    /// The range image with what can be trusted, and a colour for each sample that the colour camera sees. Alpha is 0 for other samples,
    /// which lie outside of its image or behind a nearer one. Also what was left out.
    ///
    /// Confidences of the image stay empty: the sensor's levels say what to leave out, the geometry what to trust more.
    ///
    /// Cost: O(samples) beside the black rim, one pass of the colour image's border.
    ///
    /// # Errors
    /// Images whose number of pixels is not their size's. [`Error::Cancelled`].
    pub fn into_range_image(self, progress: &Progress<'_>) -> Result<(RangeImage, LeftOutReport)> {
        self.validate()?;
        let Frame { mut depth, colour, confidence, reach } = self;
        let mut enlarged = None;
        if let Some(own_size) = repeats::undone(&depth) {
            enlarged = Some([&depth, &own_size].map(|image| [image.cols(), image.rows()]));
            depth = own_size;
        }
        let mut left_out = LeftOutReport { of: depth.valid_count(), enlarged, ..LeftOutReport::default() };
        left_out.far = far::leave_out(&mut depth).map_or(0, |far| far.count);
        if let Some(confidence) = &confidence {
            left_out.low_confidence = confidence.apply(&mut depth);
        }
        if let Some(reach) = reach {
            left_out.out_of_reach = within(reach, &mut depth);
        }
        progress.check()?;
        if let Some(image) = &colour {
            let found = look_up::colours(&depth, image, progress)?;
            left_out.black_rim = found.in_rim.len();
            depth.leave_out(found.in_rim);
            depth.colour = Some(found.colours);
        }
        Ok((depth, left_out))
    }

    fn validate(&self) -> Result<()> {
        let wrong = |what: &str, [cols, rows]: [usize; 2], count: usize| {
            Err(Error::input(format!("{}: {what} image of {cols} x {rows} pixels has {count}", self.depth.name)))
        };
        if let Some(colour) = &self.colour {
            let [cols, rows] = colour.size();
            if cols.checked_mul(rows) != Some(colour.pixels.len()) || colour.pixels.is_empty() {
                return wrong("the colour", [cols, rows], colour.pixels.len());
            }
            colour.camera.validate()?;
        }
        if let Some(confidence) = &self.confidence {
            let [cols, rows] = confidence.size;
            if cols.checked_mul(rows) != Some(confidence.levels.len()) || confidence.levels.is_empty() {
                return wrong("the confidence", confidence.size, confidence.levels.len());
            }
        }
        Ok(())
    }
}

/// Leaves out samples beyond a distance along z. Returns how many.
fn within(reach: f64, depth: &mut RangeImage) -> usize {
    let projection = *depth.projection();
    let z_is_value = matches!(projection, Projection::Pinhole { depth: DepthKind::Planar, .. });
    let far: Vec<usize> = (0..depth.len())
        .filter(|&i| if z_is_value { depth.range(i) > reach } else { depth.point_in_sensor(i).z > reach })
        .collect();
    let beyond = far.len();
    depth.leave_out(far);
    beyond
}

impl ConfidenceImage {
    /// Leaves out the samples of too low a level. Returns how many.
    fn apply(&self, depth: &mut RangeImage) -> usize {
        let [cols, rows] = self.size;
        let (of_cols, of_rows) = (depth.cols(), depth.rows());
        // The pixel whose area holds the centre of the depth's.
        let place = |i: usize, of: usize, to: usize| (2 * i + 1) * to / (2 * of);
        let is_low = |pixel: &usize| {
            let (row, col) = (place(pixel / of_cols, of_rows, rows), place(pixel % of_cols, of_cols, cols));
            depth.is_valid(*pixel) && self.levels[row * cols + col] < self.least
        };
        let low: Vec<usize> = (0..depth.len()).filter(is_low).collect();
        let count = low.len();
        depth.leave_out(low);
        count
    }
}

#[cfg(test)]
mod tests;
