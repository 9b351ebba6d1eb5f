//! The invariants of ARCHITECTURE.md that source text alone can show. The crates of the core stand on floors, no files of a crate import
//! each other in a circle, the core knows no host, `unsafe` stays where it is allowed, and every crate is on the map. The compiler says
//! that a crate imports only what it names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The folders of the merge, in the order in which data go through them: each knows those before it, and `pipeline`, `run`,
/// `reference` and `dump` know all.
const MERGE: &[&str] =
    &["stages", "params", "report", "crossings", "intake", "field", "visibility", "surface", "colour", "finish"];
const OVER_THE_MERGE: &[&str] = &["pipeline", "run", "reference", "dump", "operation"];
/// Crates that stand on the core, and know its roof and the allocator alone.
const ON_THE_ROOF: &[&str] = &["c-api", "python"];
const HOSTS: &[&str] = &["pyo3", "numpy::", "bpy", "cbindgen", "no_mangle", "extern \"C\""];
/// Files with `unsafe` blocks. Each block says why it is sound (clippy: undocumented_unsafe_blocks).
const UNSAFE_FILES: &[&str] = &[
    "c-api/src/pointer.rs",
    "c-api/src/allocator.rs",
    "python/src/arrays.rs",
    "rust-core/allocator/src/lib.rs",
    "rust-core/allocator/src/reserve.rs",
    "rust-core/allocator/tests/account.rs",
    "rust-core/tests/import_memory.rs",
    "rust-core/tests/memory.rs",
    "rust-core/tests/refused.rs",
    "tests/rust/c/calls/aligning.rs",
    "tests/rust/c/calls/bounds.rs",
    "tests/rust/c/calls/cancelling.rs",
    "tests/rust/c/calls/contexts.rs",
    "tests/rust/c/calls/crs.rs",
    "tests/rust/c/calls/files.rs",
    "tests/rust/c/calls/folders.rs",
    "tests/rust/c/calls/frames.rs",
    "tests/rust/c/calls/kit.rs",
    "tests/rust/c/calls/merging.rs",
    "tests/rust/c/calls/mod.rs",
    "tests/rust/c/calls/objects.rs",
    "tests/rust/c/calls/operations.rs",
    "tests/rust/c/calls/refusals.rs",
    "tests/rust/c/calls/right.rs",
    "tests/rust/c/calls/rightly.rs",
    "tests/rust/c/calls/select.rs",
    "tests/rust/c/calls/threads.rs",
    "tests/rust/c/calls/vertices.rs",
    "tests/rust/c/header.rs",
    "tests/rust/c/library.rs",
    "tests/rust/c/structs.rs",
    "tests/rust/c/types.rs",
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

/// The floors of the core as ARCHITECTURE.md has them, from the ground up: a crate knows those of lower floors, nothing beside it and
/// nothing above.
fn floors() -> Vec<Vec<String>> {
    let page = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let floors = page.lines().find_map(|line| line.trim().strip_prefix("floors, from the ground: "));
    let name = |crate_name: &str| match crate_name {
        "allocator" => "surfrecon-allocator".to_owned(),
        other => other.to_owned(),
    };
    let floors = floors.expect("the page has the floors").split(" / ");
    floors.map(|floor| floor.split(", ").map(name).collect()).collect()
}

/// Folder of a crate of the core.
fn folder_of(name: &str) -> String {
    match name {
        "surfrecon" => "rust-core".to_owned(),
        "surfrecon-allocator" => "rust-core/allocator".to_owned(),
        _ => format!("rust-core/{name}"),
    }
}

/// The crates of this project that a crate depends on, but for its tests.
fn own_dependencies(folder: &str) -> BTreeSet<String> {
    let manifest = std::fs::read_to_string(root().join(folder).join("Cargo.toml")).expect("a manifest");
    let section = manifest.split("\n[dependencies]\n").nth(1).unwrap_or_default();
    let section = section.split("\n[").next().unwrap_or_default();
    let ours: BTreeSet<String> = floors().into_iter().flatten().collect();
    let named = section.lines().filter_map(|line| line.split(['.', ' ', '=']).next());
    named.filter(|name| ours.contains(*name)).map(str::to_owned).collect()
}

#[test]
fn crates_stand_on_floors() {
    let floors = floors();
    assert!(floors.len() > 5, "{floors:?}");
    for (floor, crates) in floors.iter().enumerate() {
        let below: BTreeSet<&str> = floors[..floor].iter().flatten().map(String::as_str).collect();
        for name in crates {
            let known = own_dependencies(&folder_of(name));
            assert!(floor == 0 || !known.is_empty(), "{name}: no dependencies were found");
            let wrong: Vec<&String> = known.iter().filter(|known| !below.contains(known.as_str())).collect();
            assert!(wrong.is_empty(), "{name} knows {wrong:?}, which are not below it");
        }
    }
    let listed: BTreeSet<String> = floors.iter().flatten().map(|name| folder_of(name)).collect();
    for entry in std::fs::read_dir(root().join("rust-core")).expect("rust-core") {
        let entry = entry.expect("a folder entry");
        let folder = format!("rust-core/{}", entry.file_name().to_string_lossy());
        let is_crate = entry.path().join("Cargo.toml").is_file() && folder != "rust-core/fuzz";
        assert!(!is_crate || listed.contains(&folder), "{folder} stands on no floor");
    }
    for host in ON_THE_ROOF {
        let known: Vec<String> = own_dependencies(host).into_iter().collect();
        assert_eq!(known, ["surfrecon", "surfrecon-allocator"], "{host}");
    }
}

/// Modules that a file's code names by `super::` or `crate::`, as paths from the crate's root. `module` is the file's own.
fn imported(code: &str, module: &[String], known: &BTreeSet<Vec<String>>) -> BTreeSet<Vec<String>> {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let mut found = BTreeSet::new();
    let mut rest = code;
    while let Some(at) = rest.find(is_path) {
        let text = &rest[at..];
        let path = &text[..text.find(|c| !is_path(c)).unwrap_or(text.len())];
        rest = &text[path.len()..];
        let parts: Vec<&str> = path.split("::").filter(|part| !part.is_empty()).collect();
        let ups = parts.iter().take_while(|part| **part == "super").count();
        let start = match parts.first() {
            Some(&"crate") => Vec::new(),
            Some(&"super") if ups <= module.len() => module[..module.len() - ups].to_vec(),
            _ => continue,
        };
        let own = parts[ups.max(1)..].iter().map(|part| (*part).to_owned());
        let stem: Vec<String> = start.into_iter().chain(own).collect();
        let list = rest.strip_prefix('{').filter(|_| path.ends_with("::")).and_then(|list| list.split('}').next());
        let leaves: Vec<Option<&str>> = match list {
            Some(list) => list.split(',').map(|item| item.trim().split("::").next()).collect(),
            None => vec![None],
        };
        for leaf in leaves {
            let mut full = stem.clone();
            full.extend(leaf.map(str::to_owned));
            while !full.is_empty() && !known.contains(&full) {
                full.pop();
            }
            found.insert(full);
        }
    }
    // Containing another says nothing: a driver uses its stages, and these its types.
    found.retain(|other| !other.is_empty() && !module.starts_with(other) && !other.starts_with(module));
    found
}

/// The files of a folder of sources but for tests: the module that each of them is, and its code.
fn modules(source: &str) -> Vec<(Vec<String>, String)> {
    let module = |name: &str| {
        let path = name.trim_start_matches(source).trim_end_matches(".rs").to_owned();
        path.split('/').filter(|part| !matches!(*part, "mod" | "lib")).map(str::to_owned).collect::<Vec<_>>()
    };
    let files = rust_files(source).into_iter().map(|(name, text)| (module(&name), code(&text)));
    files.filter(|(module, _)| !module.iter().any(|part| part.contains("test"))).collect()
}

#[test]
fn stages_of_the_merge_stand_on_floors() {
    let files = modules("rust-core/merge/src/");
    let known: BTreeSet<Vec<String>> = files.iter().map(|(module, _)| module.clone()).collect();
    let floor = |module: &[String]| MERGE.iter().position(|name| module.first().is_some_and(|first| first == name));
    for (module, code) in files.iter().filter(|(module, _)| !module.is_empty()) {
        let Some(own) = floor(module) else {
            assert!(OVER_THE_MERGE.contains(&module[0].as_str()), "{module:?} stands on no floor");
            continue;
        };
        for other in imported(code, module, &known) {
            assert!(floor(&other).is_some_and(|other| other <= own), "{module:?} knows {other:?}, which is above it");
        }
    }
    assert!(MERGE.iter().all(|name| known.contains(&vec![(*name).to_owned()])), "a folder is not there");
}

/// Public types of a module and those in it: of each its name, where it is, and whether others can name it. Former names do not count.
fn types(folder: &Path, module: &str, path: &Path, is_open: bool, found: &mut Vec<(String, String, bool)>) {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let (code, is_root) = (code(&text), path.file_stem().is_some_and(|stem| stem == "lib" || stem == "mod"));
    let inside = if is_root { folder.to_owned() } else { folder.join(path.file_stem().expect("a name")) };
    let mut is_former = false;
    let (mut shown, mut statement) = (BTreeSet::new(), None::<String>);
    let first = found.len();
    for line in code.lines() {
        let words: Vec<&str> =
            line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|w| !w.is_empty()).collect();
        is_former |= line.trim_start().starts_with("#[deprecated");
        if let ["pub", "struct" | "enum" | "trait" | "type" | "union", name, ..] = words[..] {
            if !is_former && !line.contains('$') {
                found.push((name.to_owned(), format!("{module}, {}", path.display()), is_open));
            }
            is_former = false;
        }
        if line.starts_with("pub use ") {
            statement = Some(String::new());
        }
        if let Some(names) = &mut statement {
            names.push_str(line);
            if line.contains(';') {
                let names = names.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned);
                shown.extend(names);
                statement = None;
            }
        }
        if let (["pub", "mod", name] | ["mod", name], true) = (&words[..], line.ends_with(';')) {
            let files = [inside.join(format!("{name}.rs")), inside.join(name).join("mod.rs")];
            if let Some(file) = files.iter().find(|file| file.is_file() && !name.contains("test")) {
                let folder = file.parent().expect("it is in a folder");
                types(folder, module, file, is_open && words[0] == "pub", found);
            }
        }
    }
    if is_open {
        found[first..].iter_mut().filter(|known| shown.contains(&known.0)).for_each(|known| known.2 = true);
    }
}

/// One name says one thing: no two types that users can name are called the same, and no two public ones of one crate.
#[test]
fn no_public_type_has_a_name_twice() {
    let mut open: BTreeMap<String, String> = BTreeMap::new();
    let mut count = 0;
    for name in floors().iter().flatten() {
        let source = root().join(folder_of(name)).join("src");
        let mut found = Vec::new();
        types(&source, name, &source.join("lib.rs"), true, &mut found);
        count += found.len();
        let mut own: BTreeMap<String, String> = BTreeMap::new();
        for (name, place, is_open) in found {
            let other = own.insert(name.clone(), place.clone());
            assert!(other.is_none(), "{name} is in {place} and {}", other.unwrap_or_default());
            if is_open {
                let other = open.insert(name.clone(), place.clone());
                assert!(other.is_none(), "{name} is in {place} and {}", other.unwrap_or_default());
            }
        }
    }
    assert!(count > 350 && open.len() > 150, "{count} types were found, {} of them open", open.len());
}

#[test]
fn no_circle_of_imports() {
    let floors = floors();
    let crates = floors.iter().flatten().map(|name| folder_of(name));
    let mut edges = 0;
    for folder in crates.chain(ON_THE_ROOF.iter().map(|host| (*host).to_owned())) {
        let files = modules(&format!("{folder}/src/"));
        let known: BTreeSet<Vec<String>> = files.iter().map(|(module, _)| module.clone()).collect();
        let mut imports: BTreeMap<Vec<String>, BTreeSet<Vec<String>>> =
            files.iter().map(|(module, code)| (module.clone(), imported(code, module, &known))).collect();
        edges += imports.values().map(BTreeSet::len).sum::<usize>();
        // A file that imports nothing that is left is in no circle.
        while let Some(free) = imports.iter().find(|(_, of)| !of.iter().any(|other| imports.contains_key(other))) {
            let free = free.0.clone();
            imports.remove(&free);
        }
        let circle: Vec<String> = imports.keys().map(|module| module.join("::")).collect();
        assert!(circle.is_empty(), "{folder}: these import each other in a circle, or what does: {circle:?}");
    }
    assert!(edges > 200, "{edges} imports were found");
}

#[test]
fn the_core_knows_no_host() {
    for (name, text) in rust_files("rust-core") {
        let code = code(&text);
        for host in HOSTS {
            assert!(!code.contains(host), "{name} mentions {host}");
        }
    }
}

#[test]
fn unsafe_stays_where_it_is_allowed() {
    for folder in ["rust-core", "c-api", "python", "tests"] {
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
    for (name, text) in rust_files("python/src") {
        for class in code(&text).lines().filter(|line| line.trim_start().starts_with("#[pyclass")) {
            assert!(class.contains("frozen"), "{name}: {class}");
            count += 1;
        }
    }
    assert!(count > 10, "{count} classes");
}

#[test]
fn every_crate_is_on_the_map() {
    let map = std::fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    assert!(map.lines().count() <= 150, "ARCHITECTURE.md is longer than a page can be read");
    for name in floors().iter().flatten() {
        let folder = folder_of(name);
        assert!(map.contains(&format!("`{folder}/`")), "{folder} is not on the map of ARCHITECTURE.md");
    }
}
