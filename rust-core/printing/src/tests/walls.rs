//! Thin walls.

use close::print::walls::END;
use proptest::prelude::*;

use super::solids::{beside, mapped, relief, reversed, single};
use super::*;

/// Thickens, and holds what is promised: the same faces, no vertex farther than said.
fn thickened(mesh: &TriMesh, given: &PrepareParams) -> PreparedPrint {
    let result = prepared(mesh, given);
    let report = &result.report;
    assert_eq!(result.mesh.triangles, mesh.triangles);
    let moves = mesh.positions.iter().zip(&result.mesh.positions).map(|(a, b)| a.distance(*b));
    assert_eq!(report.deviation, moves.fold(0.0, f64::max));
    assert!(report.deviation <= given.min_wall.unwrap() * (1.0 + 1e-6), "{report:?}");
    let Some(AttributeData::Bool(thin)) = result.mesh.face_attribute("thin") else { panic!("they are marked") };
    assert_eq!(report.thin_faces, thin.iter().filter(|thin| **thin).count());
    assert_eq!(report.thin_faces > 0, report.notes.iter().any(|note| note.kind == PrepareProblem::StillThin));
    result
}

fn thick(min_wall: f64) -> PrepareParams {
    PrepareParams { min_wall: Some(min_wall), ..params() }
}

#[test]
fn plates_and_shells_get_thick() {
    let plate = single(&Shape::Cuboid { half: DVec3::new(3.0, 3.0, 0.2) }.mesh(6));
    let report = thickened(&plate, &thick(0.6)).report;
    assert!(is_near(report.wall_before.unwrap(), 0.4, 1e-3), "{report:?}");
    assert!(report.thin_faces == 0 && report.wall_after.unwrap() >= 0.6 * (1.0 - END), "{report:?}");
    assert!(report.deviation >= 0.0999 && report.deviation < 0.4 && report.moved_faces > 0, "{report:?}");
    assert!(report.volume > report.volume_before);
    let at = |radius: f64| single(&Shape::Sphere { radius }.mesh(10));
    let shell = beside(&at(1.0), &reversed(&at(0.95)));
    let report = thickened(&shell, &thick(0.15)).report;
    assert!(report.thin_faces == 0 && report.wall_after.unwrap() >= 0.15 * (1.0 - END), "{report:?}");
}

#[test]
fn walls_that_are_thick_stay_as_they_are() {
    let ball = bumpy(8);
    let result = thickened(&ball, &thick(0.1));
    assert_eq!((result.mesh.positions, result.report.deviation, result.report.moved_faces), (ball.positions, 0.0, 0));
}

#[test]
fn without_room_they_stay_thin_and_nothing_crosses() {
    let plate =
        |z: f64| mapped(&single(&Shape::Cuboid { half: DVec3::new(2.0, 2.0, 0.1) }.mesh(4)), move |p| p + z * DVec3::Z);
    let stack = beside(&beside(&plate(0.0), &plate(0.25)), &plate(0.5));
    let result = thickened(&stack, &thick(0.6));
    assert!(result.report.thin_faces > 0 && result.report.moved_faces > 0, "{:?}", result.report);
    assert!(result.report.volume > result.report.volume_before);
}

/// The cavity would shrink past the ball in it: no two faces cross then, but the ball lies in the wall.
#[test]
fn a_body_in_a_cavity_stays_in_it() {
    let at = |radius: f64, detail| single(&Shape::Sphere { radius }.mesh(detail));
    let shell = beside(&at(1.0, 9), &reversed(&at(0.9, 9)));
    let result = thickened(&beside(&shell, &at(0.87, 2)), &thick(0.3));
    assert!(result.report.moved_faces > 0, "{:?}", result.report);
}

#[test]
fn a_base_stays_flat() {
    let plate = single(&Shape::Cuboid { half: DVec3::new(2.0, 0.1, 2.0) }.mesh(5));
    let result = prepared(&plate, &PrepareParams { flat_base: true, base_height: Some(0.7), ..thick(0.5) });
    let lowest = result.mesh.positions.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
    assert!(is_near(lowest, -1.3, 1e-6), "{lowest}");
    assert!(result.report.wall_after.unwrap() > 0.45 && result.report.deviation > 0.1, "{:?}", result.report);
    let on_base = result.mesh.positions.iter().filter(|p| p.z == lowest).count();
    assert!(on_base >= 8, "{on_base}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(60)))]

    /// Thin plates with steep bumps, to thick and beyond what there is room for.
    #[test]
    fn any_relief_is_thickened_without_crossings(heights in prop::collection::vec(1_i64..6, 36), min_wall in 0.5..4.0_f64) {
        let solid = relief(6, &heights);
        let report = thickened(&solid, &thick(min_wall)).report;
        prop_assert!(report.volume >= report.volume_before, "{report:?}");
        prop_assert!((report.moved_faces > 0) == (report.deviation > 0.0));
    }
}
