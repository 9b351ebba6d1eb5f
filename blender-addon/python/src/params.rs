//! The core's parameter table.

use pyo3::prelude::*;
use surfrecon::params::{Default, ParamSpec, Unit, find, table};

use crate::errors::to_python;

/// One parameter of one operation, as the library itself defines it.
#[pyclass(frozen, get_all, module = "surfrecon")]
pub struct Parameter {
    /// Operation, for example ``"merge"``.
    operation: &'static str,
    /// Name, the same in every language.
    name: &'static str,
    /// ``"length"`` (unit of the scans), ``"angle"`` (radians), ``"ratio"`` or ``"count"``.
    unit: &'static str,
    /// Value when none is given; ``None`` when it is measured from the data.
    default: Option<f64>,
    /// How the default is measured, where it is.
    default_from: Option<&'static str>,
    /// Smallest allowed value.
    minimum: f64,
    /// Whether ``minimum`` itself is refused.
    minimum_excluded: bool,
    /// Largest allowed value, ``inf`` for none.
    maximum: f64,
    /// What it does, and what smaller and larger values do.
    text: &'static str,
}

impl From<&'static ParamSpec> for Parameter {
    fn from(p: &'static ParamSpec) -> Self {
        let (default, default_from) = match p.default {
            Default::Value(value) => (Some(value), None),
            Default::FromData(how) => (None, Some(how)),
        };
        let unit = match p.unit {
            Unit::WorldLength => "length",
            Unit::Angle => "angle",
            Unit::Ratio => "ratio",
            Unit::Count => "count",
        };
        Parameter {
            operation: p.operation,
            name: p.name,
            unit,
            default,
            default_from,
            minimum: p.min,
            minimum_excluded: p.min_excluded,
            maximum: p.max,
            text: p.text,
        }
    }
}

#[pymethods]
impl Parameter {
    fn __repr__(&self) -> String {
        let default = match (self.default, self.default_from) {
            (Some(value), _) => value.to_string(),
            (None, how) => format!("<{}>", how.unwrap_or("from the data")),
        };
        format!("<Parameter {}.{} = {default} [{}]>", self.operation, self.name, self.unit)
    }
}

/// Every parameter of the library, or those of one operation.
#[pyfunction]
#[pyo3(signature = (operation = None))]
pub fn parameters(operation: Option<&str>) -> Vec<Parameter> {
    table().filter(|p| operation.is_none_or(|o| o == p.operation)).map(Parameter::from).collect()
}

/// The given value of a parameter, checked; or its default, `None` where that is measured from the data.
///
/// # Errors
/// `ParameterError` with value, range and unit.
pub fn value_of(operation: &str, name: &str, given: Option<f64>) -> PyResult<Option<f64>> {
    let spec = find(operation, name).expect("the names in this crate are those of the table");
    match (given, spec.default) {
        (Some(value), _) => spec.check(value).map(Some).map_err(|e| to_python(&e)),
        (None, Default::Value(value)) => Ok(Some(value)),
        (None, Default::FromData(_)) => Ok(None),
    }
}

/// Like [`value_of`] for a whole number.
///
/// # Errors
/// `ParameterError`.
pub fn count_of(operation: &str, name: &str, given: Option<i64>) -> PyResult<usize> {
    let value = value_of(operation, name, given.map(|n| n as f64))?;
    Ok(value.expect("counts have plain defaults") as usize)
}
