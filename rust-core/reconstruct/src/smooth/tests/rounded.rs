//! Samples whose coordinates were rounded to steps coarse enough to hide their noise.

use glam::{DMat3, DVec3};

use super::{normal, reconstruct, sorted};
use crate::noise::{self, Noise};
use crate::rounding::Rounding;
use crate::seen::Fronts;
use crate::tests::{cloud, random};
use crate::{NoisyPoints, ReconstructParams, run};
use base::progress::Progress;
use mesh::TriMesh;

/// A gently curved sheet of `side` by `side` samples about 1.5 apart with noise.
fn sheet(side: i32, noise: f64) -> Vec<DVec3> {
    let mut normal = normal(3);
    (0..side * side)
        .map(|i| {
            let [x, y] = [i % side, i / side].map(|k| 1.5 * f64::from(k) + 0.3 * normal());
            let height = 2.0 + 1.5 * (0.015 * x).sin() - (0.02 * y).cos();
            DVec3::new(x, y, height + noise * normal())
        })
        .collect()
}

fn rounded(points: &[DVec3], steps: DVec3) -> Vec<DVec3> {
    points.iter().map(|p| (*p / steps).round() * steps).collect()
}

fn noise_of(points: &[DVec3]) -> Noise {
    noise::measure(&sorted(points), &Fronts::default(), &Progress::none()).unwrap().noise
}

fn area(mesh: &TriMesh) -> f64 {
    (0..mesh.triangles.len()).map(|t| mesh.corners(t)).map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
}

#[test]
fn noise_is_measured_through_the_steps_of_coordinates() {
    let mut normal = normal(5);
    for noise in [0.6, 1.0] {
        for turn in
            [DMat3::IDENTITY, DMat3::from_rotation_y(0.1), DMat3::from_euler(glam::EulerRot::XYZ, 0.6, 0.5, 0.3)]
        {
            let points: Vec<DVec3> = sheet(60, noise).into_iter().map(|p| turn * p).collect();
            let exact = noise_of(&points).deviation;
            assert!((exact / noise - 1.0).abs() < 0.2, "{exact} for {noise}");
            // Coarser steps hide less of what is told from lattices.
            let coarse = if noise < 1.0 { DVec3::ONE } else { DVec3::splat(1.4) };
            for steps in [DVec3::ONE, coarse, DVec3::new(0.5, 0.01, 1.0)] {
                let measured = noise_of(&rounded(&points, steps)).deviation;
                assert!((measured / exact - 1.0).abs() < 0.35, "{noise} in steps of {steps}: {measured} for {exact}");
            }
            // Points that are rounded and then changed a little.
            let near: Vec<DVec3> = rounded(&points, DVec3::ONE).into_iter().map(|p| p + 1e-4 * normal()).collect();
            let measured = noise_of(&near).deviation;
            assert!((measured / exact - 1.0).abs() < 0.3, "{noise}: {measured} for {exact}");
        }
    }
}

#[test]
fn rounded_points_are_smoothed_as_the_others_are() {
    let exact = sheet(60, 0.6);
    for (points, part) in [(rounded(&exact, DVec3::ONE), 0.02), (exact, 0.02)] {
        let (made, report) = reconstruct(points);
        assert!(made.report.smoothing > 0.0 && report.components == 1 && report.boundary_loops == 1, "{report}");
        let flat = (59.0 * 1.5_f64).powi(2);
        let area = area(&made.mesh);
        assert!((area / flat - 1.0).abs() < part, "{area} for {flat}");
        let off = |p: &DVec3| p.z - (2.0 + 1.5 * (0.015 * p.x).sin() - (0.02 * p.y).cos());
        let squares: f64 = made.mesh.positions.iter().map(|p| off(p).powi(2)).sum();
        let deviation = (squares / made.mesh.positions.len() as f64).sqrt();
        assert!(deviation < 0.3, "{deviation}");
    }
}

/// Samples of clean shapes on lattices, whose step is the spacing or a part of it.
fn lattices() -> Vec<(&'static str, Vec<DVec3>)> {
    let plane = |slopes: [f64; 2], step: DVec3| -> Vec<DVec3> {
        let at = |i: i32| [i % 50, i / 50].map(f64::from);
        (0..2500).map(at).map(|[x, y]| DVec3::new(x, y, (slopes[0] * x + slopes[1] * y).round()) * step).collect()
    };
    let cube = (0..24 * 24 * 24).map(|i| [i % 24, i / 24 % 24, i / 576]);
    let shell: Vec<DVec3> =
        cube.filter(|at| at.iter().any(|&k| k == 0 || k == 23)).map(|at| DVec3::from(at.map(f64::from))).collect();
    let mut random = random(4);
    let sparse = shell.iter().copied().filter(|_| random() < 0.6).collect();
    let stairs = (0..60 * 60).map(|i| DVec3::new(f64::from(i % 60), f64::from(i / 60), f64::from(i % 60 / 6)));
    let sides = (0..50 * 50 * 2).map(|i| DVec3::new(f64::from(i % 50), f64::from(i / 50 % 50), f64::from(i / 2500)));
    let waves = (0..60 * 60).map(|i| {
        let [x, y] = [i % 60, i / 60].map(f64::from);
        DVec3::new(x, y, (15.0 * (x / 8.0).sin() * (y / 9.0).cos()).round())
    });
    vec![
        ("level", plane([0.0; 2], DVec3::ONE)),
        ("slope of a half", plane([0.5, 0.0], DVec3::ONE)),
        ("slopes of a half", plane([0.5, 0.5], DVec3::ONE)),
        ("half as high", plane([1.0, 0.0], DVec3::new(1.0, 1.0, 0.5))),
        ("shell", shell),
        ("shell with gaps", sparse),
        ("stairs", stairs.collect()),
        ("two sides, half a step apart", sides.map(|p| p * DVec3::new(1.0, 1.0, 0.4)).collect()),
        ("waves", waves.collect()),
    ]
}

#[test]
fn clean_lattices_are_left_as_they_are() {
    for (name, points) in lattices() {
        let as_clean = ReconstructParams { noisy_points: NoisyPoints::AsClean, ..Default::default() };
        let clean = run(&cloud(points.clone()), &as_clean, &Progress::none()).unwrap();
        let made = reconstruct(points).0;
        assert!(made.mesh == clean.mesh && made.report.noise == clean.report.noise, "{name}: {:?}", made.report);
    }
}

#[test]
fn steps_are_found_along_each_axis() {
    let found = |points: &[DVec3], spacing: f64| Rounding::of(&sorted(points), spacing, &Progress::none()).unwrap();
    let points = sheet(60, 0.6);
    for (steps, rounds) in [
        (DVec3::splat(0.01), false),
        (DVec3::splat(0.2), false),
        (DVec3::splat(0.4), true),
        (DVec3::ONE, true),
        (DVec3::new(0.7, 0.001, 1e-6), true),
        (DVec3::splat(1.5), true),
        // Neither noise nor surface can be told of points on coarser ones, whatever they are.
        (DVec3::splat(8.0), false),
    ] {
        let [rounded, doubled] = [1.0, 1024.0].map(|scale| {
            let points: Vec<DVec3> = rounded(&points, steps).into_iter().map(|p| p * scale).collect();
            (found(&points, 1.5 * scale), points)
        });
        assert_eq!(rounded.0.is_some(), rounds, "{steps}: {:?}", rounded.0);
        if let (Some(one), Some(other)) = (rounded.0, doubled.0) {
            for (p, q) in rounded.1.iter().zip(&doubled.1) {
                let spread = one.spread(*p);
                assert_eq!(spread * 1024.0, other.spread(*q));
                assert!((spread - *p).abs().cmple(steps + 1e-9).all(), "{p} to {spread} by {steps}");
            }
            // To whole steps of what they were before.
            let mean = rounded.1.iter().map(|p| (one.spread(*p) - *p).length_squared()).sum::<f64>() / 3600.0;
            let expected = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| one.variance(axis)).iter().sum::<f64>();
            assert!((mean / expected - 1.0).abs() < 0.1, "{mean} for {expected}");
        }
    }
    assert_eq!(found(&points, 1.5), None);
}
