use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use proptest::prelude::*;

use super::*;

fn mesh(vertices: usize, triangles: &[[u32; 3]]) -> TriMesh {
    let positions = (0..vertices).map(|i| {
        let i = i as f64;
        DVec3::new(i, i * i, i * i * i)
    });
    TriMesh::new(positions.collect(), triangles.to_vec())
}

/// A grid of squares on a torus (`wrap`) or in the plane, two triangles each.
pub(crate) fn grid(rows: u32, cols: u32, wrap: bool) -> TriMesh {
    let (height, width) = if wrap { (rows, cols) } else { (rows + 1, cols + 1) };
    let at = |r: u32, c: u32| (r % height) * width + c % width;
    let mut triangles = Vec::new();
    for r in 0..rows {
        for c in 0..cols {
            triangles.push([at(r, c), at(r, c + 1), at(r + 1, c + 1)]);
            triangles.push([at(r, c), at(r + 1, c + 1), at(r + 1, c)]);
        }
    }
    mesh((height * width) as usize, &triangles)
}

const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

#[test]
fn known_topologies() {
    let ball = check(&mesh(4, &TETRAHEDRON));
    assert!(ball.is_closed());
    assert_eq!((ball.euler_characteristic, ball.components, ball.edges, ball.genus()), (2, 1, 6, Some(0)));
    let torus = check(&grid(5, 7, true));
    assert!(torus.is_closed());
    assert_eq!((torus.euler_characteristic, torus.genus()), (0, Some(1)));
    let disk = check(&grid(5, 7, false));
    assert!(disk.is_manifold() && !disk.is_closed());
    assert_eq!((disk.boundary_edges, disk.boundary_loops, disk.genus()), (24, 1, Some(0)));
    assert_eq!(disk.euler_characteristic, 1);
    assert_eq!(check(&TriMesh::default()), CheckReport::default());
}

#[test]
fn the_first_fault_has_a_place() {
    let first = |extra: &[[u32; 3]]| {
        let triangles = [&[[4, 6, 5], [4, 5, 7], [5, 6, 7], [6, 4, 7]], extra].concat();
        first_fault(&mesh(16, &triangles), &Progress::none()).unwrap()
    };
    assert_eq!(first(&[]), None);
    assert_eq!(first(&[[9, 8, 9]]), Some(8));
    assert_eq!(first(&[[6, 5, 4]]), Some(4));
    assert_eq!(first(&[[5, 6, 9]]), Some(5));
    assert_eq!(first(&[[7, 8, 9]]), Some(7));
    assert_eq!(first(&[[10, 11, 12], [10, 11, 13]]), Some(10));
    assert_eq!(first(&[[10, 11, 12]]), None);
}

#[test]
fn each_fault_is_found_and_named() {
    let fault = |extra: &[[u32; 3]]| {
        let mut triangles = TETRAHEDRON.to_vec();
        triangles.extend_from_slice(extra);
        check(&mesh(9, &triangles))
    };
    assert!(fault(&[]).is_manifold());
    assert_eq!(fault(&[]).unused_vertices, 5);
    assert_eq!(fault(&[[0, 1, 9]]).out_of_range_triangles, 1);
    assert_eq!(fault(&[[4, 5, 4]]).degenerate_triangles, 1);
    assert_eq!(fault(&[[2, 1, 0]]).duplicate_triangles, 1);
    assert_eq!(fault(&[[0, 1, 5]]).non_manifold_edges, 1);
    let touching = fault(&[[3, 4, 5]]);
    assert_eq!((touching.non_manifold_vertices, touching.components), (1, 1));
    assert!(touching.to_string().contains("1 non-manifold vertices"));
    let turned = check(&mesh(4, &[[0, 1, 2], [1, 2, 3]]));
    assert_eq!(turned.misoriented_edges, 1);
    for report in [fault(&[[0, 1, 9]]), fault(&[[4, 5, 4]]), fault(&[[2, 1, 0]]), fault(&[[0, 1, 5]]), touching, turned]
    {
        assert!(!report.is_manifold() && report.genus().is_none());
    }
    let mut flat = mesh(4, &TETRAHEDRON);
    flat.positions[0] = flat.positions[1];
    assert_eq!((check(&flat).zero_area_triangles, check(&flat).is_manifold()), (2, true));
    flat.positions[0].y = f64::NAN;
    assert_eq!((check(&flat).non_finite_vertices, check(&flat).is_manifold()), (1, false));
}

#[test]
fn welding_joins_what_is_equal_in_single_precision() {
    // Two triangles as a soup; one corner differs by less than an f32 can tell, one by the sign of zero.
    let positions =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, -0.0, 0.0], [1.0, 1.0, 0.0], [1e-60, 1.0, 0.0]];
    let mesh = TriMesh::new(positions.map(DVec3::from).to_vec(), vec![[0, 1, 2], [3, 4, 5]]);
    assert_eq!((check(&mesh).components, check(&mesh).boundary_edges), (2, 6));
    let welded = check_welded(&mesh);
    assert_eq!((welded.components, welded.boundary_edges, welded.vertices), (1, 4, 4));
}

/// The same counts from maps and searches, straight from the definitions.
fn naive(vertices: usize, triangles: &[[u32; 3]]) -> CheckReport {
    let mut r = CheckReport { triangles: triangles.len(), ..CheckReport::default() };
    let mut sound: Vec<[u32; 3]> = Vec::new();
    for &t in triangles {
        if t.iter().any(|&v| v as usize >= vertices) {
            r.out_of_range_triangles += 1;
        } else if t.iter().collect::<BTreeSet<_>>().len() < 3 {
            r.degenerate_triangles += 1;
        } else {
            sound.push(t);
        }
    }
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    r.duplicate_triangles = sound.len() - sound.iter().map(|&t| sorted(t)).collect::<BTreeSet<_>>().len();
    let mut edges: BTreeMap<(u32, u32), Vec<(usize, bool)>> = BTreeMap::new();
    for (t, &[a, b, c]) in sound.iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            edges.entry((p.min(q), p.max(q))).or_default().push((t, p < q));
        }
    }
    r.edges = edges.len();
    r.boundary_edges = edges.values().filter(|e| e.len() == 1).count();
    r.non_manifold_edges = edges.values().filter(|e| e.len() > 2).count();
    r.misoriented_edges = edges.values().filter(|e| e.len() == 2 && e[0].1 == e[1].1).count();
    // Parts of a set under a relation, by flooding.
    let parts = |nodes: Vec<usize>, linked: &dyn Fn(usize, usize) -> bool| {
        let (mut left, mut sizes) = (nodes, Vec::new());
        while let Some(seed) = left.pop() {
            let (mut stack, mut size) = (vec![seed], 0);
            while let Some(n) = stack.pop() {
                size += 1;
                let (near, far) = left.iter().partition(|&&m| linked(n, m));
                left = far;
                stack.extend::<Vec<usize>>(near);
            }
            sizes.push(size);
        }
        sizes
    };
    let share_edge_at = |t: usize, u: usize, at: Option<u32>| {
        edges.iter().any(|(&(p, q), e)| {
            at.is_none_or(|v| v == p || v == q) && e.iter().any(|x| x.0 == t) && e.iter().any(|x| x.0 == u)
        })
    };
    for v in 0..vertices as u32 {
        let star: Vec<usize> = (0..sound.len()).filter(|&t| sound[t].contains(&v)).collect();
        r.vertices += usize::from(!star.is_empty());
        r.non_manifold_vertices += usize::from(parts(star, &|t, u| share_edge_at(t, u, Some(v))).len() > 1);
    }
    r.unused_vertices = vertices - r.vertices;
    let touch = |t: usize, u: usize| sound[t].iter().any(|v| sound[u].contains(v));
    let components = parts((0..sound.len()).collect(), &touch);
    r.components = components.len();
    r.largest_component = components.into_iter().max().unwrap_or(0);
    let rims: Vec<(u32, u32)> = edges.iter().filter(|e| e.1.len() == 1).map(|e| *e.0).collect();
    let meet = |i: usize, j: usize| {
        let ((a, b), (c, d)) = (rims[i], rims[j]);
        a == c || a == d || b == c || b == d
    };
    r.boundary_loops = parts((0..rims.len()).collect(), &meet).len();
    r.euler_characteristic = r.vertices as i64 - r.edges as i64 + sound.len() as i64;
    r
}

proptest! {
    #[test]
    fn any_soup_is_counted_as_by_the_definitions(
        triangles in prop::collection::vec([0..9_u32, 0..9_u32, 0..9_u32], 0..16),
    ) {
        let report = check(&mesh(8, &triangles));
        let zero_area_triangles = report.zero_area_triangles;
        prop_assert_eq!(report, CheckReport { zero_area_triangles, ..naive(8, &triangles) });
    }

    #[test]
    fn cutting_and_gluing_keeps_the_euler_formula(rows in 3..7_u32, cols in 3..7_u32, cut in 0..98_usize) {
        let mut torus = grid(rows, cols, true);
        let cut = cut % torus.triangles.len();
        torus.triangles.swap_remove(cut);
        let report = check(&torus);
        prop_assert!(report.is_manifold());
        prop_assert_eq!((report.boundary_loops, report.boundary_edges, report.genus()), (1, 3, Some(1)));
    }
}
