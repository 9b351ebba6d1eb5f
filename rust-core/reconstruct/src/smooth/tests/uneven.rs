//! Points that lie closer together in some places than in others.

use glam::DVec3;

use super::{normal, random, reconstruct, spacing, sphere, torus, with_outliers};
use crate::noise::{self, Noise};
use crate::scales::{Scale, Scales};
use crate::seen::Fronts;
use crate::tests::cloud;
use crate::{Reason, ReconstructParams, run};
use base::progress::Progress;
use geom::neighbours::KdTree;

/// Waves over two squares beside each other, the second with spacings so many times those of the first, and noise in the spacings of
/// either. And how many are in the first.
pub(super) fn waves(count: usize, ratio: f64, noise: f64) -> (Vec<DVec3>, usize) {
    let (mut random, mut normal) = (random(3), normal(5));
    let all = count + (count as f64 / ratio.powi(2)) as usize;
    let points = (0..all)
        .map(|i| {
            let (right, times) = if i < count { (0.0, 1.0) } else { (1.0, ratio) };
            let [x, y] = [right + random(), random()];
            DVec3::new(x, y, 0.05 * (6.0 * x).sin() + noise * times * spacing(1.0, count) * normal())
        })
        .collect();
    (points, count)
}

#[test]
fn sparse_parts_are_kept() {
    for (ratio, noise, outliers, least) in
        [(2.0, 0.6, 0.0, 0.98), (3.0, 0.3, 0.0, 0.9), (3.0, 0.6, 0.05, 0.9), (3.0, 1.0, 0.0, 0.9), (5.0, 0.6, 0.0, 0.7)]
    {
        let (points, dense) = waves(8000, ratio, noise);
        let all = points.len();
        let mut random = random(13);
        let around = (0..(outliers * all as f64) as usize)
            .map(|_| DVec3::new(2.0, 1.0, 1.0) * DVec3::new(random(), random(), random() - 0.5));
        let (made, report) = reconstruct(points.into_iter().chain(around).collect());
        assert!(report.is_manifold() && report.components == 1, "{ratio}, {noise}: {report}");
        let lost = |range: std::ops::Range<usize>| {
            made.report.dropped.iter().filter(|dropped| range.contains(&(dropped.point as usize))).count()
        };
        let kept = 1.0 - lost(dense..all) as f64 / (all - dense) as f64;
        assert!(kept > least, "{ratio}, {noise}, {outliers}: {kept} of the sparse part");
        assert!(lost(0..dense) < dense / 100, "{ratio}, {noise}: {} of the dense part", lost(0..dense));
        let outside = made.report.points - all;
        assert!(lost(all..made.report.points) as f64 >= 0.8 * outside as f64, "{ratio}, {noise}: outliers stay");
    }
}

/// One part without a handle and without any hole, which loses next to none of its points.
#[test]
fn open_noisy_sheets_are_whole() {
    for (noise, outliers) in [(0.3, 0), (0.5, 400), (1.0, 0), (1.0, 400), (2.0, 400)] {
        let (points, dense) = waves(4000, 1.0, noise);
        let all = points.len();
        assert_eq!(all, 2 * dense);
        let mut random = random(13);
        let around = (0..outliers).map(|_| DVec3::new(2.0, 1.0, 1.0) * DVec3::new(random(), random(), random() - 0.5));
        let (made, report) = reconstruct(points.into_iter().chain(around).collect());
        assert_eq!((report.is_manifold(), report.components, report.genus()), (true, 1, Some(0)), "{noise}: {report}");
        assert_eq!(report.boundary_loops, 1, "{noise}, {outliers}: {report}");
        let lost = made.report.dropped.iter().filter(|dropped| (dropped.point as usize) < all).count();
        assert!(lost < all / 200, "{noise}, {outliers}: {lost} are lost");
    }
}

/// Scale of each sample, which is none if all lie about as far apart.
fn scales(samples: &[DVec3]) -> Scales {
    let (fronts, progress) = (Fronts::default(), Progress::none());
    let measured = noise::measure(samples, &fronts, &progress).unwrap();
    let tree = KdTree::new(samples);
    Scales::of(samples, &fronts, &measured, &tree, &progress).unwrap()
}

#[test]
fn even_clouds_are_left_alone_whatever_their_outliers() {
    for noise in [0.3, 1.0] {
        for points in [sphere(10_000, noise), torus(10_000, noise), with_outliers(torus(10_000, noise), 0.05)] {
            let points = super::sorted(&points);
            assert!(scales(&points).are_usual(), "{noise}");
        }
    }
    let points = super::sorted(&waves(8000, 3.0, 0.6).0);
    let scales = scales(&points);
    let of = |is_sparse: bool| {
        let far = |p: &DVec3| (p.x < 0.8 && !is_sparse) || (p.x > 1.2 && is_sparse);
        let found: Vec<f64> = (0..points.len()).filter(|&i| far(&points[i])).map(|i| scales.at(i).spacing).collect();
        found.iter().sum::<f64>() / found.len() as f64
    };
    assert!((of(false) - 1.0).abs() < 0.02 && (of(true) - 3.0).abs() < 0.4, "{} {}", of(false), of(true));
}

#[test]
fn usual_lengths_are_multiplied_by_one() {
    let lengths = super::super::kept::Lengths { noise: Noise { deviation: 0.7, spacing: 0.3 }, few: 0.5, given: None };
    assert_eq!(lengths.deviation(Scale::USUAL), 0.7);
    assert_eq!(lengths.radius(5.0, Scale::USUAL), 5.0);
    assert_eq!(lengths.start(Scale::USUAL), 8.0 * 0.7);
}

#[test]
fn the_same_for_any_order_and_threads() {
    let points = with_outliers(waves(6000, 3.0, 0.5).0, 0.02);
    let made = |points: &[DVec3], threads: usize| {
        let params = ReconstructParams { threads, ..Default::default() };
        run(&cloud(points.to_vec()), &params, &Progress::none()).unwrap().mesh
    };
    let one = made(&points, 1);
    for threads in [2, 3] {
        assert!(made(&points, threads) == one, "{threads} threads");
    }
    let mut turned = points.clone();
    turned.reverse();
    let places = |mesh: mesh::TriMesh| {
        let mut places: Vec<[u64; 3]> = mesh.positions.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
        places.sort_unstable();
        places
    };
    assert!(places(made(&turned, 2)) == places(one), "another order");
}

/// A radius smaller than the spacing is no reason to drop what is right.
#[test]
fn small_radii_keep_points() {
    for (count, noise) in [(500, 0.0), (3000, 0.0), (3000, 0.5)] {
        for part in [1e-3, 0.1, 0.5, 1.0] {
            let smooth = Some(part * spacing(4.0 * std::f64::consts::PI, count));
            let params = ReconstructParams { smooth, ..Default::default() };
            let made = run(&cloud(sphere(count, noise)), &params, &Progress::none()).unwrap();
            let outliers = made.report.dropped_for(Reason::Outlier);
            let most = if noise == 0.0 { 0.01 } else { 0.025 };
            assert!(
                made.report.closed && outliers as f64 <= most * count as f64,
                "{count}, {noise}, {part}: {outliers}"
            );
            let largest = if noise == 0.0 { 0.05 } else { 0.4 };
            let off = super::to_truth(&made, |p| p.length() - 1.0) / spacing(4.0 * std::f64::consts::PI, count);
            assert!(off < largest, "{count}, {noise}, {part}: {off} spacings");
        }
    }
}
