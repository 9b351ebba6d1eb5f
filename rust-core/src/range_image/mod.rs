//! Range images: a grid of pixels, each valid or not, each with a viewing ray.
//!
//! | file | what |
//! |---|---|
//! | `projection` | pixel -> point and ray, for every kind of sensor |
//! | `spacing` | sample spacing of an image, from which default limits come |
//! | `normals` | normals and curvature |
//! | `confidence` | cosine to the ray, ramped to zero at jumps and borders \[CL96\] |

pub mod projection;

pub use projection::{DepthKind, Projection, Viewing};

use glam::{DAffine3, DVec3};

use crate::error::{Error, Result};

/// The measurements of a range image, row by row; an invalid pixel is NaN.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// One value a pixel; the projection says what it measures.
    Values(Vec<f64>),
    /// A point a pixel in the sensor's frame, for [`Projection::PointGrid`].
    Points(Vec<[f32; 3]>),
}

/// A range image: `rows` x `cols` pixels, row by row, with its projection, its pose and optional attributes.
///
/// Pixels are addressed `(row, col)` from the upper left, or by `row * cols + col`. Optional attributes have one entry
/// a pixel; entries of invalid pixels mean nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeImage {
    /// Name of the scan, for messages and reports; often the file's name.
    pub name: String,
    /// Places the sensor's frame in the world: a rigid transform.
    pub world_from_sensor: DAffine3,
    /// Colours, sRGB with straight alpha.
    pub colour: Option<Vec<[u8; 4]>>,
    /// Strength of the returned signal, in the sensor's own unit.
    pub intensity: Option<Vec<f32>>,
    /// How far each sample can be trusted, >= 0; `None`: computed from the geometry when needed.
    pub confidence: Option<Vec<f32>>,
    rows: usize,
    cols: usize,
    projection: Projection,
    samples: Samples,
}

impl RangeImage {
    /// A range image of one value a pixel; NaN and infinite values are invalid pixels.
    ///
    /// # Errors
    /// [`Error::Input`] if the number of values is not `rows * cols`, or the projection is a point grid or has
    /// parameters that aren't finite.
    pub fn from_values(rows: usize, cols: usize, mut values: Vec<f64>, projection: Projection) -> Result<Self> {
        if matches!(projection, Projection::PointGrid(_)) {
            return Err(Error::input("a point grid needs a point a pixel: use RangeImage::from_points"));
        }
        projection.validate()?;
        check_count(rows, cols, values.len(), "values")?;
        for value in &mut values {
            if !value.is_finite() {
                *value = f64::NAN;
            }
        }
        Ok(Self::assemble(rows, cols, Samples::Values(values), projection))
    }

    /// A range image of one point a pixel in the sensor's frame; a point with a coordinate that isn't finite is an
    /// invalid pixel.
    ///
    /// # Errors
    /// [`Error::Input`] if the number of points is not `rows * cols`, or the viewing direction isn't usable.
    pub fn from_points(rows: usize, cols: usize, mut points: Vec<[f32; 3]>, viewing: Viewing) -> Result<Self> {
        let projection = Projection::PointGrid(viewing);
        projection.validate()?;
        check_count(rows, cols, points.len(), "points")?;
        for point in &mut points {
            if !point.iter().all(|x| x.is_finite()) {
                *point = [f32::NAN; 3];
            }
        }
        Ok(Self::assemble(rows, cols, Samples::Points(points), projection))
    }

    fn assemble(rows: usize, cols: usize, samples: Samples, projection: Projection) -> Self {
        RangeImage {
            name: String::new(),
            world_from_sensor: DAffine3::IDENTITY,
            colour: None,
            intensity: None,
            confidence: None,
            rows,
            cols,
            projection,
            samples,
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.rows * self.cols
    }

    /// Whether there is no pixel at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How pixels see.
    pub fn projection(&self) -> &Projection {
        &self.projection
    }

    /// The measurements.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Whether pixel `index` has a measurement.
    pub fn is_valid(&self, index: usize) -> bool {
        match &self.samples {
            Samples::Values(values) => !values[index].is_nan(),
            Samples::Points(points) => !points[index][0].is_nan(),
        }
    }

    /// Number of valid pixels.
    pub fn valid_count(&self) -> usize {
        (0..self.len()).filter(|&i| self.is_valid(i)).count()
    }

    /// The measured point of pixel `index` in the sensor's frame; NaN for an invalid pixel.
    pub fn point_in_sensor(&self, index: usize) -> DVec3 {
        match &self.samples {
            Samples::Values(values) => self.projection.point(index / self.cols, index % self.cols, values[index]),
            Samples::Points(points) => {
                DVec3::new(points[index][0].into(), points[index][1].into(), points[index][2].into())
            }
        }
    }

    /// The measured point of pixel `index` in the world; NaN for an invalid pixel.
    pub fn point_in_world(&self, index: usize) -> DVec3 {
        self.world_from_sensor.transform_point3(self.point_in_sensor(index))
    }

    /// Checks that each attribute has one entry a pixel.
    ///
    /// # Errors
    /// [`Error::Input`] naming the attribute.
    pub fn validate(&self) -> Result<()> {
        let lengths = [
            ("colours", self.colour.as_ref().map(Vec::len)),
            ("intensities", self.intensity.as_ref().map(Vec::len)),
            ("confidences", self.confidence.as_ref().map(Vec::len)),
        ];
        for (what, length) in lengths {
            if let Some(length) = length {
                check_count(self.rows, self.cols, length, what)?;
            }
        }
        if let Some(confidence) = &self.confidence {
            let bad =
                (0..self.len()).find(|&i| self.is_valid(i) && !(confidence[i] >= 0.0 && confidence[i].is_finite()));
            if let Some(i) = bad {
                let (row, col) = (i / self.cols, i % self.cols);
                return Err(Error::input(format!(
                    "{}: pixel ({row}, {col}): the confidence is {}, but must be a finite number >= 0",
                    self.name, confidence[i]
                )));
            }
        }
        Ok(())
    }
}

fn check_count(rows: usize, cols: usize, count: usize, what: &str) -> Result<()> {
    match rows.checked_mul(cols) {
        Some(pixels) if pixels == count => Ok(()),
        _ => Err(Error::input(format!("{rows} x {cols} pixels need {rows} x {cols} {what}, got {count}"))),
    }
}
