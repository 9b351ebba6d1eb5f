//! Scattered points -> surface.

use std::sync::{Arc, MutexGuard};
use std::time::Duration;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use surfrecon::reconstruct::{Reason, ReconstructParams, Reconstructed as Core, Reconstructor as CoreReconstructor};
use surfrecon::threads::{Exclusive, Taken};
use surfrecon::{Error, PointCloud as CoreCloud, Progress};

use crate::arrays;
use crate::background::{Background, made};
use crate::errors::to_python;
use crate::frame::Scan;
use crate::job::Job;
use crate::mesh::Mesh;
use crate::params::{no_others, params};
use crate::point_cloud::PointCloud;
use crate::progress::Watch;
use crate::range_image::RangeImage;
use crate::report;
use crate::scans::ScanSet;

type Shared = Arc<Exclusive<CoreReconstructor<Arc<CoreCloud>>>>;

/// Makes a surface through scattered points, over their Delaunay tetrahedralization.
///
/// >>> found = surfrecon.reconstruct(points)
/// >>> found.report.closed
/// True
/// >>> found.mesh.write("surface.ply")
///
/// Args:
///     points: a ``PointCloud``, or (n, 3) real numbers. Points that aren't finite, and exact copies, are dropped.
///     normals: (n, 3), towards the side of the surface from which it is seen. Zero where unknown. Default: the cloud's.
///     colour: (n, 3) or (n, 4), bytes or floats from 0 to 1, for the mesh. Default: the cloud's.
///     sensors: (3,) or (n, 3): where the points were seen from. NaN where that is not known of a point, whose normal counts
///         then. The surface is turned towards it, whatever the normals. Without normals and sensors closed surfaces are turned
///         outwards, open ones up. If points carry noise, sensors and normals also tell the sides of thin walls apart, and
///         what is inside. Normals whose signs change from point to point say nothing of that. Open surfaces span no jumps, over
///         which sensors looked from one point past it at another, and no gaps and holes through which points were seen. Parts that were
///         seen from one side only are closed only if that is asked for. A jump is told only between points whose sensors are all
///         known. Default: the cloud's.
///     toward: (3,): the surface is turned towards this place, whatever normals and sensors say. The points need not have been
///         seen from there.
#[doc = include_str!("params/reconstruct.txt")]
///     progress: called as ``progress(stage, fraction)`` about every 30 ms on the calling thread. ``False`` cancels.
///         Ctrl-C cancels as well.
///
/// Options that are ``None`` take their defaults.
///
/// Returns:
///     A ``Reconstructed`` with the mesh, in the frame of the points, and which points are not on it.
///
/// Raises:
///     ParameterError: an option out of its range. The text names value, range and unit.
///     InputError: fewer than three different points, points on one line, a closed surface of points in one plane, arrays
///         of another length.
///     Cancelled: ``progress`` returned ``False``.
#[pyfunction]
// options: reconstruct
#[pyo3(signature = (points, *, normals = None, colour = None, sensors = None, toward = None, progress = None, **options),
    text_signature = "(points, *, factor=1.0, threshold='local', topology='manifold', closure='auto', smooth=None, noisy_points='moved', threads=0, normals=None, colour=None, sensors=None, toward=None, progress=None)")]
#[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
pub fn reconstruct(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    normals: Option<&Bound<'_, PyAny>>,
    colour: Option<&Bound<'_, PyAny>>,
    sensors: Option<&Bound<'_, PyAny>>,
    toward: Option<&Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Reconstructed> {
    let params: ReconstructParams = params("reconstruct", options)?;
    let reconstructor = prepared(points, normals, colour, sensors, toward)?;
    let made = Watch::new(progress).run(py, |progress| reconstructor.into_surface(&params, progress))?;
    Reconstructed::new(py, made)
}

/// Scattered points from which surfaces are made: the first takes as long as ``reconstruct``, others, with other options, a
/// fraction of it, since the tetrahedralization is kept. A surface does not depend on those before.
///
/// >>> reconstructor = surfrecon.Reconstructor(points)
/// >>> closed = reconstructor.surface(closure="closed")
/// >>> smoothed = reconstructor.surface(closure="closed", smooth=0.2)  # a fraction of the time
///
/// Args:
///     points, normals, colour, sensors, toward: as for ``reconstruct``. Changing the arrays later changes nothing here.
///
/// Raises:
///     InputError: arrays of another length than the points.
#[pyclass(frozen, module = "surfrecon")]
pub struct Reconstructor {
    reconstructor: Shared,
    points: usize,
}

#[pymethods]
impl Reconstructor {
    #[new]
    #[pyo3(signature = (points, *, normals = None, colour = None, sensors = None, toward = None, **others),
        text_signature = "(points, *, normals=None, colour=None, sensors=None, toward=None)")]
    fn new(
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
        colour: Option<&Bound<'_, PyAny>>,
        sensors: Option<&Bound<'_, PyAny>>,
        toward: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Reconstructor", others)?;
        let reconstructor = prepared(points, normals, colour, sensors, toward)?;
        let points = reconstructor.cloud().positions.len();
        Ok(Reconstructor { reconstructor: Arc::new(Exclusive::new(reconstructor)), points })
    }

    /// Makes a surface. Options, result and errors as of ``reconstruct``.
    ///
    /// >>> reconstructor = surfrecon.Reconstructor(points)
    /// >>> reconstructor.surface(closure="closed").report.closed
    /// True
    ///
    /// Raises:
    ///     InputError: also while it makes another surface, on another thread, or did when this process was forked.
    // options: $self reconstruct
    #[pyo3(signature = (*, progress = None, **options), text_signature = "($self, *, factor=1.0, threshold='local', topology='manifold', closure='auto', smooth=None, noisy_points='moved', threads=0, progress=None)")]
    fn surface(
        &self,
        py: Python<'_>,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Reconstructed> {
        let call = SurfaceCall::new(self, options)?;
        Reconstructed::new(py, Watch::new(progress).run(py, |progress| call.run(progress))?)
    }

    fn __repr__(&self) -> String {
        format!("<Reconstructor of {} points>", self.points)
    }
}

/// A surface to be made, free of Python.
pub struct SurfaceCall {
    reconstructor: Shared,
    params: ReconstructParams,
}

impl SurfaceCall {
    /// Checks and takes the arguments of Python's `Reconstructor.surface`.
    ///
    /// # Errors
    /// `ParameterError`, `InputError`.
    pub fn new(reconstructor: &Reconstructor, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let params = params("Reconstructor.surface", options)?;
        Ok(SurfaceCall { reconstructor: reconstructor.reconstructor.clone(), params })
    }

    /// Runs it.
    ///
    /// # Errors
    /// See [`CoreReconstructor::surface`]. [`Error::Input`] while another surface is being made: waiting for that could be
    /// waiting for this very thread, from a progress callback.
    pub fn run(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        self.take()?
            .ok_or_else(|| Error::input("the reconstructor is making another surface: wait for it, or make two"))?
            .surface(&self.params, progress)
    }

    /// Runs it once the surface before is made, or a cancelled one's memory given back. For threads without callbacks.
    ///
    /// # Errors
    /// See [`CoreReconstructor::surface`].
    pub fn run_in_turn(&self, progress: &Progress<'_>) -> surfrecon::Result<Core> {
        loop {
            if let Some(mut reconstructor) = self.take()? {
                return reconstructor.surface(&self.params, progress);
            }
            progress.check()?;
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// `None` while another surface is being made.
    fn take(&self) -> surfrecon::Result<Option<MutexGuard<'_, CoreReconstructor<Arc<CoreCloud>>>>> {
        match self.reconstructor.take() {
            Ok(reconstructor) => Ok(Some(reconstructor)),
            Err(Taken::InUse) => Ok(None),
            Err(Taken::LeftBehind) => Err(Error::input(
                "the reconstructor was making a surface when this process was forked, and can't be used here: make another",
            )),
        }
    }
}

/// The points of a ``PointCloud``, or of an array.
///
/// # Errors
/// `InputError`.
pub fn cloud_of(points: &Bound<'_, PyAny>) -> PyResult<Arc<CoreCloud>> {
    if let Ok(cloud) = points.cast::<PointCloud>() {
        return Ok(cloud.get().cloud.clone());
    }
    let is_path = points.is_instance_of::<PyString>() || points.hasattr("__fspath__")?;
    for (is_it, kind, remedy) in [
        (points.is_instance_of::<RangeImage>(), "RangeImage", "give its .to_cloud()"),
        (points.is_instance_of::<Mesh>(), "Mesh", "give its .positions"),
        (points.is_instance_of::<Scan>(), "Scan", "give what its .read() returns"),
        (points.is_instance_of::<ScanSet>(), "ScanSet", "give what .read() of one of its scans returns"),
        (is_path, "path", "give what surfrecon.read(path) returns"),
    ] {
        if is_it {
            let text = format!("points must be a PointCloud or (n, 3) real numbers, got a {kind}: {remedy}");
            return Err(PyTypeError::new_err(text));
        }
    }
    let (coordinates, _) = arrays::floats(points, "points", &[None, Some(3)])?;
    Ok(Arc::new(CoreCloud { positions: arrays::vectors(coordinates), ..CoreCloud::default() }))
}

fn prepared(
    points: &Bound<'_, PyAny>,
    normals: Option<&Bound<'_, PyAny>>,
    colour: Option<&Bound<'_, PyAny>>,
    sensors: Option<&Bound<'_, PyAny>>,
    toward: Option<&Bound<'_, PyAny>>,
) -> PyResult<CoreReconstructor<Arc<CoreCloud>>> {
    let mut cloud = cloud_of(points)?;
    if let Some(normals) = normals {
        let (normals, _) = arrays::floats32(normals, "normals", &[None, Some(3)])?;
        Arc::make_mut(&mut cloud).normals = Some(normals.as_chunks().0.to_vec());
    }
    if let Some(colour) = colour {
        Arc::make_mut(&mut cloud).colour = Some(arrays::colours(colour, "colour", &[None])?);
    }
    let mut reconstructor = CoreReconstructor::new(cloud).map_err(|e| to_python(&e))?;
    if let Some(sensors) = sensors {
        let sensors = match arrays::vector(sensors, "sensors") {
            Ok(sensor) => vec![sensor],
            Err(_) => arrays::vectors(arrays::floats(sensors, "sensors", &[None, Some(3)])?.0),
        };
        reconstructor.seen_from(sensors).map_err(|e| to_python(&e))?;
    }
    if let Some(toward) = toward {
        reconstructor.turn_toward(arrays::vector(toward, "toward")?).map_err(|e| to_python(&e))?;
    }
    Ok(reconstructor)
}

/// A surface through scattered points.
///
/// >>> found = surfrecon.reconstruct(np.vstack([points, points[:10]]))
/// >>> len(found.dropped["duplicate"])
/// 10
#[pyclass(frozen, module = "surfrecon")]
pub struct Reconstructed {
    /// The surface, in the frame of the points. Its vertices are the used points in their order. Vertex attributes:
    /// ``source_point`` (which point it is), and ``colour``, ``intensity``, ``normal_x``, ``normal_y``, ``normal_z`` where
    /// the points have them.
    #[pyo3(get)]
    mesh: Py<Mesh>,
    report: surfrecon::reconstruct::ReconstructReport,
}

impl Reconstructed {
    pub fn new(py: Python<'_>, core: Core) -> PyResult<Self> {
        Ok(Reconstructed { mesh: Py::new(py, Mesh::from(core.mesh))?, report: core.report })
    }

    fn dropped_for(&self, reason: Reason) -> Vec<u32> {
        self.report.dropped.iter().filter(|dropped| dropped.reason == reason).map(|dropped| dropped.point).collect()
    }
}

#[pymethods]
impl Reconstructed {
    /// The points that are not on the surface, by the reason, each (k,) uint32 ascending: ``not_finite``, ``duplicate`` (at
    /// the same place as a point before it, or in a sheet right above one), ``inside`` and ``outside`` (out of the surface's reach), ``outlier`` (far from any
    /// surface that the others tell).
    #[getter]
    fn dropped<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (name, reason) in [
            ("not_finite", Reason::NotFinite),
            ("duplicate", Reason::Duplicate),
            ("inside", Reason::Inside),
            ("outside", Reason::Outside),
            ("outlier", Reason::Outlier),
        ] {
            dict.set_item(name, numpy::PyArray1::from_vec(py, self.dropped_for(reason)))?;
        }
        Ok(dict)
    }

    /// Figures of the run: a ``ReconstructReport``.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        report::of(py, &self.report)
    }

    fn __repr__(&self) -> String {
        let triangles = self.mesh.get().mesh.triangles.len();
        format!("<Reconstructed {triangles} triangles through {} of {} points>", self.report.used, self.report.points)
    }
}

#[pymethods]
impl Job {
    /// Starts ``reconstructor.surface`` with the same arguments but ``progress``. While the reconstructor makes another
    /// surface the job waits for its turn.
    ///
    /// Raises:
    ///     ParameterError, InputError: like ``surface``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: reconstruct
    #[pyo3(signature = (reconstructor, **options), text_signature = "(reconstructor, *, factor=1.0, threshold='local', topology='manifold', closure='auto', smooth=None, noisy_points='moved', threads=0)")]
    fn surface(reconstructor: &Reconstructor, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = SurfaceCall::new(reconstructor, options)?;
        Job::of(Background::start(move |progress| {
            made(
                call.run_in_turn(progress)?,
                |py, found| Ok(Bound::new(py, Reconstructed::new(py, found)?)?.into_any()),
            )
        }))
    }
}
