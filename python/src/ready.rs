//! Scans made ready to be aligned, drawn to others by hand and compared: what of it is free of Python's classes.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfrecon::align::{AlignParams, Prepared};
use surfrecon::error::counted;
use surfrecon::import::Content;
use surfrecon::{Progress, RangeImage as CoreImage, memory};

use crate::arrays;
use crate::constraints::scan_number;
use crate::errors::{input_error, reworded};
use crate::params::params_only;
use crate::progress::Watch;
use crate::sources::{Clouds, Source, as_dyn, sources};

/// Scans, and what was made ready of them, free of Python.
pub struct Ready {
    pub sources: Vec<Source>,
    pub prepared: Prepared,
}

/// Poses of all scans, `None` of those that have none.
pub type Poses = Vec<Option<DAffine3>>;

/// Scans to be made ready, free of Python.
pub struct ReadCall {
    sources: Vec<Source>,
    threads: usize,
}

impl ReadCall {
    /// Checks and takes scans.
    ///
    /// # Errors
    /// `TypeError`.
    pub fn new(scans: &Bound<'_, PyAny>, threads: usize) -> PyResult<Self> {
        Ok(ReadCall { sources: sources(scans, Clouds::Taken)?, threads })
    }

    /// Checks and takes the arguments of Python's `Aligner`.
    ///
    /// # Errors
    /// `ParameterError`, `TypeError`.
    pub fn with_options(scans: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let AlignParams { threads, .. } = params_only(&["threads"], "Aligner", options)?;
        ReadCall::new(scans, threads)
    }

    /// How many scans there are.
    pub fn count(&self) -> usize {
        self.sources.len()
    }

    /// Reads them.
    ///
    /// # Errors
    /// See [`Prepared::read`].
    pub fn run(self, progress: &Progress<'_>) -> surfrecon::Result<Arc<Ready>> {
        let prepared = Prepared::read(&as_dyn(&self.sources), self.threads, progress)?;
        Ok(Arc::new(Ready { sources: self.sources, prepared }))
    }
}

impl Ready {
    pub fn number(&self, scan: &Bound<'_, PyAny>) -> PyResult<usize> {
        let scan = scan_number(scan, "scan")?;
        if scan >= self.sources.len() {
            let count = self.sources.len();
            return Err(input_error(format!("there is no scan {scan}: there are {count} (counted from 0)")));
        }
        Ok(scan)
    }

    /// The poses that Python's `poses` means. Without it, the poses that the scans have.
    pub fn poses(&self, given: Option<&Bound<'_, PyAny>>) -> PyResult<Poses> {
        let Some(given) = given else {
            return Ok(self.sources.iter().map(|source| Some(source.world_from_scan())).collect());
        };
        let of_each = given.try_iter().map_err(|error| {
            reworded(error, || {
                PyTypeError::new_err(format!(
                    "poses must be a list of 4 x 4 matrices or None, got {}",
                    given.get_type()
                ))
            })
        })?;
        let of_each: Vec<Bound<'_, PyAny>> = of_each.collect::<PyResult<_>>()?;
        if of_each.len() != self.sources.len() {
            let (given, count) = (of_each.len(), self.sources.len());
            return Err(input_error(format!(
                "{} given for {}: give a list of as many as there are scans, None at a scan without a pose",
                counted(given as u64, "pose is", "poses are"),
                counted(count as u64, "scan", "scans")
            )));
        }
        let pose = |(scan, pose): (usize, &Bound<'_, PyAny>)| match pose.is_none() {
            true => Ok(None),
            false => arrays::rigid(pose, &format!("the pose of scan {scan}")).map(Some),
        };
        of_each.iter().enumerate().map(pose).collect()
    }

    /// The misfit of a scan where the scans lie as `poses` says, in the shape of the points.
    pub fn misfit<'py>(
        &self,
        py: Python<'py>,
        scan: &Bound<'py, PyAny>,
        poses: &Poses,
        points: Option<&Bound<'py, PyAny>>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let scan = self.number(scan)?;
        if poses[scan].is_none() {
            return Err(input_error(format!(
                "scan {scan} has no pose, so that nothing can be said of how it fits the others"
            )));
        }
        let given = points.map(Points::taken).transpose()?;
        let (values, grid) = Watch::new(progress).run_parts(py, |watch| {
            let points = match given {
                Some(points) => points,
                None => Points::of(&self.sources[scan], &watch.span(0.0, READING_ONE))?,
            };
            let values = self.misfit_at(scan, poses, &points.at, &watch.span(READING_ONE, 1.0))?;
            Ok((values, points.grid))
        })?;
        let values = PyArray1::from_vec(py, values);
        Ok(match grid {
            Some(grid) => values.reshape(grid)?.into_any(),
            None => values.into_any(),
        })
    }

    /// NaN also at points that are not finite.
    fn misfit_at(
        &self,
        scan: usize,
        poses: &Poses,
        points: &[DVec3],
        progress: &Progress<'_>,
    ) -> surfrecon::Result<Vec<f64>> {
        memory::foresee(points.len(), 2.0 * size_of::<DVec3>() as f64, "the misfit at", "points")?;
        let sound: Vec<DVec3> = points.iter().copied().filter(|point| point.is_finite()).collect();
        let mut found = self.prepared.misfit(scan, poses, &sound, progress)?.into_iter();
        let value = |point: &DVec3| if point.is_finite() { found.next().expect("one a point") } else { f64::NAN };
        Ok(points.iter().map(value).collect())
    }
}

/// Share of the time that reading a scan takes where its misfit is asked for.
const READING_ONE: f64 = 0.5;

/// Places in a scan's own frame: a list, or a grid of rows and columns.
struct Points {
    at: Vec<DVec3>,
    grid: Option<[usize; 2]>,
}

impl Points {
    fn taken(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        let array = given.py().import("numpy")?.call_method1("asarray", (given,))?;
        let is_grid = array.getattr("ndim")?.extract::<usize>()? == 3;
        let wanted: &[arrays::Extent] = if is_grid { &[None, None, Some(3)] } else { &[None, Some(3)] };
        let (entries, shape) = arrays::floats(given, "points", wanted)?;
        Ok(Points { at: arrays::vectors(entries), grid: is_grid.then(|| [shape[0], shape[1]]) })
    }

    /// All that a scan has: pixels, vertices or points.
    fn of(source: &Source, progress: &Progress<'_>) -> surfrecon::Result<Self> {
        let list = |at: &[DVec3]| Points { at: at.to_vec(), grid: None };
        let read = match source {
            Source::Read(scan) => scan.read_with(progress)?,
            Source::Image(image) => return Points::of_image(image),
            Source::Mesh(placed) => return Ok(list(&placed.mesh.positions)),
            Source::Cloud(placed) => return Ok(list(&placed.cloud.positions)),
        };
        match read {
            Content::RangeImage(image) => Points::of_image(&image),
            Content::Mesh(mesh) => Ok(list(&mesh.positions)),
            Content::Points(cloud) => Ok(list(&cloud.positions)),
        }
    }

    fn of_image(image: &CoreImage) -> surfrecon::Result<Self> {
        memory::foresee(image.len(), size_of::<DVec3>() as f64, "the points of", "pixels")?;
        let at = (0..image.len()).map(|pixel| image.point_in_sensor(pixel)).collect();
        Ok(Points { at, grid: Some([image.rows(), image.cols()]) })
    }
}
