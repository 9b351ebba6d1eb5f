//! The structs of figures in C: a file an operation in `c-api/src/reports`, with the struct, the enums of its choices and the
//! function that prepares it. The header is made of them like of every other file.

use std::fmt::Write as _;

use surfrecon::reports::{Figure, FigureKind, Holds, ReportField, ReportSchema, Reported, fields, reports};

use crate::c_params::{comment, formatted};
use crate::compare;
use crate::words::{sentence, snake};

/// The C type of a value.
fn type_of(kind: FigureKind) -> String {
    match kind {
        FigureKind::Length | FigureKind::Angle | FigureKind::Ratio | FigureKind::Number => "f64".to_owned(),
        FigureKind::Vector => "[f64; 3]".to_owned(),
        FigureKind::Pose => "srf_pose".to_owned(),
        FigureKind::Matrix(rows) => format!("[[f64; {rows}]; {rows}]"),
        FigureKind::Integer => "i64".to_owned(),
        _ => "u64".to_owned(),
    }
}

fn type_of_field(field: &ReportField) -> String {
    match field.holds {
        Holds::One | Holds::Length => type_of(field.kind()),
        Holds::Array(size) => format!("[{}; {size}]", type_of(field.kind())),
        Holds::Reports(most, schema) => format!("[srf_{}; {most}]", snake(schema.name)),
    }
}

fn text_of(field: &ReportField) -> String {
    let mut text = sentence(&field.text);
    if field.is_optional() {
        text += match field.kind() {
            FigureKind::Length | FigureKind::Angle | FigureKind::Ratio | FigureKind::Number => {
                " Then it is SRF_FROM_DATA."
            }
            FigureKind::Vector | FigureKind::Pose | FigureKind::Matrix(_) => " Then it is all 0.",
            FigureKind::Integer => " Then it is -1.",
            _ => " Then it is UINT64_MAX.",
        };
    }
    match field.kind() {
        FigureKind::Length => text += " In the unit of the scans.",
        FigureKind::Angle => text += " Radians.",
        FigureKind::Flag => text += " 1 or 0.",
        FigureKind::Choice(choices) => {
            let _ = write!(
                text,
                " A value of srf_{0}, such as {1}.",
                field.figure.type_of_choices(),
                constant(field.figure, choices[0].name)
            );
        }
        _ => {}
    }
    if field.since != "0.1" {
        let _ = write!(text, " Since {}.", field.since);
    }
    text
}

fn constant(figure: &Figure, choice: &str) -> String {
    format!("SRF_{}_{}", figure.type_of_choices().to_uppercase(), choice.to_uppercase())
}

/// The enums of choices that no file before has.
fn enums(fields: &[ReportField], made: &mut Vec<&'static str>) -> String {
    let mut out = String::new();
    for figure in fields.iter().map(|field| field.figure) {
        let FigureKind::Choice(choices) = figure.kind else { continue };
        if made.contains(&figure.type_of_choices()) {
            continue;
        }
        made.push(figure.type_of_choices());
        let _ = write!(
            out,
            "\n/// {}\n#[allow(non_camel_case_types, dead_code)]\n#[repr(C)]\n#[derive(Clone, Copy, Debug, PartialEq, Eq)]\npub enum srf_{} {{\n",
            figure.text,
            figure.type_of_choices()
        );
        for (place, choice) in choices.iter().enumerate() {
            out += &comment(choice.text, "    ");
            let _ = writeln!(out, "    {} = {},", constant(figure, choice.name), place + 1);
        }
        out += "}\n";
    }
    out
}

/// A struct, whose first eight bytes are its size unless another struct holds it, so that it never grows.
fn structure(name: &str, text: &str, fields: &[ReportField], is_held: bool) -> String {
    let text = match is_held {
        true => text.to_owned(),
        false => format!("{text} Starts with its size. Prepared by {name}_init()."),
    };
    let mut out = format!("\n{}", comment(&text, ""));
    out += "#[allow(non_camel_case_types)]\n#[repr(C)]\n#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]\n";
    let _ = writeln!(out, "pub struct {name} {{");
    if !is_held {
        out += "    /// Bytes of this struct.\n    pub struct_size: u32,\n    /// 0.\n    pub reserved: u32,\n";
    }
    for field in fields {
        out += &comment(&text_of(field), "    ");
        let _ = writeln!(out, "    pub {}: {},", field.name, type_of_field(field));
    }
    out += "}\n";
    if !is_held {
        let _ = write!(
            out,
            "\n/// Prepares a struct of figures. Call {name}_init(report), which adds the size that this header knows.\n\
             /// report   not NULL\n\
             /// size     sizeof({name}): what of the struct this library does not know becomes 0\n\
             /// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.\n\
             #[unsafe(no_mangle)]\n\
             pub unsafe extern \"C\" fn {name}_init_sized(report: *mut {name}, size: usize) -> srf_status {{\n    \
             guard(|| sized::init::<{name}>(\"report\", report, size, bytemuck::Zeroable::zeroed()))\n}}\n"
        );
    }
    out
}

/// The name of the struct of a report that others have lists of.
pub fn listed_name(schema: &ReportSchema) -> String {
    format!("srf_{}", snake(schema.name))
}

fn file(reported: &Reported, made: &mut Vec<&'static str>) -> String {
    let (mut enumerated, mut structures) = (String::new(), String::new());
    for listed in reported.listed() {
        let name = listed_name(listed.schema);
        if made.contains(&listed.schema.name) {
            continue;
        }
        made.push(listed.schema.name);
        let fields = fields(listed.schema.figures.iter());
        enumerated += &enums(&fields, made);
        structures += &structure(&name, listed.schema.text, &fields, listed.is_held);
    }
    let fields = reported.fields();
    enumerated += &enums(&fields, made);
    structures += &structure(&format!("srf_{}_report", reported.operation), reported.text(), &fields, false);
    let poses = if structures.contains("srf_pose") { "use crate::pose::srf_pose;\n" } else { "" };
    let held: Vec<String> = reported
        .listed()
        .iter()
        .map(|listed| listed_name(listed.schema))
        .filter(|name| !structures.contains(&format!("pub struct {name} {{")) && structures.contains(name.as_str()))
        .map(|name| format!("use crate::reports::align::{name};\n"))
        .collect();
    format!(
        "//! Figures of {}. Written by `make generate` from their declaration in the core: change that.\n\n\
         use crate::guard::guard;\n{poses}{}use crate::sized;\nuse crate::status::srf_status;\n{enumerated}{structures}",
        reported.operation,
        held.concat(),
    )
}

#[test]
pub fn structs() {
    let mut list = "//! Structs of figures, a file a report. Written by `make generate`.\n\n".to_owned();
    let mut names: Vec<_> = reports().map(|reported| reported.operation).collect();
    names.sort_unstable();
    for name in names {
        let _ = writeln!(list, "pub mod {name};");
    }
    compare("c-api/src/reports.rs", &list);
    let mut made = Vec::new();
    for reported in reports() {
        compare(&format!("c-api/src/reports/{}.rs", reported.operation), &formatted(&file(&reported, &mut made)));
    }
}
