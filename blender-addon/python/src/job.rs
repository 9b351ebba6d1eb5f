//! A long call on a thread of its own, for hosts whose main thread must stay free. Nothing in the thread is Python.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use numpy::PyArray1;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use surfrecon::cluster::Clustered as CoreClustered;
use surfrecon::import::Content;
use surfrecon::mesh::certify::Certified;
use surfrecon::plane::DominantPlane;
use surfrecon::quads::QuadGrid as CoreQuads;
use surfrecon::sculpt::Sculpted as Core;
use surfrecon::{Progress, Tick, memory};

use crate::align::{AlignCall, Aligner, Alignment, READING};
use crate::cluster::{ClusterCall, Clustered};
use crate::constraints::constraints;
use crate::errors::{input_error, internal_error, to_python};
use crate::measure::{DistanceCall, SurfaceDistanceCall, certified_dict};
use crate::merge::{Measured, MergeCall, MergeResult};
use crate::mesh::Mesh;

use crate::frame::{Scan, content_object};
use crate::quads::{QuadCall, QuadGrid};
use crate::range_image::RangeImage;
use crate::ready::ReadCall;
use crate::reconstruct::{Reconstructed, Reconstructor, SurfaceCall};
use crate::regions::Plane;
use crate::scan::{ScanCall, scanned};
use crate::scans::{OpenCall, ScanSet};
use crate::sculpt::{PrepareCall, RefineCall, Sculpted, Sculptor};
use crate::select::PlaneCall;

/// What a call gives.
enum Made {
    Plane(DominantPlane),
    Aligned(Box<Alignment>),
    Ready(Aligner),
    Merged(Box<Measured>),
    Distances(Vec<f64>),
    Certified(Box<Certified>),
    /// One or, as a list, any number.
    Scanned(Vec<surfrecon::RangeImage>, bool),
    Read(Vec<Content>),
    Opened(Box<surfrecon::import::ScanSet>),
    Prepared(Box<Sculptor>),
    Sculpted(Box<(Core, [usize; 2])>),
    Quads(Box<CoreQuads>),
    Reconstructed(Box<surfrecon::reconstruct::Reconstructed>),
    /// One or, as a list, any number.
    Clustered(Vec<CoreClustered>, bool),
}

type Outcome = std::thread::Result<surfrecon::Result<Made>>;

/// A long call on a thread of its own: start it, ask for its progress, cancel it, fetch its result.
///
/// Made by ``Job.dominant_plane``, ``Job.align``, ``Job.aligner``, ``Job.merge``, ``Job.sculptor``, ``Job.refine``, ``Job.adaptive_quads``, ``Job.surface``, ``Job.cluster``, ``Job.distances``,
/// ``Job.surface_distance``, ``Job.virtual_scan``, ``Job.open`` or ``Job.read``. Dropping a running job cancels it.
#[pyclass(frozen, module = "surfrecon")]
pub struct Job {
    watched: Arc<Calls>,
    /// The progress shown last: it never falls.
    highest: Mutex<f64>,
    thread: Mutex<Option<JoinHandle<Outcome>>>,
    /// Where the thread is: a process that is forked from this one has a job without it.
    process: u32,
}

/// The calls that a job makes one after the other, each with a progress of its own and its share of the time.
struct Calls {
    list: Vec<(Progress<'static>, f64)>,
    running: AtomicUsize,
}

impl Calls {
    fn new(shares: &[f64]) -> Self {
        let list = shares.iter().map(|&share| (Progress::none(), share)).collect();
        Calls { list, running: AtomicUsize::new(0) }
    }

    /// The progress of a call that begins.
    fn begin(&self, index: usize) -> &Progress<'static> {
        self.running.store(index, Relaxed);
        &self.list[index].0
    }

    /// Where the running call stands within all.
    fn tick(&self) -> Tick {
        let index = self.running.load(Relaxed);
        let (whole, before) = (self.share_of(self.list.len()), self.share_of(index));
        let (progress, share) = &self.list[index];
        let tick = progress.tick();
        Tick { fraction: (before + share * tick.fraction) / whole, ..tick }
    }

    fn share_of(&self, calls: usize) -> f64 {
        self.list[..calls].iter().map(|(_, share)| share).sum()
    }

    fn cancel(&self) {
        self.list.iter().for_each(|(progress, _)| progress.cancel());
    }

    fn is_stopping(&self) -> bool {
        self.list.iter().any(|(progress, _)| progress.is_stopping())
    }
}

impl Job {
    fn start(call: impl FnOnce(&Progress<'static>) -> surfrecon::Result<Made> + Send + 'static) -> PyResult<Self> {
        Job::start_calls(&[1.0], |calls| call(calls.begin(0)))
    }

    /// Starts a job of several calls with these shares of the time.
    fn start_calls(
        shares: &[f64],
        work: impl FnOnce(&Calls) -> surfrecon::Result<Made> + Send + 'static,
    ) -> PyResult<Self> {
        let watched = Arc::new(Calls::new(shares));
        let calls = watched.clone();
        let work = move || catch_unwind(AssertUnwindSafe(|| memory::guarded(|| work(&calls))));
        let thread = std::thread::Builder::new()
            .name("surfrecon-job".to_owned())
            .spawn(work)
            .map_err(|e| input_error(format!("the system refuses another thread: {e}")))?;
        Ok(Job { watched, highest: Mutex::new(0.0), thread: Mutex::new(Some(thread)), process: std::process::id() })
    }

    fn is_here(&self) -> bool {
        self.process == std::process::id()
    }
}

/// Units of progress of a part of a call.
const PART: usize = 1000;

/// The progress of part `index` of a call of equal parts that `whole` watches; its running stage counts up to [`PART`] a part.
fn part<'a>(whole: &'a Progress<'static>, index: usize, count: usize) -> Progress<'a> {
    Progress::new(move |tick: Tick| {
        whole.stage(0, (count * PART) as u64);
        let done = index * PART + (tick.fraction * PART as f64) as usize;
        if whole.advance(done as u64).is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    })
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
        Job::start(move |progress| Ok(Made::Plane(call.run(progress)?)))
    }

    /// Starts ``surfrecon.align`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``align``, at once; InputError for arrays of another shape. Other errors are raised by
    ///     ``result``.
    #[staticmethod]
    // options: align
    #[pyo3(signature = (scans, *, fixed = None, picks = None, trusted = None, rejected = None, axis = None, angles = None, **options), text_signature = "(scans, *, start='unknown', reach=None, turntable='no', tolerance=None, min_overlap=0.03, use_colour=True, threads=0, fixed=None, picks=None, trusted=None, rejected=None, axis=None, angles=None)")]
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
        Job::start_calls(&[READING, 1.0 - READING], move |calls| {
            call.check(&scans)?;
            let ready = scans.run(calls.begin(0))?;
            Ok(Made::Aligned(Box::new(call.run(ready, calls.begin(1))?)))
        })
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
        Job::start(move |progress| Ok(Made::Ready(call.run(progress)?.into())))
    }

    /// Starts ``surfrecon.merge`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``merge``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: merge
    #[pyo3(signature = (scans, *, measure = false, **options), text_signature = "(scans, *, voxel=None, merge_distance=None, max_hole_length=None, min_component_share=0.0, edge_limit=None, grazing_limit=1.5707963267948966, threads=0, measure=False)")]
    fn merge(scans: &Bound<'_, PyAny>, measure: bool, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = MergeCall::new(scans, measure, options)?;
        Job::start_calls(&[call.merging(), 1.0 - call.merging()], move |calls| {
            let merged = call.run(calls.begin(0))?;
            Ok(Made::Merged(Box::new(call.measured(merged, calls.begin(1))?)))
        })
    }

    /// Starts ``surfrecon.distances`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     InputError, TypeError: like ``distances``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    #[pyo3(signature = (points, mesh, *, signed = false, threads = None))]
    fn distances(
        points: &Bound<'_, PyAny>,
        mesh: &Bound<'_, PyAny>,
        signed: bool,
        threads: Option<i64>,
    ) -> PyResult<Self> {
        let call = DistanceCall::new(points, mesh, signed, threads)?;
        Job::start(move |progress| Ok(Made::Distances(call.run(progress)?)))
    }

    /// Starts ``surfrecon.surface_distance`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError: like ``surface_distance``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    #[pyo3(signature = (mesh, reference, *, signed = false, threads = None))]
    fn surface_distance(mesh: &Mesh, reference: &Mesh, signed: bool, threads: Option<i64>) -> PyResult<Self> {
        let call = SurfaceDistanceCall::new(mesh, reference, signed, threads)?;
        Job::start(move |progress| Ok(Made::Certified(Box::new(call.run(progress)?))))
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
        Job::start(move |progress| {
            progress.plan(&[("scanning", 1.0)]);
            let images = call.run(|index, count| part(progress, index, count))?;
            Ok(Made::Scanned(images, call.single))
        })
    }

    /// Starts ``surfrecon.open`` with the same arguments.
    ///
    /// Raises:
    ///     ParameterError, TypeError: like ``open``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: open
    #[pyo3(signature = (paths, *, camera = None, **options), text_signature = "(paths, *, scale=None, offset=0.0, step=None, invalid=None, depth='planar', pixels='auto', max_decoded_gib=4.0, allow_outside=False, camera=None)")]
    fn open(paths: &Bound<'_, PyAny>, camera: Option<[f64; 4]>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = OpenCall::new(paths, camera, options)?;
        Job::start(move |progress| {
            progress.plan(&[("opening", 1.0)]);
            Ok(Made::Opened(Box::new(call.run(progress)?)))
        })
    }

    /// Reads scans that ``surfrecon.open`` found, one after the other; the result is a list of what ``Scan.read`` gives.
    ///
    /// Raises:
    ///     TypeError: anything but scans. Other errors are raised by ``result``.
    #[staticmethod]
    fn read(scans: Vec<Py<Scan>>) -> PyResult<Self> {
        let scans: Vec<_> = scans.iter().map(|scan| scan.get().scan.clone()).collect();
        Job::start(move |progress| {
            progress.plan(&[("reading", 1.0)]);
            let read =
                |(index, scan): (usize, &surfrecon::import::Scan)| scan.read_with(&part(progress, index, scans.len()));
            Ok(Made::Read(scans.iter().enumerate().map(read).collect::<surfrecon::Result<_>>()?))
        })
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
        Job::start(move |progress| {
            progress.plan(&[("preparing", 1.0)]);
            Ok(Made::Prepared(Box::new(call.run(progress)?)))
        })
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
        Job::start(move |progress| Ok(Made::Sculpted(Box::new(call.run(progress)?))))
    }

    /// Starts ``surfrecon.adaptive_quads`` with the same arguments but ``progress``.
    ///
    /// Raises:
    ///     ParameterError, InputError, TypeError: an option out of its range, both errors given, no such option; at once.
    ///     Other errors are raised by ``result``.
    #[staticmethod]
    // options: quads
    #[pyo3(signature = (image, **options), text_signature = "(image, *, tiles_down=None, tiles_across=None, rows=9, columns=9, max_error=None, rms_error=None, gap_passes=1, gap_neighbours=8, curvature_unit=0.001, curvature_limit=255, exponent=0.7, floor=2.0, smoothing=2.0, background_curvature=None, coverage=0.5, threads=0)")]
    fn adaptive_quads(image: &RangeImage, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = QuadCall::new(image, options)?;
        Job::start(move |progress| Ok(Made::Quads(Box::new(call.run(progress)?))))
    }

    /// Starts ``reconstructor.surface`` with the same arguments but ``progress``. While the reconstructor makes another
    /// surface the job waits for its turn.
    ///
    /// Raises:
    ///     ParameterError, InputError: like ``surface``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: reconstruct
    #[pyo3(signature = (reconstructor, **options), text_signature = "(reconstructor, *, factor=1.0, threshold='local', topology='manifold', closure='auto', threads=0)")]
    fn surface(reconstructor: &Reconstructor, options: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let call = SurfaceCall::new(reconstructor, options)?;
        Job::start(move |progress| Ok(Made::Reconstructed(Box::new(call.run_in_turn(progress)?))))
    }

    /// Starts ``surfrecon.cluster`` with the same arguments but ``progress``; with ``levels``, a list of numbers of vertices,
    /// ``surfrecon.cluster_levels``, whose list is the result.
    ///
    /// Raises:
    ///     ParameterError, InputError: like ``cluster``, at once. Other errors are raised by ``result``.
    #[staticmethod]
    // options: cluster
    #[pyo3(signature = (mesh, *, levels = None, **options), text_signature = "(mesh, *, vertices=None, patches=None, max_error=None, adaptivity=1.0, iterations=40, relaxation=50, fitting=0, seed=0, threads=0, levels=None)")]
    fn cluster(
        mesh: &Bound<'_, PyAny>,
        levels: Option<Vec<Bound<'_, PyAny>>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let call = ClusterCall::new(mesh, levels, options)?;
        let chain = call.chain;
        Job::start(move |progress| Ok(Made::Clustered(call.run(progress)?, chain)))
    }

    /// Name of the running stage, and the share of the whole that is done: 0 to 1, never falling.
    fn progress(&self) -> (&'static str, f64) {
        let mut highest = self.highest.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.is_here() {
            return ("running in another process", *highest);
        }
        let tick = self.watched.tick();
        *highest = highest.max(tick.fraction);
        (tick.stage, *highest)
    }

    /// Asks the work to stop, which it does within a tenth of a second; ``result`` then raises ``Cancelled``.
    fn cancel(&self) {
        self.watched.cancel();
    }

    /// Whether the work has ended, in whatever way. Also true once the result was fetched, and in a process forked from the
    /// job's, where nobody works on it.
    ///
    /// A cancelled job has ended as soon as its work has; its thread may still be giving memory back.
    fn done(&self) -> bool {
        if !self.is_here() {
            return true;
        }
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        self.watched.is_stopping() || thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the end and hands out what the call returns; once only.
    ///
    /// Raises:
    ///     Cancelled: after ``cancel``.
    ///     RuntimeError: the result was fetched before, or another process started the job.
    ///     others: like the call itself.
    fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if !self.is_here() {
            return Err(PyRuntimeError::new_err(format!(
                "this job runs in process {}, from which this one was forked: fetch its result there",
                self.process
            )));
        }
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(thread) = thread else {
            return Err(PyRuntimeError::new_err("the result of this job was already fetched"));
        };
        if self.watched.is_stopping() && !thread.is_finished() {
            // Nobody waits for memory that is given back.
            return Err(to_python(&surfrecon::Error::Cancelled));
        }
        // Ctrl-C ends the waiting, not the job: its result can be fetched later.
        while !thread.is_finished() {
            if let Err(signal) = py.check_signals() {
                *self.thread.lock().unwrap_or_else(PoisonError::into_inner) = Some(thread);
                return Err(signal);
            }
            py.detach(|| std::thread::sleep(std::time::Duration::from_millis(2)));
        }
        match py.detach(|| thread.join()) {
            Ok(Ok(Ok(Made::Plane(plane)))) => Ok(Bound::new(py, Plane::from(plane))?.into_any()),
            Ok(Ok(Ok(Made::Aligned(aligned)))) => Ok(Bound::new(py, *aligned)?.into_any()),
            Ok(Ok(Ok(Made::Ready(aligner)))) => Ok(Bound::new(py, aligner)?.into_any()),
            Ok(Ok(Ok(Made::Merged(merged)))) => Ok(Bound::new(py, MergeResult::new(py, *merged)?)?.into_any()),
            Ok(Ok(Ok(Made::Reconstructed(made)))) => Ok(Bound::new(py, Reconstructed::new(py, *made)?)?.into_any()),
            Ok(Ok(Ok(Made::Distances(distances)))) => Ok(PyArray1::from_vec(py, distances).into_any()),
            Ok(Ok(Ok(Made::Certified(found)))) => Ok(certified_dict(py, *found)?.into_any()),
            Ok(Ok(Ok(Made::Scanned(images, single)))) => scanned(py, images, single),
            Ok(Ok(Ok(Made::Opened(set)))) => Ok(Bound::new(py, ScanSet::new(py, *set)?)?.into_any()),
            Ok(Ok(Ok(Made::Read(contents)))) => {
                let contents =
                    contents.into_iter().map(|content| content_object(py, content)).collect::<PyResult<Vec<_>>>()?;
                Ok(PyList::new(py, contents)?.into_any())
            }
            Ok(Ok(Ok(Made::Prepared(sculptor)))) => Ok(Bound::new(py, *sculptor)?.into_any()),
            Ok(Ok(Ok(Made::Sculpted(made)))) => {
                let (core, [rows, cols]) = *made;
                Ok(Bound::new(py, Sculpted::new(py, core, rows, cols)?)?.into_any())
            }
            Ok(Ok(Ok(Made::Quads(quads)))) => Ok(Bound::new(py, QuadGrid::from(*quads))?.into_any()),
            Ok(Ok(Ok(Made::Clustered(levels, chain)))) => {
                let levels = levels
                    .into_iter()
                    .map(|level| Bound::new(py, Clustered::new(py, level)?))
                    .collect::<PyResult<Vec<_>>>()?;
                if chain {
                    return Ok(PyList::new(py, levels)?.into_any());
                }
                Ok(levels.into_iter().next().expect("one level was asked for").into_any())
            }
            Ok(Ok(Err(error))) => Err(to_python(&error)),
            Ok(Err(panic)) | Err(panic) => Err(internal_error(&*panic)),
        }
    }

    fn __repr__(&self) -> String {
        let (stage, fraction) = self.progress();
        format!("<Job {stage} {:.0} %>", fraction * 100.0)
    }
}

impl Drop for Job {
    fn drop(&mut self) {
        self.watched.cancel();
        if !self.is_here() {
            // Its thread's number may be that of another thread here.
            let thread = self.thread.get_mut().unwrap_or_else(PoisonError::into_inner);
            std::mem::forget(thread.take());
        }
    }
}
