//! The one table of all parameters: name, unit, default, range and text.
//!
//! C, Python, Blender and MeshLab read it or are tested against it; no default and no range is written anywhere else.

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

/// Every parameter of the library.
pub fn table() -> impl Iterator<Item = &'static ParamSpec> {
    crate::import::PARAMS
        .iter()
        .chain(crate::triangulate::PARAMS)
        .chain(crate::merge::PARAMS)
        .chain(crate::sculpt::PARAMS)
        .chain(crate::quads::PARAMS)
        .chain(crate::scattered::PARAMS)
        .chain(crate::cluster::PARAMS)
        .chain(crate::scan::PARAMS)
}

/// The parameter `name` of `operation`.
pub fn find(operation: &str, name: &str) -> Option<&'static ParamSpec> {
    table().find(|p| p.operation == operation && p.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_defaults_in_range() {
        let mut seen = std::collections::HashSet::new();
        for p in table() {
            assert!(seen.insert((p.operation, p.name)), "{} {}", p.operation, p.name);
            assert!(p.min <= p.max && !p.text.is_empty());
            if let Default::Value(v) = p.default {
                assert!(p.check(v).is_ok(), "{} {}", p.operation, p.name);
            }
        }
    }

    #[test]
    fn the_message_names_value_range_and_unit() {
        let p = find("merge", "voxel").unwrap();
        let text = p.check(-1.5).unwrap_err().to_string();
        assert_eq!(text, "voxel must be a finite number > 0, got -1.5 (in the unit of the scans)");
        assert!(p.check(f64::NAN).is_err() && p.check(f64::INFINITY).is_err());
    }
}
