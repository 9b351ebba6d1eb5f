//! The one table of all reports: what operations say of their runs, figure by figure.
//!
//! C's structs, Python's classes, the values that MeshLab returns, Blender's lines and PARAMETERS.md are made from it. A figure
//! is declared once, as a row of its operation's `report!`.

pub use base::report::{Figure, FigureKind, FigureShape, FigureValue, Found, Remark, Report, ReportSchema, Values};

use crate::operations::OPERATIONS;

/// The report of an operation, or of a call that is none.
#[derive(Clone, Copy, Debug)]
pub struct Reported {
    /// The operation, as it is called in every language, or what the call measures.
    pub operation: &'static str,
    /// Its parts, as one report: the first gives name and text.
    pub schemas: &'static [ReportSchema],
}

/// Reports of calls that are no operations.
const OTHERS: &[Reported] = &[
    Reported { operation: "snap", schemas: &[align::Snap::SCHEMA] },
    Reported { operation: "distance", schemas: &[mesh::measure::DistanceReport::SCHEMA] },
    Reported { operation: "left_out", schemas: &[image::frame::LeftOutReport::SCHEMA] },
];

/// All reports: first those of operations.
pub fn reports() -> impl Iterator<Item = Reported> {
    let reporting = OPERATIONS.iter().filter(|operation| !operation.report.is_empty());
    let of_operations = reporting.map(|operation| Reported { operation: operation.name, schemas: operation.report });
    of_operations.chain(OTHERS.iter().copied())
}

/// The report of an operation, or of what a call measures.
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
    pub fn fields(&self) -> Vec<ReportField> {
        fields(self.figures())
    }

    /// The reports that its figures have lists of, which are structs of their own in C. A report comes after those that it
    /// has lists of.
    pub fn listed(&self) -> Vec<Listed> {
        let mut found = Vec::new();
        self.figures().for_each(|figure| list(figure, &mut found));
        found
    }
}

/// A report that another has a list of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Listed {
    /// Its declaration.
    pub schema: &'static ReportSchema,
    /// Whether C's structs hold the list, so that it never grows.
    pub is_held: bool,
}

fn list(figure: &Figure, found: &mut Vec<Listed>) {
    let FigureKind::Nested(schema) = figure.kind else { return };
    schema.figures.iter().for_each(|inner| list(inner, found));
    let is_held = matches!(figure.shape, FigureShape::UpTo(_));
    let listed = Listed { schema, is_held };
    if (is_held || figure.is_counted) && !found.contains(&listed) {
        found.push(listed);
    }
}

/// The fields of the struct in C of a report with these figures, in their order.
pub fn fields(figures: impl Iterator<Item = &'static Figure>) -> Vec<ReportField> {
    let none = figures.map(|figure| (figure, Found::Absent)).collect();
    in_order(none).into_iter().map(|(field, _)| field).collect()
}

/// The fields that hold these values, in their order in C, with the value of each.
pub fn in_order(values: Values<'_>) -> Vec<(ReportField, Found<'_>)> {
    let mut fields: Vec<_> =
        values.into_iter().flat_map(|(figure, found)| ReportField::of(figure, None, found)).collect();
    fields.sort_by_key(|(field, _)| version(field.since));
    fields
}

/// The parts of a version's number, which say which is the later one.
fn version(since: &str) -> Vec<u32> {
    since.split('.').map(|part| part.parse().expect("versions are numbers")).collect()
}

/// The contents of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Holds {
    /// A value of the figure.
    One,
    /// So many of them.
    Array(usize),
    /// The number of values of the figure, which is a list.
    Length,
    /// A report each, at most so many.
    Reports(usize, &'static ReportSchema),
}

/// A field of a struct of C: numbers of eight bytes each.
#[derive(Clone, Debug)]
pub struct ReportField {
    /// Its name.
    pub name: String,
    /// Its name for people.
    pub label: String,
    /// Its text.
    pub text: String,
    /// The figure that it is of.
    pub figure: &'static Figure,
    /// Its contents.
    pub holds: Holds,
    /// The version it came with.
    pub since: &'static str,
}

impl ReportField {
    /// The sort of its values.
    pub const fn kind(&self) -> FigureKind {
        match self.holds {
            Holds::Length => FigureKind::Count,
            _ => self.figure.kind,
        }
    }

    /// Whether its value may be absent.
    pub const fn is_optional(&self) -> bool {
        matches!(self.holds, Holds::One | Holds::Array(_)) && self.figure.is_optional()
    }

    /// How many numbers it has.
    pub fn numbers(&self) -> usize {
        match self.holds {
            Holds::Length => 1,
            Holds::One => numbers(self.figure.kind),
            Holds::Array(size) => size * numbers(self.figure.kind),
            Holds::Reports(most, schema) => most * numbers(FigureKind::Nested(schema)),
        }
    }

    /// The fields of a figure, which may stand in another one that holds a report, with their values. None of a list that is not
    /// counted, and of words.
    fn of<'a>(
        figure: &'static Figure,
        within: Option<&'static Figure>,
        found: Found<'a>,
    ) -> Vec<(ReportField, Found<'a>)> {
        let field = |name: &str, text: &str, holds| {
            let (mut name, mut label, mut text) = (name.to_owned(), figure.label.to_owned(), text.to_owned());
            let mut since = figure.since;
            if let Some(outer) = within {
                name = format!("{}_{name}", outer.name);
                label = format!("{}: {label}", outer.label);
                text = format!("{}: {text}", outer.label);
                since = if version(outer.since) > version(since) { outer.since } else { since };
            }
            ReportField { name, label, text, figure, holds, since }
        };
        let length = || {
            let (name, text) =
                (format!("{}_count", figure.name), format!("Number of {}. {}", figure.name, figure.text));
            let length = match &found {
                Found::List(values) => Found::Count(values.len() as u64),
                _ => Found::Absent,
            };
            (field(&name, &text, Holds::Length), length)
        };
        if !figure.is_fixed() {
            return if figure.is_counted { vec![length()] } else { Vec::new() };
        }
        if let (FigureKind::Nested(schema), FigureShape::UpTo(most)) = (figure.kind, figure.shape) {
            let text = format!("{} Those behind them are 0.", figure.text);
            return vec![length(), (field(figure.name, &text, Holds::Reports(most, schema)), found)];
        }
        if let FigureKind::Nested(schema) = figure.kind {
            let inner = match found {
                Found::Nested(values) => values,
                _ => schema.figures.iter().map(|inner| (inner, Found::Absent)).collect(),
            };
            return inner.into_iter().flat_map(|(inner, found)| ReportField::of(inner, Some(figure), found)).collect();
        }
        match (figure.parts, figure.shape) {
            ([], FigureShape::Array(size) | FigureShape::OptionalArray(size)) => {
                vec![(field(figure.name, figure.text, Holds::Array(size)), found)]
            }
            ([], _) => vec![(field(figure.name, figure.text, Holds::One), found)],
            (parts, _) => {
                let values = match found {
                    Found::Array(values) => values,
                    _ => vec![Found::Absent; parts.len()],
                };
                parts.iter().zip(values).map(|((name, text), found)| (field(name, text, Holds::One), found)).collect()
            }
        }
    }
}

/// How many numbers of eight bytes a value of a kind has in C.
pub fn numbers(kind: FigureKind) -> usize {
    match kind {
        FigureKind::Vector => 3,
        FigureKind::Pose => 16,
        FigureKind::Matrix(rows) => rows * rows,
        FigureKind::Nested(schema) => fields(schema.figures.iter()).iter().map(ReportField::numbers).sum(),
        _ => 1,
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
        look_at::<mesh::measure::DistanceReport>();
        look_at::<image::frame::LeftOutReport>();
        look_at::<close::print::PrintReport>();
        // operations
        look_at::<align::Freedom>();
        look_at::<align::AlignedScan>();
        look_at::<align::AlignedPair>();
        look_at::<align::AlignReport>();
        look_at::<align::Snap>();
        look_at::<close::CloseReport>();
        look_at::<cluster::TriangleShapes>();
        look_at::<cluster::ClusterReport>();
        look_at::<merge::MergeReport>();
        look_at::<printing::PrepareReport>();
        look_at::<quads::QuadReport>();
        look_at::<reconstruct::ReconstructReport>();
        look_at::<sculpt::SculptReport>();
        look_at::<texture::TexturedPhoto>();
        look_at::<texture::TextureReport>();
        look_at::<unwrap::UnwrapReport>();
        // end
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
    fn lists_of_reports_are_counted_or_held() {
        let freedom = align::Freedom { turns: true, ..align::Freedom::default() };
        let scan = align::AlignedScan { freedoms: vec![freedom; 2], ..align::AlignedScan::default() };
        assert!(scan.values().iter().all(|(figure, found)| figure.allows(found)));
        let fields = in_order(scan.values());
        let of = |name: &str| fields.iter().find(|(field, _)| field.name == name).unwrap();
        assert_eq!(of("freedoms_count").1, Found::Count(2));
        assert_eq!((of("freedoms").0.numbers(), of("covariance").0.numbers()), (6 * 7, 36));
        let too_many = align::AlignedScan { freedoms: vec![freedom; 7], ..align::AlignedScan::default() };
        assert!(!too_many.values().iter().all(|(figure, found)| figure.allows(found)));
        let names = |listed: Vec<Listed>| listed.iter().map(|one| (one.schema.name, one.is_held)).collect::<Vec<_>>();
        let expected = [("Freedom", true), ("AlignedScan", false), ("AlignedPair", false)];
        assert_eq!(names(report("align").unwrap().listed()), expected);
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
