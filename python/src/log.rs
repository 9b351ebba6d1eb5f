//! Messages of calls to Python: to the logger `surfrecon`, or to the function of a context.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::{PyTraverseError, PyVisit};
use surfrecon::log::{self, Level, Log};

use crate::calling::attached;

/// A level as the module `logging` has it.
fn number(level: Level) -> u8 {
    match level {
        Level::Info => 20,
        Level::Warning => 30,
    }
}

/// Calls with the interpreter lock. An exception fails no call, as in handlers of `logging`, but Ctrl-C is not lost.
fn call(function: impl FnOnce(Python<'_>) -> PyResult<()>) {
    // Once Python ends nobody listens.
    let _ = attached(|py| {
        match function(py) {
            Err(raised) if raised.is_instance_of::<PyKeyboardInterrupt>(py) => {
                py.import("_thread")?.call_method0("interrupt_main")?;
            }
            Err(raised) => raised.write_unraisable(py, None),
            Ok(()) => (),
        }
        Ok(())
    });
}

/// Has the logger hear what no context's function does.
///
/// # Errors
/// None but of Python itself.
pub fn to_logger(py: Python<'_>) -> PyResult<()> {
    let logger = py.import("logging")?.call_method1("getLogger", ("surfrecon",))?.unbind();
    log::set(Log::To(Arc::new(move |level, text| {
        call(|py| {
            let logger = logger.bind(py);
            if is_heard(logger)? {
                logger.call_method1("log", (number(level), text))?;
            }
            Ok(())
        });
    })));
    Ok(())
}

/// Whether a logger or one above it has a handler: without, Python would print warnings, which a library leaves to its program. Runs none
/// of Python's code, in which a signal's handler could raise what would be lost here.
fn is_heard(logger: &Bound<'_, PyAny>) -> PyResult<bool> {
    let mut at = logger.clone();
    loop {
        if at.getattr("handlers")?.len()? > 0 {
            return Ok(true);
        }
        let above = at.getattr("parent")?;
        if above.is_none() || !at.getattr("propagate")?.is_truthy()? {
            return Ok(false);
        }
        at = above;
    }
}

/// A function of Python's that is told, until its context is no more.
pub struct Listener(Mutex<Option<Py<PyAny>>>);

impl Listener {
    pub fn new(function: Py<PyAny>) -> Arc<Self> {
        Arc::new(Listener(Mutex::new(Some(function))))
    }

    /// The function.
    pub fn function(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(|function| function.clone_ref(py))
    }

    /// A log that tells the function.
    pub fn log(self: &Arc<Self>) -> Log {
        let listener = self.clone();
        Log::To(Arc::new(move |level, text| {
            call(|py| match listener.function(py) {
                Some(function) => function.call1(py, (number(level), text)).map(drop),
                None => Ok(()),
            });
        }))
    }

    /// Shows Python's collector of garbage what is held.
    pub fn traverse(&self, visit: &PyVisit<'_>) -> Result<(), PyTraverseError> {
        match self.0.try_lock() {
            Ok(function) => visit.call(&*function),
            Err(_) => Ok(()),
        }
    }

    /// Lets go of the function.
    pub fn forget(&self) {
        let function = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        drop(function);
    }
}
