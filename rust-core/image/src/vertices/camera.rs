//! Cameras of range images: all that a host keeps of one besides its vertices.

use glam::DVec3;

use base::error::{Error, Result, Shown};
use base::magnitude;
use base::progress::{Pace, Progress};

use crate::range_image::{Projection, RangeImage, Viewing};

/// Most anchors of an image: so many that a good part of them is left wherever a user deletes, few enough to be kept with
/// any object.
pub const MOST_ANCHORS: usize = 256;

/// Vertices among which anchors are chosen: looking at each of millions would find none that tell more.
const CANDIDATES: usize = 1 << 14;

/// Place where a vertex was: by it a motion of all vertices is recognized.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    /// Its pixel's row.
    pub row: usize,
    /// Its pixel's column.
    pub col: usize,
    /// The point in the sensor's frame.
    pub point: DVec3,
}

/// Camera of a range image: how its pixels see, and where some of its vertices were.
#[derive(Clone, Debug, PartialEq)]
pub struct GridCamera {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    /// Projection of the pixels.
    pub projection: Projection,
    /// Up to [`MOST_ANCHORS`] vertices far from each other. Without them all vertices are taken to lie in the sensor's frame.
    pub anchors: Vec<Anchor>,
}

impl GridCamera {
    /// The camera of an image. O(pixels). It is the same for the same image.
    ///
    /// # Errors
    /// A coordinate larger than [`magnitude::LARGEST`]. [`Error::Cancelled`].
    pub fn of(image: &RangeImage, progress: &Progress<'_>) -> Result<Self> {
        progress.watch(|| {
            let candidates = candidates(image, progress)?;
            let points: Vec<DVec3> = candidates.iter().map(|anchor| anchor.point).collect();
            magnitude::points("sample", &points)?;
            let chosen = spread(&points, progress)?;
            Ok(GridCamera {
                rows: image.rows(),
                cols: image.cols(),
                projection: *image.projection(),
                anchors: chosen.into_iter().map(|i| candidates[i]).collect(),
            })
        })
    }

    /// For a host whose unit of length is another: what is multiplied by `scale` in its vertices is so here.
    ///
    /// # Errors
    /// [`Error::Input`] for a scale that is not above 0, or with which lengths become too large or too small.
    pub fn scaled(&self, scale: f64) -> Result<Self> {
        if scale.is_nan() || scale <= 0.0 {
            return Err(Error::input(format!("the scale must be > 0, got {}", Shown(scale))));
        }
        magnitude::divisor("the scale", scale)?;
        let mut scaled = self.clone();
        scaled.projection = scaled_projection(&self.projection, scale);
        scaled.anchors.iter_mut().for_each(|anchor| anchor.point *= scale);
        scaled.validate()?;
        Ok(scaled)
    }

    /// Checks the projection, and that anchors are finite and lie on the grid.
    ///
    /// # Errors
    /// [`Error::Input`] naming what is wrong.
    pub fn validate(&self) -> Result<()> {
        self.projection.validate()?;
        for (what, count) in [("rows", self.rows), ("columns", self.cols)] {
            if i32::try_from(count).is_err() {
                return Err(Error::input(format!("a grid may have at most {} {what}, got {count}", i32::MAX)));
            }
        }
        let count = self.anchors.len();
        if count > MOST_ANCHORS {
            return Err(Error::input(format!("there may be at most {MOST_ANCHORS} anchors, got {count}")));
        }
        for (i, anchor) in self.anchors.iter().enumerate() {
            if anchor.row >= self.rows || anchor.col >= self.cols {
                return Err(Error::input(format!(
                    "anchor {i} is pixel ({}, {}), but the grid has {} x {} pixels",
                    anchor.row, anchor.col, self.rows, self.cols
                )));
            }
            magnitude::place(&format!("anchor {i}"), anchor.point)?;
        }
        Ok(())
    }
}

/// A projection whose lengths are multiplied. Angles and pixels stay.
fn scaled_projection(projection: &Projection, scale: f64) -> Projection {
    match *projection {
        Projection::Orthographic { first, step } => {
            Projection::Orthographic { first: first.map(|x| x * scale), step: step.map(|x| x * scale) }
        }
        Projection::PointGrid(Viewing::From(origin)) => Projection::PointGrid(Viewing::From(origin * scale)),
        other => other,
    }
}

/// Valid pixels from all over the image, at most [`CANDIDATES`]: one of each run of as many, at changing places of it, or a run as
/// long as a row would give one column.
fn candidates(image: &RangeImage, progress: &Progress<'_>) -> Result<Vec<Anchor>> {
    let mut valid = 0_usize;
    let mut pace = Pace::new(progress);
    for start in (0..image.len()).step_by(image.cols().max(1)) {
        valid += (start..start + image.cols()).filter(|&pixel| image.is_valid(pixel)).count();
        pace.after(image.cols())?;
    }
    let run = valid.div_ceil(CANDIDATES).max(1);
    // Multiples of the golden ratio, less their whole part, in 2^-16.
    let place = |i: usize| (((i * 40_503) % (1 << 16)) * run) >> 16;
    let mut found = Vec::with_capacity(valid.min(CANDIDATES));
    let mut k = 0;
    image.try_for_each_valid(
        |row, col, point| {
            if k % run == place(k / run) {
                found.push(Anchor { row, col, point });
            }
            k += 1;
        },
        progress,
    )?;
    Ok(found)
}

/// Points far from each other: the one farthest from the sensor, then always the one farthest from all before.
fn spread(points: &[DVec3], progress: &Progress<'_>) -> Result<Vec<usize>> {
    let farthest = |distances: &[f64]| {
        let larger = |best: usize, i: usize| if distances[i] > distances[best] { i } else { best };
        (1..distances.len()).fold(0, larger)
    };
    let mut chosen = Vec::with_capacity(MOST_ANCHORS);
    if points.is_empty() {
        return Ok(chosen);
    }
    let mut nearest = vec![f64::INFINITY; points.len()];
    let mut next = farthest(&points.iter().map(|p| p.length_squared()).collect::<Vec<_>>());
    let mut pace = Pace::new(progress);
    while chosen.len() < MOST_ANCHORS && nearest[next] > 0.0 {
        chosen.push(next);
        for (distance, point) in nearest.iter_mut().zip(points) {
            *distance = distance.min(point.distance_squared(points[next]));
        }
        next = farthest(&nearest);
        pace.after(points.len())?;
    }
    Ok(chosen)
}
