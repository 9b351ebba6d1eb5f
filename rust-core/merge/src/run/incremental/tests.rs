//! A merge that is done again gives the same as one that is done for the first time.

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DAffine3, DVec3};
use proptest::prelude::*;

use super::*;
use crate::{Loading, OrientedSurface, PlacedMesh};
use image::RangeImage;
use mesh::TriMesh;
use mesh::shapes::Shape;
use scan::ScanParams;

/// Range images of a torus, half of them in other colours than the rest.
fn images() -> Vec<RangeImage> {
    let params = ScanParams { noise: 0.002, pose_shift: 0.003, ..ScanParams::default() };
    let mut images = crate::tests::scans_with(Shape::Torus { major: 1.0, minor: 0.3 }, 60, &params);
    for (i, image) in images.iter_mut().enumerate().filter(|(i, _)| i % 2 == 0) {
        image.colour = Some(vec![[(20 * i) as u8, 150, 250, 255]; image.len()]);
    }
    images
}

fn plain(mut merged: Merged) -> Merged {
    // The memory held and the time may differ.
    (merged.report.seconds, merged.report.working_bytes) = Default::default();
    merged
}

/// A merge of scans, of which each is its own version, that nothing is known of.
fn fresh(scans: &[(u64, RangeImage)], params: &MergeParams, setup: &Setup) -> Result<Merged> {
    let sources: Vec<&dyn ScanSource> = scans.iter().map(|scan| &scan.1 as &dyn ScanSource).collect();
    run_by(&sources, params, setup, &Progress::none()).map(plain)
}

fn again(
    merger: &mut Merger,
    scans: &[(u64, RangeImage)],
    params: &MergeParams,
    setup: &Setup,
    progress: &Progress<'_>,
) -> Result<Merged> {
    let (sources, versions): (Vec<&dyn ScanSource>, Vec<u64>) =
        scans.iter().map(|(version, scan)| (scan as &dyn ScanSource, *version)).unzip();
    merger.run_by((&sources, &versions), params, setup, progress).map(plain)
}

/// A merge of scans of so many versions as users ask for it.
fn kept(merger: &mut Merger, scans: &[&dyn ScanSource], versions: &[u64], params: &MergeParams) -> Result<Merged> {
    let reuse = Some(crate::Reuse { merger, versions });
    crate::merge(scans, params, crate::Run { reuse, ..crate::Run::default() }, &Progress::none())
}

/// A change of a list of scans.
#[derive(Clone, Debug)]
enum Change {
    Add(usize),
    Remove(usize),
    Move(usize, [i32; 3]),
    Rename(usize, u8),
    Cell(Option<u8>),
    Distance(Option<u8>),
    Cancel(u64),
}

fn change() -> impl Strategy<Value = Change> {
    let shift = prop::array::uniform3(-60..60_i32);
    prop_oneof![
        2 => any::<usize>().prop_map(Change::Add),
        2 => any::<usize>().prop_map(Change::Remove),
        4 => (any::<usize>(), shift).prop_map(|(scan, shift)| Change::Move(scan, shift)),
        1 => (any::<usize>(), 0..4_u8).prop_map(|(scan, name)| Change::Rename(scan, name)),
        1 => prop::option::of(0..3_u8).prop_map(Change::Cell),
        1 => prop::option::of(0..3_u8).prop_map(Change::Distance),
        2 => (0..3000_u64).prop_map(Change::Cancel),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(16)))]

    #[test]
    fn whatever_has_changed_the_result_is_that_of_a_first_merge(
        changes in prop::collection::vec(change(), 4..10),
        kept in 0..3_usize,
        threads in 1..4_usize,
    ) {
        let all = images();
        let mut scans: Vec<(u64, RangeImage)> = (0..).zip(all.iter().take(4).cloned()).collect();
        let mut params = MergeParams { voxel: Some(0.04), threads, ..MergeParams::default() };
        // Some lists have more intersections than are kept one by one, some have fewer.
        let found = fresh(&scans, &params, &Setup::default()).unwrap().report.intersections;
        let setup = Setup { kept: [500, found - 1, u64::MAX][kept], ..Setup::default() };
        let mut merger = Merger::default();
        for (next, change) in (4..).zip(changes) {
            let mut checks = None;
            let count = scans.len();
            match change {
                Change::Add(image) => scans.push((next, all[image % all.len()].clone())),
                Change::Remove(scan) if count > 0 => drop(scans.remove(scan % count)),
                Change::Move(scan, by) if count > 0 => {
                    let scan = &mut scans[scan % count];
                    let by = DVec3::from_array(by.map(|x| 0.005 * f64::from(x)));
                    scan.1.world_from_sensor = DAffine3::from_translation(by) * scan.1.world_from_sensor;
                    scan.0 = next;
                }
                Change::Rename(scan, name) if count > 0 => {
                    let scan = &mut scans[scan % count];
                    (scan.0, scan.1.name) = (next, format!("name {name}"));
                }
                Change::Cell(cell) => params.voxel = cell.map(|cell| 0.03 + 0.01 * f64::from(cell)),
                Change::Distance(by) => params.merge_distance = by.map(|by| 0.05 + 0.01 * f64::from(by)),
                Change::Cancel(after) => checks = Some(after),
                _ => {}
            }
            if let Some(checks) = checks {
                let _ = again(&mut merger, &scans, &params, &setup, &Progress::cancel_after(checks));
            }
            let expected = fresh(&scans, &params, &setup).map_err(|error| error.to_string());
            let found = again(&mut merger, &scans, &params, &setup, &Progress::none()).map_err(|error| error.to_string());
            prop_assert!(found == expected, "{:?} {:?}", found.map(|m| m.report), expected.map(|m| m.report));
        }
    }
}

/// A scan that counts how often it is loaded.
struct Counted<'a> {
    image: &'a RangeImage,
    loads: &'a AtomicUsize,
}

impl ScanSource for Counted<'_> {
    fn name(&self) -> &str {
        self.image.name()
    }

    fn load(&self, loading: &Loading, progress: &Progress<'_>) -> Result<OrientedSurface> {
        self.loads.fetch_add(1, Ordering::Relaxed);
        self.image.load(loading, progress)
    }

    fn image(&self, progress: &Progress<'_>) -> Result<Option<std::borrow::Cow<'_, RangeImage>>> {
        self.loads.fetch_add(1, Ordering::Relaxed);
        self.image.image(progress)
    }
}

#[test]
fn nothing_is_loaded_twice_and_little_is_done_where_little_has_changed() {
    // A row of patches, each of which overlaps with the next.
    let patch = |i: usize, lift: f64| {
        let height = |k: i32| lift + 0.1 * (40.0 * i as f64 + f64::from(k % 50)).sin() + 0.1 * f64::from(k / 50).sin();
        let values = (0..2500).map(height).collect();
        let plane =
            image::range_image::Projection::Orthographic { first: [0.05 + 40.0 * i as f64, 0.03], step: [1.0, 1.0] };
        let mut image = RangeImage::from_values(50, 50, values, plane).unwrap();
        image.name = format!("{i:02}");
        image
    };
    let mut patches: Vec<RangeImage> = (0..20).map(|i| patch(i, 0.0)).collect();
    let params = MergeParams { voxel: Some(0.5), ..MergeParams::default() };
    let loads = AtomicUsize::new(0);
    let mut merger = Merger::default();
    let mut merge = |patches: &[RangeImage], versions: &[u64]| {
        loads.store(0, Ordering::Relaxed);
        let counted: Vec<Counted<'_>> = patches.iter().map(|image| Counted { image, loads: &loads }).collect();
        let scans: Vec<&dyn ScanSource> = counted.iter().map(|scan| scan as &dyn ScanSource).collect();
        let merged = plain(kept(&mut merger, &scans, versions, &params).unwrap());
        let sources: Vec<&dyn ScanSource> = patches.iter().map(|image| image as &dyn ScanSource).collect();
        assert!(merged == plain(crate::merge(&sources, &params, crate::Run::default(), &Progress::none()).unwrap()));
        (loads.load(Ordering::Relaxed), merger.renewed())
    };
    let mut versions: Vec<u64> = (0..20).collect();
    let (loaded, renewed) = merge(&patches, &versions);
    assert!(loaded >= 20 && renewed.bricks == renewed.of, "{loaded} {renewed:?}");
    let (loaded, renewed) = merge(&patches, &versions);
    assert!(loaded == 0 && renewed.bricks == 0 && renewed.of > 100, "{loaded} {renewed:?}");
    (patches[7], versions[7]) = (patch(7, 0.2), 20);
    let (loaded, renewed) = merge(&patches, &versions);
    assert!(loaded <= 2 && renewed.bricks > 0 && 5 * renewed.bricks < renewed.of, "{loaded} {renewed:?}");
    // A scan that goes or comes in the middle of the order, or at its begin, leaves the rest as it was.
    for place in [7, 0, 12] {
        let gone = (patches.remove(place), versions.remove(place));
        let (loaded, renewed) = merge(&patches, &versions);
        assert!(loaded == 0 && 5 * renewed.bricks < renewed.of, "{loaded} {renewed:?}");
        patches.insert(place, gone.0);
        versions.insert(place, gone.1);
        let (loaded, renewed) = merge(&patches, &versions);
        assert!(loaded <= 2 && renewed.bricks > 0 && 5 * renewed.bricks < renewed.of, "{loaded} {renewed:?}");
    }
}

#[test]
fn what_new_scans_see_through_goes_and_comes_back() {
    let floor = |row: usize, col: usize| -0.02 * (row as f64 + 0.3 * col as f64).sin();
    // Depths of a camera above a floor; in some frames there is something in between, in bricks of its own.
    let frame = |k: usize, is_there: bool, aside: f64| {
        let depth = |i: usize| {
            let (row, col) = (i / 60, i % 60);
            let stands = is_there && (20..40).contains(&row) && (20..40).contains(&col);
            if stands { 1.2 + 0.015 * (row + col) as f64 } else { 5.0 + floor(row, col) }
        };
        let pinhole = image::range_image::Projection::Pinhole {
            focal: [60.0; 2],
            centre: [29.5; 2],
            depth: image::range_image::DepthKind::Planar,
        };
        let mut image = RangeImage::from_values(60, 60, (0..3600).map(depth).collect(), pinhole).unwrap();
        image.name = format!("{k}");
        image.world_from_sensor = DAffine3::from_translation(DVec3::new(0.01 * k as f64 + aside, 0.0, 0.0));
        image
    };
    let params = MergeParams { voxel: Some(0.1), merge_distance: Some(0.15), ..MergeParams::default() };
    let mut merger = Merger::default();
    let mut scans: Vec<(u64, RangeImage)> = (0..6).map(|k| (k as u64, frame(k, k % 3 != 2, 0.0))).collect();
    let mut seen = Vec::new();
    // Most frames have it; a few; most again; and few of those that do not look there at all.
    let steps = [
        (0, false, 0.0),
        (1, false, 0.0),
        (3, false, 0.0),
        (1, true, 0.0),
        (2, false, 9.0),
        (5, false, 9.0),
        (3, false, 9.0),
        (0, true, 0.0),
    ];
    for (step, (k, is_there, aside)) in steps.into_iter().enumerate() {
        scans[k] = (10 + step as u64, frame(k, is_there, aside));
        let found = again(&mut merger, &scans, &params, &Setup::default(), &Progress::none()).unwrap();
        let expected = fresh(&scans, &params, &Setup::default()).unwrap();
        assert!(found == expected, "step {step}: {:?} {:?}", found.report, expected.report);
        seen.push(found.report.seen_through > 0);
    }
    assert!(seen.contains(&true) && seen.contains(&false), "{seen:?}");
}

#[test]
fn distances_count_also_where_nothing_else_is_left() {
    // Plates thinner than a cell leave pairs of intersections on the same edges, which cancel each other.
    let (plate, ball) =
        (Shape::Cuboid { half: DVec3::new(20.0, 20.0, 0.1) }.mesh(4), Shape::Sphere { radius: 5.0 }.mesh(8));
    let mut merger = Merger::default();
    let mut residuals = Vec::new();
    for step in 0..3_u64 {
        let ball_at = DVec3::new(200.0 + step as f64, 0.3, 0.4);
        let placed =
            [("a", &plate, DVec3::new(0.3, 0.2, 0.5)), ("b", &plate, DVec3::new(0.3, 0.2, 0.7)), ("c", &ball, ball_at)]
                .map(|(name, mesh, at)| PlacedMesh {
                    name: name.to_owned(),
                    mesh,
                    world_from_mesh: DAffine3::from_translation(at),
                });
        let sources = [0, 1, 2].map(|i| &placed[i] as &dyn ScanSource);
        let params = MergeParams { voxel: Some(1.0), ..MergeParams::default() };
        let expected = plain(crate::merge(&sources, &params, crate::Run::default(), &Progress::none()).unwrap());
        let found = plain(kept(&mut merger, &sources, &[0, 1, 2 + step], &params).unwrap());
        assert!(found == expected, "{step}: {:?} {:?}", found.report, expected.report);
        residuals.push(found.report.overlap_residual);
    }
    assert!(residuals[0].is_some_and(|residual| (residual - 0.2).abs() < 0.05), "{residuals:?}");
}

#[test]
fn versions_are_one_a_scan() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(4);
    let scan = PlacedMesh { name: "ball".to_owned(), mesh: &mesh, world_from_mesh: DAffine3::IDENTITY };
    let twice = [&scan as &dyn ScanSource; 2];
    let refused = |versions: &[u64]| {
        kept(&mut Merger::default(), &twice, versions, &MergeParams::default()).unwrap_err().to_string()
    };
    assert!(refused(&[3, 3]).contains("version 3"));
    assert!(refused(&[3]).contains("1 versions for 2 scans"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(48)))]

    /// Whole numbers put vertices into nodes. Bases and holes differ.
    #[test]
    fn soups_of_triangles_are_merged_again(
        corners in prop::collection::vec(prop::array::uniform3(-50..50_i32), 60..90),
        moved in prop::collection::vec((0..3_usize, prop::array::uniform3(-40..40_i32)), 1..5),
        far in any::<bool>(),
    ) {
        let positions: Vec<DVec3> = corners.iter().map(|c| DVec3::from_array(c.map(f64::from)) * 0.5).collect();
        let mesh = |third: usize| {
            let of = positions.iter().skip(third * positions.len() / 3).take(positions.len() / 3 / 3 * 3).copied().collect::<Vec<_>>();
            let triangles = (0..of.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
            TriMesh::new(of, triangles)
        };
        let meshes = [0, 1, 2].map(mesh);
        let mut places = [DVec3::ZERO; 3];
        let mut versions = [0, 1, 2];
        let params = MergeParams { voxel: Some(1.0), threads: 2, ..MergeParams::default() };
        let mut merger = Merger::default();
        for (step, (which, by)) in moved.into_iter().enumerate() {
            // From base to base.
            let unit = if far { 3e5 } else { 0.5 };
            places[which] += DVec3::from_array(by.map(f64::from)) * unit;
            versions[which] = 3 + step as u64;
            let placed = [0, 1, 2].map(|i| PlacedMesh {
                name: format!("soup{i}"),
                mesh: &meshes[i],
                world_from_mesh: DAffine3::from_translation(places[i]),
            });
            let sources = [0, 1, 2].map(|i| &placed[i] as &dyn ScanSource);
            let expected = crate::merge(&sources, &params, crate::Run::default(), &Progress::none()).map(plain).map_err(|e| e.to_string());
            let found = kept(&mut merger, &sources, &versions, &params).map(plain).map_err(|e| e.to_string());
            prop_assert!(found == expected, "{:?} {:?}", found.map(|m| m.report), expected.map(|m| m.report));
        }
    }
}
