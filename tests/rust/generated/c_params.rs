//! The structs of parameters in C: a file an operation in `c-api/src/params`, with the struct, the enums of its choices, its
//! defaults and what is given in it. The header is made of them like of every other file.

use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

use surfrecon::params::{Choice, ParamKind, ParamSchema, ParamSpec, schemas};

use crate::words::{default_choice, number, plain_default, range, rule, sentence, wrapped};
use crate::{compare, root};

/// Lengths of lines of the C library's comments, whose lines the header takes over.
const WIDTH: usize = 124;

/// Fields of a struct besides parameters.
struct Beside {
    operation: &'static str,
    fields: &'static [(&'static str, &'static str, &'static str, &'static str)],
}

/// Name, type, default, text.
const BESIDE: &[Beside] = &[Beside {
    operation: "open",
    fields: &[
        (
            "intrinsics",
            "[f64; 4]",
            "[0.0; 4]",
            "fx, fy, cx, cy in pixels, pixel centres at whole numbers: images are depth images of that camera. All 0, the default: they \
             are height maps, unless a file of a camera is opened with them.",
        ),
        (
            "camera_size",
            "[u64; 2]",
            "[0; 2]",
            "Of the camera of these intrinsics: columns and rows of its images. Others are refused. 0 and 0, the default: any.",
        ),
    ],
}];

/// The name of an operation's struct, and of the argument it is handed over as.
pub fn names(operation: &str) -> (String, &'static str) {
    match operation {
        "open" => ("srf_read_options".to_owned(), "options"),
        "write" => ("srf_write_options".to_owned(), "options"),
        other => (format!("srf_{other}_params"), "params"),
    }
}

/// Whether the C field is a whole number of 64 bits. Others are doubles.
pub fn is_whole(row: &ParamSpec) -> bool {
    match row.kind {
        ParamKind::Flag | ParamKind::Choice(_) => true,
        // 0 stands for none where it is no value.
        ParamKind::Count => !row.is_optional() || row.min >= 1.0,
        ParamKind::Length | ParamKind::Angle | ParamKind::Ratio => false,
    }
}

/// The rows in the order of the struct's fields: later versions' come last, so that the struct grows at its end.
pub fn fields(schema: &ParamSchema) -> Vec<&'static ParamSpec> {
    let mut rows: Vec<_> = (schema.all)().into_iter().filter(|row| row.name != "threads").collect();
    rows.sort_by_key(|row| {
        row.since.split('.').map(|part| part.parse().expect("versions are numbers")).collect::<Vec<u32>>()
    });
    rows
}

pub fn has_threads(schema: &ParamSchema) -> bool {
    schema.rows.iter().any(|row| row.name == "threads")
}

fn constant(row: &ParamSpec, choice: &str) -> String {
    format!("SRF_{}_{}", row.name.to_uppercase(), choice.to_uppercase())
}

fn text_of(row: &ParamSpec) -> String {
    let mut text = row.full_text();
    let range = range(row);
    let _ = match (row.kind, rule(row)) {
        (ParamKind::Choice(choices), _) => {
            write!(text, " A value of srf_{}, default {}.", row.name, constant(row, choices[default_choice(row)].name))
        }
        (ParamKind::Flag, _) => {
            write!(text, " 1 or 0, default {}.", plain_default(row).expect("flags have plain ones"))
        }
        (ParamKind::Count, Some(_)) if !is_whole(row) => {
            text += " A whole number.";
            write!(text, " {range}. SRF_FROM_DATA, the default: {}.", rule(row).unwrap_or_default())
        }
        (ParamKind::Angle, None) => {
            write!(text, " Radians, {range}, default {}.", plain_default(row).unwrap_or_default())
        }
        (_, Some(rule)) => {
            let none = match (is_whole(row), row.any_number) {
                (true, _) => "0",
                (false, false) => "SRF_FROM_DATA",
                (false, true) => "NaN",
            };
            let range = if range.is_empty() { range } else { format!(" {range}.") };
            write!(text, "{} {none}, the default: {rule}.", sentence(&range))
        }
        _ => {
            let default = plain_default(row).unwrap_or_default();
            let range = if range.is_empty() { "Default".to_owned() } else { format!("{range}, default") };
            write!(text, " {range} {default}.")
        }
    };
    text
}

fn default_of(row: &ParamSpec) -> String {
    match (row.kind, row.default) {
        (ParamKind::Choice(_), _) => (default_choice(row) + 1).to_string(),
        (_, surfrecon::params::Default::FromData(_)) => match (is_whole(row), row.any_number) {
            (true, _) => "0".to_owned(),
            (false, false) => "SRF_FROM_DATA".to_owned(),
            (false, true) => "f64::NAN".to_owned(),
        },
        (_, surfrecon::params::Default::Value(value)) if is_whole(row) => number(value),
        (_, surfrecon::params::Default::Value(std::f64::consts::FRAC_PI_2)) => "std::f64::consts::FRAC_PI_2".to_owned(),
        (_, surfrecon::params::Default::Value(std::f64::consts::FRAC_PI_4)) => "std::f64::consts::FRAC_PI_4".to_owned(),
        (_, surfrecon::params::Default::Value(value)) => format!("{value:?}"),
    }
}

/// Fields of an operation's struct besides parameters: name, type, default, text of each.
pub fn beside(schema: &ParamSchema) -> &'static [(&'static str, &'static str, &'static str, &'static str)] {
    BESIDE.iter().find(|beside| beside.operation == schema.operation).map_or(&[], |beside| beside.fields)
}

/// The operation whose file declares the enum of a row: the first of those that have the row, since names are unique in C.
fn declared_by(row: &ParamSpec) -> &'static str {
    let choices = |row: &ParamSpec| match row.kind {
        ParamKind::Choice(choices) => choices.iter().map(|choice| choice.name).collect(),
        _ => Vec::new(),
    };
    let same = |schema: &ParamSchema| {
        let own = |other: &&&ParamSpec| other.operation == schema.operation && other.name == row.name;
        (schema.all)().iter().find(own).is_some_and(|other| {
            assert_eq!(choices(other), choices(row), "{} of {} and of {}", row.name, row.operation, other.operation);
            true
        })
    };
    schemas().filter(|schema| same(schema)).map(|schema| schema.operation).min().expect("its own operation has the row")
}

/// The enums that an operation's file declares.
fn own_enums(schema: &ParamSchema) -> Vec<(&'static ParamSpec, &'static [Choice])> {
    let choices = |row: &'static ParamSpec| match row.kind {
        ParamKind::Choice(choices) if declared_by(row) == schema.operation => Some((row, choices)),
        _ => None,
    };
    fields(schema).into_iter().filter(|row| row.operation == schema.operation).filter_map(choices).collect()
}

fn file(schema: &ParamSchema) -> String {
    let (name, argument) = names(schema.operation);
    let beside = beside(schema);
    let rows = fields(schema);
    let mut out = format!(
        "//! Parameters of {}. Written by `make generate` from their declaration in the core: change that.\n\n",
        schema.operation
    );
    let uses_from_data = rows.iter().any(|row| default_of(row) == "SRF_FROM_DATA");
    out += "use crate::given::{Fields, Given};\nuse crate::guard::guard;\n";
    out += if uses_from_data { "use crate::settings::SRF_FROM_DATA;\n" } else { "" };
    out += "use crate::sized;\nuse crate::status::srf_status;\n";
    for (row, choices) in own_enums(schema) {
        let _ = write!(
            out,
            "\n/// {}\n#[allow(non_camel_case_types, dead_code)]\n#[repr(C)]\n#[derive(Clone, Copy, Debug, PartialEq, Eq)]\npub enum srf_{} {{\n",
            row.text, row.name
        );
        for (place, choice) in choices.iter().enumerate() {
            out += &comment(choice.text, "    ");
            let _ = writeln!(out, "    {} = {},", constant(row, choice.name), place + 1);
        }
        out += "}\n";
    }
    out.push('\n');
    let about = format!("{} Starts with its size. Set to the defaults by {name}_init().", schema.text);
    out += &comment(&about, "");
    out += "#[allow(non_camel_case_types)]\n#[repr(C)]\n#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]\n";
    let _ = write!(out, "pub struct {name} {{\n    /// Bytes of this struct.\n    pub struct_size: u32,\n");
    if has_threads(schema) {
        out += &comment(
            "Worker threads, at most 1024. 0, the default, for the number of srf_set_threads(). Results are the same for any number.",
            "    ",
        );
        out += "    pub threads: u32,\n";
    } else {
        out += "    /// 0.\n    pub reserved: u32,\n";
    }
    for (field, kind, _, text) in beside {
        out += &comment(text, "    ");
        let _ = writeln!(out, "    pub {field}: {kind},");
    }
    for row in &rows {
        out += &comment(&text_of(row), "    ");
        let _ = writeln!(out, "    pub {}: {},", row.name, if is_whole(row) { "u64" } else { "f64" });
    }
    let _ = write!(
        out,
        "}}\n\nimpl Fields for {name} {{\n    fn defaults() -> Self {{\n        {name} {{\n            struct_size: size_of::<Self>() as u32,\n"
    );
    let second = if has_threads(schema) { "threads" } else { "reserved" };
    let _ = writeln!(out, "            {second}: 0,");
    for (field, _, default, _) in beside {
        let _ = writeln!(out, "            {field}: {default},");
    }
    for row in &rows {
        let _ = writeln!(out, "            {}: {},", row.name, default_of(row));
    }
    out += "        }\n    }\n\n    fn given(&self) -> Vec<(&'static str, Given)> {\n        vec![\n";
    if has_threads(schema) {
        out += "            (\"threads\", Given::Threads(self.threads)),\n";
    } else {
        out += "            (\"reserved\", Given::Reserved(self.reserved)),\n";
    }
    for row in &rows {
        let kind = if is_whole(row) { "Whole" } else { "Double" };
        let _ = writeln!(out, "            (\"{0}\", Given::{kind}(self.{0})),", row.name);
    }
    out += "        ]\n    }\n}\n\n";
    let wide = argument.len().max("returns".len()) + 2;
    let _ = write!(
        out,
        "/// Sets the defaults. Call {name}_init({argument}), which adds the size that this header knows.\n\
         /// {argument:wide$}not NULL\n\
         /// {:wide$}sizeof({name}): what of the struct this library does not know becomes 0\n\
         /// {:wide$}SRF_OK, SRF_ERR_NULL, SRF_ERR_STRUCT_SIZE. Since 0.1.\n\
         #[unsafe(no_mangle)]\n",
        "size", "returns"
    );
    let _ = write!(
        out,
        "pub unsafe extern \"C\" fn {name}_init_sized({argument}: *mut {name}, size: usize) -> srf_status {{"
    );
    let _ = write!(out, "\n    guard(|| sized::init(\"{argument}\", {argument}, size, {name}::defaults()))\n}}\n");
    out
}

pub fn comment(text: &str, indent: &str) -> String {
    wrapped(text, &format!("{indent}/// "), WIDTH).iter().map(|line| format!("{line}\n")).collect()
}

/// As rustfmt would have it.
pub fn formatted(source: &str) -> String {
    let mut rustfmt = Command::new("rustfmt");
    rustfmt.arg("--config-path").arg(root()).args(["--edition", "2024"]).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut running = rustfmt.spawn().expect("rustfmt, a part of the toolchain, can be run");
    running.stdin.take().expect("it is piped").write_all(source.as_bytes()).expect("rustfmt reads");
    let done = running.wait_with_output().expect("rustfmt ends");
    assert!(done.status.success(), "rustfmt refuses what was generated:\n{source}");
    String::from_utf8(done.stdout).expect("text")
}

#[test]
pub fn structs() {
    let mut names: Vec<_> = schemas().map(|schema| schema.operation).collect();
    names.sort_unstable();
    let list: String = names.iter().map(|name| format!("pub mod {name};\n")).collect();
    let name = "c-api/src/params.rs";
    compare(name, &crate::between(name, "// modules\n", "// end\n", &list));
    for schema in schemas() {
        compare(&format!("c-api/src/params/{}.rs", schema.operation), &formatted(&file(schema)));
    }
}
