//! PARAMETERS.md.

use std::fmt::Write as _;

use surfrecon::params::{Kind, ParamSpec, SCHEMAS};

use crate::compare;
use crate::words::{plain_default, range, rule};

#[test]
fn parameters() {
    let mut page = "# Parameters\n\nThe same in every language; generated from the operations' declarations by `make generate`. Lengths are \
                    in the unit of the scans, angles in radians (Blender and MeshLab show degrees); choices are names, in C numbers \
                    counted from 1.\n"
        .to_owned();
    for schema in SCHEMAS {
        let _ = write!(
            page,
            "\n## {}\n\n{}\n\n| name | | kind | default | range | meaning | since |\n|---|---|---|---|---|---|---|\n",
            schema.operation, schema.text
        );
        for p in schema.rows {
            let (name, label, kind) = (p.name, p.label, kind(p));
            let _ = writeln!(
                page,
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
            let _ = writeln!(page, "\nAnd those of [{other}](#{other}).");
        }
    }
    compare("PARAMETERS.md", &page);
}

fn kind(p: &ParamSpec) -> &'static str {
    match p.kind {
        Kind::Length => "length",
        Kind::Angle => "angle",
        Kind::Ratio => "ratio",
        Kind::Count => "count",
        Kind::Flag => "flag",
        Kind::Choice(_) => "choice",
    }
}

fn default(p: &ParamSpec) -> String {
    match (p.kind, rule(p)) {
        (_, Some(rule)) => rule.to_owned(),
        (Kind::Flag, _) => if plain_default(p).as_deref() == Some("1") { "on" } else { "off" }.to_owned(),
        (Kind::Choice(choices), _) => format!("`{}`", choices[0].name),
        _ => plain_default(p).unwrap_or_default(),
    }
}

fn meaning(p: &ParamSpec) -> String {
    p.choices().iter().fold(p.full_text(), |text, choice| format!("{text} `{}`: {}", choice.name, choice.text))
}
