//! Long calls in the background, for hosts whose main thread must stay free: an entry an operation, that starts it and says
//! what Python's object of its value is.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::align::{AlignCall, Aligner, READING};
use crate::background::{Background, made, made_class, part};
use crate::close::{CloseCall, Closed};
use crate::cluster::{ClusterCall, clustered};
use crate::constraints::constraints;
use crate::crs::CrsText;
use crate::frame::{Scan, content_object};
use crate::measure::{DistanceCall, SurfaceDistanceCall, distance_report};
use crate::memory_folder::Place;
use crate::merge::{MergeCall, MergeResult, store};
use crate::merge_to_file::{FileCall, written};
use crate::merger::Merger;
use crate::mesh::Mesh;
use crate::params::no_others;
use crate::paths::FsPath;
use crate::quads::{QuadCall, QuadGrid};
use crate::range_image::RangeImage;
use crate::ready::ReadCall;
use crate::reconstruct::{Reconstructed, Reconstructor, SurfaceCall};
use crate::regions::Plane;
use crate::report;
use crate::scan::{ScanCall, scanned};
use crate::scans::{OpenCall, ScanSet};
use crate::sculpt::{PrepareCall, RefineCall, Sculpted, Sculptor};
use crate::select::PlaneCall;

/// A long call on a thread of its own: start it, ask for its progress, cancel it, fetch its result.
///
/// Made by ``Job.dominant_plane``, ``Job.align``, ``Job.aligner``, ``Job.merge``, ``Job.merge_to_file``, ``Job.sculptor``, ``Job.refine``, ``Job.adaptive_quads``, ``Job.surface``, ``Job.cluster``, ``Job.close``, ``Job.distances``,
/// ``Job.surface_distance``, ``Job.virtual_scan``, ``Job.open`` or ``Job.read``. Dropping a running job cancels it.
///
/// >>> job = surfrecon.Job.merge(scans)
/// >>> while not job.done():
/// ...     stage, share = job.progress()  # a host draws its window meanwhile
/// >>> mesh = job.result().mesh
#[pyclass(frozen, module = "surfrecon")]
pub struct Job {
    call: Background,
}

impl Job {
    fn of(call: PyResult<Background>) -> PyResult<Self> {
        Ok(Job { call: call? })
    }
}

#[pymethods]
impl Job {
    /// Starts ``surfrecon.dominant_plane`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``dominant_plane``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: plane
    #[pyo3(signature = (scans, **options), text_signature = "(scans, *, tolerance=None, min_share=0.05, margin=None, threads=0)")]
    fn dominant_plane(scans: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = PlaneCall::new(scans, options)?;
        Job::of(Background::start(move |progress| made_class(Plane::from(call.run(progress)?))))
    }

    /// Starts ``surfrecon.align`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``align``, at once. InputError for arrays of another shape. Other errors are raised by
    ///         ``result``.
    #[staticmethod]
    // options: align
    #[pyo3(signature = (scans, *, fixed = None, picks = None, trusted = None, rejected = None, axis = None, angles = None, **options), text_signature = "(scans, *, start='auto', reach=None, turntable='no', tolerance=None, min_overlap=0.03, use_colour=True, threads=0, fixed=None, picks=None, trusted=None, rejected=None, axis=None, angles=None)")]
    #[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn align(
        scans: &Bound<'_, PyAny>,
        fixed: Option<&Bound<'_, PyAny>>,
        picks: Option<&Bound<'_, PyAny>>,
        trusted: Option<&Bound<'_, PyAny>>,
        rejected: Option<&Bound<'_, PyAny>>,
        axis: Option<&Bound<'_, PyAny>>,
        angles: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = AlignCall::new(options, || constraints(fixed, picks, trusted, rejected, axis, angles))?;
        let scans = call.scans(scans)?;
        Job::of(Background::start_calls(&[READING, 1.0 - READING], move |calls| {
            call.check(&scans)?;
            let ready = scans.run(calls.begin(0))?;
            made_class(call.run(ready, calls.begin(1))?)
        }))
    }

    /// Starts ``surfrecon.Aligner`` with the same arguments but ``progress``: the result is one.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``Aligner``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: align only threads
    #[pyo3(signature = (scans, **options), text_signature = "(scans, *, threads=0)")]
    fn aligner(scans: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = ReadCall::with_options(scans, options)?;
        Job::of(Background::start(move |progress| made_class(Aligner::from(call.run(progress)?))))
    }

    /// Starts ``surfrecon.merge`` with the same arguments but ``progress``, or ``Merger.merge``, of a ``Merger`` in the place of scans.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``merge``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: merge
    #[pyo3(signature = (scans, *, measure = false, files = None, max_memory = None, workspace = None, **options), text_signature = "(scans, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, match_exposure=True, edge_limit=None, grazing_limit=1.5707963267948966, threads=0, measure=False, files=None, max_memory=None, workspace=None)")]
    fn merge(
        scans: &Bound<'_, PyAny>,
        measure: bool,
        files: Option<&str>,
        max_memory: Option<&Bound<'_, PyAny>>,
        workspace: Option<FsPath>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let store = store(files, max_memory, workspace)?;
        let call = match scans.cast::<Merger>() {
            Ok(merger) => MergeCall::incremental(merger.get().call(), measure, store, options),
            Err(_) => MergeCall::new(scans, measure, store, options),
        }?;
        Job::of(Background::start_calls(&[call.merging(), 1.0 - call.merging()], move |calls| {
            let merged = call.run(calls.begin(0))?;
            made(call.measured(merged, calls.begin(1))?, |py, merged| {
                Ok(Bound::new(py, MergeResult::new(py, merged)?)?.into_any())
            })
        }))
    }

    /// Starts ``surfrecon.merge_to_file`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, InputError, TypeError: an option out of its range or of another kind, at once. Other errors are raised by
    ///         ``result``.
    #[staticmethod]
    // options: merge
    #[pyo3(signature = (scans, path, *, max_memory = None, workspace = None, keep = false, encoding = None, part_triangles = None, provenance = None, **options), text_signature = "(scans, path, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, match_exposure=True, edge_limit=None, grazing_limit=1.5707963267948966, threads=0, max_memory=None, workspace=None, keep=False, encoding=None, part_triangles=None, provenance=None)")]
    #[expect(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn merge_to_file(
        scans: &Bound<'_, PyAny>,
        path: Place,
        max_memory: Option<&Bound<'_, PyAny>>,
        workspace: Option<FsPath>,
        keep: bool,
        encoding: Option<&str>,
        part_triangles: Option<&Bound<'_, PyAny>>,
        provenance: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let write = written(encoding, part_triangles, provenance)?;
        let call = FileCall::new(scans, path, max_memory, (workspace, keep), write, options)?;
        Job::of(Background::start(move |progress| made(call.run(progress)?, |py, report| report::of(py, &report))))
    }

    /// Starts ``surfrecon.distances`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     InputError, TypeError: like ``distances``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    #[pyo3(signature = (points, mesh, *, signed = false, crs = None, threads = None, **others),
        text_signature = "(points, mesh, *, signed=False, crs=None, threads=None)")]
    fn distances(
        points: &Bound<'_, PyAny>,
        mesh: &Bound<'_, PyAny>,
        signed: bool,
        crs: Option<CrsText>,
        threads: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Job.distances", others)?;
        let call = DistanceCall::new(points, mesh, signed, crs, threads)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, distances| Ok(PyArray1::from_vec(py, distances).into_any()))
        }))
    }

    /// Starts ``surfrecon.surface_distance`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError: like ``surface_distance``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    #[pyo3(signature = (mesh, reference, *, signed = false, threads = None, **others),
        text_signature = "(mesh, reference, *, signed=False, threads=None)")]
    fn surface_distance(
        mesh: &Mesh,
        reference: &Mesh,
        signed: bool,
        threads: Option<&Bound<'_, PyAny>>,
        others: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        no_others("Job.surface_distance", others)?;
        let call = SurfaceDistanceCall::new(mesh, reference, signed, threads)?;
        Job::of(Background::start(move |progress| made(call.run(progress)?, distance_report)))
    }

    /// Starts ``surfrecon.virtual_scan`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``virtual_scan``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: scan
    #[pyo3(signature = (mesh, cameras, **options), text_signature = "(mesh, cameras, *, noise=0.0, noise_grazing=0.0, quantum=0.0, dropout=0.0, dropout_grazing=0.0, max_range=None, backfaces=False, pose_shift=0.0, pose_turn=0.0, seed=0, threads=0)")]
    fn virtual_scan(mesh: &Mesh, cameras: &Bound<'_, PyAny>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = ScanCall::new(mesh, cameras, options)?;
        Job::of(Background::start(move |progress| {
            progress.plan(&[("scanning", 1.0)]);
            let images = call.run(|index, count| part(progress, index, count))?;
            let single = call.single;
            made(images, move |py, images| scanned(py, images, single))
        }))
    }

    /// Starts ``surfrecon.open`` with the same arguments.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``open``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: open
    #[pyo3(signature = (paths, *, camera = None, crs = None, **options), text_signature = "(paths, *, scale=None, offset=0.0, step=None, invalid=None, depth='planar', pixels='auto', max_decoded_gib=4.0, allow_outside=False, poses='auto', axes='auto', camera=None, crs=None)")]
    fn open(
        paths: &Bound<'_, PyAny>,
        camera: Option<&Bound<'_, PyAny>>,
        crs: Option<CrsText>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = OpenCall::new(paths, camera, crs, options)?;
        Job::of(Background::start(move |progress| {
            progress.plan(&[("opening", 1.0)]);
            made(call.run(progress)?, |py, set| Ok(Bound::new(py, ScanSet::new(py, set)?)?.into_any()))
        }))
    }

    /// Reads scans that ``surfrecon.open`` found, one after the other. The result is a list of what ``Scan.read`` gives.
    ///
    /// Raises:
    ///     TypeError: anything but scans. Other errors are raised by ``result``.
    #[staticmethod]
    fn read(scans: Vec<Py<Scan>>) -> PyResult<Self> {
        let scans: Vec<_> = scans.iter().map(|scan| scan.get().scan.clone()).collect();
        Job::of(Background::start(move |progress| {
            progress.plan(&[("reading", 1.0)]);
            let read = |(index, scan): (usize, &surfrecon::import::FileScan)| {
                scan.read_with(&part(progress, index, scans.len()))
            };
            let contents = scans.iter().enumerate().map(read).collect::<surfrecon::Result<Vec<_>>>()?;
            made(contents, |py, contents| {
                let objects = contents.into_iter().map(|content| content_object(py, content));
                Ok(PyList::new(py, objects.collect::<PyResult<Vec<_>>>()?)?.into_any())
            })
        }))
    }

    /// Starts ``Sculptor`` with the same arguments: the result is one.
    ///
    /// Raises:
    ///     ParameterError: like ``Sculptor``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: sculpt but tolerance relative_tolerance
    #[pyo3(signature = (image, **options), text_signature = "(image, *, effort=1, interpolate=True, min_angle=0.0, simplify_borders=False, edge_limit=None, grazing_limit=1.5707963267948966, threads=0)")]
    fn sculptor(image: &RangeImage, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = PrepareCall::new(image, options)?;
        Job::of(Background::start(move |progress| {
            progress.plan(&[("preparing", 1.0)]);
            made_class(call.run(progress)?)
        }))
    }

    /// Starts ``Sculptor.refine`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, InputError: like ``Sculptor.refine``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: sculpt only tolerance relative_tolerance
    #[pyo3(signature = (sculptor, **options), text_signature = "(sculptor, *, tolerance=None, relative_tolerance=0.001)")]
    fn refine(sculptor: &Sculptor, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = RefineCall::new(sculptor, options)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, (core, [rows, cols])| {
                Ok(Bound::new(py, Sculpted::new(py, core, rows, cols)?)?.into_any())
            })
        }))
    }

    /// Starts ``surfrecon.adaptive_quads`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, InputError, TypeError: an option out of its range, both errors given, no such option, all at once.
    ///     Other errors are raised by ``result``.
    #[staticmethod]
    // options: quads
    #[pyo3(signature = (image, **options), text_signature = "(image, *, tiles_down=None, tiles_across=None, rows=9, columns=9, max_error=None, rms_error=None, gap_passes=1, gap_neighbours=8, curvature_unit=0.001, curvature_limit=255, exponent=0.7, floor=2.0, smoothing=2.0, background_curvature=None, coverage=0.5, threads=0)")]
    fn adaptive_quads(image: &RangeImage, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = QuadCall::new(image, options)?;
        Job::of(Background::start(move |progress| made_class(QuadGrid::from(call.run(progress)?))))
    }

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

    /// Starts ``surfrecon.cluster`` with the same arguments but ``progress``. With ``levels``, a list of numbers of vertices, or
    /// of triangles by ``levels_of``, ``surfrecon.cluster_levels``, whose list is the result.
    ///
    /// Raises:
    ///     ParameterError, InputError: like ``cluster``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: cluster
    #[pyo3(signature = (mesh, *, levels = None, levels_of = None, **options), text_signature = "(mesh, *, vertices=None, patches=None, max_error=None, triangles=None, adaptivity=1.0, iterations=40, relaxation=50, fitting=0, min_angle=0.0, feature_angle=0.6981317007977318, seed=0, threads=0, levels=None, levels_of=None)")]
    fn cluster(
        mesh: &Bound<'_, PyAny>,
        levels: Option<Vec<Bound<'_, PyAny>>>,
        levels_of: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = ClusterCall::new(mesh, levels, levels_of, options)?;
        let chain = call.chain;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, move |py, levels| clustered(py, levels, chain))
        }))
    }

    /// Starts ``surfrecon.close`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``close``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: close
    #[pyo3(signature = (mesh, scans = None, **options), text_signature = "(mesh, scans = None, *, openings='all', max_hole_length=None, cell=None, merge_distance=None, flat_base=False, force=False, base_up='z', threads=0)")]
    fn close(mesh: &Mesh, scans: Option<&Bound<'_, PyAny>>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = CloseCall::new(mesh, scans, options)?;
        Job::of(Background::start(move |progress| {
            made(call.run(progress)?, |py, closed| Ok(Bound::new(py, Closed::new(py, closed)?)?.into_any()))
        }))
    }

    /// Name of the running stage, and the share of the whole that is done: 0 to 1, never falling.
    fn progress(&self) -> (&'static str, f64) {
        self.call.progress()
    }

    /// Asks the work to stop, which it does within a tenth of a second. ``result`` then raises ``Cancelled``.
    ///
    /// >>> job = surfrecon.Job.align(scans)
    /// >>> job.cancel()
    /// >>> try:
    /// ...     aligned = job.result()
    /// ... except surfrecon.Cancelled:
    /// ...     aligned = None
    fn cancel(&self) {
        self.call.cancel();
    }

    /// Whether the work has ended, in whatever way. Also true once the result was fetched, and in a process forked from the
    /// job's, where nobody works on it.
    ///
    /// A cancelled job has ended as soon as its work has. Its thread may still be giving memory back.
    fn done(&self) -> bool {
        self.call.done()
    }

    /// Waits for the end and hands out what the call returns, once only.
    ///
    /// Raises:
    ///     Cancelled: after ``cancel``.
    ///     RuntimeError: the result was fetched before, or another process started the job.
    ///     others: like the call itself.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.call.result(py)
    }

    fn __repr__(&self) -> String {
        let (stage, fraction) = self.progress();
        format!("<Job {stage} {:.0} %>", fraction * 100.0)
    }
}
