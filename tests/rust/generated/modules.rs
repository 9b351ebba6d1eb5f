//! Lists of what files declare: the modules of the C library and of the Python module, and the names that Python has of it.
//!
//! Lines between `// modules` and `// end`, or `# native` and `# end`, are written by `make generate`.

use std::fmt::Write as _;

use crate::c_params::formatted;
use crate::python_reports::class_names;
use crate::{between, compare, replaced, root};

/// Names of the files of a folder, without their endings.
fn files(folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(root().join(folder)).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let mut names: Vec<String> = entries
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("a name"))
        .filter_map(|name| name.strip_suffix(".rs").map(str::to_owned))
        .filter(|name| name != "lib")
        .collect();
    names.sort_unstable();
    names
}

/// The crates that declare an operation.
fn operations() -> Vec<String> {
    let crates =
        std::fs::read_dir(root().join("rust-core")).expect("the crates").map(|entry| entry.expect("an entry").path());
    let mut names: Vec<String> = crates
        .filter(|folder| {
            std::fs::read_to_string(folder.join("src/operation.rs"))
                .is_ok_and(|text| text.contains("pub const OPERATION:"))
        })
        .map(|folder| folder.file_name().expect("a name").to_string_lossy().into_owned())
        .collect();
    names.sort_unstable();
    names
}

/// Paths of the types that crates of operations declare by a macro and that have defaults.
fn declared(by: &str) -> Vec<String> {
    let mut found = Vec::new();
    for name in operations() {
        let folder = format!("rust-core/{name}/src");
        let mut files = files(&folder);
        files.push("lib".to_owned());
        for file in files {
            let source = std::fs::read_to_string(root().join(&folder).join(file).with_extension("rs")).expect("a file");
            for block in source.split(&format!("\nbase::{by}! {{\n")).skip(1) {
                let (before, item) = block.split_once("pub struct ").expect("a struct");
                let item = item.split([' ', '<']).next().expect("its name");
                if by == "params" || before.contains("Default") {
                    found.push(format!("{name}::{item}"));
                }
            }
        }
    }
    found
}

/// The types that tests of the tables try, each with its defaults.
#[test]
fn of_tables() {
    for (name, by, tried) in
        [("rust-core/src/params.rs", "params", "try_all"), ("rust-core/src/reports.rs", "report", "look_at")]
    {
        let list: String = declared(by).iter().map(|of| format!("        {tried}::<{of}>();\n")).collect();
        assert!(list.lines().count() > 7, "{list}");
        compare(name, &between(name, "        // operations\n", "        // end\n", &list));
    }
}

/// A table of the files of a folder: of each the first sentence of its comment.
fn table(folder: &str) -> String {
    let row = |name: &String| {
        let source = std::fs::read_to_string(root().join(folder).join(name).with_extension("rs")).expect("a file");
        let lines = source.lines().map_while(|line| line.strip_prefix("//! "));
        let words = lines.collect::<Vec<_>>().join(" ");
        // Or the title of a chapter of the header.
        let sentence = words.split(". ").next().unwrap_or_default().trim_start_matches("# ").trim_end_matches('.');
        assert!(!sentence.is_empty(), "{folder}/{name}.rs does not begin with a comment that says what is in it");
        // Links would lead to what is not public.
        let plain = sentence.replace("[`", "`").replace("`]", "`").replace('|', "\\|");
        format!("//! | `{name}` | {plain} |\n")
    };
    files(folder).iter().map(row).collect()
}

#[test]
fn of_rust() {
    for (folder, file, below) in [
        ("c-api/src", "c-api/src/lib.rs", "//!\n//! `unsafe` blocks"),
        ("python/src", "python/src/lib.rs", "\n#![allow("),
    ] {
        let list: String = files(folder).iter().map(|name| format!("mod {name};\n")).collect();
        let modules = between(file, "// modules\n", "// end\n", &list);
        compare(file, &replaced(file, &modules, "//! |---|---|\n", below, &table(folder)));
    }
    let list: String = operations().iter().map(|name| format!("#[doc(inline)]\npub use {name};\n")).collect();
    let name = "rust-core/src/lib.rs";
    compare(name, &between(name, "// operations\n", "// end\n", &list));
    let name = "python/src/lib.rs";
    let mut exports = String::new();
    for (file, items) in exported() {
        let names: Vec<&str> = items.iter().map(|(rust, _)| rust.as_str()).collect();
        let list = if let [only] = names.as_slice() { (*only).to_owned() } else { format!("{{{}}}", names.join(", ")) };
        let _ = write!(exports, "    #[pymodule_export]\n    use crate::{file}::{list};\n");
    }
    let module = formatted(&format!("mod exports {{\n{exports}}}\n"));
    let exports = module.strip_prefix("mod exports {\n").and_then(|text| text.strip_suffix("}\n")).expect("a module");
    compare(name, &between(name, "    // exports\n", "    // end\n", exports));
}

/// Exports of each file of the Python module: names in Rust, names in Python.
fn exported() -> Vec<(String, Vec<(String, String)>)> {
    let mut all = Vec::new();
    for file in files("python/src") {
        let path = root().join("python/src").join(&file).with_extension("rs");
        let source = std::fs::read_to_string(path).expect("a file");
        let mut items = Vec::new();
        for mark in ["#[pyclass", "#[pyfunction"] {
            for piece in source.split(mark).skip(1) {
                // Attributes and comments go on until what they are of; a private item is no export.
                let Some(line) = piece.lines().find(|line| {
                    ["pub struct ", "pub enum ", "pub fn ", "struct ", "enum ", "fn "]
                        .iter()
                        .any(|word| line.starts_with(word))
                }) else {
                    continue;
                };
                let Some(item) = line.strip_prefix("pub ") else { continue };
                let rust: String = item
                    .split_whitespace()
                    .nth(1)
                    .expect("a name")
                    .chars()
                    .take_while(|letter| letter.is_alphanumeric() || *letter == '_')
                    .collect();
                let attributes = piece.split(line).next().unwrap_or_default();
                let renamed = attributes.split_once("name = \"").and_then(|(_, rest)| rest.split('"').next());
                items.push((rust.clone(), renamed.map_or(rust, str::to_owned)));
            }
        }
        if !items.is_empty() {
            // As rustfmt sorts them.
            items.sort_by_key(|(rust, _)| (!rust.starts_with('_'), kind(rust), rust.clone()));
            all.push((file, items));
        }
    }
    all
}

/// Classes before functions, as formatters sort them.
fn kind(name: &str) -> bool {
    !name.starts_with(char::is_uppercase)
}

/// Names of the native module, sorted.
pub fn native() -> Vec<String> {
    let mut names: Vec<String> =
        exported().into_iter().flat_map(|(_, items)| items).map(|(_, python)| python).collect();
    names.push("__version__".to_owned());
    names.sort_by_key(|name| (kind(name), name.clone()));
    names
}

/// Names as a list that Python imports, a line each.
pub fn imported(mut names: Vec<&str>) -> String {
    names.sort_by_key(|name| (kind(name), name.to_lowercase()));
    names.iter().map(|name| format!("    {name},\n")).collect()
}

/// Names as the list of what a module has, a line each.
pub fn listed(mut names: Vec<&str>) -> String {
    names.sort_by_key(|name| (kind(name), *name));
    names.dedup();
    names.iter().map(|name| format!("    \"{name}\",\n")).collect()
}

/// The names that the package takes of the native module and of the reports, and all that it has.
#[test]
fn of_python() {
    let name = "python/python/surfrecon/__init__.py";
    let mut reports = class_names();
    reports.push("Report");
    let text = between(name, "from ._reports import (\n", ")\n", &imported(reports));
    let by_hand: Vec<&str> = imports(&text);
    let native = native();
    let is_public = |name: &&str| !name.starts_with('_') || *name == "__version__";
    let taken = native.iter().map(String::as_str).filter(is_public).filter(|name| !by_hand.contains(name));
    let taken: Vec<&str> = taken.collect();
    let public: Vec<&str> = by_hand.iter().chain(&taken).copied().collect();
    let whole = replaced(name, &text, "from ._native import (\n", ")\n", &imported(taken.clone()));
    compare(name, &replaced(name, &whole, "__all__ = [\n", "]\n", &listed(public)));
}

/// Names that the package imports from its own files but the native module.
fn imports(source: &str) -> Vec<&str> {
    let mut names = Vec::new();
    for piece in source.split("\nfrom .").skip(1) {
        let Some((module, rest)) = piece.split_once(" import ") else { continue };
        if module.is_empty() || module == "_native" {
            continue;
        }
        let list = match rest.strip_prefix('(') {
            Some(lines) => lines.split(')').next(),
            None => rest.lines().next(),
        };
        names.extend(list.unwrap_or_default().split([',', '\n']).map(str::trim).filter(|name| !name.is_empty()));
    }
    names
}
