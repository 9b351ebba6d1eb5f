//! The area that a mesh must cover, from the contract alone: this shares nothing with what sculpts.
//!
//! A place is what the sensor sees, up to a factor above 0: (across, across, 1) along parallel rays, the way from the eye
//! along others. So a ray, too, is a place, and where rays meet triangles is a matter of signs of determinants.

use super::*;
use image::range_image::Viewing;

/// A triangle of half a cell as the sensor sees it.
struct Half {
    places: [DVec3; 3],
    /// Rises with the mean range of its corners.
    depth: f64,
}

/// Eye of an image: how it sees.
enum Eye {
    Parallel { across: [DVec3; 2], toward: DVec3 },
    At(DVec3),
}

impl Eye {
    fn of(image: &RangeImage) -> Self {
        match *image.projection() {
            Projection::Orthographic { .. } => Eye::Parallel { across: [DVec3::X, DVec3::Y], toward: DVec3::NEG_Z },
            Projection::PointGrid(Viewing::Parallel(toward)) => {
                let (x, y) = toward.normalize().any_orthonormal_pair();
                Eye::Parallel { across: [x, y], toward }
            }
            Projection::PointGrid(Viewing::From(eye)) => Eye::At(eye),
            Projection::Pinhole { .. } | Projection::Spherical { .. } => Eye::At(DVec3::ZERO),
        }
    }

    fn place(&self, p: DVec3) -> DVec3 {
        match self {
            Eye::Parallel { across: [x, y], .. } => DVec3::new(p.dot(*x), p.dot(*y), 1.0),
            Eye::At(eye) => (p - eye).normalize(),
        }
    }

    fn depth(&self, p: DVec3) -> f64 {
        match self {
            Eye::Parallel { toward, .. } => p.dot(toward.normalize()),
            Eye::At(eye) => p.distance(*eye),
        }
    }

    /// The part of the view that a triangle takes up: an area, or a solid angle.
    fn area(&self, [a, b, c]: [DVec3; 3]) -> f64 {
        let det = side(a, b, c).abs();
        match self {
            Eye::Parallel { .. } => 0.5 * det,
            Eye::At(_) => 2.0 * det.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a)),
        }
    }
}

/// Positive where three places turn one way.
fn side(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    a.dot(b.cross(c))
}

/// Distance inside of a triangle at which a ray meets it. Below 0 outside.
fn inside([a, b, c]: [DVec3; 3], ray: DVec3) -> f64 {
    let turn = side(a, b, c).signum();
    [(a, b), (b, c), (c, a)].map(|(p, q)| turn * side(p, q, ray)).into_iter().fold(f64::INFINITY, f64::min)
}

/// Four rays well inside of a triangle, by odd weights: edges between samples pass beside them.
fn rays([a, b, c]: [DVec3; 3]) -> [DVec3; 4] {
    let weights = [[1.0, 1.3217, 0.8713], [7.9131, 1.0217, 0.7391], [0.9173, 8.3719, 1.1931], [1.0719, 0.8131, 7.7193]];
    weights.map(|[u, v, w]| (a * u + b * v + c * w).normalize())
}

/// Whether two triangles have rays in common that are on the border of neither.
fn overlap(one: [DVec3; 3], other: [DVec3; 3]) -> bool {
    // Cones around both: what lies on the other side of the eye is on the inner side of some edges as well.
    let cone = |corners: [DVec3; 3]| {
        let axis = corners.iter().sum::<DVec3>();
        (axis, corners.map(|corner| axis.angle_between(corner)).into_iter().fold(0.0, f64::max))
    };
    let [(axis, reach), (other_axis, other_reach)] = [cone(one), cone(other)];
    if axis.angle_between(other_axis) > reach + other_reach {
        return false;
    }
    let apart = |[a, b, c]: [DVec3; 3], other: [DVec3; 3]| {
        let turn = side(a, b, c).signum();
        [(a, b), (b, c), (c, a)].iter().any(|&(p, q)| other.iter().all(|&r| turn * side(p, q, r) <= 1e-12))
    };
    !apart(one, other) && !apart(other, one)
}

/// The halves of cells with three valid corners and no edge longer than the limit. A whole cell is cut by its shorter diagonal, the one
/// from its first pixel if they are equal. Of point grids those that turn as most do: the others are seen from behind.
fn halves(image: &RangeImage, eye: &Eye, limit: f64) -> Vec<Half> {
    let cols = image.cols();
    let sample = |i: usize| image.point_in_sensor(i);
    let mut found: Vec<[usize; 3]> = Vec::new();
    for row in 1..image.rows() {
        for col in 1..cols {
            let [a, b, c, d] =
                [(row - 1, col - 1), (row - 1, col), (row, col), (row, col - 1)].map(|(r, c)| r * cols + c);
            let valid: Vec<usize> = [a, b, c, d].into_iter().filter(|&i| !sample(i).is_nan()).collect();
            match valid[..] {
                [p, q, r] => found.push([p, q, r]),
                [..] if valid.len() < 3 => {}
                _ if sample(a).distance_squared(sample(c)) <= sample(b).distance_squared(sample(d)) => {
                    found.extend([[a, b, c], [a, c, d]]);
                }
                _ => found.extend([[a, b, d], [b, c, d]]),
            }
        }
    }
    let short = |i: usize, j: usize| sample(i).distance_squared(sample(j)) <= limit * limit;
    found.retain(|&[i, j, k]| short(i, j) && short(j, k) && short(k, i));
    let turn = |corners: &[usize; 3]| {
        let [p, q, r] = corners.map(|i| eye.place(sample(i)));
        side(p, q, r)
    };
    let balance: f64 = found.iter().map(turn).filter(|&t| t != 0.0).map(f64::signum).sum();
    found.retain(|corners| turn(corners) * balance > 0.0);
    let half = |corners: [usize; 3]| Half {
        places: corners.map(|i| eye.place(sample(i))),
        depth: corners.map(|i| eye.depth(sample(i))).iter().sum::<f64>() / 3.0,
    };
    found.into_iter().map(half).collect()
}

/// Nearest first, those that are seen beside all that stay.
fn seen_halves(mut halves: Vec<Half>) -> Vec<Half> {
    halves.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let mut stay: Vec<Half> = Vec::new();
    for half in halves {
        if !stay.iter().any(|other| overlap(half.places, other.places)) {
            stay.push(half);
        }
    }
    stay
}

/// Checks that the mesh covers what is seen of the halves of cells, each ray once, and nothing else.
fn assert_covers(image: &RangeImage, mesh: &TriMesh, limit: f64) {
    let eye = Eye::of(image);
    let halves = seen_halves(halves(image, &eye, limit));
    let triangles: Vec<[DVec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t).map(|p| eye.place(p))).collect();
    // Seen so narrow that rounding decides what its rays meet.
    let is_narrow = |half: &&Half| rays(half.places).iter().any(|&ray| inside(half.places, ray) < 1e-10);
    for half in halves.iter().filter(|half| !is_narrow(half)) {
        let met = rays(half.places).map(|ray| triangles.iter().filter(|&&t| inside(t, ray) > 0.0).count());
        assert_eq!(met, [1; 4], "triangles that each of four rays through half a cell meets");
    }
    let expected: f64 = halves.iter().map(|half| eye.area(half.places)).sum();
    let area: f64 = triangles.iter().map(|&t| eye.area(t)).sum();
    assert!((expected - area).abs() <= 1e-9 * area, "covers {area} of {expected}");
}

/// The points of an image moved about, as a grid that folds.
fn folded(image: &RangeImage, by: f64, seed: u64) -> RangeImage {
    let grid = as_point_grid(image);
    let Samples::Points(mut points) = grid.samples().clone() else { unreachable!("a point grid") };
    for (i, point) in points.iter_mut().enumerate() {
        for (axis, coordinate) in point.iter_mut().enumerate() {
            *coordinate += (by * (noise(seed, (3 * i + axis) as u64) - 0.5)) as f32;
        }
    }
    let Projection::PointGrid(viewing) = *grid.projection() else { unreachable!("a point grid") };
    RangeImage::from_points(grid.rows(), grid.cols(), points, viewing).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(128)))]

    #[test]
    fn the_mesh_covers_what_the_contract_says(
        scene in scenes(), [rows, cols] in [2..14_usize, 2..14], kind in 0..48_usize, by in 0.0..0.2_f64,
        tolerance in tolerances(), limit in prop_oneof![Just(1e6), 0.05..1.0_f64], effort in 0..3_u32, interpolate in any::<bool>(),
    ) {
        let scene = Scene { rows, cols, ..scene };
        let image = seen(&scene, kind % 32);
        let image = if kind < 32 { image } else { folded(&image, by, scene.seed) };
        let triangulation = TriangulateParams { edge_limit: Some(limit), ..TriangulateParams::default() };
        let params = SculptParams { effort, interpolate, triangulation, ..absolute(tolerance) };
        prop_assume!(has_triangles(&image, &params));
        let sculpted = sculpt(&image, &params);
        assert_covers(&image, &sculpted.mesh, limit);
    }

    #[test]
    fn a_scan_that_goes_around_more_than_once_covers_each_ray_once(
        scene in scenes(), [rows, cols] in [6..16_usize, 16..32], turns in 0.5..2.0_f64, height in 1.0..5.0_f64,
        tolerance in tolerances(),
    ) {
        let scene = Scene { rows, cols, ..scene };
        let step = [std::f64::consts::TAU * turns / cols as f64, height / rows as f64];
        // None at the same range as another.
        let range = |i: usize| scene.value((i / cols) as f64, (i % cols) as f64) + 1e-3 * noise(scene.seed, i as u64);
        let values = (0..rows * cols).map(range).collect();
        // No row at the horizon, where all edges lie on one line: what touches counts for what overlaps.
        let projection = Projection::Spherical { first: [0.3, -0.5 * height + 0.0123], step };
        let image = RangeImage::from_values(rows, cols, values, projection).unwrap();
        let triangulation = TriangulateParams { edge_limit: Some(1e6), ..TriangulateParams::default() };
        let params = SculptParams { triangulation, ..absolute(tolerance) };
        prop_assume!(has_triangles(&image, &params));
        let sculpted = sculpt(&image, &params);
        assert_covers(&image, &sculpted.mesh, 1e6);
    }
}
