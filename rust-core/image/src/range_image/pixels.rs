//! The image itself: its pixels, and where each of them lies.

use glam::{DAffine3, DVec3};

use base::error::{Error, Result, Shown};
use base::progress::{Pace, Progress};
use mesh::Crs;

use super::projection::{Projection, Viewing};
use crate::rigid;

/// The measurements of a range image, row by row. An invalid pixel is NaN.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// One value per pixel. The projection says what it measures.
    Values(Vec<f64>),
    /// A point a pixel in the sensor's frame, for [`Projection::PointGrid`].
    Points(Vec<[f32; 3]>),
}

/// A range image: `rows` x `cols` pixels, row by row, with its projection, its pose and optional attributes.
///
/// Pixels are addressed `(row, col)` from the upper left, or by `row * cols + col`. Optional attributes have one entry per pixel. Entries
/// of invalid pixels mean nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct RangeImage {
    /// Name of the scan, for messages and reports. Often the file's name.
    pub name: String,
    /// Places the sensor's frame in the world: a rigid transform.
    pub world_from_sensor: DAffine3,
    /// Colours, sRGB with straight alpha.
    pub colour: Option<Vec<[u8; 4]>>,
    /// Strength of the returned signal, in the sensor's own unit.
    pub intensity: Option<Vec<f32>>,
    /// Confidence of each sample, >= 0: how far it can be trusted. `None`: computed from the geometry when needed.
    pub confidence: Option<Vec<f32>>,
    /// The system of the world that it is placed in. `None` if that is not known.
    pub crs: Option<Crs>,
    pub(super) rows: usize,
    pub(super) cols: usize,
    pub(super) projection: Projection,
    pub(super) samples: Samples,
}

/// Largest departure of a pose's axes from unit length and right angles that computing with them bears.
const RIGID: f64 = 1e-4;

/// Whether a transform rotates and moves and does no more: what places a sensor. What others write is made so by
/// [`crate::rigid::nearest`].
pub fn is_rigid(transform: &DAffine3) -> bool {
    let axes = transform.matrix3;
    rigid::departure(axes) <= RIGID && axes.determinant() > 0.0 && transform.is_finite()
}

impl RangeImage {
    /// A range image of one value per pixel. NaN and infinite values are invalid pixels. For a pinhole or spherical sensor so are those
    /// that aren't positive, which such sensors write where nothing came back.
    ///
    /// # Errors
    /// [`Error::Input`] if the number of values is not `rows * cols`, the projection is a point grid or has parameters
    /// that aren't usable, or a point would have a coordinate that isn't finite.
    pub fn from_values(rows: usize, cols: usize, mut values: Vec<f64>, projection: Projection) -> Result<Self> {
        if matches!(projection, Projection::PointGrid(_)) {
            return Err(Error::input("a point grid needs a point a pixel: use RangeImage::from_points"));
        }
        projection.validate()?;
        check_count(rows, cols, values.len(), "values")?;
        let is_distance = matches!(projection, Projection::Pinhole { .. } | Projection::Spherical { .. });
        // Chosen, not branched on: where a scan has holes is hard to guess.
        let least = if is_distance { f64::from_bits(1) } else { f64::MIN };
        let mut lanes = [0.0_f64; 8];
        for values in values.chunks_mut(lanes.len()) {
            for (largest, value) in lanes.iter_mut().zip(values) {
                *value = if (least..=f64::MAX).contains(value) { *value } else { f64::NAN };
                *largest = if value.abs() > *largest { value.abs() } else { *largest };
            }
        }
        let largest = lanes.into_iter().fold(0.0, f64::max);
        let reach = projection.reach(rows, cols, largest);
        if !reach.is_finite() {
            return Err(Error::input(format!(
                "the image would have points that are not finite: values reach to {}, which the projection \
                    {projection:?} takes too far. Use a larger unit.",
                Shown(largest)
            )));
        }
        Ok(Self::assemble(rows, cols, Samples::Values(values), projection))
    }

    /// A range image of one point per pixel in the sensor's frame. A point with a coordinate that isn't finite is an invalid pixel.
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
            crs: None,
            rows,
            cols,
            projection,
            samples,
        }
    }

    /// Bytes of its samples and attributes.
    pub fn bytes(&self) -> usize {
        let samples = match &self.samples {
            Samples::Values(values) => size_of_val(&values[..]),
            Samples::Points(points) => size_of_val(&points[..]),
        };
        let floats = [&self.intensity, &self.confidence].into_iter().flatten().map(|values| size_of_val(&values[..]));
        let colours = self.colour.as_ref().map_or(0, |colours| size_of_val(&colours[..]));
        samples + floats.sum::<usize>() + colours
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

    /// Its name in messages.
    pub fn called(&self) -> &str {
        if self.name.is_empty() { "the image" } else { &self.name }
    }

    /// Whether there is no pixel at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Projection of the pixels.
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

    /// Makes pixels invalid.
    pub fn leave_out(&mut self, pixels: impl IntoIterator<Item = usize>) {
        for pixel in pixels {
            match &mut self.samples {
                Samples::Values(values) => values[pixel] = f64::NAN,
                Samples::Points(points) => points[pixel] = [f32::NAN; 3],
            }
        }
    }

    /// Number of valid pixels.
    pub fn valid_count(&self) -> usize {
        (0..self.len()).filter(|&i| self.is_valid(i)).count()
    }

    /// The measured point of pixel `index` in the sensor's frame. NaN for an invalid pixel.
    pub fn point_in_sensor(&self, index: usize) -> DVec3 {
        match &self.samples {
            Samples::Values(values) => self.projection.point(index / self.cols, index % self.cols, values[index]),
            Samples::Points(points) => {
                DVec3::new(points[index][0].into(), points[index][1].into(), points[index][2].into())
            }
        }
    }

    /// Calls `visit(row, col, point)` for every valid pixel, row by row. `point` is what [`RangeImage::point_in_sensor`] gives, to the bit.
    /// Trigonometry is done once per row and column, not per pixel.
    pub fn for_each_valid(&self, visit: impl FnMut(usize, usize, DVec3)) {
        self.try_for_each_valid(visit, &Progress::none()).expect("nobody cancels");
    }

    /// [`RangeImage::for_each_valid`] that stops when it is cancelled.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn try_for_each_valid(
        &self,
        mut visit: impl FnMut(usize, usize, DVec3),
        progress: &Progress<'_>,
    ) -> Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        let mut pace = Pace::new(progress);
        let values = match &self.samples {
            Samples::Points(points) => {
                for (row, points) in points.chunks_exact(self.cols).enumerate() {
                    for (col, &[x, y, z]) in points.iter().enumerate() {
                        if !x.is_nan() {
                            visit(row, col, DVec3::new(x.into(), y.into(), z.into()));
                        }
                    }
                    pace.after(self.cols)?;
                }
                return Ok(());
            }
            Samples::Values(values) => values,
        };
        let unproject = self.projection.tables(self.rows, self.cols);
        for (row, values) in values.chunks_exact(self.cols).enumerate() {
            for (col, &value) in values.iter().enumerate() {
                if !value.is_nan() {
                    visit(row, col, unproject.point(row, col, value));
                }
            }
            pace.after(self.cols)?;
        }
        Ok(())
    }

    /// The range of pixel `index`: how far its sample lies along its ray, up to a constant. For parallel rays it is the coordinate along
    /// them: the value itself for an orthographic image, whose rays run along -z. For a pinhole or spherical image it is the value itself.
    /// For a point grid seen from a point it is the distance to that point. NaN for an invalid pixel.
    pub fn range(&self, index: usize) -> f64 {
        match (&self.samples, &self.projection) {
            (Samples::Values(values), _) => values[index],
            (_, Projection::PointGrid(Viewing::From(origin))) => self.point_in_sensor(index).distance(*origin),
            _ => {
                let point = self.point_in_sensor(index);
                point.dot(self.projection.view_direction(point))
            }
        }
    }

    /// The ray of pixel `index` in the sensor's frame: a point on it and its unit direction from the sensor toward the
    /// scene. The measured point lies on it. NaN where a point grid's pixel is invalid.
    pub fn ray_in_sensor(&self, index: usize) -> (DVec3, DVec3) {
        self.projection.ray(index / self.cols, index % self.cols, self.point_in_sensor(index))
    }

    /// Start of its rays, in the world. `None` if they are parallel.
    pub fn sensor(&self) -> Option<DVec3> {
        self.projection.eye().map(|eye| self.world_from_sensor.transform_point3(eye))
    }

    /// The system that its own coordinates are in: the world's, where its pose is the identity.
    pub fn crs_of_frame(&self) -> Option<Crs> {
        self.crs.clone().filter(|_| self.world_from_sensor == DAffine3::IDENTITY)
    }

    /// The measured point of pixel `index` in the world. NaN for an invalid pixel.
    pub fn point_in_world(&self, index: usize) -> DVec3 {
        self.world_from_sensor.transform_point3(self.point_in_sensor(index))
    }

    /// Checks that each attribute has one entry per pixel.
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
                let name = if self.name.is_empty() { String::new() } else { format!("{}: ", self.name) };
                return Err(Error::input(format!(
                    "{name}pixel ({row}, {col}): the confidence is {}, but must be a finite number >= 0",
                    confidence[i]
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

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::super::projection::DepthKind;
    use super::super::test_images::*;
    use super::*;

    #[test]
    fn samples_lie_on_their_rays_and_visits_agree_with_lookups() {
        for projection in projections(11, 9) {
            let centre = ahead(&projection);
            let image = render(11, 9, projection, sphere(centre, 0.25));
            for image in [as_point_grid(&image), image] {
                let mut seen = 0;
                image.for_each_valid(|row, col, point| {
                    let index = row * 9 + col;
                    assert_eq!(point, image.point_in_sensor(index), "{projection:?}");
                    let (origin, direction) = image.ray_in_sensor(index);
                    assert!((direction.length() - 1.0).abs() < 1e-14);
                    let off = (point - origin).cross(direction).length();
                    assert!(off < 1e-14, "{projection:?}: {off} off its ray");
                    assert!((point - centre).length() - 0.25 < 1e-6);
                    assert!((direction - image.projection().view_direction(point)).length() < 1e-14);
                    seen += 1;
                });
                assert!(seen > 5 && seen == image.valid_count());
            }
        }
    }

    #[test]
    fn what_can_t_be_computed_with_is_refused_by_name() {
        let made = |projection, value: f64| {
            RangeImage::from_values(2, 3, vec![1.0, 1.0, value, 1.0, f64::NAN, 2.0], projection)
        };
        let refused = |projection, value, words: [&str; 2]| {
            let text = made(projection, value).unwrap_err().to_string();
            assert!(words.iter().all(|word| text.contains(word)), "{text}");
        };
        let plane = |first: f64, step: f64| Projection::Orthographic { first: [first, 0.0], step: [step, -1.0] };
        let pinhole =
            |focal: f64, centre: f64, depth| Projection::Pinhole { focal: [focal; 2], centre: [centre; 2], depth };
        for value in [1e300, -1e300, f64::INFINITY, 0.0] {
            assert!(made(plane(0.0, 1.0), value).is_ok(), "{value}");
        }
        refused(plane(f64::INFINITY, 1.0), 1.0, ["place of the first pixel", "inf"]);
        refused(plane(f64::NAN, 1.0), 1.0, ["place of the first pixel", "NaN"]);
        refused(plane(0.0, 0.0), 1.0, ["step from column to column", "got 0"]);
        refused(plane(0.0, 1e308), 7.0, ["step from column to column", "1e308"]);
        for depth in [DepthKind::Planar, DepthKind::Ray] {
            refused(pinhole(1e-320, 1.0, depth), 1.0, ["focal length fx", "1e-320"]);
            refused(pinhole(1.0, 1e80, depth), 1.0, ["centre cx", "1e80"]);
            assert!(made(pinhole(1e-70, 1.0, depth), 1.0).is_ok());
        }
        refused(pinhole(1e-70, 1e10, DepthKind::Planar), 1e300, ["values reach to 1e300", "Pinhole"]);
        let viewed = |viewing| RangeImage::from_points(1, 1, vec![[0.0; 3]], viewing).map(drop);
        assert!(viewed(Viewing::Parallel(DVec3::new(0.0, 1e-70, 1e70))).is_ok());
        for bad in [DVec3::ZERO, DVec3::new(0.0, 1e-80, 0.0), DVec3::new(0.0, 1.0, 1e80), DVec3::NAN] {
            assert!(viewed(Viewing::Parallel(bad)).unwrap_err().to_string().contains("viewing direction"), "{bad}");
        }
        assert!(viewed(Viewing::From(DVec3::splat(1e80))).unwrap_err().to_string().contains("1e80"));
    }

    #[test]
    fn a_cloud_is_placed_by_the_pose() {
        let projection = projections(20, 20)[0];
        let mut image = render(20, 20, projection, sphere(ahead(&projection), 0.25));
        image.world_from_sensor = DAffine3::from_rotation_translation(DQuat::from_rotation_x(0.3), DVec3::splat(1e6));
        image.colour = Some((0..400).map(|i| [i as u8, 0, 0, 255]).collect());
        let cloud = image.to_point_cloud(&Progress::none()).unwrap();
        let valid: Vec<usize> = (0..400).filter(|&i| image.is_valid(i)).collect();
        assert_eq!(cloud.positions.len(), valid.len());
        for (k, &i) in valid.iter().enumerate() {
            assert_eq!(cloud.world_from_cloud.transform_point3(cloud.positions[k]), image.point_in_world(i));
            assert_eq!(cloud.colour.as_ref().unwrap()[k][0], i as u8);
        }
        for projection in projections(20, 20) {
            let image = render(20, 20, projection, sphere(ahead(&projection), 0.25));
            assert_eq!(image.to_point_cloud(&Progress::none()).unwrap().sensor, projection.eye(), "{projection:?}");
        }
        image.colour = Some(vec![[0; 4]; 399]);
        assert!(image.to_point_cloud(&Progress::none()).unwrap_err().to_string().contains("colours"));
    }
}
