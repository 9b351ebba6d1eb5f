//! Reports: what calls found, each a dictionary whose figures are attributes as well (`surfrecon._reports`).

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use surfrecon::reports::{Found, Kind, Report, Values};

/// A report of a class of `surfrecon._reports`.
///
/// # Errors
/// None but of Python itself.
pub fn report<'py>(class: &str, figures: Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    figures.py().import("surfrecon._reports")?.getattr(class)?.call1((figures,))
}

/// A report that the core declares, as the class of its name.
///
/// # Errors
/// None but of Python itself.
pub fn of<'py>(py: Python<'py>, reported: &impl Report) -> PyResult<Bound<'py, PyAny>> {
    declared(py, name_of(reported), reported.values())
}

/// Two reports that the core declares as one, as the class of the first one's name.
///
/// # Errors
/// None but of Python itself.
pub fn of_both<'py>(py: Python<'py>, first: &impl Report, second: &impl Report) -> PyResult<Bound<'py, PyAny>> {
    let mut values = first.values();
    values.extend(second.values());
    declared(py, name_of(first), values)
}

fn name_of<R: Report>(_: &R) -> &'static str {
    R::SCHEMA.name
}

fn declared<'py>(py: Python<'py>, class: &str, values: Values<'_>) -> PyResult<Bound<'py, PyAny>> {
    let dict = PyDict::new(py);
    for (figure, found) in values {
        let value = match (figure.kind, found) {
            (Kind::Stage, Found::List(stages)) => by_name(py, stages)?,
            (kind, found) => value(py, kind, found)?,
        };
        dict.set_item(figure.name, value)?;
    }
    report(class, dict)
}

/// A list of pairs as a dictionary.
fn by_name<'py>(py: Python<'py>, pairs: Vec<Found<'_>>) -> PyResult<Bound<'py, PyAny>> {
    let dict = PyDict::new(py);
    for pair in pairs {
        if let Found::Array(pair) = pair
            && let [Found::Text(name), Found::Number(number)] = pair.as_slice()
        {
            dict.set_item(name, number)?;
        }
    }
    Ok(dict.into_any())
}

fn value<'py>(py: Python<'py>, kind: Kind, found: Found<'_>) -> PyResult<Bound<'py, PyAny>> {
    let all = |values: Vec<Found<'_>>| values.into_iter().map(|one| value(py, kind, one)).collect::<PyResult<Vec<_>>>();
    match found {
        Found::Absent => Ok(py.None().into_bound(py)),
        Found::Flag(flag) => flag.into_bound_py_any(py),
        Found::Count(count) => count.into_bound_py_any(py),
        Found::Integer(number) => number.into_bound_py_any(py),
        Found::Number(number) => number.into_bound_py_any(py),
        Found::Choice(text) | Found::Text(text) => text.into_bound_py_any(py),
        Found::Array(values) => Ok(PyTuple::new(py, all(values)?)?.into_any()),
        Found::List(values) => Ok(PyList::new(py, all(values)?)?.into_any()),
        Found::Nested(values) => {
            let Kind::Nested(schema) = kind else { unreachable!("{kind:?} is no report") };
            declared(py, schema.name, values)
        }
    }
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
