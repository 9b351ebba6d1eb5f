//! Files that are generated from the code and committed: they must be what would be generated now.
//!
//! `SURFRECON_GENERATE=1 cargo test -p surfrecon-tests --test generated`, or `make generate`, writes them anew.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use surfrecon::params::{self, Default, ParamSpec, Unit};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Compares a committed file with what would be generated, or writes it when asked to.
fn compare(name: &str, generated: &str) {
    let path = root().join(name);
    if std::env::var_os("SURFRECON_GENERATE").is_some() {
        std::fs::write(&path, generated).unwrap_or_else(|error| panic!("{name}: {error}"));
        return;
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let line = committed.lines().zip(generated.lines()).take_while(|(a, b)| a == b).count() + 1;
    assert!(
        committed == generated,
        "{name} differs from what the code generates, from line {line}: run `make generate`"
    );
}

/// The files of the C library that make the header, in the order they have there.
const CHAPTERS: &[&str] = &[
    "version",
    "status",
    "last_error",
    "settings",
    "progress",
    "array",
    "pose",
    "image",
    "cloud",
    "mesh",
    "formats",
    "files",
    "write",
    "merge",
    "sculpt",
    "quads",
    "spline",
    "reconstruct",
    "cluster",
    "scan",
    "measure",
];

/// The header with a macro behind each function that initializes a struct: it adds the size that the header gives the struct,
/// which a library of another version can't know.
fn with_macros(header: &str) -> String {
    let (mut all, mut after) = (String::new(), String::new());
    for line in header.split_inclusive('\n') {
        all.push_str(line);
        if let Some((name, arguments)) = line.trim_start_matches("srf_status ").split_once("_init_sized(") {
            let (of, argument) = arguments.split_once(" *").expect("a pointer comes first");
            let argument = argument.split(',').next().expect("its name");
            after = format!("#define {name}_init({argument}) {name}_init_sized(({argument}), sizeof({of}))\n");
        }
        if line.trim_end().ends_with(");") {
            all.push_str(&std::mem::take(&mut after));
        }
    }
    all
}

#[test]
fn header() {
    let library = root().join("c-api");
    let config = cbindgen::Config::from_file(library.join("cbindgen.toml")).expect("cbindgen.toml");
    let mut builder = cbindgen::Builder::new().with_config(config);
    for chapter in CHAPTERS {
        builder = builder.with_src(library.join("src").join(chapter).with_extension("rs"));
    }
    let mut header = Vec::new();
    builder.generate().expect("cbindgen").write(&mut header);
    let header = with_macros(&String::from_utf8(header).expect("the header is text"));
    compare("c-api/include/surfrecon.h", &header);
}

/// The version is said in the workspace's manifest; whatever repeats it, since a registry or a host asks for it, follows.
#[test]
fn versions() {
    let version = env!("CARGO_PKG_VERSION");
    let after = |text: &str, mark: &str| -> String {
        let mut pieces = text.split(mark);
        let mut all = pieces.next().unwrap_or_default().to_owned();
        let mut found = 0;
        for piece in pieces {
            let (_, rest) = piece.split_once('"').expect("a version ends with a quotation mark");
            all = all + mark + version + "\"" + rest;
            found += 1;
        }
        assert!(found > 0, "{mark} is not there");
        all
    };
    for (name, mark) in [
        ("c-api/cmake/surfreconConfigVersion.cmake", "set(PACKAGE_VERSION \""),
        ("blender-addon/extension/blender_manifest.toml", "\nversion = \""),
    ] {
        let text = std::fs::read_to_string(root().join(name)).expect(name);
        compare(name, &after(&text, mark));
    }
    // Own crates only: others have versions of their own.
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).expect("Cargo.toml");
    let lines = manifest.split_inclusive('\n').map(|line| match line.contains("path = \"rust-core/") {
        true => after(line, "version = \""),
        false => line.to_owned(),
    });
    compare("Cargo.toml", &lines.collect::<String>());
}

#[test]
fn parameters() {
    let mut page = "# Parameters\n\nThe same in every language; generated from the core's table by `make generate`. Lengths are in the \
                    unit of the scans, angles in radians (hosts show degrees).\n"
        .to_owned();
    let mut operation = "";
    for p in params::table() {
        if p.operation != operation {
            operation = p.operation;
            let _ = write!(
                page,
                "\n## {operation}\n\n| name | unit | default | range | meaning |\n|---|---|---|---|---|\n"
            );
        }
        let _ = writeln!(page, "| `{}` | {} | {} | {} | {} |", p.name, unit(p), default(p), range(p), p.text);
    }
    compare("PARAMETERS.md", &page);
}

fn unit(p: &ParamSpec) -> &'static str {
    match p.unit {
        Unit::WorldLength => "length",
        Unit::Angle => "rad",
        Unit::Ratio => "ratio",
        Unit::Count => "count",
    }
}

fn default(p: &ParamSpec) -> String {
    match p.default {
        Default::Value(value) => number(value),
        Default::FromData(how) => how.to_owned(),
    }
}

fn range(p: &ParamSpec) -> String {
    let low = format!("{} {}", if p.min_excluded { ">" } else { ">=" }, number(p.min));
    if p.max.is_finite() { format!("{low}, <= {}", number(p.max)) } else { low }
}

fn number(value: f64) -> String {
    match value {
        std::f64::consts::FRAC_PI_2 => "π/2".to_owned(),
        value if value >= 1e16 => format!("{value:e}"),
        value => value.to_string(),
    }
}
