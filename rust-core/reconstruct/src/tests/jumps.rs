//! Open surfaces of which is known from where they were seen.

use glam::DVec3;

use super::open::ball_on_a_sheet;
use super::{as_set, check, cloud, plate, random, sphere, torus};
use crate::{Closure, ReconstructParams, Reconstructed, Reconstructor};
use base::progress::Progress;
use mesh::check::CheckReport;
use mesh::point_cloud::PointCloud;

/// Far above.
const SENSOR: DVec3 = DVec3::new(30.0, 30.0, 1e5);

fn made(points: &[DVec3], sensors: &[DVec3], threads: usize) -> Reconstructed {
    let mut reconstructor = Reconstructor::new(cloud(points.to_vec())).unwrap();
    if !sensors.is_empty() {
        reconstructor.seen_from(sensors.to_vec()).unwrap();
    }
    reconstructor.surface(&ReconstructParams { threads, ..Default::default() }, &Progress::none()).unwrap()
}

fn seen(points: &[DVec3], sensors: &[DVec3]) -> CheckReport {
    check(&made(points, sensors, 0).mesh)
}

/// Parts, loops of their borders, genus.
fn shape(report: &CheckReport) -> (usize, usize, Option<i64>) {
    (report.components, report.boundary_loops, report.genus())
}

/// A bent sheet of 60 by 60 samples about 1 apart, each moved by `place`, which leaves some out.
fn sheet(place: impl Fn(i32, i32, DVec3) -> Option<DVec3>) -> Vec<DVec3> {
    let mut random = random(12);
    let sample = |i: i32| {
        let jitter = 0.3 * DVec3::new(random(), random(), 0.1 * random());
        let (x, y) = (i % 60, i / 60);
        place(x, y, DVec3::new(f64::from(x), f64::from(y), 0.01 * f64::from(y).powi(2)) + jitter)
    };
    (0..60 * 60).filter_map(sample).collect()
}

/// One that is not bent.
fn flat(place: impl Fn(i32, DVec3) -> DVec3) -> Vec<DVec3> {
    sheet(|x, y, p| Some(place(x, p - 0.01 * f64::from(y).powi(2) * DVec3::Z)))
}

/// The right half lies behind the left one.
fn step() -> Vec<DVec3> {
    flat(|x, p| if x < 30 { p } else { p - 12.0 * DVec3::Z })
}

#[test]
fn what_lies_behind_is_not_joined_at_the_silhouette() {
    let points = step();
    let joined = seen(&points, &[]);
    assert_eq!(joined.components, 1, "{joined}");
    assert_eq!(shape(&seen(&points, &[SENSOR])), (2, 2, Some(0)));
    // From the side it is seen that there is a wall.
    assert_eq!(shape(&seen(&points, &[DVec3::new(1e5, 30.0, 1e5)])), shape(&joined));
    // A jump has two ends.
    let of_one_half: Vec<DVec3> = points.iter().map(|p| if p.x < 29.5 { SENSOR } else { DVec3::NAN }).collect();
    assert_eq!(shape(&seen(&points, &of_one_half)), shape(&joined));
}

#[test]
fn a_cloud_knows_its_sensor() {
    let own =
        |sensor| crate::run(&PointCloud { sensor, ..cloud(step()) }, &ReconstructParams::default(), &Progress::none());
    assert!(own(Some(SENSOR)).unwrap().mesh == made(&step(), &[SENSOR], 0).mesh);
    assert!(own(None).unwrap().mesh == made(&step(), &[], 0).mesh);
    let text = own(Some(DVec3::NAN)).unwrap_err().to_string();
    assert!(text.contains("sensor origin lies at (NaN, NaN, NaN)") && text.contains("or no sensor"), "{text}");
    // A sensor per point goes before it.
    let mut reconstructor = Reconstructor::new(PointCloud { sensor: Some(SENSOR), ..cloud(step()) }).unwrap();
    reconstructor.seen_from(vec![DVec3::NAN; step().len()]).unwrap();
    let unseen = reconstructor.surface(&ReconstructParams::default(), &Progress::none()).unwrap();
    assert!(unseen.mesh == made(&step(), &[], 0).mesh);
}

#[test]
fn a_gap_through_which_something_is_seen_stays_open() {
    let halves = sheet(|x, _, p| Some(if x < 30 { p } else { p + 8.0 * DVec3::X }));
    assert_eq!(shape(&seen(&halves, &[SENSOR])), (1, 1, Some(0)));
    let behind = sheet(|x, _, p| (30..38).contains(&x).then_some(p - 40.0 * DVec3::Z));
    let all = [halves, behind].concat();
    let joined = seen(&all, &[]);
    assert_eq!(joined.components, 2, "{joined}");
    assert_eq!(shape(&seen(&all, &[SENSOR])), (3, 3, Some(0)));
    // From below the strip is in front.
    assert_eq!(shape(&seen(&all, &[-SENSOR])), shape(&joined));
    // The sensor is between the two.
    assert_eq!(shape(&seen(&all, &[DVec3::new(34.0, 30.0, -12.0)])), shape(&joined));
}

#[test]
fn a_hole_through_which_something_is_seen_has_no_lid() {
    let is_hole = |x: i32, y: i32| (27..33).contains(&x) && (27..33).contains(&y);
    let holed = sheet(|x, y, p| (!is_hole(x, y)).then_some(p));
    assert_eq!(shape(&seen(&holed, &[SENSOR])), (1, 1, Some(0)));
    let behind = sheet(|x, y, p| is_hole(x, y).then_some(p - 40.0 * DVec3::Z));
    let all = [holed, behind].concat();
    assert_eq!(shape(&seen(&all, &[])), (1, 1, Some(0)));
    assert_eq!(shape(&seen(&all, &[SENSOR])), (1, 2, Some(0)));
    assert_eq!(shape(&seen(&all, &[-SENSOR])), (1, 1, Some(0)));
}

/// Steps of such a height that some of their facets seem to span jumps, and others don't.
#[test]
fn jitter_leaves_no_holes_in_what_is_steep() {
    for height in [4.5, 4.75, 5.0] {
        let stairs = flat(|x, p| p - height * f64::from(x / 6) * DVec3::Z);
        assert_eq!(shape(&seen(&stairs, &[SENSOR])), shape(&seen(&stairs, &[])), "{height}");
    }
}

#[test]
fn a_loop_around_a_deep_jump_stays_open() {
    // One half is torn from the other in the middle, twelve apart. In straight columns no sample lies behind the tear.
    let torn = flat(|x, p| {
        let share = (2.0 - (p.y - 30.0).abs() / 3.0).clamp(0.0, 1.0) * (1.0 - f64::from(x - 30) / 30.0);
        DVec3::new(f64::from(x), p.y, if x < 30 { p.z } else { p.z - 12.0 * share })
    });
    assert_eq!(shape(&seen(&torn, &[])), (1, 1, Some(0)));
    assert_eq!(shape(&seen(&torn, &[SENSOR])), (1, 2, Some(0)));
}

#[test]
fn a_sheet_seen_at_80_degrees_stays_whole() {
    let sheet = flat(|_, p| p);
    let (sin, cos) = 80_f64.to_radians().sin_cos();
    assert_eq!(shape(&seen(&sheet, &[1e5 * DVec3::new(sin, 0.0, cos)])), (1, 1, Some(0)));
    // As a range image has it: one ray beside the other.
    let image: Vec<DVec3> = sheet.iter().map(|p| DVec3::new(p.x, p.y.floor(), p.y.floor() * sin / cos)).collect();
    assert_eq!(shape(&seen(&image, &[SENSOR])), (1, 1, Some(0)));
}

#[test]
fn the_same_for_any_threads_and_any_order() {
    let halves = sheet(|x, _, p| Some(if x < 30 { p } else { p + DVec3::new(8.0, 0.0, -6.0) }));
    let behind = sheet(|x, _, p| (30..38).contains(&x).then_some(p - 40.0 * DVec3::Z));
    let mut points = [halves, behind].concat();
    let one = made(&points, &[SENSOR], 1).mesh;
    for threads in [2, 3, 8] {
        assert!(one == made(&points, &[SENSOR], threads).mesh, "{threads} threads");
    }
    let mut random = random(14);
    for i in (1..points.len()).rev() {
        points.swap(i, (random() * (i + 1) as f64) as usize);
    }
    assert!(as_set(&one) == as_set(&made(&points, &vec![SENSOR; points.len()], 2).mesh), "another order");
}

#[test]
fn sensors_that_are_nowhere_are_named() {
    let points = step();
    let mut reconstructor = Reconstructor::new(cloud(points.clone())).unwrap();
    let mut sensors = vec![DVec3::NAN; points.len()];
    reconstructor.seen_from(sensors.clone()).unwrap();
    sensors[7] = DVec3::new(1.0, f64::NAN, 0.0);
    let text = reconstructor.seen_from(sensors.clone()).unwrap_err().to_string();
    assert!(text.contains("sensor origin 7 lies at (1, NaN, 0)") && text.contains("three NaN"), "{text}");
    sensors[7] = DVec3::splat(1e80);
    let text = reconstructor.seen_from(sensors).unwrap_err().to_string();
    assert!(text.contains("sensor origin 7 lies at (1e80") && text.contains("larger unit"), "{text}");
    let text = reconstructor.seen_from(vec![DVec3::NAN]).unwrap_err().to_string();
    assert!(text.contains("or no sensor where it is not known") && !text.contains("unit"), "{text}");
    let text = reconstructor.turn_toward(DVec3::new(f64::NAN, 0.0, 0.0)).unwrap_err().to_string();
    assert!(text.contains("toward") && text.contains("finite"), "{text}");
}

/// No lid, whatever else is closed: nobody saw what lies under the sheet.
#[test]
fn what_was_seen_from_one_side_gets_no_lid() {
    let (points, _) = ball_on_a_sheet(78);
    assert!(made(&points, &[], 0).report.closed);
    let above = DVec3::new(0.0, 0.0, 1e5);
    for sensor in [above, -above, DVec3::new(300.0, 200.0, 400.0)] {
        let one = vec![sensor];
        assert!(!made(&points, &one, 0).report.closed, "seen from {sensor}");
        // Of a few it is not known.
        let mut each = vec![sensor; points.len()];
        each.iter_mut().step_by(3).for_each(|sensor| *sensor = DVec3::NAN);
        assert!(!made(&points, &each, 0).report.closed, "most seen from {sensor}");
    }
    let asked_for = ReconstructParams { closure: Closure::Closed, ..Default::default() };
    let mut reconstructor = Reconstructor::new(cloud(points.clone())).unwrap();
    reconstructor.seen_from(vec![above]).unwrap();
    let closed = reconstructor.surface(&asked_for, &Progress::none()).unwrap();
    assert!(closed.report.closed);
}

/// A place that somebody names for all points of an object, to have it turned there: no one can have seen its far side from there.
#[test]
fn whole_objects_are_closed_wherever_their_sensor_is_said_to_be() {
    for points in [sphere(3000, DVec3::ONE, 2.0), torus(6000, 3.0, 1.0, 1), plate(6000, 0.25)] {
        for sensor in [DVec3::Z * 9.0, DVec3::X * 1e4, DVec3::new(5.0, 4.0, 3.0), DVec3::splat(0.5)] {
            let made = made(&points, &[sensor], 0);
            assert!(made.report.closed, "{} points, {sensor}: {:?}", points.len(), made.report);
        }
    }
}
