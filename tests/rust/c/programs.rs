//! Programs in C and C++: compiled with all warnings as errors, run plainly, under sanitizers and under valgrind.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::library::*;

pub struct Program {
    pub folder: tempfile::TempDir,
    file: PathBuf,
}

/// Compiles a program of the tree and links it to the library.
pub fn compile(compiler: &str, options: &[&str], source: &str) -> Program {
    let scratch = tempfile::tempdir().expect("a scratch folder");
    let file = scratch.path().join("program");
    let compiled = Command::new(compiler)
        .args(options)
        .args(["-Wall", "-Wextra", "-pedantic", "-Werror", "-g", "-I"])
        .arg(root().join("c-api/include"))
        .args([root().join(source).as_os_str(), OsStr::new("-o"), file.as_os_str(), OsStr::new("-L")])
        .args([folder().as_os_str(), OsStr::new("-lsurfrecon"), OsStr::new("-lm")])
        .output()
        .unwrap_or_else(|error| panic!("{compiler} can't be run: {error}"));
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    Program { folder: scratch, file }
}

impl Program {
    pub fn command(&self, through: &[&str]) -> Command {
        let mut words: Vec<&OsStr> = through.iter().map(OsStr::new).collect();
        words.push(self.file.as_os_str());
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).env("LD_LIBRARY_PATH", folder()).current_dir(self.folder.path());
        command.env("ASAN_OPTIONS", "detect_leaks=1:exitcode=99").env("UBSAN_OPTIONS", "halt_on_error=1");
        command
    }

    pub fn run(&self, arguments: &[&str]) -> String {
        told(&self.command(&[]).args(arguments).output().expect("the program runs"))
    }
}

pub fn told(output: &Output) -> String {
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}: {printed}{}", output.status, String::from_utf8_lossy(&output.stderr));
    printed
}

/// A scan file of a bumpy square, written into the folder of a program.
fn scan_file(folder: &Path) -> String {
    square(folder, "scan.ply", 50)
}

/// The same of any size and name: its bumps have the same number of pixels.
pub fn square(folder: &Path, name: &str, side: u32) -> String {
    use surfrecon::range_image::{Projection, RangeImage};
    let bump = |i: u32| 0.1 * (f64::from(i % side) * 0.3).sin() * (f64::from(i / side) * 0.2).cos();
    let values = (0..side * side).map(bump).collect();
    let plane = Projection::Orthographic { first: [0.0; 2], step: [0.1, -0.1] };
    let image = RangeImage::from_values(side as usize, side as usize, values, plane).unwrap();
    let path = folder.join(name);
    surfrecon::export::write_range_grid_ply(
        &path,
        &image,
        surfrecon::export::PlyEncoding::Ascii,
        &surfrecon::Progress::none(),
    )
    .unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn the_header_is_c99_c11_and_cpp17() {
    for (compiler, options) in [
        ("cc", &["-std=c99"][..]),
        ("cc", &["-std=c11"]),
        ("c++", &["-std=c++17", "-x", "c++"]),
        ("c++", &["-std=c++20", "-x", "c++"]),
    ] {
        let printed = compile(compiler, options, "tests/c/versions.c").run(&[]);
        assert_eq!(printed.trim(), format!("surfrecon {}", env!("CARGO_PKG_VERSION")));
    }
}

#[test]
fn the_c_example_merges_a_scan() {
    let program = compile("cc", &["-std=c99"], "c-api/examples/c/merge_scans.c");
    let scan = scan_file(program.folder.path());
    let printed = program.run(&["out.glb", &scan]);
    assert!(printed.starts_with("1 scan, 4802 triangles in"), "{printed}");
    assert!(std::fs::metadata(program.folder.path().join("out.glb")).unwrap().len() > 1000);
    let failed = program.command(&[]).args(["out2.glb", "missing.ply"]).output().unwrap();
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("missing.ply: No such file"));
    assert!(!program.folder.path().join("out2.glb").exists());
}

#[test]
fn the_c_example_merges_frames_and_leaks_nothing() {
    let sanitizers = ["-std=c99", "-fsanitize=address,undefined", "-fno-omit-frame-pointer", "-O1"];
    let program = compile("cc", &sanitizers, "c-api/examples/c/merge_frames.c");
    let printed = program.run(&["out.ply", "20"]);
    assert!(printed.starts_with("20 frames, voxel 0.0") && printed.ends_with(" 0 holes left open\n"), "{printed}");
    assert!(std::fs::metadata(program.folder.path().join("out.ply")).unwrap().len() > 100_000);
    let failed = program.command(&[]).args(["out2.ply", "0"]).output().unwrap();
    assert!(!failed.status.success() && String::from_utf8_lossy(&failed.stderr).starts_with("usage: "));
}

#[test]
fn the_c_example_lists_scans_and_leaks_nothing() {
    let sanitizers = ["-std=c99", "-fsanitize=address,undefined", "-fno-omit-frame-pointer", "-O1"];
    let program = compile("cc", &sanitizers, "c-api/examples/c/list_scans.c");
    let scan = scan_file(program.folder.path());
    let seeds = root().join("rust-core/fuzz/seeds/import_scan");
    let seed = |name: &str| seeds.join(name).to_str().unwrap().to_owned();
    assert_eq!(program.run(&[&scan]), "scan: range image, 50 x 50, 2500 samples, at 0 0 0\n");
    let printed = program.run(&[&seed("points.laz"), &seed("mesh.glb"), &seed("two.ptx")]);
    let lines: Vec<&str> = printed.lines().collect();
    assert!(lines.len() == 4 && lines[0].starts_with("points: 8 points"), "{printed}");
    assert!(lines[1].starts_with("mesh: mesh, 4 vertices, 2 triangles"), "{printed}");
    assert!(lines[2].starts_with("two: range image, 3 x 4, 9 samples, at 4e+06 5e+06 7"), "{printed}");
    let depth = program.run(&["--camera", "2", "2", "0.5", "0.5", &seed("map.pgm")]);
    assert!(depth.starts_with("map: range image, 2 x 2, 3 samples"), "{depth}");
    let failed = program.command(&[]).args(["--camera", "0", "2", "0.5", "0.5", &seed("map.pgm")]).output().unwrap();
    assert!(!failed.status.success() && !String::from_utf8_lossy(&failed.stderr).contains("Sanitizer"));
}

#[test]
fn the_c_example_aligns_scans_and_leaks_nothing() {
    let sanitizers = ["-std=c99", "-fsanitize=address,undefined", "-fno-omit-frame-pointer", "-O1"];
    let program = compile("cc", &sanitizers, "c-api/examples/c/align_scans.c");
    let list = crate::views::without_poses(program.folder.path());
    let printed = program.run(&[list.to_str().unwrap()]);
    let lines: Vec<&str> = printed.lines().collect();
    assert!(lines.len() == 4 && lines[0].starts_with("view0: at 0 0 0, to 0"), "{printed}");
    assert!(lines[1..].iter().all(|line| line.starts_with("view") && !line.contains("not placed")), "{printed}");
    let failed = program.command(&[]).args(["--rough", &scan_file(program.folder.path())]).output().unwrap();
    assert!(!failed.status.success() && String::from_utf8_lossy(&failed.stderr).contains("at least two scans, got 1"));
}

#[test]
fn the_cpp_example_stays_within_its_tolerance() {
    let program = compile("c++", &["-std=c++17"], "c-api/examples/cpp/live_tolerance.cpp");
    let printed = program.run(&["out.ply"]);
    let triangles: Vec<u32> = printed.lines().map(|line| line.split(' ').nth(2).unwrap().parse().unwrap()).collect();
    assert!(triangles[..5].is_sorted() && triangles[5] == triangles[2] && triangles[4] > 4 * triangles[0], "{printed}");
    assert!(program.folder.path().join("out.ply").exists());
}

/// The header with its sized structs a field shorter, or a field longer.
fn other_header(longer: bool) -> String {
    let header = std::fs::read_to_string(root().join("c-api/include/surfrecon.h")).expect("the header");
    let (mut all, mut first, mut changed) = (Vec::<&str>::new(), None, 0);
    for line in header.lines() {
        if line.contains(" struct_size;") {
            first = Some(all.len());
        }
        if line.starts_with('}')
            && let Some(first) = first.take()
        {
            changed += 1;
            if longer {
                all.push("  double added_later;");
            } else {
                let last = all.iter().rposition(|line| line.ends_with(';')).expect("a field");
                assert!(
                    last > first && ["64_t ", "double ", "  srf_"].iter().any(|kind| all[last].contains(kind)),
                    "{}",
                    all[last]
                );
                all.remove(last);
            }
        }
        all.push(line);
    }
    assert_eq!(changed, header.matches("#define srf_").count(), "every sized struct has its initializer");
    all.join("\n") + "\n"
}

#[test]
fn programs_of_an_older_and_of_a_newer_header_work() {
    let sanitizers = ["-fsanitize=address,undefined", "-fno-omit-frame-pointer", "-O1"];
    for (longer, defined) in [(false, "-DLESS"), (true, "-DMORE")] {
        let folder = tempfile::tempdir().expect("a scratch folder");
        std::fs::write(folder.path().join("surfrecon.h"), other_header(longer)).expect("a header");
        let include = format!("-I{}", folder.path().display());
        for (compiler, language) in [("cc", ["-std=c99", "-x", "c"]), ("c++", ["-std=c++17", "-x", "c++"])] {
            let options = [&[include.as_str(), defined], &sanitizers[..], &language].concat();
            assert_eq!(compile(compiler, &options, "tests/c/other_header.c").run(&[]).trim(), "fine");
        }
    }
}

/// Theorem: programs built against a release from 0.2.0 on run with every later library. A release leaves its header and its `exercise.c`
/// in `tests/c/released/VERSION/`. CHANGELOG.md says which releases there are.
#[test]
fn programs_of_released_headers_work() {
    let changelog = std::fs::read_to_string(root().join("CHANGELOG.md")).expect("CHANGELOG.md");
    let version = |line: &str| {
        let heading = line.strip_prefix("## ").filter(|heading| !heading.ends_with("(unreleased)"))?;
        let number = heading.trim_start_matches('[').split([']', ' ']).next()?.to_owned();
        let parts: Vec<u32> = number.split('.').map(|part| part.parse().ok()).collect::<Option<_>>()?;
        (parts >= vec![0, 2, 0]).then_some(number)
    };
    for version in changelog.lines().filter_map(version) {
        let released = root().join("tests/c/released").join(&version);
        assert!(
            released.join("surfrecon.h").exists(),
            "{version} was released: its header and exercise.c belong there"
        );
        let include = format!("-I{}", released.display());
        let source = format!("tests/c/released/{version}/exercise.c");
        assert_eq!(compile("cc", &["-std=c99", &include], &source).run(&[]).trim(), "fine", "{version}");
    }
}

#[test]
fn a_forked_program_goes_on() {
    let program = compile("cc", &["-std=c11", "-pthread", "-O1"], "tests/c/fork.c");
    assert_eq!(program.run(&[]).trim(), "fine");
}

#[test]
fn memory_comes_from_functions_of_the_program() {
    let sanitizers = ["-std=c99", "-pthread", "-fsanitize=address,undefined", "-fno-omit-frame-pointer", "-O1"];
    let program = compile("cc", &sanitizers, "tests/c/allocator.c");
    assert_eq!(program.run(&[]).trim(), "fine");
    assert_eq!(program.run(&["reallocate"]).trim(), "fine");
}

#[test]
fn a_handler_of_a_signal_cancels() {
    let program = compile("cc", &["-std=c99", "-O1"], "tests/c/interrupt.c");
    assert_eq!(program.run(&[]).trim(), "fine");
}

#[test]
fn a_program_that_unloads_and_loads_twice_goes_on() {
    let program = compile("cc", &["-std=c99", "-O1", "-Wl,--as-needed"], "tests/c/unload.c");
    let library = folder().join(libloading::library_filename("surfrecon"));
    let scratch = tempfile::tempdir().unwrap();
    let copy = scratch.path().join("another.so");
    std::fs::copy(&library, &copy).unwrap();
    assert_eq!(program.run(&[library.to_str().unwrap(), copy.to_str().unwrap()]).trim(), "fine");
}

#[test]
fn a_program_without_memory_goes_on() {
    let program = compile("cc", &["-std=c99", "-O1"], "tests/c/memory.c");
    assert_eq!(program.run(&[]).trim(), "fine");
}

mod thorough {
    use super::*;

    #[test]
    fn valgrind_has_nothing_to_report() {
        if Command::new("valgrind").arg("--version").output().is_err() {
            println!("SKIPPED: valgrind is not installed");
            return;
        }
        let program = compile("cc", &["-std=c99", "-O1"], "tests/c/exercise.c");
        // Worker threads live to the end of the program: what they hold is still reachable, not lost.
        let through =
            ["valgrind", "--quiet", "--error-exitcode=99", "--leak-check=full", "--errors-for-leak-kinds=definite"];
        let output = program.command(&through).output().expect("valgrind runs");
        assert_eq!(told(&output).trim(), "fine");
    }

    #[test]
    fn nothing_leaks_and_nothing_is_undefined() {
        let sanitizers = ["-fsanitize=address,undefined", "-fno-omit-frame-pointer", "-O1"];
        let c = compile("cc", &[&["-std=c99"], &sanitizers[..]].concat(), "tests/c/exercise.c");
        assert_eq!(c.run(&[]).trim(), "fine");
        let cpp = compile("c++", &[&["-std=c++20"], &sanitizers[..]].concat(), "tests/c/exercise.cpp");
        assert_eq!(cpp.run(&[]).trim(), "fine");
    }

    #[test]
    fn two_plugins_in_a_program_have_threads_memory_and_a_log_of_their_own() {
        let program = compile("cc", &["-std=c99", "-O1", "-pthread"], "tests/c/contexts.c");
        assert_eq!(program.run(&[]).trim(), "fine");
    }
}
