//! Scans made by the virtual scanner, whose poses are known: what is placed is placed rightly, what can't be placed is not.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]

mod bare;
mod by_hand;
mod half_turn;
mod misfit;
mod naive;
mod painted;
mod reach;
mod rooms;
mod scans;
mod sequence;
mod told;
mod turntable;

use std::ops::ControlFlow;
use std::time::Duration;

use base::error::Error;
use base::progress::Progress;
use geom::bvh::Bvh;
use glam::{DAffine3, DQuat, DVec3};
use image::RangeImage;
use mesh::TriMesh;
use mesh::shapes::Shape;
use proptest::prelude::*;
use scan::{ScanParams, VirtualCamera, scan};
use scans::{PIXELS, aligned, around, errors, look, placed, sources, statue, without_poses};
use surfrecon_align::{AlignParams, Alignment, Constraints, PairState, Pick, ScanSource, ScanState, Start, run};

#[test]
fn scans_around_a_statue_find_their_places() {
    let images = around(statue(), 8, 0.0);
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    let off = errors(&images, &alignment);
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.0)), "{off:?} {:?}", alignment.report.lines());
    assert_eq!(alignment.report.groups, [(0..8).collect::<Vec<_>>()]);
    assert_eq!(alignment.report.scans.iter().filter(|scan| scan.state == ScanState::Kept).count(), 1);
    for (scan, off) in alignment.report.scans.iter().zip(off) {
        assert!(scan.reason.is_empty() && scan.freedoms.is_empty() && scan.deviation < scan.spacing, "{scan:?}");
        assert!(off.unwrap() * scan.spacing <= 6.0 * scan.deviation + 1e-9, "{off:?} {}", scan.deviation);
    }
}

#[test]
fn noise_moves_poses_by_less_than_a_spacing() {
    let images = around(statue(), 6, 0.5);
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    let off = errors(&images, &alignment);
    assert!(off.iter().all(|off| off.is_none_or(|off| off < 2.0)), "{off:?}");
    assert!(off.iter().flatten().count() >= 5, "{:?}", alignment.report.lines());
}

fn same(a: &Alignment, b: &Alignment) -> bool {
    let bits = |alignment: &Alignment| -> Vec<Option<[u64; 12]>> {
        alignment.world_from_scan.iter().map(|pose| pose.map(|pose| pose.to_cols_array().map(f64::to_bits))).collect()
    };
    bits(a) == bits(b) && a.report == b.report
}

#[test]
fn threads_and_order_change_no_bit() {
    let images = without_poses(&around(statue(), 6, 0.2));
    let by = |threads| {
        let params = AlignParams { threads, ..AlignParams::default() };
        run(&sources(&images), &params, &Constraints::default(), &Progress::none()).unwrap()
    };
    let first = by(1);
    assert!(first.report.placed() >= 5);
    assert!(same(&first, &by(2)) && same(&first, &by(8)));
    let mut order: Vec<usize> = (0..images.len()).collect();
    for round in 0..base::tier::cases(20) as usize {
        order.rotate_left(1 + round % 3);
        order.swap(round % 6, (round * 5 + 2) % 6);
        let shuffled: Vec<RangeImage> = order.iter().map(|&k| images[k].clone()).collect();
        let other = aligned(&shuffled, &Constraints::default());
        for (place, &k) in order.iter().enumerate() {
            let bits = |pose: Option<DAffine3>| pose.map(|pose| pose.to_cols_array().map(f64::to_bits));
            assert_eq!(bits(other.world_from_scan[place]), bits(first.world_from_scan[k]), "round {round}, scan {k}");
            assert_eq!(other.report.scans[place].covariance, first.report.scans[k].covariance);
        }
    }
}

#[test]
fn fixed_scans_stay_to_the_bit() {
    let images = around(statue(), 5, 0.0);
    let mut given = without_poses(&images);
    let odd = DAffine3::from_rotation_translation(
        DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 1.1),
        DVec3::new(7.0, -3.1, 0.7),
    );
    for fixed in [1, 3] {
        given[fixed].world_from_sensor = odd * images[fixed].world_from_sensor;
    }
    let constraints = Constraints { fixed: vec![1, 3], ..Constraints::default() };
    let alignment = aligned(&given, &constraints);
    for fixed in [1, 3] {
        assert_eq!(alignment.world_from_scan[fixed], Some(given[fixed].world_from_sensor));
        assert_eq!(alignment.report.scans[fixed].state, ScanState::Kept);
    }
    for (image, found) in images.iter().zip(&alignment.world_from_scan) {
        let truth = odd * image.world_from_sensor;
        assert!(found.unwrap().translation.distance(truth.translation) < 0.02, "{:?}", alignment.report.lines());
    }
}

/// Checks that scans which no search can place are not placed, and that a reason names it.
fn refused(images: &[RangeImage], words: &str) {
    let alignment = aligned(&without_poses(images), &Constraints::default());
    let unplaced: Vec<_> = alignment.report.scans.iter().filter(|scan| scan.state != ScanState::Kept).collect();
    assert_eq!(alignment.report.placed(), 0, "{:?}", alignment.report.lines());
    assert!(unplaced.iter().any(|scan| scan.reason.contains(words)), "{words}: {:?}", alignment.report.lines());
}

fn views(mesh: &TriMesh) -> Vec<RangeImage> {
    vec![
        look(mesh, DVec3::new(1.0, 0.3, 0.5), 0.2, 0.0),
        look(mesh, DVec3::new(0.7, 0.8, 0.45), 1.3, 0.0),
        look(mesh, DVec3::new(0.9, 0.5, 0.7), 0.7, 0.0),
    ]
}

#[test]
fn a_ball_may_turn() {
    refused(&views(&Shape::Sphere { radius: 1.0 }.mesh(64)), "turn");
}

#[test]
fn a_plane_may_slide() {
    let plane = Shape::Plane { half: glam::DVec2::new(1.0, 0.8) }.mesh(8);
    refused(
        &[look(&plane, DVec3::new(0.1, 0.2, 1.0), 0.2, 0.0), look(&plane, DVec3::new(-0.3, 0.1, 1.0), 1.0, 0.0)],
        "slide",
    );
}

#[test]
fn a_cylinder_may_turn() {
    refused(&views(&Shape::Cylinder { radius: 0.6, half_height: 1.0 }.mesh(96)), "turn");
}

#[test]
fn a_cube_fits_in_several_places() {
    refused(&views(&Shape::Cuboid { half: DVec3::splat(1.0) }.mesh(4)), "places");
}

#[test]
fn what_repeats_itself_is_placed_rightly_or_not_at_all() {
    // A pillar of five lobes, wider here than there: after a fifth of a turn it fits itself.
    let mut pillar = Shape::Cylinder { radius: 0.5, half_height: 1.0 }.mesh(240);
    for p in &mut pillar.positions {
        let wide = (1.0 + 0.12 * (5.0 * p.y.atan2(p.x)).cos()) * (1.0 + 0.2 * (2.5 * p.z).sin());
        *p = DVec3::new(wide * p.x, wide * p.y, p.z);
    }
    for tilt in [0.1, 0.4] {
        let seen = |k: u32| {
            let turn = 0.9 * f64::from(k);
            look(&pillar, DVec3::new(turn.cos(), turn.sin(), tilt), 0.4 * f64::from(k), 0.0)
        };
        let images: Vec<RangeImage> = (0..6).map(seen).collect();
        let alignment = aligned(&without_poses(&images), &Constraints::default());
        let off = if alignment.report.placed() > 0 { errors(&images, &alignment) } else { Vec::new() };
        assert!(off.iter().flatten().all(|off| *off < 5.0), "{off:?} {}", alignment.report.lines().join("\n"));
        let unused = alignment.report.pairs.iter().filter(|pair| pair.state == PairState::Ambiguous).count();
        assert!(unused > 0 || alignment.report.placed() == 6, "{:?}", alignment.report.pairs);
    }
}

#[test]
fn two_objects_are_two_groups_or_left_out() {
    let mut images = around(statue(), 5, 0.0);
    let torus = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(64);
    images.push(look(&torus, DVec3::new(0.3, 0.2, 1.0), 0.4, 0.0));
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    assert_eq!(alignment.world_from_scan[5], None, "{:?}", alignment.report.lines());
    assert!(alignment.world_from_scan[..5].iter().all(Option::is_some), "{:?}", alignment.report.lines());
    assert!(alignment.report.messages.iter().any(|text| text.contains("not placed")));
}

#[test]
fn what_stands_still_before_the_sensor_is_named() {
    // A statue that turns before a room's corner, seen by a sensor that does not move.
    let corner = Shape::Cuboid { half: DVec3::new(0.9, 1.0, 0.9) }.mesh(4);
    let turned = |turn: f64| {
        let about = DQuat::from_rotation_z(turn);
        let TriMesh { mut positions, mut triangles, .. } = statue().clone();
        positions.iter_mut().for_each(|p| *p = about * *p);
        let base = positions.len() as u32;
        // Around and below it, inside out so that its inner sides are seen.
        positions.extend(corner.positions.iter().map(|p| *p + DVec3::new(-0.1, 0.0, 0.4)));
        triangles.extend(corner.triangles.iter().map(|t| [t[0] + base, t[2] + base, t[1] + base]));
        TriMesh { positions, triangles, ..TriMesh::default() }
    };
    let images: Vec<RangeImage> = [0.0, 0.9, 1.8]
        .map(|turn| {
            let scene = turned(turn);
            let bvh = Bvh::build(&scene.positions, &scene.triangles, 0).unwrap();
            let eye = DVec3::new(0.78, 0.2, 0.4);
            let camera =
                VirtualCamera::pinhole(PIXELS, PIXELS, 1.4, eye, DVec3::new(-0.2, 0.0, 0.1), DVec3::Z).unwrap();
            let params = ScanParams { threads: 1, ..ScanParams::default() };
            let mut image = scan(&scene, &bvh, &camera, &params, &Progress::none()).unwrap();
            image.name = format!("turned {turn}");
            image
        })
        .into();
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    assert_eq!(alignment.report.placed(), 0, "{:?}", alignment.report.lines());
    assert!(
        alignment.report.pairs.iter().any(|pair| pair.state == PairState::Background),
        "{:?}",
        alignment.report.pairs
    );
}

#[test]
fn picks_place_what_may_turn() {
    let ball = Shape::Cylinder { radius: 0.6, half_height: 1.0 }.mesh(96);
    let images = views(&ball)[..2].to_vec();
    let given = without_poses(&images);
    let point = |at: DVec3, k: usize| images[k].world_from_sensor.inverse().transform_point3(at);
    let picks = [
        DVec3::new(0.5, 0.332, 0.3),
        DVec3::new(0.4, 0.447, -0.6),
        DVec3::new(0.1, 0.2, 1.0),
        DVec3::new(0.3, 0.0, 1.0),
    ]
    .map(|at| Pick { scans: [0, 1], points: [point(at, 0), point(at, 1)], normals: None, weight: 1.0 })
    .to_vec();
    let alignment = aligned(&given, &Constraints { picks, ..Constraints::default() });
    let off = errors(&images, &alignment);
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 2.0)), "{off:?} {:?}", alignment.report.lines());
}

#[test]
fn rejected_pairs_are_not_used() {
    let images = around(statue(), 3, 0.0);
    let rejected = vec![[0, 1], [1, 2], [2, 0]];
    let alignment = aligned(&without_poses(&images), &Constraints { rejected, ..Constraints::default() });
    assert_eq!(alignment.report.placed(), 0);
    assert!(alignment.report.pairs.iter().all(|pair| pair.state == PairState::Rejected));
    let both = Constraints { rejected: vec![[0, 1]], trusted: vec![[1, 0]], ..Constraints::default() };
    let error = run(&sources(&images), &AlignParams::default(), &both, &Progress::none()).unwrap_err();
    assert!(error.to_string().contains("both trusted and rejected"), "{error}");
}

#[test]
fn rough_poses_are_used() {
    let images = around(statue(), 5, 0.0);
    let moved: Vec<RangeImage> = images
        .iter()
        .enumerate()
        .map(|(k, image)| {
            let turn = DQuat::from_axis_angle(DVec3::new(1.0, k as f64, 2.0).normalize(), 0.05);
            let shake = DAffine3::from_rotation_translation(turn, 0.03 * DVec3::new(k as f64 % 2.0, 1.0, -1.0));
            placed(image, shake * image.world_from_sensor)
        })
        .collect();
    let params = AlignParams { start: Start::Rough, ..AlignParams::default() };
    let alignment = run(&sources(&moved), &params, &Constraints::default(), &Progress::none()).unwrap();
    let off = errors(&images, &alignment);
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.0)), "{off:?} {:?}", alignment.report.lines());
}

#[test]
fn odd_scans_get_a_sentence_each() {
    let images = around(statue(), 4, 0.0);
    let seen = look(statue(), DVec3::X, 0.0, 0.0);
    let image::range_image::Samples::Values(mut depths) = seen.samples().clone() else {
        panic!("a pinhole has depths")
    };
    let last = depths.iter().rposition(|d| d.is_finite()).unwrap();
    depths.iter_mut().enumerate().filter(|(k, _)| *k != last).for_each(|(_, d)| *d = f64::NAN);
    let mut lone = RangeImage::from_values(seen.rows(), seen.cols(), depths, *seen.projection()).unwrap();
    lone.name = "one pixel".to_owned();
    let mut all = without_poses(&images);
    all.push(lone);
    let mut twin = all[0].clone();
    twin.name = "twin".to_owned();
    all.push(twin);
    let alignment = aligned(&all, &Constraints::default());
    let lines = alignment.report.lines().join("\n");
    assert!(alignment.world_from_scan[4].is_none() && lines.contains("one pixel"), "{lines}");
    assert!(lines.contains("hold the same samples"), "{lines}");
    assert!(alignment.world_from_scan[..4].iter().all(Option::is_some), "{lines}");
}

#[test]
fn too_few_scans_and_wrong_numbers_are_refused() {
    let images = around(statue(), 2, 0.0);
    let text = |sources: &[&dyn ScanSource], constraints: &Constraints| {
        run(sources, &AlignParams::default(), constraints, &Progress::none()).unwrap_err().to_string()
    };
    let all = sources(&images);
    assert!(text(&all[..1], &Constraints::default()).contains("at least two scans"));
    assert!(text(&all, &Constraints { fixed: vec![2], ..Constraints::default() }).contains("scan 2"));
    assert!(text(&all, &Constraints { trusted: vec![[1, 1]], ..Constraints::default() }).contains("twice"));
    let pick = Pick { scans: [0, 1], points: [DVec3::ZERO; 2], normals: None, weight: 0.0 };
    assert!(text(&all, &Constraints { picks: vec![pick], ..Constraints::default() }).contains("weight"));
    let pick = Pick { points: [DVec3::NAN, DVec3::ZERO], weight: 1.0, ..pick };
    assert!(text(&all, &Constraints { picks: vec![pick], ..Constraints::default() }).contains("finite"));
}

#[test]
fn a_scaled_mesh_is_refused() {
    let images = around(statue(), 2, 0.0);
    let mesh = statue();
    let scaled = |world_from_mesh| image::source::PlacedMesh { name: "big".to_owned(), mesh, world_from_mesh };
    for place in [DAffine3::from_scale(DVec3::splat(2.0)), DAffine3::from_scale(DVec3::new(1.0, 1.0, -1.0))] {
        let placed = scaled(place);
        let outcome = run(&[&images[0], &placed], &AlignParams::default(), &Constraints::default(), &Progress::none());
        let text = outcome.unwrap_err().to_string();
        assert!(text.contains("big") && text.contains("scale"), "{text}");
    }
}

#[test]
fn another_unit_is_named() {
    let images = around(statue(), 4, 0.0);
    let surface = images[0].load(&image::source::Loading::default(), &Progress::none()).unwrap();
    for (scale, words) in [(1000.0, "large where others are"), (0.001, "is it in another unit?")] {
        let positions = surface.positions.iter().map(|p| scale * *p).collect();
        let mesh = TriMesh { positions, triangles: surface.triangles.clone(), ..TriMesh::default() };
        let placed = image::source::PlacedMesh {
            name: "other unit".to_owned(),
            mesh: &mesh,
            world_from_mesh: DAffine3::IDENTITY,
        };
        let given = without_poses(&images);
        let mut all = sources(&given);
        all.push(&placed);
        let alignment = run(&all, &AlignParams::default(), &Constraints::default(), &Progress::none()).unwrap();
        let scan = &alignment.report.scans[4];
        assert!(scan.state == ScanState::Unplaced || scale > 1.0, "{scan:?}");
        let lines = alignment.report.lines().join("\n");
        assert!(lines.contains(words), "{lines}");
    }
}

#[test]
fn cancelling_ends_it() {
    let images = around(statue(), 3, 0.0);
    for checks in [0, 3, 20, 60] {
        let progress = Progress::cancel_after(checks);
        let outcome = run(&sources(&images), &AlignParams::default(), &Constraints::default(), &progress);
        assert!(matches!(outcome, Err(Error::Cancelled)), "after {checks}");
    }
    // Also where the work is done before the answer is there.
    let mut calls = 0;
    let late = Progress::new(|_| {
        calls += 1;
        if calls < 2 {
            return ControlFlow::Continue(());
        }
        std::thread::sleep(Duration::from_secs(4));
        ControlFlow::Break(())
    });
    let outcome = run(&sources(&images), &AlignParams::default(), &Constraints::default(), &late);
    assert!(matches!(outcome, Err(Error::Cancelled)), "{outcome:?}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: base::tier::cases(16), ..ProptestConfig::default() })]

    /// Two views of the statue: placed rightly or not at all.
    #[test]
    fn pairs_are_right_or_left_out(turn in 0.3..3.0_f64, tilt in -0.6..1.2_f64, roll in 0.0..6.0_f64, noise in prop::sample::select(vec![0.0, 0.5, 1.0])) {
        let images = [
            look(statue(), DVec3::new(1.0, 0.1, 0.4), roll, noise),
            look(statue(), DVec3::new(turn.cos(), turn.sin(), tilt), roll + 1.0, noise),
        ];
        let alignment = aligned(&without_poses(&images), &Constraints::default());
        for off in errors(&images, &alignment).into_iter().flatten() {
            prop_assert!(off < 5.0, "{off} {:?}", alignment.report);
        }
    }
}
