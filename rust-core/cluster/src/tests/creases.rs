//! Sharp edges of parts: edges of the result run along them.

use super::*;

const TURN: f64 = 40.0;

/// Edges whose triangles turn by more than 40 degrees.
fn sharp_edges(mesh: &TriMesh) -> Vec<[DVec3; 2]> {
    let mut sides = std::collections::BTreeMap::<[u32; 2], Vec<DVec3>>::new();
    for (t, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        let [p, q, r] = mesh.corners(t);
        let normal = (q - p).cross(r - p).normalize_or_zero();
        for [v, w] in [[a, b], [b, c], [c, a]] {
            sides.entry([v.min(w), v.max(w)]).or_default().push(normal);
        }
    }
    let turns = |n: &Vec<DVec3>| n.len() == 2 && n[0].dot(n[1]) < TURN.to_radians().cos();
    sides.iter().filter(|s| turns(s.1)).map(|s| s.0.map(|v| mesh.positions[v as usize])).collect()
}

fn length(edges: &[[DVec3; 2]]) -> f64 {
    edges.iter().map(|[p, q]| p.distance(*q)).sum()
}

/// A closed cylinder of radius and height 1 with a triangle fan for each end.
fn closed_cylinder() -> TriMesh {
    let (around, along) = (64, 12);
    let mut mesh = TriMesh::default();
    let ring = |mesh: &mut TriMesh, radius: f64, z: f64| {
        mesh.positions.extend((0..around).map(|i| {
            let a = TAU * f64::from(i) / f64::from(around);
            DVec3::new(radius * a.cos(), radius * a.sin(), z)
        }));
    };
    let inner = 10;
    (1..inner).for_each(|i| ring(&mut mesh, f64::from(i) / f64::from(inner), 0.0));
    (0..=along).for_each(|i| ring(&mut mesh, 1.0, f64::from(i) / f64::from(along)));
    (1..inner).rev().for_each(|i| ring(&mut mesh, f64::from(i) / f64::from(inner), 1.0));
    let rings = mesh.positions.len() as u32 / around;
    for (r, i) in (0..rings - 1).flat_map(|r| (0..around).map(move |i| (r, i))) {
        let [a, b] = [i, (i + 1) % around].map(|i| r * around + i);
        mesh.triangles.extend([[a, b, b + around], [a, b + around, a + around]]);
    }
    let [low, high] = [0.0, 1.0].map(|z| {
        mesh.positions.push(DVec3::Z * z);
        mesh.positions.len() as u32 - 1
    });
    for i in 0..around {
        let j = (i + 1) % around;
        let last = (rings - 1) * around;
        mesh.triangles.extend([[low, j, i], [high, last + i, last + j]]);
    }
    mesh
}

#[test]
fn the_edges_of_a_box_are_edges_of_the_result() {
    let half = DVec3::new(1.0, 0.8, 0.6);
    let mesh = Shape::Cuboid { half }.mesh(24);
    let all = 8.0 * (half.x + half.y + half.z);
    let at_edge = |p: &DVec3| (half - p.abs()).to_array().iter().filter(|gap| gap.abs() < 1e-12).count() >= 2;
    for resolution in [Resolution::Vertices(100), Resolution::Vertices(500), Resolution::MaxError(0.05)] {
        let result = cluster(&mesh, resolution).unwrap();
        assert_same_topology(&mesh, &result, "box");
        let edges = sharp_edges(&result.mesh);
        assert!((length(&edges) - all).abs() < 1e-9, "{resolution:?}: {} of {all}", length(&edges));
        assert!(edges.iter().flatten().all(at_edge));
        assert!(result.report.after.smallest_angle.to_degrees() > 30.0);
        if let Resolution::Vertices(wanted) = resolution {
            assert_eq!(result.mesh.positions.len(), wanted as usize);
        }
    }
    let params = ClusterParams { resolution: Resolution::Vertices(100), threads: 1, ..ClusterParams::default() };
    let alone = run(&mesh, &params, &Progress::none()).unwrap();
    assert!(alone.mesh == cluster(&mesh, params.resolution).unwrap().mesh, "another number of threads");
    // Switched off, it cuts across them.
    let off = run(&mesh, &ClusterParams { feature_angle: 0.0, ..params }, &Progress::none()).unwrap();
    assert!(!sharp_edges(&off.mesh).iter().flatten().all(at_edge));
    assert_same_topology(&mesh, &off, "off");
}

#[test]
fn rims_that_have_no_corner_are_kept() {
    let mesh = closed_cylinder();
    let before = length(&sharp_edges(&mesh));
    for vertices in [80, 300] {
        let result = cluster(&mesh, Resolution::Vertices(vertices)).unwrap();
        assert_same_topology(&mesh, &result, "cylinder");
        let edges = sharp_edges(&result.mesh);
        assert!((length(&edges) / before - 1.0).abs() < 0.02, "{vertices}: {} of {before}", length(&edges));
        let on_rim = |p: &DVec3| (p.z == 0.0 || p.z == 1.0) && (p.truncate().length() - 1.0).abs() < 2e-3;
        assert!(edges.iter().flatten().all(on_rim));
    }
}

/// A roof over a square: its ridge runs from border to border, or ends in the middle.
fn roof(ends: bool) -> TriMesh {
    let mut mesh = square(25);
    for p in &mut mesh.positions {
        let slope = if ends { (1.0 - p.y / 12.0).clamp(0.0, 1.0) } else { 1.0 };
        p.z = -slope * (p.x - 12.0).abs();
    }
    mesh
}

#[test]
fn creases_end_at_a_border_or_in_the_middle() {
    for vertices in [60, 200] {
        let whole = cluster(&roof(false), Resolution::Vertices(vertices)).unwrap();
        assert_same_topology(&roof(false), &whole, "roof");
        assert!((length(&sharp_edges(&whole.mesh)) - 24.0).abs() < 1e-9, "{}", length(&sharp_edges(&whole.mesh)));
    }
    // If it turns by less than the angle, no crease is found.
    let fading = cluster(&roof(true), Resolution::Vertices(200)).unwrap();
    assert_same_topology(&roof(true), &fading, "fading roof");
    let on_ridge = fading.mesh.positions.iter().filter(|p| p.x == 12.0 && p.y < 8.0).count();
    assert!(on_ridge >= 4, "{on_ridge}");
}

#[test]
fn noise_makes_no_creases() {
    // A third of the edges turn by more than 40 degrees, in runs all over.
    let mut mesh = Shape::Sphere { radius: 1.0 }.mesh(20);
    let mut state = 1_u64;
    for p in &mut mesh.positions {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        *p *= 1.0 + 0.04 * ((state >> 40) as f64 / f64::from(1 << 24) - 0.5);
    }
    assert!(10 * sharp_edges(&mesh).len() > mesh.triangles.len(), "{}", sharp_edges(&mesh).len());
    for vertices in [150, 500] {
        let params = ClusterParams { resolution: Resolution::Vertices(vertices), ..ClusterParams::default() };
        let [kept, off] = [params, ClusterParams { feature_angle: 0.0, ..params }]
            .map(|params| run(&mesh, &params, &Progress::none()).unwrap().mesh);
        assert!(kept == off, "{vertices}");
    }
}

#[test]
fn a_least_angle_keeps_the_edges_of_a_box() {
    let mesh = Shape::Cuboid { half: DVec3::ONE }.mesh(20);
    let resolution = Resolution::Vertices(150);
    let params = ClusterParams { resolution, min_angle: 0.5, threads: 2, ..ClusterParams::default() };
    let result = run(&mesh, &params, &Progress::none()).unwrap();
    let found = length(&sharp_edges(&result.mesh));
    assert!((found / 24.0 - 1.0).abs() < 0.02, "{found}");
}
