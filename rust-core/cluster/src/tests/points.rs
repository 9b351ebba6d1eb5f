//! Points without triangles.

use super::*;

fn cluster_points(positions: Vec<DVec3>, resolution: Resolution) -> Result<Clustered> {
    let params = ClusterParams { resolution, threads: 2, ..ClusterParams::default() };
    run_points(&PointCloud { positions, ..PointCloud::default() }, &params, &Progress::none())
}

#[test]
fn points_of_a_surface_become_one_like_it() {
    let shapes = [
        ("sphere", sphere(), 2, 0),
        ("torus", torus(), 0, 0),
        ("open cylinder", open_cylinder(), 0, 2),
        ("thin box", Shape::Cuboid { half: DVec3::new(1.0, 1.0, 0.15) }.mesh(24), 2, 0),
    ];
    for (name, mesh, euler, loops) in shapes {
        for patches in [20, 90] {
            let result = cluster_points(mesh.positions.clone(), Resolution::Patches(patches)).unwrap();
            let found = check(&result.mesh);
            assert!(found.is_manifold(), "{name}, {patches}: {found}");
            assert_eq!(
                (found.euler_characteristic, found.boundary_loops),
                (euler, loops),
                "{name}, {patches}: {found}"
            );
            assert_eq!(result.labels.len(), mesh.positions.len());
            let off = result.labels.iter().filter(|&&l| l < 0).count();
            assert_eq!((off, result.report.off_surface), (0, 0), "{name}");
            assert!(result.report.after.mean_smallest_angle > result.report.before.mean_smallest_angle, "{name}");
        }
    }
}

#[test]
fn points_keep_a_largest_error_and_carry_their_attributes() {
    let mesh = sphere();
    let mut positions = mesh.positions.clone();
    // A copy, a point inside, and one that is none.
    positions.extend([positions[0], DVec3::ZERO, DVec3::NAN]);
    let count = positions.len();
    let cloud = PointCloud {
        intensity: Some(positions.iter().map(|p| if p.is_finite() { p.z as f32 } else { 0.0 }).collect()),
        positions,
        ..PointCloud::default()
    };
    let params = ClusterParams { resolution: Resolution::MaxError(0.02), ..ClusterParams::default() };
    let result = run_points(&cloud, &params, &Progress::none()).unwrap();
    let measured = measure::deviation(&mesh.positions, &result.mesh, Side::Ignored, 2, &Progress::none()).unwrap();
    assert!(measured.summary.max <= 0.02 && result.mesh.positions.len() < mesh.positions.len());
    assert_eq!((result.report.off_surface, result.labels.len()), (3, count));
    assert!(result.labels[count - 3..].iter().all(|&l| l == -1) && result.labels[..count - 3].iter().all(|&l| l >= 0));
    assert!(result.mesh.vertex_attribute("source_point").is_none());
    let Some(AttributeData::F32(heights)) = result.mesh.vertex_attribute("intensity") else { panic!() };
    assert!(result.mesh.positions.iter().zip(heights).all(|(p, &h)| (p.z - f64::from(h)).abs() < 1e-6));
}

#[test]
fn points_without_a_surface_say_so_and_any_call_can_be_stopped() {
    let text = |points: Vec<DVec3>| cluster_points(points, Resolution::Patches(5)).unwrap_err().to_string();
    assert!(text(Vec::new()).contains("at least 3 different points"));
    assert!(text(vec![DVec3::ONE; 40]).contains("at least 3 different points"));
    assert!(cluster_points((0..40).map(|i| DVec3::X * f64::from(i)).collect(), Resolution::Tenth).is_err());
    let cloud = PointCloud { positions: sphere().positions, ..PointCloud::default() };
    let params = ClusterParams { threads: 1, ..ClusterParams::default() };
    for checks in [0, 1, 3, 10, 30, 60] {
        let outcome = run_points(&cloud, &params, &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
    let same: Vec<TriMesh> = [1, 3]
        .map(|threads| run_points(&cloud, &ClusterParams { threads, ..params }, &Progress::none()).unwrap().mesh)
        .to_vec();
    assert!(same[0] == same[1]);
}
