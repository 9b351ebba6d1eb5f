//! The header's structs and functions as the tests of the C library declare them: `tests/rust/c/generated.rs` and the list in
//! `tests/rust/c/library.rs`.

use std::fmt::Write as _;

use surfrecon::params::schemas;
use surfrecon::reports::{ReportField, fields as fields_of, reports};

use crate::c_params::{beside, fields, formatted, names};
use crate::chapters::CHAPTERS;
use crate::words::snake;
use crate::{between, compare, root};

/// `srf_read_options` as `ReadOptions`.
pub fn type_name(of: &str) -> String {
    of.trim_start_matches("srf_").split('_').map(crate::words::sentence).collect()
}

#[test]
fn structs_of_the_c_tests() {
    let mut out =
        "//! Structs of the header by the numbers after their first eight bytes. Written by `make generate`.\n\n\
                   use crate::types::Sized;\n"
            .to_owned();
    for schema in schemas() {
        let (name, _) = names(schema.operation);
        let numbers = beside(schema).iter().map(|field| numbers_of(field.1)).sum::<usize>();
        let _ = write!(out, "\npub type {} = Sized<{}>;\n", type_name(&name), numbers + fields(schema).len());
    }
    let mut made = Vec::new();
    for reported in reports() {
        for listed in reported.listed() {
            let name = snake(listed.schema.name);
            if !listed.is_held && !made.contains(&name) {
                out += &places(listed.schema.name, &name, &fields_of(listed.schema.figures.iter()));
                made.push(name);
            }
        }
        out += &places(reported.name(), &format!("{}_report", reported.operation), &reported.fields());
    }
    compare("tests/rust/c/generated.rs", &formatted(&out));
}

/// The table of structs with their functions, by which a test compares all defaults.
#[test]
fn parameters_of_the_c_tests() {
    let list: String = schemas()
        .map(|schema| {
            let (name, _) = names(schema.operation);
            format!("        (\"{}\", \"{name}\", init!({name}_init_sized)),\n", schema.operation)
        })
        .collect();
    let name = "tests/rust/c/structs.rs";
    compare(name, &between(name, "    let structs: &[(&str, &str, Init)] = &[\n", "    ];\n", &list));
}

/// A struct of figures, and a module with the place of each.
fn places(kind: &str, module: &str, fields: &[ReportField]) -> String {
    let (mut numbers, mut places) = (0, String::new());
    for field in fields {
        let _ = writeln!(places, "    pub const {}: usize = {numbers};", field.name.to_uppercase());
        numbers += field.numbers();
    }
    format!(
        "\npub type {kind} = Sized<{numbers}>;\n\n/// Places of the figures of [`{kind}`].\n\
         #[allow(dead_code, reason = \"tests look at some\")]\npub mod {module} {{\n{places}}}\n"
    )
}

/// Number of numbers of an array, by its type.
fn numbers_of(kind: &str) -> usize {
    let size = kind.trim_end_matches(']').rsplit("; ").next();
    size.and_then(|size| size.parse().ok()).unwrap_or(1)
}

/// The functions in the order of the header, with types that know nothing of the library's.
#[test]
fn functions_of_the_c_tests() {
    let mut list = String::new();
    for file in CHAPTERS.iter().flat_map(|chapter| chapter.files) {
        let path = root().join("c-api/src").join(file).with_extension("rs");
        let source = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        for piece in source.split("extern \"C\" fn srf_").skip(1) {
            // Types of functions have no name.
            let (name, rest) = piece.split_once('(').expect("arguments");
            let (arguments, rest) = rest.split_once(')').expect("their end");
            let result = rest.split_once('{').map_or("", |(result, _)| result.trim().trim_start_matches("->").trim());
            let arguments: Vec<String> = arguments
                .split(',')
                .filter_map(|argument| argument.trim().split_once(": "))
                .map(|(name, kind)| format!("{name}: {}", plain(kind)))
                .collect();
            let _ = writeln!(list, "    srf_{name}({}) -> {};", arguments.join(", "), plain(result));
        }
    }
    let name = "tests/rust/c/library.rs";
    compare(name, &between(name, "functions! {\n", "}\n\n/// The functions of the built library, which", &list));
}

/// A type of the library as a stranger has it.
fn plain(kind: &str) -> String {
    let known = [
        ("srf_status", "i32"),
        ("srf_log_fn", "LogFn"),
        ("srf_pose", "[f64; 16]"),
        ("srf_progress", "Watch"),
        ("srf_allocator", "[usize; 4]"),
    ];
    let named = |name: &str| {
        let reported = reports().find(|reported| format!("srf_{}_report", reported.operation) == name);
        match (known.iter().find(|(of, _)| *of == name), reported) {
            (Some((_, plain)), _) => (*plain).to_owned(),
            (None, Some(reported)) => reported.name().to_owned(),
            (None, None) if name.starts_with("srf_") => type_name(name),
            (None, None) => name.to_owned(),
        }
    };
    let name = kind.trim_start_matches(['*', ' ']).rsplit(' ').next().unwrap_or_default();
    let before = kind.strip_suffix(name).expect("a name ends its type");
    let is_handle = name.starts_with("srf_") && is_opaque(name);
    match (before.trim(), is_handle) {
        ("*mut" | "*const", true) => "Handle".to_owned(),
        ("*mut *mut", true) => "*mut Handle".to_owned(),
        ("*const *const", true) => "*const Handle".to_owned(),
        ("", _) => named(name),
        _ => format!("{before}{}", named(name)),
    }
}

/// Whether a type is one whose inside nobody sees.
fn is_opaque(name: &str) -> bool {
    CHAPTERS.iter().flat_map(|chapter| chapter.files).any(|file| {
        let path = root().join("c-api/src").join(file).with_extension("rs");
        let source = std::fs::read_to_string(path).unwrap_or_default();
        source.contains(&format!("pub struct {name} {{\n    _opaque: [u8; 0],"))
    })
}
