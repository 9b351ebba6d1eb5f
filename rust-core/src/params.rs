//! The one table of all parameters: name, unit, default, range and text.
//!
//! C, Python, Blender and MeshLab read it or are tested against it; no default and no range is written anywhere else.

pub use base::params::{Default, ParamSpec, Unit};

/// Every parameter of the library.
pub fn table() -> impl Iterator<Item = &'static ParamSpec> {
    io::import::PARAMS
        .iter()
        .chain(image::triangulate::PARAMS)
        .chain(merge::PARAMS)
        .chain(sculpt::PARAMS)
        .chain(quads::PARAMS)
        .chain(reconstruct::PARAMS)
        .chain(cluster::PARAMS)
        .chain(scan::PARAMS)
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
