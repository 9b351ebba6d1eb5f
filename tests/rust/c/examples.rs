//! Whole jobs: scans on disk with Ctrl-C, frames of a tracking camera. Under sanitizers and valgrind, interrupted and refused.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::library::root;
use crate::programs::{Program, compile, square, told};

pub const ADDRESS: [&str; 3] = ["-fsanitize=address,undefined", "-fno-omit-frame-pointer", "-O1"];
pub const THREAD: [&str; 3] = ["-fsanitize=thread", "-fno-omit-frame-pointer", "-O1"];
/// Worker threads live to the end of the program: what they hold is still reachable, not lost.
pub const VALGRIND: [&str; 5] =
    ["valgrind", "--quiet", "--error-exitcode=99", "--leak-check=full", "--errors-for-leak-kinds=definite"];

/// An example in C++ with threads.
pub fn threaded(source: &str, options: &[&str]) -> Program {
    compile("c++", &[&["-std=c++17", "-pthread"], options].concat(), &format!("c-api/examples/cpp/{source}"))
}

/// Whether valgrind is there. Says so if not.
pub fn has_valgrind() -> bool {
    let there = Command::new("valgrind").arg("--version").output().is_ok();
    if !there {
        println!("SKIPPED: valgrind is not installed");
    }
    there
}

/// The command with what ThreadSanitizer is to pass over, and why.
pub fn with_suppressions(mut command: Command) -> Command {
    let file = root().join("tests/c/tsan.supp");
    command.env("TSAN_OPTIONS", format!("suppressions={}:exitcode=99", file.display()));
    command
}

pub fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
    assert!(sent.expect("kill can be run").success());
}

/// Starts a merge, interrupts it once its line on the terminal says so, and waits: how it ended and after how long.
fn interrupted(program: &Program, arguments: &[&str], when: &str) -> (Option<i32>, Duration) {
    let mut command = program.command(&[]);
    let mut child = command.args(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stream = child.stderr.take().unwrap();
    let (mut said, mut part) = (String::new(), [0; 4096]);
    while !said.contains(when) {
        let count = stream.read(&mut part).unwrap();
        assert!(count > 0, "never said {when}: {said}");
        said.push_str(&String::from_utf8_lossy(&part[..count]));
    }
    signal(&child, "INT");
    let asked = Instant::now();
    let rest = std::thread::spawn(move || std::io::copy(&mut stream, &mut std::io::sink()));
    let status = child.wait().unwrap();
    let taken = asked.elapsed();
    rest.join().unwrap().unwrap();
    (status.code(), taken)
}

#[test]
fn a_wrong_use_of_the_examples_is_told() {
    let merge = compile("cc", &["-std=c99"], "c-api/examples/c/merge_scans.c");
    let said = merge.command(&[]).arg("out.glb").output().unwrap();
    assert!(said.status.code() == Some(2) && said.stderr.starts_with(b"usage: "));
    // Before it looks for the scans.
    let said = merge.command(&[]).args(["out.xyz", "nowhere.ply"]).output().unwrap();
    assert_eq!(said.status.code(), Some(1));
    assert!(
        String::from_utf8_lossy(&said.stderr).contains("out.xyz: the name must end in .ply, .glb, .stl, .3mf or .obj")
    );
    let camera = threaded("tracked_camera.cpp", &["-O1"]);
    let said = camera.command(&[]).args(["out.ply", "0"]).output().unwrap();
    assert!(said.status.code() == Some(2) && said.stderr.starts_with(b"usage: "));
}

/// The frames, voxel, triangles and holes of the lines that the camera's program prints.
fn merges(printed: &str) -> Vec<(usize, usize, usize)> {
    let number = |words: &[&str], k: usize| words[k].parse().unwrap_or_else(|_| panic!("{printed}"));
    let line = |line: &str| {
        let words: Vec<&str> = line.split(' ').collect();
        (number(&words, 0), number(&words, 4), number(&words, 6))
    };
    printed.lines().map(line).collect()
}

#[test]
fn a_tracked_camera_previews_and_leaks_nothing() {
    let program = threaded("tracked_camera.cpp", &ADDRESS);
    let found = merges(&program.run(&["out.ply", "30"]));
    let frames: Vec<usize> = found.iter().map(|merge| merge.0).collect();
    assert_eq!(frames, [12, 24, 30], "previews, and all in the end");
    assert!(found[2].1 > 3 * found[1].1 && found[2].2 == 0, "the last is fine and closed: {found:?}");
    assert!(std::fs::metadata(program.folder.path().join("out.ply")).unwrap().len() > 1_000_000);
    let failed = program.command(&[]).args(["out.xyz", "1"]).output().unwrap();
    assert_eq!(failed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&failed.stderr).contains("the name must end in .ply, .glb, .stl, .3mf or .obj"));
}

mod thorough {
    use super::*;

    #[test]
    fn a_tracked_camera_has_no_races() {
        let program = threaded("tracked_camera.cpp", &THREAD);
        let mut command = with_suppressions(program.command(&[]));
        assert_eq!(merges(&told(&command.args(["out.ply", "14"]).output().unwrap())).len(), 2);
    }

    #[test]
    fn valgrind_has_nothing_to_report_of_files_and_frames() {
        if !has_valgrind() {
            return;
        }
        let merge = compile("cc", &["-std=c99", "-O1"], "c-api/examples/c/merge_scans.c");
        let scan = square(merge.folder.path(), "scan.ply", 50);
        told(&merge.command(&VALGRIND).args(["out.glb", &scan]).output().unwrap());
        let camera = threaded("tracked_camera.cpp", &["-O1"]);
        told(&camera.command(&VALGRIND).args(["out.ply", "1"]).output().unwrap());
    }

    /// Theorem: Ctrl-C at any moment ends the merge of files at once, and what was there stays as it was, to the byte and the name.
    #[test]
    fn ctrl_c_leaves_nothing() {
        let moments = ["starting", "measuring", "reading scans", "fusing", "labelling", "building", "writing"];
        for options in [&["-O1"][..], &ADDRESS] {
            let program = compile("cc", &[&["-std=c99"], options].concat(), "c-api/examples/c/merge_scans.c");
            let folder = program.folder.path();
            let scans = [square(folder, "a.ply", 900), square(folder, "b.ply", 850)];
            std::fs::write(folder.join("there.glb"), "what was there").unwrap();
            let names = || {
                let mut names: Vec<_> = folder.read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
                names.sort();
                names
            };
            let before = names();
            let mut taken = vec![];
            for (k, when) in moments.into_iter().enumerate() {
                let out = ["new.glb", "there.glb"][k % 2];
                let (code, waited) = interrupted(&program, &[out, &scans[0], &scans[1]], when);
                if when == "writing" && code == Some(0) {
                    // It was done before the signal came.
                    assert!(std::fs::metadata(folder.join(out)).unwrap().len() > 1_000_000);
                    continue;
                }
                assert_eq!(code, Some(130), "interrupted while {when}");
                assert_eq!(names(), before, "interrupted while {when}");
                assert_eq!(std::fs::read(folder.join("there.glb")).unwrap(), b"what was there");
                taken.push(waited);
            }
            // On a machine that does other things as well most take longer; the benchmark of limits measures each call alone.
            taken.sort();
            assert!(
                taken[0] < Duration::from_millis(300) && taken[taken.len() - 1] < Duration::from_secs(2),
                "{taken:?}"
            );
        }
    }
}
