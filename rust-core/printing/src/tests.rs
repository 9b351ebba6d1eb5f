//! Preparing as a whole, judged by code that shares nothing with it: topology, exact crossings, exact volumes.

mod bases;
mod hollows;
mod parts;
mod solids;
mod walls;

use glam::DVec3;

use base::error::Error;
use base::progress::Progress;
use close::bodies::{Bodies, Lies};
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
    let is_single = prepared.mesh.positions.iter().all(|&p| p == p.as_vec3().as_dvec3());
    assert!(is_single || prepared.report.notes.iter().any(|note| note.kind == PrepareProblem::TooFine));
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
    let bodies = Bodies::new(mesh, true, &Progress::none()).unwrap().list;
    assert!(bodies.iter().all(|body| matches!(body.lies(), Lies::Outer | Lies::Cavity)), "{bodies:?}");
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
    let small = Shape::Sphere { radius: 0.1 }.mesh(4);
    let away = solids::mapped(&solids::reversed(&small), |p| p + 3.0 * DVec3::X);
    let text = refused(&solids::beside(&ball, &away), &params());
    assert!(
        text.starts_with("1 body is inside out, the first at (") && text.ends_with("flip its faces first"),
        "{text}"
    );
    let text = refused(&solids::beside(&ball, &small), &params());
    assert!(text.starts_with("1 body lies in the solid of another, the first at ("), "{text}");
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
        ("scale_to", PrepareParams { scale_to: Some(1e39), ..params() }),
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
        ("drain_sides is given without drain", PrepareParams { drain_sides: 8, ..params() }),
        ("scale_side is given without", PrepareParams { scale_side: ScaleSide::Height, ..params() }),
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
    assert!(is_near(longest.report.size[1], 0.12, 1e-6));
    assert!(is_near(longest.report.volume, 12.0 * 0.02_f64.powi(3), 1e-6));
    for (up, along) in UPS.into_iter().zip([2, 1, 0, 2, 1, 0]) {
        let given = PrepareParams { scale_to: Some(7.0), scale_side: ScaleSide::Height, print_up: up, ..params() };
        let report = prepared(&cuboid, &given).report;
        assert!(is_near(report.size[along], 7.0, 1e-6) && is_near(report.scale, 7.0 / (2.0 * half[along]), 1e-15));
    }
}

/// The base cuts some height off, and thicker walls add some.
#[test]
fn sides_have_their_length_once_all_is_done() {
    let ball = bumpy(10);
    for (scale_side, base_height) in
        [(ScaleSide::Longest, None), (ScaleSide::Height, None), (ScaleSide::Height, Some(60.0))]
    {
        let given = PrepareParams { scale_to: Some(300.0), scale_side, flat_base: true, base_height, ..params() };
        let report = prepared(&ball, &given).report;
        let longest = report.size.into_iter().fold(0.0, f64::max);
        let side = if scale_side == ScaleSide::Height { report.size[2] } else { longest };
        assert!(is_near(side, 300.0, 1e-6), "{report:?}");
        assert!(
            report.base_faces > 0
                && is_near(report.base_height.unwrap(), base_height.unwrap_or(0.0), 1e-6) == base_height.is_some()
        );
    }
    let at = |radius: f64| Shape::Sphere { radius }.mesh(6);
    let shell = solids::beside(&at(1.0), &solids::reversed(&at(0.95)));
    let report = prepared(&shell, &PrepareParams { scale_to: Some(2.0), min_wall: Some(0.15), ..params() }).report;
    assert!(report.deviation > 0.02 && is_near(report.size[0], 2.0, 1e-4), "{report:?}");
    assert!(report.scale < 0.98 && report.notes.is_empty(), "{report:?}");
    // A wall that is thicker than the side may be.
    let plate = Shape::Cuboid { half: DVec3::new(2.0, 2.0, 0.1) }.mesh(3);
    let given = PrepareParams { scale_to: Some(4.0), scale_side: ScaleSide::Height, min_wall: Some(6.0), ..params() };
    let notes = prepared(&plate, &given).report.notes;
    assert_eq!(notes.iter().map(|note| note.kind).collect::<Vec<_>>(), [PrepareProblem::SizeMissed]);
    assert!(notes[0].text.starts_with("The side is 6 long, not 4: "), "{notes:?}");
}

#[test]
fn thin_faces_are_those_of_the_result() {
    let plate = Shape::Cuboid { half: DVec3::new(2.0, 2.0, 0.1) }.mesh(2);
    let above = |z: f64| solids::mapped(&plate, move |p| p + z * DVec3::Z);
    let stack = solids::beside(&solids::beside(&plate, &above(0.25)), &above(0.5));
    let given = PrepareParams { min_wall: Some(0.6), printer_width: Some(1.1), ..params() };
    let result = prepared(&stack, &given);
    let Some(AttributeData::Bool(thin)) = result.mesh.face_attribute("thin") else { panic!("they are marked") };
    let count = thin.iter().filter(|thin| **thin).count();
    assert!(result.report.parts > 1 && count > 0);
    assert_eq!(result.report.thin_faces, count);
    let note = result.report.notes.iter().find(|note| note.kind == PrepareProblem::StillThin).unwrap();
    assert!(note.text.starts_with(&format!("{count} faces still have")), "{}", note.text);
}

/// Nodes of the cavity lie in the plane of its floor unless the grid is moved: vertices would meet there once they are written.
#[test]
fn single_precision_tells_all_vertices_apart() {
    let given = PrepareParams {
        scale_to: Some(60.0),
        flat_base: true,
        min_wall: Some(2.0),
        hollow: Some(3.0),
        drain: Some(4.0),
        ..params()
    };
    let solid = solids::mapped(&bumpy(12), |p| p * 0.1 + 0.7);
    for given in [given, PrepareParams { printer_height: Some(35.0), ..given }] {
        let result = prepared(&solid, &given);
        assert!(result.report.is_drained && result.report.notes.is_empty(), "{:?}", result.report);
        for part in result.parts() {
            let mut places: Vec<_> = part.positions.iter().map(|p| (*p + 0.0).to_array().map(f64::to_bits)).collect();
            places.sort_unstable();
            assert!(places.windows(2).all(|pair| pair[0] != pair[1]));
        }
    }
}

/// Cosines of right angles are 6e-17. A cut there would leave edges as long, which programs for printing take for points.
#[test]
fn cuts_along_vertices_that_are_nearly_in_a_plane_leave_no_tiny_edges() {
    let mut post = solids::mapped(&bumpy(8), |p| DVec3::new(p.x * 30.0, p.y * 30.0, p.z * 30.0));
    post.positions.iter_mut().for_each(|place| place.x = if place.x.abs() < 4.0 { 1e-15 * place.y } else { place.x });
    assert!(post.positions.iter().filter(|place| place.x.abs() < 1e-13).count() > 4);
    for given in [
        PrepareParams { printer_width: Some(40.0), ..params() },
        PrepareParams { flat_base: true, base_height: Some(1e-9), ..params() },
        PrepareParams { print_up: UpAxis::X, flat_base: true, base_height: Some(30.0), ..params() },
    ] {
        let result = prepared(&post, &given);
        for part in result.parts() {
            assert!(check(&part).is_closed());
            let sides = part.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
            let shortest = sides.map(|[a, b]| part.positions[a as usize].distance(part.positions[b as usize]));
            let shortest = shortest.fold(f64::INFINITY, f64::min);
            assert!(shortest > 1e-6, "{shortest} with {given:?}");
        }
    }
}

#[test]
fn too_fine_for_single_precision_stays_double_and_says_so() {
    let ball = bumpy(6);
    let far = solids::mapped(&ball, |p| p + 1e9);
    let mut close = ball.clone();
    let [a, b, _] = close.triangles[0].map(|v| v as usize);
    close.positions[a] = close.positions[b].lerp(close.positions[a], 1e-9);
    for (mesh, text) in [(&far, "where others do in single precision"), (&close, "2 vertices lie where others do")] {
        let result = prepared(mesh, &params());
        assert_eq!(result.mesh.positions, mesh.positions);
        let [note] = &result.report.notes[..] else { panic!("{:?}", result.report.notes) };
        assert!(note.kind == PrepareProblem::TooFine && note.text.contains(text), "{}", note.text);
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
        checks += 1 + checks / 4;
    }
    assert!(checks > 20, "{checks}");
}
