use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_4, PI};

use proptest::prelude::*;

use geom::bvh::Closest;

use super::*;
use crate::shapes::Shape;

fn measure(points: &[DVec3], mesh: &TriMesh, side: Side) -> Deviation {
    deviation(points, mesh, side, 2, &Progress::none()).unwrap()
}

proptest! {
    /// A box is its triangles: its formula and the mesh must agree, inside and outside, at faces, edges and corners.
    #[test]
    fn signed_distances_to_a_box_are_exact(
        points in prop::collection::vec([-3.0..3.0, -3.0..3.0, -3.0..3.0], 1..50),
        detail in 1usize..4,
        offset in prop_oneof![Just(0.0), Just(1e7)],
    ) {
        let shape = Shape::Cuboid { half: DVec3::new(1.0, 2.0, 0.5) };
        let mut mesh = shape.mesh(detail);
        mesh.positions.iter_mut().for_each(|p| *p += offset);
        let points: Vec<DVec3> = points.into_iter().map(|p| DVec3::from_array(p) + offset).collect();
        let measured = measure(&points, &mesh, Side::Signed);
        let unsigned = measure(&points, &mesh, Side::Ignored);
        for (i, &p) in points.iter().enumerate() {
            let exact = shape.distance(p - offset);
            prop_assert!((measured.distances[i] - exact).abs() <= 1e-14 + 4.0 * f64::EPSILON * offset);
            prop_assert_eq!(measured.distances[i].abs(), unsigned.distances[i]);
        }
    }

    #[test]
    fn the_summary_is_that_of_the_sorted_distances(distances in prop::collection::vec(-5.0..5.0, 1..200)) {
        let s = DistanceReport::of(&distances);
        let mut sorted: Vec<f64> = distances.iter().map(|d: &f64| d.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let within = sorted.iter().filter(|&&d| d <= s.p95).count();
        let below = sorted.iter().filter(|&&d| d < s.p95).count();
        prop_assert!(within * 100 >= distances.len() * 95 && below * 100 < distances.len() * 95);
        prop_assert_eq!(s.max, sorted[sorted.len() - 1]);
        prop_assert_eq!(s.worst, distances.iter().position(|d| d.abs() == s.max));
        prop_assert!(s.bias.abs() <= s.mean + 1e-12 && s.mean <= s.rms + 1e-12 && s.rms <= s.max + 1e-12);
    }
}

#[test]
fn distances_to_a_fine_sphere_are_those_of_the_sphere() {
    let shape = Shape::Sphere { radius: 1.0 };
    let mesh = shape.mesh(100);
    let points: Vec<DVec3> = (0..2000)
        .map(|i| {
            let (z, a) = (1.0 - (i as f64 + 0.5) / 1000.0, i as f64 * 2.4);
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * a.cos(), r * a.sin(), z) * (0.1 + 2.0 * ((i * 37 % 100) as f64 / 100.0))
        })
        .collect();
    let measured = measure(&points, &mesh, Side::Signed);
    for (p, d) in points.iter().zip(&measured.distances) {
        let difference = d - shape.distance(*p);
        assert!((-1e-12..1e-4).contains(&difference), "{difference}");
    }
}

#[test]
fn nothing_is_measured_in_degrees() {
    let crs = Some(Crs::new("EPSG:4326").unwrap());
    let mesh = TriMesh { crs, ..Shape::Sphere { radius: 1.0 }.mesh(4) };
    let (points, none) = ([DVec3::ZERO], Progress::none());
    for error in [
        deviation(&points, &mesh, Side::Ignored, 1, &none).unwrap_err(),
        nearest_triangles(&points, &mesh, 1, &none).unwrap_err(),
    ] {
        assert!(
            error.to_string().starts_with("the mesh: its coordinates are degrees (EPSG:4326), in which"),
            "{error}"
        );
    }
}

#[test]
fn the_side_is_right_beyond_a_sharp_edge() {
    // A thin wedge: close to its sharp edge the nearest face alone would often name the wrong side.
    let mesh = TriMesh::new(
        vec![DVec3::ZERO, DVec3::Y, DVec3::new(1.0, 0.0, 0.01), DVec3::new(1.0, 0.0, -0.01)],
        vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    );
    assert!(enclosed_volume(&mesh) > 0.0);
    let outside = [DVec3::new(-0.5, 0.5, 0.3), DVec3::new(-0.1, 0.4, -0.3), DVec3::new(-1.0, -1.0, 0.0)];
    let inside = [DVec3::new(0.5, 0.2, 0.0), DVec3::new(0.9, 0.05, 0.004)];
    assert!(measure(&outside, &mesh, Side::Signed).distances.iter().all(|&d| d > 0.0));
    assert!(measure(&inside, &mesh, Side::Signed).distances.iter().all(|&d| d < 0.0));
}

#[test]
fn the_side_is_right_beyond_a_sharp_tip() {
    // Seen from beside the tip, the faces on its other side look away from the point.
    let base = [DVec3::new(1.0, 1.0, -10.0), DVec3::new(-1.0, 1.0, -10.0), DVec3::new(0.0, -1.0, -10.0)];
    let positions = [vec![DVec3::ZERO], base.to_vec()].concat();
    let mesh = TriMesh::new(positions, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]]);
    assert!(enclosed_volume(&mesh) > 0.0);
    let around: Vec<DVec3> = (0..24).map(|i| DVec3::new(0.0, 0.5, 0.2).rotate_z(0.26 * f64::from(i))).collect();
    let measured = measure(&around, &mesh, Side::Signed);
    assert!(around.iter().zip(&measured.distances).all(|(p, d)| (d - p.length()).abs() < 1e-15));
}

#[test]
fn the_same_distances_for_any_number_of_threads() {
    let mesh = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(12);
    let points: Vec<DVec3> =
        (0..5000).map(|i| DVec3::new((i % 17) as f64, (i % 13) as f64, (i % 7) as f64) * 0.3 - 2.0).collect();
    let all = [1, 2, 8].map(|n| deviation(&points, &mesh, Side::Signed, n, &Progress::none()).unwrap());
    assert!(all[0] == all[1] && all[0] == all[2]);
}

#[test]
fn the_nearest_triangle_is_the_one_at_the_least_distance() {
    let mesh = Shape::Torus { major: 2.0, minor: 0.5 }.mesh(4);
    let points: Vec<DVec3> = (0..300).map(|i| DVec3::new((i % 17) as f64, (i % 13) as f64, 1.0) * 0.3 - 2.0).collect();
    let found = nearest_triangles(&points, &mesh, 2, &Progress::none()).unwrap();
    for (point, &found) in points.iter().zip(&found) {
        let distance = |t: usize| Closest::on_triangle(*point, &mesh.corners(t), 0).distance_squared;
        let least = (0..mesh.triangles.len()).map(distance).fold(f64::INFINITY, f64::min);
        assert_eq!(distance(found as usize), least);
    }
    let cancelled = nearest_triangles(&points, &mesh, 1, &Progress::cancel_after(1));
    assert!(matches!(cancelled, Err(Error::Cancelled)));
}

#[test]
fn angles_areas_and_volumes_are_known() {
    let right = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let expected = [FRAC_PI_2, FRAC_PI_4, FRAC_PI_4];
    assert!(angles(right).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15));
    assert_eq!(area(right), 0.5);
    assert_eq!(angles([DVec3::ZERO; 3]), [0.0; 3]);

    let mut mesh = Shape::Cuboid { half: DVec3::new(1.0, 2.0, 0.5) }.mesh(2);
    mesh.positions.iter_mut().for_each(|p| *p += 1e6);
    assert!((enclosed_volume(&mesh) - 8.0).abs() < 1e-8 && (total_area(&mesh) - 28.0).abs() < 1e-8);

    let side = 3f64.sqrt() / 2.0;
    let two = TriMesh::new(
        vec![DVec3::ZERO, DVec3::X, DVec3::new(0.5, side, 0.0), DVec3::X * 2.0],
        vec![[0, 1, 2], [0, 1, 3]],
    );
    let q = quality(&two);
    assert_eq!((q.triangles, q.without_area, q.smallest_angle), (2, 1, 0.0));
    assert!((q.largest_angle - PI).abs() < 1e-12 && (q.mean_smallest_angle - FRAC_PI_3 / 2.0).abs() < 1e-12);
    assert!((q.area - side / 2.0).abs() < 1e-15 && q.by_smallest_angle[0] == 1);
}

#[test]
fn bad_input_is_named_and_cancelling_works() {
    let mesh = Shape::Sphere { radius: 1.0 }.mesh(3);
    let text = |points: &[DVec3], mesh: &TriMesh| {
        deviation(points, mesh, Side::Ignored, 1, &Progress::none()).unwrap_err().to_string()
    };
    let beyond = 2.0 * magnitude::LARGEST;
    // The largest of a number and of what is none is the number.
    let nan = DVec3::new(f64::NAN, 0.0, 0.0);
    for bad in [DVec3::NAN, DVec3::INFINITY, nan, DVec3::new(0.0, f64::NAN, 1.0), DVec3::splat(beyond)] {
        assert!(text(&[DVec3::ZERO, bad], &mesh).contains("point 1"), "{bad}");
    }
    let broken = TriMesh::new(vec![nan, DVec3::X, DVec3::Y], vec![[0, 1, 2]]);
    assert!(text(&[DVec3::ZERO], &broken).contains("vertex 0"));
    assert!(text(&[DVec3::ZERO], &TriMesh::default()).contains("no triangle"));
    assert!(text(&[DVec3::ZERO], &TriMesh::new(vec![DVec3::ZERO], vec![[0, 0, 9]])).contains("vertex 9"));
    assert_eq!(measure(&[], &TriMesh::default(), Side::Signed), Deviation::default());
    let points = vec![DVec3::X; 3 * CHUNK];
    for checks in 0..4 {
        let outcome = deviation(&points, &mesh, Side::Ignored, 1, &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
}
