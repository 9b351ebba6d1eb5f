//! The same bytes in files as in memory.

use std::borrow::Cow;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use glam::{DAffine3, DVec3};
use proptest::prelude::*;

use super::setting::{Cut, Setting};
use super::{Keep, Tasks, Workspace, kept_folder, merge, run};
use crate::intake::setup::Setup;
use crate::tests::closing::WINDOW;
use crate::tests::{by_setup, clean_scans, scans, scans_with};
use crate::visibility::tests::{BOX, CELL, FLOOR, cuboids, frames};
use crate::{MergeParams, Merged, PlacedMesh, ScanSource};
use base::error::Error;
use base::progress::Progress;
use close::Openings;
use image::RangeImage;
use mesh::TriMesh;
use scan::{ScanParams, shapes::Shape};

mod corners;
mod kept;

/// The merge without the memory held and the time, which may differ.
fn without_cost(mut merged: Merged) -> Merged {
    (merged.report.seconds, merged.report.working_bytes) = Default::default();
    merged
}

fn in_memory(sources: &[&dyn ScanSource], params: &MergeParams, kept: u64) -> Merged {
    let setup = Setup { kept, ..Setup::default() };
    without_cost(by_setup(sources, params, &setup, &Progress::none()).unwrap())
}

fn in_files(sources: &[&dyn ScanSource], params: &MergeParams, side: i32, held: u64, kept: u64) -> Merged {
    let folder = tempfile::tempdir().unwrap();
    let setting = Setting {
        folder: folder.path(),
        cut: Cut { side },
        held,
        memory: 1 << 30,
        kept,
        corner: [0; 3],
        stays: false,
        has_all: true,
    };
    // Of those who vote as many are loaded at a time as there are threads, and more only if they may be held.
    let pool = base::threads::pool(if held == 0 { 1 } else { 3 }).unwrap();
    let mut mesh = TriMesh::default();
    // The work of a stage is one task, or cut into several.
    let tasks =
        Tasks { sources, versions: super::places(sources), params, setting, portions: if held == 0 { 3 } else { 1 } };
    let report = pool.install(|| merge(tasks, &mut mesh, &Progress::none())).unwrap();
    without_cost(Merged { mesh, report })
}

fn same_in_files(scans: &[RangeImage], params: &MergeParams) -> Merged {
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let mut whole = Merged::default();
    for kept in [u64::MAX, 0] {
        whole = in_memory(&sources, params, kept);
        for (side, held) in [(2, 1 << 16), (3, 0), (64, 1 << 28)] {
            let found = in_files(&sources, params, side, held, kept);
            assert_eq!(found.report, whole.report, "blocks of {side}, {held} bytes held, {kept} kept");
            assert!(found == whole, "blocks of {side}, {held} bytes held, {kept} kept");
        }
    }
    whole
}

#[test]
fn clean_and_noisy_scans_are_the_same_in_files() {
    let shape = Shape::Torus { major: 1.0, minor: 0.3 };
    for scans in [scans(shape, 100), clean_scans(shape, 100)] {
        let found = same_in_files(&scans, &MergeParams { voxel: Some(0.02), ..MergeParams::default() });
        assert!(found.mesh.triangles.len() > 10_000);
    }
}

#[test]
fn what_scans_see_through_is_the_same_in_files() {
    // A box stood there for a quarter of the frames.
    let scene = |k: usize| if k % 4 == 1 { cuboids(&[FLOOR, BOX]) } else { cuboids(&[FLOOR]) };
    let found =
        same_in_files(&frames(8, [0.0; 2], scene), &MergeParams { voxel: Some(CELL), ..MergeParams::default() });
    assert!(found.report.seen_through > 100, "{}", found.report.seen_through);
}

#[test]
fn what_is_closed_is_the_same_in_files() {
    let frames = frames(6, [0.0; 2], |_| cuboids(&WINDOW));
    for close in [Openings::All, Openings::Seen, Openings::Holes] {
        let params = MergeParams { voxel: Some(CELL), close, max_hole_length: Some(4.0), ..MergeParams::default() };
        let found = same_in_files(&frames, &params);
        assert!(found.report.faces[2] > 0, "{close:?}");
        assert!(found.report.holes_seen_through > 0 || close != Openings::Holes, "{close:?}");
    }
}

#[test]
fn parts_that_go_are_the_same_in_files() {
    let apart = ScanParams { noise: 0.02, pose_shift: 0.03, ..ScanParams::default() };
    let scans = scans_with(Shape::Sphere { radius: 1.0 }, 50, &apart);
    let shares: &[f64] = if base::tier::is_thorough() { &[0.0, 0.01] } else { &[0.01] };
    for &share in shares {
        let params = MergeParams {
            voxel: Some(0.015),
            merge_distance: Some(0.015),
            min_component_share: share,
            ..MergeParams::default()
        };
        let found = same_in_files(&scans, &params);
        assert!(found.report.dropped_components[0] > 10, "{:?}", found.report.dropped_components);
    }
}

#[test]
fn neither_threads_nor_order_nor_base_matter() {
    let mut scans = scans(Shape::Sphere { radius: 1.0 }, 60);
    let params = MergeParams { voxel: Some(0.031), ..MergeParams::default() };
    let by = |scans: &[RangeImage], threads: usize, corner: [i64; 3]| {
        let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
        let folder = tempfile::tempdir().unwrap();
        let setting = Setting {
            folder: folder.path(),
            cut: Cut { side: 1 },
            held: 1 << 14,
            memory: 1 << 30,
            kept: 0,
            corner,
            stays: false,
            has_all: true,
        };
        let mut mesh = TriMesh::default();
        let pool = base::threads::pool(threads).unwrap();
        let tasks = Tasks {
            sources: &sources,
            versions: super::places(&sources),
            params: &params,
            setting,
            portions: threads as u32,
        };
        pool.install(|| merge(tasks, &mut mesh, &Progress::none())).unwrap();
        mesh
    };
    // Its middle is the corner of eight blocks.
    let found = by(&scans, 1, [0; 3]);
    assert!(found.triangles.len() > 5_000);
    assert!(by(&scans, 2, [0; 3]) == found);
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    assert!(in_memory(&sources, &params, 0).mesh == found);
    scans.reverse();
    assert!(by(&scans, 3, [0; 3]) == found);
    // Whole bricks keep their order; else only that follows the base.
    assert!(by(&scans, 2, [32, -64, 1 << 24]) == found);
    let corners = |mesh: &TriMesh| {
        let at = |v: u32| mesh.positions[v as usize].to_array().map(f64::to_bits);
        let mut list: Vec<_> = mesh.triangles.iter().map(|t| t.map(at)).collect();
        list.sort_unstable();
        list
    };
    assert!(corners(&by(&scans, 2, [5, -7, 11])) == corners(&found));
}

#[test]
fn a_plane_that_grazes_the_lines_is_the_same_in_files() {
    for slope in [0.0, 1e-3, 0.01] {
        let corner = |x: f64, y: f64| DVec3::new(x, y, slope * x + 1e-4 * y);
        let positions = vec![corner(-90.0, -40.0), corner(110.0, -40.0), corner(110.0, 70.0), corner(-90.0, 70.0)];
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]);
        let placed = PlacedMesh { name: "plane".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
        let params = MergeParams { voxel: Some(1.0), ..MergeParams::default() };
        let whole = in_memory(&[&placed], &params, u64::MAX);
        assert!(whole.mesh.triangles.len() > 20_000);
        for side in [1, 2] {
            assert!(in_files(&[&placed], &params, side, 0, u64::MAX) == whole, "{slope}: blocks of {side}");
        }
    }
}

#[test]
fn nothing_is_left_of_a_merge_that_is_cancelled_or_fails() {
    let scans = scans(Shape::Sphere { radius: 1.0 }, 40);
    let mut sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let params = MergeParams { voxel: Some(0.05), threads: 2, ..MergeParams::default() };
    let folder = tempfile::tempdir().unwrap();
    let workspace = Workspace { folder: folder.path(), memory: 1 << 26, kept: None };
    for checks in [0, 3, 30, 100, 300] {
        let mut mesh = TriMesh::default();
        let found = run(&sources, &params, workspace, &mut mesh, &Progress::cancel_after(checks));
        assert!(matches!(found, Err(Error::Cancelled)), "{checks}");
        assert_eq!(folder.path().read_dir().unwrap().count(), 0, "{checks}");
    }
    struct Missing;
    impl ScanSource for Missing {
        fn name(&self) -> &str {
            "missing"
        }
        fn load(&self, _: &crate::Loading, _: &Progress<'_>) -> base::error::Result<crate::OrientedSurface> {
            Err(Error::input("missing: gone"))
        }
    }
    sources.push(&Missing);
    let found = run(&sources, &params, workspace, &mut TriMesh::default(), &Progress::none());
    assert_eq!(found.unwrap_err().to_string(), "missing: gone");
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    let tight = Workspace { memory: 1 << 20, ..workspace };
    let found = run(&sources[..5], &params, tight, &mut TriMesh::default(), &Progress::none());
    assert!(found.unwrap_err().to_string().contains("not enough memory: scans of "));
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
    let nowhere = folder.path().join("nowhere");
    let found = run(
        &sources[..5],
        &params,
        Workspace { folder: &nowhere, ..workspace },
        &mut TriMesh::default(),
        &Progress::none(),
    );
    assert!(found.unwrap_err().to_string().starts_with(nowhere.to_str().unwrap()));
}

/// Scans that count how often they are loaded.
struct Counted<'a>(&'a dyn ScanSource, &'a AtomicU32);

impl ScanSource for Counted<'_> {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn load(&self, loading: &crate::Loading, progress: &Progress<'_>) -> base::error::Result<crate::OrientedSurface> {
        self.1.fetch_add(1, Relaxed);
        self.0.load(loading, progress)
    }
    fn image(&self, progress: &Progress<'_>) -> base::error::Result<Option<Cow<'_, RangeImage>>> {
        self.0.image(progress)
    }
}

#[test]
fn a_merge_that_is_stopped_goes_on_from_what_is_complete() {
    let scans = scans(Shape::Torus { major: 1.0, minor: 0.3 }, 70);
    let loaded = AtomicU32::new(0);
    let counted: Vec<Counted<'_>> = scans.iter().map(|scan| Counted(scan, &loaded)).collect();
    let sources: Vec<&dyn ScanSource> = counted.iter().map(|scan| scan as &dyn ScanSource).collect();
    // A segment for each scan, and blocks of few bricks.
    let params = MergeParams { voxel: Some(0.02), threads: 2, ..MergeParams::default() };
    let whole = in_memory(&sources, &params, u64::MAX);
    let folder = tempfile::tempdir().unwrap();
    let beside = folder.path().join("somebody's");
    std::fs::write(&beside, "else").unwrap();
    let versions: Vec<u64> = (7..7 + scans.len() as u64).collect();
    let kept = Some(Keep { versions: &versions, stays: false });
    let workspace = Workspace { folder: folder.path(), memory: 6 << 20, kept };
    let go_on = |checks: u64| {
        let mut mesh = TriMesh::default();
        let progress = Progress::cancel_after(checks);
        run(&sources, &params, workspace, &mut mesh, &progress).map(|report| without_cost(Merged { mesh, report }))
    };
    loaded.store(0, Relaxed);
    let (mut stops, mut checks) = (0, 40);
    let found = loop {
        match go_on(checks) {
            Ok(found) => break found,
            Err(Error::Cancelled) => (stops, checks) = (stops + 1, checks + 40),
            Err(error) => panic!("{error}"),
        }
    };
    assert_eq!(found.report, whole.report);
    assert!(found == whole);
    assert!(stops > 5, "{stops}");
    // The first is loaded each time; of the others each once, and once more what a stop found in a thread's hands.
    let again = loaded.load(Relaxed) - stops - 1;
    assert!(again <= scans.len() as u32 + params.threads as u32 * stops, "{again} loads, {stops} stops");
    assert_eq!(std::fs::read(&beside).unwrap(), b"else");
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);

    // A damaged file is told; two are not at work at once.
    let left = || folder.path().read_dir().unwrap().map(|file| file.unwrap().path()).find(|path| path.is_dir());
    let segment = || {
        let mut files = left()?.read_dir().unwrap().map(|file| file.unwrap().path());
        files.find(|path| path.file_name().unwrap().to_str().unwrap().starts_with("segment-"))
    };
    let is_stopped_with = |checks| go_on(checks).is_err() && segment().is_some();
    assert!((1..100).any(|checks| is_stopped_with(10 * checks)));
    let lock = kept_folder(folder.path(), &params).unwrap().lock;
    let text = go_on(u64::MAX).unwrap_err().to_string();
    assert!(text.contains("another merge is at work"), "{text}");
    drop(lock);
    let segment = segment().unwrap();
    let mut bytes = std::fs::read(&segment).unwrap();
    bytes[5] ^= 1;
    std::fs::write(&segment, bytes).unwrap();
    let text = go_on(u64::MAX).unwrap_err().to_string();
    assert!(text.contains("segment-") && text.contains("is damaged"), "{text}");
}

#[test]
fn holes_and_colours_nobody_has_are_the_same_in_files() {
    // Scans off their places have ragged borders, between which holes are stuck; beside the shape lies one without colours.
    let shifted = ScanParams { noise: 0.004, pose_shift: 0.02, ..ScanParams::default() };
    let mut scans = scans_with(Shape::Torus { major: 1.0, minor: 0.3 }, 90, &shifted);
    scans.iter_mut().step_by(2).for_each(|scan| scan.colour = None);
    let mut beside = scans_with(Shape::Sphere { radius: 0.4 }, 60, &shifted);
    for scan in &mut beside {
        scan.name.insert_str(0, "beside");
        scan.world_from_sensor.translation += DVec3::X * 3.0;
        scan.colour = None;
    }
    scans.append(&mut beside);
    for share in [0.0, 0.02] {
        let params = MergeParams {
            voxel: Some(0.025),
            merge_distance: Some(0.05),
            max_hole_length: Some(2.0),
            min_component_share: share,
            ..MergeParams::default()
        };
        let found = same_in_files(&scans, &params);
        assert!(found.report.holes[0] > 1, "{:?}", found.report);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(10)))]
    // Whole numbers put vertices into nodes, and many triangles through an edge make pinches.
    #[test]
    fn soups_of_triangles_are_the_same_in_files(
        corners in prop::collection::vec(prop::array::uniform3(-50..50_i32), 60..120),
        halves in any::<bool>(),
        share in prop::sample::select(vec![0.0, 0.1]),
    ) {
        let unit = if halves { 0.5 } else { 0.37 };
        let positions: Vec<DVec3> = corners.iter().map(|c| DVec3::from_array(c.map(|x| f64::from(x) * unit))).collect();
        let triangles = (0..positions.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let mesh = TriMesh::new(positions, triangles);
        let placed = PlacedMesh { name: "soup".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
        let params = MergeParams { voxel: Some(1.0), min_component_share: share, ..MergeParams::default() };
        let whole = in_memory(&[&placed], &params, u64::MAX);
        for side in 1..=5 {
            prop_assert!(in_files(&[&placed], &params, side, 0, u64::MAX) == whole, "blocks of {side}");
        }
    }
}
