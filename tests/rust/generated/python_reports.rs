//! The classes of reports in Python: what stands between `# report: OPERATION` and `# end` in `_reports.py`.

use std::fmt::Write as _;

use surfrecon::reports::{Figure, Kind, Schema, Shape, report, reports};

use crate::words::wrapped;
use crate::{compare, root};

const WIDTH: usize = 120;

fn type_of(figure: &Figure) -> String {
    let plain = match figure.kind {
        Kind::Flag => "bool".to_owned(),
        Kind::Count | Kind::Integer | Kind::Bytes => "int".to_owned(),
        Kind::Length | Kind::Angle | Kind::Ratio | Kind::Number => "float".to_owned(),
        Kind::Choice(choices) => {
            let names: Vec<String> = choices.iter().map(|choice| format!("\"{}\"", choice.name)).collect();
            format!("Literal[{}]", names.join(", "))
        }
        Kind::Text => "str".to_owned(),
        Kind::Warning(_) => "tuple[str, str]".to_owned(),
        Kind::Stage => return "dict[str, float]".to_owned(),
        Kind::Nested(schema) => schema.name.to_owned(),
    };
    let tuple = |size| format!("tuple[{}]", vec![plain.as_str(); size].join(", "));
    match figure.shape {
        Shape::One => plain,
        Shape::Optional => format!("{plain} | None"),
        Shape::Array(size) => tuple(size),
        Shape::OptionalArray(size) => format!("{} | None", tuple(size)),
        Shape::List(0) => format!("list[{plain}]"),
        Shape::List(size) => format!("list[{}]", tuple(size)),
    }
}

/// The text with names in code as Python's documentation marks them.
fn marked(text: &str) -> String {
    text.replace('`', "``")
}

fn text_of(figure: &Figure) -> String {
    let mut text = marked(figure.text);
    if matches!(figure.shape, Shape::Optional | Shape::OptionalArray(_)) {
        text += " Then it is ``None``.";
    }
    match figure.kind {
        Kind::Length => text += " In the unit of the scans.",
        Kind::Angle => text += " Radians.",
        Kind::Warning(kinds) => {
            text += " A kind and a sentence each:";
            for kind in kinds {
                let _ = write!(text, " ``{}``: {}", kind.name, kind.text);
            }
        }
        Kind::Choice(choices) => {
            for choice in choices {
                let _ = write!(text, " ``\"{}\"``: {}", choice.name, choice.text);
            }
        }
        _ => {}
    }
    text
}

fn class<'a>(name: &str, about: &str, figures: impl Iterator<Item = &'a Figure> + Clone) -> String {
    let mut out = format!("class {name}(Report):\n");
    let about = wrapped(&format!("\"\"\"{}", marked(about)), "    ", WIDTH);
    let (first, rest) = match about.split_first() {
        // A docstring's first line is a sentence of its own.
        Some((line, rest)) => (line.clone(), rest),
        None => unreachable!("a report has a text"),
    };
    out += &first;
    out.push('\n');
    rest.iter().for_each(|line| out += &format!("{line}\n"));
    out += "\n    Attributes:\n";
    for figure in figures.clone() {
        let text = format!("{}: {}", figure.name, text_of(figure));
        let mut lines = wrapped(&text, "            ", WIDTH);
        lines[0] = lines[0][4..].to_owned();
        lines.iter().for_each(|line| out += &format!("{line}\n"));
    }
    out += "    \"\"\"\n\n    __slots__ = ()\n";
    for figure in figures {
        let _ = writeln!(out, "    {}: {}", figure.name, type_of(figure));
    }
    out
}

/// The reports that figures of a report are.
fn inner(schemas: &'static [Schema]) -> Vec<&'static Schema> {
    let mut found: Vec<&Schema> = Vec::new();
    for figure in schemas.iter().flat_map(|schema| schema.figures) {
        if let Kind::Nested(schema) = figure.kind
            && !found.contains(&schema)
        {
            found.push(schema);
        }
    }
    found
}

#[test]
fn classes() {
    let name = "python/python/surfrecon/_reports.py";
    let source = std::fs::read_to_string(root().join(name)).expect("the classes");
    let mut out = String::new();
    let mut skipping = false;
    let mut marks = 0;
    for line in source.split_inclusive('\n') {
        if line.trim() == "# end" {
            skipping = false;
        }
        if !skipping {
            out += line;
        }
        if let Some(operation) = line.trim().strip_prefix("# report: ") {
            skipping = true;
            marks += 1;
            let reported = report(operation).unwrap_or_else(|| panic!("{operation} has no report"));
            for schema in inner(reported.schemas) {
                out += &format!("{}\n\n", class(schema.name, schema.text, schema.figures.iter()));
            }
            let figures: Vec<&Figure> = reported.figures().collect();
            out += &format!("{}\n\n", class(reported.name(), reported.text(), figures.into_iter()));
        }
    }
    assert!(!skipping, "the last mark has no end");
    assert_eq!(marks, reports().count(), "each report has its class");
    compare(name, &out);
}
