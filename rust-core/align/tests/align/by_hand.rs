//! One scan drawn to others.

use base::progress::Progress;
use glam::{DAffine3, DQuat, DVec3};
use image::RangeImage;
use surfrecon_align::{AlignParams, PairState, Prepared};

use crate::scans::{around, look, sources, statue};

fn snapped(images: &[RangeImage], scan: usize, from: DAffine3) -> surfrecon_align::Snap {
    let prepared = Prepared::read(&sources(images), 0, &Progress::none()).unwrap();
    let mut poses: Vec<Option<DAffine3>> = images.iter().map(|image| Some(image.world_from_sensor)).collect();
    poses[scan] = Some(from);
    prepared.snap(scan, &poses, &AlignParams::default(), &Progress::none()).unwrap()
}

fn off(image: &RangeImage, found: &DAffine3) -> f64 {
    let points = image.oriented_points(&Progress::none()).unwrap();
    let off =
        |p: &DVec3| found.transform_point3(*p).distance(image.world_from_sensor.transform_point3(*p)) / points.spacing;
    points.positions.iter().map(off).fold(0.0, f64::max)
}

use image::source::ScanSource as _;

#[test]
fn a_scan_is_drawn_to_where_it_belongs() {
    let images = around(statue(), 6, 0.0);
    for (scan, direction) in [(1, DVec3::X), (2, DVec3::Y), (4, DVec3::new(1.0, -1.0, 1.0).normalize())] {
        let middle = DVec3::ZERO;
        let shake = DAffine3::from_translation(middle)
            * DAffine3::from_rotation_translation(DQuat::from_axis_angle(direction, 0.08), 0.04 * direction);
        let snap = snapped(&images, scan, shake * images[scan].world_from_sensor);
        assert_eq!(snap.state, PairState::Fits, "{snap:?}");
        let error = off(&images[scan], &snap.world_from_scan);
        assert!(error < 1.0, "{error} {snap:?}");
        assert!(snap.moved > 0.03 && !snap.touches.is_empty() && snap.freedoms.is_empty(), "{snap:?}");
    }
}

#[test]
fn what_touches_nothing_stays() {
    let images = around(statue(), 3, 0.0);
    let away = DAffine3::from_translation(DVec3::new(40.0, 0.0, 0.0)) * images[1].world_from_sensor;
    let snap = snapped(&images, 1, away);
    assert_eq!((snap.state, snap.moved, snap.touches), (PairState::Nothing, 0.0, Vec::new()));
    assert!(snap.world_from_scan.abs_diff_eq(away, 1e-9));
}

#[test]
fn what_may_slide_says_so() {
    let plane = mesh::shapes::Shape::Plane { half: glam::DVec2::new(1.0, 0.8) }.mesh(8);
    let images =
        [look(&plane, DVec3::new(0.1, 0.2, 1.0), 0.2, 0.0), look(&plane, DVec3::new(-0.3, 0.1, 1.0), 1.0, 0.0)];
    let lifted = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.02)) * images[1].world_from_sensor;
    let snap = snapped(&images, 1, lifted);
    assert_eq!(snap.state, PairState::Slides, "{snap:?}");
    assert_eq!(snap.freedoms.len(), 3);
}

#[test]
fn wrong_poses_are_refused() {
    let images = around(statue(), 3, 0.0);
    let prepared = Prepared::read(&sources(&images), 0, &Progress::none()).unwrap();
    let own: Vec<Option<DAffine3>> = images.iter().map(|image| Some(image.world_from_sensor)).collect();
    let text = |scan: usize, poses: &[Option<DAffine3>]| {
        prepared.snap(scan, poses, &AlignParams::default(), &Progress::none()).unwrap_err().to_string()
    };
    assert!(text(3, &own).contains("no scan 3"));
    assert!(text(0, &own[..2]).contains("2 poses are given for 3 scans"));
    assert!(text(0, &[None, own[1], own[2]]).contains("no pose to start from"));
    assert!(text(0, &[own[0], Some(DAffine3::from_scale(DVec3::splat(2.0))), own[2]]).contains("not rigid"));
}

#[test]
fn the_same_for_any_number_of_threads() {
    let images = around(statue(), 5, 0.3);
    let prepared = Prepared::read(&sources(&images), 0, &Progress::none()).unwrap();
    let mut poses: Vec<Option<DAffine3>> = images.iter().map(|image| Some(image.world_from_sensor)).collect();
    poses[2] = Some(DAffine3::from_translation(DVec3::splat(0.02)) * images[2].world_from_sensor);
    let by = |threads| {
        let params = AlignParams { threads, ..AlignParams::default() };
        prepared.snap(2, &poses, &params, &Progress::none()).unwrap()
    };
    assert!(by(1) == by(2) && by(1) == by(8));
}
