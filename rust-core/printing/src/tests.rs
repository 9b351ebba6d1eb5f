//! Preparing as a whole, judged by code that shares nothing with it: topology, exact crossings, exact volumes.

mod bases;
mod hollows;
mod parts;
mod solids;
mod walls;

use glam::DVec3;

use base::error::Error;
use base::progress::Progress;
use close::{UpAxis, crossing_pairs};
use mesh::measure::enclosed_volume;
use mesh::shapes::Shape;
use mesh::{Attribute, AttributeData, TriMesh, check};
use solids::bumpy;

use super::*;

/// The six directions.
const UPS: [UpAxis; 6] = [UpAxis::Z, UpAxis::Y, UpAxis::X, UpAxis::MinusZ, UpAxis::MinusY, UpAxis::MinusX];

fn params() -> PrepareParams {
    PrepareParams { threads: 1, ..PrepareParams::default() }
}

/// Prepares, and holds what is promised of every result.
fn prepared(mesh: &TriMesh, params: &PrepareParams) -> PreparedPrint {
    let prepared = prepare_print(mesh, params, &Progress::none()).unwrap();
    prepared.parts().iter().for_each(sound);
    assert_eq!(prepared.report.volume, enclosed_volume(&prepared.mesh));
    let Some(AttributeData::Bool(added)) = prepared.mesh.face_attribute("added") else { panic!("it is marked") };
    assert_eq!(prepared.report.added_faces, added.iter().filter(|added| **added).count());
    prepared
}

fn sound(mesh: &TriMesh) {
    mesh.validate().unwrap();
    let report = check(mesh);
    assert!(report.is_closed(), "{report}");
    assert_eq!(report.unused_vertices, 0);
    assert_eq!(crossing_pairs(mesh, &Progress::none()).unwrap(), Vec::<[u32; 2]>::new());
}

fn is_near(a: f64, b: f64, share: f64) -> bool {
    (a - b).abs() <= share * a.abs().max(b.abs())
}

fn refused(mesh: &TriMesh, params: &PrepareParams) -> String {
    prepare_print(mesh, params, &Progress::none()).unwrap_err().to_string()
}

#[test]
fn what_encloses_nothing_is_refused_with_the_remedy() {
    let ball = Shape::Sphere { radius: 1.0 }.mesh(4);
    let mut open = ball.clone();
    open.triangles.pop();
    assert_eq!(refused(&open, &params()), "the mesh has 1 opening: close it first, by the operation close");
    let mut turned = ball.clone();
    turned.triangles.iter_mut().for_each(|t| t.swap(0, 1));
    assert!(refused(&turned, &params()).contains("flip its faces"));
    let mut crossing = ball.clone();
    crossing.positions[0] *= -1.5;
    assert!(refused(&crossing, &params()).contains("of faces cross"), "{}", refused(&crossing, &params()));
    let mut other = ball.clone();
    other.triangles[3].swap(0, 1);
    assert!(refused(&other, &params()).contains("oriented manifold"));
    let mut other = ball.clone();
    other.positions[3].x = f64::NAN;
    assert!(refused(&other, &params()).contains("not finite"));
    assert!(refused(&TriMesh::default(), &params()).contains("no triangles"));
    for (name, given) in [
        ("scale_to", PrepareParams { scale_to: Some(0.0), ..params() }),
        ("base_height", PrepareParams { flat_base: true, base_height: Some(-0.1), ..params() }),
        ("base_height", PrepareParams { flat_base: true, base_height: Some(f64::NAN), ..params() }),
        ("base_height", PrepareParams { flat_base: true, base_height: Some(2.5), ..params() }),
        (
            "drain is given without hollow",
            PrepareParams { drain: Some(0.1), flat_base: true, base_height: Some(0.1), ..params() },
        ),
        ("drain is given without flat_base", PrepareParams { drain: Some(0.1), hollow: Some(0.1), ..params() }),
        ("base_height is given without", PrepareParams { base_height: Some(0.1), ..params() }),
        ("hollow_cell is given without hollow", PrepareParams { hollow_cell: Some(0.1), ..params() }),
        ("hollow_cell is 0.1", PrepareParams { hollow: Some(0.2), hollow_cell: Some(0.1), ..params() }),
        ("drain_sides", PrepareParams { drain_sides: 2, ..params() }),
        ("printer_width is 0.01", PrepareParams { printer_width: Some(0.01), ..params() }),
    ] {
        assert!(refused(&ball, &given).starts_with(name), "{}", refused(&ball, &given));
    }
}

#[test]
fn without_steps_the_mesh_stays_as_it_is() {
    let ball = bumpy(6);
    let result = prepared(&ball, &params());
    assert_eq!((&result.mesh.positions, &result.mesh.triangles), (&ball.positions, &ball.triangles));
    let report = &result.report;
    assert_eq!((report.scale, report.deviation, report.added_faces), (1.0, 0.0, 0));
    assert_eq!(report.volume, report.volume_before);
}

#[test]
fn sides_get_the_length_that_is_asked_for() {
    let half = DVec3::new(1.0, 3.0, 0.5);
    let cuboid = Shape::Cuboid { half }.mesh(2);
    let longest = prepared(&cuboid, &PrepareParams { scale_to: Some(0.12), ..params() });
    assert!(is_near(longest.report.size[1], 0.12, 1e-15));
    assert!(is_near(longest.report.volume, 12.0 * 0.02_f64.powi(3), 1e-12));
    for (up, along) in UPS.into_iter().zip([2, 1, 0, 2, 1, 0]) {
        let given = PrepareParams { scale_to: Some(7.0), scale_side: ScaleSide::Height, print_up: up, ..params() };
        let report = prepared(&cuboid, &given).report;
        assert!(is_near(report.size[along], 7.0, 1e-15) && is_near(report.scale, 7.0 / (2.0 * half[along]), 1e-15));
    }
}

#[test]
fn cancelling_leaves_nothing_and_threads_change_nothing() {
    let ball = bumpy(16);
    let whole = PrepareParams {
        scale_to: Some(0.1),
        flat_base: true,
        base_height: Some(0.02),
        min_wall: Some(0.03),
        hollow: Some(0.01),
        drain: Some(0.01),
        printer_width: Some(0.06),
        ..params()
    };
    let expected = prepare_print(&ball, &whole, &Progress::none()).unwrap();
    for threads in [2, 3] {
        let mut result = prepare_print(&ball, &PrepareParams { threads, ..whole }, &Progress::none()).unwrap();
        result.report.seconds.clone_from(&expected.report.seconds);
        assert!(result == expected, "{threads} threads");
    }
    let mut checks = 0;
    while let Err(error) = prepare_print(&ball, &whole, &Progress::cancel_after(checks)) {
        assert!(matches!(error, Error::Cancelled), "{error}");
        checks += 1 + checks / 8;
    }
    assert!(checks > 20, "{checks}");
}
