//! The one table of all reports: what operations say of their runs, figure by figure.
//!
//! C's structs, Python's classes, the values that MeshLab returns, Blender's lines and PARAMETERS.md are made from it. A figure
//! is declared once, as a row of its operation's `report!`.

pub use base::report::{Figure, Found, Kind, Measured, Report, Schema, Shape, Values};

use crate::operations::OPERATIONS;

/// The report of an operation.
#[derive(Clone, Copy, Debug)]
pub struct Reported {
    /// The operation, as it is called in every language.
    pub operation: &'static str,
    /// Its parts, as one report: the first gives name and text.
    pub schemas: &'static [Schema],
}

/// The operations' reports.
pub fn reports() -> impl Iterator<Item = Reported> {
    let reporting = OPERATIONS.iter().filter(|operation| !operation.report.is_empty());
    reporting.map(|operation| Reported { operation: operation.name, schemas: operation.report })
}

/// The report of an operation.
pub fn report(operation: &str) -> Option<Reported> {
    reports().find(|reported| reported.operation == operation)
}

impl Reported {
    /// Name of its type.
    pub const fn name(&self) -> &'static str {
        self.schemas[0].name
    }

    /// The subject of its figures.
    pub const fn text(&self) -> &'static str {
        self.schemas[0].text
    }

    /// All figures, in the order in which people read them.
    pub fn figures(&self) -> impl Iterator<Item = &'static Figure> + use<> {
        self.schemas.iter().flat_map(|schema| schema.figures)
    }

    /// The fields of its struct in C, in their order. Those of later versions come last, so that the struct grows at its end.
    pub fn fields(&self) -> Vec<Field> {
        let none = self.figures().map(|figure| (figure, Found::Absent)).collect();
        in_order(none).into_iter().map(|(field, _)| field).collect()
    }
}

/// The fields that hold these values, in their order in C, with the value of each.
pub fn in_order(values: Values<'_>) -> Vec<(Field, Found<'_>)> {
    let mut fields: Vec<_> = values.into_iter().flat_map(|(figure, found)| Field::of(figure, None, found)).collect();
    fields.sort_by_key(|(field, _)| version(field.since));
    fields
}

/// The parts of a version's number, which say which is the later one.
fn version(since: &str) -> Vec<u32> {
    since.split('.').map(|part| part.parse().expect("versions are numbers")).collect()
}

/// A field of a struct of C: a number of eight bytes, or an array of these.
#[derive(Clone, Debug)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// Its name for people.
    pub label: String,
    /// Its text.
    pub text: String,
    /// The figure that it is of.
    pub figure: &'static Figure,
    /// Number of its numbers, if it is an array.
    pub array: Option<usize>,
    /// The version it came with.
    pub since: &'static str,
}

impl Field {
    /// The fields of a figure, which may stand in another one that holds a report, with their values. None of what has no fixed
    /// size.
    fn of<'a>(figure: &'static Figure, within: Option<&'static Figure>, found: Found<'a>) -> Vec<(Field, Found<'a>)> {
        if !figure.is_fixed() {
            return Vec::new();
        }
        if let Kind::Nested(schema) = figure.kind {
            let inner = match found {
                Found::Nested(values) => values,
                _ => schema.figures.iter().map(|inner| (inner, Found::Absent)).collect(),
            };
            return inner.into_iter().flat_map(|(inner, found)| Field::of(inner, Some(figure), found)).collect();
        }
        let field = |name: &str, text: &str, array| match within {
            None => Field {
                name: name.to_owned(),
                label: figure.label.to_owned(),
                text: text.to_owned(),
                figure,
                array,
                since: figure.since,
            },
            Some(outer) => Field {
                name: format!("{}_{name}", outer.name),
                label: format!("{}: {}", outer.label, figure.label),
                text: format!("{}: {text}", outer.label),
                figure,
                array,
                since: if version(outer.since) > version(figure.since) { outer.since } else { figure.since },
            },
        };
        match (figure.parts, figure.shape) {
            ([], Shape::Array(size) | Shape::OptionalArray(size)) => {
                vec![(field(figure.name, figure.text, Some(size)), found)]
            }
            ([], _) => vec![(field(figure.name, figure.text, None), found)],
            (parts, _) => {
                let values = match found {
                    Found::Array(values) => values,
                    _ => vec![Found::Absent; parts.len()],
                };
                parts.iter().zip(values).map(|((name, text), found)| (field(name, text, None), found)).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each row is whole, and a report as it is before any run has values of the kinds that its rows declare.
    fn look_at<R: Report + Default>() {
        let report = R::default();
        let values = report.values();
        assert_eq!(values.len(), R::SCHEMA.figures.len());
        for (figure, found) in values {
            let named = format!("{} {}", R::SCHEMA.name, figure.name);
            assert!(figure.allows(&found), "{named}: {found:?} is no {:?} {:?}", figure.shape, figure.kind);
            assert!(!figure.label.is_empty() && figure.text.ends_with('.'), "{named}: {}", figure.text);
            assert!(figure.parts.iter().all(|(_, text)| text.ends_with('.')), "{named}");
        }
    }

    #[test]
    fn rows_are_whole() {
        look_at::<mesh::CheckReport>();
        look_at::<merge::MergeReport>();
        look_at::<sculpt::SculptReport>();
        look_at::<quads::QuadReport>();
        look_at::<reconstruct::ReconstructReport>();
        look_at::<cluster::ClusterReport>();
        for reported in reports() {
            let mut names = std::collections::HashSet::new();
            assert!(
                reported.figures().all(|figure| names.insert(figure.name)),
                "{} has a name twice",
                reported.operation
            );
            let mut names = std::collections::HashSet::new();
            assert!(reported.fields().iter().all(|field| names.insert(field.name.clone())), "{}", reported.operation);
        }
    }

    #[test]
    fn a_value_of_another_kind_is_refused() {
        let figure = |name| merge::MergeReport::FIGURES.iter().find(|figure| figure.name == name).unwrap();
        assert!(!figure("voxel").allows(&Found::Count(1)) && !figure("voxel").allows(&Found::Absent));
        assert!(figure("overlap_residual").allows(&Found::Absent));
        assert!(!figure("voxel_reason").allows(&Found::Choice("as given")));
        assert!(!figure("grid").allows(&Found::Array(vec![Found::Count(1); 2])));
        let pair = |kind| Found::List(vec![Found::Array(vec![Found::Choice(kind), Found::Text("so")])]);
        assert!(figure("warnings").allows(&pair("apart")) && !figure("warnings").allows(&pair("far")));
    }

    #[test]
    fn structs_of_c_grow_at_their_end() {
        for reported in reports() {
            let fields = reported.fields();
            assert!(
                fields.windows(2).all(|pair| version(pair[0].since) <= version(pair[1].since)),
                "{}",
                reported.operation
            );
        }
    }
}
