//! Recordings without poses: frames in the order they were taken in.

use std::f64::consts::TAU;

use geom::bvh::Bvh;
use glam::DVec3;
use image::RangeImage;
use mesh::TriMesh;
use mesh::shapes::Shape;
use scan::{ScanParams, VirtualCamera, scan};
use surfrecon_align::{AlignParams, AlignReport, Alignment, Constraints, ScanSource, Start, run};

use crate::painted::painted;
use crate::reach::{add, lines, room, tour, tour_frame};
use crate::rooms::{boxed, corridor, none_wrong, office, twins, walk};
use crate::scans::{Known, errors, sources, without_poses};
use base::progress::Progress;

const SIZE: (usize, usize) = (60, 80);

pub fn followed(images: &[RangeImage], threads: usize) -> Alignment {
    let params = AlignParams { start: Start::Sequence, threads, ..AlignParams::default() };
    run(&sources(&without_poses(images)), &params, &Constraints::default(), &Progress::none()).unwrap()
}

/// How many are placed. None of them is placed wrongly: by more than 2 spacings of its samples, and than what is said it may be off.
fn placed(images: &[RangeImage], alignment: &Alignment) -> usize {
    let off = errors(images, alignment);
    println!("{} of {} placed: {off:.2?}", off.iter().flatten().count(), off.len());
    let said = alignment.report.scans.iter().map(|scan| 6.0 * scan.deviation / scan.spacing);
    let is_right = |(off, said): (&Option<f64>, f64)| off.is_none_or(|off| off < said.max(2.0));
    assert!(off.iter().zip(said).all(is_right), "{off:?} {}", lines(alignment));
    off.iter().flatten().count()
}

fn named(image: &RangeImage, name: &str) -> RangeImage {
    let mut image = image.clone();
    name.clone_into(&mut image.name);
    image
}

#[test]
fn a_whole_turn_is_followed_and_closed() {
    let images = tour(&room(11, 14), 30, SIZE, 0.004);
    let alignment = followed(&images, 0);
    assert_eq!(placed(&images, &alignment), 30, "{}", lines(&alignment));
    assert!(alignment.report.messages.iter().all(|text| !text.contains("track was lost")), "{}", lines(&alignment));
    // The first and the last are beside each other again.
    assert!(alignment.report.pairs.iter().any(|pair| pair.scans == [0, 29]), "{:?}", alignment.report.pairs);
}

/// Theorem: the order alone tells more than a search without it.
#[test]
fn rooms_of_few_things_are_followed() {
    for seed in 0..u64::from(base::tier::cases(4)) {
        let images = tour(&room(seed, 5), 40, SIZE, 0.004);
        assert!(placed(&images, &followed(&images, 0)) >= 12, "{seed}");
    }
}

#[test]
fn rooms_that_repeat_themselves_come_in_pieces() {
    let scenes = [office(), corridor(), twins()];
    for scene in &scenes[..if base::tier::is_thorough() { 3 } else { 1 }] {
        let mut images = walk(scene, 48, [2.5, 0.3], SIZE);
        images.truncate(20);
        assert!(placed(&images, &followed(&images, 0)) >= 4);
    }
}

/// A corridor of 16 m with equal doors every 2 m, walked along in steps of 0.4 m by a sensor that sees 8 m far: the end comes into view after
/// half of them. Theorem: frames of the end, which fit doors elsewhere as well, turn no step back.
#[test]
fn equal_doors_turn_no_step_back() {
    let mut scene = TriMesh::default();
    boxed(&mut scene, DVec3::new(8.0, 0.9, 1.25), DVec3::new(8.0, 0.9, 1.25), true);
    for k in 0..8 {
        for (side, knob) in [(0.0, 0.08), (1.8, 1.72)] {
            let x = 1.0 + 2.0 * f64::from(k);
            boxed(&mut scene, DVec3::new(0.45, 0.05, 1.05), DVec3::new(x, side, 1.05), false);
            boxed(&mut scene, DVec3::new(0.05, 0.04, 0.025), DVec3::new(x + 0.38, knob, 1.0), false);
        }
    }
    let bvh = Bvh::build(&scene.positions, &scene.triangles, 0).unwrap();
    let frame = |k: usize| {
        let at = k as f64;
        let eye = DVec3::new(0.8 + 0.4 * at, 0.9 + 0.05 * at.sin(), 1.4 + 0.02 * (2.0 * at).cos());
        let target = DVec3::new(eye.x + 1.0, 0.9 + 0.1 * (0.7 * at).sin(), 1.3);
        let camera = VirtualCamera::pinhole(120, 160, 1.1, eye, target, DVec3::Z).unwrap();
        let params = ScanParams { noise: 0.004, max_range: Some(8.0), seed: k as u64, ..ScanParams::default() };
        named(&scan(&scene, &bvh, &camera, &params, &Progress::none()).unwrap(), &format!("frame {k}"))
    };
    let all: Vec<RangeImage> = (4..22).map(frame).collect();
    for images in [&all[..16], &all[6..18]] {
        assert!(placed(images, &followed(images, 0)) >= 8);
    }
}

#[test]
fn threads_change_no_bit() {
    let mut images = tour(&room(11, 14), 40, SIZE, 0.004);
    images.truncate(12);
    let [one, many] = [1, 4].map(|threads| followed(&images, threads));
    assert_eq!(one.report, many.report);
    assert_eq!(one.world_from_scan, many.world_from_scan);
}

#[test]
fn a_gap_is_bridged_and_said() {
    let mut images = tour(&room(11, 14), 240, SIZE, 0.004);
    images.truncate(44);
    images.drain(14..24);
    let alignment = followed(&images, 0);
    assert_eq!(placed(&images, &alignment), 34, "{}", lines(&alignment));
}

/// Ten frames are missing, and neighbours share next to nothing. Theorem: what was lost is found again where the turn closes and numbers
/// say that frames are missing. Else pieces stay apart. Both is said.
#[test]
fn a_gap_that_breaks_track_is_said() {
    // Of a turn of 60 frames it is beyond what is found from rest: of fewer it is wider still.
    let mut images = tour(&room(11, 14), if base::tier::is_thorough() { 60 } else { 36 }, SIZE, 0.004);
    let mut frames = recorded(&images, "tour");
    images.drain(14..24);
    frames.drain(14..24);
    let said = |alignment: &Alignment, then: &str| {
        let lost = alignment.report.messages.iter().filter(|text| text.starts_with("track was lost"));
        let lost: Vec<&String> = lost.collect();
        let is_said = |text: &&String| text.contains("between \"frame 13\" and \"frame 24\": ") && text.ends_with(then);
        assert!(lost.len() == 1 && lost.iter().all(is_said), "{}", lines(alignment));
    };
    let numbered = by(&frames.iter().collect::<Vec<_>>(), Start::Sequence);
    assert_eq!(placed(&images, &numbered), images.len(), "{}", lines(&numbered));
    said(&numbered, "other frames say how they lie");
    let some = &images[7..21];
    let ordered = followed(some, 0);
    none_wrong(some, &ordered);
    assert_eq!(ordered.report.groups.len(), 2, "{}", lines(&ordered));
    said(&ordered, "they are not in one group");
}

/// A sensor that leaps, and nobody says so: what both show fits somewhere near rest by chance. Theorem: that joins nothing, and is said.
#[test]
fn a_leap_is_lost_track() {
    // Each of these was placed wrongly where the order alone joined what fits.
    let leaps = [(11, 30, 14), (5, 24, 2), (5, 28, 2), (11, 28, 14), (11, 32, 14)];
    for (seed, count, start) in &leaps[..if base::tier::is_thorough() { 5 } else { 3 }] {
        let mut images = tour(&room(*seed, 14), *count, SIZE, 0.004);
        images.drain(*start..start + 8);
        images.truncate(start + 6);
        let images = &images[start.saturating_sub(6_usize)..];
        let alignment = followed(images, 0);
        none_wrong(images, &alignment);
        assert_eq!(alignment.report.groups.len(), 2, "{}", lines(&alignment));
        let place = format!("track was lost between \"frame {}\" and \"frame {}\"", start - 1, start + 8);
        assert!(alignment.report.messages.iter().any(|text| text.starts_with(&place)), "{}", lines(&alignment));
    }
}

#[test]
fn frames_in_a_wrong_order_are_not_placed_wrongly() {
    let mut images = tour(&room(11, 14), 24, SIZE, 0.004);
    if !base::tier::is_thorough() {
        images.truncate(12);
    }
    let last = images.len() - 3;
    images.swap(3, last);
    let alignment = followed(&images, 0);
    assert!(placed(&images, &alignment) >= 6, "{}", lines(&alignment));
}

#[test]
fn a_frame_twice_and_one_of_another_room() {
    let mut images = tour(&room(11, 14), 60, SIZE, 0.004);
    images.truncate(24);
    images.insert(6, named(&images[5], "again"));
    images[12] = named(&walk(&office(), 24, [2.5, 0.3], SIZE)[3], "another room");
    let alignment = followed(&images, 0);
    assert_eq!(alignment.world_from_scan[12], None, "{}", lines(&alignment));
    assert!(alignment.report.messages.iter().any(|text| text.contains("track was lost")), "{}", lines(&alignment));
    let without = |k: &usize| *k != 12;
    let rest = Alignment {
        world_from_scan: (0..25).filter(without).map(|k| alignment.world_from_scan[k]).collect(),
        report: AlignReport {
            scans: (0..25).filter(without).map(|k| alignment.report.scans[k].clone()).collect(),
            ..alignment.report
        },
    };
    images.remove(12);
    assert_eq!(placed(&images, &rest), 24, "{}", lines(&rest));
}

/// A hand before the lens: a flat patch, near, and nothing else.
#[test]
fn a_sensor_that_is_covered_for_a_while() {
    let mut images = tour(&room(11, 14), 60, SIZE, 0.004);
    images.truncate(36);
    let hand = Shape::Cuboid { half: DVec3::new(3.0, 3.0, 0.01) }.mesh(4);
    let covered = tour(&hand, 36, SIZE, 0.002);
    for k in 14..18 {
        images[k] = named(&covered[k], &format!("covered {k}"));
    }
    let alignment = followed(&images, 0);
    let seen = |k: &usize| !(14..18).contains(k);
    assert!((14..18).all(|k| alignment.world_from_scan[k].is_none()), "{}", lines(&alignment));
    let of = |all: &[RangeImage]| -> Vec<RangeImage> { (0..36).filter(seen).map(|k| all[k].clone()).collect() };
    let rest = Alignment {
        world_from_scan: (0..36).filter(seen).map(|k| alignment.world_from_scan[k]).collect(),
        report: AlignReport {
            scans: (0..36).filter(seen).map(|k| alignment.report.scans[k].clone()).collect(),
            ..alignment.report
        },
    };
    assert!(placed(&of(&images), &rest) >= 28);
}

/// Someone walks through before the sensor: in each frame a pillar stands elsewhere. Track may be lost, which is said. Nothing is wrong.
#[test]
fn a_person_who_walks_through() {
    let still = room(11, 14);
    let person = Shape::Cuboid { half: DVec3::new(0.18, 0.12, 0.85) }.mesh(2);
    let mut images = Vec::new();
    for k in 0..30 {
        let mut scene = still.clone();
        if (8..20).contains(&k) {
            // From one side of the image to the other.
            let turn = TAU * f64::from(k) / 30.0;
            let ahead = turn + 0.5 + 0.07 * (f64::from(k) - 14.0);
            let at = DVec3::new(turn.cos() + 1.2 * ahead.cos(), 0.7 * turn.sin() + 1.2 * ahead.sin(), 0.85);
            add(&mut scene, &person, 0.3 * f64::from(k), at, false);
        }
        images.push(tour_frame(&scene, k as usize, 30, SIZE, 0.004));
    }
    let alignment = followed(&images, 0);
    none_wrong(&images, &alignment);
    assert!(alignment.report.placed() >= 10, "{}", lines(&alignment));
    assert!(alignment.report.messages.iter().any(|text| text.contains("something moved")), "{}", lines(&alignment));
}

#[test]
fn what_slides_is_said() {
    let empty = tour(&room(3, 0), 8, SIZE, 0.004);
    let alignment = followed(&empty, 0);
    assert!(placed(&empty, &alignment) <= 4, "{}", lines(&alignment));
    assert!(alignment.report.messages.iter().any(|text| text.contains("track was lost")), "{}", lines(&alignment));
}

/// An empty room slides along its walls. Photos of what hangs there hold it.
#[test]
fn colours_hold_what_walls_leave_free() {
    let mut walls = painted(Shape::Cuboid { half: DVec3::new(2.5, 2.0, 1.35) }.mesh(120));
    walls.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    walls.positions.iter_mut().for_each(|p| p.z += 1.35);
    let mut images = tour(&walls, 30, SIZE, 0.004);
    images.truncate(if base::tier::is_thorough() { 30 } else { 8 });
    let alignment = followed(&images, 0);
    assert_eq!(placed(&images, &alignment), images.len(), "{}", lines(&alignment));
    let by_shape = AlignParams { start: Start::Sequence, use_colour: false, ..AlignParams::default() };
    let alone = run(&sources(&without_poses(&images)), &by_shape, &Constraints::default(), &Progress::none()).unwrap();
    assert!(2 * placed(&images, &alone) <= images.len(), "{}", lines(&alone));
}

fn recorded(images: &[RangeImage], recording: &'static str) -> Vec<Known> {
    let images = without_poses(images).into_iter().enumerate();
    images.map(|(k, image)| Known { image, moment: Some((recording, 3.0 * k as f64 + 1.0)), up: None }).collect()
}

fn by(frames: &[&Known], start: Start) -> Alignment {
    let frames: Vec<&dyn ScanSource> = frames.iter().map(|&frame| frame as &dyn ScanSource).collect();
    let params = AlignParams { start, ..AlignParams::default() };
    run(&frames, &params, &Constraints::default(), &Progress::none()).unwrap()
}

#[test]
fn frames_of_a_recording_are_followed_in_whatever_order_they_are_given() {
    let mut images = tour(&room(11, 14), 40, SIZE, 0.004);
    images.truncate(12);
    let in_order = followed(&images, 0);
    assert!(in_order.report.messages.is_empty(), "{}", lines(&in_order));
    let frames = recorded(&images, "tour");
    let order = [7, 3, 11, 0, 5, 9, 1, 10, 4, 8, 2, 6];
    let shuffled: Vec<&Known> = order.iter().map(|&k| &frames[k]).collect();
    for start in [Start::Auto, Start::Sequence] {
        let alignment = by(&shuffled, start);
        for (place, &k) in order.iter().enumerate() {
            assert_eq!(alignment.world_from_scan[place], in_order.world_from_scan[k], "{start:?} {k}");
        }
    }
}

/// The end of a turn beside its beginning: many frames are missing between the two, and the sensor may have been anywhere.
#[test]
fn a_gap_in_the_numbers_is_no_leap() {
    for seed in 0..base::tier::cases(8).into() {
        let images = tour(&room(seed, 14), 36, SIZE, 0.004);
        let frames = recorded(&images, "tour");
        let some: Vec<usize> = (0..4).chain(32..36).collect();
        let given: Vec<&Known> = some.iter().map(|&k| &frames[k]).collect();
        let own: Vec<RangeImage> = some.iter().map(|&k| images[k].clone()).collect();
        let alignment = by(&given, Start::Auto);
        assert_eq!(placed(&own, &alignment), 8, "{seed} {}", lines(&alignment));
    }
}

/// Somebody else's frames, themselves followed, are no piece that the others must wait for.
#[test]
fn frames_of_another_room_in_the_middle() {
    let images = tour(&room(11, 14), 36, SIZE, 0.004);
    let others = walk(&office(), 36, [2.5, 0.3], SIZE);
    for from in [3, 10] {
        let mixed: Vec<RangeImage> =
            images[..3].iter().chain(&others[from..from + 2]).chain(&images[3..6]).cloned().collect();
        let alignment = followed(&mixed, 0);
        let own = |k: &usize| *k < 3 || *k > 4;
        let found = Alignment {
            world_from_scan: (0..8).filter(own).map(|k| alignment.world_from_scan[k]).collect(),
            report: AlignReport {
                scans: (0..8).filter(own).map(|k| alignment.report.scans[k].clone()).collect(),
                ..alignment.report
            },
        };
        assert_eq!(placed(&images[..6], &found), 6, "{}", lines(&found));
        assert_eq!(alignment.world_from_scan[3..5], [None, None], "{}", lines(&found));
    }
}

#[test]
fn what_is_no_sequence_is_taken_for_a_heap() {
    let images = tour(&room(11, 14), 12, SIZE, 0.004);
    // One frame in three: next to none fits the one before it.
    let far: Vec<RangeImage> = [0, 6, 3, 9, 1, 7, 4].iter().map(|&k| images[k].clone()).collect();
    let frames = recorded(&far, "tour");
    let frames: Vec<&Known> = frames.iter().collect();
    let mut by_order = by(&frames, Start::Auto);
    let said = "the order of the frames is not used: less than half of them were found to overlap the next";
    assert!(by_order.report.messages.remove(0).starts_with(said), "{}", lines(&by_order));
    assert_eq!(by_order, by(&frames, Start::Unknown));
    // Frames of two recordings have no order.
    let [first, second] = ["first", "second"].map(|name| recorded(&images[..4], name));
    let both: Vec<&Known> = [&first[0], &second[1], &first[2], &second[3]].into();
    assert_eq!(by(&both, Start::Auto), by(&both, Start::Unknown));
    let images = without_poses(&images[..4]);
    let automatic = run(&sources(&images), &AlignParams::default(), &Constraints::default(), &Progress::none());
    let params = AlignParams { start: Start::Unknown, ..AlignParams::default() };
    assert_eq!(
        automatic.unwrap(),
        run(&sources(&images), &params, &Constraints::default(), &Progress::none()).unwrap()
    );
}
