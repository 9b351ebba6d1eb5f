use glam::{DAffine3, DMat3, DQuat, DVec3};
use proptest::prelude::*;

use super::node::STACK;
use super::*;
use base::error::Result;

/// A closed ball of `bands` x `2 bands` quads with shared poles, radius 1.
fn ball(bands: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let around = 2 * bands;
    let mut positions = vec![DVec3::Z];
    for i in 1..bands {
        let polar = std::f64::consts::PI * i as f64 / bands as f64;
        for j in 0..around {
            let azimuth = std::f64::consts::TAU * j as f64 / around as f64;
            positions.push(DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()));
        }
    }
    positions.push(DVec3::NEG_Z);
    let south = positions.len() as u32 - 1;
    let at = |i: usize, j: usize| (1 + (i - 1) * around + j % around) as u32;
    let mut triangles = Vec::new();
    for j in 0..around {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([south, at(bands - 1, j + 1), at(bands - 1, j)]);
        for i in 1..bands - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    (positions, triangles)
}

/// The slow twin of `first_hit`: every triangle in turn.
fn first_hit_of_all(bvh: &Bvh<'_>, triangles: &[[u32; 3]], ray: &Ray, t_min: f64, t_max: f64) -> Option<Hit> {
    let sheared = ray::Sheared::new(ray, t_min, t_max, &bvh.frame)?;
    let mut best = None;
    for (t, corners) in triangles.iter().enumerate() {
        if let Some(hit) = sheared.meet(&corners.map(|v| bvh.positions[v as usize]), t as u32) {
            hit.keep_best(&mut best);
        }
    }
    best
}

/// Triangles whose corners share few coordinates: many touch, overlap, or have no area.
fn soup() -> impl Strategy<Value = (Vec<DVec3>, Vec<[u32; 3]>)> {
    let coordinate = prop_oneof![Just(0.0), Just(1.0), Just(-1.0), -2.0..2.0];
    let point = [coordinate.clone(), coordinate.clone(), coordinate].prop_map(DVec3::from_array);
    (prop::collection::vec(point, 3..40), 1usize..120).prop_flat_map(|(positions, count)| {
        let n = positions.len() as u32;
        (Just(positions), prop::collection::vec([0..n, 0..n, 0..n], count))
    })
}

fn direction() -> impl Strategy<Value = DVec3> {
    prop_oneof![
        Just(DVec3::NEG_Z),
        Just(DVec3::X),
        [-1.0..1.0, -1.0..1.0, -1.0..1.0].prop_map(DVec3::from_array),
        [-1.0..1.0, 0.0..1e-300, -1e-9..1e-9].prop_map(DVec3::from_array),
    ]
}

fn check_tree(bvh: &Bvh<'_>, triangles: &[[u32; 3]]) {
    let mut seen = vec![0; triangles.len()];
    let mut visits = vec![(0u32, 1)];
    while let Some((index, depth)) = visits.pop() {
        assert!(depth <= STACK);
        let node = &bvh.nodes[index as usize];
        if node.count == 0 {
            for child in [index + 1, node.link] {
                let c = &bvh.nodes[child as usize];
                assert!(node.lo().cmple(c.lo()).all() && node.hi().cmpge(c.hi()).all());
                visits.push((child, depth + 1));
            }
            continue;
        }
        for slot in node.slots(&bvh.slots) {
            seen[slot.triangle as usize] += 1;
            assert_eq!(slot.corners, triangles[slot.triangle as usize]);
            for p in bvh.corners(slot) {
                let p = bvh.frame.to_frame(p);
                assert!(node.lo().as_dvec3().cmple(p).all() && node.hi().as_dvec3().cmpge(p).all());
            }
        }
    }
    assert!(seen.iter().all(|&n| n == 1));
    let mut order: Vec<u32> = bvh.order().collect();
    order.sort_unstable();
    assert!(order.iter().enumerate().all(|(i, &t)| i == t as usize) && order.len() == triangles.len());
}

proptest! {
    #[test]
    fn every_triangle_is_in_one_leaf_within_all_its_boxes((positions, triangles) in soup()) {
        check_tree(&Bvh::build(&positions, &triangles, 1).unwrap(), &triangles);
    }

    #[test]
    fn first_hits_are_those_of_all_triangles(
        (positions, triangles) in soup(),
        rays in prop::collection::vec(([-3.0..3.0, -3.0..3.0, -3.0..3.0], direction(), prop::bool::ANY), 1..140),
        limits in prop_oneof![Just((f64::NEG_INFINITY, f64::INFINITY)), Just((0.0, f64::INFINITY)), (-1.0..0.5, 0.5..3.0)],
        offset in prop_oneof![Just(0.0), Just(1e7)],
        scale in prop_oneof![Just(1.0), Just(1e-9), Just(1e9)],
    ) {
        let place = |p: DVec3| p * scale + offset;
        let positions: Vec<DVec3> = positions.into_iter().map(place).collect();
        let bvh = Bvh::build(&positions, &triangles, 1).unwrap();
        let rays: Vec<Ray> = rays
            .into_iter()
            .map(|(o, d, on_grid)| {
                let o = DVec3::from_array(o);
                Ray { origin: place(if on_grid { o.round() } else { o }), direction: d * scale }
            })
            .collect();
        let mut hits = vec![None; rays.len()];
        bvh.first_hits(&rays, limits.0, limits.1, &mut hits);
        for (ray, packet) in rays.iter().zip(hits) {
            let expected = first_hit_of_all(&bvh, &triangles, ray, limits.0, limits.1);
            prop_assert_eq!(bvh.first_hit(ray, limits.0, limits.1), expected);
            prop_assert_eq!(packet, expected);
        }
    }

    #[test]
    fn closest_points_are_those_of_all_triangles(
        (positions, triangles) in soup(),
        queries in prop::collection::vec([-3.0..3.0, -3.0..3.0, -3.0..3.0], 1..20),
        offset in prop_oneof![Just(0.0), Just(1e7)],
        far in prop_oneof![Just(1.0), Just(1e6)],
    ) {
        let positions: Vec<DVec3> = positions.into_iter().map(|p| p + offset).collect();
        let bvh = Bvh::build(&positions, &triangles, 1).unwrap();
        for q in queries {
            let q = DVec3::from_array(q) * far + offset;
            let mut expected: Option<Closest> = None;
            for (t, corners) in triangles.iter().enumerate() {
                let c = Closest::of(q, &corners.map(|v| positions[v as usize]), t as u32);
                if c.beats(&expected) {
                    expected = Some(c);
                }
            }
            prop_assert_eq!(bvh.closest_point(q), expected);
            let distance = expected.unwrap().distance();
            for within in [0.0, 0.9 * distance, 1.1 * distance, 2.0 * distance, f64::INFINITY] {
                let known = expected.filter(|closest| closest.distance_squared <= within * within);
                prop_assert_eq!(bvh.closest_point_within(q, within), known);
            }
            for (t, corners) in triangles.iter().enumerate().step_by(5) {
                let known = Closest::on_triangle(q, &corners.map(|v| positions[v as usize]), t as u32);
                prop_assert_eq!(bvh.closest_point_from(q, Some(known)), expected);
            }
        }
    }

    /// The theorem: the point lies on the triangle, and no other point of the triangle is closer.
    #[test]
    fn no_point_of_the_triangle_is_closer(
        corners in [[-1.0..1.0, -1.0..1.0, -1.0..1.0], [-1.0..1.0, -1.0..1.0, -1.0..1.0], [-1.0..1.0, -1.0..1.0, -1.0..1.0]],
        flatten in prop_oneof![Just(1.0), Just(1e-7), Just(0.0)],
        q in [-2.0..2.0, -2.0..2.0, -2.0..2.0],
        others in prop::collection::vec((0.0..1.0f64, 0.0..1.0f64), 30),
    ) {
        let q = DVec3::from_array(q);
        let mut corners = corners.map(DVec3::from_array);
        corners[2] = corners[0].lerp(corners[1], 0.3) + (corners[2] - corners[0]) * flatten;
        let found = Closest::of(q, &corners, 0);
        let w = found.barycentric;
        prop_assert!(w.iter().all(|&x| x >= 0.0) && (w.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        prop_assert!(found.point.distance(corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]) < 1e-12);
        prop_assert!((found.point.distance(q) - found.distance()).abs() < 1e-12);
        for (a, b) in others {
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            let p = corners[0] + (corners[1] - corners[0]) * a + (corners[2] - corners[0]) * b;
            prop_assert!(p.distance(q) >= found.distance() - 1e-9, "{} < {}", p.distance(q), found.distance());
        }
    }

    /// The theorem: a ray from inside a closed surface meets it, wherever it is aimed: at vertices, at points of edges.
    #[test]
    fn nothing_slips_through_edges_and_vertices(
        from in [-0.4..0.4, -0.4..0.4, -0.4..0.4],
        turn in [-3.0..3.0, -3.0..3.0, -3.0..3.0],
        offset in prop_oneof![Just(0.0), Just(1e3), Just(1e7)],
        size in prop_oneof![Just(1.0), Just(1e-6), Just(1e6)],
    ) {
        let (positions, triangles) = ball(16);
        let place = DAffine3::from_scale_rotation_translation(
            DVec3::splat(size), DQuat::from_scaled_axis(DVec3::from_array(turn)), DVec3::splat(offset * size));
        let positions: Vec<DVec3> = positions.iter().map(|&p| place.transform_point3(p)).collect();
        let bvh = Bvh::build(&positions, &triangles, 1).unwrap();
        let origin = place.transform_point3(DVec3::from_array(from));
        let mut rays = Vec::new();
        for t in &triangles {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            for target in [a, b, c, a.midpoint(b), b.lerp(c, 0.3), c.lerp(a, 1e-9), (a + b + c) / 3.0] {
                rays.push(Ray { origin, direction: target - origin });
            }
        }
        let mut hits = vec![None; rays.len()];
        bvh.first_hits(&rays, 0.0, f64::INFINITY, &mut hits);
        for (i, hit) in hits.iter().enumerate() {
            let Some(hit) = hit else { panic!("ray {i} slips through: {:?}", rays[i]) };
            prop_assert!((hit.t - 1.0).abs() < 1e-6 && hit.from_behind);
        }
    }
}

#[test]
fn axis_parallel_rays_through_grid_vertices_all_hit() {
    // Rays exactly through the vertices and along the edges' projections of a height field: the scanner's worst case.
    let n = 40;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for r in 0..=n {
        for c in 0..=n {
            positions.push(DVec3::new(c as f64, r as f64, ((r * 7 + c * 3) % 5) as f64));
        }
    }
    let at = |r: usize, c: usize| (r * (n + 1) + c) as u32;
    for r in 0..n {
        for c in 0..n {
            triangles.push([at(r, c), at(r, c + 1), at(r + 1, c + 1)]);
            triangles.push([at(r, c), at(r + 1, c + 1), at(r + 1, c)]);
        }
    }
    let bvh = Bvh::build(&positions, &triangles, 1).unwrap();
    for r in 0..=4 * n {
        for c in 0..=4 * n {
            let (x, y) = (c as f64 / 4.0, r as f64 / 4.0);
            let ray = Ray { origin: DVec3::new(x, y, 0.0), direction: DVec3::NEG_Z };
            let hit = bvh.first_hit(&ray, f64::NEG_INFINITY, f64::INFINITY).expect("a hit");
            assert!(!hit.from_behind);
            if r % 4 == 0 && c % 4 == 0 {
                assert_eq!(-hit.t, positions[at(r / 4, c / 4) as usize].z);
            }
        }
    }
}

#[test]
fn the_tree_is_the_same_for_any_thread_count() {
    let (positions, triangles) = ball(150);
    let trees = [1, 2, 8].map(|threads| Bvh::build(&positions, &triangles, threads).unwrap());
    check_tree(&trees[0], &triangles);
    for tree in &trees[1..] {
        assert_eq!(tree.nodes, trees[0].nodes);
        assert_eq!(tree.slots, trees[0].slots);
    }
}

#[test]
fn many_equal_and_degenerate_triangles_make_a_shallow_tree() {
    let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::ONE];
    let mut triangles = vec![[0, 1, 2]; 20_000];
    triangles.extend([[3, 3, 3]; 5_000]);
    triangles.extend([[0, 1, 1]; 5_000]);
    let bvh = Bvh::build(&positions, &triangles, 2).unwrap();
    check_tree(&bvh, &triangles);
    let ray = Ray { origin: DVec3::new(0.2, 0.2, 1.0), direction: DVec3::NEG_Z };
    assert_eq!(bvh.first_hit(&ray, 0.0, 9.0).unwrap().triangle, 0);
    assert_eq!(bvh.closest_point(DVec3::splat(2.0)).unwrap().triangle, 20_000);
}

#[test]
fn empty_and_bad_input() {
    let bvh = Bvh::build(&[], &[], 1).unwrap();
    let ray = Ray { origin: DVec3::ZERO, direction: DVec3::X };
    assert!(bvh.is_empty() && bvh.first_hit(&ray, 0.0, 1.0).is_none() && bvh.closest_point(DVec3::ZERO).is_none());
    let mut hits = [None];
    bvh.first_hits(&[ray], 0.0, 1.0, &mut hits);
    assert_eq!(hits, [None]);
    let text = |r: Result<Bvh<'_>>| r.unwrap_err().to_string();
    assert!(text(Bvh::build(&[DVec3::ZERO], &[[0, 0, 1]], 1)).contains("triangle 0 names vertex 1"));
    assert!(text(Bvh::build(&[DVec3::NAN], &[], 1)).contains("vertex 0"));
    assert!(text(Bvh::build(&[DVec3::MAX], &[], 1)).contains("vertex 0"));

    let (positions, triangles) = ball(4);
    let bvh = Bvh::build(&positions, &triangles, 1).unwrap();
    for direction in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        assert!(bvh.first_hit(&Ray { origin: DVec3::ZERO, direction }, 0.0, f64::INFINITY).is_none());
    }
    assert!(bvh.first_hit(&Ray { origin: DVec3::NAN, direction: DVec3::X }, 0.0, 9.0).is_none());
    assert!(bvh.first_hit(&Ray { origin: DVec3::ZERO, direction: DVec3::X }, f64::NAN, 9.0).is_none());
    assert!(bvh.closest_point(DVec3::NAN).is_none());
}

#[test]
fn a_far_sensor_sees_as_well_as_a_near_one() {
    let (positions, triangles) = ball(64);
    let bvh = Bvh::build(&positions, &triangles, 1).unwrap();
    let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.3, 0.5, 0.1)));
    for distance in [2.0, 1e3, 1e6, 1e9] {
        let mut rays = Vec::new();
        for i in 0..64 * 64 {
            let (x, y) = ((i % 64) as f64 / 64.0 - 0.5, (i / 64) as f64 / 64.0 - 0.5);
            rays.push(Ray { origin: turn * DVec3::new(x, y, distance), direction: turn * DVec3::NEG_Z });
        }
        let mut hits = vec![None; rays.len()];
        bvh.first_hits(&rays, 0.0, f64::INFINITY, &mut hits);
        for (ray, hit) in rays.iter().zip(&hits) {
            let hit = hit.expect("a hit");
            let radius = (ray.origin + ray.direction * hit.t).length();
            assert!((0.99..1.0 + 1e-15 * distance).contains(&radius), "{radius}");
        }
    }
}

/// A scan that is made while its merge waits may come from a worker of another pool.
#[test]
fn a_worker_does_not_wait_for_another_pool() {
    let positions = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let (end, wait) = std::sync::mpsc::channel::<()>();
    let busy = base::threads::pool(1).unwrap();
    busy.spawn(move || _ = wait.recv());
    let other = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let (done, made) = std::sync::mpsc::channel();
    other.spawn(move || {
        let bvh = Bvh::build(&positions, &[[0, 1, 2]], 1).unwrap();
        done.send(bvh.len()).unwrap();
    });
    let found = made.recv_timeout(std::time::Duration::from_secs(20));
    end.send(()).unwrap();
    assert_eq!(found, Ok(1));
}
