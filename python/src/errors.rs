//! The core's errors and panics -> the exceptions of `surfrecon._errors`.

use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::exceptions::{PyException, PyMemoryError};
use pyo3::prelude::*;
use surfrecon::{Error, memory};

/// An exception of `surfrecon._errors` by name.
fn exception(name: &str, text: &str) -> PyErr {
    Python::attach(|py| {
        let made = py.import("surfrecon._errors").and_then(|m| m.getattr(name)).and_then(|class| class.call1((text,)));
        made.map_or_else(|failure| failure, PyErr::from_value)
    })
}

/// An `InputError`.
pub fn input_error(text: String) -> PyErr {
    exception("InputError", &text)
}

/// A `ParameterError` of a value that the table of parameters does not know.
pub fn parameter_error(text: String) -> PyErr {
    exception("ParameterError", &text)
}

/// An `InternalError`: a broken invariant of ours.
pub fn internal_error(panic: &(dyn std::any::Any + Send)) -> PyErr {
    let what = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    let text = format!("internal error of surfrecon: report it with this text: {}", what.unwrap_or("no description"));
    exception("InternalError", &text)
}

/// The error for a value of the wrong kind, instead of Python's own. Ctrl-C and a lack of memory, which may come while a value is
/// looked at, stay as they are.
pub fn reworded(error: PyErr, words: impl FnOnce() -> PyErr) -> PyErr {
    let is_of_value =
        Python::attach(|py| error.is_instance_of::<PyException>(py) && !error.is_instance_of::<PyMemoryError>(py));
    if is_of_value { words() } else { error }
}

/// The exception of a core error.
pub fn to_python(error: &Error) -> PyErr {
    if let Error::Io { source, .. } = error
        && let Some(raised) = source.get_ref().and_then(|inner| inner.downcast_ref::<PyErr>())
    {
        // The exception that the caller's own function raised while it read or wrote.
        return Python::attach(|py| raised.clone_ref(py));
    }
    let name = match error {
        Error::Parameter { .. } => "ParameterError",
        Error::Format { .. } => "FormatError",
        Error::Io { .. } => "FileError",
        Error::OutOfMemory(_) => "OutOfMemoryError",
        Error::Cancelled => "Cancelled",
        _ => "InputError",
    };
    let made = exception(name, &error.to_string());
    if let Error::Io { path, source } = error {
        Python::attach(|py| {
            let value = made.value(py);
            // Attributes of OSError, for those who look at them; the text says it all.
            let _ = value.setattr("errno", errno(py, source));
            let _ = value.setattr("filename", path.as_os_str());
        });
    }
    made
}

/// The system's number of an error: what it said itself, else what stands for the kind of error.
fn errno(py: Python<'_>, error: &std::io::Error) -> Option<i32> {
    use std::io::ErrorKind;
    let name = match error.kind() {
        ErrorKind::NotFound => "ENOENT",
        ErrorKind::PermissionDenied => "EACCES",
        ErrorKind::AlreadyExists => "EEXIST",
        ErrorKind::StorageFull => "ENOSPC",
        _ => return error.raw_os_error(),
    };
    let standing = || py.import("errno").ok()?.getattr(name).ok()?.extract().ok();
    error.raw_os_error().or_else(standing)
}

/// Runs work of the core without the interpreter lock. A panic becomes an `InternalError` instead of ending the host.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> surfrecon::Result<T> + Send) -> PyResult<T> {
    // Whatever the panic left half done is dropped with the closure: nothing of it is looked at again.
    match py.detach(|| catch_unwind(AssertUnwindSafe(|| memory::guarded(work)))) {
        Ok(outcome) => outcome.map_err(|e| to_python(&e)),
        Err(panic) => Err(internal_error(&*panic)),
    }
}

/// Runs work that needs the interpreter lock: what it takes stays within the memory limit, and an allocation that is refused
/// becomes an `OutOfMemoryError`.
pub fn guarded<T>(work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    memory::guarded(|| Ok(work())).unwrap_or_else(|error: Error| Err(to_python(&error)))
}
