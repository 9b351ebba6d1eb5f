//! The inside of loops.

use glam::DVec2;

use super::*;

/// Side of the lattice of cells.
const CELLS: i64 = 5;

/// The directed edges between cells that are inside and those that are not, over the corners that they use.
fn bounds_of(is_inside: impl Fn(I64Vec2) -> bool, step: I64Vec2, shear: i64) -> (Vec<I64Vec2>, Vec<[u32; 2]>) {
    let (mut points, mut segments) = (Vec::new(), Vec::new());
    let mut number = |p: I64Vec2| {
        let p = I64Vec2::new(p.x * step.x + shear * p.y, p.y * step.y);
        let found = points.iter().position(|&other| other == p);
        found.unwrap_or_else(|| {
            points.push(p);
            points.len() - 1
        }) as u32
    };
    for cell in (0..CELLS * CELLS).map(|i| I64Vec2::new(i % CELLS, i / CELLS)).filter(|&cell| is_inside(cell)) {
        let around = [I64Vec2::ZERO, I64Vec2::X, I64Vec2::ONE, I64Vec2::Y];
        let beyond = [I64Vec2::NEG_Y, I64Vec2::X, I64Vec2::Y, I64Vec2::NEG_X];
        for k in 0..4 {
            if !is_inside(cell + beyond[k]) {
                segments.push([number(cell + around[k]), number(cell + around[(k + 1) % 4])]);
            }
        }
    }
    (points, segments)
}

fn triangulation(points: &[I64Vec2], segments: &[[u32; 2]]) -> Option<Vec<[u32; 3]>> {
    let points: Vec<DVec2> = points.iter().map(|p| p.as_dvec2()).collect();
    region(&points, segments, &Progress::none()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(400)))]

    /// Any cells: holes, islands in them, and loops that meet in corners.
    #[test]
    fn the_inside_is_covered_once(cells: [bool; 25], step in (1_i64..9, 1_i64..9), shear in -5_i64..6) {
        let is_inside = |cell: I64Vec2| {
            cell.min_element() >= 0 && cell.max_element() < CELLS && cells[(cell.x + CELLS * cell.y) as usize]
        };
        let (points, segments) = bounds_of(is_inside, I64Vec2::new(step.0, step.1), shear);
        let triangles = triangulation(&points, &segments).expect("they cross nowhere");
        let areas: Vec<i64> = triangles.iter().map(|t| twice_the_area(t.map(|v| points[v as usize]))).collect();
        prop_assert!(areas.iter().all(|&area| area > 0));
        let inside = cells.iter().filter(|inside| **inside).count() as i64;
        prop_assert_eq!(areas.iter().sum::<i64>(), 2 * inside * step.0 * step.1);
        // The border of the triangles is what was given.
        let apex = apexes(&triangles);
        let open: BTreeSet<[u32; 2]> = apex.keys().filter(|[a, b]| !apex.contains_key(&[*b, *a])).copied().collect();
        prop_assert_eq!(open, segments.iter().copied().collect::<BTreeSet<_>>());
        for (&[a, b], &c) in &apex {
            if let Some(&d) = apex.get(&[b, a]) {
                let [a, b, c, d] = [a, b, c, d].map(|v| points[v as usize].extend(0));
                prop_assert!(!super::is_inside([a, b, c], d), "not Delaunay");
            }
        }
    }
}

const SQUARE: [I64Vec2; 4] = [I64Vec2::ZERO, I64Vec2::new(4, 0), I64Vec2::new(4, 4), I64Vec2::new(0, 4)];
const AROUND: [[u32; 2]; 4] = [[0, 1], [1, 2], [2, 3], [3, 0]];

#[test]
fn what_bounds_no_region_is_refused() {
    let none = None::<Vec<[u32; 3]>>;
    // Across itself, turned over, open, twice around, over a point, two points at one place.
    assert_eq!(triangulation(&SQUARE, &[[0, 1], [1, 3], [3, 2], [2, 0]]), none);
    assert_eq!(triangulation(&SQUARE, &AROUND.map(|[a, b]| [b, a])), none);
    assert_eq!(triangulation(&SQUARE, &AROUND[..3]), none);
    assert_eq!(triangulation(&SQUARE, &[AROUND, AROUND].concat()), none);
    assert_eq!(triangulation(&[&SQUARE[..], &[I64Vec2::new(2, 0)]].concat(), &AROUND), none);
    assert_eq!(triangulation(&[&SQUARE[..], &[SQUARE[2]]].concat(), &AROUND), none);
}

#[test]
fn points_and_segments_both_ways_become_corners_and_edges() {
    let points = [&SQUARE[..], &[I64Vec2::new(1, 1), I64Vec2::new(3, 2), I64Vec2::new(9, 9)]].concat();
    let triangles = triangulation(&points, &[&AROUND[..], &[[4, 5], [5, 4]]].concat()).unwrap();
    assert_eq!(triangles.iter().map(|t| twice_the_area(t.map(|v| points[v as usize]))).sum::<i64>(), 32);
    let apex = apexes(&triangles);
    assert!(apex.contains_key(&[4, 5]) && apex.contains_key(&[5, 4]));
    assert!(!triangles.iter().flatten().any(|&v| v == 6));
    assert_eq!(triangulation(&[], &[]), Some(Vec::new()));
}
