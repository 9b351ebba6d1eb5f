//! Cavities and drains.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::solids::{beside, mapped, relief, single};
use super::*;

/// Prepares, and holds what is promised of cavities: vertices and faces of the surface come first, and distances are as asked within a cell.
fn hollowed(mesh: &TriMesh, params: &PrepareParams) -> PreparedPrint {
    let result = prepared(mesh, params);
    let report = &result.report;
    if !params.flat_base {
        assert_eq!(result.mesh.positions[..mesh.positions.len()], mesh.positions[..]);
        assert_eq!(result.mesh.triangles[..mesh.triangles.len()], mesh.triangles[..]);
    }
    if let Some((least, most)) = report.thinnest_wall.zip(report.thickest_wall) {
        let (wall, cell) = (params.hollow.unwrap(), report.hollow_cell.unwrap());
        assert!(least > wall - cell && least <= most && most < wall + cell, "{report:?}");
    }
    result
}

fn thick(wall: f64) -> PrepareParams {
    PrepareParams { hollow: Some(wall), ..params() }
}

#[test]
fn balls_cuboids_and_rings_are_hollowed_out() {
    let ball = single(&Shape::Sphere { radius: 1.0 }.mesh(24));
    let result = hollowed(&ball, &thick(0.2));
    assert!(
        is_near(result.report.volume_before - result.report.volume, 4.0 / 3.0 * PI * 0.512, 0.01),
        "{:?}",
        result.report
    );
    assert_eq!((check(&result.mesh).components, result.report.shut_cavities), (2, 1));
    let cuboid = single(&Shape::Cuboid { half: DVec3::new(1.0, 1.5, 2.0) }.mesh(3));
    let result = hollowed(&cuboid, &PrepareParams { hollow_cell: Some(0.05), ..thick(0.3) });
    assert!(is_near(result.report.volume_before - result.report.volume, 1.4 * 2.4 * 3.4, 0.01), "{:?}", result.report);
    let torus = single(&Shape::Torus { major: 2.0, minor: 0.7 }.mesh(24));
    let result = hollowed(&torus, &thick(0.3));
    assert!(is_near(result.report.volume_before - result.report.volume, TAU * 2.0 * PI * 0.16, 0.02));
    assert_eq!(check(&result.mesh).genus(), Some(2));
}

#[test]
fn thin_things_stay_solid_and_say_so() {
    for mesh in [
        single(&Shape::Cuboid { half: DVec3::new(5.0, 5.0, 0.39) }.mesh(2)),
        single(&Shape::Torus { major: 2.0, minor: 0.39 }.mesh(12)),
    ] {
        let result = hollowed(
            &mesh,
            &PrepareParams { drain: Some(0.1), flat_base: true, base_height: Some(1e-300), ..thick(0.4) },
        );
        assert_eq!(result.mesh.triangles, mesh.triangles);
        let kinds: Vec<_> = result.report.notes.iter().map(|note| note.kind).collect();
        assert!(
            kinds.contains(&PrepareProblem::NothingHollow) && kinds.contains(&PrepareProblem::NoDrain),
            "{kinds:?}"
        );
    }
    let error = refused(&bumpy(8), &PrepareParams { hollow_cell: Some(1e-5), ..thick(0.1) });
    assert!(error.contains("give a larger hollow_cell or thicker walls"), "{error}");
}

/// Coordinates of surveys, which round places on edges a million times more coarsely.
#[test]
fn far_from_the_origin_all_steps_are_as_exact() {
    for far in [1e3, 1e6] {
        let solid = mapped(&bumpy(12), |p| p + far * DVec3::new(1.0, 2.0, 3.0));
        for up in UPS {
            let given = PrepareParams {
                flat_base: true,
                base_height: Some(0.3),
                drain: Some(0.2),
                print_up: up,
                printer_height: Some(1.0),
                ..thick(0.15)
            };
            let report = prepared(&solid, &given).report;
            assert!(report.is_drained && report.parts > 1, "{report:?}");
            assert!(report.notes.iter().all(|note| note.kind == PrepareProblem::TooFine && far > 1e3), "{report:?}");
        }
    }
}

/// Area of the prism's section.
fn section(diameter: f64, sides: u32) -> f64 {
    let n = f64::from(sides);
    0.125 * n * diameter * diameter * (TAU / n).sin()
}

#[test]
fn a_drain_leads_through_the_base() {
    let ball = single(&Shape::Sphere { radius: 1.0 }.mesh(24));
    for up in UPS {
        let shut =
            PrepareParams { flat_base: true, base_height: Some(0.4), print_up: up, drain: Some(5.0), ..thick(0.2) };
        let without = hollowed(&ball, &shut);
        assert_eq!(without.report.notes[0].kind, PrepareProblem::NoDrain);
        let drain = 0.3;
        let with = hollowed(&ball, &PrepareParams { drain: Some(drain), drain_sides: 12, ..shut });
        assert!(with.report.is_drained && with.report.notes.is_empty(), "{:?}", with.report);
        let removed = without.report.volume - with.report.volume;
        assert!(is_near(removed, 0.2 * section(drain, 12), 1e-5), "{removed}");
        // The hole makes one surface of both.
        assert_eq!((check(&with.mesh).components, with.report.shut_cavities), (1, 0));
        assert_eq!(check(&with.mesh).genus(), Some(0));
        // The floor is a disc of this radius.
        let room = with.report.drain_room.unwrap();
        let radius = (0.64_f64 - 0.16).sqrt();
        assert!((0.5 * room - radius).abs() < 0.05, "{room}");
        // The base lies at one height, the floor one wall above it.
        let down = up.direction();
        let heights: Vec<f64> = with.mesh.positions.iter().map(|p| p.dot(down)).collect();
        let floor = heights.iter().filter(|&&h| (h + 0.4).abs() < 1e-6).count();
        assert!(floor > 24, "{floor}");
    }
}

#[test]
fn figures_with_several_cavities_say_which_stay_shut() {
    let at =
        |x: f64, z: f64| mapped(&single(&Shape::Sphere { radius: 1.0 }.mesh(16)), move |p| p + DVec3::new(x, 0.0, z));
    let pair = beside(&at(0.0, 0.0), &at(3.0, 0.1));
    let result =
        hollowed(&pair, &PrepareParams { flat_base: true, base_height: Some(0.3), drain: Some(0.2), ..thick(0.2) });
    assert!(result.report.is_drained);
    assert_eq!((result.report.shut_cavities, result.report.notes[0].kind), (1, PrepareProblem::ShutCavities));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(32)))]

    #[test]
    fn any_relief_is_hollowed_and_drained(heights in prop::collection::vec(3_i64..9, 25), wall in 0.5..1.2_f64, drain in 0.1..2.0_f64) {
        let solid = relief(5, &heights);
        let without = hollowed(&solid, &thick(wall));
        prop_assert!(without.report.thinnest_wall.is_some());
        let with = hollowed(&solid, &PrepareParams { flat_base: true, base_height: Some(0.5), drain: Some(drain), ..thick(wall) });
        prop_assert!(with.report.is_drained || with.report.notes.iter().any(|note| note.kind == PrepareProblem::NoDrain));
    }

    #[test]
    fn any_bumps_are_hollowed(wall in 0.05..0.35_f64, tilt in -1.0..1.0_f64) {
        let turn = glam::DQuat::from_rotation_y(tilt) * glam::DQuat::from_rotation_x(2.0 * tilt);
        let solid = mapped(&bumpy(8), |p| turn * p);
        let result = hollowed(&solid, &PrepareParams { hollow_cell: Some(wall / 3.0), flat_base: true, base_height: Some(0.2), drain: Some(0.1), ..thick(wall) });
        prop_assert!(result.report.is_drained, "{:?}", result.report);
    }
}
