//! Coordinate reference systems as Python has them: texts.

use pyo3::prelude::*;
use pyo3::types::PyString;
use surfrecon::mesh::Crs;

use crate::errors::to_python;

/// A text that is given for a system: what is no Unicode in it names none, as other letters that are none of text.
pub struct CrsText(String);

impl<'py> FromPyObject<'_, 'py> for CrsText {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        Ok(CrsText(given.cast::<PyString>()?.to_string_lossy().into_owned()))
    }
}

/// The system that a text names, empty for none.
///
/// # Errors
/// `InputError` for what names none.
pub fn crs_of(text: Option<CrsText>) -> PyResult<Option<Crs>> {
    given(text, Crs::new)
}

/// The system that somebody names for files, empty for none.
///
/// # Errors
/// `InputError` for what others can't look up.
pub fn told(text: Option<CrsText>) -> PyResult<Option<Crs>> {
    given(text, Crs::told)
}

fn given(text: Option<CrsText>, named: impl Fn(&str) -> surfrecon::Result<Crs>) -> PyResult<Option<Crs>> {
    let text = text.filter(|text| !text.0.is_empty());
    text.map(|text| named(&text.0)).transpose().map_err(|error| to_python(&error))
}

/// Its text.
pub fn text_of(crs: Option<&Crs>) -> Option<String> {
    crs.map(|crs| crs.text().to_owned())
}
