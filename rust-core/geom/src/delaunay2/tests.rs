mod polygons;
mod regions;

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, I64Vec2, I64Vec3};
use proptest::prelude::*;

use super::*;
use crate::span;
use base::error::Error;

/// Points of a plane of space whose coordinates are whole numbers.
struct Plane {
    origin: I64Vec3,
    /// Steps of the plane's own lattice.
    steps: [I64Vec3; 2],
}

impl Plane {
    fn at(&self, p: I64Vec2) -> I64Vec3 {
        self.origin + self.steps[0] * p.x + self.steps[1] * p.y
    }

    fn points(&self, lattice: &[I64Vec2]) -> Vec<DVec3> {
        lattice.iter().map(|&p| self.at(p).as_dvec3()).collect()
    }
}

fn triangulated(points: &[DVec3]) -> Vec<[u32; 3]> {
    let corners = span::of(points, &Progress::none()).unwrap();
    let corners = <[usize; 3]>::try_from(corners).expect("points of a plane");
    Delaunay2::new(points, corners, &Progress::none()).unwrap().into_triangles()
}

fn dot(a: I64Vec3, b: I64Vec3) -> i128 {
    (0..3).map(|k| i128::from(a[k]) * i128::from(b[k])).sum()
}

/// Whether d lies inside of the circle around a, b, c: by its place in terms of the two sides at a, in whole numbers.
fn is_inside([a, b, c]: [I64Vec3; 3], d: I64Vec3) -> bool {
    let (u, v, w) = (b - a, c - a, d - a);
    let n = u.cross(v);
    dot(w, w) * dot(n, n) < dot(u, u) * dot(w.cross(v), n) + dot(v, v) * dot(u.cross(w), n)
}

fn twice_the_area([a, b, c]: [I64Vec2; 3]) -> i64 {
    (b - a).perp_dot(c - a)
}

/// Twice the area of the convex hull. \[Andrew's chains\]
fn hull_area(points: &[I64Vec2]) -> i64 {
    let mut points: Vec<[i64; 2]> = points.iter().map(|p| p.to_array()).collect();
    points.sort_unstable();
    let half = |points: &mut dyn Iterator<Item = I64Vec2>| {
        let mut chain: Vec<I64Vec2> = Vec::new();
        for p in points {
            while chain.len() > 1 && twice_the_area([chain[chain.len() - 2], chain[chain.len() - 1], p]) <= 0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied().map(I64Vec2::from));
    hull.extend(half(&mut points.iter().rev().copied().map(I64Vec2::from)));
    (0..hull.len()).map(|i| hull[i].perp_dot(hull[(i + 1) % hull.len()])).sum()
}

/// The corner opposite to each directed edge, of which no two triangles have the same.
fn apexes(triangles: &[[u32; 3]]) -> BTreeMap<[u32; 2], u32> {
    let mut apexes = BTreeMap::new();
    for &[a, b, c] in triangles {
        for (edge, opposite) in [([a, b], c), ([b, c], a), ([c, a], b)] {
            assert!(apexes.insert(edge, opposite).is_none(), "two triangles on one side of {edge:?}");
        }
    }
    apexes
}

/// Delaunay in the plane, all points used, turning one way, without overlaps and over the whole hull.
fn check(plane: &Plane, lattice: &[I64Vec2], triangles: &[[u32; 3]]) {
    let areas: Vec<i64> = triangles.iter().map(|t| twice_the_area(t.map(|v| lattice[v as usize]))).collect();
    assert!(areas.iter().all(|&area| area > 0) || areas.iter().all(|&area| area < 0), "not turned one way");
    // Triangles that turn one way, side by side, over the hull's area cover it once.
    assert_eq!(areas.iter().sum::<i64>().abs(), hull_area(lattice));
    let normal = plane.steps[0].cross(plane.steps[1]) * areas[0].signum();
    let up = normal.to_array().into_iter().rev().find(|&x| x != 0);
    assert!(up.unwrap() > 0, "seen from behind: {normal}");
    let used: BTreeSet<u32> = triangles.as_flattened().iter().copied().collect();
    assert_eq!(used.len(), lattice.len());
    let apex = apexes(triangles);
    let at = |v: u32| plane.at(lattice[v as usize]);
    for (&[a, b], &c) in &apex {
        if let Some(&d) = apex.get(&[b, a]) {
            assert!(!is_inside([a, b, c].map(at), at(d)), "{d} is inside of the circle around {a}, {b}, {c}");
        }
    }
}

fn lattice_points(limit: i64, count: usize) -> impl Strategy<Value = Vec<I64Vec2>> {
    prop::collection::btree_set([0..limit, 0..limit], 3..count)
        .prop_map(|points| points.into_iter().map(I64Vec2::from).collect::<Vec<_>>())
        .prop_shuffle()
        .prop_filter("on a line", |p| p[2..].iter().any(|&c| twice_the_area([p[0], p[1], c]) != 0))
}

fn step() -> impl Strategy<Value = I64Vec3> {
    prop::array::uniform3(-9_i64..10).prop_map(I64Vec3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(400)))]

    /// Small lattices are full of points on lines and on circles, large ones have none.
    #[test]
    fn delaunay_in_any_plane(
        lattice in prop_oneof![lattice_points(6, 36), lattice_points(4000, 120)],
        origin in prop::sample::select(vec![0, 7, 5_000_000, -(1_i64 << 40)]),
        steps in [step(), step()].prop_filter("parallel", |[a, b]| a.cross(*b) != I64Vec3::ZERO),
    ) {
        let plane = Plane { origin: I64Vec3::new(origin, -origin, origin / 2), steps };
        check(&plane, &lattice, &triangulated(&plane.points(&lattice)));
    }
}

#[test]
fn planes_along_axes_show_their_front() {
    for (steps, front) in [
        ([I64Vec3::Y, I64Vec3::X], I64Vec3::Z),
        ([I64Vec3::X, I64Vec3::Z], I64Vec3::Y),
        ([I64Vec3::Z, I64Vec3::Y], I64Vec3::X),
        // So flat that all but the sign of its height is lost in products.
        ([I64Vec3::X, I64Vec3::new(0, 1 << 30, 1)], I64Vec3::Z),
        ([I64Vec3::X, I64Vec3::new(0, 1, -(1 << 30))], I64Vec3::Z),
    ] {
        let plane = Plane { origin: I64Vec3::ZERO, steps };
        let lattice: Vec<I64Vec2> = (0..25).map(|i| I64Vec2::new(i % 5, i / 5)).collect();
        let triangles = triangulated(&plane.points(&lattice));
        check(&plane, &lattice, &triangles);
        let [a, b, c] = triangles[0].map(|v| plane.at(lattice[v as usize]));
        assert!((b - a).cross(c - a).dot(front) > 0, "{front}");
    }
}

#[test]
fn any_power_of_two_makes_the_same_triangles() {
    let plane = Plane { origin: I64Vec3::ONE, steps: [I64Vec3::new(3, 1, 4), I64Vec3::new(-1, 5, 9)] };
    let lattice: Vec<I64Vec2> = (0..200).map(|i| I64Vec2::new(i * 37 % 101, i * i % 83)).collect();
    let points = plane.points(&lattice);
    let expected = triangulated(&points);
    for exponent in [-1000, -300, 300, 1000] {
        let scaled: Vec<DVec3> = points.iter().map(|p| *p * 2.0_f64.powi(exponent)).collect();
        assert_eq!(triangulated(&scaled), expected, "2^{exponent}");
    }
}

#[test]
fn sizes_that_can_not_be_multiplied_are_refused() {
    let points = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1e-60, 0.0)];
    let problem = Delaunay2::new(&points, [0, 1, 2], &Progress::none()).unwrap_err().to_string();
    assert!(problem.contains("a coordinate of 1e-60 is too small beside the others"), "{problem}");
}

#[test]
fn cancels_at_any_check() {
    let steps = [I64Vec3::new(3, 1, 4), I64Vec3::new(-1, 5, 9)];
    let lattice: Vec<I64Vec2> = (0..10_000).map(|i| I64Vec2::new(i % 100, i / 100)).collect();
    let points = Plane { origin: I64Vec3::ZERO, steps }.points(&lattice);
    for checks in [0, 1, 10, 40, 80] {
        let outcome = Delaunay2::new(&points, [0, 1, 100], &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
}
