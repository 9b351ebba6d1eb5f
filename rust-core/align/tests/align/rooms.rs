//! Rooms seen from inside, where walls fit walls and corners fit corners: what is placed is placed rightly.

use base::progress::Progress;
use glam::{DAffine3, DVec3};
use image::RangeImage;
use image::source::ScanSource as _;
use mesh::TriMesh;
use mesh::shapes::Shape;
use surfrecon_align::{AlignParams, AlignedPair, Alignment, Constraints, PairState, run};

use crate::bare::nothing_joined;
use crate::reach::{add, displaced, film, lines, room, rough, tour};
use crate::scans::{aligned, errors, placed, sources, without_poses};

/// Theorem: lines of sight of all frames together refuse joins that fit by themselves. Pairs of corners did, and whole groups came out
/// turned by half the room.
#[test]
fn no_frame_without_a_pose_is_placed_wrongly() {
    let count = base::tier::cases(8).into();
    for seed in 1..=count {
        let images = tour(&room(seed, 14), 14, (60, 75), 0.004);
        let alignment = aligned(&without_poses(&images), &Constraints::default());
        let off = errors(&images, &alignment);
        println!("{seed}: {} of {} placed", off.iter().flatten().count(), off.len());
        assert!(off.iter().flatten().all(|off| *off < 2.0), "{seed}: {off:?} {}", lines(&alignment));
    }
}

/// Theorem: with exact poses, what data do not hold is not placed. Nothing that is placed has slid along walls.
#[test]
fn nothing_slides_in_an_empty_room() {
    for things in [0, 2] {
        let images = tour(&room(3, things), 10, (48, 60), 0.004);
        let alignment = rough(&images, Some(0.3), &Constraints::default());
        for (image, found) in images.iter().zip(&alignment.world_from_scan) {
            let off = found.map(|found| displaced(image, &found));
            assert!(off.is_none_or(|off| off < 0.06), "{things}: {off:?} {}", lines(&alignment));
        }
    }
}

pub fn boxed(scene: &mut TriMesh, half: DVec3, to: DVec3, is_inside_out: bool) {
    add(scene, &Shape::Cuboid { half }.mesh(4), 0.0, to, is_inside_out);
}

/// An office, 8 x 6 x 2.7 m, of equal desks, each with a screen.
pub fn office() -> TriMesh {
    let mut scene = TriMesh::default();
    boxed(&mut scene, DVec3::new(4.0, 3.0, 1.35), DVec3::new(0.0, 0.0, 1.35), true);
    for k in 0..6 {
        let at = DVec3::new(2.4 * f64::from(k % 3) - 2.4, if k < 3 { -1.7 } else { 1.7 }, 0.0);
        boxed(&mut scene, DVec3::new(0.7, 0.4, 0.37), at + 0.37 * DVec3::Z, false);
        boxed(&mut scene, DVec3::new(0.25, 0.03, 0.18), at + 0.95 * DVec3::Z, false);
    }
    scene
}

/// A corridor, 14 x 1.8 x 2.5 m, with equal doors on both sides.
pub fn corridor() -> TriMesh {
    let mut scene = TriMesh::default();
    boxed(&mut scene, DVec3::new(7.0, 0.9, 1.25), DVec3::new(0.0, 0.0, 1.25), true);
    for k in 0..6 {
        for side in [-0.9, 0.9] {
            boxed(&mut scene, DVec3::new(0.45, 0.06, 1.0), DVec3::new(2.2 * f64::from(k) - 5.5, side, 1.0), false);
        }
    }
    scene
}

/// Two equal rooms, 4 x 4 x 2.6 m, with the same things in them, joined by a passage.
pub fn twins() -> TriMesh {
    let mut scene = TriMesh::default();
    for x in [-2.0, 2.0] {
        boxed(&mut scene, DVec3::new(0.35, 0.5, 0.6), DVec3::new(x - 1.2, 1.4, 0.6), false);
        boxed(&mut scene, DVec3::new(0.5, 0.3, 0.35), DVec3::new(x + 0.4, -1.6, 0.35), false);
        boxed(&mut scene, DVec3::new(0.2, 0.2, 0.9), DVec3::new(x + 0.3, 1.7, 0.9), false);
    }
    boxed(&mut scene, DVec3::new(4.0, 2.0, 1.3), DVec3::new(0.0, 0.0, 1.3), true);
    boxed(&mut scene, DVec3::new(0.05, 0.75, 1.3), DVec3::new(0.0, 1.25, 1.3), false);
    boxed(&mut scene, DVec3::new(0.05, 0.75, 1.3), DVec3::new(0.0, -1.25, 1.3), false);
    scene
}

/// A walk that turns once about z while the eye goes along an ellipse.
pub fn walk(scene: &TriMesh, count: usize, radii: [f64; 2], size: (usize, usize)) -> Vec<RangeImage> {
    let place = |k: usize| {
        let turn = std::f64::consts::TAU * k as f64 / count as f64;
        let eye = DVec3::new(radii[0] * turn.cos(), radii[1] * turn.sin(), 1.4 + 0.1 * (2.0 * turn).sin());
        let ahead = turn + 0.7;
        (eye, eye + DVec3::new(2.0 * ahead.cos(), 2.0 * ahead.sin(), -0.5))
    };
    film(scene, &(0..count).map(place).collect::<Vec<_>>(), size, 0.004)
}

/// Theorem: doors fold onto doors without any sensor speaking against it. Where few frames of the heap fit each other, nothing is placed, and the
/// report names them.
#[test]
fn few_frames_of_a_corridor_are_in_doubt() {
    let images = walk(&corridor(), 16, [5.5, 0.2], (60, 80));
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    assert_eq!(alignment.report.placed(), 0, "{}", lines(&alignment));
    assert!(alignment.report.messages.iter().any(|text| text.contains("too few of 16")), "{}", lines(&alignment));
}

/// Theorem: pairs of frames that share walls alone join nothing.
#[test]
fn walls_alone_join_nothing() {
    let mut images = tour(&room(0, 2), if base::tier::is_thorough() { 36 } else { 16 }, (60, 80), 0.004);
    // A room of 5 x 4 x 2.7 m: what stands in it lies inside.
    let shows_walls_alone = |image: &RangeImage| {
        let points = image.oriented_points(&Progress::none()).unwrap().positions;
        let is_inside = |p: &DVec3| {
            let p = image.world_from_sensor.transform_point3(*p);
            p.x.abs() < 2.4 && p.y.abs() < 1.9 && (0.1..2.6).contains(&p.z)
        };
        !points.iter().any(is_inside)
    };
    images.retain(shows_walls_alone);
    assert!(images.len() >= 6, "{}", images.len());
    nothing_joined(&aligned(&without_poses(&images), &Constraints::default()));
}

/// How far the scans of each group are off, in the distances of samples, beside that scan of it by which they are off least.
pub fn errors_in_groups(images: &[RangeImage], alignment: &Alignment) -> Vec<Vec<(usize, f64)>> {
    let points: Vec<_> = images.iter().map(|image| image.oriented_points(&Progress::none()).unwrap()).collect();
    let of_group = |group: &Vec<usize>| {
        let pose = |k: usize| alignment.report.scans[k].world_from_scan.unwrap();
        let beside = |reference: &usize| {
            let truth_from_found = images[*reference].world_from_sensor * pose(*reference).inverse();
            let off = |&k: &usize| {
                let (found, truth) = (truth_from_found * pose(k), images[k].world_from_sensor);
                let far = |p: &DVec3| found.transform_point3(*p).distance(truth.transform_point3(*p));
                (k, points[k].positions.iter().map(far).fold(0.0, f64::max) / points[k].spacing)
            };
            group.iter().map(off).collect::<Vec<(usize, f64)>>()
        };
        let worst = |off: &Vec<(usize, f64)>| off.iter().map(|off| off.1).fold(0.0, f64::max);
        group.iter().map(beside).min_by(|x, y| worst(x).total_cmp(&worst(y))).unwrap()
    };
    alignment.report.groups.iter().map(of_group).collect()
}

/// No scan of any group is off by more than two distances of its samples and than what is said it may be.
pub fn none_wrong(images: &[RangeImage], alignment: &Alignment) {
    for off in errors_in_groups(images, alignment) {
        let said = |k: usize| 6.0 * alignment.report.scans[k].deviation / alignment.report.scans[k].spacing;
        assert!(off.iter().all(|&(k, off)| off < said(k).max(2.0)), "{off:.2?} {}", lines(alignment));
    }
}

/// Two rooms that differ, 4 x 4 and 5 x 4 m, with a door between them.
fn flat() -> TriMesh {
    let mut scene = TriMesh::default();
    boxed(&mut scene, DVec3::new(4.5, 2.0, 1.3), DVec3::new(0.5, 0.0, 1.3), true);
    boxed(&mut scene, DVec3::new(0.06, 0.9, 1.3), DVec3::new(0.0, -1.1, 1.3), false);
    boxed(&mut scene, DVec3::new(0.06, 0.65, 1.3), DVec3::new(0.0, 1.35, 1.3), false);
    boxed(&mut scene, DVec3::new(0.06, 0.45, 0.3), DVec3::new(0.0, 0.25, 2.3), false);
    let things = [
        // Of the one: half of the size, and where.
        [0.5, 0.3, 0.4, -3.3, 1.5, 0.3],
        [0.2, 0.7, 0.9, -3.7, -0.6, 0.1],
        [0.4, 0.25, 0.25, -2.2, -1.6, 0.5],
        [0.25, 0.3, 0.55, -1.0, 1.6, 0.2],
        [0.3, 0.2, 0.7, -0.7, -1.5, 0.7],
        [0.35, 0.35, 0.3, -2.4, 1.7, 1.1],
        // Of the other.
        [0.9, 0.4, 0.25, 3.2, 1.4, 0.2],
        [0.25, 0.25, 0.8, 4.6, -1.5, 0.5],
        [0.35, 0.5, 0.35, 2.1, -1.3, 0.9],
        [0.15, 0.4, 0.6, 4.7, 0.3, 0.1],
        [0.3, 0.3, 0.45, 1.0, 1.6, 0.4],
        [0.2, 0.5, 0.5, 0.9, -1.5, 0.3],
    ];
    for [x, y, z, to_x, to_y, turn] in things {
        let half = DVec3::new(x, y, z);
        add(&mut scene, &Shape::Cuboid { half }.mesh(2), turn, DVec3::new(to_x, to_y, z), false);
    }
    scene
}

/// Frames of a camera that turns in a room whose middle is at x, `some` frames of `count` a turn.
fn inside(scene: &TriMesh, x: f64, begin: f64, count: usize, some: usize) -> Vec<RangeImage> {
    let place = |k: usize| {
        let turn = begin + std::f64::consts::TAU * k as f64 / count as f64;
        let eye = DVec3::new(x + 0.6 * turn.cos(), 0.5 * turn.sin(), 1.4);
        (eye, eye + DVec3::new((turn + 0.4).cos(), (turn + 0.4).sin(), -0.3))
    };
    film(scene, &(0..some).map(place).collect::<Vec<_>>(), (60, 80), 0.004)
}

/// Theorem: frames of two rooms are not mixed up, and most of each are together.
#[test]
fn two_rooms_joined_by_a_door() {
    let (count, some) = if base::tier::is_thorough() { (20, 12) } else { (24, 5) };
    let scene = flat();
    let both = [inside(&scene, -2.0, 1.0, count, some), inside(&scene, 2.5, 4.0, count, some)].concat();
    let named = |(k, mut image): (usize, RangeImage)| {
        image.name = format!("frame {k}");
        image
    };
    let images: Vec<RangeImage> = both.into_iter().enumerate().map(named).collect();
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    none_wrong(&images, &alignment);
    for room in [0..some, some..2 * some] {
        let of_room = |group: &Vec<usize>| group.iter().filter(|k| room.contains(*k)).count();
        let together = alignment.report.groups.iter().map(of_room).max().unwrap();
        assert!(2 * together > some, "{:?} {}", alignment.report.groups, lines(&alignment));
    }
}

/// Theorem: frames of a room that looks alike, but is deeper, fit some frames here and others there: they pull none of them away from
/// where it lies without them.
#[test]
fn frames_of_a_room_that_looks_alike_pull_none() {
    let own = room(11, 14);
    let mut alike = own.clone();
    alike.positions.iter_mut().filter(|p| p.y < 0.0).for_each(|p| p.y -= 0.3);
    let (all, others) = (tour(&own, 24, (60, 80), 0.004), tour(&alike, 48, (60, 80), 0.004));
    let cases = [(18, [41, 45]), (17, [43, 47])];
    for (begin, strange) in &cases[..if base::tier::is_thorough() { 2 } else { 1 }] {
        let images: Vec<RangeImage> = (*begin..begin + 8).map(|k: usize| all[k % 24].clone()).collect();
        let without = aligned(&without_poses(&images), &Constraints::default());
        assert_eq!(without.report.placed(), 8, "{}", lines(&without));
        let named = |k: &usize| {
            let mut image = others[*k].clone();
            image.name = format!("strange {k}");
            image
        };
        let mixed: Vec<RangeImage> = images.iter().cloned().chain(strange.iter().map(named)).collect();
        let with = aligned(&without_poses(&mixed), &Constraints::default());
        // Sure by themselves, and wrong.
        let is_wrong = |pair: &&AlignedPair| pair.scans[1] >= 8 && pair.state == PairState::SeenThrough;
        assert!(with.report.pairs.iter().filter(is_wrong).count() > 0, "{}", lines(&with));
        let mut rest = with.clone();
        rest.report.groups.iter_mut().for_each(|group| group.retain(|k| *k < 8));
        rest.report.groups.retain(|group| group.len() > 1);
        assert_eq!(rest.report.groups.iter().flatten().count(), 8, "{}", lines(&with));
        let moved = images.iter().zip(&without.world_from_scan).map(|(image, pose)| placed(image, pose.unwrap()));
        for off in [&images, &moved.collect::<Vec<_>>()].map(|truth| errors_in_groups(truth, &rest)) {
            assert!(off.iter().flatten().all(|(_, off)| *off < 2.0), "{off:.2?} {}", lines(&with));
        }
    }
}

/// Theorem: heaps of rooms are the same bytes for any number of threads and any order of the scans.
#[test]
fn heaps_are_the_same_for_any_number_of_threads_and_any_order() {
    let count = if base::tier::is_thorough() { 14 } else { 7 };
    let images = tour(&room(11, 14), 24, (60, 80), 0.004);
    let given = without_poses(&images[8..8 + count]);
    let by = |images: &[RangeImage], threads| {
        let params = AlignParams { threads, ..AlignParams::default() };
        run(&sources(images), &params, &Constraints::default(), &Progress::none()).unwrap()
    };
    let first = by(&given, 1);
    assert!((2..count).contains(&first.report.placed()), "{}", lines(&first));
    let bits = |pose: Option<DAffine3>| pose.map(|pose| pose.to_cols_array().map(f64::to_bits));
    for round in 0..base::tier::cases(4) as usize {
        let order: Vec<usize> = (0..count).map(|k| (3 + 5 * k + round) % count).rev().collect();
        let shuffled: Vec<RangeImage> = order.iter().map(|&k| given[k].clone()).collect();
        let other = by(&shuffled, 4 - round);
        for (place, &k) in order.iter().enumerate() {
            assert_eq!(bits(other.world_from_scan[place]), bits(first.world_from_scan[k]), "round {round}, {k}");
            let (mine, other) = (&first.report.scans[k], &other.report.scans[place]);
            assert_eq!((mine.covariance, &mine.reason), (other.covariance, &other.reason), "round {round}, {k}");
        }
    }
}
