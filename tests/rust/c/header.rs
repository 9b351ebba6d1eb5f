//! The header: what it declares is what the library exports and what the committed lists say.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use crate::library::*;

pub fn header() -> String {
    std::fs::read_to_string(root().join("c-api/include/surfrecon.h")).unwrap()
}

/// The header's code without its comments, as one line of words.
fn code() -> String {
    let header = header();
    without_comments(&header[header.find("#include").unwrap()..])
}

/// Code without its comments and directives, as one line of words.
fn without_comments(code: &str) -> String {
    let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
    lines
        .filter(|line| !line.trim_start().starts_with('#'))
        .flat_map(str::split_whitespace)
        .collect::<Vec<_>>()
        .join(" ")
}

/// Names of the functions the header declares, sorted.
fn declared() -> Vec<String> {
    functions(&code())
}

/// Names of the functions that code without comments declares, sorted.
fn functions(code: &str) -> Vec<String> {
    let names = code.match_indices("srf_").filter_map(|(at, _)| {
        let rest = &code[at..];
        let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        rest[end..].starts_with('(').then(|| rest[..end].to_owned())
    });
    let mut names: Vec<String> = names.collect();
    names.sort();
    names.dedup();
    names
}

fn run(program: &str, arguments: &[&str]) -> String {
    let output =
        Command::new(program).args(arguments).output().unwrap_or_else(|e| panic!("{program} can't be run: {e}"));
    assert!(output.status.success(), "{program} {arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Compares with a committed list, or writes it when asked to.
fn compare(name: &str, now: &str) {
    let path = root().join("c-api/abi").join(name);
    if std::env::var_os("SURFRECON_GENERATE").is_some() {
        std::fs::write(&path, now).unwrap();
        return;
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let gone: Vec<&str> = committed.lines().filter(|line| !now.lines().any(|l| l == *line)).collect();
    assert!(gone.is_empty(), "the binary interface has lost or changed, against c-api/abi/{name}: {gone:#?}");
    assert!(committed == now, "c-api/abi/{name} lacks what is new: run `make generate`");
}

#[test]
fn symbols_are_those_declared_called_and_committed() {
    let library = folder().join(libloading::library_filename("surfrecon"));
    let listed = run("nm", &["--dynamic", "--defined-only", library.to_str().unwrap()]);
    let mut exported: Vec<String> =
        listed.lines().map(|line| line.split(' ').next_back().unwrap().to_owned()).collect();
    exported.sort();
    assert_eq!(exported, declared());
    let mut called: Vec<&str> = NAMES.to_vec();
    called.sort_unstable();
    assert_eq!(called, declared());
    compare("symbols.txt", &(exported.join("\n") + "\n"));
}

/// Structs of the header: name, and the names of the fields.
fn structs() -> Vec<(String, Vec<String>)> {
    let code = code();
    let mut all = Vec::new();
    for part in code.split("typedef struct {").skip(1) {
        let (body, rest) = part.split_once('}').unwrap();
        let name = rest.split(';').next().unwrap().trim().to_owned();
        let field = |f: &str| f.split('[').next().unwrap().split([' ', '*']).next_back().unwrap().to_owned();
        all.push((name, body.split(';').map(str::trim).filter(|f| !f.is_empty()).map(field).collect()));
    }
    all
}

fn compiled(compiler: &str, options: &[&str], source: &str, out: &Path) {
    let file = out.with_extension("c");
    std::fs::write(&file, source).unwrap();
    let include = root().join("c-api/include");
    let mut arguments = options.to_vec();
    arguments.extend(["-I", include.to_str().unwrap(), file.to_str().unwrap(), "-o", out.to_str().unwrap()]);
    run(compiler, &arguments);
}

#[test]
fn layouts_are_those_committed() {
    let mut source = "#include <stdio.h>\n#include \"surfrecon.h\"\nint main(void) {\n".to_owned();
    for (name, fields) in structs() {
        let _ = writeln!(source, "printf(\"{name}: %zu bytes\\n\", sizeof({name}));");
        for field in fields {
            let at = format!("offsetof({name}, {field})");
            let size = format!("sizeof((({name} *)0)->{field})");
            let _ = writeln!(source, "printf(\"{name}.{field}: %zu bytes at %zu\\n\", {size}, {at});");
        }
    }
    source += "return 0; }\n";
    let scratch = tempfile::tempdir().unwrap();
    let program = scratch.path().join("layouts");
    compiled("cc", &["-std=c99"], &source, &program);
    let now = run(program.to_str().unwrap(), &[]);
    assert!(now.lines().count() > 60, "{now}");
    compare("layouts.txt", &now);
}

/// A library whose functions do nothing and whose debug information is the header's.
fn stubs(out: &Path) {
    let code = code();
    let functions = code.split("extern \"C\" {").nth(1).unwrap_or(&code);
    let mut source = "#include \"surfrecon.h\"\n".to_owned();
    for declaration in functions.split(';').map(str::trim).filter(|d| d.contains('(') && d.starts_with(['s', 'c', 'u']))
    {
        let _ = writeln!(source, "{declaration} {{ __builtin_trap(); }}");
    }
    // No path of this machine goes into the committed file.
    let nowhere = format!("-ffile-prefix-map={}=.", out.parent().unwrap().display());
    let here = format!("-ffile-prefix-map={}=.", root().display());
    let options = ["-std=c99", "-g", "-shared", "-fPIC", "-Wl,-soname,libsurfrecon.so", &nowhere, &here];
    compiled("cc", &options, &source, out);
}

#[test]
fn libabigail_finds_no_break() {
    if Command::new("abidiff").arg("--version").output().is_err() {
        println!("SKIPPED: abidiff is not installed (package abigail-tools)");
        return;
    }
    let scratch = tempfile::tempdir().unwrap();
    let library = scratch.path().join("libsurfrecon.so");
    stubs(&library);
    let baseline = root().join("c-api/abi/surfrecon.abi");
    if std::env::var_os("SURFRECON_GENERATE").is_some() {
        let options = ["--no-corpus-path", "--no-comp-dir-path", "--no-show-locs", "--type-id-style", "hash"];
        let out = ["--out-file", baseline.to_str().unwrap(), library.to_str().unwrap()];
        run("abidw", &[&options[..], &out[..]].concat());
    }
    // Functions and fields that were added at the end are no break.
    let arguments = ["--no-added-syms", "--no-show-locs", baseline.to_str().unwrap(), library.to_str().unwrap()];
    let output = Command::new("abidiff").args(arguments).output().unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    // Bit 4 says that something changed, bit 8 that the change breaks programs.
    assert!(output.status.code().is_some_and(|code| code & 0b1011 == 0), "{told}");
}

#[test]
fn every_function_says_since_when_and_every_argument_what_it_is() {
    let header = header();
    let mut comment = String::new();
    let mut declaration = String::new();
    let mut checked = 0;
    let start = header.find("extern \"C\" {").unwrap();
    for line in header[start..].lines().skip(2) {
        if let Some(text) = line.trim().strip_prefix("//") {
            comment += text;
            comment += "\n";
        } else if line.trim().is_empty() || line.starts_with('#') {
            comment.clear();
        } else {
            declaration += line.trim();
            declaration += " ";
            if !line.ends_with(';') {
                continue;
            }
            assert!(comment.contains("Since "), "{declaration}");
            let arguments = declaration.split_once('(').unwrap().1;
            let arguments = arguments.trim_end_matches([' ', ';', ')']).split(',').filter(|a| *a != "void");
            for argument in arguments {
                let name = argument.trim().split([' ', '*']).next_back().unwrap();
                let described = comment
                    .lines()
                    .any(|line| line.split("  ").next().unwrap_or_default().split(',').any(|word| word.trim() == name));
                assert!(described || declaration.contains("srf_status_text"), "{name} of {declaration}");
            }
            checked += 1;
            declaration.clear();
            comment.clear();
        }
    }
    assert_eq!(checked, NAMES.len());
}

/// The functions that the chapters have as examples.
fn chapter_examples(header: &str) -> Vec<String> {
    let chapter = |part: &str| {
        let lines = part.lines().skip(1).take_while(|line| line.starts_with("//"));
        lines.filter_map(|line| line.strip_prefix("//     ")).collect::<Vec<_>>().join("\n")
    };
    header.split("// ==== ").skip(1).map(chapter).collect()
}

#[test]
fn chapters_have_examples_that_compile_and_stand_in_the_index() {
    let header = header();
    let examples = chapter_examples(&header);
    let index = header.split("*/").next().unwrap();
    for (number, title) in (1..=examples.len()).zip(header.split("// ==== ").skip(1)) {
        let title = title.split(" =").next().unwrap();
        assert!(title.starts_with(&format!("{number}. ")) && index.contains(&format!(" {title} ")), "{title}");
    }
    assert!(examples.len() > 10 && examples.iter().all(|example| example.contains("srf_")));
    let source =
        format!("#include <stdio.h>\n#include <stdlib.h>\n#include \"surfrecon.h\"\n{}\n", examples.join("\n"));
    let scratch = tempfile::tempdir().unwrap();
    let options = ["-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-c"];
    compiled("cc", &[&["-std=c99"], &options[..]].concat(), &source, &scratch.path().join("examples.o"));
    compiled("c++", &[&["-std=c++17", "-x", "c++"], &options[..]].concat(), &source, &scratch.path().join("cpp.o"));
}

#[test]
fn every_function_is_called_in_the_examples_of_its_chapter() {
    let header = header();
    let mut called = 0;
    for (chapter, examples) in header.split("// ==== ").skip(1).zip(chapter_examples(&header)) {
        let (title, rest) = chapter.split_once('\n').unwrap();
        for name in functions(&without_comments(rest)) {
            // Structs are prepared by macros of that name.
            let call = format!("{}(", name.trim_end_matches("_sized"));
            assert!(examples.contains(&call), "{name} is in no example of {}", title.trim_end_matches([' ', '=']));
            called += 1;
        }
    }
    assert_eq!(called, NAMES.len());
}

#[test]
fn versions_are_those_of_the_workspace_and_the_header() {
    // SAFETY: no arguments.
    let (version, abi_version) = unsafe { (text((api().srf_version)()), (api().srf_abi_version)()) };
    assert_eq!(version, env!("CARGO_PKG_VERSION"));
    assert!(header().contains(&format!("#define SRF_ABI_VERSION {abi_version}\n")));
}

#[test]
fn every_status_of_the_header_has_a_text_and_no_other() {
    let header = header();
    let declared = header.lines().filter_map(|line| {
        let (name, number) = line.trim().trim_end_matches(',').split_once(" = ")?;
        (name == "SRF_OK" || name.starts_with("SRF_ERR_")).then(|| number.parse::<i32>().expect("a number"))
    });
    let declared: Vec<i32> = declared.collect();
    assert!(declared.len() >= 11 && declared.contains(&0), "{declared:?}");
    for status in -2..100 {
        let mut out = std::ptr::null();
        // SAFETY: `out` may be written.
        let answer = unsafe { (api().srf_status_text)(status, &mut out) };
        if declared.contains(&status) {
            api().ok(answer);
            assert!(!text(out).is_empty());
        } else {
            api().refused(answer, 1, &format!("got {status}"));
            assert!(out.is_null(), "written in spite of the error");
        }
    }
}

/// Enums of the header: name, and the names of their values.
fn enums() -> Vec<(String, Vec<String>)> {
    let code = code();
    let one = |part: &str| {
        let (body, rest) = part.split_once('}').unwrap();
        let values = body.split(',').filter_map(|value| Some(value.split_once('=')?.0.trim().to_owned()));
        (rest.split(';').next().unwrap().trim().to_owned(), values.collect())
    };
    code.split("typedef enum {").skip(1).map(one).collect()
}

#[test]
fn values_of_enums_carry_its_name() {
    let all = enums();
    assert!(all.len() > 15);
    for (name, values) in all.iter().filter(|(name, _)| name != "srf_status") {
        // The kinds of something have its name: SRF_PROJECTION_SPHERICAL.
        let prefix = format!("{}_", name.trim_end_matches("_kind").to_ascii_uppercase());
        assert!(values.len() > 1 && values.iter().all(|value| value.starts_with(&prefix)), "{name}: {values:?}");
    }
}

/// Functions that answer with a status: name, arguments, and the comment with what it may be.
pub fn promised() -> Vec<(String, Vec<String>, String)> {
    let header = header();
    let (mut all, mut comment, mut declaration) = (Vec::new(), String::new(), String::new());
    for line in header.lines().map(str::trim) {
        if let Some(text) = line.strip_prefix("//") {
            comment = comment + " " + text.trim();
        } else if line.starts_with("srf_status srf_") || !declaration.is_empty() {
            declaration = declaration + " " + line;
            if declaration.ends_with(");") {
                let (name, arguments) = declaration.trim_end_matches(");").split_once('(').unwrap();
                let name = name.trim().trim_start_matches("srf_status ").to_owned();
                let arguments = arguments.split(',').map(|argument| argument.trim().to_owned()).collect();
                all.push((name, arguments, std::mem::take(&mut comment)));
                declaration.clear();
            }
        } else {
            comment.clear();
        }
    }
    all
}

/// Theorem: the comment of each function lists every status that follows from what it takes, and those that wrong calls are seen to get.
#[test]
fn what_calls_return_is_said() {
    let sized: Vec<String> =
        structs().into_iter().filter(|(_, f)| f[0] == "struct_size").map(|(name, _)| name).collect();
    let is_struct = |kind: &str| structs().iter().any(|(name, _)| name == kind);
    let mut wrong = Vec::new();
    let promised = promised();
    assert!(promised.len() > 100, "{}", promised.len());
    for (name, arguments, comment) in &promised {
        let said = comment.split("returns").nth(1).unwrap_or_default();
        let mut expected = vec!["SRF_OK"];
        for argument in arguments {
            let words: Vec<&str> = argument.split([' ', '*']).filter(|word| *word != "const").collect();
            let (kind, is_const) = (words[0], argument.starts_with("const "));
            let is_pointer = argument.contains('*') && !argument.contains("**");
            let is_initializer = name.ends_with("_init_sized");
            if kind.starts_with("srf_") && is_pointer && !is_struct(kind) {
                expected.push("SRF_ERR_HANDLE");
            }
            if kind == "srf_array" && is_const {
                expected.extend(["SRF_ERR_PARAMETER", "SRF_ERR_INPUT"]);
            }
            if kind == "srf_progress" {
                expected.extend(["SRF_ERR_CANCELLED", "SRF_ERR_HANDLE"]);
            }
            if sized.iter().any(|known| known == kind) && is_pointer && !is_initializer {
                expected.push("SRF_ERR_STRUCT_SIZE");
            }
            if argument == "const char *path" {
                expected.extend(["SRF_ERR_IO", "SRF_ERR_INPUT"]);
            }
            if ["uint32_t", "int32_t", "double"].contains(&kind)
                && !argument.contains('*')
                && name != "srf_spline_point"
            {
                expected.push("SRF_ERR_PARAMETER");
            }
        }
        let missing: Vec<&str> = expected.into_iter().filter(|status| !said.contains(status)).collect();
        if !missing.is_empty() {
            wrong.push(format!("{name} does not say {}", missing.join(", ")));
        }
    }
    for (name, status) in api().call_with_zeros().into_iter().chain(api().call_with_junk()) {
        let (_, _, comment) = promised.iter().find(|(known, ..)| known == name).expect("it is declared");
        let status = crate::returned::STATUSES[status as usize];
        if !comment.split("returns").nth(1).unwrap_or_default().contains(status) {
            wrong.push(format!("{name} returned {status} and does not say it"));
        }
    }
    wrong.sort();
    wrong.dedup();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
