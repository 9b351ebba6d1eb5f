//! Writers that are killed: what they leave is nothing.
#![cfg(target_os = "linux")]
// The test reads what it prints.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::io::{BufRead, BufReader};
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Command, Stdio};

use glam::DVec3;
use surfrecon::export::{PlyEncoding, write_ply, write_scan_list};
use surfrecon::range_image::Viewing;
use surfrecon::{Progress, RangeImage, TriMesh};

/// Variable with the path that the test, run once more as a program of its own, writes to.
const TARGET: &str = "SURFRECON_TEST_WRITES_TO";
/// Its words when it is halfway.
const HALFWAY: &str = "halfway";

/// Writes until it is halfway, says so and waits to be killed.
fn write(path: &Path) {
    let progress = Progress::new(|tick| {
        if tick.fraction > 0.4 && tick.fraction < 1.0 {
            println!("{HALFWAY}");
            loop {
                std::thread::park();
            }
        }
        ControlFlow::Continue(())
    });
    if path.extension().is_some_and(|extension| extension == "conf") {
        let points = vec![[0.123_456_7, -7.654_321, 1.0 / 3.0]; 1_000_000];
        let image = RangeImage::from_points(1000, 1000, points, Viewing::ALONG_MINUS_Z).unwrap();
        let named = |name: &str| {
            let mut image = image.clone();
            image.name = name.to_owned();
            image
        };
        let images = ["a", "b", "c"].map(named);
        write_scan_list(path, &images.iter().collect::<Vec<_>>(), PlyEncoding::Ascii, &progress).unwrap();
    } else {
        let mesh = TriMesh::new(vec![DVec3::new(1.0 / 3.0, 1e7 / 7.0, -0.1); 4_000_000], Vec::new());
        write_ply(path, &mesh, PlyEncoding::Ascii, &progress).unwrap();
    }
}

/// Theorem: killed halfway, a writer of a file or of a set leaves the folder as it was.
#[test]
fn killed_writers_leave_nothing() {
    if let Some(path) = std::env::var_os(TARGET) {
        return write(Path::new(&path));
    }
    for name in ["mesh.ply", "scans.conf"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, "old").unwrap();
        let mut writer = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "killed_writers_leave_nothing", "--nocapture"])
            .env(TARGET, &path)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(writer.stdout.take().unwrap()).lines().map_while(Result::ok);
        let is_halfway = lines.any(|line| line.contains(HALFWAY));
        writer.kill().unwrap();
        writer.wait().unwrap();
        assert!(is_halfway, "{name}: it was faster than that");
        let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, [name]);
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    }
}
