//! Points without noise that have outliers around them.

use glam::DVec3;

use super::uneven::waves;
use super::{random, reconstruct, sorted, spacing, sphere, to_truth, torus, with_outliers};
use crate::seen::Fronts;
use crate::tests::cloud;
use crate::{NoisyPoints, Reason, ReconstructParams, isolated, noise, run};
use base::progress::Progress;

#[test]
fn clean_points_lose_their_outliers_and_stay_where_they_are() {
    for (points, genus, share) in
        [(sphere(10_000, 0.0), 0, 0.05), (torus(10_000, 0.0), 1, 0.05), (torus(10_000, 0.0), 1, 0.2)]
    {
        let all = with_outliers(points.clone(), share);
        let (made, report) = reconstruct(all.clone());
        assert!(report.is_closed() && report.genus() == Some(genus) && report.components == 1, "{genus}: {report}");
        let outliers: Vec<u32> =
            made.report.dropped.iter().filter(|d| d.reason == Reason::Outlier).map(|d| d.point).collect();
        let right = outliers.iter().filter(|&&point| point >= 10_000).count();
        assert!(right as f64 > 0.89 * (all.len() - 10_000) as f64, "{right} of {}", all.len() - 10_000);
        assert!(outliers.len() <= right + 1, "{} points of the surface are left out", outliers.len() - right);
        assert_eq!((made.report.smoothing, made.report.moved), (0.0, 0.0));
        let off = match genus {
            0 => to_truth(&made, |p| p.length() - 1.0) / spacing(4.0 * std::f64::consts::PI, 10_000),
            _ => {
                let area = 12.0 * std::f64::consts::PI.powi(2);
                to_truth(&made, |p| (p.x.hypot(p.y) - 3.0).hypot(p.z) - 1.0) / spacing(area, 10_000)
            }
        };
        assert!(off < 0.12, "{genus}, {share}: {off} spacings");
        // As they are, all are wanted.
        let params = ReconstructParams { noisy_points: NoisyPoints::AsClean, ..Default::default() };
        let kept = run(&cloud(all), &params, &Progress::none()).unwrap().report;
        assert_eq!(kept.dropped_for(Reason::Outlier), 0);
    }
}

#[test]
fn outliers_of_clean_points_are_the_same_for_any_number_of_threads_and_any_order() {
    let points = with_outliers(torus(60_000, 0.0), 0.05);
    let last = points.len() as u32 - 1;
    let made = |points: Vec<DVec3>, threads: usize| {
        run(&cloud(points), &ReconstructParams { threads, ..Default::default() }, &Progress::none()).unwrap()
    };
    let dropped = |made: &crate::Reconstructed| made.report.dropped.iter().map(|d| d.point).collect::<Vec<u32>>();
    let one = made(points.clone(), 1);
    assert!(one.report.dropped_for(Reason::Outlier) > 2_000);
    for threads in [2, 3, 8] {
        let many = made(points.clone(), threads);
        assert_eq!((dropped(&many), &many.mesh), (dropped(&one), &one.mesh), "{threads} threads");
    }
    let turned = made(points.into_iter().rev().collect(), 2);
    let mut back: Vec<u32> = dropped(&turned).into_iter().map(|point| last - point).collect();
    back.sort_unstable();
    let mut expected = dropped(&one);
    expected.sort_unstable();
    assert_eq!(back, expected, "in reverse");
}

fn have_outliers(points: &[DVec3]) -> bool {
    let (samples, progress) = (sorted(points), Progress::none());
    let noise = noise::measure(&samples, &Fronts::default(), &progress).unwrap().noise;
    isolated::are_around(&samples, noise.spacing, &mut None, &progress).unwrap()
}

/// Samples that lie apart on a surface: sparse parts, also with creases, lines, and all of it at once.
#[test]
fn what_lies_apart_on_surfaces_is_no_outlier() {
    let mut random = random(51);
    let dense = sphere(9000, 0.0);
    let mut face = |axis: usize, side: f64| {
        let at: Vec<DVec3> = (0..144)
            .map(|_| {
                let mut at = [6.0 * random(), 6.0 * random(), 6.0 * side];
                at.rotate_right(axis);
                DVec3::from(at) + 2.0
            })
            .collect();
        at
    };
    let coarse_box: Vec<DVec3> = (0..6).flat_map(|k| face(k / 2, f64::from(k as u8 % 2))).collect();
    let line: Vec<DVec3> = (0..200).map(|i| DVec3::new(-2.0, 0.3 * f64::from(i), 0.0)).collect();
    for apart in [vec![], coarse_box.clone(), line.clone(), [coarse_box, line].concat()] {
        assert!(!have_outliers(&[dense.clone(), apart.clone()].concat()), "{}", apart.len());
    }
    for ratio in [2.0, 3.0, 6.0] {
        let (points, _) = waves(8000, ratio, 0.0);
        assert!(!have_outliers(&points), "{ratio}");
        let (made, _) = reconstruct(points);
        assert_eq!(made.report.dropped_for(Reason::Outlier), 0);
    }
    // A few are too few to tell.
    assert!(!have_outliers(&with_outliers(dense.clone(), 0.001)));
    assert!(have_outliers(&with_outliers(dense, 0.02)));
}
