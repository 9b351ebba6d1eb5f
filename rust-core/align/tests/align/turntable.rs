//! Objects that turned on a table.

use std::f64::consts::TAU;

use base::progress::Progress;
use glam::{DAffine3, DQuat, DVec3};
use image::RangeImage;
use mesh::TriMesh;
use mesh::shapes::Shape;
use surfrecon_align::{AlignParams, Alignment, Axis, Constraints, Turntable, run};

use crate::scans::{camera, errors, seen, sources, statue, without_poses};

/// Images by a sensor that stands still of something that turns about a line through `foot`: in the object's frame the sensor goes
/// around it.
fn turned(mesh: &TriMesh, count: usize, noise: f64) -> (Vec<RangeImage>, Axis) {
    let camera = camera(mesh, DVec3::new(1.0, 0.0, 0.5), 0.2);
    let sensor_from_world = camera.world_from_sensor.inverse();
    let (foot, up) = (DVec3::new(0.05, -0.02, 0.0), DVec3::Z);
    let image = |k: usize| {
        let turn = DAffine3::from_quat(DQuat::from_axis_angle(up, TAU * k as f64 / count as f64));
        let turned = DAffine3::from_translation(foot) * turn * DAffine3::from_translation(-foot);
        let positions: Vec<DVec3> = mesh.positions.iter().map(|p| turned.transform_point3(*p)).collect();
        let there = TriMesh { positions, triangles: mesh.triangles.clone(), ..TriMesh::default() };
        let mut image = seen(&there, &camera, noise, k as u64);
        // The place of the sensor, if the object had stood still.
        image.world_from_sensor = turned.inverse() * camera.world_from_sensor;
        image.name = format!("step {k}");
        image
    };
    let axis =
        Axis { point: sensor_from_world.transform_point3(foot), direction: sensor_from_world.transform_vector3(up) };
    ((0..count).map(image).collect(), axis)
}

/// A vase: only its table tells how it was turned.
fn vase() -> TriMesh {
    let mut mesh = Shape::Cylinder { radius: 0.3, half_height: 0.5 }.mesh(96);
    for p in &mut mesh.positions {
        let wide = 1.0 + 0.4 * (4.0 * p.z).cos();
        *p = DVec3::new(0.05 + wide * p.x, -0.02 + wide * p.y, p.z);
    }
    mesh
}

fn aligned(images: &[RangeImage], turntable: Turntable, constraints: &Constraints) -> Alignment {
    let params = AlignParams { turntable, ..AlignParams::default() };
    run(&sources(&without_poses(images)), &params, constraints, &Progress::none()).unwrap()
}

fn right(images: &[RangeImage], alignment: &Alignment) {
    let off = errors(images, alignment);
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.5)), "{off:?} {}", alignment.report.lines().join("\n"));
}

#[test]
fn the_axis_is_found() {
    let (images, axis) = turned(statue(), 8, 0.0);
    for turntable in [Turntable::Turned, Turntable::Equal] {
        let alignment = aligned(&images, turntable, &Constraints::default());
        right(&images, &alignment);
        let found = alignment.report.turntable.unwrap();
        let cosine = found.axis.direction.dot(axis.direction);
        assert!(cosine.abs() > 0.9999, "{cosine}");
        let off = (found.axis.point - axis.point).reject_from(axis.direction.normalize()).length();
        assert!(off < 0.01, "{off}");
        for (k, angle) in found.angles.iter().enumerate() {
            let expected = (cosine.signum() * TAU * k as f64 / 8.0).rem_euclid(TAU);
            let off = (angle.unwrap() - expected + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
            assert!(off.abs() < 0.02, "{k}: {angle:?} {expected}");
        }
    }
}

#[test]
fn a_vase_has_a_place_where_angles_are_known() {
    let (images, axis) = turned(&vase(), 8, 0.0);
    let alone = aligned(&images, Turntable::No, &Constraints::default());
    assert_eq!(alone.report.placed(), 0, "{:?}", alone.report.lines());
    // The axis alone leaves the turn free: nothing is guessed.
    let on_axis = Constraints { axis: Some(axis), ..Constraints::default() };
    let free = aligned(&images, Turntable::Turned, &on_axis);
    assert_eq!(free.report.placed(), 0, "{:?}", free.report.lines());
    let angles: Vec<f64> = (0..8).map(|k| TAU * f64::from(k) / 8.0).collect();
    let told = Constraints { axis: Some(axis), angles, ..Constraints::default() };
    right(&images, &aligned(&images, Turntable::No, &told));
}

#[test]
fn wrong_angles_place_nothing_wrongly() {
    let (images, axis) = turned(statue(), 6, 0.0);
    let angles: Vec<f64> = (0..6).map(|k| TAU * f64::from(k) / 9.0).collect();
    let told = Constraints { axis: Some(axis), angles, ..Constraints::default() };
    let alignment = aligned(&images, Turntable::No, &told);
    let off = errors(&images, &alignment);
    assert!(off.iter().flatten().all(|off| *off < 1.5), "{off:?} {:?}", alignment.report.lines());
    // It is no small print behind all scans.
    assert!(alignment.report.lines()[1].starts_with("the turntable was not found, and not used. "));
}

#[test]
fn a_vase_by_wrong_angles_is_left_out() {
    let (images, axis) = turned(&vase(), 6, 0.0);
    let away = Axis { point: axis.point + 0.2 * axis.direction.any_orthonormal_vector(), ..axis };
    let angles: Vec<f64> = (0..6).map(|k| TAU * f64::from(k) / 6.0).collect();
    let alignment =
        aligned(&images, Turntable::No, &Constraints { axis: Some(away), angles, ..Constraints::default() });
    assert_eq!(alignment.report.placed(), 0, "{:?}", alignment.report.lines());
}

#[test]
fn scans_in_another_order_than_the_steps_are_not_put_by_them() {
    let (mut images, _) = turned(statue(), 8, 0.0);
    images.swap(1, 2);
    let alignment = aligned(&images, Turntable::Equal, &Constraints::default());
    let off = errors(&images, &alignment);
    assert!(off.iter().flatten().all(|off| *off < 1.5), "{off:?} {}", alignment.report.lines().join("\n"));
    // It is no small print behind all scans.
    assert!(alignment.report.lines()[1].starts_with("the turntable was not found, and not used. "));
}

#[test]
fn an_axis_a_little_off_is_made_better() {
    let (images, axis) = turned(statue(), 8, 0.0);
    let rough = Axis { point: axis.point + DVec3::new(0.006, -0.004, 0.005), ..axis };
    let told = Constraints { axis: Some(rough), ..Constraints::default() };
    let alignment = aligned(&images, Turntable::Equal, &told);
    right(&images, &alignment);
    let found = alignment.report.turntable.unwrap().axis.point - axis.point;
    assert!(found.reject_from(axis.direction.normalize()).length() < 0.003, "{found}");
}

#[test]
fn what_cannot_be_is_refused() {
    let (images, axis) = turned(statue(), 2, 0.0);
    let text = |constraints: &Constraints| {
        let params = AlignParams::default();
        run(&sources(&images), &params, constraints, &Progress::none()).unwrap_err().to_string()
    };
    let flat = Axis { direction: DVec3::ZERO, ..axis };
    assert!(text(&Constraints { axis: Some(flat), ..Constraints::default() }).contains("axis"));
    assert!(text(&Constraints { angles: vec![0.0; 3], ..Constraints::default() }).contains("3 angles"));
    assert!(text(&Constraints { angles: vec![0.0, f64::NAN], ..Constraints::default() }).contains("scan 1"));
}
