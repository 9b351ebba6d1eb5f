//! Rough poses bind: no scan is placed further than `reach` from where it was given.

use base::progress::Progress;
use geom::bvh::Bvh;
use glam::{DAffine3, DQuat, DVec3};
use image::RangeImage;
use image::source::ScanSource as _;
use mesh::TriMesh;
use mesh::shapes::Shape;
use proptest::prelude::*;
use scan::{ScanParams, VirtualCamera, scan};
use surfrecon_align::{AlignParams, Alignment, Constraints, ScanState, Start, run};

use crate::scans::{around, errors, placed, sources, statue};

/// A part turned about z, then moved, added to a scene.
pub fn add(scene: &mut TriMesh, part: &TriMesh, turn: f64, to: DVec3, is_inside_out: bool) {
    let base = scene.positions.len() as u32;
    scene.positions.extend(part.positions.iter().map(|p| DQuat::from_rotation_z(turn) * *p + to));
    let corners = |t: &[u32; 3]| if is_inside_out { [t[0], t[2], t[1]] } else { *t };
    scene.triangles.extend(part.triangles.iter().map(|t| corners(t).map(|v| v + base)));
}

/// A room 5 x 4 x 2.7 large, seen from inside, with boxes at the walls that lie as `seed` has them.
pub fn room(seed: u64, things: usize) -> TriMesh {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut number = |lo: f64, hi: f64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        lo + (hi - lo) * (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut scene = TriMesh::default();
    let walls = Shape::Cuboid { half: DVec3::new(2.5, 2.0, 1.35) }.mesh(8);
    add(&mut scene, &walls, 0.0, DVec3::new(0.0, 0.0, 1.35), true);
    for k in 0..things {
        let half = 0.5 * DVec3::new(number(0.25, 1.0), number(0.25, 1.0), number(0.3, 1.4));
        let side = [1.0, -1.0][k / 2 % 2];
        let to = if k % 2 == 0 {
            DVec3::new(2.1 * side, number(-1.5, 1.5), half.z)
        } else {
            DVec3::new(number(-2.0, 2.0), 1.6 * side, half.z)
        };
        add(&mut scene, &Shape::Cuboid { half }.mesh(2), number(0.0, 3.0), to, false);
    }
    scene
}

/// Frames of a camera that turns once in the room.
pub fn tour(room: &TriMesh, count: usize, size: (usize, usize), noise: f64) -> Vec<RangeImage> {
    film(room, &(0..count).map(|k| on_tour(k, count)).collect::<Vec<_>>(), size, noise)
}

/// One frame of [`tour`].
pub fn tour_frame(room: &TriMesh, k: usize, count: usize, size: (usize, usize), noise: f64) -> RangeImage {
    shot(room, &Bvh::build(&room.positions, &room.triangles, 0).unwrap(), k, on_tour(k, count), size, noise)
}

/// The eye of a frame of [`tour`], and its target.
fn on_tour(k: usize, count: usize) -> (DVec3, DVec3) {
    let turn = std::f64::consts::TAU * k as f64 / count as f64;
    let at = |along: DVec3| DVec3::new(along.x * turn.cos(), along.y * turn.sin(), along.z);
    let eye = at(DVec3::new(1.0, 0.7, 1.35)) + 0.15 * DVec3::Z * (2.0 * turn).sin();
    let ahead = turn + 0.5;
    (eye, DVec3::new(2.4 * ahead.cos(), 2.0 * ahead.sin(), 0.8 + 0.3 * (3.0 * turn).sin()))
}

/// Frames of a camera from eyes, looking at targets.
pub fn film(room: &TriMesh, places: &[(DVec3, DVec3)], size: (usize, usize), noise: f64) -> Vec<RangeImage> {
    let bvh = Bvh::build(&room.positions, &room.triangles, 0).unwrap();
    (0..places.len()).map(|k| shot(room, &bvh, k, places[k], size, noise)).collect()
}

/// One frame, whose noise follows from its number.
fn shot(
    room: &TriMesh,
    bvh: &Bvh,
    k: usize,
    (eye, target): (DVec3, DVec3),
    (rows, cols): (usize, usize),
    noise: f64,
) -> RangeImage {
    let camera = VirtualCamera::pinhole(rows, cols, 1.2, eye, target, DVec3::Z).unwrap();
    let params = ScanParams { noise, seed: k as u64, threads: 1, ..ScanParams::default() };
    let mut image = scan(room, bvh, &camera, &params, &Progress::none()).unwrap();
    image.name = format!("frame {k}");
    image
}

pub fn rough(images: &[RangeImage], reach: Option<f64>, constraints: &Constraints) -> Alignment {
    let params = AlignParams { start: Start::Rough, reach, ..AlignParams::default() };
    run(&sources(images), &params, constraints, &Progress::none()).unwrap()
}

/// Largest distance of a sample from where its given pose has it.
pub fn displaced(image: &RangeImage, found: &DAffine3) -> f64 {
    let points = image.oriented_points(&Progress::none()).unwrap().positions;
    let off = |p: &DVec3| found.transform_point3(*p).distance(image.world_from_sensor.transform_point3(*p));
    points.iter().map(off).fold(0.0, f64::max)
}

pub fn lines(alignment: &Alignment) -> String {
    alignment.report.lines().join("\n")
}

/// Shakes a pose by a turn about the scan's middle and a shift.
fn shaken(image: &RangeImage, axis: DVec3, turn: f64, shift: DVec3) -> RangeImage {
    let points = image.oriented_points(&Progress::none()).unwrap().positions;
    let middle = image.world_from_sensor.transform_point3(points.iter().sum::<DVec3>() / points.len() as f64);
    let about = DQuat::from_axis_angle(axis.normalize(), turn);
    let shake =
        DAffine3::from_translation(middle + shift) * DAffine3::from_quat(about) * DAffine3::from_translation(-middle);
    placed(image, shake * image.world_from_sensor)
}

#[test]
fn exact_poses_of_a_room_like_a_box_stay() {
    let images = tour(&room(11, 14), 12, (48, 60), 0.004);
    let alignment = rough(&images, Some(0.3), &Constraints::default());
    let found = images.iter().zip(&alignment.world_from_scan);
    let off: Vec<Option<f64>> = found.map(|(image, found)| Some(displaced(image, found.as_ref()?))).collect();
    assert!(off.iter().flatten().all(|off| *off < 0.03), "{off:?} {}", lines(&alignment));
    assert!(off.iter().flatten().count() >= 7, "{off:?} {}", lines(&alignment));
    assert!(!lines(&alignment).contains("times as large"), "{}", lines(&alignment));
}

#[test]
fn what_nothing_decides_stays_where_it_was_given_and_is_said() {
    let room = room(11, 14);
    let mut given = tour(&room, 12, (48, 60), 0.004);
    // Its ceiling alone, along which it slides.
    given.extend(film(&room, &[(DVec3::new(0.3, 0.2, 2.0), DVec3::new(0.4, 0.2, 2.7))], (48, 60), 0.004));
    given[12].name = "ceiling".to_owned();
    // Its sensor would stand in the room's corner and see through the walls.
    given[5] = placed(&given[5], DAffine3::from_translation(DVec3::new(2.0, 1.5, 0.0)) * given[5].world_from_sensor);
    let alignment = rough(&given, Some(0.1), &Constraints::default());
    let states = |state| (0..13).filter(|&k| alignment.report.scans[k].state == state).collect::<Vec<usize>>();
    assert_eq!(states(ScanState::Unplaced), [5], "{}", lines(&alignment));
    assert!(alignment.report.scans[5].reason.starts_with("others see through where it was given"));
    assert_eq!(states(ScanState::Undecided), [12], "{}", lines(&alignment));
    assert_eq!(alignment.world_from_scan[12], Some(given[12].world_from_sensor));
    assert_eq!(alignment.report.scans[12].deviation, 0.1);
    let said = lines(&alignment);
    assert!(said.contains("ceiling: stays where it was given, undecided: ") && !said.contains("rough pose"), "{said}");
    assert!(said.contains("\"ceiling\" stays where it was given: nothing decides where it belongs"), "{said}");
    assert_eq!(alignment.report.placed(), 11, "{said}");
}

/// Scans whose files have no pose, and say nothing of their sensors.
#[test]
fn that_no_file_has_a_pose_is_said() {
    let mesh = statue();
    let seen = |from: DVec3, k: usize| {
        let camera = VirtualCamera::orthographic(90, 90, 0.014, DVec3::ZERO, -from, DVec3::Z).unwrap();
        let bvh = Bvh::build(&mesh.positions, &mesh.triangles, 0).unwrap();
        let params = ScanParams { threads: 1, ..ScanParams::default() };
        let mut image = scan(mesh, &bvh, &camera, &params, &Progress::none()).unwrap();
        image.name = format!("scan {k}");
        placed(&image, DAffine3::IDENTITY)
    };
    let from = |k: usize| DVec3::new((1.3 * k as f64).cos(), (1.3 * k as f64).sin(), 0.3);
    let images: Vec<RangeImage> = (0..4).map(|k| seen(from(k), k)).collect();
    let alignment = rough(&images, Some(0.01), &Constraints::default());
    let said = lines(&alignment);
    assert!(said.contains("no scan has a pose, and start = \"rough\""), "{said}");
    assert!(!said.contains("check its pose"), "{said}");
    assert!(said.starts_with("0 of 4 scans placed. 0 pairs of scans overlap there and fit."), "{said}");
    assert!(said.contains(": stays where it is, and no other scan has a place beside it"), "{said}");
}

/// Frames that nobody has placed, and said to be near their poses.
#[test]
fn that_no_scan_has_a_pose_is_said() {
    let all = tour(&room(11, 14), 24, (48, 60), 0.004);
    let images: Vec<RangeImage> = [0, 6, 12].iter().map(|&k| placed(&all[k], DAffine3::IDENTITY)).collect();
    let said = lines(&rough(&images, Some(0.3), &Constraints::default()));
    assert!(said.contains("no scan has a pose, and start = \"rough\""), "{said}");
    assert!(!said.contains("check its pose"), "{said}");
}

#[test]
fn a_scan_given_too_far_off_is_left_out_and_said() {
    let images = around(statue(), 5, 0.0);
    let mut given = images.clone();
    given[2] = shaken(&images[2], DVec3::Z, 0.0, DVec3::new(0.0, 0.15, 0.1));
    let alignment = rough(&given, Some(0.1), &Constraints::default());
    let scan = &alignment.report.scans[2];
    assert_eq!((alignment.world_from_scan[2], scan.state), (None, ScanState::Unplaced), "{}", lines(&alignment));
    assert!(scan.reason.contains("0.18 from where it was given, and reach allows 0.1: "), "{}", scan.reason);
    let off = errors(&images, &alignment);
    assert!((0..5).all(|k| k == 2 || off[k].is_some_and(|off| off < 1.0)), "{off:?} {}", lines(&alignment));
    // With more reach it comes to its place.
    let alignment = rough(&given, Some(0.2), &Constraints::default());
    assert!(errors(&images, &alignment).iter().all(|off| off.is_some_and(|off| off < 1.0)), "{}", lines(&alignment));
}

#[test]
fn where_the_largest_scan_is_the_one_that_is_off_the_others_stay_together() {
    let images = around(statue(), 5, 0.0);
    let kept = rough(&images, Some(0.1), &Constraints::default());
    let largest = kept.report.scans.iter().position(|scan| scan.state == ScanState::Kept).unwrap();
    let mut given = images.clone();
    given[largest] = shaken(&images[largest], DVec3::Z, 0.0, DVec3::new(0.15, 0.0, -0.1));
    let alignment = rough(&given, Some(0.1), &Constraints::default());
    assert_eq!(alignment.world_from_scan[largest], None, "{}", lines(&alignment));
    assert!(alignment.report.scans[largest].reason.contains("reach allows 0.1"), "{}", lines(&alignment));
    assert_eq!(alignment.report.placed(), 4, "{}", lines(&alignment));
    for (k, found) in alignment.world_from_scan.iter().enumerate().filter(|(k, _)| *k != largest) {
        assert!(displaced(&given[k], &found.unwrap()) < 0.02, "{k} {}", lines(&alignment));
    }
}

#[test]
fn the_same_within_reach_for_any_number_of_threads_and_any_order() {
    let shift = |k: usize| 0.04 * DVec3::new(1.0, k as f64 - 2.0, 0.5);
    let shake = |(k, image): (usize, &RangeImage)| shaken(image, DVec3::X, 0.02, shift(k));
    let given: Vec<RangeImage> = around(statue(), 5, 0.2).iter().enumerate().map(shake).collect();
    let by = |images: &[RangeImage], threads| {
        let params = AlignParams { start: Start::Rough, reach: Some(0.1), threads, ..AlignParams::default() };
        run(&sources(images), &params, &Constraints::default(), &Progress::none()).unwrap()
    };
    let bits = |pose: Option<DAffine3>| pose.map(|pose| pose.to_cols_array().map(f64::to_bits));
    let first = by(&given, 1);
    assert!((2..5).contains(&first.report.placed()), "{}", lines(&first));
    let order = [3, 0, 4, 1, 2];
    let shuffled: Vec<RangeImage> = order.iter().map(|&k| given[k].clone()).collect();
    let other = by(&shuffled, 8);
    for (place, &k) in order.iter().enumerate() {
        assert_eq!(bits(other.world_from_scan[place]), bits(first.world_from_scan[k]));
        assert_eq!(other.report.scans[place].reason, first.report.scans[k].reason);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 6, ..ProptestConfig::default() })]

    /// Rooms and a statue, poses off by anything, any reach, scans fixed or not: what is placed is within reach.
    #[test]
    fn no_scan_is_placed_beyond_reach(
        seed in 0..1000_u64,
        things in 0..10_usize,
        is_room in any::<bool>(),
        reach in prop::sample::select(vec![None, Some(0.001), Some(0.05), Some(0.3), Some(1.0)]),
        off in prop::sample::select(vec![0.0, 0.03, 0.3, 2.0]),
        fixed in prop::sample::select(vec![vec![], vec![1], vec![0, 2]]),
        trusted in prop::sample::select(vec![vec![], vec![[0, 1]]]),
    ) {
        let images = match is_room {
            true => tour(&room(seed, things), 4, (36, 48), 0.004),
            false => around(statue(), 4, 0.3),
        };
        let way = |k: usize| DVec3::new((seed as f64 + 1.7 * k as f64).sin(), (1.3 * k as f64).cos(), 0.4);
        let shake = |(k, image): (usize, &RangeImage)| shaken(image, way(k), 0.3 * off, off * way(k + 7));
        let given: Vec<RangeImage> = images.iter().enumerate().map(shake).collect();
        let alignment = rough(&given, reach, &Constraints { fixed: fixed.clone(), trusted, ..Constraints::default() });
        for (k, (image, found)) in given.iter().zip(&alignment.world_from_scan).enumerate() {
            let Some(found) = found else { continue };
            let points = image.oriented_points(&Progress::none()).unwrap().positions;
            let middle = points.iter().sum::<DVec3>() / points.len() as f64;
            let radius = points.iter().map(|p| p.distance(middle)).fold(0.0, f64::max);
            let most = if fixed.contains(&k) { 0.0 } else { reach.unwrap_or(0.2 * radius) };
            prop_assert!(displaced(image, found) <= most + 1e-9, "scan {}: {} > {}", k, displaced(image, found), most);
        }
    }
}

/// Theorem: of frames with rough poses that all lie in one room, each is compared with so many others, however many there are.
#[test]
fn frames_of_a_cube_are_compared_with_few_others_each() {
    let mut cube = TriMesh::default();
    add(&mut cube, &Shape::Cuboid { half: DVec3::splat(1.0) }.mesh(4), 0.0, DVec3::ZERO, true);
    let compared = |count: usize| {
        let place = |k: usize| {
            let turn = std::f64::consts::TAU * k as f64 / count as f64;
            let eye = DVec3::new(0.3 * turn.cos(), 0.3 * turn.sin(), 0.1 * (2.0 * turn).sin());
            let ahead = turn + 0.5;
            (eye, eye + DVec3::new(ahead.cos(), ahead.sin(), 0.5 * (3.0 * turn).sin()))
        };
        let images = film(&cube, &(0..count).map(place).collect::<Vec<_>>(), (30, 40), 0.0);
        let alignment = rough(&images, None, &Constraints::default());
        for (image, found) in images.iter().zip(&alignment.world_from_scan) {
            assert!(found.is_none_or(|found| displaced(image, &found) < 0.06), "{}", lines(&alignment));
        }
        alignment.report.compared
    };
    let counts = [12, 24].map(compared);
    assert!(counts[0] <= 12 * 7 && counts[1] <= 24 * 7, "{counts:?}");
}
