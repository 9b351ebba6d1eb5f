//! The core's parameter table, and parameters from keyword arguments.

use pyo3::exceptions::{PyDeprecationWarning, PyOverflowError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use surfrecon::error::{meant, nearest};
use surfrecon::params::{Choice, Default, ParamKind, ParamSpec, Params, Value, find, schemas, table};

use crate::errors::{input_error, reworded, to_python};

/// One parameter of one operation, as the library itself defines it.
///
/// >>> limit = {one.name: one for one in surfrecon.parameters("triangulate")}["grazing_limit"]
/// >>> limit.kind, limit.allowed
/// ('angle', '> 0 and <= 1.5707963267948966')
/// >>> limit.check(1.2)  # raises where the operation would
#[pyclass(frozen, module = "surfrecon")]
pub struct Parameter {
    spec: &'static ParamSpec,
}

#[pymethods]
impl Parameter {
    /// Operation, for example ``"merge"``.
    #[getter]
    fn operation(&self) -> &'static str {
        self.spec.operation
    }

    /// Name, the same in every language.
    #[getter]
    fn name(&self) -> &'static str {
        self.spec.name
    }

    /// Name for people.
    #[getter]
    fn label(&self) -> &'static str {
        self.spec.label
    }

    /// ``"length"`` (unit of the scans), ``"angle"`` (radians), ``"ratio"``, ``"count"``, ``"flag"`` or ``"choice"``.
    #[getter]
    fn kind(&self) -> &'static str {
        match self.spec.kind {
            ParamKind::Length => "length",
            ParamKind::Angle => "angle",
            ParamKind::Ratio => "ratio",
            ParamKind::Count => "count",
            ParamKind::Flag => "flag",
            ParamKind::Choice(_) => "choice",
        }
    }

    /// Deprecated: its former name of ``kind``.
    #[getter]
    #[pyo3(warn(message = "Parameter.unit is called Parameter.kind now", category = PyDeprecationWarning))]
    fn unit(&self) -> &'static str {
        self.kind()
    }

    /// Value when none is given: a number, a ``bool`` or the name of a choice. ``None`` when the data give it.
    #[getter]
    fn default<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(match self.spec.default_value() {
            Value::Absent => py.None().into_bound(py),
            Value::Flag(flag) => flag.into_pyobject(py)?.to_owned().into_any(),
            Value::Choice(name) => name.into_pyobject(py)?.into_any(),
            Value::Number(number) if self.spec.kind == ParamKind::Count => {
                (number as i64).into_pyobject(py)?.into_any()
            }
            Value::Number(number) => number.into_pyobject(py)?.into_any(),
        })
    }

    /// How the data give the default, where they do.
    #[getter]
    fn default_from(&self) -> Option<&'static str> {
        match self.spec.default {
            Default::Value(_) => None,
            Default::FromData(how) => Some(how),
        }
    }

    /// Smallest allowed number, ``-inf`` for none.
    #[getter]
    fn minimum(&self) -> f64 {
        self.spec.min
    }

    /// Whether ``minimum`` itself is refused.
    #[getter]
    fn minimum_excluded(&self) -> bool {
        self.spec.min_excluded
    }

    /// Largest allowed number, ``inf`` for none.
    #[getter]
    fn maximum(&self) -> f64 {
        self.spec.max
    }

    /// The values that it may have in words, for example ``"> 0 and <= 1"``.
    #[getter]
    fn allowed(&self) -> String {
        self.spec.allowed()
    }

    /// Checks a value as the operation does, before anything is read.
    ///
    /// >>> limit = {one.name: one for one in surfrecon.parameters("triangulate")}["grazing_limit"]
    /// >>> limit.check(1.2)
    ///
    /// Raises:
    ///     ParameterError: it lies outside of the range. The text names value, range and unit.
    ///     TypeError: a value of another kind.
    fn check(&self, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let taken = taken(self.spec, value)?;
        self.spec.check_value(taken.value()).map_err(|e| to_python(&e))
    }

    /// The values that a choice may have: ``(name, name for people, text)`` each.
    #[getter]
    fn choices(&self) -> Vec<(&'static str, &'static str, &'static str)> {
        self.spec.choices().iter().map(|&Choice { name, label, text }| (name, label, text)).collect()
    }

    /// Its text for people: what it does, and what smaller and larger values do. Of a flag, what it does when it is on.
    #[getter]
    fn text(&self) -> &'static str {
        self.spec.text
    }

    /// The effect of 0, or of a flag that is off. Empty where it is plain from the text.
    #[getter]
    fn off(&self) -> &'static str {
        self.spec.off
    }

    /// The version of the library it came with.
    #[getter]
    fn since(&self) -> &'static str {
        self.spec.since
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let default = match self.default_from() {
            Some(how) => format!("<{how}>"),
            None => self.default(py)?.repr()?.to_string(),
        };
        Ok(format!("<Parameter {}.{} = {default} [{}]>", self.spec.operation, self.spec.name, self.kind()))
    }
}

/// Every parameter of the library, or an operation's own: ``merge`` and ``sculpt`` take those of ``triangulate`` as well.
///
/// >>> voxel = surfrecon.parameters("merge")[0]
/// >>> voxel.name, voxel.allowed
/// ('voxel', 'a finite number > 0')
///
/// Raises:
///     InputError: there is no such operation.
#[pyfunction]
#[pyo3(signature = (operation = None))]
pub fn parameters(operation: Option<&str>) -> PyResult<Vec<Parameter>> {
    let known: Vec<&str> = schemas().map(|schema| schema.operation).collect();
    if let Some(operation) = operation.filter(|operation| !known.contains(operation)) {
        let (meant, known) = (meant(operation, known.iter().copied()), known.join("\", \""));
        return Err(input_error(format!("operation must be one of \"{known}\", got {operation:?}{meant}")));
    }
    Ok(table().filter(|p| operation.is_none_or(|o| o == p.operation)).map(|spec| Parameter { spec }).collect())
}

/// The parameters of an operation that `function` was given as `**options`. `None` stands for the default.
///
/// # Errors
/// `ParameterError`, `InputError` for several of which one may be given, `TypeError`.
pub fn params<P: Params + std::default::Default>(function: &str, options: Option<&Bound<'_, PyDict>>) -> PyResult<P> {
    params_but(&[], function, options)
}

/// Like [`params`] where the function does not take all of them.
///
/// # Errors
/// As [`params`].
pub fn params_but<P: Params + std::default::Default>(
    but: &[&str],
    function: &str,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<P> {
    let rows = P::rows();
    let mut given = Vec::new();
    for (name, value) in options.into_iter().flatten() {
        let name: String = name.extract()?;
        let Some(row) = rows.iter().copied().find(|row| row.name == name && !but.contains(&row.name)) else {
            let known = rows.iter().map(|row| row.name).filter(|name| !but.contains(name));
            return Err(unexpected(value.py(), function, &name, known.collect()));
        };
        given.push((row, taken(row, &value)?));
    }
    let given: Vec<_> = given.iter().map(|(row, taken)| (row.name, taken.value())).collect();
    let mut params = P::default();
    params.set_all(&given).map_err(|e| to_python(&e))?;
    Ok(params)
}

/// The error of a keyword that `function` does not take: it names the likeliest that was meant.
fn unexpected(py: Python<'_>, function: &str, name: &str, known: Vec<&str>) -> PyErr {
    let made = py.import("surfrecon._arguments").and_then(|m| m.call_method1("unexpected", (function, name, known)));
    made.map_or_else(|failure| failure, PyErr::from_value)
}

/// Refuses keywords that a function without parameters of a table does not take.
///
/// # Errors
/// `TypeError` for the first of them, with the one that was probably meant.
pub fn no_others(function: &str, others: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    match others.and_then(|others| others.keys().get_item(0).ok()) {
        None => Ok(()),
        Some(name) => Err(unexpected(name.py(), function, &name.to_string(), Vec::new())),
    }
}

/// The known name that was probably meant by one that is none.
#[pyfunction]
pub fn _nearest<'py>(given: &Bound<'py, PyString>, known: Vec<Bound<'py, PyString>>) -> Option<Bound<'py, PyString>> {
    // Arguments and names of files may be none of Unicode.
    let names: Vec<_> = known.iter().map(|name| name.to_string_lossy()).collect();
    let found = nearest(&given.to_string_lossy(), names.iter().map(AsRef::as_ref))?;
    let place = names.iter().position(|name| name == found)?;
    Some(known[place].clone())
}

/// Like [`params`] where the function takes a few of them.
///
/// # Errors
/// As [`params`].
pub fn params_only<P: Params + std::default::Default>(
    only: &[&str],
    function: &str,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<P> {
    let rows = P::rows();
    let but: Vec<&str> = rows.iter().map(|row| row.name).filter(|name| !only.contains(name)).collect();
    params_but(&but, function, options)
}

/// A value of Python in the form that the table knows.
enum Taken {
    None,
    Number(f64),
    Flag(bool),
    Choice(String),
}

impl Taken {
    fn value(&self) -> Value<'_> {
        match self {
            Taken::None => Value::Absent,
            Taken::Number(number) => Value::Number(*number),
            Taken::Flag(flag) => Value::Flag(*flag),
            Taken::Choice(name) => Value::Choice(name),
        }
    }
}

fn taken(row: &ParamSpec, value: &Bound<'_, PyAny>) -> PyResult<Taken> {
    if value.is_none() {
        return Ok(Taken::None);
    }
    let taken = match row.kind {
        ParamKind::Length | ParamKind::Angle | ParamKind::Ratio => value.extract().map(Taken::Number),
        ParamKind::Count => whole(row, value).map(Taken::Number),
        ParamKind::Flag => value.extract().map(Taken::Flag),
        ParamKind::Choice(_) => value.extract().map(Taken::Choice),
    };
    taken.map_err(|error| {
        // As of arguments that Python itself takes apart.
        let py = value.py();
        let text = || PyTypeError::new_err(format!("argument '{}': {}", row.name, error.value(py)));
        if error.is_instance_of::<PyTypeError>(py) { text() } else { error }
    })
}

/// A whole number.
pub fn whole(row: &ParamSpec, value: &Bound<'_, PyAny>) -> PyResult<f64> {
    match value.extract::<i64>() {
        // A number that a double can't hold is more than anything here counts.
        Ok(number) if number as f64 as i64 == number => Ok(number as f64),
        Ok(_) => Err(to_python(&row.refused(value))),
        Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => Err(to_python(&row.refused(value))),
        Err(error) => Err(error),
    }
}

/// Worker threads of a function that takes no other parameter.
///
/// # Errors
/// `ParameterError` with value and range, `TypeError`.
pub fn threads(given: Option<&Bound<'_, PyAny>>) -> PyResult<usize> {
    let spec = find("merge", "threads").expect("the parameter is in the table");
    let number = given.map_or(Ok(0.0), |given| whole(spec, given))?;
    Ok(spec.check(number).map_err(|e| to_python(&e))? as usize)
}

/// A whole number, of Python or NumPy, of things that are no parameter of the table. `remedy` says what to give instead.
///
/// # Errors
/// `InputError` below `least` and for what 64 bits can't hold, `TypeError` for what is no whole number.
pub fn count(name: &str, given: &Bound<'_, PyAny>, least: usize, remedy: &str) -> PyResult<usize> {
    let number = given.call_method0("__index__").map_err(|error| {
        let shown = given.repr().map_or_else(|_| given.get_type().to_string(), |text| text.to_string());
        reworded(error, || PyTypeError::new_err(format!("{name} is {shown}, but must be a whole number. {remedy}")))
    })?;
    number.extract::<usize>().ok().filter(|number| *number >= least).ok_or_else(|| {
        // Python writes no number of thousands of digits.
        let shown = number.str().map_or_else(|_| "a number of too many digits".to_owned(), |text| text.to_string());
        input_error(format!("{name} is {shown}, but must be at least {least} and below 2^64. {remedy}"))
    })
}
