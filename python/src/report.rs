//! Reports: what calls found, each a dictionary whose figures are attributes as well (`surfrecon._reports`).

use numpy::PyArray2;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use surfrecon::error::meant;
use surfrecon::params::Choice;
use surfrecon::reports::{self as core, FigureKind, FigureShape, Found, Report, Values};

use crate::arrays;
use crate::errors::input_error;

/// One figure of an operation's report, as the library itself defines it.
///
/// >>> voxel = {one.name: one for one in surfrecon.figures("merge")}["voxel"]
/// >>> voxel.kind, voxel.text
/// ('length', 'Size of a cell that was used.')
#[pyclass(frozen, module = "surfrecon")]
pub struct Figure {
    figure: &'static core::Figure,
    operation: &'static str,
}

#[pymethods]
impl Figure {
    /// Operation, for example ``"merge"``.
    #[getter]
    fn operation(&self) -> &'static str {
        self.operation
    }

    /// Name, the same in every language.
    #[getter]
    fn name(&self) -> &'static str {
        self.figure.name
    }

    /// Name for people.
    #[getter]
    fn label(&self) -> &'static str {
        self.figure.label
    }

    /// ``"flag"``, ``"count"``, ``"integer"``, ``"bytes"``, ``"length"`` (unit of the scans), ``"angle"`` (radians), ``"ratio"``,
    /// ``"number"``, ``"vector"`` (three numbers), ``"pose"`` (4 x 4), ``"matrix"``, ``"choice"``, ``"text"``, ``"warning"`` (a kind
    /// and a sentence), ``"stage"`` (seconds by name) or ``"report"``.
    #[getter]
    fn kind(&self) -> &'static str {
        match self.figure.kind {
            FigureKind::Flag => "flag",
            FigureKind::Count => "count",
            FigureKind::Integer => "integer",
            FigureKind::Bytes => "bytes",
            FigureKind::Length => "length",
            FigureKind::Angle => "angle",
            FigureKind::Ratio => "ratio",
            FigureKind::Number => "number",
            FigureKind::Choice(_) => "choice",
            FigureKind::Vector => "vector",
            FigureKind::Pose => "pose",
            FigureKind::Matrix(_) => "matrix",
            FigureKind::Text => "text",
            FigureKind::Warning(_) => "warning",
            FigureKind::Stage => "stage",
            FigureKind::Nested(_) => "report",
        }
    }

    /// ``"one"``, ``"optional"``, ``"array"``, ``"optional array"``, ``"list"``, ``"list of optional"`` or ``"lists"``.
    #[getter]
    fn shape(&self) -> &'static str {
        match self.figure.shape {
            FigureShape::One => "one",
            FigureShape::Optional => "optional",
            FigureShape::Array(_) => "array",
            FigureShape::OptionalArray(_) => "optional array",
            FigureShape::List(_) | FigureShape::UpTo(_) => "list",
            FigureShape::ListOfOptional => "list of optional",
            FigureShape::Lists => "lists",
        }
    }

    /// Allowed values of a choice or a warning: ``(name, name for people, text)`` each.
    #[getter]
    fn choices(&self) -> Vec<(&'static str, &'static str, &'static str)> {
        self.figure.choices().iter().map(|&Choice { name, label, text }| (name, label, text)).collect()
    }

    /// The figure in words.
    #[getter]
    fn text(&self) -> &'static str {
        self.figure.text
    }

    /// The version of the library it came with.
    #[getter]
    fn since(&self) -> &'static str {
        self.figure.since
    }

    fn __repr__(&self) -> String {
        format!("<Figure {}.{} [{}]>", self.operation, self.figure.name, self.kind())
    }
}

/// Every figure of every report, or those of an operation's report.
///
/// >>> [figure.name for figure in surfrecon.figures("merge")][:3]
/// ['scans', 'scan_names', 'input_triangles']
///
/// Raises:
///     InputError: no operation of that name has a report.
#[pyfunction]
#[pyo3(signature = (operation = None))]
pub fn figures(operation: Option<&str>) -> PyResult<Vec<Figure>> {
    if let Some(operation) = operation.filter(|operation| core::report(operation).is_none()) {
        let known: Vec<&str> = core::reports().map(|reported| reported.operation).collect();
        let (meant, known) = (meant(operation, known.iter().copied()), known.join("\", \""));
        return Err(input_error(format!("operation must be one of \"{known}\", got {operation:?}{meant}")));
    }
    let asked = core::reports().filter(|reported| operation.is_none_or(|operation| operation == reported.operation));
    let all = asked
        .flat_map(|reported| reported.figures().map(move |figure| Figure { figure, operation: reported.operation }));
    Ok(all.collect())
}

/// A report of a class of `surfrecon._reports`.
fn report<'py>(class: &str, figures: Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
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
            (FigureKind::Stage, Found::List(stages)) => by_name(py, stages)?,
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

fn value<'py>(py: Python<'py>, kind: FigureKind, found: Found<'_>) -> PyResult<Bound<'py, PyAny>> {
    let all = |values: Vec<Found<'_>>| values.into_iter().map(|one| value(py, kind, one)).collect::<PyResult<Vec<_>>>();
    match found {
        Found::Absent => Ok(py.None().into_bound(py)),
        Found::Flag(flag) => flag.into_bound_py_any(py),
        Found::Count(count) => count.into_bound_py_any(py),
        Found::Integer(number) => number.into_bound_py_any(py),
        Found::Number(number) => number.into_bound_py_any(py),
        Found::Choice(text) | Found::Text(text) => text.into_bound_py_any(py),
        Found::Vector(vector) => Ok(PyTuple::new(py, vector.to_array())?.into_any()),
        Found::Pose(pose) => Ok(arrays::matrix(py, &pose).into_any()),
        Found::Array(rows) if matches!(kind, FigureKind::Matrix(_)) => matrix(py, &rows),
        Found::Array(values) => Ok(PyTuple::new(py, all(values)?)?.into_any()),
        Found::List(values) => Ok(PyList::new(py, all(values)?)?.into_any()),
        Found::Nested(values) => {
            let FigureKind::Nested(schema) = kind else { unreachable!("{kind:?} is no report") };
            declared(py, schema.name, values)
        }
    }
}

/// Rows of numbers as an array.
fn matrix<'py>(py: Python<'py>, rows: &[Found<'_>]) -> PyResult<Bound<'py, PyAny>> {
    let number = |value: &Found<'_>| if let Found::Number(number) = value { *number } else { f64::NAN };
    let row = |row: &Found<'_>| match row {
        Found::Array(values) => values.iter().map(number).collect(),
        _ => Vec::new(),
    };
    let rows: Vec<Vec<f64>> = rows.iter().map(row).collect();
    Ok(PyArray2::from_vec2(py, &rows).expect("rows of equal length").into_any())
}
