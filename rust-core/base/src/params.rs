//! What a parameter is: name, unit, default, range and text.

use crate::error::{Error, Result, Shown};

/// What a parameter's number means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// The unit of the scans' coordinates, whatever that is.
    WorldLength,
    /// Radians inside; hosts show degrees.
    Angle,
    /// A plain ratio or share.
    Ratio,
    /// A whole number of things.
    Count,
}

impl Unit {
    /// The unit as error texts end with it: with a leading space, or empty.
    pub fn suffix(self) -> &'static str {
        match self {
            Unit::WorldLength => " (in the unit of the scans)",
            Unit::Angle => " rad",
            Unit::Ratio | Unit::Count => "",
        }
    }
}

/// Where a parameter's value comes from when the caller gives none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Default {
    /// This value.
    Value(f64),
    /// Measured from the data; the text says how.
    FromData(&'static str),
}

/// One parameter of one operation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParamSpec {
    /// Operation, for example `merge`.
    pub operation: &'static str,
    /// Name, the same in every language.
    pub name: &'static str,
    /// Unit of the number.
    pub unit: Unit,
    /// Value when none is given.
    pub default: Default,
    /// Smallest allowed value.
    pub min: f64,
    /// Whether `min` itself is refused.
    pub min_excluded: bool,
    /// Largest allowed value, infinity for none.
    pub max: f64,
    /// What it does, and what smaller and larger values do: one or two sentences.
    pub text: &'static str,
}

impl ParamSpec {
    /// Checks a given value against the range.
    ///
    /// # Errors
    /// [`Error::Parameter`] with the value, the allowed range and the unit.
    pub fn check(&self, value: f64) -> Result<f64> {
        let low = if self.min_excluded { value > self.min } else { value >= self.min };
        if low && value <= self.max && value.is_finite() {
            return Ok(value);
        }
        let low = if self.min_excluded { "> " } else { ">= " };
        let allowed = if self.max.is_finite() {
            format!("{low}{} and <= {}", self.min, self.max)
        } else {
            format!("a finite number {low}{}", self.min)
        };
        Err(Error::Parameter { name: self.name, value: Shown(value).to_string(), allowed, unit: self.unit.suffix() })
    }

    /// The default when it is a plain value.
    ///
    /// # Panics
    /// If the default is measured from the data.
    pub fn value(&self) -> f64 {
        match self.default {
            Default::Value(v) => v,
            Default::FromData(how) => panic!("the default of {} is measured: {how}", self.name),
        }
    }
}

/// The parameter of that name in an operation's own table.
///
/// # Panics
/// If there is none: names are written in the code that asks.
pub fn named(specs: &'static [ParamSpec], operation: &str, name: &str) -> &'static ParamSpec {
    let named = |spec: &&ParamSpec| spec.operation == operation && spec.name == name;
    specs.iter().find(named).unwrap_or_else(|| panic!("{operation} has no parameter {name}"))
}
