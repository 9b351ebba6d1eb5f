//! Objects as pickle takes them: a kind and the parts of that, from which `_again` makes the object in another process, to the bit.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use surfrecon::import::{FileScan as CoreScan, Kept};
use surfrecon::mesh::Crs;

use crate::errors::to_python;

/// Gives pickle the function that makes an object again, and what that is called with.
pub type Reduced<'py> = (Bound<'py, PyAny>, (&'static str, Bound<'py, PyDict>));

/// Parts of an object under the names of its attributes.
///
/// # Errors
/// None but of Python itself.
pub fn attributes<'py>(of: &Bound<'py, PyAny>, names: &[&str]) -> PyResult<Bound<'py, PyDict>> {
    let parts = PyDict::new(of.py());
    names.iter().try_for_each(|name| parts.set_item(name, of.getattr(*name)?))?;
    Ok(parts)
}

/// Gives pickle an object of a kind that `_again` knows.
///
/// # Errors
/// None but of Python itself.
pub fn reduced<'py>(kind: &'static str, parts: Bound<'py, PyDict>) -> PyResult<Reduced<'py>> {
    Ok((parts.py().import("surfrecon._native")?.getattr("_again")?, (kind, parts)))
}

/// The coordinate reference system as a part: its text alone does not say whether a file means degrees.
pub fn crs_part(crs: Option<&Crs>) -> Option<(&str, bool)> {
    crs.map(|crs| (crs.text(), crs.is_in_degrees()))
}

/// Gives pickle a scan: the paths of its files, and what is not in them.
///
/// # Errors
/// `InputError` for a scan whose file lies in memory.
pub fn of_scan<'py>(py: Python<'py>, scan: &CoreScan) -> PyResult<Reduced<'py>> {
    let Kept { path, recording, text } = scan.kept().map_err(|error| to_python(&error))?;
    let parts = PyDict::new(py);
    parts.set_item("path", path)?;
    parts.set_item("recording", recording)?;
    parts.set_item("text", text)?;
    reduced("scan", parts)
}

/// Parts of a set of scans.
///
/// # Errors
/// None but of Python itself.
pub fn of_scans<'py, T: pyo3::PyTypeInfo>(
    py: Python<'py>,
    scans: &[Py<T>],
    notes: &[String],
) -> PyResult<Reduced<'py>> {
    let parts = PyDict::new(py);
    parts.set_item("scans", PyList::new(py, scans)?)?;
    parts.set_item("notes", notes)?;
    reduced("scans", parts)
}
