//! The classes of reports in Python: what stands between `# reports` and `# end` in `_reports.py`.

use std::fmt::Write as _;

use surfrecon::reports::{Figure, Kind, Reported, Schema, Shape, reports};

use crate::compare;
use crate::words::wrapped;

const WIDTH: usize = 120;
/// What an interpreter shows of each class: the call that gives it, and figures that tell most.
const EXAMPLES: &[(&str, &[&str])] = &[
    (
        "MergeReport",
        &[
            ">>> report = surfrecon.merge(scans).report",
            ">>> report.scans, report.scan_names[0], report.voxel_reason",
            "(6, 'view0', 'spacing')",
        ],
    ),
    (
        "SculptReport",
        &[
            ">>> report = surfrecon.sculpt(image, tolerance=0.5).report",
            ">>> report.max_error <= report.tolerance, report.triangles < report.full_triangles",
            "(True, True)",
        ],
    ),
    (
        "QuadReport",
        &[
            ">>> report = surfrecon.adaptive_quads(image).report",
            ">>> report.rms_error <= report.uniform_rms_error",
            "True",
        ],
    ),
    (
        "ReconstructReport",
        &[
            ">>> report = surfrecon.reconstruct(points).report",
            ">>> report.closed, report.used == report.points",
            "(True, True)",
        ],
    ),
    (
        "TriangleShapes",
        &[
            ">>> shapes = surfrecon.cluster(mesh, vertices=500).report.after",
            ">>> shapes.smallest_angle < shapes.mean_smallest_angle < np.pi / 3",
            "True",
        ],
    ),
    (
        "ClusterReport",
        &[
            ">>> report = surfrecon.cluster(mesh, vertices=500).report",
            ">>> report.vertices, report.after.mean_smallest_angle > report.before.mean_smallest_angle",
            "(500, True)",
        ],
    ),
    ("CheckReport", &[">>> report = mesh.check()", ">>> report.is_manifold, report.boundary_edges", "(True, 0)"]),
];

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

fn example(class: &str) -> &'static [&'static str] {
    let found = EXAMPLES.iter().find(|(name, _)| *name == class);
    found.unwrap_or_else(|| panic!("{class} has no example: give it one here")).1
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
    out.push('\n');
    example(name).iter().for_each(|line| out += &format!("    {line}\n"));
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

/// The schemas of the reports that figures of a report are.
fn inner(reported: &Reported) -> Vec<&'static Schema> {
    let mut found: Vec<&Schema> = Vec::new();
    for figure in reported.figures() {
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
    let mut classes = String::new();
    for reported in reports() {
        for schema in inner(&reported) {
            classes += &format!("{}\n\n", class(schema.name, schema.text, schema.figures.iter()));
        }
        let figures: Vec<&Figure> = reported.figures().collect();
        classes += &format!("{}\n\n", class(reported.name(), reported.text(), figures.into_iter()));
    }
    let name = "python/python/surfrecon/_reports.py";
    compare(name, &crate::between(name, "# reports\n", "# end\n", &classes));
}
