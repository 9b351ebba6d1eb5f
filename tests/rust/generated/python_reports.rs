//! The classes of reports in Python: what stands between `# reports` and `# end` in `_reports.py`.

use std::fmt::Write as _;

use surfrecon::operations::{DataKind, OPERATIONS};
use surfrecon::reports::{Figure, FigureKind, FigureShape, ReportSchema, reports};

use crate::modules::listed;
use crate::words::wrapped;
use crate::{between, compare, replaced};

const WIDTH: usize = 120;
/// Sessions that an interpreter shows of each class: the call that gives it, and figures that tell most.
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
        "CloseReport",
        &[
            ">>> merged = surfrecon.merge(scans).mesh",
            ">>> report = surfrecon.close(merged, scans).report",
            ">>> report.is_closed == (report.open_edges == 0) and sum(report.left) == len(report.open)",
            "True",
        ],
    ),
    (
        "PrintReport",
        &[
            ">>> report = surfrecon.check_print(mesh).report",
            ">>> report.is_closed, report.crossing_pairs, report.bodies",
            "(True, 0, 1)",
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
    (
        "AlignReport",
        &[
            ">>> report = surfrecon.align(scans).report",
            ">>> report.placed, report.groups",
            "(6, [[0, 1, 2, 3, 4, 5]])",
            ">>> report.summary[0].partition(\".\")[0]",
            "'6 of 6 scans placed'",
        ],
    ),
    (
        "AlignedScan",
        &[
            ">>> report = surfrecon.align(scans).report",
            ">>> [(scan.name, scan.reason) for scan in report.scans if scan.state == \"unplaced\"]",
            "[]",
        ],
    ),
    (
        "AlignedPair",
        &[
            ">>> report = surfrecon.align(scans).report",
            ">>> [pair.scans for pair in report.pairs if pair.state == \"fits\"][0]",
            "(0, 1)",
        ],
    ),
    (
        "Freedom",
        &[
            ">>> report = surfrecon.align(scans).report",
            ">>> [way.turns for pair in report.pairs if pair.state == \"fits\" for way in pair.freedoms]",
            "[]",
        ],
    ),
    (
        "TurntableFound",
        &[
            ">>> table = surfrecon.align(scans, turntable=\"turned\").report.turntable",
            ">>> np.degrees(table.angles).round()",
            "array([  0.,  60., 120., 180., 240., 300.])",
        ],
    ),
    (
        "Snap",
        &[
            ">>> snap = surfrecon.Aligner(scans).snap(2, scans[2].world_from_sensor)",
            ">>> snap.state, 3 in snap.touches",
            "('fits', True)",
        ],
    ),
    (
        "TexturedPhoto",
        &[
            ">>> flat = surfrecon.unwrap(light, size=128).mesh",
            ">>> report = surfrecon.texture(flat, detail, photos, size=128).report",
            ">>> [photo.name for photo in report.photos] == [photo.name for photo in photos]",
            "True",
        ],
    ),
    (
        "TextureReport",
        &[
            ">>> flat = surfrecon.unwrap(light, size=128).mesh",
            ">>> report = surfrecon.texture(flat, detail, photos, size=128).report",
            ">>> 0 < report.seen <= report.texels < 128**2",
            "True",
        ],
    ),
    (
        "DistanceReport",
        &[
            ">>> coarse = surfrecon.cluster(mesh, vertices=500).mesh",
            ">>> report = surfrecon.surface_distance(coarse, mesh)",
            ">>> report.rms <= report.p95 <= report.max <= report.bound",
            "True",
        ],
    ),
    ("LeftOutReport", &[">>> left_out = scans[0].left_out", ">>> left_out.low_confidence <= left_out.of", "True"]),
];

fn type_of(figure: &Figure) -> String {
    let plain = match figure.kind {
        FigureKind::Flag => "bool".to_owned(),
        FigureKind::Count | FigureKind::Integer | FigureKind::Bytes => "int".to_owned(),
        FigureKind::Length | FigureKind::Angle | FigureKind::Ratio | FigureKind::Number => "float".to_owned(),
        FigureKind::Choice(choices) => {
            let names: Vec<String> = choices.iter().map(|choice| format!("\"{}\"", choice.name)).collect();
            format!("Literal[{}]", names.join(", "))
        }
        FigureKind::Vector => "tuple[float, float, float]".to_owned(),
        FigureKind::Pose | FigureKind::Matrix(_) => "NDArray[np.float64]".to_owned(),
        FigureKind::Text => "str".to_owned(),
        FigureKind::Warning(_) => "tuple[str, str]".to_owned(),
        FigureKind::Stage => return "dict[str, float]".to_owned(),
        FigureKind::Nested(schema) => schema.name.to_owned(),
    };
    let tuple = |size| format!("tuple[{}]", vec![plain.as_str(); size].join(", "));
    match figure.shape {
        FigureShape::One => plain,
        FigureShape::Optional => format!("{plain} | None"),
        FigureShape::Array(size) => tuple(size),
        FigureShape::OptionalArray(size) => format!("{} | None", tuple(size)),
        FigureShape::List(0) | FigureShape::UpTo(_) => format!("list[{plain}]"),
        FigureShape::ListOfOptional => format!("list[{plain} | None]"),
        FigureShape::Lists => format!("list[list[{plain}]]"),
        FigureShape::List(size) => format!("list[{}]", tuple(size)),
    }
}

/// The text with names in code as Python's documentation marks them.
fn marked(text: &str) -> String {
    text.replace('`', "``")
}

fn text_of(figure: &Figure) -> String {
    let mut text = marked(figure.text);
    if figure.is_optional() {
        text += " Then it is ``None``.";
    }
    match figure.kind {
        FigureKind::Length => text += " In the unit of the scans.",
        FigureKind::Angle => text += " Radians.",
        FigureKind::Pose => text += " 4 x 4 float64.",
        FigureKind::Matrix(rows) => {
            let _ = write!(text, " {rows} x {rows} float64.");
        }
        FigureKind::Warning(kinds) => {
            text += " A kind and a sentence each:";
            for kind in kinds {
                let _ = write!(text, " ``{}``: {}", kind.name, kind.text);
            }
        }
        FigureKind::Choice(choices) => {
            for choice in choices {
                let _ = write!(text, " ``\"{}\"``: {}", choice.name, choice.text);
            }
        }
        _ => {}
    }
    text
}

/// Figures that Python's reports have beside those of the core: name, type and text.
const ADDED: &[(&str, &str, &str, &str)] = &[
    ("AlignReport", "summary", "list[str]", "All of it in words, a line each. `print` shows it."),
    ("DistanceReport", "distances", "NDArray[np.float64]", "(n,) float64, exact, one for each vertex."),
];

/// A session that shows a class: the one that is written above, or that a figure is had by name and by key.
fn example<'a>(class: &str, operation: &str, mut figures: impl Iterator<Item = &'a Figure>) -> Vec<String> {
    if let Some((_, lines)) = EXAMPLES.iter().find(|(name, _)| *name == class) {
        return lines.iter().map(|line| (*line).to_owned()).collect();
    }
    let taken = OPERATIONS.iter().find(|one| one.name == operation && one.report.iter().any(|r| r.name == class));
    // As the tests of examples call their inputs.
    let input = taken.and_then(|operation| match operation.takes[0] {
        DataKind::Mesh => Some("mesh"),
        DataKind::Points => Some("points"),
        DataKind::Scans => Some("scans"),
        DataKind::Image => Some("image"),
        _ => None,
    });
    let figure = figures.find(|figure| figure.shape == FigureShape::One && figure.kind != FigureKind::Stage);
    let (Some(input), Some(figure)) = (input, figure) else { panic!("{class} has no example: give it one here") };
    let figure = figure.name;
    vec![
        format!(">>> report = surfrecon.{operation}({input}).report"),
        format!(">>> report.{figure} == report[\"{figure}\"]"),
        "True".to_owned(),
    ]
}

fn class<'a>(name: &str, operation: &str, about: &str, figures: impl Iterator<Item = &'a Figure> + Clone) -> String {
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
    example(name, operation, figures.clone()).iter().for_each(|line| out += &format!("    {line}\n"));
    out += "\n    Attributes:\n";
    for figure in figures.clone() {
        let text = format!("{}: {}", figure.name, text_of(figure));
        let mut lines = wrapped(&text, "            ", WIDTH);
        lines[0] = lines[0][4..].to_owned();
        lines.iter().for_each(|line| out += &format!("{line}\n"));
    }
    for (_, added, _, text) in ADDED.iter().filter(|(class, ..)| *class == name) {
        let mut lines = wrapped(&format!("{added}: {}", marked(text)), "            ", WIDTH);
        lines[0] = lines[0][4..].to_owned();
        lines.iter().for_each(|line| out += &format!("{line}\n"));
    }
    out += "    \"\"\"\n\n    __slots__ = ()\n";
    for figure in figures {
        let line = format!("    {}: {}", figure.name, type_of(figure));
        // Types of many choices are broken as a formatter does.
        let broken = || line.replacen('[', "[\n        ", 1).trim_end_matches(']').to_owned() + "\n    ]";
        out += &if line.len() > WIDTH { broken() } else { line.clone() };
        out.push('\n');
    }
    for (_, added, kind, _) in ADDED.iter().filter(|(class, ..)| *class == name) {
        let _ = writeln!(out, "    {added}: {kind}");
    }
    if ADDED.iter().any(|(class, added, ..)| *class == name && *added == "summary") {
        out += "\n    def __str__(self) -> str:\n        \"\"\"The summary.\"\"\"\n        return \"\\n\".join(self.summary)\n";
    }
    out
}

/// The schemas of the reports that figures are, after those that their own figures are.
fn inner<'a>(figures: impl Iterator<Item = &'a Figure>, found: &mut Vec<&'static ReportSchema>) {
    for figure in figures {
        if let FigureKind::Nested(schema) = figure.kind
            && !found.contains(&schema)
        {
            inner(schema.figures.iter(), found);
            found.push(schema);
        }
    }
}

/// The classes of all reports.
pub fn class_names() -> Vec<&'static str> {
    let mut found = Vec::new();
    reports().for_each(|reported| inner(reported.figures(), &mut found));
    found.iter().map(|schema| schema.name).chain(reports().map(|reported| reported.name())).collect()
}

#[test]
fn classes() {
    let mut classes = String::new();
    let mut made = Vec::new();
    for reported in reports() {
        let before = made.len();
        inner(reported.figures(), &mut made);
        for schema in &made[before..] {
            classes += &format!("{}\n\n", class(schema.name, reported.operation, schema.text, schema.figures.iter()));
        }
        let figures: Vec<&Figure> = reported.figures().collect();
        classes += &format!("{}\n\n", class(reported.name(), reported.operation, reported.text(), figures.into_iter()));
    }
    let name = "python/python/surfrecon/_reports.py";
    let mut names = class_names();
    names.push("Report");
    let text = between(name, "__all__ = [\n", "]\n", &listed(names));
    compare(name, &replaced(name, &text, "# reports\n", "# end\n", &classes));
}
