//! Surfaces that are open: scans from one side, parts, borders.

use glam::DVec3;

use super::*;

/// Two sheets above each other, noise as large as a third of their spacing.
fn crumpled() -> Vec<DVec3> {
    let mut random = random(11);
    let mut points: Vec<DVec3> = (0..90 * 90)
        .map(|i| {
            let jitter = DVec3::new(random() - 0.5, random() - 0.5, 0.6 * (random() - 0.5));
            DVec3::new(f64::from(i % 90), f64::from(i / 90), 0.0) + 0.5 * jitter
        })
        .collect();
    points.extend((0..30 * 90).map(|i| {
        let jitter = DVec3::new(random() - 0.5, random() - 0.5, 0.6 * (random() - 0.5));
        DVec3::new(f64::from(i % 30), f64::from(i / 30), 4.0) + 0.5 * jitter
    }));
    points
}

#[test]
fn noise_makes_no_handles() {
    let params = ReconstructParams { interpolate: true, ..Default::default() };
    let (made, report) = reconstruct(crumpled(), &params);
    assert!(report.is_manifold() && report.genus() == Some(0), "{report}");
    assert!(report.boundary_loops <= 8 && report.components == 1, "{report}");
    assert!(made.report.used as f64 > 0.995 * made.report.points as f64, "{}", made.report.used);
}

#[test]
fn the_same_for_any_order_and_any_threads_where_noise_crumples() {
    let params = ReconstructParams { interpolate: true, threads: 1, ..Default::default() };
    let mut points = crumpled();
    let (one, _) = reconstruct(points.clone(), &params);
    for threads in [2, 3, 8] {
        let (other, _) = reconstruct(points.clone(), &ReconstructParams { threads, ..params });
        assert!(one.mesh == other.mesh, "{threads} threads");
    }
    let mut random = random(14);
    for i in (1..points.len()).rev() {
        points.swap(i, (random() * (i + 1) as f64) as usize);
    }
    let (other, _) = reconstruct(points, &params);
    assert!(as_set(&one.mesh) == as_set(&other.mesh), "another order");
}

/// Two halves of a sheet with a gap of eight spacings between them.
#[test]
fn parts_are_joined_unless_gaps_stay_open() {
    let mut random = random(12);
    let halves: Vec<DVec3> = (0..60 * 60)
        .map(|i| {
            let jitter = 0.3 * DVec3::new(random(), random(), 0.1 * random());
            DVec3::new(
                f64::from(i % 60) + if i % 60 < 30 { 0.0 } else { 8.0 },
                f64::from(i / 60),
                0.01 * f64::from(i / 60).powi(2),
            ) + jitter
        })
        .collect();
    let (_, joined) = reconstruct(halves.clone(), &ReconstructParams::default());
    assert_eq!((joined.components, joined.boundary_loops, joined.genus()), (1, 1, Some(0)), "{joined}");
    let open = ReconstructParams { closure: Closure::Open, ..Default::default() };
    let (_, apart) = reconstruct(halves, &open);
    assert_eq!((apart.components, apart.boundary_loops, apart.genus()), (2, 2, Some(0)), "{apart}");
}

#[test]
fn what_lies_far_apart_stays_apart() {
    let mut random = random(15);
    let sheets: Vec<DVec3> = (0..2 * 40 * 40)
        .map(|i| {
            let jitter = 0.3 * DVec3::new(random(), random(), 0.1 * random());
            DVec3::new(f64::from(i % 40) + f64::from(i / 1600) * 400.0, f64::from(i / 40 % 40), 0.0) + jitter
        })
        .collect();
    let (_, apart) = reconstruct(sheets, &ReconstructParams::default());
    assert_eq!((apart.components, apart.boundary_loops, apart.genus()), (2, 2, Some(0)), "{apart}");
}
