//! Borders and thin rims are lines, no saws.

use super::*;

/// Vertices by polar coordinates, all around, and where each lies.
fn ring_mesh(around: usize, along: usize, at: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let vertex = |i: usize, j: usize| (j * around + i % around) as u32;
    let positions = (0..=along)
        .flat_map(|j| (0..around).map(move |i| (TAU * i as f64 / around as f64, j as f64 / along as f64)))
        .map(|(a, s)| at(a, s))
        .collect();
    let quads = (0..along).flat_map(|j| (0..around).map(move |i| (i, j)));
    let corners = |(i, j): (usize, usize)| {
        [[vertex(i, j), vertex(i + 1, j + 1), vertex(i + 1, j)], [vertex(i, j), vertex(i, j + 1), vertex(i + 1, j + 1)]]
    };
    TriMesh::new(positions, quads.flat_map(corners).collect())
}

fn round(a: f64, radius: f64, z: f64) -> DVec3 {
    DVec3::new(radius * a.cos(), radius * a.sin(), z)
}

/// Edges of one triangle only.
fn border(mesh: &TriMesh) -> Vec<[DVec3; 2]> {
    let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let all: std::collections::BTreeSet<[u32; 2]> = mesh.triangles.iter().flat_map(edges).collect();
    let open = all.iter().filter(|&&[a, b]| !all.contains(&[b, a]));
    open.map(|e| e.map(|v| mesh.positions[v as usize])).collect()
}

fn length(edges: &[[DVec3; 2]]) -> f64 {
    edges.iter().map(|[a, b]| a.distance(*b)).sum()
}

/// The farthest place of some edges from others.
fn farthest(edges: &[[DVec3; 2]], others: &[[DVec3; 2]]) -> f64 {
    let to_edge = |p: DVec3, [a, b]: [DVec3; 2]| {
        let t = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        p.distance(a + (b - a) * t)
    };
    let places = edges.iter().flat_map(|&[a, b]| (0..8).map(move |i| a + (b - a) * (f64::from(i) / 8.0)));
    places.map(|p| others.iter().map(|&e| to_edge(p, e)).fold(f64::INFINITY, f64::min)).fold(0.0, f64::max)
}

#[test]
fn borders_keep_their_length_and_place() {
    let disc = ring_mesh(96, 30, |a, s| round(a, 1e-3 + (1.0 - 1e-3) * s, 0.0));
    let annulus = ring_mesh(96, 30, |a, s| round(a, 0.4 + 0.6 * s, 0.0));
    let half_sphere = ring_mesh(96, 40, |a, s| {
        let polar = 0.01 + 1.56 * s;
        round(a, polar.sin(), polar.cos())
    });
    let mut sheet = square(40);
    let centre = DVec3::new(19.5, 19.5, 0.0);
    let cell = |t: &[u32; 3]| t.iter().all(|&v| sheet.positions[v as usize].distance(centre) > 8.0);
    let kept: Vec<[u32; 3]> = sheet.triangles.iter().copied().filter(cell).collect();
    sheet.triangles = kept;
    // The hole's border has steps nearly as long as the edges of the result.
    for (name, mesh, share) in [
        ("disc", disc, 0.35),
        ("annulus", annulus, 0.35),
        ("half sphere", half_sphere, 0.35),
        ("sheet with a hole", sheet, 0.6),
    ] {
        let input = border(&mesh);
        let size = mesh.positions.iter().map(|p| p.distance(mesh.positions[0])).fold(0.0, f64::max);
        for vertices in [250, 600] {
            let result = cluster(&mesh, Resolution::Vertices(vertices)).unwrap().mesh;
            let output = border(&result);
            let ratio = length(&output) / length(&input);
            assert!((0.93..1.01).contains(&ratio), "{name}, {vertices}: length {ratio}");
            let mean = length(&output) / output.len() as f64;
            let (there, back) = (farthest(&input, &output), farthest(&output, &input));
            assert!(there.max(back) < share * mean, "{name}, {vertices}: {there} {back} of {mean}");
            assert!(there.max(back) < 0.03 * size, "{name}, {vertices}: {there} {back} of {size}");
        }
    }
}

/// A lens, open in the middle of both faces, whose rim bends within an edge of the result.
fn lens() -> TriMesh {
    ring_mesh(160, 100, |a, s| {
        let polar: f64 = 0.15 + (std::f64::consts::PI - 0.3) * s;
        round(a, polar.sin(), 0.06 * polar.cos())
    })
}

/// The same closed.
fn closed_lens() -> TriMesh {
    let ball = Shape::Sphere { radius: 1.0 }.mesh(60);
    TriMesh::new(ball.positions.iter().map(|p| *p * DVec3::new(1.0, 1.0, 0.06)).collect(), ball.triangles)
}

#[test]
fn a_thin_rim_is_no_saw() {
    is_no_saw(&lens(), [(200, 0.15), (300, 0.115), (450, 0.09)]);
}

#[test]
fn a_thin_rim_of_a_closed_surface_is_no_saw() {
    is_no_saw(&closed_lens(), [(200, 0.125), (300, 0.095), (450, 0.066)]);
}

/// Places of the rim lie near the results of so many vertices: at most as far in the mean.
fn is_no_saw(mesh: &TriMesh, cases: [(u32, f64); 3]) {
    let places: Vec<DVec3> = mesh.positions.iter().copied().filter(|p| p.truncate().length() > 0.99).collect();
    for (vertices, most) in cases {
        let run = |threads| {
            let params =
                ClusterParams { resolution: Resolution::Vertices(vertices), threads, ..ClusterParams::default() };
            run(mesh, &params, &Progress::none()).unwrap()
        };
        let result = run(2);
        assert_same_topology(mesh, &result, "lens");
        let from = measure::deviation(&places, &result.mesh, Side::Ignored, 2, &Progress::none()).unwrap().summary;
        assert!(from.mean < most, "{vertices}: {}", from.mean);
        assert!(result.mesh == run(1).mesh, "another number of threads");
    }
}
