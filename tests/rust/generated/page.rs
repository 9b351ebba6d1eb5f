//! PARAMETERS.md.

use std::fmt::Write as _;

use surfrecon::operations::{DataKind, OPERATIONS};
use surfrecon::params::{ParamKind, ParamSchema, ParamSpec};
use surfrecon::reports::{Figure, FigureKind, FigureShape, report};

use crate::compare;
use crate::words::{default_choice, plain_default, range, rule};

#[test]
fn parameters() {
    let mut page = "# Operations and their parameters\n\nThe same in every language. This page is generated from the operations' \
                    declarations by `make generate`. Lengths are in the unit of the scans, angles in radians (Blender and MeshLab \
                    show degrees). Choices are names, in C numbers counted from 1. C's structs have the figures of reports that have \
                    a fixed size.\n"
        .to_owned();
    for operation in OPERATIONS {
        let words = |contents: &[DataKind]| -> String {
            let words: Vec<&str> = contents.iter().map(|content| content.words()).collect();
            words.join(" or ")
        };
        let _ = write!(page, "\n## {}\n\n{} Takes {}", operation.name, operation.text, words(operation.takes));
        if !operation.gives.is_empty() {
            let _ = write!(page, ", gives {}", words(operation.gives));
        }
        page += ".\n";
        let command = operation.command.map(|command| format!("`surfrecon {}`", command.name));
        let hosts = [
            ("Command line", command),
            ("Blender", operation.blender.map(|operator| format!("*{}*", operator.label))),
            ("MeshLab", operation.meshlab.map(|filter| format!("*{}*", filter.label))),
        ];
        let hosts: Vec<String> =
            hosts.into_iter().filter_map(|(host, name)| name.map(|name| format!("{host}: {name}"))).collect();
        if !hosts.is_empty() {
            let _ = writeln!(page, "\n{}.", hosts.join(". "));
        }
        if let Some(schema) = &operation.params {
            page += &table(schema);
        }
        if let Some(reported) = report(operation.name) {
            let _ = write!(
                page,
                "\n### Report of {}\n\n{}\n\n| name | | kind | meaning | since |\n|---|---|---|---|---|\n",
                reported.operation,
                reported.text()
            );
            reported.figures().for_each(|figure| page += &row(figure, ""));
        }
    }
    compare("PARAMETERS.md", &page);
}

/// The parameters of an operation.
fn table(schema: &ParamSchema) -> String {
    let mut out = format!(
        "\n{}\n\n| name | | kind | default | range | meaning | since |\n|---|---|---|---|---|---|---|\n",
        schema.text
    );
    for p in schema.rows {
        let (name, label, kind) = (p.name, p.label, kind(p));
        let _ = writeln!(
            out,
            "| `{name}` | {label} | {kind} | {} | {} | {} | {} |",
            default(p),
            range(p),
            meaning(p),
            p.since
        );
    }
    let mut others: Vec<&str> =
        (schema.all)().iter().map(|row| row.operation).filter(|other| *other != schema.operation).collect();
    others.dedup();
    for other in others {
        let _ = writeln!(out, "\nAnd those of [{other}](#{other}).");
    }
    out
}

/// The row of a figure, and those of the report that it is.
fn row(figure: &Figure, within: &str) -> String {
    let kind = match figure.kind {
        FigureKind::Flag => "flag",
        FigureKind::Count => "count",
        FigureKind::Integer => "whole number",
        FigureKind::Bytes => "bytes",
        FigureKind::Length => "length",
        FigureKind::Angle => "angle",
        FigureKind::Ratio => "ratio",
        FigureKind::Number => "number",
        FigureKind::Choice(_) => "choice",
        FigureKind::Vector => "three numbers",
        FigureKind::Pose => "pose",
        FigureKind::Matrix(_) => "matrix",
        FigureKind::Text => "text",
        FigureKind::Warning(_) => "kind and text",
        FigureKind::Stage => "seconds by stage",
        FigureKind::Nested(_) => "report",
    };
    let kind = match figure.shape {
        FigureShape::One => kind.to_owned(),
        FigureShape::Optional => format!("{kind} or none"),
        FigureShape::Array(size) => format!("{size} of {kind}"),
        FigureShape::OptionalArray(size) => format!("{size} of {kind}, or none"),
        FigureShape::List(0) if figure.kind == FigureKind::Stage => kind.to_owned(),
        FigureShape::List(0) => format!("list of {kind}"),
        FigureShape::List(size) => format!("list of {size} of {kind}"),
        FigureShape::UpTo(most) => format!("list of {kind}, at most {most}"),
        FigureShape::ListOfOptional => format!("list of {kind} or none"),
        FigureShape::Lists => format!("lists of {kind}"),
    };
    let mut text = figure.text.to_owned();
    for (name, _) in figure.parts {
        let _ = write!(text, "{} `{name}`", if text.ends_with('.') { " In C:" } else { "," });
    }
    if !figure.parts.is_empty() {
        text.push('.');
    }
    let text = figure.choices().iter().fold(text, |text, choice| format!("{text} `{}`: {}", choice.name, choice.text));
    let mut rows = format!("| `{within}{}` | {} | {kind} | {text} | {} |\n", figure.name, figure.label, figure.since);
    if let FigureKind::Nested(schema) = figure.kind {
        schema.figures.iter().for_each(|inner| rows += &row(inner, &format!("{within}{}.", figure.name)));
    }
    rows
}

fn kind(p: &ParamSpec) -> &'static str {
    match p.kind {
        ParamKind::Length => "length",
        ParamKind::Angle => "angle",
        ParamKind::Ratio => "ratio",
        ParamKind::Count => "count",
        ParamKind::Flag => "flag",
        ParamKind::Choice(_) => "choice",
    }
}

fn default(p: &ParamSpec) -> String {
    match (p.kind, rule(p)) {
        (_, Some(rule)) => rule.to_owned(),
        (ParamKind::Flag, _) => if plain_default(p).as_deref() == Some("1") { "on" } else { "off" }.to_owned(),
        (ParamKind::Choice(choices), _) => format!("`{}`", choices[default_choice(p)].name),
        _ => plain_default(p).unwrap_or_default(),
    }
}

fn meaning(p: &ParamSpec) -> String {
    p.choices().iter().fold(p.full_text(), |text, choice| format!("{text} `{}`: {}", choice.name, choice.text))
}
