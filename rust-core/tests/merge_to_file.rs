//! Merges into a file, with what memory does not hold on a disk.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use glam::{DAffine3, DVec3};

use surfrecon::export::{Encoding, Provenance, WriteOptions, write_mesh};
use surfrecon::geom::bvh::Bvh;
use surfrecon::memory_folder::MemoryFolder;
use surfrecon::merge::{self, MergeParams, MergeReport, ScanSource};
use surfrecon::mesh::shapes::Shape;
use surfrecon::scan::{ScanParams, TurntableViews, bounds, scan, turntable};
use surfrecon::{Error, IntoFile, Progress, RangeImage, merge_to_file};

fn scans() -> Vec<RangeImage> {
    let shape = Shape::Torus { major: 1.0, minor: 0.3 }.mesh(40);
    let tree = Bvh::build(&shape.positions, &shape.triangles, 0).unwrap();
    let table = TurntableViews { around: 5, above: 1, below: 1, pixels: 90, ..TurntableViews::default() };
    let noisy = ScanParams { noise: 0.002, ..ScanParams::default() };
    let cameras = turntable(bounds(&shape.positions).unwrap(), &table, &Progress::none()).unwrap();
    cameras.iter().map(|camera| scan(&shape, &tree, camera, &noisy, &Progress::none()).unwrap()).collect()
}

fn sources(scans: &[RangeImage]) -> Vec<&dyn ScanSource> {
    scans.iter().map(|scan| scan as &dyn ScanSource).collect()
}

/// Two threads, with as little memory as they do with: blocks of two bricks.
fn least(workspace: &Path) -> IntoFile {
    let max_memory = Some(2 * merge::out_of_core::LEAST);
    IntoFile { max_memory, workspace: Some(workspace.to_owned()), ..IntoFile::default() }
}

fn params() -> MergeParams {
    MergeParams { voxel: Some(0.012), threads: 2, ..MergeParams::default() }
}

/// A few triangles of a ground, as one of very many sees it.
struct Tiny {
    name: String,
    at: [u32; 2],
}

impl ScanSource for Tiny {
    fn name(&self) -> &str {
        &self.name
    }

    fn load(&self, _: &merge::Loading, _: &Progress<'_>) -> surfrecon::Result<merge::OrientedSurface> {
        // Patches of three by three vertices overlap by half.
        let corner = |k: u32| {
            let [x, y] = [k % 3, k / 3].map(f64::from);
            let [x, y] = [f64::from(self.at[0]) + x, f64::from(self.at[1]) + y];
            DVec3::new(x, y, 0.3 * (0.1 * x).sin() * (0.13 * y).cos() + 0.41)
        };
        let cells = [0, 1, 3, 4];
        let triangles = cells.iter().flat_map(|&k| [[k, k + 1, k + 4], [k, k + 4, k + 3]]).collect();
        let mesh = surfrecon::TriMesh::new((0..9).map(corner).collect(), triangles);
        merge::OrientedSurface::from_mesh(&mesh, DAffine3::IDENTITY)
    }
}

#[test]
fn a_hundred_thousand_scans_of_a_few_samples() {
    const WIDE: u32 = 400;
    let scans: Vec<Tiny> = (0..100_000).map(|k| Tiny { name: format!("{k:06}"), at: [k % WIDE, k / WIDE] }).collect();
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let (folder, workspace) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let params = MergeParams { voxel: Some(1.9), threads: 2, ..MergeParams::default() };
    let merged = merge::merge(&sources, &params, merge::Run::default(), &Progress::none()).unwrap();
    assert!(merged.mesh.triangles.len() > 30_000);
    let at_once = folder.path().join("at once.ply");
    write_mesh(&at_once, &merged.mesh, &[], &WriteOptions::default(), &Progress::none()).unwrap();
    let path = folder.path().join("in pieces.ply");
    let into = IntoFile { keep: true, ..least(workspace.path()) };
    for _ in 0..2 {
        merge_to_file(&sources, &path, &params, &into, &Progress::none()).unwrap();
        assert!(std::fs::read(&path).unwrap() == std::fs::read(&at_once).unwrap());
        // No file for each of them.
        let kept = workspace.path().join(&names(workspace.path())[0]);
        assert!(names(&kept).len() < 2_000, "{}", names(&kept).len());
    }
}

#[test]
fn what_is_kept_serves_the_next_merge() {
    let mut scans = scans();
    // Two of one name and content are two scans.
    scans.push(scans[0].clone());
    let (folder, workspace) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = folder.path().join("surface.ply");
    let run = |scans: &[RangeImage], keep: bool| {
        let into = IntoFile { keep, ..least(workspace.path()) };
        merge_to_file(&sources(scans), &path, &params(), &into, &Progress::none()).unwrap();
        std::fs::read(&path).unwrap()
    };
    let tiles = || {
        let kept = names(workspace.path());
        assert_eq!(kept.len(), 1, "{kept:?}");
        let files = names(&workspace.path().join(&kept[0]));
        assert!(files.iter().all(|name| !name.starts_with("done-")), "{files:?}");
        files.into_iter().filter(|name| name.starts_with("tile-")).collect::<std::collections::BTreeSet<_>>()
    };
    let expected = run(&scans, false);
    assert!(names(workspace.path()).is_empty());
    assert!(run(&scans, true) == expected);
    let before = tiles();
    assert!(run(&scans, true) == expected && tiles() == before);
    scans[3].world_from_sensor.translation.z += 0.002;
    scans.pop();
    assert!(run(&scans, true) == run(&scans, false));
    assert!(!tiles().is_empty());
    // Cancelled it leaves what it had, and no file.
    std::fs::remove_file(&path).unwrap();
    scans[2].world_from_sensor.translation.z += 0.002;
    let into = IntoFile { keep: true, ..least(workspace.path()) };
    let cancelled = merge_to_file(&sources(&scans), &path, &params(), &into, &Progress::cancel_after(40));
    assert!(matches!(cancelled, Err(Error::Cancelled)) && !path.exists());
    assert!(run(&scans, true) == run(&scans, false));
    let nowhere = IntoFile { keep: true, ..IntoFile::default() };
    let refused = merge_to_file(&sources(&scans), &path, &params(), &nowhere, &Progress::none()).unwrap_err();
    assert_eq!(refused.to_string(), "what is kept needs a workspace: give a folder");
}

fn names(folder: &Path) -> Vec<String> {
    std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn the_file_is_the_one_that_merging_and_writing_make() {
    let scans = scans();
    let merged = merge::merge(&sources(&scans), &params(), merge::Run::default(), &Progress::none()).unwrap();
    assert!(merged.report.grid.iter().max().unwrap() > &(4 * 32), "{:?}", merged.report.grid);
    let folder = tempfile::tempdir().unwrap();
    let [at_once, in_pieces] = ["at once.ply", "in pieces.ply"].map(|name| folder.path().join(name));
    let provenance = Some(Provenance::from_json("{\"command\": \"merge\"}").unwrap());
    for encoding in [Encoding::Binary, Encoding::BinaryDouble] {
        let write = WriteOptions { encoding, provenance: provenance.clone(), ..WriteOptions::default() };
        write_mesh(&at_once, &merged.mesh, &[], &write, &Progress::none()).unwrap();
        let workspace = tempfile::tempdir().unwrap();
        for into in [least(workspace.path()), IntoFile::default()] {
            let into = IntoFile { write: write.clone(), ..into };
            let report = merge_to_file(&sources(&scans), &in_pieces, &params(), &into, &Progress::none()).unwrap();
            assert!(std::fs::read(&in_pieces).unwrap() == std::fs::read(&at_once).unwrap());
            let figures = |of: &MergeReport| (of.faces, of.holes, of.shortest_edge);
            assert_eq!(figures(&report), figures(&merged.report));
            assert!(names(workspace.path()).is_empty() && names(folder.path()).len() == 2);
        }
    }
}

#[test]
fn what_can_not_be_is_refused_before_the_work() {
    let scans = scans();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("surface.ply");
    let refused = |path: &Path, into: &IntoFile| {
        let error = merge_to_file(&sources(&scans), path, &params(), into, &Progress::none()).unwrap_err();
        assert!(names(folder.path()).is_empty());
        error
    };
    let text = refused(&folder.path().join("surface.glb"), &IntoFile::default()).to_string();
    assert!(text.ends_with("surface.glb: only .ply is written piece by piece: choose such a name"), "{text}");
    let write = WriteOptions { encoding: Encoding::Ascii, ..WriteOptions::default() };
    let text = refused(&path, &IntoFile { write, ..IntoFile::default() }).to_string();
    assert!(text.contains("must be binary, got the encoding \"ascii\""), "{text}");
    let text = refused(&path, &least(&folder.path().join("none"))).to_string();
    assert!(text.ends_with("none: the workspace must be a folder that exists"), "{text}");
    let little = IntoFile { max_memory: Some(1_000_000), ..IntoFile::default() };
    let error = refused(&path, &little);
    let wanted = "not enough memory: merging into a file needs 24 MB at least, 12 MB for each of 2 threads, 1 MB are given: \
                  allow more, or fewer threads";
    assert!(matches!(error, Error::OutOfMemory(_)) && error.to_string() == wanted, "{error}");
    let memory = MemoryFolder::new();
    let text = refused(&memory.path("surface.ply").unwrap(), &IntoFile::default()).to_string();
    assert!(text.ends_with("a file in memory has no folder to work in: give a workspace"), "{text}");
    assert!(refused(&folder.path().join("none/surface.ply"), &IntoFile::default()).to_string().contains("no folder"));
}

#[test]
fn cancelled_anywhere_it_leaves_nothing() {
    let scans = scans();
    let (folder, workspace) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let path = folder.path().join("surface.ply");
    let params = MergeParams { voxel: Some(0.05), ..params() };
    let mut checks = 0;
    loop {
        let progress = Progress::cancel_after(checks);
        match merge_to_file(&sources(&scans), &path, &params, &least(workspace.path()), &progress) {
            Err(Error::Cancelled) => assert!(names(folder.path()).is_empty() && names(workspace.path()).is_empty()),
            Ok(_) => break,
            Err(other) => panic!("{other}"),
        }
        checks += 1 + checks / 4;
    }
    assert!(checks > 100 && names(folder.path()) == ["surface.ply"] && names(workspace.path()).is_empty(), "{checks}");
}

#[test]
fn what_is_read_is_never_written_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let meshes = [Shape::Sphere { radius: 1.0 }, Shape::Torus { major: 1.0, minor: 0.3 }].map(|shape| shape.mesh(20));
    for (name, mesh) in ["first.ply", "second.ply"].iter().zip(&meshes) {
        write_mesh(&path(name), mesh, &[], &WriteOptions::default(), &Progress::none()).unwrap();
    }
    let set = surfrecon::import::open_many(&[path("first.ply"), path("second.ply")]).unwrap();
    let sources: Vec<&dyn ScanSource> = set.scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let before = std::fs::read(path("second.ply")).unwrap();
    let (other, params) = (folder.path().join(".").join("second.ply"), MergeParams { voxel: Some(0.1), ..params() });
    for output in [path("second.ply"), other] {
        let refused = merge_to_file(&sources, &output, &params, &IntoFile::default(), &Progress::none()).unwrap_err();
        let expected = "scan second is read from it: give the output another name";
        assert!(refused.to_string().ends_with(expected), "{refused}");
    }
    assert!(std::fs::read(path("second.ply")).unwrap() == before);
    merge_to_file(&sources, &path("third.ply"), &params, &IntoFile::default(), &Progress::none()).unwrap();
}
