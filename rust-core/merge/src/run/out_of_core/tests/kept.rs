//! Workspaces that are kept: scans come and go, and the bytes are those of a first merge.

use std::collections::BTreeSet;

use rustc_hash::FxHashSet;

use super::*;
use crate::crossings::scan_order::ScanOrder;

/// Two shapes apart, each seen by nine scans.
fn two_shapes() -> Vec<RangeImage> {
    let mut all = scans(Shape::Torus { major: 1.0, minor: 0.3 }, 50);
    let mut beside = scans(Shape::Sphere { radius: 0.8 }, 50);
    for scan in &mut beside {
        scan.name.insert_str(0, "tail");
        scan.world_from_sensor.translation += DVec3::X * 4.0;
    }
    all.append(&mut beside);
    all
}

/// Number of blocks of two bricks that have a brick that a sample of a scan lies in, within a cell, or at most so many beside one.
fn blocks_near(scan: &RangeImage, voxel: f64, reach: i64) -> usize {
    let loading = crate::Loading { triangulation: Default::default(), cell: voxel };
    let surface = scan.load(&loading, &Progress::none()).unwrap();
    let brick = |p: DVec3, i: usize| {
        let by = [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { -1.0 } else { 1.0 });
        (p / voxel + DVec3::from_array(by)).floor().as_i64vec3().to_array().map(|at| at.div_euclid(32))
    };
    let places = surface.positions.iter().map(|&p| surface.world_from_surface.transform_point3(p));
    let bricks: FxHashSet<[i64; 3]> = places.flat_map(|p| (0..8).map(move |i| brick(p, i))).collect();
    let wide = 2 * reach + 1;
    let beside = |at: [i64; 3], i: i64| {
        let by = [i % wide, i / wide % wide, i / (wide * wide)];
        [0, 1, 2].map(|axis| (at[axis] + by[axis] - reach).div_euclid(2))
    };
    let blocks = bricks.into_iter().flat_map(|at| (0..wide.pow(3)).map(move |i| beside(at, i)));
    blocks.collect::<FxHashSet<_>>().len()
}

#[test]
fn scans_come_and_go_and_what_they_have_no_part_in_stays() {
    let loaded = AtomicU32::new(0);
    let kinds = [(true, 0), (false, 60_000), (false, u64::MAX)];
    let count = if base::tier::is_thorough() { kinds.len() } else { 1 };
    for (match_exposure, kept) in kinds.into_iter().take(count) {
        let mut scans: Vec<(u64, RangeImage)> = (100..).zip(two_shapes()).collect();
        let params = MergeParams {
            voxel: Some(0.02),
            merge_distance: Some(0.04),
            match_exposure,
            threads: 2,
            ..MergeParams::default()
        };
        let folder = tempfile::tempdir().unwrap();
        let names = |kind: &str| {
            let files = folder.path().read_dir().unwrap().map(|file| file.unwrap().file_name().into_string().unwrap());
            files.filter(|name| name.starts_with(kind)).collect::<BTreeSet<_>>()
        };
        let run = |scans: &[(u64, RangeImage)], portions: u32| {
            let counted: Vec<Counted<'_>> = scans.iter().map(|scan| Counted(&scan.1, &loaded)).collect();
            let sources: Vec<&dyn ScanSource> = counted.iter().map(|scan| scan as &dyn ScanSource).collect();
            let setting = Setting {
                folder: folder.path(),
                cut: Cut { side: 2 },
                // A segment a scan.
                held: 0,
                memory: 1 << 30,
                kept,
                corner: [0; 3],
                stays: true,
                has_all: true,
            };
            let versions = scans.iter().map(|scan| scan.0).collect();
            let tasks = Tasks { sources: &sources, versions, params: &params, setting, portions };
            tasks.begin().unwrap();
            loaded.store(0, Relaxed);
            let mut mesh = TriMesh::default();
            let pool = base::threads::pool(2).unwrap();
            let report = pool.install(|| merge(tasks, &mut mesh, &Progress::none())).unwrap();
            let loads = loaded.load(Relaxed);
            assert!(without_cost(Merged { mesh, report }) == in_memory(&sources, &params, kept), "{loads} loads");
            assert!(names("done-").is_empty() && names("unfinished").is_empty());
            loads
        };
        let all = scans.len() as u32;
        assert_eq!(run(&scans, 1), all + 1);
        let before = [names("tile"), names("labels"), names("block"), names("votes"), names("segment")];
        // The same again: the first is loaded to see where it lies.
        assert_eq!(run(&scans, 3), 1);
        assert_eq!([names("tile"), names("labels"), names("block"), names("votes"), names("segment")], before);

        // One of the second shape is moved.
        scans[12].1.world_from_sensor.translation.z += 0.03;
        scans[12].0 = 1;
        assert_eq!(run(&scans, 1), 2);
        let new = |kind: &str, before: &BTreeSet<String>| {
            let now = names(kind);
            (now.difference(before).count(), now.len())
        };
        let (renewed, of) = new("segment", &before[4]);
        assert_eq!((renewed, of), (1, scans.len()));
        let (renewed, of) = new("block", &before[2]);
        assert!(0 < renewed && 3 * renewed < of, "{renewed} of {of} blocks");
        if !match_exposure {
            let (renewed, of) = new("tile", &before[0]);
            assert!(0 < renewed && 2 * renewed <= of, "{renewed} of {of} tiles");
        }

        // The last one goes, others come behind it, one in the middle goes and comes again.
        let last = scans.pop().unwrap();
        // Fewer crossings, and those of some scans have to be seen again.
        let is_sampled = kept == 60_000;
        assert!(run(&scans, 1) == 1 || is_sampled);
        let mut another = last.1.clone();
        another.name.push_str(" again");
        another.world_from_sensor.translation.y += 0.01;
        scans.push((2, another));
        assert!(run(&scans, 2) == 2 || is_sampled);
        for place in [4, 0, 12] {
            let before = [names("segment"), names("block"), names("labels"), names("tile")];
            let gone = scans.remove(place);
            assert!(run(&scans, 1) == 1 || is_sampled, "without {place}");
            let [segments, blocks, labels, tiles] = before;
            assert!(is_sampled || new("segment", &segments) == (0, scans.len()));
            // Those that the scan lies in; labels follow what is a brick beside them, tiles labels two bricks beside them.
            let touched = [0, 1, 3].map(|reach| blocks_near(&gone.1, 0.02, reach));
            for (kind, before, touched) in
                [("block", blocks, touched[0]), ("labels", labels, touched[1]), ("tile", tiles, touched[2])]
            {
                let (renewed, of) = new(kind, &before);
                // How bright other scans are follows from all.
                let is_bound = !is_sampled && (kind == "block" || !match_exposure);
                assert!(!is_bound || renewed <= touched, "{renewed} of {of} {kind} for {touched} without {place}");
                assert!(touched < of, "{touched} of {of} {kind} without {place}");
            }
            scans.insert((place + 5) % scans.len(), gone);
            assert!(run(&scans, 1) <= 2 || is_sampled, "{place} again");
        }
        // So many go that overlaps are measured by all crossings again.
        scans.truncate(2);
        run(&scans, 2);
        scans.push(last);
        run(&scans, 1);
        // Findings about scans are of no use in other cells.
        let voxel = Some(0.03);
        let params = MergeParams { voxel, ..params };
        let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| &scan.1 as &dyn ScanSource).collect();
        let versions: Vec<u64> = scans.iter().map(|scan| scan.0).collect();
        let kept = Some(Keep { versions: &versions, stays: true });
        let workspace = Workspace { folder: folder.path(), memory: 1 << 30, kept };
        let mut mesh = TriMesh::default();
        super::run(&sources, &params, workspace, &mut mesh, &Progress::none()).unwrap();
        assert!(mesh == in_memory(&sources, &params, u64::MAX).mesh);
    }
}

#[test]
fn what_another_version_has_kept_is_refused() {
    let scans = scans(Shape::Sphere { radius: 1.0 }, 30);
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let versions: Vec<u64> = (0..9).collect();
    let folder = tempfile::tempdir().unwrap();
    let kept = Some(Keep { versions: &versions, stays: true });
    let workspace = Workspace { folder: folder.path(), memory: 1 << 30, kept };
    let params = MergeParams { voxel: Some(0.1), ..MergeParams::default() };
    let merged = || run(&sources, &params, workspace, &mut TriMesh::default(), &Progress::none());
    merged().unwrap();
    let own = folder.path().read_dir().unwrap().next().unwrap().unwrap().path();
    let left = || own.read_dir().unwrap().map(|file| file.unwrap().file_name()).collect::<BTreeSet<_>>();
    let before = left();
    std::fs::write(own.join("version"), "0.0.1").unwrap();
    let text = merged().unwrap_err().to_string();
    let here = env!("CARGO_PKG_VERSION");
    assert!(text.contains(&format!("surfrecon 0.0.1, which {here} does not go on with: remove the folder")), "{text}");
    assert!(text.starts_with(own.to_str().unwrap()) && left() == before, "{text}");
    std::fs::remove_dir_all(&own).unwrap();
    merged().unwrap();
}

#[test]
fn versions_are_one_a_scan() {
    let scans = scans(Shape::Sphere { radius: 1.0 }, 30);
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let folder = tempfile::tempdir().unwrap();
    let said = |versions: &[u64]| {
        let kept = Some(Keep { versions, stays: true });
        let workspace = Workspace { folder: folder.path(), memory: 1 << 30, kept };
        let params = MergeParams::default();
        run(&sources, &params, workspace, &mut TriMesh::default(), &Progress::none()).unwrap_err().to_string()
    };
    assert_eq!(said(&[1, 2]), "2 versions for 9 scans: give one per scan");
    assert!(said(&[1, 2, 3, 4, 5, 6, 7, 8, 3]).starts_with("two scans have the version 3"));
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);
}

#[test]
fn what_is_refused_leaves_no_folder_and_what_was_begun_stays() {
    let scans = scans(Shape::Sphere { radius: 1.0 }, 30);
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
    let versions: Vec<u64> = (0..9).collect();
    let folder = tempfile::tempdir().unwrap();
    let run = |memory: u64, progress: &Progress<'_>| {
        let kept = Some(Keep { versions: &versions, stays: true });
        let workspace = Workspace { folder: folder.path(), memory, kept };
        let params = MergeParams { voxel: Some(0.05), threads: 1, ..MergeParams::default() };
        run(&sources, &params, workspace, &mut TriMesh::default(), progress)
    };
    let left = || folder.path().read_dir().unwrap().count();
    assert!(matches!(run(1, &Progress::none()), Err(Error::OutOfMemory(_))));
    assert!(run(1 << 30, &Progress::cancel_after(0)).is_err());
    assert_eq!(left(), 0);
    assert!((1..200).any(|checks| run(1 << 30, &Progress::cancel_after(checks)).is_err() && left() == 1));
    run(1 << 30, &Progress::none()).unwrap();
    assert!(matches!(run(1, &Progress::none()), Err(Error::OutOfMemory(_)) | Ok(_)));
    assert_eq!(left(), 1);
}

/// Merges in a folder that has what merges before have left, in small blocks.
fn merged_again(
    folder: &std::path::Path,
    sources: &[&dyn ScanSource],
    versions: Vec<u64>,
    params: &MergeParams,
    side: i32,
) -> Merged {
    let setting = Setting {
        folder,
        cut: Cut { side },
        held: 0,
        memory: 1 << 30,
        kept: u64::MAX,
        corner: [0; 3],
        stays: true,
        has_all: true,
    };
    let tasks = Tasks { sources, versions, params, setting, portions: 1 };
    tasks.begin().unwrap();
    let mut mesh = TriMesh::default();
    let report = merge(tasks, &mut mesh, &Progress::none()).unwrap();
    without_cost(Merged { mesh, report })
}

#[test]
fn what_scans_see_through_is_asked_of_those_and_there_where_it_changed() {
    // A box stands there for a quarter of the frames, and then for another.
    let scene = |k: usize, with: usize| if k % 4 == with { cuboids(&[FLOOR, BOX]) } else { cuboids(&[FLOOR]) };
    let [mut scans, others] = [1, 2].map(|with| frames(8, [0.0; 2], |k| scene(k, with)));
    let params = MergeParams { voxel: Some(CELL), ..MergeParams::default() };
    let mut versions: Vec<u64> = (0..8).collect();
    let folder = tempfile::tempdir().unwrap();
    let mut seen_through = BTreeSet::new();
    for changed in [None, Some(1), Some(2), Some(5), Some(6), Some(0)] {
        if let Some(scan) = changed {
            scans[scan] = others[scan].clone();
            versions[scan] += 100;
        }
        let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
        let found = merged_again(folder.path(), &sources, versions.clone(), &params, 1);
        assert!(found == in_memory(&sources, &params, u64::MAX), "{changed:?}");
        seen_through.insert(found.report.seen_through);
    }
    assert!(seen_through.len() > 2, "{seen_through:?}");
}

#[test]
fn of_a_thousand_scans_one_goes_or_comes_anywhere() {
    // Squares that overlap with those beside them, so many that overlaps are measured between some scans only.
    let (side, loaded) = (40, AtomicU32::new(0));
    let square = |k: usize| {
        let corner = |x: f64, y: f64| {
            DVec3::new((k % side) as f64 * 8.0 + x, (k / side) as f64 * 8.0 + y, 0.01 * (k % 7) as f64)
        };
        let corners = vec![corner(0.1, 0.2), corner(12.1, 0.2), corner(12.1, 12.2), corner(0.1, 12.2)];
        TriMesh::new(corners, vec![[0, 1, 2], [0, 2, 3]])
    };
    let meshes: Vec<TriMesh> = (0..1_100).map(square).collect();
    let placed =
        |k: usize| PlacedMesh { name: format!("{k:04}"), mesh: &meshes[k], world_from_mesh: DAffine3::IDENTITY };
    let scans: Vec<PlacedMesh<&TriMesh>> = (0..meshes.len()).map(placed).collect();
    // One without which the scan after it is looked at for overlaps with the one before it, and else is not.
    let is_sampled = |places: &[usize], k: usize| {
        let sources: Vec<&dyn ScanSource> = places.iter().map(|&place| &scans[place] as &dyn ScanSource).collect();
        let scan_order = ScanOrder::new(&sources, &vec![0; places.len()], &(0..places.len()).collect::<Vec<_>>());
        scan_order.is_sampled(places.iter().position(|&place| place == k).unwrap())
    };
    let all: Vec<usize> = (0..meshes.len()).collect();
    let without = |gone: usize| all.iter().copied().filter(|&k| k != gone).collect::<Vec<_>>();
    let between =
        (300..800).find(|&k| is_sampled(&without(k), k + 1) && !is_sampled(&all, k + 1)).expect("some are like that");
    let counted: Vec<Counted<'_>> = scans.iter().map(|scan| Counted(scan, &loaded)).collect();
    let params = MergeParams { voxel: Some(1.0), max_hole_length: Some(0.0), ..MergeParams::default() };
    let folder = tempfile::tempdir().unwrap();
    let mut here: Vec<usize> = (0..meshes.len()).collect();
    for step in 0..4 {
        match step {
            1 => drop(here.remove(between)),
            2 => drop(here.remove(0)),
            3 => here.insert(700, between),
            _ => {}
        }
        let sources: Vec<&dyn ScanSource> = here.iter().map(|&k| &counted[k] as &dyn ScanSource).collect();
        loaded.store(0, Relaxed);
        let setting = Setting {
            folder: folder.path(),
            cut: Cut { side: 2 },
            // A few scans a segment.
            held: 1 << 15,
            memory: 1 << 30,
            kept: 0,
            corner: [0; 3],
            stays: true,
            has_all: true,
        };
        let versions = here.iter().map(|&k| k as u64).collect();
        let tasks = Tasks { sources: &sources, versions, params: &params, setting, portions: 30 };
        tasks.begin().unwrap();
        let mut mesh = TriMesh::default();
        let report = merge(tasks, &mut mesh, &Progress::none()).unwrap();
        let loads = loaded.load(Relaxed);
        // Beside four that tell how much there is: the one that is new, and those of two segments, of the one that goes and of the one
        // whose overlap with the one before it counts now.
        assert!(step == 0 || loads <= 22, "{loads} loads in step {step}");
        assert!(step < 3 || loads > 5, "{loads} loads in step {step}");
        assert!(report.overlap_residual.is_some());
        assert!(without_cost(Merged { mesh, report }) == in_memory(&sources, &params, 0), "step {step}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(12)))]
    // Scans of a triangle or two, so that what changes lies in a block or two.
    #[test]
    fn soups_of_which_some_is_another(
        corners in prop::collection::vec(prop::array::uniform3(-40..40_i32), 60..90),
        others in prop::collection::vec((any::<prop::sample::Index>(), prop::array::uniform9(-40..40_i32)), 1..4),
        side in 1..4_i32,
    ) {
        let at = |c: &[i32]| DVec3::new(f64::from(c[0]), f64::from(c[1]), f64::from(c[2])) * 0.37;
        let triangle = |corners: Vec<DVec3>| TriMesh::new(corners, vec![[0, 1, 2]]);
        let mut meshes: Vec<TriMesh> =
            corners.chunks_exact(3).map(|c| triangle(c.iter().map(|c| at(c)).collect())).collect();
        let mut versions: Vec<u64> = (0..meshes.len() as u64).collect();
        let params = MergeParams { voxel: Some(1.0), merge_distance: Some(1.0), ..MergeParams::default() };
        let folder = tempfile::tempdir().unwrap();
        for round in 0..=others.len() {
            if round > 0 {
                let (which, corners) = &others[round - 1];
                let place = which.index(meshes.len());
                meshes[place] = triangle(corners.chunks(3).map(at).collect());
                versions[place] += 1000;
            }
            // In each round another is not there.
            let here = || (0..meshes.len()).filter(|place| place % (others.len() + 2) != round);
            let scan = |k: usize| PlacedMesh {
                name: format!("{k:03}"),
                mesh: &meshes[k],
                world_from_mesh: DAffine3::IDENTITY,
            };
            let scans: Vec<PlacedMesh<&TriMesh>> = here().map(scan).collect();
            let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| scan as &dyn ScanSource).collect();
            let versions = here().map(|k| versions[k]).collect();
            let found = merged_again(folder.path(), &sources, versions, &params, side);
            prop_assert!(found == in_memory(&sources, &params, u64::MAX), "round {round}, blocks of {side}");
        }
    }
}
