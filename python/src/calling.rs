//! Calls of Python's functions from threads of ours while files are read and written. Once the interpreter ends, a thread that waits for its
//! lock is ended by it, and the program with it: so the end waits for calls that are under way, and none begins any more.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use pyo3::prelude::*;
use pyo3::types::PyCFunction;

static ENDING: AtomicBool = AtomicBool::new(false);
/// Calls that have begun, or look whether they may.
static CALLS: AtomicUsize = AtomicUsize::new(0);

/// How long the end of the interpreter waits for a function that does not come back.
const PATIENCE: Duration = Duration::from_secs(10);

/// Counts a call until it is dropped.
struct Counted;

impl Counted {
    fn new() -> Self {
        CALLS.fetch_add(1, Ordering::SeqCst);
        Counted
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        CALLS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Calls Python. An exception is the error's inner one.
///
/// # Errors
/// The exception that is raised. The end of Python.
pub fn attached<R>(call: impl FnOnce(Python<'_>) -> PyResult<R>) -> std::io::Result<R> {
    let _counted = Counted::new();
    if ENDING.load(Ordering::SeqCst) {
        return Err(std::io::Error::other(
            "the interpreter ends, and its functions can't be called any more: wait for \
            the call before it ends",
        ));
    }
    Python::attach(call).map_err(std::io::Error::other)
}

/// Has the end of the interpreter wait for calls.
///
/// # Errors
/// None but of Python itself.
pub fn watch_the_end(py: Python<'_>) -> PyResult<()> {
    let end = PyCFunction::new_closure(py, None, None, |arguments, _| {
        ENDING.store(true, Ordering::SeqCst);
        arguments.py().detach(|| {
            let began = Instant::now();
            while CALLS.load(Ordering::SeqCst) > 0 && began.elapsed() < PATIENCE {
                std::thread::sleep(Duration::from_millis(1));
            }
        });
    })?;
    py.import("atexit")?.call_method1("register", (end,))?;
    Ok(())
}
