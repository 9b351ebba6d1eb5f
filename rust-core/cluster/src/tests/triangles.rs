//! As many triangles as asked for, and the largest error of any result.

use super::*;

/// Three spheres, a tube and a plate, apart.
fn many_parts() -> TriMesh {
    let mut all = TriMesh::default();
    for (k, part) in [sphere(), sphere(), open_cylinder(), square(14), sphere()].into_iter().enumerate() {
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions.iter().map(|p| *p + DVec3::Y * (20.0 * k as f64)));
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

/// A square with holes of all sizes.
fn sieve() -> TriMesh {
    let mut mesh = square(40);
    let holes = [(8.0, 8.0, 5.0), (28.0, 10.0, 3.0), (12.0, 28.0, 6.0), (30.0, 30.0, 2.0)];
    let outside = |t: &[u32; 3]| {
        let p = mesh.positions[t[0] as usize];
        holes.iter().all(|&(x, y, radius)| p.distance(DVec3::new(x, y, 0.0)) > radius)
    };
    let kept: Vec<[u32; 3]> = mesh.triangles.iter().copied().filter(outside).collect();
    mesh.triangles = kept;
    mesh
}

fn of(mesh: &TriMesh, triangles: u32, params: ClusterParams) -> Clustered {
    let params = ClusterParams { resolution: Resolution::Triangles(triangles), threads: 2, ..params };
    run(mesh, &params, &Progress::none()).unwrap()
}

#[test]
fn the_number_of_triangles_is_the_one_asked_for_or_one_fewer() {
    let shapes = [
        ("sphere", sphere()),
        ("torus", torus()),
        ("double torus", double_torus()),
        ("open cylinder", open_cylinder()),
        ("square", square(24)),
        ("sieve", sieve()),
        ("thin plate", thin_plate()),
        ("many parts", many_parts()),
    ];
    for (name, mesh) in shapes {
        let closed = check(&mesh).is_closed();
        for wanted in [300, 401, 666, 1000] {
            for (fitting, min_angle) in [(0, 0.0), (2, 20_f64.to_radians())] {
                let result = of(&mesh, wanted, ClusterParams { fitting, min_angle, ..ClusterParams::default() });
                let got = result.mesh.triangles.len() as u32;
                let what = format!("{name}, {wanted} triangles, least angle {min_angle}: {got}");
                assert!(got <= wanted && got + 1 >= wanted, "{what}");
                // A closed surface has an even number.
                assert!(!closed || got.is_multiple_of(2), "{what}");
                assert_eq!(got as usize, result.report.triangles);
                let figures = |r: &mesh::CheckReport| (r.euler_characteristic, r.components, r.boundary_loops);
                assert_eq!(figures(&check(&mesh)), figures(&check(&result.mesh)), "{what}");
            }
        }
    }
}

#[test]
fn the_topology_may_need_more_triangles_and_the_input_may_have_too_few() {
    for (name, mesh) in [("double torus", double_torus()), ("many parts", many_parts()), ("sphere", sphere())] {
        let result = of(&mesh, 1, ClusterParams::default());
        assert_same_topology(&mesh, &result, name);
        assert!(result.mesh.triangles.len() < 120, "{name}: {}", result.mesh.triangles.len());
    }
    let few = of(&sphere(), 596, ClusterParams::default()).mesh;
    // More than the input has can be had, but not any number.
    assert_eq!(of(&few, 900, ClusterParams::default()).mesh.triangles.len(), 900);
    let results = [6 * 300, 4_000_000_000].map(|wanted| of(&few, wanted, ClusterParams::default()).mesh);
    assert_eq!(results[0], results[1]);
    // Single triangles have no coarser form.
    let corner = |i: u32| DVec3::new(f64::from(3 * i), 0.0, 0.0);
    let positions = (0..50).flat_map(|i| [corner(i), corner(i) + DVec3::X, corner(i) + DVec3::Y]).collect();
    let mesh = TriMesh::new(positions, (0..50).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let result = of(&mesh, 10, ClusterParams::default());
    assert!(result.report.kept_input && result.report.triangles == 50 && result.report.max_error == 0.0);
}

#[test]
fn levels_may_be_of_triangles_and_of_vertices() {
    let mesh = torus();
    let wanted = [Resolution::Triangles(800), Resolution::Vertices(100), Resolution::Triangles(100)];
    let chain = levels(&mesh, &wanted, &ClusterParams::default(), &Progress::none()).unwrap();
    assert_eq!(chain.iter().map(|l| l.mesh.triangles.len()).collect::<Vec<_>>(), [800, 200, 100]);
}

#[test]
fn the_largest_error_is_measured_whatever_was_asked_for() {
    for (name, mesh) in [("torus", torus()), ("cylinder", open_cylinder()), ("many parts", many_parts())] {
        for resolution in [Resolution::Tenth, Resolution::Triangles(700), Resolution::Patches(90)] {
            for fitting in [0, 2] {
                let params = ClusterParams { resolution, fitting, threads: 2, ..ClusterParams::default() };
                let result = run(&mesh, &params, &Progress::none()).unwrap();
                let (bound, deviation) = (result.report.max_error, &result.report.deviation);
                let most = farthest_of_many(&mesh, &result.mesh).max(farthest_of_many(&result.mesh, &mesh));
                // No more than it can be, and no more than it is.
                assert!(most <= bound + 1e-12 && bound <= 1.1 * most, "{name}, {resolution:?}: {bound}, found {most}");
                assert!(deviation.max <= bound && deviation.rms < deviation.max);
                assert_eq!(result.report.rms_error, deviation.rms);
                let anew = measure::deviation(&mesh.positions, &result.mesh, Side::Ignored, 2, &Progress::none());
                assert_eq!(anew.unwrap().summary, *deviation);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(48)))]

    /// Cutting triangles out of a torus makes borders of any shape.
    #[test]
    fn of_any_holes(cuts in prop::collection::vec(0..2048_usize, 0..60), wanted in 500..1500_u32) {
        let mut mesh = Shape::Torus { major: 2.0, minor: 0.6 }.mesh(16);
        let count = mesh.triangles.len();
        let gone: std::collections::BTreeSet<usize> = cuts.iter().map(|c| c % count).collect();
        let mut t = 0;
        mesh.triangles.retain(|_| (!gone.contains(&t), t += 1).0);
        let result = of(&mesh, wanted, ClusterParams::default());
        let got = result.mesh.triangles.len() as u32;
        prop_assert!(got <= wanted && got + 1 >= wanted, "{got} of {wanted}");
        prop_assert!(check(&result.mesh).is_manifold());
    }
}
