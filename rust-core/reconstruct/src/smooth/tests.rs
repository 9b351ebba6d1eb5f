mod isolated;
mod rounded;
mod uneven;

use glam::DVec3;

use crate::noise;
use crate::tests::{cloud, random};
use crate::{NoisyPoints, Reason, ReconstructParams, Reconstructed, run};
use base::error::Error;
use base::progress::Progress;
use mesh::check::{CheckReport, check};

/// Numbers with the standard normal distribution.
fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut random = random(seed);
    move || (-2.0 * (1.0 - random()).ln()).sqrt() * (std::f64::consts::TAU * random()).cos()
}

/// Side of a square of the surface that has one point.
fn spacing(area: f64, count: usize) -> f64 {
    (area / count as f64).sqrt()
}

/// At random over the unit sphere, with noise in spacings.
fn sphere(count: usize, noise: f64) -> Vec<DVec3> {
    let (mut random, mut normal) = (random(7), normal(9));
    let deviation = noise * spacing(4.0 * std::f64::consts::PI, count);
    (0..count)
        .map(|_| {
            let (z, turn) = (2.0 * random() - 1.0, std::f64::consts::TAU * random());
            let around = (1.0 - z * z).sqrt();
            DVec3::new(around * turn.cos(), around * turn.sin(), z) * (1.0 + deviation * normal())
        })
        .collect()
}

/// At random over a torus with radii 3 and 1.
fn torus(count: usize, noise: f64) -> Vec<DVec3> {
    let (mut random, mut normal) = (random(17), normal(19));
    let deviation = noise * spacing(12.0 * std::f64::consts::PI.powi(2), count);
    let mut points = Vec::new();
    while points.len() < count {
        let [u, v] = [random(), random()].map(|x| x * std::f64::consts::TAU);
        if random() * 4.0 <= 3.0 + v.cos() {
            let small = 1.0 + deviation * normal();
            let large = 3.0 + small * v.cos();
            points.push(DVec3::new(large * u.cos(), large * u.sin(), small * v.sin()));
        }
    }
    points
}

/// And others at random around them.
fn with_outliers(mut points: Vec<DVec3>, share: f64) -> Vec<DVec3> {
    let mut random = random(23);
    let low = points.iter().copied().reduce(DVec3::min).unwrap();
    let size = points.iter().copied().reduce(DVec3::max).unwrap() - low;
    for _ in 0..(points.len() as f64 * share) as usize {
        points.push(low + size * DVec3::new(random(), random(), random()));
    }
    points
}

/// In the order of samples.
fn sorted(points: &[DVec3]) -> Vec<DVec3> {
    crate::prepare::prepare(points, &Progress::none()).unwrap().points
}

fn reconstruct(points: Vec<DVec3>) -> (Reconstructed, CheckReport) {
    let made = run(&cloud(points), &ReconstructParams::default(), &Progress::none()).unwrap();
    let report = check(&made.mesh);
    (made, report)
}

/// Root mean square of the distances of vertices to the truth.
fn to_truth(made: &Reconstructed, distance: impl Fn(DVec3) -> f64) -> f64 {
    let squares: f64 = made.mesh.positions.iter().map(|p| distance(*p).powi(2)).sum();
    (squares / made.mesh.positions.len() as f64).sqrt()
}

#[test]
fn noise_is_measured() {
    // As users are told.
    assert_eq!(noise::INTERPOLATED, 0.2);
    for truth in [0.0, 0.05, 0.1, 0.15, 0.27, 0.3, 0.5, 1.0, 2.0] {
        let (made, _) = reconstruct(sphere(5000, truth));
        let noise = made.report.noise / made.report.spacing;
        assert!((noise - truth).abs() < 0.02 + 0.2 * truth, "{noise} for {truth}");
        assert_eq!(made.report.smoothing > 0.0, truth > noise::INTERPOLATED, "{truth}");
        let apart = made.report.spacing / spacing(4.0 * std::f64::consts::PI, 5000);
        assert!((apart - 1.0).abs() < 0.1, "{apart}");
    }
}

#[test]
fn what_carries_no_noise_is_left_alone() {
    let points = torus(3000, 0.1);
    let (made, _) = reconstruct(points.clone());
    for noisy_points in [NoisyPoints::PutBack, NoisyPoints::AsClean] {
        let as_given = ReconstructParams { noisy_points, ..Default::default() };
        let given = run(&cloud(points.clone()), &as_given, &Progress::none()).unwrap();
        assert_eq!(made.mesh, given.mesh, "{noisy_points:?}");
    }
    assert_eq!((made.report.smoothing, made.report.moved), (0.0, 0.0));
    assert_eq!(made.report.dropped_for(Reason::Outlier), 0);
}

/// The vertices of a thin wall are as many spacings apart as noise would be large: its sides are clean.
#[test]
fn thin_walls_are_no_noise() {
    let mut random = random(3);
    let wall = (0..6000).map(|i| DVec3::new(random(), random(), 0.01 * f64::from(i % 2))).collect();
    let report = reconstruct(wall).0.report;
    assert!(report.noise < 1e-9 * report.spacing && report.smoothing == 0.0, "{report:?}");
}

#[test]
fn noisy_spheres_are_closed_and_near_the_truth() {
    for (noise, outliers, part) in [(0.3, 0.0, 0.35), (1.0, 0.0, 0.25), (1.0, 0.05, 0.4), (2.0, 0.05, 0.4)] {
        let (made, report) = reconstruct(with_outliers(sphere(5000, noise), outliers));
        assert!(report.is_closed() && report.genus() == Some(0) && report.components == 1, "{noise}: {report}");
        let deviation = noise * spacing(4.0 * std::f64::consts::PI, 5000);
        let error = to_truth(&made, |p| p.length() - 1.0);
        assert!(error < part * deviation, "{noise}, {outliers}: {}", error / deviation);
        // A noisy point is moved by its noise, about.
        assert!((made.report.moved / deviation - 1.0).abs() < 0.25, "{}", made.report.moved / deviation);
    }
}

#[test]
fn a_noisy_torus_keeps_its_hole() {
    for noise in [0.5, 1.0] {
        let (made, report) = reconstruct(torus(5000, noise));
        assert!(report.is_closed() && report.genus() == Some(1) && report.components == 1, "{noise}: {report}");
        let deviation = noise * spacing(12.0 * std::f64::consts::PI.powi(2), 5000);
        let error = to_truth(&made, |p| (p.x.hypot(p.y) - 3.0).hypot(p.z) - 1.0);
        assert!(error < 0.5 * deviation, "{}", error / deviation);
    }
}

#[test]
fn outliers_are_counted_and_named() {
    let points = with_outliers(sphere(5000, 0.3), 0.05);
    let (made, _) = reconstruct(points);
    let outliers: Vec<u32> =
        made.report.dropped.iter().filter(|d| d.reason == Reason::Outlier).map(|dropped| dropped.point).collect();
    let right = outliers.iter().filter(|&&point| point >= 5000).count();
    // Some of the 250 lie near the sphere.
    assert!(right > 170, "{right}");
    assert!(outliers.len() - right < 10, "{}", outliers.len() - right);
}

/// A surface through the points as they are is found by those that were smoothed, within a radius that the noise asks for or a given one.
#[test]
fn points_go_back_to_where_they_were_measured() {
    for (noise, genus, smooth) in [(0.39, 0, None), (1.0, 0, None), (1.0, 1, None), (1.0, 1, Some(0.9))] {
        let points = if genus == 0 { sphere(5000, noise) } else { torus(5000, noise) };
        let points = with_outliers(points, 0.02);
        let moved = ReconstructParams { smooth, ..Default::default() };
        let params = ReconstructParams { noisy_points: NoisyPoints::PutBack, ..moved };
        let made = run(&cloud(points.clone()), &params, &Progress::none()).unwrap();
        let report = check(&made.mesh);
        assert!(report.is_closed() && report.genus() == Some(genus) && report.components == 1, "{noise}: {report}");
        assert_eq!((made.report.smoothing, made.report.moved), (0.0, 0.0));
        let Some(mesh::AttributeData::I32(sources)) = made.mesh.vertex_attribute("source_point") else { panic!() };
        for (position, &source) in made.mesh.positions.iter().zip(sources) {
            assert_eq!(*position, points[source as usize]);
        }
        assert!(made.report.used > 4900, "{}", made.report.used);
        let moved = run(&cloud(points), &moved, &Progress::none()).unwrap();
        assert_eq!(moved.mesh.triangles, made.mesh.triangles);
        assert_ne!(moved.mesh.positions, made.mesh.positions);
    }
}

/// Points taken as clean stay, outliers too, and the surface is whatever can be had of them.
#[test]
fn noise_may_be_ignored() {
    for noise in [0.3, 0.39, 0.5, 1.0] {
        let points = with_outliers(sphere(5000, noise), 0.02);
        let as_clean = ReconstructParams { noisy_points: NoisyPoints::AsClean, ..Default::default() };
        let made = run(&cloud(points.clone()), &as_clean, &Progress::none()).unwrap();
        let report = check(&made.mesh);
        assert!(report.is_manifold(), "{report}");
        assert_eq!((made.report.smoothing, made.report.moved), (0.0, 0.0));
        assert!(made.report.noise > 0.2 * made.report.spacing);
        assert_eq!(made.report.dropped_for(Reason::Outlier), 0);
        let Some(mesh::AttributeData::I32(sources)) = made.mesh.vertex_attribute("source_point") else { panic!() };
        for (position, &source) in made.mesh.positions.iter().zip(sources) {
            assert_eq!(*position, points[source as usize]);
        }
        let with_a_radius = ReconstructParams { smooth: Some(0.3), ..as_clean };
        assert_eq!(run(&cloud(points), &with_a_radius, &Progress::none()).unwrap().mesh, made.mesh);
    }
}

/// Two walls, nearer to each other than either is wide.
#[test]
fn a_noisy_wall_keeps_its_sides() {
    let (mut random, mut normal) = (random(41), normal(43));
    let spacing = (32.0_f64 / 8000.0).sqrt();
    let points = (0..8000)
        .map(|i| {
            let side = if i % 2 == 0 { 0.0 } else { 8.0 * spacing };
            DVec3::new(4.0 * random(), 4.0 * random(), side + 0.5 * spacing * normal())
        })
        .collect();
    let (made, report) = reconstruct(points);
    assert!(report.is_manifold() && report.genus() == Some(0), "{report}");
    let between = made.mesh.positions.iter().filter(|p| p.z > 2.0 * spacing && p.z < 6.0 * spacing).count();
    assert!(between < 20 && made.report.used > 7800, "{between} between, {} used", made.report.used);
}

#[test]
fn the_same_for_any_number_of_threads_and_any_order() {
    let points = with_outliers(torus(60_000, 1.0), 0.05);
    // Small neighbourhoods, for the test's sake.
    let smooth = Some(4.0 * spacing(12.0 * std::f64::consts::PI.powi(2), 60_000));
    let mut order: Vec<usize> = (0..points.len()).collect();
    let mut random = random(11);
    (1..order.len()).rev().for_each(|i| order.swap(i, (random() * (i + 1) as f64) as usize));
    let made = |threads: usize, points: Vec<DVec3>| {
        let params = ReconstructParams { threads, smooth, ..Default::default() };
        run(&cloud(points), &params, &Progress::none()).unwrap()
    };
    let first = made(1, points.clone());
    for threads in [2, 3, 8] {
        assert_eq!(made(threads, points.clone()).mesh, first.mesh, "{threads} threads");
    }
    let turned = made(2, order.iter().map(|&i| points[i]).collect());
    let sorted = |made: &Reconstructed| {
        let mut triangles: Vec<[[u64; 3]; 3]> = made
            .mesh
            .triangles
            .iter()
            .map(|t| {
                let mut corners = t.map(|v| made.mesh.positions[v as usize].to_array().map(f64::to_bits));
                let first = (0..3).min_by_key(|&i| corners[i]).unwrap();
                corners.rotate_left(first);
                corners
            })
            .collect();
        triangles.sort_unstable();
        triangles
    };
    assert!(sorted(&turned) == sorted(&first), "the order matters");
}

#[test]
fn a_reconstructor_smooths_anew_when_asked_otherwise() {
    let points = cloud(sphere(3000, 0.5));
    let mut kept = crate::Reconstructor::new(&points).unwrap();
    let choices =
        NoisyPoints::ALL.iter().flat_map(|&noisy_points| [None, Some(0.3)].map(|smooth| (smooth, noisy_points)));
    for (smooth, noisy_points) in choices.chain([(None, NoisyPoints::Moved)]) {
        let params = ReconstructParams { smooth, noisy_points, ..Default::default() };
        let again = kept.surface(&params, &Progress::none()).unwrap();
        assert_eq!(again.mesh, run(&points, &params, &Progress::none()).unwrap().mesh, "{params:?}");
    }
}

/// Any points give a surface or an error that says what to do. Never a panic.
#[test]
fn clouds_that_are_no_surface() {
    let mut random = random(31);
    let noise: Vec<DVec3> = (0..1200).map(|_| DVec3::new(random(), random(), random())).collect();
    let line: Vec<DVec3> = (0..2000).map(|i| DVec3::X * f64::from(i)).collect();
    let lattice: Vec<DVec3> =
        (0..1100).map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100))).collect();
    let copies = [[DVec3::ONE; 1500].as_slice(), &[DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]].concat();
    let wide: Vec<DVec3> = noise.iter().map(|p| *p * 1e150).collect();
    let tiny: Vec<DVec3> = noise.iter().map(|p| *p * 1e-150).collect();
    let far: Vec<DVec3> = sphere(1200, 1.0).iter().map(|p| *p + DVec3::splat(5e6)).collect();
    let plane: Vec<DVec3> = noise.iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect();
    let off = [plane.as_slice(), &[DVec3::new(0.5, 0.5, 1e-12)]].concat();
    let parallel = [plane.as_slice(), &plane.iter().map(|p| *p + DVec3::Z).collect::<Vec<_>>()].concat();
    let far_plane: Vec<DVec3> = plane.iter().map(|p| *p + DVec3::splat(5e6)).collect();
    let nowhere = [vec![], vec![DVec3::ONE], vec![DVec3::NAN; 2000]];
    let sets = [noise, line, lattice, copies, wide, tiny, far, plane, off, parallel, far_plane];
    for points in sets.into_iter().chain(nowhere) {
        let smoothings = if base::tier::is_thorough() {
            vec![None, Some(1e-3), Some(1e200), Some(1e-200)]
        } else {
            vec![None, Some(1e200)]
        };
        for (&noisy_points, smooth) in
            NoisyPoints::ALL.iter().flat_map(|choice| smoothings.iter().map(move |&smooth| (choice, smooth)))
        {
            let params = ReconstructParams { smooth, noisy_points, ..Default::default() };
            match run(&cloud(points.clone()), &params, &Progress::none()) {
                Ok(made) => {
                    let report = check(&made.mesh);
                    assert!(report.is_manifold() && report.unused_vertices == 0, "{report}");
                    assert_eq!(made.report.closed, report.is_closed(), "{report}");
                    assert_eq!((made.report.used, made.report.points), (report.vertices, points.len()));
                    assert_eq!(made.report.used + made.report.dropped.len(), points.len());
                }
                Err(Error::Input(text)) => assert!(text.contains("point"), "{text}"),
                Err(other) => panic!("{other}"),
            }
        }
    }
}

#[test]
fn stops_when_asked_to() {
    let points = cloud(sphere(3000, 1.0));
    for checks in [0, 1, 3, 10, 30, 100] {
        let made = run(&points, &ReconstructParams::default(), &Progress::cancel_after(checks));
        assert!(matches!(made, Err(Error::Cancelled)), "{checks}");
    }
}
