//! The one table of all parameters: each operation's schema, and its rows.
//!
//! C, Python, Blender and MeshLab are made from it. No default, no range and no text of a parameter is written anywhere else.

pub use base::params::{Choice, Default, ParamField, ParamKind, ParamSchema, ParamSpec, Params, Value};

/// The former name of [`ParamKind`].
#[deprecated(since = "0.2.0", note = "it is called `ParamKind`")]
pub type Kind = ParamKind;

/// The former name of [`ParamSchema`].
#[deprecated(since = "0.2.0", note = "it is called `ParamSchema`")]
pub type Schema = ParamSchema;

use crate::operations::OPERATIONS;

/// The operations' schemas.
pub fn schemas() -> impl Iterator<Item = &'static ParamSchema> {
    OPERATIONS.iter().filter_map(|operation| operation.params.as_ref())
}

/// Every parameter of the library.
pub fn table() -> impl Iterator<Item = &'static ParamSpec> {
    schemas().flat_map(|schema| schema.rows)
}

/// The schema of an operation.
pub fn schema(operation: &str) -> Option<&'static ParamSchema> {
    schemas().find(|schema| schema.operation == operation)
}

/// The parameter `name` of `operation`.
pub fn find(operation: &str, name: &str) -> Option<&'static ParamSpec> {
    schema(operation)?.rows.iter().find(|row| row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_whole() {
        let mut seen = std::collections::HashSet::new();
        for p in table() {
            let named = format!("{} {}", p.operation, p.name);
            assert!(seen.insert((p.operation, p.name)), "{named} is there twice");
            assert!(p.min <= p.max && !p.label.is_empty() && !p.since.is_empty(), "{named}");
            assert!(p.text.ends_with('.') && !p.text.contains('_') && !p.off.ends_with('.'), "{named}: {}", p.text);
            assert!(p.check_value(p.default_value()).is_ok(), "{named}");
            for choice in p.choices() {
                assert!(!choice.label.is_empty() && choice.text.ends_with('.'), "{named}: {}", choice.name);
            }
        }
        for part in schemas().flat_map(|schema| (schema.all)()) {
            assert_eq!(find(part.operation, part.name), Some(part), "a part is not in the table");
        }
    }

    #[test]
    fn the_message_names_value_range_and_unit() {
        let p = find("merge", "voxel").unwrap();
        let text = p.check(-1.5).unwrap_err().to_string();
        assert_eq!(text, "voxel must be a finite number > 0, got -1.5 (in the unit of the scans)");
        assert!(p.check(f64::NAN).is_err() && p.check(f64::INFINITY).is_err());
        let p = find("reconstruct", "closure").unwrap();
        let text = p.check_value(Value::Choice("shut")).unwrap_err().to_string();
        assert_eq!(text, "closure must be \"auto\", \"closed\" or \"open\", got \"shut\"");
    }

    /// Sets each parameter to a value that is not its default, and to one that is refused.
    fn try_all<P: Params + std::default::Default>() {
        for row in P::rows() {
            let middle = if row.max.is_finite() { (row.min + row.max) / 2.0 } else { row.min + 3.0 };
            let (other, wrong) = match row.kind {
                ParamKind::Flag => (Value::Flag(row.default_value() == Value::Flag(false)), Value::Number(2.0)),
                ParamKind::Choice(choices) => {
                    (Value::Choice(choices[choices.len() - 1].name), Value::Choice("none such"))
                }
                ParamKind::Count => (Value::Number(middle.trunc()), Value::Number(1.5)),
                _ if row.any_number => (Value::Number(f64::INFINITY), Value::Flag(true)),
                _ if row.min.is_finite() => (Value::Number(middle), Value::Number(row.min - 1.0)),
                _ => (Value::Number(-1.0), Value::Number(f64::NAN)),
            };
            let mut params = P::default();
            assert_eq!(params.get(row.name).unwrap(), row.default_value(), "{}", row.name);
            assert!(params.set(row.name, other).unwrap());
            assert_eq!(params.get(row.name).unwrap(), other, "{}", row.name);
            params.check().unwrap();
            let refused = params.set(row.name, wrong).unwrap_err().to_string();
            assert!(refused.starts_with(&format!("{} must be ", row.name)), "{refused}");
            assert_eq!(params.get(row.name).unwrap(), other, "{} changed though it was refused", row.name);
            assert!(params.set(row.name, Value::Absent).unwrap());
            assert_eq!(params.get(row.name).unwrap(), row.default_value(), "{}", row.name);
        }
        let mut params = P::default();
        assert!(!params.set("none such", Value::Absent).unwrap() && params.get("none such").is_none());
        for rows in P::alternatives() {
            let given: Vec<_> = rows.iter().map(|row| (row.name, Value::Number(row.min.max(1.0)))).collect();
            assert!(params.set_all(&given).unwrap_err().to_string().starts_with("give "));
            for one in &given {
                params.set_all(&[*one]).unwrap();
            }
        }
    }

    #[test]
    fn every_parameter_is_set_by_name() {
        try_all::<io::import::ReadOptions>();
        try_all::<io::export::WriteOptions>();
        try_all::<image::triangulate::TriangulateParams>();
        try_all::<close::print::PrintParams>();
        // operations
        try_all::<align::AlignParams>();
        try_all::<close::CloseParams>();
        try_all::<cluster::ClusterParams>();
        try_all::<merge::MergeParams>();
        try_all::<plane::PlaneParams>();
        try_all::<printing::PrepareParams>();
        try_all::<quads::QuadParams>();
        try_all::<quads::SplineParams>();
        try_all::<reconstruct::ReconstructParams>();
        try_all::<scan::ScanParams>();
        try_all::<sculpt::SculptParams>();
        try_all::<texture::TextureParams>();
        try_all::<unwrap::UnwrapParams>();
        // end
    }
}
