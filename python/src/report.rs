//! Reports: what calls found, each a dictionary whose figures are attributes as well (`surfrecon._reports`).

use pyo3::prelude::*;
use pyo3::types::PyDict;

/// A report of a class of `surfrecon._reports`.
///
/// # Errors
/// None but of Python itself.
pub fn report<'py>(class: &str, figures: Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    figures.py().import("surfrecon._reports")?.getattr(class)?.call1((figures,))
}

/// Wall-clock seconds by the name of the stage.
///
/// # Errors
/// None but of Python itself.
pub fn seconds<'py>(py: Python<'py>, stages: &[(&str, f64)]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (stage, seconds) in stages {
        dict.set_item(stage, seconds)?;
    }
    Ok(dict)
}

/// A dictionary of figures by the names of the variables that hold them.
macro_rules! figures {
    ($py:expr, { $($name:ident),* $(,)? }) => {{
        let dict = pyo3::types::PyDict::new($py);
        $(dict.set_item(stringify!($name), $name)?;)*
        dict
    }};
}
pub(crate) use figures;
