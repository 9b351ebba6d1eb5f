//! A naive twin, degenerate sets, and the same cells for any order and any number of threads.

use std::collections::BTreeSet;

use proptest::prelude::*;

use super::*;
use crate::predicates::{sphere_sign, volume_sign};

/// Cells by their vertices' coordinates, whatever their numbers. Ghosts as well.
fn shape(delaunay: &Delaunay3, points: &[DVec3]) -> BTreeSet<Vec<[u64; 3]>> {
    let bits = |v: u32| if v == INFINITE { [u64::MAX; 3] } else { points[v as usize].to_array().map(f64::to_bits) };
    let shape: BTreeSet<_> = delaunay
        .cells()
        .iter()
        .map(|cell| {
            let mut corners = cell.vertices.map(bits).to_vec();
            corners.sort_unstable();
            corners
        })
        .collect();
    assert_eq!(shape.len(), delaunay.cells().len(), "no two cells have the same vertices");
    shape
}

fn tetrahedralized(points: &[DVec3], threads: usize) -> Delaunay3 {
    let delaunay = Delaunay3::new(points, threads, &Progress::none()).unwrap();
    delaunay.check(points).unwrap();
    delaunay
}

/// Whether the lifted point `p` is below the hyperplane of the lifted cell. Ties are broken as by the engine's rule, but found by moving
/// the points: the later a point in the order of coordinates, the more it is lifted.
fn naive_is_inside(cell: [DVec3; 4], p: DVec3, arithmetic: Arithmetic) -> bool {
    let exact = sphere_sign([cell[0], cell[1], cell[2], cell[3], p], arithmetic);
    if exact != 0 {
        return exact > 0;
    }
    let mut order: Vec<usize> = (0..5).collect();
    let at = |i: usize| if i == 4 { p } else { cell[i] };
    order.sort_by(|&i, &j| at(j).to_array().partial_cmp(&at(i).to_array()).unwrap());
    for i in order {
        if i == 4 {
            return false;
        }
        let mut replaced = cell;
        replaced[i] = p;
        match volume_sign(replaced, arithmetic) {
            0 => {}
            side => return side > 0,
        }
    }
    unreachable!("a cell is not flat")
}

/// All tetrahedra with empty spheres, by trying all.
fn naive(points: &[DVec3]) -> BTreeSet<Vec<[u64; 3]>> {
    let (arithmetic, factor) = Arithmetic::of(points.iter().copied());
    let mut distinct = points.to_vec();
    distinct.sort_by(|a, b| a.to_array().partial_cmp(&b.to_array()).unwrap());
    distinct.dedup();
    let n = distinct.len();
    let mut cells = BTreeSet::new();
    for a in 0..n {
        for b in a + 1..n {
            for c in b + 1..n {
                for d in c + 1..n {
                    let mut cell = [a, b, c, d].map(|i| distinct[i] * factor);
                    match volume_sign(cell, arithmetic) {
                        0 => continue,
                        -1 => cell.swap(0, 1),
                        _ => {}
                    }
                    let is_empty = (0..n)
                        .filter(|i| ![a, b, c, d].contains(i))
                        .all(|i| !naive_is_inside(cell, distinct[i] * factor, arithmetic));
                    if is_empty {
                        let mut corners: Vec<_> =
                            [a, b, c, d].map(|i| distinct[i].to_array().map(f64::to_bits)).to_vec();
                        corners.sort_unstable();
                        cells.insert(corners);
                    }
                }
            }
        }
    }
    cells
}

fn finite(shape: BTreeSet<Vec<[u64; 3]>>) -> BTreeSet<Vec<[u64; 3]>> {
    shape.into_iter().filter(|corners| corners[3] != [u64::MAX; 3]).collect()
}

fn agrees_with_the_naive_twin(points: &[DVec3]) {
    agrees_on(points, 1);
}

fn agrees_on(points: &[DVec3], threads: usize) {
    match Delaunay3::new(points, threads, &Progress::none()) {
        Ok(delaunay) => {
            delaunay.check(points).unwrap();
            assert_eq!(finite(shape(&delaunay, points)), naive(points), "{points:?}");
        }
        Err(error) => {
            assert!(naive(points).is_empty(), "{error}: {points:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(1500)))]

    #[test]
    fn agrees_with_the_naive_twin_on_small_integers(
        points in prop::collection::vec(prop::array::uniform3(0_i8..3), 4..12)
    ) {
        agrees_with_the_naive_twin(&points.iter().map(|p| DVec3::from(p.map(f64::from))).collect::<Vec<_>>());
    }

    #[test]
    fn agrees_with_the_naive_twin_on_integers(
        points in prop::collection::vec(prop::array::uniform3(-20_000_i32..20_000), 4..11)
    ) {
        agrees_with_the_naive_twin(&points.iter().map(|p| DVec3::from(p.map(f64::from))).collect::<Vec<_>>());
    }

    #[test]
    fn agrees_with_the_naive_twin_on_doubles(points in prop::collection::vec(prop::array::uniform3(-1.0..1.0), 4..11)) {
        agrees_with_the_naive_twin(&points.iter().map(|&p| DVec3::from(p)).collect::<Vec<_>>());
    }

    /// Points on a sphere's lattice, in a plane but for a few, on lines, with tiny and huge coordinates among them.
    #[test]
    fn agrees_with_the_naive_twin_on_mixed_scales(
        points in prop::collection::vec(prop::array::uniform3(prop::sample::select(
            vec![0.0, 1.0, -1.0, 0.1, 1e-30, 1e-300, 5e-324, 1e12, 1e300, -1e300])), 4..10)
    ) {
        agrees_with_the_naive_twin(&points.iter().map(|&p| DVec3::from(p)).collect::<Vec<_>>());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(20)))]

    #[test]
    fn agrees_with_the_naive_twin_on_more_integers(
        points in prop::collection::vec(prop::array::uniform3(0_i8..5), 30..60)
    ) {
        agrees_with_the_naive_twin(&points.iter().map(|p| DVec3::from(p.map(f64::from))).collect::<Vec<_>>());
    }

    #[test]
    fn agrees_with_the_naive_twin_on_more_doubles(points in prop::collection::vec(prop::array::uniform3(-1.0..1.0), 30..50)) {
        agrees_with_the_naive_twin(&points.iter().map(|&p| DVec3::from(p)).collect::<Vec<_>>());
    }
}

/// Centre and squared radius of the sphere around a cell. `None` if rounding decides them.
fn sphere([a, b, c, d]: [DVec3; 4]) -> Option<(DVec3, f64)> {
    let [u, v, w] = [b - a, c - a, d - a];
    let volume = u.dot(v.cross(w));
    if volume.abs() < 1e-4 * u.length() * v.length() * w.length() {
        return None;
    }
    let to = (v.cross(w) * u.length_squared() + w.cross(u) * v.length_squared() + u.cross(v) * w.length_squared())
        / (2.0 * volume);
    Some((a + to, to.length_squared()))
}

/// Theorem: on several threads, too, cells are those of the naive twin, told of sets too large to try all. Each has a sphere that is empty
/// of all points, ties broken by the naive rule. Together they fill the convex hull exactly. There is one such set of cells.
#[test]
fn on_several_threads_all_spheres_are_empty_and_the_hull_is_full() {
    // Whole numbers, which volumes are exact of; many on common spheres, in planes, and equal.
    let whole = |side: f64, count: usize| scattered(count).iter().map(|p| (p * side).floor()).collect::<Vec<_>>();
    for (name, points, threads) in
        [("dense", whole(16.0, 5_000), 2), ("sparse", whole(4000.0, 5_000), 2), ("four threads", whole(40.0, 5_000), 4)]
    {
        let delaunay = tetrahedralized(&points, threads);
        let (arithmetic, factor) = Arithmetic::of(points.iter().copied());
        let copies: BTreeSet<u32> = delaunay.duplicates().iter().map(|copy| copy[0]).collect();
        let distinct: Vec<u32> = (0..points.len() as u32).filter(|i| !copies.contains(i)).collect();
        let at = |v: u32| points[v as usize];
        let volume = |[a, b, c]: [DVec3; 3]| a.dot(b.cross(c)) as i128;
        let (mut filled, mut hull) = (0, 0);
        for cell in delaunay.cells() {
            let [a, b, c, d] = cell.vertices;
            if d == INFINITE {
                hull += volume([a, b, c].map(at));
                let is_inner = |&p: &u32| volume_sign([a, b, c, p].map(|v| at(v) * factor), arithmetic) <= 0;
                assert!(distinct.iter().all(is_inner), "{name}: {cell:?}");
                continue;
            }
            let corners = cell.vertices.map(at);
            filled += volume([corners[1], corners[2], corners[3]].map(|p| p - corners[0]));
            let around = sphere(corners);
            let is_far =
                |p: DVec3| around.is_some_and(|(centre, square)| (p - centre).length_squared() > square * (1.0 + 1e-6));
            let is_inside = |&p: &u32| {
                !cell.vertices.contains(&p)
                    && !is_far(at(p))
                    && naive_is_inside(corners.map(|p| p * factor), at(p) * factor, arithmetic)
            };
            assert!(!distinct.iter().any(is_inside), "{name}: {cell:?}");
        }
        assert!(filled == hull && filled > 0, "{name}: {filled} of {hull}");
    }
}

/// Points of a small linear congruential generator, in the unit cube.
fn scattered(count: usize) -> Vec<DVec3> {
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..count).map(|_| DVec3::new(next(), next(), next())).collect()
}

fn grid(side: i32) -> Vec<DVec3> {
    let axis = 0..side;
    let plane =
        |x: i32| axis.clone().flat_map(move |y| (0..side).map(move |z| DVec3::new(x.into(), y.into(), z.into())));
    axis.clone().flat_map(plane).collect()
}

/// At random on a torus, or up to `off` from it. Spheres that touch it along a circle, without that of all its points there, make cells
/// that span its hole and its inside.
fn torus(count: usize, off: f64) -> Vec<DVec3> {
    let place = |p: &DVec3| {
        let [u, v] = [p.x, p.y].map(|x| std::f64::consts::TAU * x);
        let r = 0.35 + off * p.z;
        DVec3::new((1.0 + r * v.cos()) * u.cos(), (1.0 + r * v.cos()) * u.sin(), r * v.sin())
    };
    scattered(count).iter().map(place).collect()
}

/// Many kinds of points, each more than a thread's share.
fn large_sets() -> Vec<(&'static str, Vec<DVec3>)> {
    let cube = scattered(30_000);
    let sphere = cube.iter().map(|p| (p - 0.5).normalize()).collect();
    let layers = grid(20).into_iter().chain(grid(20).iter().map(|p| p * DVec3::new(1.0, 1.0, 0.0) + 0.5)).collect();
    let clusters = cube.iter().map(|p| if p.x < 0.5 { *p } else { p + 1e12 }).collect();
    let copies = scattered(60).iter().flat_map(|p| std::iter::repeat_n(*p, 1000)).collect();
    let flat = cube.iter().map(|p| DVec3::new(p.x, p.y, p.z * 1e-9)).collect();
    let curve = (0..300).map(|i| f64::from(i) / 16.0).map(|t| DVec3::new(t, t * t, t * t * t)).collect();
    vec![
        ("cube", cube),
        ("grid", grid(30)),
        ("sphere", sphere),
        ("layers", layers),
        ("clusters", clusters),
        ("copies", copies),
        ("flat", flat),
        ("curve", curve),
        ("torus", torus(10_000, 0.0)),
    ]
}

#[test]
fn is_the_same_for_any_number_of_threads_and_any_order() {
    for (name, points) in large_sets() {
        let one = tetrahedralized(&points, 1);
        let expected = shape(&one, &points);
        let many: &[usize] = if base::tier::is_thorough() { &[2, 8] } else { &[2] };
        for &threads in many {
            let many = tetrahedralized(&points, threads);
            assert_eq!(shape(&many, &points), expected, "{name} on {threads} threads");
            assert_eq!(many.duplicates(), one.duplicates(), "{name} on {threads} threads");
        }
        let mut turned = points.clone();
        turned.reverse();
        assert_eq!(shape(&tetrahedralized(&turned, 2), &turned), expected, "{name} in reverse");
    }
}

#[test]
fn threads_put_off_few_points_of_a_surface() {
    // Ways that leave the surface lead through cells of the other thread.
    let points = torus(120_000, 1e-3);
    let left = with_last_round(&points, |build, ids| {
        let left = base::threads::pool(2).unwrap().install(|| build.insert_in_parallel(&ids, 2, 0)).unwrap();
        [left.len(), ids.len()]
    });
    assert!(left[0] * 6 < left[1], "{left:?}");
}

/// Exact tori have twice as many cells a point as there is room for at first.
#[test]
fn threads_go_on_where_the_room_for_cells_is_used_up() {
    with_last_round(&torus(60_000, 0.0), |build, ids| {
        let room = build.cells.room();
        let (in_turn, ids) = ids.split_at(20_000);
        build.insert_in_turn(in_turn.iter().copied()).unwrap();
        assert_eq!(build.cells.room(), room, "used up too early");
        let left = base::threads::pool(2).unwrap().install(|| build.insert_in_parallel(ids, 2, 0)).unwrap();
        let wanted = build.cells.taken() as usize + 10 * left.len();
        assert!(!left.is_empty() && build.cells.room() > wanted, "{} for {wanted}", build.cells.room());
    });
}

/// Half of an exact torus's points are put off whatever the blocks: eight passes would try each four times.
#[test]
fn threads_do_not_try_in_vain() {
    let points = torus(60_000, 0.0);
    let progress = Progress::none();
    let room = 100.0 * points.len() as f64;
    progress.stage(0, room as u64);
    let order = Order::of(&points, 0.0, &progress).unwrap();
    let sorted = order.sorted(&points).unwrap();
    base::threads::pool(2).unwrap().install(|| Build::of_all(&sorted, &order, 2, &progress)).unwrap();
    let tried = progress.tick().fraction * room / points.len() as f64;
    assert!((0.9..1.6).contains(&tried), "each point is tried {tried} times");
}

/// Of a tetrahedralization to which only the last round is missing, with the points of that.
fn with_last_round<T>(points: &[DVec3], look: impl FnOnce(&mut Build<'_, '_>, Vec<u32>) -> T) -> T {
    let progress = Progress::none();
    let order = Order::of(points, 0.0, &progress).unwrap();
    let sorted = order.sorted(points).unwrap();
    let signs = Signs::new(&sorted, order.extent, order.arithmetic);
    let mut build = Build::start(&signs, &progress).unwrap();
    let last = *order.rounds.last().unwrap();
    build.insert_in_turn(4..last as u32).unwrap();
    let ids: Vec<u32> = (last as u32..points.len() as u32).collect();
    look(&mut build, ids)
}

#[test]
fn in_place_the_cells_are_the_same_and_the_points_come_back() {
    let huge = scattered(50).iter().map(|p| (p - 0.5) * f64::MAX).collect();
    let tiny =
        (0..60).map(|i| DVec3::new(f64::from(i % 7), f64::from(i * i % 11), f64::from(i % 3)) * 5e-324).collect();
    let mixed = (0..60).map(|i| DVec3::new(-0.0, 1e300, 1e-300) * (scattered(60)[i] - 0.5)).collect();
    let mut sets = large_sets();
    sets.extend([("huge", huge), ("tiny", tiny), ("mixed", mixed), ("none", Vec::new()), ("one", vec![DVec3::ONE])]);
    for (name, points) in sets {
        let mut moved = points.clone();
        let bits = |points: &[DVec3]| points.iter().map(|p| p.to_array().map(f64::to_bits)).collect::<Vec<_>>();
        match (Delaunay3::new(&points, 1, &Progress::none()), Delaunay3::in_place(&mut moved, 1, &Progress::none())) {
            (Ok(copied), Ok(placed)) => {
                placed.check(&points).unwrap_or_else(|wrong| panic!("{name}: {wrong}"));
                assert_eq!(copied.cells(), placed.cells(), "{name}");
            }
            (Err(copied), Err(placed)) => assert_eq!(copied.to_string(), placed.to_string(), "{name}"),
            _ => panic!("{name}: one of two fails"),
        }
        assert_eq!(bits(&points), bits(&moved), "{name}");
    }
    let mut points = scattered(20_000);
    let outcome = Delaunay3::in_place(&mut points, 1, &Progress::cancel_after(10));
    assert!(matches!(outcome, Err(Error::Cancelled)));
    assert_eq!(points, scattered(20_000));
}

/// The factor that brings the largest coordinate to 1 would itself be infinite.
#[test]
fn denormal_coordinates_are_ordinary_input() {
    let corners: Vec<DVec3> = grid(3).iter().map(|p| p * 5e-324).collect();
    assert_eq!(tetrahedralized(&corners, 1).cells(), tetrahedralized(&grid(3), 1).cells());
}

#[test]
fn copies_are_listed_with_the_first_of_them() {
    let mut points = scattered(500);
    points.extend(points[..100].to_vec());
    points.extend(points[..10].to_vec());
    let delaunay = tetrahedralized(&points, 1);
    let expected: Vec<[u32; 2]> = (0..100).map(|i| [500 + i, i]).chain((0..10).map(|i| [600 + i, i])).collect();
    assert_eq!(delaunay.duplicates(), expected);
}

#[test]
fn points_that_span_no_volume_are_refused() {
    let refused = |points: &[DVec3], expected: &str| {
        let error = Delaunay3::new(points, 1, &Progress::none()).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    let p = DVec3::new(0.1, 0.2, 0.3);
    refused(&[], "no points");
    refused(&[p], "equal");
    refused(&[p; 7], "equal");
    refused(&[p, p * 2.0], "line");
    refused(&[p, p * 2.0, p * 4.0, p * 8.0], "line");
    refused(&[p, p * 2.0, DVec3::X], "plane");
    let in_plane: Vec<DVec3> = grid(5).iter().map(|p| DVec3::new(p.x, p.y, p.x + p.y)).collect();
    refused(&in_plane, "plane");
    let line = [1e-300, 1.0, 1e300].map(DVec3::splat);
    refused(&line, "line");
    refused(&[p, DVec3::X, DVec3::new(0.0, f64::NAN, 0.0)], "point 2");
    refused(&[p, DVec3::X, DVec3::new(0.0, f64::INFINITY, 0.0)], "point 2");
}

/// Every point is a vertex or listed as the copy of one, or the error says what is missing. On one thread and on two.
#[test]
fn degenerate_points_give_cells_or_say_why() {
    let cycle = [(65, 0), (63, 16), (60, 25), (56, 33), (52, 39)];
    let circle: Vec<DVec3> = cycle
        .iter()
        .flat_map(|&(x, y)| [(x, y), (-y, x), (-x, -y), (y, -x)])
        .map(|(x, y)| DVec3::new(f64::from(x), f64::from(y), 0.0))
        .collect();
    let poles = [DVec3::new(0.0, 0.0, 65.0), DVec3::new(0.0, 0.0, -65.0)];
    let sphere = [circle.clone(), circle.iter().map(|p| DVec3::new(p.x, 0.0, p.y)).collect(), poles.to_vec()].concat();
    let line: Vec<DVec3> = (0..9).map(|i| DVec3::splat(f64::from(i))).collect();
    let clusters = grid(4).into_iter().chain(grid(4).iter().map(|p| p + 1e12)).collect();
    let copies = grid(2).iter().flat_map(|p| [*p; 1000]).collect();
    let tiny = grid(3).iter().map(|p| p * 5e-324).collect();
    let with = |p: DVec3| [grid(2), vec![p]].concat();
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let cases: [(&str, Vec<DVec3>, std::result::Result<usize, &str>); 20] = [
        ("empty", vec![], Err("no points")),
        ("1 point", corners[..1].to_vec(), Err("equal")),
        ("2 points", corners[..2].to_vec(), Err("line")),
        ("3 points", corners[..3].to_vec(), Err("plane")),
        ("4 points", corners.to_vec(), Ok(4)),
        ("all equal", vec![DVec3::ONE; 100], Err("equal")),
        ("collinear", line.clone(), Err("line")),
        ("collinear but one", [line, vec![DVec3::X]].concat(), Err("plane")),
        ("coplanar", grid(5).iter().map(|p| DVec3::new(p.x, p.y, p.x)).collect(), Err("plane")),
        ("cocircular", circle.clone(), Err("plane")),
        ("cocircular but two", [circle, poles.to_vec()].concat(), Ok(22)),
        ("cospherical", sphere, Ok(38)),
        ("grid", grid(6), Ok(216)),
        ("two clusters 1e12 apart", clusters, Ok(128)),
        ("1,000 copies of each point", copies, Ok(8)),
        ("NaN", with(DVec3::new(0.0, f64::NAN, 0.0)), Err("point 8 is")),
        ("infinity", with(DVec3::new(f64::INFINITY, 0.0, 0.0)), Err("point 8 is")),
        ("minus infinity", with(DVec3::new(0.0, 0.0, f64::NEG_INFINITY)), Err("point 8 is")),
        ("denormals", tiny, Ok(27)),
        ("the largest numbers", with(DVec3::splat(-f64::MAX)), Ok(9)),
    ];
    for (name, points, expected) in cases {
        for threads in [1, 2] {
            match (Delaunay3::new(&points, threads, &Progress::none()), expected) {
                (Ok(delaunay), Ok(vertices)) => {
                    delaunay.check(&points).unwrap_or_else(|e| panic!("{name}: {e}"));
                    assert_eq!(points.len() - delaunay.duplicates().len(), vertices, "{name}");
                    let used: BTreeSet<u32> = delaunay.cells().iter().flat_map(|cell| cell.vertices).collect();
                    assert_eq!(used.len(), vertices + 1, "{name}: with the one at infinity");
                }
                (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{name}: {error}"),
                (outcome, _) => panic!("{name}: {outcome:?}"),
            }
        }
    }
}

/// All cells are in conflict with the last point, whose star has more vertices than 16 bits count.
#[test]
fn a_star_of_seventy_thousand_vertices() {
    let mut points: Vec<DVec3> = scattered(70_000).iter().map(|p| (p - 0.5).normalize()).collect();
    points.push(DVec3::ZERO);
    let delaunay = tetrahedralized(&points, 1);
    let around = delaunay.cells().iter().filter(|cell| cell.vertices.contains(&70_000)).count();
    assert!(around > 100_000, "{around}");
}

#[test]
fn any_power_of_two_makes_the_same_cells() {
    let points = scattered(300);
    let expected = tetrahedralized(&points, 1);
    for exponent in [-900, -300, 300, 900] {
        let scaled: Vec<DVec3> = points.iter().map(|p| *p * 2.0_f64.powi(exponent)).collect();
        assert_eq!(tetrahedralized(&scaled, 1).cells(), expected.cells(), "{exponent}");
    }
}

#[test]
fn four_points_are_one_cell() {
    let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let delaunay = tetrahedralized(&points, 1);
    assert_eq!((delaunay.finite_count(), delaunay.cells().len()), (1, 5));
}

#[test]
fn cancelling_ends_the_work() {
    let points = scattered(20_000);
    for threads in [1, 2] {
        for checks in [0, 1, 10, 40] {
            let outcome = Delaunay3::new(&points, threads, &Progress::cancel_after(checks));
            assert!(matches!(outcome, Err(Error::Cancelled)));
        }
    }
}
