//! `SURFRECON_DUMP`: what the stages of the operations leave to look at.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

use surfrecon::mesh::dump::VARIABLE;
use surfrecon::range_image::Projection;
use surfrecon::scan::shapes::Shape;
use surfrecon::{PointCloud, Progress, RangeImage, cluster, merge, quads, reconstruct, sculpt};

/// Whether this is the test run once more, with the variable set.
const AGAIN: &str = "SURFRECON_TEST_DUMPS";

/// Every operation once. Returns what it says if it fails.
fn operations() -> surfrecon::Result<()> {
    let none = Progress::none();
    let heights = (0..40 * 40).map(|i| f64::from(i % 40) * f64::from(i / 40) / 40.0).collect();
    let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0; 2] };
    let image = RangeImage::from_values(40, 40, heights, projection)?;
    merge::merge(&[&image], &merge::MergeParams::default(), merge::Run::default(), &none)?;
    sculpt::run(&image, &sculpt::SculptParams::default(), &none)?;
    quads::run(&image, &quads::QuadParams::default(), &none)?;
    let sphere = Shape::Sphere { radius: 1.0 }.mesh(8);
    reconstruct::run(
        &PointCloud { positions: sphere.positions.clone(), ..PointCloud::default() },
        &reconstruct::ReconstructParams::default(),
        &none,
    )?;
    cluster::run(&sphere, &cluster::ClusterParams::default(), &none)?;
    Ok(())
}

fn again(test: &str, folder: &Path) -> Output {
    let program = std::env::current_exe().unwrap();
    Command::new(program).args([test, "--exact", "--nocapture"]).env(AGAIN, "1").env(VARIABLE, folder).output().unwrap()
}

#[test]
fn each_operation_leaves_its_stages() {
    if std::env::var_os(AGAIN).is_some() {
        return operations().unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let ran = again("each_operation_leaves_its_stages", folder.path());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    for stage in [
        "merge-1-crossings",
        "merge-2-labels",
        "merge-3-parts",
        "sculpt-1-dug",
        "sculpt-2-polished",
        "quads-1-grid",
        "reconstruct-1-cells",
        "cluster-1-patches",
        "cluster-2-fans",
    ] {
        let bytes = std::fs::read(folder.path().join(format!("{stage}.ply"))).expect(stage);
        let header = String::from_utf8_lossy(&bytes[..bytes.len().min(400)]).into_owned();
        let vertices = header.lines().find_map(|line| line.strip_prefix("element vertex ")).expect(stage);
        assert!(vertices.parse::<usize>().unwrap() >= 10, "{stage}: {vertices} vertices");
    }
}

#[test]
#[cfg(unix)]
fn a_pipe_in_its_place_is_left_alone() {
    if std::env::var_os(AGAIN).is_some() {
        let error = operations().unwrap_err().to_string();
        assert!(error.contains("merge-1-crossings.ply can't be written (this is no regular file"), "{error}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("merge-1-crossings.ply");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let ran = again("a_pipe_in_its_place_is_left_alone", folder.path());
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert!(!pipe.metadata().unwrap().is_file() && std::fs::read_dir(folder.path()).unwrap().count() == 1);
}

#[test]
fn a_folder_that_is_not_there_is_said() {
    if std::env::var_os(AGAIN).is_some() {
        let error = operations().unwrap_err().to_string();
        assert!(error.contains(VARIABLE) && error.contains("merge-1-crossings.ply"), "{error}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let ran = again("a_folder_that_is_not_there_is_said", &folder.path().join("nowhere"));
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    assert!(!folder.path().join("nowhere").exists());
}
