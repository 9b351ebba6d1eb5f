//! Samples of a range image whose coordinates were rounded. Those of a row lie in one plane through the sensor but for that, so that the
//! cells at the sides of the image are as flat as rounding is small.

use glam::DVec3;
use proptest::prelude::*;

use super::{balls::Balls, random, reconstruct};
use crate::ReconstructParams;
use crate::complex::Complex;
use base::progress::Progress;
use geom::delaunay3::Delaunay3;

/// A saddle seen by a pinhole camera in the origin, with noise along the rays.
fn image(rows: i32, columns: i32, seed: u64) -> Vec<DVec3> {
    let mut random = random(seed);
    let middle = [columns, rows].map(|count| f64::from(count - 1) / 2.0);
    let ray = |i: i32| {
        let [x, y] = [i % columns, i / columns].map(f64::from);
        DVec3::new((x - middle[0]) / 131.25, (y - middle[1]) / 131.25, 1.0)
    };
    (0..rows * columns)
        .map(|i| {
            let ray = ray(i);
            ray * (2.0 + 0.4 * ray.x * ray.y + 0.004 * (random() + random() - 1.0))
        })
        .collect()
}

/// To steps of `step`. 0 for single precision.
fn rounded(points: &[DVec3], step: f64) -> Vec<DVec3> {
    let round = |x: f64| if step > 0.0 { (x / step).round() * step } else { f64::from(x as f32) };
    points.iter().map(|p| DVec3::from_array(p.to_array().map(round))).collect()
}

#[test]
fn range_images_stay_open_however_they_were_rounded() {
    for seed in 1..4 {
        let exact = image(120, 160, seed);
        let area = area_of(&exact);
        for step in [0.0, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5] {
            let open = area_of(&rounded(&exact, step));
            assert!((open / area - 1.0).abs() < 1e-3, "image {seed} rounded to {step}: {open} instead of {area}");
        }
    }
}

/// The area of the surface, which is open and in one part.
fn area_of(points: &[DVec3]) -> f64 {
    let (made, report) = reconstruct(points.to_vec(), &ReconstructParams::default());
    assert!(!made.report.closed && report.components == 1 && report.genus() == Some(0), "{report}");
    let area = |t: usize| {
        let [a, b, c] = made.mesh.corners(t);
        (b - a).cross(c - a).length() / 2.0
    };
    (0..made.mesh.triangles.len()).map(area).sum()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: base::tier::cases(32), ..ProptestConfig::default() })]

    /// Theorem (Edelsbrunner 2003): beyond a facet that a ball's centre lies beyond, the ball is as large or larger. By this, what is
    /// connected with the outside is found to be.
    #[test]
    fn balls_grow_through_the_facets_that_their_centres_lie_beyond(seed in any::<u64>(), digits in 3..16_i32, is_single in any::<bool>()) {
        let step = if is_single { 0.0 } else { 10.0_f64.powi(-digits) };
        let points = rounded(&image(16, 24, seed), step);
        let delaunay = Delaunay3::new(&points, 1, &Progress::none()).unwrap();
        let complex = Complex { points: &points, cells: delaunay.cells(), finite: delaunay.finite_count() };
        let balls = Balls::of(complex, &Progress::none()).unwrap();
        for cell in 0..complex.finite as u32 {
            for slot in (0..4).filter(|&slot| balls.sides[cell as usize] >> slot & 1 == 0) {
                let [ball, beyond] = [cell, complex.neighbour(cell, slot)].map(|cell| balls.radii[cell as usize]);
                prop_assert!(beyond >= 0.999 * ball, "{} beyond {}", beyond, ball);
            }
        }
    }
}
