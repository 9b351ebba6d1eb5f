//! Parts.

use glam::I64Vec3;
use proptest::prelude::*;

use super::solids::{single, voxels};
use super::*;

fn printer(size: [f64; 3]) -> PrepareParams {
    let [width, depth, height] = size.map(Some);
    PrepareParams { printer_width: width, printer_depth: depth, printer_height: height, ..params() }
}

/// Splits, and holds what is promised of parts: they fit, and they are the whole together.
fn split(mesh: &TriMesh, size: [f64; 3]) -> PreparedPrint {
    let result = prepared(mesh, &printer(size));
    let parts = result.parts();
    assert_eq!(parts.len(), result.report.parts);
    for part in &parts {
        let (lo, hi) = mesh::measure::bounds(&part.positions).unwrap();
        assert!((0..3).all(|axis| hi[axis] - lo[axis] <= size[axis] * (1.0 + 1e-6)), "{}", hi - lo);
        assert!(enclosed_volume(part) > 0.0);
    }
    assert!(is_near(parts.iter().map(enclosed_volume).sum(), result.report.volume_before, 1e-6));
    result
}

#[test]
fn a_cuboid_becomes_boxes_in_order() {
    let cuboid = single(&Shape::Cuboid { half: DVec3::new(1.0, 2.0, 4.0) }.mesh(2));
    let result = split(&cuboid, [2.0, 2.0, 3.0]);
    assert_eq!(result.report.parts, 6);
    let parts = result.parts();
    assert!(parts.iter().all(|part| is_near(enclosed_volume(part), 64.0 / 6.0, 1e-6)));
    let lowest = |part: &TriMesh| mesh::measure::bounds(&part.positions).unwrap().0;
    assert!(lowest(&parts[0]).y < lowest(&parts[1]).y && lowest(&parts[1]).z < lowest(&parts[2]).z);
    // As large as the printer, and along each axis.
    assert_eq!(split(&cuboid, [2.0, 4.0, 8.0]).report.parts, 1);
    for (up, count) in [(UpAxis::Z, 8), (UpAxis::Y, 4), (UpAxis::X, 2)] {
        let given = PrepareParams { printer_height: Some(1.0), print_up: up, ..params() };
        assert_eq!(prepared(&cuboid, &given).report.parts, count);
    }
}

#[test]
fn hollow_bodies_are_cut_with_their_cavity() {
    let mut ball = bumpy(12);
    ball.vertex_attributes = vec![Attribute::f32("intensity", ball.positions.iter().map(|p| p.x as f32).collect())];
    let given = PrepareParams {
        hollow: Some(0.15),
        flat_base: true,
        base_height: Some(0.2),
        drain: Some(0.1),
        ..printer([1.4, 1.4, 5.0])
    };
    let result = prepared(&ball, &given);
    let parts = result.parts();
    assert_eq!((parts.len(), result.report.parts), (4, 4));
    assert!(is_near(parts.iter().map(enclosed_volume).sum(), result.report.volume, 1e-6));
    let Some(AttributeData::F32(values)) = result.mesh.vertex_attribute("intensity") else { panic!("it is kept") };
    let Some(AttributeData::Bool(added)) = result.mesh.face_attribute("added") else { panic!("it is marked") };
    for (t, corners) in result.mesh.triangles.iter().enumerate().filter(|(t, _)| !added[*t]) {
        for &v in corners {
            assert!((f64::from(values[v as usize]) - result.mesh.positions[v as usize].x).abs() < 1e-6, "face {t}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(100)))]

    #[test]
    fn cells_are_split_exactly(cells in prop::collection::vec(prop::bool::weighted(0.6), 27), size in prop::array::uniform3(1_i64..7)) {
        prop_assume!(cells.contains(&true));
        let is_inside = |c: I64Vec3| {
            c.min_element() >= 0 && c.max_element() < 3 && cells[(c.x + 3 * (c.y + 3 * c.z)) as usize]
        };
        split(&voxels([3, 3, 3], is_inside), size.map(|size| size as f64));
    }
}
