mod flat;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::{CheckReport, TriMesh, check};
use geom::triangles::cross;

/// Boundary edges in the direction of their triangles.
fn boundary_of(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = || triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let all: std::collections::BTreeSet<[u32; 2]> = sides().collect();
    sides().filter(|&[a, b]| !all.contains(&[b, a])).collect()
}

fn close_all(mesh: &TriMesh, limit: f64) -> (TriMesh, HoleReport) {
    let mut closed = mesh.clone();
    let boundary = boundary_of(&mesh.triangles);
    let report =
        close(&mut closed.positions, &mut closed.triangles, &boundary, |_| limit, 0.0, &Progress::none()).unwrap();
    check_closing(mesh, &closed, &report);
    (closed, report)
}

/// Checks that must hold whatever was closed.
fn check_closing(before: &TriMesh, after: &TriMesh, report: &HoleReport) {
    let (v, t) = (before.positions.len(), before.triangles.len());
    assert_eq!((report.first_vertex, report.first_triangle), (v, t));
    assert!(after.positions[..v] == before.positions && after.triangles[..t] == before.triangles, "old parts stay");
    assert_eq!(report.sources.len(), after.positions.len() - v);
    for (i, sources) in report.sources.iter().enumerate() {
        assert!(sources.iter().all(|&s| (s as usize) < v + i), "attributes come from what is known already");
    }
    let (old, new) = (check(before), check(after));
    if old.is_manifold() {
        assert!(new.is_manifold(), "{new}");
        assert_eq!(new.boundary_loops, old.boundary_loops - report.closed);
        assert_eq!(new.genus(), old.genus().map(|g| g + joined(&old, &new)));
        assert_eq!(report.open.len(), new.boundary_loops);
    }
    for i in t..after.triangles.len() {
        for j in 0..after.triangles.len() {
            if i != j {
                assert!(!cross(after.corners(i), after.corners(j)), "new triangle {i} crosses triangle {j}");
            }
        }
    }
}

/// Every loop bounds one component, so closing never joins components nor makes handles.
fn joined(old: &CheckReport, new: &CheckReport) -> i64 {
    assert_eq!(old.components, new.components);
    0
}

/// A mesh over a grid of `rows` x `cols` squares. With `wrap` closed along rows and columns.
fn grid(rows: u32, cols: u32, wrap: [bool; 2], place: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let (height, width) = (rows + u32::from(!wrap[0]), cols + u32::from(!wrap[1]));
    let at = |r: u32, c: u32| (r % height) * width + c % width;
    let mut triangles = Vec::new();
    for r in 0..rows {
        for c in 0..cols {
            let [p, q, s, t] = [at(r, c), at(r, c + 1), at(r + 1, c + 1), at(r + 1, c)];
            if (r + c) % 2 == 0 {
                triangles.extend([[p, q, s], [p, s, t]]);
            } else {
                triangles.extend([[p, q, t], [q, s, t]]);
            }
        }
    }
    let positions = (0..height * width).map(|i| place(f64::from(i / width), f64::from(i % width))).collect();
    TriMesh::new(positions, triangles)
}

#[test]
fn work_grows_with_the_number_of_pinholes_in_a_wall() {
    let pool = base::threads::pool(1).unwrap();
    let work = |rows: u32, cols: u32, axis: usize| {
        let mut wall = grid(rows, cols, [false; 2], |r, c| {
            let mut at = [1.0, r, c];
            at.rotate_right(axis);
            DVec3::from(at)
        });
        let mut triangle = 0;
        wall.triangles.retain(|_| {
            let square = triangle / 2;
            triangle += 1;
            triangle % 2 == 1 || (square / cols) % 3 != 1 || (square % cols) % 3 != 1
        });
        let boundary = boundary_of(&wall.triangles);
        let (report, steps) = pool.install(|| {
            base::work::counted(|| {
                close(&mut wall.positions, &mut wall.triangles, &boundary, |_| 5.0, 0.0, &Progress::none()).unwrap()
            })
        });
        assert_eq!((report.closed as u32, report.open.len()), (rows / 3 * (cols / 3), 1));
        assert!(check(&wall).is_manifold());
        steps
    };
    for axis in 0..3 {
        let (one, two) = (work(90, 90, axis), work(180, 90, axis));
        assert!(one > 900 && 10 * two <= 23 * one, "{one} {two}");
    }
}

fn plane(size: u32) -> TriMesh {
    // Tilted, and irregular within the plane, but so that it stays one to the last bit.
    grid(size, size, [false; 2], |r, c| {
        let (x, y) = (c + 0.25 * ((3.0 * r + 5.0 * c) % 3.0 - 1.0), r + 0.25 * ((2.0 * r + 7.0 * c) % 3.0 - 1.0));
        DVec3::new(x, y, 0.5 * x - 0.25 * y)
    })
}

fn torus(rows: u32, cols: u32) -> TriMesh {
    use std::f64::consts::TAU;
    grid(rows, cols, [true; 2], |r, c| {
        let (u, v) = (r / f64::from(rows) * TAU, c / f64::from(cols) * TAU);
        DVec3::new((3.0 + u.cos()) * v.cos(), (3.0 + u.cos()) * v.sin(), -u.sin())
    })
}

/// An octahedron, each triangle split into four `depth` times, on the unit sphere.
fn sphere(depth: u32) -> TriMesh {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
    let mut mesh = TriMesh::new(
        axes.to_vec(),
        vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]],
    );
    for _ in 0..depth {
        let mut middles = std::collections::BTreeMap::new();
        let mut split = Vec::new();
        let TriMesh { positions, triangles, .. } = &mut mesh;
        for &[a, b, c] in &*triangles {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
                *middles.entry((p.min(q), p.max(q))).or_insert_with(|| {
                    positions.push((positions[p as usize] + positions[q as usize]).normalize());
                    positions.len() as u32 - 1
                })
            });
            split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        *triangles = split;
    }
    mesh
}

/// The mesh without the triangles whose middle is `within`.
fn cut(mesh: &TriMesh, within: impl Fn(DVec3) -> bool) -> TriMesh {
    let keep = |t: &usize| !within(mesh.corners(*t).iter().sum::<DVec3>() / 3.0);
    let triangles = (0..mesh.triangles.len()).filter(keep).map(|t| mesh.triangles[t]).collect();
    TriMesh::new(mesh.positions.clone(), triangles)
}

#[test]
fn a_flat_hole_stays_flat() {
    for radius in [0.8, 1.6, 2.4, 3.7] {
        let middle = plane(12).positions[6 * 13 + 6];
        let holed = cut(&plane(12), |p| p.distance(middle) < radius);
        let (closed, report) = close_all(&holed, 30.0);
        assert_eq!((report.closed, report.open.len()), (1, 1), "radius {radius}");
        assert_eq!(report.open[0].reason, HoleReason::TooLong);
        for p in &closed.positions[report.first_vertex..] {
            assert!((p.z - (0.5 * p.x - 0.25 * p.y)).abs() < 1e-9, "radius {radius}: {p}");
        }
        for t in report.first_triangle..closed.triangles.len() {
            let [a, b, c] = closed.corners(t);
            assert!((b - a).cross(c - a).z > 0.0, "no triangle is turned over");
        }
        // As fine as the surroundings: the same number of triangles as were cut out, within a factor of two.
        let (cut, filled) = (2 * 144 - report.first_triangle, closed.triangles.len() - report.first_triangle);
        assert!(filled <= 2 * cut && cut <= 2 * filled, "radius {radius}: {filled} triangles for {cut}");
    }
}

/// The spherical cap around `axis` with this opening angle.
fn cap(centre: DVec3, axis: DVec3, angle: f64) -> impl Fn(DVec3) -> bool {
    move |p| (p - centre).normalize().dot(axis.normalize()) > angle.cos()
}

#[test]
fn a_spherical_cap_is_faired_outward() {
    let axis = DVec3::new(0.3, 0.5, 0.7);
    for (depth, angle) in [(3, 0.5), (4, 0.3), (4, 0.4), (4, 0.6), (5, 0.4), (5, 0.8)] {
        let (closed, report) = close_all(&cut(&sphere(depth), cap(DVec3::ZERO, axis, angle)), 12.0);
        assert_eq!((report.closed, report.open.len()), (1, 0));
        assert!(check(&closed).is_closed() && check(&closed).genus() == Some(0));
        let off = closed.positions[report.first_vertex..].iter().map(|p| (p.length() - 1.0).abs());
        let (worst, height) = (off.fold(0.0, f64::max), 1.0 - f64::cos(angle));
        // A flat fill would be off by the height of the cap above its rim.
        assert!(worst < 0.15 * height, "depth {depth} angle {angle}: {worst} off, the cap is {height} high");
    }
}

#[test]
fn holes_of_all_shapes_close() {
    let saddle = grid(16, 16, [false; 2], |r, c| {
        let (x, y) = (c - 8.0, r - 8.0);
        DVec3::new(x, y, 0.1 * (x * x - y * y))
    });
    let ridge = grid(16, 16, [false; 2], |r, c| DVec3::new(c, r, -2.0 * (c - 8.0).abs()));
    let donut = torus(24, 40);
    let ring = |p: DVec3| (p - DVec3::new(4.0, 0.0, 0.0)).length();
    for (name, mesh, left_open) in [
        ("saddle", cut(&saddle, |p| p.length() < 4.0), 1),
        ("ridge", cut(&ridge, |p| (p - DVec3::new(8.0, 8.0, 0.0)).length() < 4.0), 1),
        ("long slit", cut(&saddle, |p| p.y.abs() < 1.0 && p.x.abs() < 6.0), 1),
        ("letter C", cut(&saddle, |p| (3.0..5.0).contains(&p.length()) && (p.x < 3.0 || p.y.abs() > 1.0)), 1),
        ("island", cut(&saddle, |p| (3.0..5.0).contains(&p.length())), 2),
        ("torus", cut(&donut, |p| ring(p) < 1.2), 0),
        // All around the tube: two loops, each closed by a disk, and the handle is gone.
        ("cut through the tube", cut(&donut, |p| p.x > 0.0 && p.y.abs() < 0.5), 0),
        ("most of a sphere", cut(&sphere(3), |p| p.z > -0.6), 0),
        ("a bent leaf", TriMesh::new(sphere(1).positions, sphere(1).triangles[..4].to_vec()), 0),
    ] {
        let (_, report) = close_all(&mesh, 80.0);
        assert_eq!(report.open.len(), left_open, "{name}: {:?}", report.open);
        assert!(report.closed > 0, "{name}");
    }
}

#[test]
fn a_long_loop_is_cut_and_closed() {
    // 320 edges around a wavy hole.
    let mesh = grid(90, 90, [false; 2], |r, c| DVec3::new(c, r, (0.2 * c).sin() + (0.15 * r).cos()));
    let middle = DVec3::new(45.0, 45.0, 0.0);
    let holed =
        cut(&mesh, |p| (p - middle).truncate().length() < 30.0 + 8.0 * (5.0 * (p.y - 45.0).atan2(p.x - 45.0)).sin());
    let mut closed = holed.clone();
    let boundary = boundary_of(&holed.triangles);
    assert!(boundary.len() > 360 + 2 * minimal::LARGEST - 50);
    let report =
        close(&mut closed.positions, &mut closed.triangles, &boundary, |_| 345.0, 0.0, &Progress::none()).unwrap();
    assert_eq!(report.closed, 1);
    assert!(check(&closed).is_manifold());
}

#[test]
fn a_fill_keeps_clear_of_what_lies_beneath_and_above() {
    let joined = |meshes: &[TriMesh]| {
        let mut all = TriMesh::default();
        for mesh in meshes {
            let first = all.positions.len() as u32;
            all.positions.extend(&mesh.positions);
            all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
        }
        all
    };
    let scaled =
        |mesh: TriMesh, by: f64| TriMesh { positions: mesh.positions.iter().map(|p| p * by).collect(), ..mesh };
    let holed = || cut(&sphere(4), cap(DVec3::ZERO, DVec3::Z, 0.6));
    // A wall just beneath, which a flat fill would cut, and one just above, which a bulging one would.
    for other in [0.9, 1.002] {
        let (_, report) = close_all(&joined(&[holed(), scaled(sphere(4), other)]), 5.0);
        assert_eq!((report.closed, report.open.len()), (1, 0), "other wall at {other}");
    }
    // A thin wall with a hole through both sides.
    let inner = scaled(holed(), 0.95);
    let inner = TriMesh::new(inner.positions, inner.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect());
    let (_, report) = close_all(&joined(&[holed(), inner]), 5.0);
    assert_eq!((report.closed, report.open.len()), (2, 0));
    // A needle through the hole: whatever closes it crosses the needle.
    let needle = TriMesh::new(vec![DVec3::ZERO, DVec3::new(0.01, 0.0, 0.0), DVec3::Z * 3.0], vec![[0, 1, 2]]);
    let (_, report) = close_all(&joined(&[holed(), needle]), 5.0);
    assert_eq!((report.closed, report.open[0].reason), (0, HoleReason::Crossing));
}

#[test]
fn fills_keep_clear_of_each_other() {
    // Two spheres whose missing caps would overlap.
    let left = cut(&sphere(4), cap(DVec3::ZERO, DVec3::X, 0.6));
    let apart = DVec3::X * 1.9;
    let right = cut(&sphere(4), cap(DVec3::ZERO, DVec3::NEG_X, 0.6));
    let first = left.positions.len() as u32;
    let mut both = left;
    both.positions.extend(right.positions.iter().map(|p| p + apart));
    both.triangles.extend(right.triangles.iter().map(|t| t.map(|v| v + first)));
    let (_, report) = close_all(&both, 5.0);
    assert_eq!((report.closed, report.open.len()), (2, 0));
}

#[test]
fn only_loops_up_to_the_limit_are_closed() {
    // Square holes of 1 x 1 and 2 x 2 in a flat grid: 4 and 8 long; the outer border is 40 long.
    let flat = grid(10, 10, [false; 2], |r, c| DVec3::new(c, r, 0.0));
    let within = |p: DVec3, x: f64, y: f64, size: f64| p.x > x && p.x < x + size && p.y > y && p.y < y + size;
    let holed = cut(&flat, |p| within(p, 1.0, 1.0, 1.0) || within(p, 5.0, 5.0, 2.0));
    for (limit, closed) in [(0.0, 0), (3.9, 0), (4.0, 1), (7.9, 1), (8.0, 2), (39.0, 2)] {
        let (_, report) = close_all(&holed, limit);
        assert_eq!(report.closed, closed, "limit {limit}");
        assert!(report.open.iter().all(|open| open.reason == HoleReason::TooLong && open.length > limit));
    }
    assert_eq!(
        close_all(&holed, 0.0).1.open.iter().map(|o| (o.vertex, o.edges)).collect::<Vec<_>>(),
        [(0, 40), (12, 4), (60, 8)]
    );
    // The whole sheet could only be closed by its own other side.
    let (_, report) = close_all(&holed, 41.0);
    assert_eq!((report.closed, report.open[0].reason), (2, HoleReason::Crossing));
}

#[test]
fn what_is_no_loop_is_left_and_bad_boundaries_do_no_harm() {
    // Two triangles cut out that meet in a corner: the loops meet there.
    let mut ball = sphere(2);
    let corner = ball.triangles[5][0];
    let around: Vec<usize> = (0..ball.triangles.len()).filter(|&t| ball.triangles[t].contains(&corner)).collect();
    let (first, opposite) = (around[0], around[around.len() / 2]);
    let shares_edge = ball.triangles[first].iter().filter(|v| ball.triangles[opposite].contains(v)).count() > 1;
    assert!(!shares_edge);
    ball.triangles.swap_remove(first.max(opposite));
    ball.triangles.swap_remove(first.min(opposite));
    let (_, report) = close_all(&ball, 9.0);
    assert!(report.closed == 0 && report.open.iter().all(|open| open.reason == HoleReason::NotSimple));
    // A boundary that the mesh doesn't have.
    let mut mesh = sphere(1);
    let report = close(
        &mut mesh.positions,
        &mut mesh.triangles,
        &[[0, 1], [1, 2], [2, 0], [3, 4]],
        |_| 9.0,
        0.0,
        &Progress::none(),
    );
    assert!(report.is_ok());
    let report = close(&mut vec![], &mut vec![], &[], |_| 1.0, 0.0, &Progress::none()).unwrap();
    assert_eq!(report, HoleReport::default());
}

#[test]
fn new_vertices_have_no_edge_below_the_shortest() {
    let holed = cut(&torus(40, 60), |p| (4.0 * p.x).sin() * (5.0 * p.y).cos() > 0.5);
    let boundary = boundary_of(&holed.triangles);
    let fill = |shortest: f64| {
        let mut mesh = holed.clone();
        let (positions, triangles) = (&mut mesh.positions, &mut mesh.triangles);
        let report = close(positions, triangles, &boundary, |_| 9.0, shortest, &Progress::none()).unwrap();
        check_closing(&holed, &mesh, &report);
        (mesh, report)
    };
    let new_edges = |(mesh, report): &(TriMesh, HoleReport)| {
        let sides = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let new = sides.filter(|side| side.iter().any(|&v| v as usize >= report.first_vertex));
        new.map(|[a, b]| mesh.positions[a as usize].distance(mesh.positions[b as usize])).collect::<Vec<_>>()
    };
    let as_fine = fill(0.0);
    let least = new_edges(&as_fine).into_iter().fold(f64::INFINITY, f64::min);
    assert!(least.is_finite() && fill(least) == as_fine);
    // Holes are filled without new vertices rather than left open.
    for shortest in [1.01 * least, 2.0 * least, 9.0] {
        let found = fill(shortest);
        assert!(new_edges(&found).into_iter().all(|length| length >= shortest));
        assert_eq!(found.1.closed, as_fine.1.closed);
        assert!(found.1.sources.len() < as_fine.1.sources.len());
    }
}

#[test]
fn the_same_whatever_the_threads_and_the_order_of_the_boundary() {
    let holed = cut(&torus(40, 60), |p| (4.0 * p.x).sin() * (5.0 * p.y).cos() * (3.0 * p.z + 1.0).sin() > 0.45);
    let mut boundary = boundary_of(&holed.triangles);
    let mut results = Vec::new();
    for threads in [1, 2, 8] {
        let mut mesh = holed.clone();
        let third = boundary.len() / 3;
        boundary.rotate_left(third);
        boundary.reverse();
        let pool = base::threads::pool(threads).unwrap();
        let report = pool
            .install(|| close(&mut mesh.positions, &mut mesh.triangles, &boundary, |_| 9.0, 0.0, &Progress::none()))
            .unwrap();
        assert!(report.closed > 5);
        results.push((mesh, report));
    }
    assert!(results.windows(2).all(|w| w[0] == w[1]));
}

#[test]
fn cancelling_leaves_the_mesh_as_it_was() {
    let holed = cut(&torus(40, 60), |p| (4.0 * p.x).sin() * (5.0 * p.y).cos() > 0.5);
    let boundary = boundary_of(&holed.triangles);
    let mut checks = 0;
    loop {
        let mut mesh = holed.clone();
        match close(&mut mesh.positions, &mut mesh.triangles, &boundary, |_| 9.0, 0.0, &Progress::cancel_after(checks))
        {
            Ok(_) => break,
            Err(error) => assert!(matches!(error, base::Error::Cancelled) && mesh == holed),
        }
        checks += 1 + checks / 8;
    }
    assert!(checks > 20);
}

/// The mesh without what grows from seeds, places among the triangles, over edges, triangle by triangle.
fn with_holes(mesh: &TriMesh, seeds: &[(f64, usize)]) -> TriMesh {
    let mut kept: std::collections::BTreeSet<usize> = (0..mesh.triangles.len()).collect();
    for &(seed, size) in seeds {
        let mut front = vec![(seed * mesh.triangles.len() as f64) as usize];
        for _ in 0..size {
            let Some(t) = front.pop() else { break };
            kept.remove(&t);
            let shared = |u: usize| mesh.triangles[u].iter().filter(|v| mesh.triangles[t].contains(v)).count();
            front.splice(0..0, kept.iter().copied().filter(|&u| shared(u) == 2));
        }
    }
    TriMesh::new(mesh.positions.clone(), kept.iter().map(|&t| mesh.triangles[t]).collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(64)))]
    #[test]
    fn any_holes_close_or_stay_and_the_mesh_stays_a_manifold(
        which in 0..3, seeds in prop::collection::vec((0.0..1.0_f64, 1..40_usize), 1..12), bend in 0.0..1.5_f64,
    ) {
        let mesh = match which {
            0 => torus(14, 22),
            1 => sphere(3),
            _ => grid(15, 15, [false; 2], |r, c| DVec3::new(c, r, bend * (r * 1.7).sin() * (c * 1.3).cos())),
        };
        let holed = with_holes(&mesh, &seeds);
        prop_assume!(check(&holed).is_manifold());
        let (_, report) = close_all(&holed, 12.0);
        for open in &report.open {
            prop_assert!(open.reason != HoleReason::NotSimple);
        }
    }
}

/// Whether no side of a triangle is another's but those of the boundary: what closes a loop of three edges by itself.
fn is_lid(triangle: [u32; 3], boundary: &std::collections::BTreeSet<[u32; 2]>) -> bool {
    let [a, b, c] = triangle;
    [[b, a], [c, b], [a, c]].iter().all(|edge| boundary.contains(edge))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(64)))]
    /// Over loops alone, of surfaces that noise crumples, too.
    #[test]
    fn loops_close_or_stay_and_what_closes_them_crosses_nothing(
        which in 0..3, seeds in prop::collection::vec((0.0..1.0_f64, 1..12_usize), 1..16), noise in 0.0..0.4_f64, seed in any::<u32>(),
    ) {
        let (mut mesh, side) = match which {
            0 => (torus(14, 22), 0.6),
            1 => (sphere(3), 0.15),
            _ => (grid(15, 15, [false; 2], |r, c| DVec3::new(c, r, 0.0)), 1.0),
        };
        let draw = |i: usize| f64::from((i as u32).wrapping_mul(2_654_435_761).wrapping_add(seed).wrapping_mul(2_246_822_519) >> 8) / f64::from(1 << 24) - 0.5;
        for (i, p) in mesh.positions.iter_mut().enumerate() {
            *p += 2.0 * noise * side * DVec3::from([0, 1, 2].map(|axis| draw(3 * i + axis)));
        }
        let holed = with_holes(&mesh, &seeds);
        prop_assume!(check(&holed).is_manifold());
        let boundary = boundary_of(&holed.triangles);
        let closed = |threads: usize, is_wanted: bool| {
            let pool = base::threads::pool(threads).unwrap();
            let triangles = pool.install(|| {
                close_over_loops(&holed.positions, holed.triangles.clone(), &boundary, |_| 20.0, |_| Ok(is_wanted), &Progress::none())
            });
            TriMesh::new(holed.positions.clone(), triangles.unwrap())
        };
        let after = closed(1, true);
        for threads in [2, 8] {
            prop_assert!(closed(threads, true) == after, "{} threads", threads);
        }
        prop_assert!(closed(2, false) == holed, "what is not wanted");
        let (old, new) = (check(&holed), check(&after));
        prop_assert!(new.is_manifold(), "{}", new);
        prop_assert_eq!((new.components, new.genus()), (old.components, old.genus()), "{}\n{}", old, new);
        prop_assert!(new.boundary_loops <= old.boundary_loops);
        let before: std::collections::BTreeSet<[u32; 3]> = holed.triangles.iter().copied().collect();
        let boundary = boundary.into_iter().collect();
        let crosses_none = |t: usize| !before.contains(&after.triangles[t]) && !is_lid(after.triangles[t], &boundary);
        for i in (0..after.triangles.len()).filter(|&i| crosses_none(i)) {
            for j in (0..after.triangles.len()).filter(|&j| j != i && !is_lid(after.triangles[j], &boundary)) {
                prop_assert!(!cross(after.corners(i), after.corners(j)), "new triangle {} crosses {}", i, j);
            }
        }
    }
}
