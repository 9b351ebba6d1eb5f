//! Shapes whose samples lie exactly as their makers put them: ties wherever a choice is made.

use glam::{DVec2, DVec3};

use super::{cloud, random};
use crate::{Closure, ReconstructParams, run};
use base::error::Error;
use base::progress::Progress;
use mesh::check;

/// Checks within which a shape of a few hundred samples is done, many times over.
const CHECKS: u64 = 200_000;

/// Rings of samples above each other, of so many each.
fn rings(around: usize, rings: &[(f64, f64)]) -> Vec<DVec3> {
    let ring = |&(radius, height): &(f64, f64)| {
        (0..around).map(move |i| {
            let turn = DVec2::from_angle(std::f64::consts::TAU * i as f64 / around as f64);
            (turn * radius).extend(height)
        })
    };
    rings.iter().flat_map(ring).collect()
}

/// A tube whose rings are so many times as far apart as their samples are.
fn tall_tube(around: usize, count: usize, radius: f64, times: f64) -> Vec<DVec3> {
    let step = times * std::f64::consts::TAU * radius / around as f64;
    let rings: Vec<_> = (0..count).map(|i| (radius, step * i as f64)).collect();
    self::rings(around, &rings)
}

/// One of the shapes, and its name.
fn shape(seed: u64) -> (&'static str, Vec<DVec3>) {
    let mut random = random(seed);
    let mut between = |low: usize, high: usize| low + (random() * (high - low + 1) as f64) as usize;
    let (around, count) = (between(3, 40), between(2, 9));
    let kind = between(0, 5);
    let radius = 0.5 + 5.0 * random();
    let step = (0.5 + 30.0 * random().powi(2)) * std::f64::consts::TAU * radius / around as f64;
    let along = |i: usize| i as f64 / (count - 1) as f64;
    match kind {
        0 => {
            let rings: Vec<_> = (0..count).map(|i| (radius, step * i as f64)).collect();
            ("tube", self::rings(around, &rings))
        }
        1 => ("tall tube", tall_tube(2 * around + 10, 3 + count % 3, radius, 18.0 + 7.0 * random())),
        2 => {
            let rings: Vec<_> = (0..count).map(|i| (radius * (1.0 - 0.99 * along(i)), step * i as f64)).collect();
            ("cone", self::rings(around, &rings))
        }
        3 => {
            let turn = |i: usize| std::f64::consts::PI * (i as f64 + 0.5) / count as f64;
            let rings: Vec<_> = (0..count).map(|i| (radius * turn(i).sin(), radius * turn(i).cos())).collect();
            ("sphere", self::rings(around, &rings))
        }
        4 => {
            let turn = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
            let far = radius * (1.2 + 3.0 * random());
            let rings: Vec<_> = (0..count).map(|i| (far + radius * turn(i).cos(), radius * turn(i).sin())).collect();
            ("torus", self::rings(around, &rings))
        }
        _ => {
            let steps = DVec3::new(1.0, 0.3 + 3.0 * random(), 0.3 + 20.0 * random());
            let (wide, high) = (around.min(12), count.min(5));
            let is_shell = random() < 0.5;
            let points = (0..wide * wide * high).map(|i| [i % wide, i / wide % wide, i / wide / wide]);
            let on_shell = |at: &[usize; 3]| {
                !is_shell || at.iter().zip([wide, wide, high]).any(|(&at, count)| at == 0 || at + 1 == count)
            };
            ("lattice", points.filter(on_shell).map(|at| DVec3::from(at.map(|at| at as f64)) * steps).collect())
        }
    }
}

fn assert_it_ends(about: &str, points: Vec<DVec3>, params: &ReconstructParams) {
    let count = points.len();
    match run(&cloud(points), params, &Progress::cancel_after(CHECKS)) {
        Ok(made) => {
            let report = check(&made.mesh);
            assert!(report.is_manifold() && made.report.closed == report.is_closed(), "{about}: {report}");
        }
        Err(Error::Input(_)) => {}
        Err(error) => panic!("{about}, {count} samples, {params:?}: {error}"),
    }
}

/// 10,000 of them where `SURFRECON_TIER` is `all`.
#[test]
fn exact_shapes_come_to_an_end() {
    let is_all = std::env::var_os("SURFRECON_TIER").is_some_and(|tier| tier == "all");
    for seed in 0..if is_all { 10_000 } else { 80 } {
        let (name, points) = shape(seed);
        let closure = if seed % 4 == 3 { Closure::Closed } else { Closure::Auto };
        assert_it_ends(&format!("{name} {seed}"), points, &ReconstructParams { closure, ..Default::default() });
    }
}

/// Of two facets between rings of these tubes one wants two parts turned over, and then the other wants one turned back.
#[test]
fn two_parts_do_not_turn_each_other_for_ever() {
    for (around, radius) in [(83, 1.15), (86, 1.11), (84, 1.11), (85, 1.15)] {
        let points = tall_tube(around, 4, radius, 23.7);
        let made = run(&cloud(points), &ReconstructParams::default(), &Progress::cancel_after(CHECKS)).unwrap();
        let report = check(&made.mesh);
        assert!(report.is_manifold() && report.genus() == Some(0), "{around}, {radius}: {report}");
    }
}
