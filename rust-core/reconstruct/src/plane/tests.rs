use glam::{DVec2, DVec3};

use super::super::tests::{as_set, cloud, random};
use super::Plane;
use crate::prepare::prepare;
use crate::smooth::Smoothing;
use crate::*;
use base::error::Error;
use base::progress::Progress;
use mesh::check;

/// Of a rectangle of 60 by 40 steps: a square hole, a gap, and an island beyond it. Steps are of 1,000, so that a plane of
/// space through them has whole coordinates.
fn ring_and_island(jitter: f64) -> Vec<DVec2> {
    let mut random = random(3);
    let all = (0..60 * 40).map(|i| [i % 60, i / 60]);
    all.filter(|[i, j]| !((40..50).contains(i) || (14..26).contains(i) && (14..26).contains(j)))
        .map(|[i, j]| DVec2::new(f64::from(i), f64::from(j)) * 1000.0)
        .map(|p| p + (DVec2::new(random(), random()) * jitter * 1000.0).round())
        .collect()
}

/// In exact planes: along axes, tilted, upright, far away.
fn in_planes(flat: &[DVec2]) -> Vec<Vec<DVec3>> {
    [
        (DVec3::ZERO, DVec3::X, DVec3::Y),
        (DVec3::Z * 5e6, DVec3::X, DVec3::Y),
        (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 2.0, 1.0), DVec3::new(-2.0, 1.0, 2.0)),
        (DVec3::splat(5e9), DVec3::new(2.0, 2.0, 1.0), DVec3::new(1.0, -2.0, 2.0)),
        (DVec3::ZERO, DVec3::Z * 5.0, DVec3::new(3.0, 4.0, 0.0)),
    ]
    .map(|(origin, u, v)| flat.iter().map(|p| origin + u * p.x + v * p.y).collect())
    .to_vec()
}

fn area(made: &Reconstructed) -> f64 {
    let twice = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).length();
    (0..made.mesh.triangles.len()).map(|t| twice(made.mesh.corners(t)) / 2.0).sum()
}

#[test]
fn outline_hole_and_island_in_any_plane() {
    for jitter in [0.0, 0.8] {
        for points in in_planes(&ring_and_island(jitter)) {
            let scale = points[1].distance(points[0]) * points[50].distance(points[0]);
            for threshold in [Threshold::Local, Threshold::Global] {
                for topology in [Topology::Manifold, Topology::Free] {
                    let params = ReconstructParams { threshold, topology, ..ReconstructParams::default() };
                    let made = run(&cloud(points.clone()), &params, &Progress::none()).unwrap();
                    let report = check(&made.mesh);
                    assert_eq!((made.report.used, made.report.tetrahedra), (points.len(), 0));
                    assert!(!made.report.closed && report.genus() == Some(0), "{report}");
                    assert!(topology == Topology::Free || report.is_manifold(), "{report}");
                    assert_eq!((report.components, report.boundary_loops), (2, 3), "{threshold:?}: {report}");
                    // The samples' own hull but for hole and gap, whose corners may be cut.
                    let expected = 39.0 * 39.0 - 13.0 * 13.0 + 9.0 * 39.0;
                    let found = area(&made) / scale;
                    assert!(jitter > 0.0 || (found / expected - 1.0).abs() < 0.02, "{found} of {expected}");
                }
            }
        }
    }
}

#[test]
fn points_alone_are_left_out_and_colours_kept() {
    let mut points: Vec<DVec3> = ring_and_island(0.0).iter().map(|p| p.extend(7.0)).collect();
    let count = points.len();
    points.extend([points[5], DVec3::new(500_000.0, 500_000.0, 7.0), DVec3::NAN]);
    let mut given = cloud(points);
    given.colour = Some((0..given.positions.len()).map(|i| [i as u8, 1, 2, 255]).collect());
    given.intensity = Some((0..given.positions.len()).map(|i| i as f32).collect());
    // The sample far away is of its nearest samples' spacing, which is far: so by the mean.
    let params = ReconstructParams { threshold: Threshold::Global, ..ReconstructParams::default() };
    let made = run(&given, &params, &Progress::none()).unwrap();
    let dropped = [(0, Reason::Duplicate), (1, Reason::Outside), (2, Reason::NotFinite)];
    assert_eq!(made.report.dropped, dropped.map(|(i, reason)| Dropped { point: (count + i) as u32, reason }));
    assert!(made.report.rounds > 1 && made.report.cut_facets > 0);
    let Some(mesh::AttributeData::Colour(colour)) = made.mesh.vertex_attribute("colour") else { panic!() };
    assert_eq!(colour[77], [77, 1, 2, 255]);
    assert!(made.mesh.vertex_attribute("intensity").is_some() && made.mesh.vertex_attribute("source_point").is_some());
}

#[test]
fn it_looks_up_or_where_normals_and_sensors_say() {
    let points: Vec<DVec3> = ring_and_island(0.0).iter().map(|p| p.extend(0.0)).collect();
    let up = |made: &Reconstructed| {
        let [a, b, c] = made.mesh.corners(0);
        (b - a).cross(c - a).z > 0.0
    };
    let params = ReconstructParams::default();
    let plain = run(&cloud(points.clone()), &params, &Progress::none()).unwrap();
    assert!(up(&plain) && plain.report.turned_parts == 0);
    let mut down = cloud(points.clone());
    down.normals = Some(vec![[0.0, 0.0, -1.0]; points.len()]);
    let made = run(&down, &params, &Progress::none()).unwrap();
    assert!(!up(&made) && made.report.turned_parts == 2);
    let mut seen = Reconstructor::new(cloud(points)).unwrap();
    seen.seen_from(vec![DVec3::new(0.0, 0.0, -1e5)]).unwrap();
    assert!(!up(&seen.surface(&params, &Progress::none()).unwrap()));
}

#[test]
fn the_same_bytes_for_any_threads_and_surfaces_for_any_order() {
    let mut random = random(5);
    for mut points in in_planes(&ring_and_island(0.0)) {
        let made = |points: &[DVec3], threads| {
            let params = ReconstructParams { threads, ..ReconstructParams::default() };
            run(&cloud(points.to_vec()), &params, &Progress::none()).unwrap().mesh
        };
        let one = made(&points, 1);
        for threads in [2, 3, 8] {
            assert!(one == made(&points, threads), "{threads} threads");
        }
        for i in (1..points.len()).rev() {
            points.swap(i, (random() * (i + 1) as f64) as usize);
        }
        assert!(as_set(&one) == as_set(&made(&points, 2)), "another order");
    }
}

#[test]
fn what_is_no_surface_says_why() {
    let refused = |points: Vec<DVec3>, closure| {
        let params = ReconstructParams { closure, ..ReconstructParams::default() };
        match run(&cloud(points), &params, &Progress::none()) {
            Err(Error::Input(text)) => text,
            other => panic!("{other:?}"),
        }
    };
    let flat: Vec<DVec3> = ring_and_island(0.0).iter().map(|p| p.extend(1.0)).collect();
    assert!(refused(flat.clone(), Closure::Closed).contains("encloses nothing: let the closure be auto or open"));
    let line = (0..9).map(|i| DVec3::splat(f64::from(i))).collect();
    assert!(refused(line, Closure::Auto).contains("9 different points lie on one line"));
    assert!(refused(vec![DVec3::ONE; 9], Closure::Auto).contains("at least 3 different points"));
    let three = run(&cloud(vec![DVec3::ZERO, DVec3::X, DVec3::Y]), &ReconstructParams::default(), &Progress::none());
    assert_eq!(three.unwrap().mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn other_parameters_again_and_cancelling() {
    let points = cloud(ring_and_island(0.5).iter().map(|p| p.extend(1.0)).collect());
    let mut again = Reconstructor::new(&points).unwrap();
    for factor in [1.0, 2.0, 1.0] {
        for threshold in [Threshold::Local, Threshold::Global] {
            let params = ReconstructParams { factor, threshold, ..ReconstructParams::default() };
            let made = again.surface(&params, &Progress::none()).unwrap();
            assert!(made.mesh == run(&points, &params, &Progress::none()).unwrap().mesh, "as if it were the first");
        }
    }
    for checks in [0, 1, 5, 10] {
        let outcome = run(&points, &ReconstructParams::default(), &Progress::cancel_after(checks));
        assert!(matches!(outcome, Err(Error::Cancelled)), "{checks}");
    }
}

#[test]
fn three_hundred_thousand_points_and_a_hand_that_stops_them() {
    let at = |i: i32| DVec3::new(2.0, 2.0, 1.0) * f64::from(i % 600) + DVec3::new(1.0, -2.0, 2.0) * f64::from(i / 600);
    let points = cloud((0..300_000).map(at).collect());
    let started = std::time::Instant::now();
    let made = run(&points, &ReconstructParams::default(), &Progress::none()).unwrap();
    let seconds = started.elapsed().as_secs_f64();
    assert_eq!((made.report.used, made.mesh.triangles.len()), (300_000, 2 * 599 * 499));
    println!("{seconds:.2} s, {:?}", made.report.seconds);
    for share in [0.02, 0.3, 0.7] {
        let (mut stopped, started) = (None, std::time::Instant::now());
        let stop = |_| {
            let is_time = started.elapsed().as_secs_f64() > share * seconds;
            if is_time {
                stopped.get_or_insert_with(std::time::Instant::now);
                std::ops::ControlFlow::Break(())
            } else {
                std::ops::ControlFlow::Continue(())
            }
        };
        let outcome = run(&points, &ReconstructParams::default(), &Progress::new(stop));
        let Some(stopped) = stopped else { continue };
        let waited = stopped.elapsed().as_secs_f64();
        println!("stopped at {share} of it, after {waited:.3} s");
        assert!(matches!(outcome, Err(Error::Cancelled)) && waited < 1.0, "{waited} s");
    }
}

/// At random over a square of side 6, turned out of the axes.
fn turned_square(count: usize, height: impl Fn(usize) -> f64) -> Vec<DVec3> {
    let mut random = random(13);
    let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.7, 1.1);
    (0..count).map(|i| turn * DVec3::new(6.0 * random(), 6.0 * random(), height(i))).collect()
}

/// Theorem: what is flat but for rounding, for a point beside it or for its noise is one sheet with one border.
#[test]
fn flat_but_for_noise() {
    let single = |points: Vec<DVec3>| points.iter().map(|p| p.as_vec3().as_dvec3()).collect::<Vec<_>>();
    let far = |points: Vec<DVec3>| points.iter().map(|p| *p + DVec3::splat(5e6)).collect::<Vec<_>>();
    let noise: Vec<f64> = {
        let mut random = random(29);
        (0..3000).map(|_| (0..12).map(|_| random()).sum::<f64>() - 6.0).collect()
    };
    let mut one_beside: Vec<DVec3> = turned_square(3000, |_| 0.0);
    one_beside[100] += DVec3::splat(1e-12);
    // A tenth of a side of a square that has one point.
    let spacing = 6.0 / 3000.0_f64.sqrt();
    for (name, points) in [
        ("turned", turned_square(3000, |_| 0.0)),
        ("in single precision", single(turned_square(3000, |_| 0.0))),
        ("far away", far(turned_square(3000, |_| 0.0))),
        ("one beside it", one_beside),
        ("with little noise", turned_square(3000, |i| 0.1 * spacing * noise[i])),
        ("with as much as its spacing", turned_square(3000, |i| spacing * noise[i])),
    ] {
        for threshold in [Threshold::Local, Threshold::Global] {
            let params = ReconstructParams { threshold, ..Default::default() };
            let made = run(&cloud(points.clone()), &params, &Progress::none()).unwrap();
            let report = check(&made.mesh);
            assert_eq!((report.components, report.genus()), (1, Some(0)), "{name}: {report}");
            // At random, threes may be further apart than is trusted.
            assert!(report.boundary_loops <= 8, "{name}: {report}");
            assert!(made.report.used > 2950, "{name}: {:?}", made.report.used);
            let up = made.mesh.triangles.iter().all(|t| {
                let [a, b, c] = t.map(|v| made.mesh.positions[v as usize]);
                (b - a).cross(c - a).z > 0.0
            });
            assert!(up || name.starts_with("with"), "{name}");
        }
    }
}

/// A lattice along the axes, where samples of either time it was seen are right above each other.
#[test]
fn a_lattice_seen_twice_is_one_sheet() {
    let lattice: Vec<DVec3> = (0..40 * 40).map(|i| DVec3::new(f64::from(i % 40), f64::from(i / 40), 0.0)).collect();
    let mut random = random(37);
    let mut normal = || (0..12).map(|_| random()).sum::<f64>() - 6.0;
    let mut seen = |of: &[DVec3], noise: f64| of.iter().map(|p| *p + DVec3::Z * noise * normal()).collect::<Vec<_>>();
    let auto = ReconstructParams::default();
    let smooth = ReconstructParams { smooth: Some(3.0), ..auto };
    for (name, first, second, hidden, params) in [
        ("one above another", lattice.clone(), vec![lattice[630] + DVec3::Z * 1e-12], 0..2, auto),
        ("all but for rounding", lattice.clone(), seen(&lattice, 1e-12), 1600..1601, auto),
        ("the same smoothed", lattice.clone(), seen(&lattice, 1e-12), 1600..1601, smooth),
        ("with little noise", lattice.clone(), seen(&lattice, 1e-5), 1..1600, auto),
        ("with noise", seen(&lattice, 0.1), seen(&lattice, 0.1), 0..1, auto),
    ] {
        let mut points = [first, second].concat();
        let made = run(&cloud(points.clone()), &params, &Progress::none()).unwrap();
        let report = check(&made.mesh);
        assert!(report.is_manifold() && report.components == 1 && report.boundary_loops == 1, "{name}: {report}");
        assert_eq!((report.genus(), made.report.tetrahedra), (Some(0), 0), "{name}");
        let dropped = made.report.dropped_for(Reason::Duplicate);
        assert!(hidden.contains(&dropped), "{name}: {dropped} are above another");
        assert_eq!(made.report.used + made.report.dropped.len(), points.len(), "{name}");
        points.reverse();
        let reversed = run(&cloud(points), &ReconstructParams { threads: 2, ..params }, &Progress::none()).unwrap();
        assert!(as_set(&reversed.mesh) == as_set(&made.mesh), "{name}: another order");
    }
}

/// The measured place of each sample, and how far it came, are still known once those above others are left out.
#[test]
fn what_is_known_of_samples_goes_with_them() {
    let progress = Progress::none();
    let at = |i: i32, height: f64| DVec3::new(f64::from(i % 20), f64::from(i / 20), height);
    let points: Vec<DVec3> = [0.0, 1e-12].iter().flat_map(|&height| (0..400).map(move |i| at(i, height))).collect();
    let mut samples = prepare(&points, &progress).unwrap();
    let moved: Vec<f64> = samples.input.iter().map(|&i| f64::from(i)).collect();
    let mut smoothing = Smoothing { moved, measured: samples.points.clone(), ..Smoothing::default() };
    let plane = Plane::along(&mut samples, &mut smoothing, &progress).unwrap().expect("they are flat");
    assert_eq!((samples.points.len(), samples.given()), (400, points.len()));
    // Rounding may put slivers along the rim.
    assert!(plane.triangles.len() >= 2 * 19 * 19 && plane.triangles.as_flattened().iter().all(|&v| v < 400));
    assert!(samples.dropped.iter().all(|dropped| dropped.reason == Reason::Duplicate));
    assert_eq!(smoothing.measured, samples.points);
    assert_eq!(smoothing.moved, samples.input.iter().map(|&i| f64::from(i)).collect::<Vec<_>>());
    assert!(samples.input.iter().zip(&samples.points).all(|(&i, point)| points[i as usize] == *point));
}

/// Gaps and noise in spacings of either plane. Planes less than a spacing apart lose some of their points. Those far apart are taken for
/// the two sides of a plate, whose rim may stay open.
#[test]
fn parallel_planes_are_no_sheet() {
    let spacing = 6.0 / 2000.0_f64.sqrt();
    let noise: Vec<f64> = {
        let mut random = random(31);
        (0..4000).map(|_| (0..12).map(|_| random()).sum::<f64>() - 6.0).collect()
    };
    let back = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.7, 1.1).inverse();
    for (gap, deviation, used, loops) in [(0.3, 0.0, 3800, 1..16), (8.0, 0.0, 3995, 1..2), (8.0, 0.5, 3995, 0..2)] {
        let points = turned_square(4000, |i| spacing * (gap * (i % 2) as f64 + deviation * noise[i]));
        let made = run(&cloud(points), &ReconstructParams::default(), &Progress::none()).unwrap();
        let report = check(&made.mesh);
        assert!(made.report.tetrahedra > 0, "{gap}: a sheet");
        assert_eq!(made.report.smoothing > 0.0, deviation > 0.0, "{gap}: {:?}", made.report);
        assert_eq!((report.is_manifold(), report.genus(), report.components), (true, Some(0), 1), "{gap}: {report}");
        assert!(loops.contains(&report.boundary_loops), "{gap}: {report}");
        assert!(made.report.used >= used, "{gap}: {}", made.report.used);
        let heights = made.mesh.positions.iter().map(|p| (back * *p).z / spacing);
        let between = heights.filter(|height| (0.25 * gap..0.75 * gap).contains(height)).count();
        assert_eq!(between, 0, "{gap}");
    }
}
