//! The structs of figures in C: a file an operation in `c-api/src/reports`, with the struct, the enums of its choices and the
//! function that prepares it. The header is made of them like of every other file.

use std::fmt::Write as _;

use surfrecon::reports::{Field, Figure, Kind, Reported, Shape, reports};

use crate::c_params::{comment, formatted};
use crate::compare;
use crate::words::sentence;

/// The C type of a field.
fn type_of(figure: &Figure) -> &'static str {
    match figure.kind {
        Kind::Length | Kind::Angle | Kind::Ratio | Kind::Number => "f64",
        Kind::Integer => "i64",
        _ => "u64",
    }
}

fn text_of(field: &Field) -> String {
    let mut text = sentence(&field.text);
    if matches!(field.figure.shape, Shape::Optional | Shape::OptionalArray(_)) {
        text += match type_of(field.figure) {
            "f64" => " Then it is SRF_FROM_DATA.",
            "i64" => " Then it is -1.",
            _ => " Then it is UINT64_MAX.",
        };
    }
    match field.figure.kind {
        Kind::Length => text += " In the unit of the scans.",
        Kind::Angle => text += " Radians.",
        Kind::Flag => text += " 1 or 0.",
        Kind::Choice(choices) => {
            let _ = write!(
                text,
                " A value of srf_{0}, such as {1}.",
                field.figure.name,
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
    format!("SRF_{}_{}", figure.name.to_uppercase(), choice.to_uppercase())
}

fn file(reported: &Reported) -> String {
    let name = format!("srf_{}_report", reported.operation);
    let fields = reported.fields();
    let mut out = format!(
        "//! Figures of {}. Written by `make generate` from their declaration in the core: change that.\n\n\
         use crate::guard::guard;\nuse crate::sized;\nuse crate::status::srf_status;\n",
        reported.operation
    );
    for figure in fields.iter().map(|field| field.figure) {
        let Kind::Choice(choices) = figure.kind else { continue };
        let _ = write!(
            out,
            "\n/// {}\n#[allow(non_camel_case_types, dead_code)]\n#[repr(C)]\n#[derive(Clone, Copy, Debug, PartialEq, Eq)]\npub enum srf_{} {{\n",
            figure.text, figure.name
        );
        for (place, choice) in choices.iter().enumerate() {
            out += &comment(choice.text, "    ");
            let _ = writeln!(out, "    {} = {},", constant(figure, choice.name), place + 1);
        }
        out += "}\n";
    }
    out.push('\n');
    out += &comment(&format!("{} Starts with its size. Prepared by {name}_init().", reported.text()), "");
    out += "#[allow(non_camel_case_types)]\n#[repr(C)]\n#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]\n";
    let _ = write!(
        out,
        "pub struct {name} {{\n    /// Bytes of this struct.\n    pub struct_size: u32,\n    /// 0.\n    pub reserved: u32,\n"
    );
    for field in &fields {
        out += &comment(&text_of(field), "    ");
        let plain = type_of(field.figure);
        let kind = field.array.map_or(plain.to_owned(), |size| format!("[{plain}; {size}]"));
        let _ = writeln!(out, "    pub {}: {kind},", field.name);
    }
    let _ = write!(
        out,
        "}}\n\n/// Prepares a struct of figures. Call {name}_init(report), which adds the size that this header knows.\n\
         /// report   not NULL\n\
         /// size     sizeof({name}): what of the struct this library does not know becomes 0\n\
         /// returns  SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.\n\
         #[unsafe(no_mangle)]\n\
         pub unsafe extern \"C\" fn {name}_init_sized(report: *mut {name}, size: usize) -> srf_status {{\n    \
         guard(|| sized::init(\"report\", report, size, {name}::default()))\n}}\n"
    );
    out
}

#[test]
pub fn structs() {
    let mut list = "//! Structs of figures, a file an operation. Written by `make generate`.\n\n".to_owned();
    let mut names: Vec<_> = reports().map(|reported| reported.operation).collect();
    names.sort_unstable();
    for name in names {
        let _ = writeln!(list, "pub mod {name};");
    }
    compare("c-api/src/reports.rs", &list);
    for reported in reports() {
        compare(&format!("c-api/src/reports/{}.rs", reported.operation), &formatted(&file(&reported)));
    }
}
