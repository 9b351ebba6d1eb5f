//! Whole runs: topology kept, bounds kept, anything accepted.

use std::f64::consts::TAU;

use glam::DVec3;
use proptest::prelude::*;

mod creases;
mod least_angle;
mod points;
mod rims;
mod triangles;

use super::*;
use base::{Error, Progress, Result};
use mesh::measure::{self, DistanceReport, Side};
use mesh::point_cloud::PointCloud;
use mesh::shapes::Shape;
use mesh::{Attribute, AttributeData, TriMesh, check};

fn cluster(mesh: &TriMesh, resolution: Resolution) -> Result<Clustered> {
    run(mesh, &ClusterParams { resolution, threads: 2, ..ClusterParams::default() }, &Progress::none())
}

fn sphere() -> TriMesh {
    Shape::Sphere { radius: 1.0 }.mesh(12)
}

fn torus() -> TriMesh {
    Shape::Torus { major: 2.0, minor: 0.6 }.mesh(16)
}

/// A tube without its ends.
fn open_cylinder() -> TriMesh {
    let (around, along) = (48, 30);
    let at = |i: usize, j: usize| (j * around + i % around) as u32;
    let positions = (0..=along)
        .flat_map(|j| (0..around).map(move |i| (TAU * i as f64 / around as f64, j)))
        .map(|(a, j)| DVec3::new(a.cos(), a.sin(), 0.1 * j as f64))
        .collect();
    let quads = (0..along).flat_map(|j| (0..around).map(move |i| (i, j)));
    let triangles = quads
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
        .collect();
    TriMesh::new(positions, triangles)
}

/// Two tori, one's hole beside the other's, joined: a triangle of each is cut out and the rims are sewn together.
fn double_torus() -> TriMesh {
    let one = torus();
    let n = one.positions.len() as u32;
    let outermost = |sign: f64| {
        let middle = |t: usize| one.corners(t).iter().map(|p| p.x * sign).sum::<f64>();
        (0..one.triangles.len()).max_by(|&s, &t| middle(s).total_cmp(&middle(t))).unwrap()
    };
    let (cut, other_cut) = (outermost(1.0), outermost(-1.0));
    let mut mesh = one.clone();
    mesh.positions.extend(one.positions.iter().map(|p| *p + DVec3::X * 5.4));
    mesh.triangles.extend(one.triangles.iter().map(|t| t.map(|v| v + n)));
    let a = one.triangles[cut];
    let b = one.triangles[other_cut].map(|v| v + n);
    mesh.triangles.retain(|t| *t != a && *t != b);
    // The rims run against each other; which corner meets which matters little.
    for k in 0..3 {
        let (a0, a1) = (a[k], a[(k + 1) % 3]);
        let (b0, b1) = (b[(3 - k) % 3], b[(2 - k) % 3]);
        mesh.triangles.extend([[a0, a1, b0], [a1, b1, b0]]);
    }
    mesh
}

/// A plate much thinner than a patch.
fn thin_plate() -> TriMesh {
    Shape::Cuboid { half: DVec3::new(1.0, 1.0, 0.004) }.mesh(14)
}

/// The topology of `result` is that of `input`, and it is a manifold on its surface.
fn assert_same_topology(input: &TriMesh, result: &Clustered, what: &str) {
    let (before, after) = (check(input), check(&result.mesh));
    assert!(after.is_manifold(), "{what}: {after}");
    assert_eq!(after.unused_vertices, 0, "{what}");
    let figures = |r: &mesh::CheckReport| (r.euler_characteristic, r.components, r.boundary_loops, r.genus());
    assert_eq!(figures(&before), figures(&after), "{what}: {before} -> {after}");
    let on = measure::deviation(&result.mesh.positions, input, Side::Ignored, 2, &Progress::none()).unwrap();
    let (low, high) = measure::bounds(&input.positions).unwrap();
    assert!(on.summary.max <= 1e-12 * low.distance(high), "{what}: a vertex off the surface by {}", on.summary.max);
}

#[test]
fn the_topology_is_that_of_the_input_at_any_resolution() {
    let shapes = [
        ("sphere", sphere(), 0),
        ("torus", torus(), 1),
        ("double torus", double_torus(), 2),
        ("open cylinder", open_cylinder(), 0),
        ("thin plate", thin_plate(), 0),
    ];
    for (name, mesh, genus) in shapes {
        assert_eq!(check(&mesh).genus(), Some(genus), "{name}");
        let all = [77, 1, 2, 3, 10, 400, 100_000];
        for &patches in &all[..base::tier::cases(7) as usize] {
            let result = cluster(&mesh, Resolution::Patches(patches)).unwrap();
            assert_same_topology(&mesh, &result, &format!("{name}, {patches} patches"));
        }
    }
}

#[test]
fn the_number_of_vertices_is_the_one_asked_for() {
    for (mesh, wanted) in [(sphere(), 200), (torus(), 333), (open_cylinder(), 250), (thin_plate(), 300)] {
        let result = cluster(&mesh, Resolution::Vertices(wanted)).unwrap();
        assert_eq!(result.mesh.positions.len(), wanted as usize);
        assert_same_topology(&mesh, &result, "vertices");
    }
    // More than the input has can be had, but not any number.
    let few = cluster(&sphere(), Resolution::Vertices(300)).unwrap().mesh;
    let finer = cluster(&few, Resolution::Vertices(500)).unwrap().mesh;
    assert_eq!(finer.positions.len(), 500);
    let results = [3 * 300, 4_000_000_000].map(|wanted| cluster(&few, Resolution::Vertices(wanted)).unwrap());
    assert_eq!(results[0].mesh, results[1].mesh);
    // If the topology needs more, there are more, and not many.
    let result = cluster(&double_torus(), Resolution::Vertices(1)).unwrap();
    assert!(result.mesh.positions.len() < 60, "{}", result.mesh.positions.len());
}

#[test]
fn triangles_are_well_shaped() {
    for (mesh, wanted) in [(sphere(), 250), (torus(), 400)] {
        let result = cluster(&mesh, Resolution::Vertices(wanted)).unwrap();
        let (before, after) = (&result.report.before, &result.report.after);
        assert!(after.mean_smallest_angle > before.mean_smallest_angle);
        assert!(after.mean_smallest_angle.to_degrees() > 50.0, "{}", after.mean_smallest_angle.to_degrees());
        assert_eq!(result.report.after.angles.iter().sum::<usize>(), 3 * result.mesh.triangles.len());
        // Faces look outward, as the input's do.
        assert!(measure::enclosed_volume(&result.mesh) > 0.9 * measure::enclosed_volume(&mesh));
    }
}

#[test]
fn fitted_vertices_leave_the_surface_for_less_error() {
    for (name, mesh) in [("sphere", sphere()), ("torus", torus()), ("open cylinder", open_cylinder())] {
        let run = |fitting, threads| {
            let params =
                ClusterParams { resolution: Resolution::Vertices(220), fitting, threads, ..ClusterParams::default() };
            run(&mesh, &params, &Progress::none()).unwrap()
        };
        let mean = |result: &Clustered| {
            let side = Side::Ignored;
            measure::deviation(&mesh.positions, &result.mesh, side, 2, &Progress::none()).unwrap().summary.mean
        };
        let (on, fitted) = (run(0, 2), run(1, 2));
        assert!(mean(&fitted) < 0.7 * mean(&on), "{name}: {} {}", mean(&fitted), mean(&on));
        assert_eq!(on.mesh.triangles, fitted.mesh.triangles);
        assert!(fitted.report.after.smallest_angle >= on.report.after.smallest_angle.min(30_f64.to_radians()));
        assert!(fitted.mesh == run(1, 1).mesh, "{name}: another number of threads");
        // A vertex on the border stays on it.
        for (a, b) in on.mesh.positions.iter().zip(&fitted.mesh.positions) {
            assert!(name != "open cylinder" || a.z > 1e-9 && a.z < 3.0 - 1e-9 || a == b);
        }
    }
}

/// A square of n x n vertices.
fn square(n: usize) -> TriMesh {
    let positions = (0..n * n).map(|i| DVec3::new((i / n) as f64, (i % n) as f64, 0.0)).collect();
    let at = |i: usize, j: usize| (i * n + j) as u32;
    let cells = (0..n - 1).flat_map(|i| (0..n - 1).map(move |j| (i, j)));
    let triangles = cells
        .flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]])
        .collect();
    TriMesh::new(positions, triangles)
}

#[test]
fn corners_of_the_border_are_kept() {
    let mesh = square(24);
    let corners = [0, 23, 23 * 24, 24 * 24 - 1].map(|v: usize| mesh.positions[v]);
    for vertices in [40, 60, 120, 300] {
        let result = cluster(&mesh, Resolution::Vertices(vertices)).unwrap();
        for corner in corners {
            assert!(result.mesh.positions.contains(&corner), "{vertices}: {corner}");
        }
        assert!(result.report.after.smallest_angle.to_degrees() > 25.0, "{vertices}");
        assert_same_topology(&mesh, &result, "square");
    }
    let result = cluster(&mesh, Resolution::MaxError(0.01)).unwrap();
    assert!(!result.report.kept_input && result.mesh.positions.len() < 200, "{}", result.mesh.positions.len());
}

#[test]
fn copies_of_triangles_count_once() {
    let mesh = square(12);
    let alone = cluster(&mesh, Resolution::Vertices(30)).unwrap();
    for turned in [false, true] {
        let mut doubled = mesh.clone();
        doubled.triangles.extend(mesh.triangles.iter().map(|&[a, b, c]| if turned { [a, c, b] } else { [a, b, c] }));
        let result = cluster(&doubled, Resolution::Vertices(30)).unwrap();
        assert!(result.mesh == alone.mesh && result.report.cut_edges == 0);
    }
}

/// The largest distance of places all over the triangles of a surface from another.
fn farthest_of_many(surface: &TriMesh, other: &TriMesh) -> f64 {
    let places = |t: usize| {
        let [a, b, c] = surface.corners(t);
        let at = move |i: i32, j: i32| a + (b - a) * (f64::from(i) / 8.0) + (c - a) * (f64::from(j) / 8.0);
        (0..=8).flat_map(move |i| (0..=8 - i).map(move |j| at(i, j)))
    };
    let places: Vec<DVec3> = (0..surface.triangles.len()).flat_map(places).collect();
    measure::deviation(&places, other, Side::Ignored, 2, &Progress::none()).unwrap().summary.max
}

#[test]
fn a_largest_error_is_kept() {
    // Of large triangles, too: between the vertices of such an input its result lies where no vertex tells.
    let coarse = Shape::Torus { major: 1.0, minor: 0.4 }.mesh(9);
    let shapes =
        [(sphere(), "sphere"), (open_cylinder(), "cylinder"), (thin_plate(), "plate"), (coarse, "coarse torus")];
    for (mesh, name) in shapes {
        for bound in [0.2, 0.1, 0.02] {
            let result = cluster(&mesh, Resolution::MaxError(bound)).unwrap();
            let certified = result.report.max_error;
            assert!(certified <= bound, "{name} {bound}: {certified}");
            for (one, other) in [(&mesh, &result.mesh), (&result.mesh, &mesh)] {
                let farthest = farthest_of_many(one, other);
                // Of the input itself it is 0, up to rounding of the places.
                assert!(farthest <= certified + 1e-15, "{name} {bound}: {farthest} > {certified}");
            }
            assert!(result.mesh.positions.len() <= mesh.positions.len());
            assert_same_topology(&mesh, &result, name);
        }
    }
    // Nothing coarser lies this near: the input does.
    let result = cluster(&sphere(), Resolution::MaxError(1e-12)).unwrap();
    assert!(result.report.kept_input && result.mesh.triangles == sphere().triangles);
}

/// Three sheets of squares that meet in one line.
fn three_sheets() -> TriMesh {
    let (along, across) = (12, 8);
    let mut mesh = TriMesh::default();
    for sheet in 0..3 {
        let out = glam::DVec2::from_angle(TAU * f64::from(sheet) / 3.0).extend(0.0);
        let first = mesh.positions.len() as u32;
        // The first column is that of the first sheet.
        let at = |i: u32, j: u32| match (sheet, j) {
            (0, _) => i * across + j,
            (_, 0) => i * across,
            _ => first + i * (across - 1) + j - 1,
        };
        for (i, j) in (0..along).flat_map(|i| (u32::from(sheet > 0)..across).map(move |j| (i, j))) {
            // Bent: nothing coarser lies on them.
            let bend = out.cross(DVec3::Z) * (0.05 * f64::from(i * i + j * j));
            mesh.positions.push(out * f64::from(j) + bend + DVec3::Z * f64::from(i));
        }
        for (i, j) in (0..along - 1).flat_map(|i| (0..across - 1).map(move |j| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

#[test]
fn the_input_that_is_kept_is_cut_to_a_manifold() {
    let mut mesh = three_sheets();
    mesh.positions.push(DVec3::ONE);
    mesh.vertex_attributes = vec![Attribute::f32("height", mesh.positions.iter().map(|p| p.z as f32).collect())];
    assert_eq!(check(&mesh).non_manifold_edges, 11);
    let result = cluster(&mesh, Resolution::MaxError(1e-9)).unwrap();
    let report = check(&result.mesh);
    assert!(result.report.kept_input && report.is_manifold() && report.unused_vertices == 0, "{report}");
    assert_eq!(result.mesh.triangles.len(), mesh.triangles.len());
    let Some(AttributeData::F32(heights)) = result.mesh.vertex_attribute("height") else { panic!() };
    assert!(result.mesh.positions.iter().zip(heights).all(|(p, h)| p.z == f64::from(*h)));
    // Every vertex of the input is in a patch but the one that no triangle uses.
    let none = result.labels.iter().position(|&label| label < 0);
    assert_eq!(none, Some(mesh.positions.len() - 1));
    assert!(result.labels.iter().all(|&label| label < result.report.patches as i32));
}

#[test]
fn a_result_has_no_more_vertices_than_the_input() {
    // Separate triangles, and separate squares of two.
    for corners in [3, 4_u32] {
        let mut mesh = TriMesh::default();
        for i in 0..800_u32 {
            let corner = DVec3::new(f64::from(i % 40), f64::from(i / 40), 0.0) * 3.0;
            mesh.positions.extend(
                [[0, 0], [1, 0], [1, 1], [0, 1]][..corners as usize]
                    .iter()
                    .map(|&[x, y]| corner + DVec3::new(f64::from(x), f64::from(y), 0.0)),
            );
            mesh.triangles.push([0, 1, 2].map(|k| corners * i + k));
            if corners == 4 {
                mesh.triangles.push([0, 2, 3].map(|k| corners * i + k));
            }
        }
        for vertices in [1, 500, mesh.positions.len() as u32] {
            let result = cluster(&mesh, Resolution::Vertices(vertices)).unwrap();
            assert!(result.mesh.positions.len() <= mesh.positions.len(), "{}", result.mesh.positions.len());
            assert_same_topology(&mesh, &result, "separate parts");
        }
    }
}

#[test]
fn levels_come_in_the_order_asked_for() {
    let mesh = torus();
    let wanted = [400, 100, 200].map(Resolution::Vertices);
    let chain = levels(&mesh, &wanted, &ClusterParams::default(), &Progress::none()).unwrap();
    assert_eq!(chain.iter().map(|l| l.mesh.positions.len()).collect::<Vec<_>>(), [400, 100, 200]);
    chain.iter().for_each(|level| assert_same_topology(&mesh, level, "level"));
}

#[test]
fn the_same_bytes_for_any_number_of_threads_and_twice() {
    let mesh = torus();
    let results: Vec<TriMesh> = [1, 2, 5, 2]
        .map(|threads| {
            let params = ClusterParams { resolution: Resolution::Vertices(500), threads, ..ClusterParams::default() };
            run(&mesh, &params, &Progress::none()).unwrap().mesh
        })
        .to_vec();
    assert!(results.iter().all(|r| *r == results[0]));
}

#[test]
fn cancelled_at_any_check() {
    let mesh = torus();
    let params = ClusterParams { resolution: Resolution::MaxError(0.05), threads: 1, ..ClusterParams::default() };
    for checks in [0, 1, 2, 5, 10, 50, 100, 200] {
        let outcome = run(&mesh, &params, &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
}

#[test]
fn degenerate_input() {
    let text = |outcome: Result<Clustered>| outcome.unwrap_err().to_string();
    assert!(text(cluster(&TriMesh::default(), Resolution::Patches(3))).contains("no triangle"));
    let points = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
    assert!(text(cluster(&TriMesh::new(points.clone(), vec![[0, 1, 9]]), Resolution::Tenth)).contains("vertex 9"));
    let nan = TriMesh::new(vec![DVec3::NAN, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
    assert!(text(cluster(&nan, Resolution::Tenth)).contains("coordinates must be finite"));
    assert!(text(cluster(&sphere(), Resolution::Patches(0))).contains("patches must be >= 1"));
    assert!(text(cluster(&sphere(), Resolution::MaxError(-1.0))).contains("max_error must be"));

    let one = TriMesh::new(points.clone(), vec![[0, 1, 2]]);
    for resolution in [Resolution::Patches(1), Resolution::Patches(99), Resolution::Vertices(1), Resolution::Tenth] {
        assert_same_topology(&one, &cluster(&one, resolution).unwrap(), "one triangle");
    }
    // Two parts, one of them tiny; and the same far away and at the ends of the numbers.
    let mut two = sphere();
    let n = two.positions.len() as u32;
    two.positions.extend(points.iter().map(|p| *p * 1e-3 + DVec3::splat(2.0)));
    two.triangles.push([n, n + 1, n + 2]);
    assert_same_topology(&two, &cluster(&two, Resolution::Patches(20)).unwrap(), "two parts");
    for (scale, offset) in [(1e-70, 0.0), (1e70, 0.0), (1.0, 1e12), (1e-12, 0.0)] {
        let moved: Vec<DVec3> = sphere().positions.iter().map(|p| *p * scale + offset).collect();
        let result = cluster(&TriMesh::new(moved, sphere().triangles), Resolution::Patches(30)).unwrap();
        assert!(check(&result.mesh).is_closed(), "{scale} {offset}");
        assert!(result.mesh.positions.iter().all(|p| p.is_finite()));
    }
}

#[test]
fn points_in_one_place_or_on_a_line_are_no_danger() {
    let torus = torus();
    for squash in [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0)] {
        let flat = TriMesh::new(torus.positions.iter().map(|p| *p * squash).collect(), torus.triangles.clone());
        for patches in [1, 50] {
            let result = cluster(&flat, Resolution::Patches(patches)).unwrap();
            assert_eq!(check(&result.mesh).genus(), Some(1), "{squash}");
        }
    }
}

#[test]
fn what_is_no_manifold_is_cut_to_one() {
    // Three sheets at one edge, two fans at one vertex, and a triangle that faces the other way.
    let positions = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0], [3, 0, 0], [3, 1, 0]]
        .map(|p| DVec3::from(p.map(f64::from)))
        .to_vec();
    let mesh =
        TriMesh::new(positions, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 5, 6], [6, 5, 2], [5, 6, 3], [1, 1, 0]]);
    assert!(!check(&mesh).is_manifold());
    let result = cluster(&mesh, Resolution::Patches(5)).unwrap();
    assert!(check(&result.mesh).is_manifold(), "{}", check(&result.mesh));
    assert!(result.report.cut_edges > 0);
}

#[test]
fn progress_moves_within_a_level() {
    let seen = std::sync::Mutex::new(Vec::new());
    let progress = Progress::new(|tick| {
        seen.lock().unwrap().push(tick.fraction);
        std::ops::ControlFlow::Continue(())
    });
    let mesh = Shape::Torus { major: 2.0, minor: 0.6 }.mesh(96);
    run(&mesh, &ClusterParams { threads: 1, ..ClusterParams::default() }, &progress).unwrap();
    drop(progress);
    let seen = seen.into_inner().unwrap();
    assert!(seen.windows(2).all(|w| w[0] <= w[1]));
    assert!(seen.iter().any(|&f| 0.05 < f && f < 0.95), "{seen:?}");
}

#[test]
fn attributes_ride_along() {
    let mut mesh = sphere();
    mesh.vertex_attributes = vec![
        Attribute::f32("height", mesh.positions.iter().map(|p| p.z as f32).collect()),
        Attribute::bool("upper", mesh.positions.iter().map(|p| p.z > 0.0).collect()),
        Attribute::i32("side", mesh.positions.iter().map(|p| p.z.signum() as i32).collect()),
        Attribute::colour("colour", vec![[200, 100, 50, 255]; mesh.positions.len()]),
    ];
    let result = cluster(&mesh, Resolution::Vertices(300)).unwrap().mesh;
    result.validate().unwrap();
    let Some(AttributeData::F32(heights)) = result.vertex_attribute("height") else { panic!() };
    for (p, h) in result.positions.iter().zip(heights) {
        assert!((p.z - f64::from(*h)).abs() < 1e-6);
    }
    let Some(AttributeData::Colour(colours)) = result.vertex_attribute("colour") else { panic!() };
    assert!(colours.iter().all(|c| *c == [200, 100, 50, 255]));
    assert_eq!(result.vertex_attributes.len(), 4);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(48)))]

    /// A soup of any triangles becomes a manifold.
    #[test]
    fn any_soup_becomes_a_manifold(
        triangles in prop::collection::vec([0..12_u32, 0..12_u32, 0..12_u32], 1..40),
        places in prop::collection::vec([-3..3_i32, -3..3, -3..3], 12),
        patches in 1..20_u32,
    ) {
        let positions = places.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
        let mesh = TriMesh::new(positions, triangles.clone());
        match cluster(&mesh, Resolution::Patches(patches)) {
            Ok(result) => {
                prop_assert!(check(&result.mesh).is_manifold(), "{}", check(&result.mesh));
                let kept = cluster(&mesh, Resolution::MaxError(1e-12)).unwrap();
                prop_assert!(check(&kept.mesh).is_manifold(), "{}", check(&kept.mesh));
            }
            Err(_) => prop_assert!(triangles.iter().all(|[a, b, c]| a == b || b == c || c == a)),
        }
    }

    /// Cutting triangles out of a torus makes holes of any shape. All of them stay.
    #[test]
    fn holes_stay(cuts in prop::collection::vec(0..1024_usize, 0..60), vertices in 1..300_u32) {
        let mut mesh = Shape::Torus { major: 2.0, minor: 0.6 }.mesh(8);
        let count = mesh.triangles.len();
        let gone: std::collections::BTreeSet<usize> = cuts.iter().map(|c| c % count).collect();
        let mut t = 0;
        mesh.triangles.retain(|_| (!gone.contains(&t), t += 1).0);
        let result = cluster(&mesh, Resolution::Vertices(vertices)).unwrap();
        let (before, after) = (check(&mesh), check(&result.mesh));
        prop_assert!(after.is_manifold());
        if before.is_manifold() {
            prop_assert_eq!(before.euler_characteristic, after.euler_characteristic);
            prop_assert_eq!(before.boundary_loops, after.boundary_loops);
        }
    }
}
