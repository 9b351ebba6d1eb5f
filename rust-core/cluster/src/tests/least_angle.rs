//! With a least angle: nearer at the same number of vertices, whatever the shape of the triangles.

use super::*;

fn least(mesh: &TriMesh, resolution: Resolution, threads: usize) -> Clustered {
    let params = ClusterParams { resolution, min_angle: 30_f64.to_radians(), threads, ..ClusterParams::default() };
    run(mesh, &params, &Progress::none()).unwrap()
}

/// Vertices leave the surface.
fn assert_topology(input: &TriMesh, result: &TriMesh, what: &str) {
    let (before, after) = (check(input), check(result));
    assert!(after.is_manifold(), "{what}: {after}");
    assert_eq!(before.euler_characteristic, after.euler_characteristic, "{what}");
    assert_eq!(before.boundary_loops, after.boundary_loops, "{what}");
    assert_eq!(before.components, after.components, "{what}");
}

fn deviation(mesh: &TriMesh, result: &TriMesh) -> DistanceReport {
    measure::deviation(&mesh.positions, result, Side::Ignored, 2, &Progress::none()).unwrap().summary
}

#[test]
fn a_least_angle_leaves_less_error_at_the_same_number_of_vertices() {
    // A sphere bends alike all ways: even triangles are best on it.
    let cases = [
        ("sphere", sphere(), 1.1),
        ("torus", torus(), 0.85),
        ("open cylinder", open_cylinder(), 0.8),
        ("double torus", double_torus(), 0.85),
    ];
    for (name, mesh, share) in cases {
        let resolution = Resolution::Vertices(220);
        let fitted = ClusterParams { resolution, fitting: 2, ..ClusterParams::default() };
        let fitted = run(&mesh, &fitted, &Progress::none()).unwrap();
        let found = least(&mesh, resolution, 2);
        assert_topology(&mesh, &found.mesh, name);
        assert_eq!(found.mesh.positions.len(), fitted.mesh.positions.len(), "{name}");
        let degrees = found.report.after.smallest_angle.to_degrees();
        assert!(degrees >= 30.0 - 1e-9, "{name}: {degrees}");
        let [mean, before] = [&found, &fitted].map(|r| deviation(&mesh, &r.mesh).mean);
        assert!(mean < share * before, "{name}: {mean} {before}");
        assert!(found.mesh == least(&mesh, resolution, 1).mesh, "{name}: another number of threads");
    }
}

#[test]
fn a_border_stays_a_border() {
    let mesh = open_cylinder();
    let result = least(&mesh, Resolution::Vertices(150), 2).mesh;
    let links: std::collections::BTreeSet<[u32; 2]> =
        result.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    let border = links.iter().filter(|e| !links.contains(&[e[1], e[0]])).map(|e| result.positions[e[0] as usize]);
    let mut count = 0;
    for p in border {
        assert!(p.z.abs() < 1e-9 || (p.z - 3.0).abs() < 1e-9, "{p}");
        assert!((p.truncate().length() - 1.0).abs() < 0.01, "{p}");
        count += 1;
    }
    assert!(count >= 6);
}

#[test]
fn a_largest_error_is_kept_with_a_least_angle() {
    for (name, mesh) in [("torus", torus()), ("thin plate", thin_plate())] {
        let bound = 0.03;
        let result = least(&mesh, Resolution::MaxError(bound), 2);
        assert!(!result.report.kept_input, "{name}");
        assert_topology(&mesh, &result.mesh, name);
        assert!(
            farthest_of_many(&result.mesh, &mesh) <= bound && farthest_of_many(&mesh, &result.mesh) <= bound,
            "{name}"
        );
    }
}

#[test]
fn attributes_are_those_of_the_surface_beside() {
    let mut mesh = torus();
    let height = mesh.positions.iter().map(|p| p.x as f32).collect();
    mesh.vertex_attributes.push(Attribute { name: "x".into(), data: AttributeData::F32(height) });
    let result = least(&mesh, Resolution::Vertices(150), 2).mesh;
    let Some(AttributeData::F32(values)) = result.vertex_attribute("x") else { panic!() };
    for (p, x) in result.positions.iter().zip(values) {
        assert!((p.x - f64::from(*x)).abs() < 0.12, "{p} {x}");
    }
}

#[test]
fn any_number_of_vertices_and_cancelled_at_any_check() {
    for (name, mesh) in [("torus", torus()), ("plate", thin_plate()), ("cylinder", open_cylinder())] {
        // All of them by the second tier alone.
        let all = [700, 30, 1, 1_000_000];
        for &wanted in &all[..base::tier::cases(4) as usize] {
            let result = least(&mesh, Resolution::Vertices(wanted), 2);
            assert_topology(&mesh, &result.mesh, name);
            assert!(result.mesh.positions.len() <= mesh.positions.len().max(wanted as usize), "{name} {wanted}");
            assert!(wanted != 700 || result.mesh.positions.len() == 700, "{name} {}", result.mesh.positions.len());
        }
    }
    let params = ClusterParams { min_angle: 0.5, threads: 1, ..ClusterParams::default() };
    let mesh = torus();
    for checks in [0, 10, 50, 80, 100, 120, 150] {
        let outcome = run(&mesh, &params, &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(32)))]

    /// A soup of any triangles becomes a manifold of the same topology at any number.
    #[test]
    fn any_soup_becomes_a_manifold_with_a_least_angle(
        triangles in prop::collection::vec([0..12_u32, 0..12_u32, 0..12_u32], 1..40),
        places in prop::collection::vec([-3..3_i32, -3..3, -3..3], 12),
        count in 1..20_u32,
    ) {
        let positions = places.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
        let mesh = TriMesh::new(positions, triangles.clone());
        for resolution in [Resolution::Patches(count), Resolution::Vertices(count)] {
            let params = ClusterParams { resolution, min_angle: 0.5, ..ClusterParams::default() };
            match run(&mesh, &params, &Progress::none()) {
                Ok(result) => prop_assert!(check(&result.mesh).is_manifold(), "{}", check(&result.mesh)),
                Err(_) => prop_assert!(triangles.iter().all(|[a, b, c]| a == b || b == c || c == a)),
            }
        }
    }

    /// Holes of any shape in a torus stay.
    #[test]
    fn holes_stay_with_a_least_angle(cuts in prop::collection::vec(0..1024_usize, 0..60), vertices in 1..300_u32) {
        let mut mesh = Shape::Torus { major: 2.0, minor: 0.6 }.mesh(8);
        let count = mesh.triangles.len();
        let gone: std::collections::BTreeSet<usize> = cuts.iter().map(|c| c % count).collect();
        let mut t = 0;
        mesh.triangles.retain(|_| (!gone.contains(&t), t += 1).0);
        let result = least(&mesh, Resolution::Vertices(vertices), 2);
        let (before, after) = (check(&mesh), check(&result.mesh));
        prop_assert!(after.is_manifold());
        if before.is_manifold() {
            prop_assert_eq!(before.euler_characteristic, after.euler_characteristic);
            prop_assert_eq!(before.boundary_loops, after.boundary_loops);
        }
    }
}
