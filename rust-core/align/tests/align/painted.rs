//! Shapes that may turn or slide, but are painted.

use base::progress::Progress;
use glam::DVec3;
use image::RangeImage;
use mesh::shapes::Shape;
use mesh::{Attribute, AttributeData, TriMesh};
use surfrecon_align::{AlignParams, Constraints, run};

use crate::scans::{aligned, errors, look, sources, without_poses};

/// Colours that are nowhere the same.
pub fn painted(mut mesh: TriMesh) -> TriMesh {
    let bright = |p: DVec3, seed: f64| {
        let waves = (1..6).map(|k| {
            let k = f64::from(k);
            let along = DVec3::new((k * 1.7 + seed).sin(), (k * 2.9 + 2.0 * seed).cos(), (k * 0.8 - seed).sin());
            (3.0 + 2.0 * k) * p.dot(along) + k * seed
        });
        (127.5 + 45.0 * waves.map(f64::sin).sum::<f64>()).clamp(0.0, 255.0) as u8
    };
    let colour = mesh.positions.iter().map(|&p| [bright(p, 0.3), bright(p, 1.1), bright(p, 2.2), 255]).collect();
    mesh.vertex_attributes.push(Attribute { name: "colour".to_owned(), data: AttributeData::Colour(colour) });
    mesh
}

fn right(images: &[RangeImage]) {
    let alignment = aligned(&without_poses(images), &Constraints::default());
    let off = errors(images, &alignment);
    assert!(off.iter().all(|off| off.is_some_and(|off| off < 1.5)), "{off:?} {}", alignment.report.lines().join("\n"));
    let by_shape = AlignParams { use_colour: false, ..AlignParams::default() };
    let alone = run(&sources(&without_poses(images)), &by_shape, &Constraints::default(), &Progress::none()).unwrap();
    assert_eq!(alone.report.placed(), 0, "{:?}", alone.report.lines());
}

fn looks(mesh: &TriMesh, noise: f64) -> Vec<RangeImage> {
    vec![
        look(mesh, DVec3::new(1.0, 0.3, 0.5), 0.2, noise),
        look(mesh, DVec3::new(0.7, 0.8, 0.45), 1.3, noise),
        look(mesh, DVec3::new(0.9, 0.5, 0.7), 0.7, noise),
    ]
}

#[test]
fn a_painted_ball_has_a_place() {
    right(&looks(&painted(Shape::Sphere { radius: 1.0 }.mesh(200)), 0.0));
}

#[test]
fn a_painted_cylinder_has_a_place() {
    right(&looks(&painted(Shape::Cylinder { radius: 0.6, half_height: 1.0 }.mesh(300)), 0.2));
}

#[test]
fn a_painted_plane_has_a_place() {
    let plane = painted(Shape::Plane { half: glam::DVec2::new(1.0, 0.8) }.mesh(150));
    right(&[look(&plane, DVec3::new(0.1, 0.2, 1.0), 0.2, 0.1), look(&plane, DVec3::new(-0.3, 0.1, 1.0), 1.0, 0.1)]);
}

#[test]
fn paint_in_rows_decides_nothing() {
    // Stripes along the cylinder repeat as it turns.
    let mut cylinder = Shape::Cylinder { radius: 0.6, half_height: 1.0 }.mesh(240);
    let stripe = |p: &DVec3| if (8.0 * p.y.atan2(p.x)).sin() > 0.0 { [230, 40, 40, 255] } else { [30, 60, 200, 255] };
    let colour = cylinder.positions.iter().map(stripe).collect();
    cylinder.vertex_attributes.push(Attribute { name: "colour".to_owned(), data: AttributeData::Colour(colour) });
    let alignment = aligned(&without_poses(&looks(&cylinder, 0.0)), &Constraints::default());
    assert_eq!(alignment.report.placed(), 0, "{:?}", alignment.report.lines());
}

#[test]
fn another_lamp_does_not_matter() {
    let ball = painted(Shape::Sphere { radius: 1.0 }.mesh(200));
    let mut images = looks(&ball, 0.0);
    for entry in images[1].colour.as_mut().unwrap() {
        *entry = [entry[0] / 2 + 20, entry[1] / 2 + 20, entry[2] / 2 + 40, entry[3]];
    }
    let alignment = aligned(&without_poses(&images), &Constraints::default());
    // Rightly or not at all.
    let kept = alignment.report.placed() > 0;
    let off = if kept { errors(&images, &alignment) } else { Vec::new() };
    assert!(off.iter().flatten().all(|off| *off < 5.0), "{off:?} {}", alignment.report.lines().join("\n"));
}
