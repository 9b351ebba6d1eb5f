//! Files that are generated from the code and committed: they must be what would be generated now.
//!
//! `SURFRECON_GENERATE=1 cargo test -p surfrecon-tests --test generated`, or `make generate`, writes them anew.

mod c_params;
mod c_reports;
mod c_tests;
mod chapters;
mod cpp;
mod header;
mod meshlab;
mod modules;
mod page;
mod python;
mod python_reports;
mod words;

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Compares a committed file with what would be generated, or writes it when asked to.
fn compare(name: &str, generated: &str) {
    let path = root().join(name);
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    if std::env::var_os("SURFRECON_GENERATE").is_some() {
        // A file that is as it should be may be read by another test just now.
        if committed != generated {
            std::fs::write(&path, generated).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
        return;
    }
    let line = committed.lines().zip(generated.lines()).take_while(|(a, b)| a == b).count() + 1;
    assert!(
        committed == generated,
        "{name} differs from what the code generates, from line {line}: run `make generate`"
    );
}

/// A committed file with other text between two marks.
fn between(name: &str, begin: &str, end: &str, text: &str) -> String {
    let committed = std::fs::read_to_string(root().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    replaced(name, &committed, begin, end, text)
}

/// The same of a text that is not the committed one any more.
fn replaced(name: &str, source: &str, begin: &str, end: &str, text: &str) -> String {
    let (before, rest) = source.split_once(begin).unwrap_or_else(|| panic!("{name} has no mark {begin}"));
    let (_, after) = rest.split_once(end).unwrap_or_else(|| panic!("{name} has no mark {end}"));
    format!("{before}{begin}{text}{end}{after}")
}

/// The version is said in the workspace's manifest. Whatever repeats it, since a registry or a host asks for it, follows.
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
    let name = "blender-addon/extension/blender_manifest.toml";
    let text = std::fs::read_to_string(root().join(name)).expect(name);
    compare(name, &after(&text, "\nversion = \""));
    let name = "c-api/src/version.rs";
    let mut text = std::fs::read_to_string(root().join(name)).expect(name);
    for (part, number) in ["MAJOR", "MINOR", "PATCH"].into_iter().zip(version.split('.')) {
        let mark = format!("SRF_VERSION_{part}: u32 = ");
        let (before, rest) = text.split_once(&mark).expect("the header has each part of the version");
        let (_, after) = rest.split_once(';').expect("a constant ends");
        text = format!("{before}{mark}{number};{after}");
    }
    compare(name, &text);
    let name = "c-api/examples/CMakeLists.txt";
    let text = std::fs::read_to_string(root().join(name)).expect(name);
    let mark = "find_package(surfrecon ";
    let (before, rest) = text.split_once(mark).expect("the examples find the library");
    let (_, after_version) = rest.split_once(' ').expect("and ask for a version");
    let asked = version.rsplit_once('.').map_or(version, |(minor, _)| minor);
    compare(name, &format!("{before}{mark}{asked} {after_version}"));
    // Own crates only: others have versions of their own.
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).expect("Cargo.toml");
    let lines = manifest.split_inclusive('\n').map(|line| match line.contains("path = \"rust-core/") {
        true => after(line, "version = \""),
        false => line.to_owned(),
    });
    compare("Cargo.toml", &lines.collect::<String>());
}
