//! A Python callback and Ctrl-C -> the core's progress.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use surfrecon::{Progress, Tick};

/// Calls `callback(stage, fraction)` with the interpreter lock at every tick, on the calling thread, and with 1 at the end of what
/// succeeded. `False` cancels. An exception of the callback, or Ctrl-C, cancels as well and is kept for the caller.
pub struct Watch {
    callback: Option<Py<PyAny>>,
    raised: Mutex<Option<PyErr>>,
    /// The stage that was shown last.
    stage: Mutex<&'static str>,
    /// Whether it has cancelled: a part may end before it hears that, and then the next one must not begin.
    stopped: AtomicBool,
}

impl Watch {
    /// Watches with a callable, or only for Ctrl-C.
    pub fn new(callback: Option<Py<PyAny>>) -> Self {
        Watch { callback, raised: Mutex::new(None), stage: Mutex::new("starting"), stopped: AtomicBool::new(false) }
    }

    /// Runs `work` without the interpreter lock under this watch.
    pub fn run<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&Progress<'_>) -> surfrecon::Result<T> + Send,
    ) -> PyResult<T> {
        self.run_parts(py, |watch| work(&watch.part(0, 1)))
    }

    /// Like [`Watch::run`] for work of several parts, each of which gets its progress from [`Watch::part`].
    pub fn run_parts<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&Self) -> surfrecon::Result<T> + Send,
    ) -> PyResult<T> {
        let outcome = crate::errors::detached(py, || work(self));
        if outcome.is_ok() && !self.stopped.load(Ordering::Relaxed) {
            let stage = *self.stage.lock().unwrap_or_else(PoisonError::into_inner);
            // All is done: False can't cancel it any more.
            let _ = self.ask(Tick { stage, fraction: 1.0 });
        }
        match self.raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(raised) => Err(raised),
            None => outcome,
        }
    }

    /// The progress of part `index` of `count` of equal length.
    pub fn part(&self, index: usize, count: usize) -> Progress<'_> {
        let place = |index: usize| index as f64 / count as f64;
        self.span(place(index), place(index + 1))
    }

    /// The progress of what leads from one share of the whole to another.
    pub fn span(&self, from: f64, to: f64) -> Progress<'_> {
        Progress::new(move |tick| self.tick(Tick { fraction: from + (to - from) * tick.fraction, ..tick }))
    }

    fn tick(&self, tick: Tick) -> ControlFlow<()> {
        if self.stopped.load(Ordering::Relaxed) {
            return ControlFlow::Break(());
        }
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = tick.stage;
        let answer = self.ask(tick);
        self.stopped.store(answer.is_break(), Ordering::Relaxed);
        answer
    }

    fn ask(&self, tick: Tick) -> ControlFlow<()> {
        let go_on = Python::attach(|py| -> PyResult<bool> {
            py.check_signals()?;
            let Some(callback) = &self.callback else { return Ok(true) };
            let answer = callback.bind(py).call1((tick.stage, tick.fraction))?;
            // Only False cancels, numpy's, too: a callback without a return statement answers None.
            Ok(answer.extract::<bool>().unwrap_or(true))
        });
        match go_on {
            Ok(true) => ControlFlow::Continue(()),
            Ok(false) => ControlFlow::Break(()),
            Err(raised) => {
                *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(raised);
                ControlFlow::Break(())
            }
        }
    }
}
