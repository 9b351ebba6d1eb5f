//! The inside of polygons.

use super::*;

fn polygon_of(plane: &Plane, lattice: &[I64Vec2]) -> Option<Vec<[u32; 3]>> {
    let points = plane.points(lattice);
    let corners = <[usize; 3]>::try_from(span::of(&points, &Progress::none()).unwrap()).expect("points of a plane");
    polygon(&points, corners, &Progress::none()).unwrap()
}

/// Covers the inside once, runs through the edges forward, and is locally Delaunay where triangles meet.
fn check(plane: &Plane, outline: &[I64Vec2], triangles: &[[u32; 3]]) {
    let n = outline.len() as u32;
    assert_eq!(triangles.len(), outline.len() - 2);
    let whole: i64 = (0..outline.len()).map(|i| outline[i].perp_dot(outline[(i + 1) % outline.len()])).sum();
    let areas: Vec<i64> = triangles.iter().map(|t| twice_the_area(t.map(|v| outline[v as usize]))).collect();
    assert!(areas.iter().all(|area| area.signum() == whole.signum()), "not turned as the polygon");
    assert_eq!(areas.iter().sum::<i64>(), whole);
    let apex = apexes(triangles);
    let at = |v: u32| plane.at(outline[v as usize]);
    for (&[a, b], &c) in &apex {
        match apex.get(&[b, a]) {
            Some(&d) => assert!(!is_inside([a, b, c].map(at), at(d)), "{d} is in the circle of {a}, {b}, {c}"),
            None => assert_eq!(b, (a + 1) % n, "an edge that is not the polygon's"),
        }
    }
}

/// The outline of triangles side by side, each new one with a new corner.
fn grown(lattice: &[I64Vec2], choices: &[u16]) -> Vec<I64Vec2> {
    let flat = Plane { origin: I64Vec3::ZERO, steps: [I64Vec3::X, I64Vec3::Y] };
    let triangles = triangulated(&flat.points(lattice));
    let apex = apexes(&triangles);
    let mut outline = triangles[usize::from(choices[0]) % triangles.len()].to_vec();
    for &choice in choices {
        let i = usize::from(choice) % outline.len();
        let beyond = apex.get(&[outline[(i + 1) % outline.len()], outline[i]]);
        if let Some(&corner) = beyond.filter(|corner| !outline.contains(corner)) {
            outline.insert(i + 1, corner);
        }
    }
    outline.into_iter().map(|v| lattice[v as usize]).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(base::tier::cases(400)))]

    #[test]
    fn any_simple_polygon_in_any_plane(
        lattice in prop_oneof![lattice_points(6, 36), lattice_points(4000, 120)],
        choices in prop::collection::vec(any::<u16>(), 1..200),
        is_turned in any::<bool>(),
        origin in prop::sample::select(vec![0, 7, 5_000_000, -(1_i64 << 40)]),
        steps in [step(), step()].prop_filter("parallel", |[a, b]| a.cross(*b) != I64Vec3::ZERO),
    ) {
        let plane = Plane { origin: I64Vec3::new(origin, -origin, origin / 2), steps };
        let mut outline = grown(&lattice, &choices);
        if is_turned {
            outline.reverse();
        }
        check(&plane, &outline, &polygon_of(&plane, &outline).expect("a simple polygon"));
    }

    /// Any order of any points: what is made is right, and what crosses or touches itself is refused.
    #[test]
    fn what_is_no_simple_polygon_is_refused(outline in lattice_points(5, 9)) {
        let plane = Plane { origin: I64Vec3::ONE, steps: [I64Vec3::new(2, 1, 0), I64Vec3::new(0, -1, 3)] };
        let n = outline.len();
        let edge = |i: usize| [outline[i], outline[(i + 1) % n]];
        let turn = |[a, b]: [I64Vec2; 2], c: I64Vec2| twice_the_area([a, b, c]).signum();
        let is_on = |[a, b]: [I64Vec2; 2], c: I64Vec2| turn([a, b], c) == 0 && (c - a).dot(c - b) < 0;
        let mut is_simple = true;
        for i in 0..n {
            is_simple &= (0..n).all(|v| !is_on(edge(i), outline[v]));
            for j in (0..n).filter(|&j| j != i && (j + 1) % n != i && (i + 1) % n != j) {
                let crosses = |a: [I64Vec2; 2], b: [I64Vec2; 2]| turn(a, b[0]) * turn(a, b[1]) < 0;
                is_simple &= !(crosses(edge(i), edge(j)) && crosses(edge(j), edge(i)));
            }
        }
        let made = polygon_of(&plane, &outline);
        prop_assert_eq!(made.is_some(), is_simple);
        if let Some(triangles) = made {
            check(&plane, &outline, &triangles);
        }
    }
}

#[test]
fn a_place_twice_and_a_way_back_are_refused() {
    let plane = Plane { origin: I64Vec3::ZERO, steps: [I64Vec3::X, I64Vec3::Y] };
    for outline in [
        &[[0, 0], [4, 0], [2, 2], [4, 4], [0, 4], [2, 2]][..],
        &[[0, 0], [4, 0], [4, 4], [2, 2], [4, 4], [0, 4]][..],
        &[[0, 0], [4, 0], [0, 0], [0, 4]][..],
    ] {
        let outline: Vec<I64Vec2> = outline.iter().copied().map(I64Vec2::from).collect();
        assert!(polygon_of(&plane, &outline).is_none(), "{outline:?}");
    }
}
