//! The invariants of ARCHITECTURE.md that source text alone can show: imports point down, the core knows no host, `unsafe`
//! stays where it is allowed, and every module is on the map.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// What each module of the core may know, besides itself and what all may: `error`, `magnitude`, `memory`, `params`,
/// `progress`, `threads`, `work`.
const MAY_KNOW: &[(&str, &[&str])] = &[
    ("geom", &[]),
    ("point_cloud", &[]),
    ("mesh", &["geom"]),
    ("range_image", &["geom", "point_cloud"]),
    ("triangulate", &["geom", "mesh", "range_image"]),
    ("scan", &["geom", "mesh", "range_image"]),
    ("merge", &["geom", "mesh", "range_image", "triangulate"]),
    ("scattered", &["geom", "mesh", "point_cloud"]),
    ("sculpt", &["geom", "mesh", "range_image", "triangulate"]),
    ("cluster", &["geom", "mesh", "point_cloud", "scattered"]),
    ("quads", &["mesh", "range_image"]),
    // Files become scans; of the merge they know only the trait that scans implement and what it returns.
    (
        "import",
        &["geom", "mesh", "point_cloud", "range_image", "triangulate", "merge::OrientedSurface", "merge::ScanSource"],
    ),
    ("export", &["mesh", "point_cloud", "range_image"]),
];
/// The table of parameters gathers those of the operations.
const PARAMS_MAY_KNOW: &[&str] = &[
    "import::PARAMS",
    "triangulate::PARAMS",
    "merge::PARAMS",
    "sculpt::PARAMS",
    "quads::PARAMS",
    "scattered::PARAMS",
    "cluster::PARAMS",
    "scan::PARAMS",
];
const BENEATH_ALL: &[&str] =
    &["error", "magnitude", "memory", "params", "progress", "threads", "work", "Error", "Result"];
const HOSTS: &[&str] = &["pyo3", "numpy::", "bpy", "cbindgen", "no_mangle", "extern \"C\""];
/// Files with `unsafe` blocks; each block says why it is sound (clippy: undocumented_unsafe_blocks).
const UNSAFE_FILES: &[&str] = &[
    "c-api/src/pointer.rs",
    "blender-addon/python/src/arrays.rs",
    "rust-core/allocator/src/lib.rs",
    "rust-core/allocator/src/reserve.rs",
    "rust-core/tests/import_memory.rs",
    "rust-core/tests/memory.rs",
    "rust-core/tests/refused.rs",
    "tests/rust/c/calls/files.rs",
    "tests/rust/c/calls/mod.rs",
    "tests/rust/c/calls/objects.rs",
    "tests/rust/c/calls/operations.rs",
    "tests/rust/c/calls/refusals.rs",
    "tests/rust/c/calls/threads.rs",
    "tests/rust/c/header.rs",
    "tests/rust/c/library.rs",
    "tests/rust/c/structs.rs",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Every Rust file under a folder of the project, with its name from the root.
fn rust_files(folder: &str) -> Vec<(String, String)> {
    let mut folders = vec![root().join(folder)];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
            let path = entry.expect("a folder entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(root()).expect("inside the project").to_string_lossy().replace('\\', "/");
                files.push((name, std::fs::read_to_string(&path).expect("a text file")));
            }
        }
    }
    files.sort();
    files
}

/// The code of a file without comments, and without the tests at its end, which may use anything.
fn code(text: &str) -> String {
    let code = text.split("\n#[cfg(test)]\nmod tests {").next().unwrap_or(text);
    code.lines().map(|line| line.split("//").next().unwrap_or(line)).collect::<Vec<_>>().join("\n")
}

/// Paths that code takes from its crate: `a` and `a::B` of `use crate::a::B` and of `crate::a::{B, C}`.
fn crate_paths(code: &str) -> BTreeSet<String> {
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut paths = BTreeSet::new();
    for (at, found) in code.match_indices("crate::") {
        if code[..at].ends_with(is_name) {
            continue;
        }
        let rest = &code[at + found.len()..];
        let module = rest.split(|c| !is_name(c)).next().unwrap_or_default();
        let after = &rest[module.len()..];
        let items = match after.strip_prefix("::") {
            None => vec![],
            Some(list) if list.starts_with('{') => {
                let list = list[1..].split('}').next().unwrap_or_default();
                list.split(',').map(|item| item.trim().split(|c| !is_name(c)).next().unwrap_or_default()).collect()
            }
            Some(item) => vec![item.split(|c| !is_name(c)).next().unwrap_or_default()],
        };
        assert!(!module.is_empty(), "`use crate::{{..}}` hides what is imported: one `use` a module");
        if items.is_empty() {
            paths.insert(module.to_owned());
        }
        paths.extend(items.into_iter().filter(|item| !item.is_empty()).map(|item| format!("{module}::{item}")));
    }
    paths
}

#[test]
fn imports_point_down() {
    let allowed: BTreeMap<_, _> = MAY_KNOW.iter().copied().collect();
    let mut wrong = Vec::new();
    for (name, text) in rust_files("rust-core/src") {
        let inside = name.trim_start_matches("rust-core/src/");
        let module = inside.split(['/', '.']).next().unwrap_or_default();
        let test_only = inside.ends_with("tests.rs") || inside.contains("/tests/") || inside.contains("test_");
        if module == "lib" || test_only {
            continue;
        }
        let may_know = match module {
            "params" => PARAMS_MAY_KNOW,
            _ if BENEATH_ALL.contains(&module) => &[],
            _ => allowed.get(module).unwrap_or_else(|| panic!("{name}: the module {module} is not in this table")),
        };
        for path in crate_paths(&code(&text)) {
            let target = path.split("::").next().unwrap_or_default();
            let known = target == module || BENEATH_ALL.contains(&target) || may_know.contains(&target);
            if !known && !may_know.contains(&path.as_str()) {
                wrong.push(format!("{name} knows {path}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_core_knows_no_host() {
    for (name, text) in rust_files("rust-core/src") {
        let code = code(&text);
        for host in HOSTS {
            assert!(!code.contains(host), "{name} mentions {host}");
        }
    }
}

#[test]
fn unsafe_stays_where_it_is_allowed() {
    for folder in ["rust-core", "c-api", "blender-addon/python", "tests"] {
        for (name, text) in rust_files(folder) {
            // Exporting a symbol and declaring a function's contract are not blocks.
            let block = code(&text).contains("unsafe {");
            let listed = UNSAFE_FILES.contains(&name.as_str()) || name == "tests/rust/layering.rs";
            assert!(!block || listed, "{name} has an unsafe block and is not listed");
        }
    }
}

/// Others fail with "Already borrowed" when a callback or a second thread changes what a call is using.
#[test]
fn classes_of_python_are_frozen() {
    let mut count = 0;
    for (name, text) in rust_files("blender-addon/python/src") {
        for class in code(&text).lines().filter(|line| line.trim_start().starts_with("#[pyclass")) {
            assert!(class.contains("frozen"), "{name}: {class}");
            count += 1;
        }
    }
    assert!(count > 10, "{count} classes");
}

#[test]
fn every_module_is_on_the_map() {
    let map = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    assert!(map.lines().count() <= 150, "ARCHITECTURE.md is longer than a page can be read");
    let modules: BTreeSet<String> = rust_files("rust-core/src")
        .iter()
        .filter_map(|(name, _)| name.trim_start_matches("rust-core/src/").split(['/', '.']).next().map(str::to_owned))
        .collect();
    for module in modules.iter().filter(|module| *module != "lib") {
        let on_map = [format!("{module}/`"), format!("{module}.rs`")].iter().any(|entry| map.contains(entry));
        assert!(on_map, "{module} is not on the map of ARCHITECTURE.md");
    }
}
