//! Coordinate reference systems as Python has them: texts.

use pyo3::prelude::*;
use surfrecon::mesh::Crs;

use crate::errors::to_python;

/// The system that a text names, empty for none.
///
/// # Errors
/// `InputError` for what names none.
pub fn crs_of(text: Option<&str>) -> PyResult<Option<Crs>> {
    text.filter(|text| !text.is_empty()).map(Crs::new).transpose().map_err(|error| to_python(&error))
}

/// Its text.
pub fn text_of(crs: Option<&Crs>) -> Option<String> {
    crs.map(|crs| crs.text().to_owned())
}
