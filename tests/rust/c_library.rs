//! The C library as a stranger meets it: the built file is loaded by name, the header compiled as C99 and as C++17.

use std::ffi::{CStr, OsStr, c_char};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use libloading::{Library, Symbol};

const ABI_VERSION: u32 = 1;
const OK: i32 = 0;
const ERR_PARAMETER: i32 = 1;
const ERR_NULL: i32 = 7;

type StatusText = unsafe extern "C" fn(i32, *mut *const c_char) -> i32;
type Message = unsafe extern "C" fn() -> *const c_char;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The folder of the built library; cargo builds no library for a test that only loads it, so it is built here, once.
fn library_folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the target folder").to_owned();
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--package", "surfrecon-capi", "--target-dir"])
            .arg(&target)
            .current_dir(root())
            .status();
        assert!(built.expect("cargo can be run").success(), "surfrecon-capi does not build");
        target.join("debug")
    })
}

fn with_library(test: impl FnOnce(&Library)) {
    let file = library_folder().join(libloading::library_filename("surfrecon"));
    // SAFETY: our own library; loading it runs no code of ours.
    #[allow(unsafe_code)]
    let library = unsafe { Library::new(&file) }.unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    test(&library);
}

fn function<'a, F>(library: &'a Library, name: &str) -> Symbol<'a, F> {
    // SAFETY: `F` is the type the header declares for `name`.
    #[allow(unsafe_code)]
    unsafe { library.get(name.as_bytes()) }.unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn text(pointer: *const c_char) -> String {
    assert!(!pointer.is_null());
    // SAFETY: the library answers with a text that ends with a zero byte and outlives this call.
    #[allow(unsafe_code)]
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().expect("UTF-8").to_owned()
}

#[test]
#[allow(unsafe_code)]
fn versions_are_those_of_the_workspace_and_the_header() {
    with_library(|library| {
        let version: Symbol<Message> = function(library, "srf_version");
        let abi_version: Symbol<unsafe extern "C" fn() -> u32> = function(library, "srf_abi_version");
        // SAFETY: no arguments.
        let (version, abi_version) = unsafe { (text(version()), abi_version()) };
        assert_eq!(version, env!("CARGO_PKG_VERSION"));
        assert_eq!(abi_version, ABI_VERSION);
        let header = std::fs::read_to_string(root().join("c-api/include/surfrecon.h")).expect("the header");
        assert!(header.contains(&format!("#define SRF_ABI_VERSION {ABI_VERSION}\n")));
    });
}

#[test]
#[allow(unsafe_code)]
fn every_status_of_the_header_has_a_text_and_no_other() {
    let header = std::fs::read_to_string(root().join("c-api/include/surfrecon.h")).expect("the header");
    let declared = header.lines().filter_map(|line| {
        let (name, number) = line.trim().trim_end_matches(',').split_once(" = ")?;
        name.starts_with("SRF_").then(|| number.parse::<i32>().expect("a number"))
    });
    let declared: Vec<i32> = declared.collect();
    assert!(declared.len() >= 9 && declared.contains(&OK), "{declared:?}");
    with_library(|library| {
        let status_text: Symbol<StatusText> = function(library, "srf_status_text");
        let message: Symbol<Message> = function(library, "srf_last_error_message");
        for status in -2..100 {
            let mut out = std::ptr::null();
            // SAFETY: `out` may be written.
            let outcome = unsafe { status_text(status, &mut out) };
            if declared.contains(&status) {
                assert_eq!(outcome, OK, "{status}");
                assert!(!text(out).is_empty());
            } else {
                assert_eq!(outcome, ERR_PARAMETER, "{status}");
                assert!(out.is_null(), "written in spite of the error");
                // SAFETY: no arguments.
                let message = text(unsafe { message() });
                assert!(message.contains(&format!("got {status}")) && message.contains(">= 0"), "{message}");
            }
        }
    });
}

#[test]
#[allow(unsafe_code)]
fn a_null_pointer_is_an_error_that_names_the_argument() {
    with_library(|library| {
        let status_text: Symbol<StatusText> = function(library, "srf_status_text");
        let message: Symbol<Message> = function(library, "srf_last_error_message");
        // SAFETY: NULL is allowed to be handed in; the library checks.
        let outcome = unsafe { status_text(OK, std::ptr::null_mut()) };
        assert_eq!(outcome, ERR_NULL);
        // SAFETY: no arguments.
        assert_eq!(text(unsafe { message() }), "out_text must not be NULL");
    });
}

/// Compiles `tests/c/versions.c` with all warnings as errors, links it to the library and runs it.
fn compile_and_run(compiler: &str, options: &[&str]) {
    let folder = tempfile::tempdir().expect("a scratch folder");
    let program = folder.path().join("versions");
    let compiled = Command::new(compiler)
        .args(options)
        .args(["-Wall", "-Wextra", "-pedantic", "-Werror"])
        .arg("-I")
        .arg(root().join("c-api/include"))
        .arg(root().join("tests/c/versions.c"))
        .args([OsStr::new("-o"), program.as_os_str(), OsStr::new("-L"), library_folder().as_os_str()])
        .arg("-lsurfrecon")
        .output()
        .unwrap_or_else(|error| panic!("{compiler} can't be run: {error}"));
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = Command::new(&program).env("LD_LIBRARY_PATH", library_folder()).output().expect("the program runs");
    let printed = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success(), "{printed}{}", String::from_utf8_lossy(&ran.stderr));
    assert_eq!(printed.trim(), format!("surfrecon {}", env!("CARGO_PKG_VERSION")));
}

#[test]
#[cfg(target_os = "linux")]
fn the_header_is_c99() {
    compile_and_run("cc", &["-std=c99"]);
}

#[test]
#[cfg(target_os = "linux")]
fn the_header_is_cpp17() {
    compile_and_run("c++", &["-std=c++17", "-x", "c++"]);
}
