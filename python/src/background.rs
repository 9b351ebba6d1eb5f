//! A call on a thread of its own: started, watched, cancelled, waited for. Nothing in the thread is Python.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use pyo3::PyClass;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use surfrecon::{Progress, Tick, context, memory};

use crate::errors::{input_error, internal_error, to_python};

/// The result of a call, as a step that makes Python's object of it. The step must wait until Python asks.
pub type Made = Box<dyn FnOnce(Python<'_>) -> PyResult<Py<PyAny>> + Send>;

/// The value of a call, and how it becomes Python's object.
pub fn made<T: Send + 'static>(
    value: T,
    object: impl for<'py> FnOnce(Python<'py>, T) -> PyResult<Bound<'py, PyAny>> + Send + 'static,
) -> surfrecon::Result<Made> {
    Ok(Box::new(move |py| object(py, value).map(Bound::unbind)))
}

/// The value of a call that is Python's object as it is.
pub fn made_class<T: PyClass + Into<PyClassInitializer<T>> + Send + 'static>(value: T) -> surfrecon::Result<Made> {
    made(value, |py, value| Ok(Bound::new(py, value)?.into_any()))
}

type Outcome = std::thread::Result<surfrecon::Result<Made>>;

/// A call at work, or done.
pub struct Background {
    watched: Arc<Calls>,
    /// The progress shown last: it never falls.
    highest: Mutex<f64>,
    thread: Mutex<Option<JoinHandle<Outcome>>>,
    /// The process of the thread. A process that is forked from it has a job without the thread.
    process: u32,
}

impl Background {
    /// Starts a call.
    pub fn start(call: impl FnOnce(&Progress<'static>) -> surfrecon::Result<Made> + Send + 'static) -> PyResult<Self> {
        Background::start_calls(&[1.0], |calls| call(calls.begin(0)))
    }

    /// Starts several calls with these shares of the time.
    pub fn start_calls(
        shares: &[f64],
        work: impl FnOnce(&Calls) -> surfrecon::Result<Made> + Send + 'static,
    ) -> PyResult<Self> {
        let watched = Arc::new(Calls::new(shares));
        let calls = watched.clone();
        let context = context::chosen();
        let work = move || {
            if context.is_some() {
                drop(context::choose(context));
            }
            let outcome = catch_unwind(AssertUnwindSafe(|| memory::guarded(|| work(&calls))));
            calls.succeeded.store(matches!(outcome, Ok(Ok(_))), Relaxed);
            outcome
        };
        let thread = std::thread::Builder::new()
            .name("surfrecon-job".to_owned())
            .spawn(work)
            .map_err(|e| input_error(format!("the system refuses another thread: {e}")))?;
        Ok(Background {
            watched,
            highest: Mutex::new(0.0),
            thread: Mutex::new(Some(thread)),
            process: std::process::id(),
        })
    }

    /// Name of the running stage, and the share of the whole that is done.
    pub fn progress(&self) -> (&'static str, f64) {
        let mut highest = self.highest.lock().unwrap_or_else(PoisonError::into_inner);
        if !self.is_here() {
            return ("running in another process", *highest);
        }
        let tick = self.watched.tick();
        *highest = highest.max(tick.fraction);
        (tick.stage, *highest)
    }

    /// Asks the work to stop.
    pub fn cancel(&self) {
        self.watched.cancel();
    }

    /// Whether the work has ended, or is somebody else's.
    pub fn done(&self) -> bool {
        !self.is_here() || self.watched.is_stopping() || self.thread().as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Waits for the end and hands out what the call gave, once.
    pub fn result<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        if !self.is_here() {
            return Err(PyRuntimeError::new_err(format!(
                "this job runs in process {}, from which this one was forked: fetch its result there",
                self.process
            )));
        }
        let Some(thread) = self.thread().take() else {
            return Err(PyRuntimeError::new_err(
                "the result of this job was already fetched: keep what .result() returns",
            ));
        };
        if self.watched.is_stopping() && !thread.is_finished() {
            // Nobody waits for memory that is given back.
            return Err(to_python(&surfrecon::Error::Cancelled));
        }
        // Ctrl-C ends the waiting, not the job: its result can be fetched later.
        while !thread.is_finished() {
            if let Err(signal) = py.check_signals() {
                *self.thread() = Some(thread);
                return Err(signal);
            }
            py.detach(|| std::thread::sleep(std::time::Duration::from_millis(2)));
        }
        match py.detach(|| thread.join()) {
            Ok(Ok(Ok(object))) => Ok(object(py)?.into_bound(py)),
            Ok(Ok(Err(error))) => Err(to_python(&error)),
            Ok(Err(panic)) | Err(panic) => Err(internal_error(&*panic)),
        }
    }

    fn thread(&self) -> MutexGuard<'_, Option<JoinHandle<Outcome>>> {
        self.thread.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_here(&self) -> bool {
        self.process == std::process::id()
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.watched.cancel();
        if !self.is_here() {
            // Its thread's number may be that of another thread here.
            let thread = self.thread.get_mut().unwrap_or_else(PoisonError::into_inner);
            std::mem::forget(thread.take());
        }
    }
}

/// The calls that a job makes one after the other, each with a progress of its own and its share of the time.
pub struct Calls {
    list: Vec<(Progress<'static>, f64)>,
    running: AtomicUsize,
    /// Whether all of them have succeeded.
    succeeded: AtomicBool,
}

impl Calls {
    fn new(shares: &[f64]) -> Self {
        let list = shares.iter().map(|&share| (Progress::none(), share)).collect();
        Calls { list, running: AtomicUsize::new(0), succeeded: AtomicBool::new(false) }
    }

    /// The progress of a call that begins.
    pub fn begin(&self, index: usize) -> &Progress<'static> {
        self.running.store(index, Relaxed);
        &self.list[index].0
    }

    /// The place of the running call within all.
    fn tick(&self) -> Tick {
        let index = self.running.load(Relaxed);
        let (whole, before) = (self.share_of(self.list.len()), self.share_of(index));
        let (progress, share) = &self.list[index];
        let tick = progress.tick();
        let done = self.succeeded.load(Relaxed);
        Tick { fraction: if done { 1.0 } else { (before + share * tick.fraction) / whole }, ..tick }
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

/// Units of progress of a part of a call.
const PART: usize = 1000;

/// The progress of part `index` of a call of equal parts that `whole` watches. Its running stage counts up to [`PART`] a part.
pub fn part<'a>(whole: &'a Progress<'static>, index: usize, count: usize) -> Progress<'a> {
    Progress::new(move |tick: Tick| {
        whole.stage(0, (count * PART) as u64);
        let done = index * PART + (tick.fraction * PART as f64) as usize;
        if whole.advance(done as u64).is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    })
}
