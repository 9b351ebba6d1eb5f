//! The invariants of ARCHITECTURE.md that source text alone can show. The crates of the core stand on floors. No files of a crate import
//! each other in a circle, and none imports from one that contains it. The core knows no host, `unsafe` stays where it is allowed, and
//! every crate is on the map. The compiler says that a crate imports only what it names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

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
    let is_tests = |at: &usize| {
        let line = text[at + 1..].lines().nth(1).unwrap_or_default();
        line.ends_with('{')
            && line.split('(').next().is_some_and(|word| word.starts_with("mod ") || word.starts_with("pub"))
    };
    let end = text.match_indices("\n#[cfg(test)]\n").map(|(at, _)| at).find(is_tests).unwrap_or(text.len());
    text[..end].lines().map(|line| line.split("//").next().unwrap_or(line)).collect::<Vec<_>>().join("\n")
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

/// The files of a crate by the module that each of them is, but for tests.
struct Tree {
    files: BTreeMap<Vec<String>, File>,
    of_tests: Vec<Vec<String>>,
}

struct File {
    code: String,
    /// Names that its `use` statements bring, with their paths.
    brought: BTreeMap<String, Vec<String>>,
}

/// Imports of a file.
struct Imports {
    /// Modules that it names items of, but for those that contain it and those that it contains.
    others: BTreeSet<Vec<String>>,
    /// Items that it takes of modules that contain it and define them.
    of_above: Vec<String>,
}

const PATH: fn(char) -> bool = |c| c.is_alphanumeric() || c == '_' || c == ':';

/// The path at the beginning of a text, and what follows it.
fn path_at(text: &str) -> (Vec<String>, bool, &str) {
    let path = &text[..text.find(|c| !PATH(c)).unwrap_or(text.len())];
    let parts = path.split("::").filter(|part| !part.is_empty()).map(str::to_owned);
    (parts.collect(), path.ends_with("::"), &text[path.len()..])
}

/// The paths of a list of a `use` statement, until the brace that ends it. Returns what follows that.
fn leaves<'t>(text: &'t str, stem: &[String], found: &mut Vec<Vec<String>>) -> &'t str {
    let mut rest = text;
    while let Some(at) = rest.find(|c: char| PATH(c) || c == '}' || c == '*') {
        rest = &rest[at..];
        if let Some(after) = rest.strip_prefix('}') {
            return after;
        }
        if let Some(after) = rest.strip_prefix('*') {
            found.push([stem, &["*".to_owned()]].concat());
            rest = after;
            continue;
        }
        let (parts, is_open, after) = path_at(rest);
        rest = after;
        if parts == ["as"] {
            // The other name.
            rest = path_at(rest.trim_start()).2;
            continue;
        }
        let full = [stem, &parts].concat();
        match after.chars().next().filter(|_| is_open) {
            Some('{') => rest = leaves(&after[1..], &full, found),
            Some('*') => {}
            _ => found.push(full),
        }
        if is_open && after.starts_with('*') {
            found.push([stem, &parts, &["*".to_owned()]].concat());
            rest = &after[1..];
        }
    }
    ""
}

/// Paths from `super::` or `crate::` that code names, each of a list by itself. Those of macros are of who calls them.
fn paths(code: &str) -> Vec<Vec<String>> {
    let (mut found, mut rest) = (Vec::new(), code);
    let mut before = "";
    while let Some(at) = rest.find(PATH) {
        before = if at > 0 { &rest[..at] } else { before };
        let is_elsewhere = before.ends_with('$') || before.ends_with("(in ");
        let (parts, is_open, after) = path_at(&rest[at..]);
        let text = &rest[at..];
        rest = after;
        if is_elsewhere || !matches!(parts.first().map(String::as_str), Some("super" | "crate")) {
            before = text;
            continue;
        }
        match after.chars().next().filter(|_| is_open) {
            Some('{') => rest = leaves(&after[1..], &parts, &mut found),
            Some('*') => found.push([&parts[..], &["*".to_owned()]].concat()),
            // The visibility of an item.
            _ if parts.last().is_some_and(|last| last == "super" || last == "crate") => {}
            _ => found.push(parts),
        }
        before = "";
    }
    found
}

/// Names that `use` statements bring, with their paths.
fn brought(code: &str) -> BTreeMap<String, Vec<String>> {
    let statements = code.match_indices("use ").filter(|(at, _)| {
        let line = &code[code[..*at].rfind('\n').map_or(0, |end| end + 1)..*at];
        line.is_empty() || line.starts_with("pub")
    });
    let mut found = Vec::new();
    for (at, word) in statements {
        let text = &code[at + word.len()..];
        leaves(&text[..text.find(';').unwrap_or(text.len())], &[], &mut found);
    }
    let name = |path: &Vec<String>| path.iter().rev().find(|part| *part != "self").cloned();
    found.into_iter().filter_map(|path| Some((name(&path)?, path))).collect()
}

impl Tree {
    /// The files of a folder of sources.
    fn of(source: &str) -> Self {
        let module = |name: &str| {
            let path = name.trim_start_matches(source).trim_end_matches(".rs").to_owned();
            path.split('/').filter(|part| !matches!(*part, "mod" | "lib")).map(str::to_owned).collect::<Vec<_>>()
        };
        let file = |text: &str| {
            let code = code(text);
            File { brought: brought(&code), code }
        };
        let mut files: BTreeMap<_, _> =
            rust_files(source).into_iter().map(|(name, text)| (module(&name), file(&text))).collect();
        // Modules of tests and of fuzzing see what they like.
        let mut of_tests: Vec<Vec<String>> = Vec::new();
        for (module, file) in &files {
            let lines: Vec<&str> = file.code.lines().collect();
            for pair in lines.windows(2).filter(|pair| matches!(pair[0], "#[cfg(test)]" | "#[cfg(any(test, fuzzing))]"))
            {
                let name = pair[1].strip_suffix(';').and_then(|line| line.split("mod ").nth(1));
                of_tests.extend(name.map(|name| [&module[..], &[name.to_owned()]].concat()));
            }
        }
        let is_of_tests = |module: &Vec<String>| {
            module.iter().any(|part| part.contains("test")) || of_tests.iter().any(|test| module.starts_with(test))
        };
        files.retain(|module, _| !is_of_tests(module));
        Tree { files, of_tests }
    }

    /// The module that a path names something of, and what. `module` is the one that has the path.
    fn found(&self, path: &[String], module: &[String]) -> Option<(Vec<String>, Option<String>)> {
        let ups = path.iter().take_while(|part| *part == "super").count();
        let first = path.first().map(String::as_str);
        let (start, rest) = match first {
            Some("crate") => (Vec::new(), &path[1..]),
            Some("super") if ups <= module.len() => (module[..module.len() - ups].to_vec(), &path[ups..]),
            Some("self") => (module.to_vec(), &path[1..]),
            // A module that it contains, or another crate.
            Some(name) if self.files.contains_key(&[module, &[name.to_owned()]].concat()) => (module.to_vec(), path),
            _ => return None,
        };
        let full = [&start[..], rest].concat();
        let length = (0..=full.len()).rev().find(|&length| self.files.contains_key(&full[..length]))?;
        Some((full[..length].to_vec(), full.get(length).cloned()))
    }

    fn imports(&self, module: &[String]) -> Imports {
        let (mut others, mut of_above) = (BTreeSet::new(), Vec::new());
        for path in paths(&self.files[module].code) {
            let (mut other, mut item) = self.found(&path, module).unwrap_or_default();
            // A module that contains it may pass on what others define: then it is of these.
            while let Some(name) = item.clone().filter(|_| module.starts_with(&other) && module != other) {
                let Some(from) = self.files[&other].brought.get(&name) else { break };
                let next = self.found(from, &other).unwrap_or_else(|| (module.to_vec(), None));
                if next.0 == other {
                    break;
                }
                (other, item) = next;
            }
            if !module.starts_with(&other) && !other.starts_with(module) {
                others.insert(other);
            } else if let Some(item) = item.filter(|_| module.starts_with(&other) && module != other) {
                let full = [&other[..], &[item]].concat();
                of_above.extend(Some(full.join("::")).filter(|_| !self.of_tests.contains(&full)));
            }
        }
        Imports { others, of_above }
    }
}

/// The folders of the merge by the table of its `lib.rs`, which has them in the order in which data go through them: each knows those
/// before it, and `driver` and those after it know all.
fn folders_of_the_merge() -> Vec<String> {
    let page = std::fs::read_to_string(root().join("rust-core/merge/src/lib.rs")).expect("the merge");
    let cells = page.lines().filter_map(|line| line.strip_prefix("//! | ")?.split(" | ").next());
    let names = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2));
    names.map(|name| name.trim_end_matches('/').to_owned()).collect()
}

#[test]
fn stages_of_the_merge_stand_on_floors() {
    let folders = folders_of_the_merge();
    let driver = folders.iter().position(|name| name == "driver").expect("the table has the driver");
    let (floors, over) = folders.split_at(driver);
    let tree = Tree::of("rust-core/merge/src/");
    let floor = |module: &[String]| floors.iter().position(|name| module.first() == Some(name));
    for module in tree.files.keys().filter(|module| !module.is_empty()) {
        let Some(own) = floor(module) else {
            assert!(over.contains(&module[0]) || module[0] == "operation", "{module:?} stands on no floor");
            continue;
        };
        for other in tree.imports(module).others {
            assert!(floor(&other).is_some_and(|other| other <= own), "{module:?} knows {other:?}, which is above it");
        }
    }
    let is_there = |name: &String| tree.files.contains_key(std::slice::from_ref(name));
    assert!(floors.len() > 7 && folders.iter().all(is_there), "{folders:?}");
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

/// The trees of the core's crates and of those on its roof, with their folders.
fn trees() -> Vec<(String, Tree)> {
    let core = floors().into_iter().flatten().map(|name| folder_of(&name));
    let folders = core.chain(ON_THE_ROOF.iter().map(|host| (*host).to_owned()));
    folders.map(|folder| (folder.clone(), Tree::of(&format!("{folder}/src/")))).collect()
}

#[test]
fn no_circle_of_imports() {
    let mut edges = 0;
    for (folder, tree) in trees() {
        let mut imports: BTreeMap<&Vec<String>, BTreeSet<Vec<String>>> =
            tree.files.keys().map(|module| (module, tree.imports(module).others)).collect();
        edges += imports.values().map(BTreeSet::len).sum::<usize>();
        // A file that imports nothing that is left is in no circle.
        while let Some(free) = imports.iter().find(|(_, of)| !of.iter().any(|other| imports.contains_key(other))) {
            let free = *free.0;
            imports.remove(free);
        }
        let circle: Vec<String> = imports.keys().map(|module| module.join("::")).collect();
        assert!(circle.is_empty(), "{folder}: these import each other in a circle, or what does: {circle:?}");
    }
    assert!(edges > 200, "{edges} imports were found");
}

/// A file that contains others knows them. They know each other, and nothing that it defines.
#[test]
fn no_file_knows_one_that_contains_it() {
    let mut wrong = Vec::new();
    for (folder, tree) in trees() {
        for module in tree.files.keys() {
            let of_above = tree.imports(module).of_above;
            wrong.extend(of_above.iter().map(|item| format!("{folder}: {} takes {item}", module.join("::"))));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
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
