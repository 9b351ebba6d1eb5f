//! Paths as Python has them: texts, bytes of the system's own coding, and objects that say one of these.

use std::path::PathBuf;

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

/// A path that Python hands over.
pub struct FsPath(pub PathBuf);

impl<'py> FromPyObject<'_, 'py> for FsPath {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        of(&given).map(FsPath)
    }
}

/// Takes a path as ``os.fsdecode`` does.
///
/// # Errors
/// `TypeError` for what is no path.
pub fn of(given: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    let error = match given.extract::<PathBuf>() {
        Err(error) if error.is_instance_of::<PyTypeError>(given.py()) => error,
        outcome => return outcome,
    };
    let decoded = given.py().import("os")?.call_method1("fsdecode", (given,));
    decoded.map_err(|_| error)?.extract()
}
