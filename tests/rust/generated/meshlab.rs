//! The parameters of MeshLab's filters: tables of C++, in the order of the rows.

use std::fmt::Write as _;

use surfrecon::operations::OPERATIONS;
use surfrecon::params::{Default, ParamKind, ParamSpec, schemas};
use surfrecon::reports::{FigureKind, reports};

use crate::c_params::{is_whole, names};
use crate::compare;
use crate::words::{number, range, rule, sentence};

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// The text of a tip. If the data give the default, 0 asks for it, whatever it does in the library.
fn tip(row: &ParamSpec) -> String {
    let mut text = match rule(row) {
        Some(_) => row.text.to_owned(),
        None => row.full_text(),
    };
    for choice in row.choices() {
        let _ = write!(text, "<br>{}: {}", choice.label, choice.text);
    }
    if row.kind == ParamKind::Angle {
        let [min, max] = degrees(row).map(number);
        let low = if row.min_excluded { format!("more than {min}, at most") } else { format!("{min} to") };
        let _ = write!(text, " Degrees, {low} {max}.");
    } else if rule(row).is_none() && !range(row).is_empty() {
        let _ = write!(text, " {}.", sentence(&range(row)));
    }
    if let Some(rule) = rule(row) {
        let none = if row.any_number { "Empty" } else { "0" };
        let _ = write!(text, "<br>{none}: {rule}.");
    }
    text
}

/// The range of an angle as MeshLab shows it.
fn degrees(row: &ParamSpec) -> [f64; 2] {
    [row.min, row.max].map(|angle| (angle.to_degrees() * 1e9).round() / 1e9)
}

#[test]
fn filters() {
    let mut out = "// SPDX-License-Identifier: GPL-3.0-or-later\n\
                   // Parameters of the operations. Written by `make generate` from their declarations in the core: change those.\n\
                   #pragma once\n\n#include <cstddef>\n\n#include \"parameter.h\"\n\nnamespace srf {\n"
        .to_owned();
    for schema in schemas() {
        let (of, _) = names(schema.operation);
        let _ = write!(out, "\ninline const Parameters {}_parameters = {{\n", schema.operation);
        for row in (schema.all)() {
            if row.name == "threads" {
                // MeshLab has no place for them; results do not depend on them.
                continue;
            }
            let kind = match row.kind {
                _ if row.any_number => "number_or_none",
                // Nothing is loaded yet of whose size a length could be a share.
                ParamKind::Length if schema.operation == "open" => "ratio",
                ParamKind::Length => "length",
                ParamKind::Angle => "angle",
                ParamKind::Ratio => "ratio",
                ParamKind::Count => "count",
                ParamKind::Flag => "flag",
                ParamKind::Choice(_) => "choice",
            };
            let initial = match row.default {
                Default::FromData(_) => "0".to_owned(),
                Default::Value(value) if row.kind == ParamKind::Angle => {
                    number((value.to_degrees() * 1e9).round() / 1e9)
                }
                Default::Value(value) => number(value),
            };
            let [least, most] = if row.kind == ParamKind::Angle { degrees(row) } else { [row.min, row.max] };
            let bound = |value: f64| if value.is_finite() { number(value) } else { "unbounded".to_owned() };
            let choices: Vec<String> = row.choices().iter().map(|choice| quoted(choice.label)).collect();
            let _ = writeln!(
                out,
                "    {{Kind::{kind}, \"{}\", {},\n     {},\n     {}, {initial}, {}, {}, {}, offsetof({of}, {}), {{{}}}}},",
                row.name,
                quoted(row.label),
                quoted(&tip(row)),
                row.is_optional(),
                bound(least),
                bound(most),
                is_whole(row),
                row.name,
                choices.join(", "),
            );
        }
        out += "};\n";
    }
    out += "\n}  // namespace srf\n";
    compare("meshlab-plugin/src/parameters.h", &out);
}

#[test]
fn figures() {
    let mut out = "// SPDX-License-Identifier: GPL-3.0-or-later\n\
                   // Figures of the operations. Written by `make generate` from their declarations in the core: change those.\n\
                   #pragma once\n\n#include \"report.h\"\n\nnamespace srf {\n"
        .to_owned();
    let has_filter = |name| OPERATIONS.iter().any(|operation| operation.name == name && operation.meshlab.is_some());
    for reported in reports().filter(|reported| has_filter(reported.operation)) {
        let _ = write!(out, "\ninline const Figures {}_figures = {{\n", reported.operation);
        for field in reported.fields() {
            let kind = match field.kind() {
                FigureKind::Flag => "flag",
                FigureKind::Count => "count",
                FigureKind::Integer => "integer",
                FigureKind::Bytes => "bytes",
                FigureKind::Length => "length",
                FigureKind::Angle => "angle",
                FigureKind::Ratio => "ratio",
                FigureKind::Number => "number",
                FigureKind::Choice(_) => "choice",
                FigureKind::Vector => "number",
                // The filters set matrices themselves, and the log says the rest.
                FigureKind::Pose | FigureKind::Matrix(_) | FigureKind::Nested(_) => continue,
                other => unreachable!("{other:?} has no fixed size"),
            };
            let choices: Vec<String> = field.figure.choices().iter().map(|choice| quoted(choice.label)).collect();
            let names: Vec<String> = field.figure.choices().iter().map(|choice| quoted(choice.name)).collect();
            let _ = writeln!(
                out,
                "    {{Figure::Kind::{kind}, \"{0}\", {1}, {2}, {3}, offsetof(srf_{4}_report, {0}), {{{5}}}, {{{6}}}}},",
                field.name,
                quoted(&field.label),
                field.is_optional(),
                field.numbers(),
                reported.operation,
                names.join(", "),
                choices.join(", "),
            );
        }
        out += "};\n";
    }
    out += "\n}  // namespace srf\n";
    compare("meshlab-plugin/src/reports.h", &out);
}

/// Names, texts and menus of the filters that are operations. What a filter asks for and does is in the file of the operation's name.
#[test]
fn operations() {
    let mut out = "// SPDX-License-Identifier: GPL-3.0-or-later\n\
                   // The operations as filters. Written by `make generate` from their declarations in the core: change those.\n\
                   #pragma once\n\n#include \"filter.h\"\n\nnamespace srf {\n"
        .to_owned();
    let mut names = Vec::new();
    for operation in OPERATIONS {
        let Some(filter) = operation.meshlab else { continue };
        let menus: Vec<String> = filter.menus.iter().map(|menu| format!("compat::FilterBase::{menu}")).collect();
        // No literal has more than it may have at most, if it is cut at line breaks.
        let text: Vec<String> = filter.text.split_inclusive("<br>").map(quoted).collect();
        let _ = write!(
            out,
            "\nvoid ask_{0}(const MeshDocument &document, RichParameterList &list);\nOutputs run_{0}(Job &job);\n\
             inline const Filter {0}_filter = {{\n    {1},\n    {2},\n    {3},\n    {4},\n    compat::FilterBase::{5},\n    ask_{0},\n    run_{0},\n}};\n",
            operation.name,
            quoted(filter.label),
            quoted(filter.id),
            text.join("\n    "),
            menus.join(" | "),
            filter.layers,
        );
        names.push(operation.name);
    }
    let list: Vec<String> = names.iter().map(|name| format!("    &{name}_filter,\n")).collect();
    let _ = write!(
        out,
        "\ninline const Filter *const operation_filters[] = {{\n{}}};\n\n}}  // namespace srf\n",
        list.concat()
    );
    compare("meshlab-plugin/src/operations.h", &out);
}
