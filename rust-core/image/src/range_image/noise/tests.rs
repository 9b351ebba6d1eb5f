use glam::DVec3;

use super::super::test_images::*;
use super::super::{DepthKind, Projection, Samples};
use super::*;

const SIDE: usize = 160;

/// Distance of neighbouring pixels of [`projections`] at [`ahead`].
const PITCH: f64 = 2.0 * 0.6 / SIDE as f64;

/// Normally distributed with deviation 1, independent from pixel to pixel: Box and Muller of the words of SplitMix64
/// \[SLF14\].
fn normal(pixel: usize) -> f64 {
    let uniform = |i: usize| {
        let mix = |z: u64, shift: u32, factor: u64| (z ^ (z >> shift)).wrapping_mul(factor);
        let z = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let z = mix(mix(z, 30, 0xbf58_476d_1ce4_e5b9), 27, 0x94d0_49bb_1331_11eb);
        (((z ^ (z >> 31)) >> 12) as f64 + 0.5) / (1_u64 << 52) as f64
    };
    (-2.0 * uniform(2 * pixel).ln()).sqrt() * (std::f64::consts::TAU * uniform(2 * pixel + 1)).cos()
}

/// With white noise along the rays, of a deviation that `sigma` gives by range.
fn noisy(image: &RangeImage, sigma: impl Fn(f64) -> f64) -> RangeImage {
    let Samples::Values(values) = image.samples() else { panic!("no values") };
    let error = |i: usize| {
        let (origin, direction) = image.ray_in_sensor(i);
        let range = image.point_in_sensor(i).distance(origin);
        let error = sigma(range) * normal(i);
        match image.projection() {
            Projection::Pinhole { depth: DepthKind::Planar, .. } => error * direction.z,
            _ => error,
        }
    };
    let values = values.iter().enumerate().map(|(i, value)| value + error(i)).collect();
    RangeImage::from_values(image.rows(), image.cols(), values, *image.projection()).unwrap()
}

fn heights(side: usize, z: impl Fn(usize, usize) -> f64) -> RangeImage {
    let values = (0..side * side).map(|i| z(i / side, i % side)).collect();
    let projection = Projection::Orthographic { first: [0.0; 2], step: [1.0, 1.0] };
    RangeImage::from_values(side, side, values, projection).unwrap()
}

fn measured(image: &RangeImage) -> Noise {
    let progress = &Progress::none();
    let grid = SampleGrid::new(image, progress).unwrap();
    let noise = Noise::measure(image, progress).unwrap();
    let mut deviations = noise.of_samples(image, &grid, progress).unwrap();
    assert_eq!(deviations.len(), grid.len());
    deviations.sort_by(f32::total_cmp);
    let middle = deviations.get(grid.len() / 2).map_or(0.0, |&deviation| f64::from(deviation));
    assert!((middle - noise.typical()).abs() <= 0.05 * noise.typical(), "{middle} for {}", noise.typical());
    noise
}

#[track_caller]
fn assert_near(value: f64, truth: f64, tolerance: f64) {
    assert!((value / truth - 1.0).abs() <= tolerance, "{value} instead of {truth}");
}

/// Both kinds of surfaces that lie across the field of view.
fn surfaces(projection: Projection) -> [RangeImage; 2] {
    let centre = ahead(&projection);
    let normal = (centre.normalize() + DVec3::new(0.2, -0.1, 0.15)).normalize();
    [
        render(SIDE, SIDE, projection, plane(centre, normal)),
        render(SIDE, SIDE, projection, sphere(centre * 1.5, 0.5 * centre.length())),
    ]
}

#[test]
fn heights_of_planes_are_linear() {
    for projection in projections(SIDE, SIDE) {
        // Seen spherically, a plane is linear up to the square of the angle between pixels.
        let most = if matches!(projection, Projection::Spherical { .. }) { 1e-4 } else { 1e-14 };
        let [plane, _] = surfaces(projection);
        let heights = Heights::new(&plane, &Progress::none()).unwrap().heights;
        for line in heights.chunks_exact(SIDE) {
            assert!(line.windows(3).all(|h| (h[0] - 2.0 * h[1] + h[2]).abs() < most * h[1].abs()), "{projection:?}");
        }
    }
}

#[test]
fn white_noise_is_measured_in_every_projection() {
    for (i, projection) in projections(SIDE, SIDE).into_iter().enumerate() {
        let sigma = [0.05, 0.5, 6.0][i % 3] * PITCH;
        for image in surfaces(projection) {
            let image = noisy(&image, |_| sigma);
            for image in [as_point_grid(&image), image] {
                let noise = measured(&image);
                assert_near(noise.typical(), sigma, 0.15);
                assert_eq!(noise.correlation(), 1.0);
            }
        }
    }
}

#[test]
fn surfaces_without_noise_have_none() {
    for projection in projections(SIDE, SIDE) {
        let [plane, sphere] = surfaces(projection);
        assert!(measured(&plane).typical() < 1e-12, "{projection:?}");
        for image in [as_point_grid(&plane), as_point_grid(&sphere), sphere] {
            assert!(measured(&image).typical() < 1e-3 * PITCH, "{projection:?}");
        }
    }
    let inside = |i: usize| (40..120).contains(&i);
    let block = heights(SIDE, |r, c| if inside(r) && inside(c) { 50.0 } else { 0.0 });
    assert_eq!(measured(&block).typical(), 0.0);
}

#[test]
fn noise_that_grows_with_the_range_is_followed_across_jumps() {
    // Panels face on, at ranges from 1 to 8, and not in that order.
    let depth = |col: usize| 2.0_f64.powf((col / 40 * 5 % 7) as f64 / 2.0);
    let projection = Projection::Pinhole { focal: [500.0; 2], centre: [140.0; 2], depth: DepthKind::Planar };
    let values = (0..280 * 280).map(|i| depth(i % 280)).collect();
    let image = RangeImage::from_values(280, 280, values, projection).unwrap();
    let sigma = |range: f64| 0.003 * range * range;
    let noise = measured(&noisy(&image, sigma));
    for col in (0..280).step_by(40) {
        let range = depth(col);
        assert_near(noise.deviation(range, 1.0), sigma(range), 0.2);
    }
}

#[test]
fn noise_that_grows_with_obliquity_is_followed() {
    // A roof: 1 / cos is 1.02 on the larger side and 2 on the other.
    let ridge = 6 * TILE;
    let slope = |c: usize| if c < ridge { 0.2 } else { 3_f64.sqrt() };
    let sigma = |c: usize| 0.4 * (1.0 + 0.6 * (f64::hypot(slope(c), 1.0) - 1.0));
    let height = |c: usize| slope(c) * (c as f64 - ridge as f64);
    let noise = measured(&heights(SIDE, |r, c| height(c) + sigma(c) * normal(r * SIDE + c)));
    assert_near(noise.deviation(0.0, 1.0), 0.4, 0.1);
    assert_near(noise.deviation(0.0, 0.5), sigma(SIDE - 1), 0.15);
    // Growth as of errors to the side that make 0.64 of 0.4 at an angle of 60 degrees.
    let across = (0.64_f64.powi(2) - 0.4_f64.powi(2)).sqrt() / 60_f64.to_radians().tan();
    assert_near(noise.across(), across * noise.typical() / 0.4, 0.25);
    assert_eq!(noise.typical_step(), 0.0);
}

#[test]
fn relief_is_no_noise() {
    // A coarse mesh of a dome with a radius of 60 pixels: 3 pixels from vertex to vertex.
    let vertex = |r: usize, c: usize| {
        let [x, y] = [r, c].map(|i| i as f64 - SIDE as f64 / 6.0);
        -0.5 * 9.0 * (x * x + y * y) / 60.0
    };
    let dome = |row: usize, col: usize| {
        let (r, c) = (row / 3, col / 3);
        let [s, t] = [row, col].map(|i| (i % 3) as f64 / 3.0);
        let (a, b, d) = (vertex(r, c), vertex(r + 1, c + 1), if s > t { vertex(r + 1, c) } else { vertex(r, c + 1) });
        a * (1.0 - s.max(t)) + b * s.min(t) + d * (s - t).abs()
    };
    assert!(measured(&heights(SIDE, dome)).typical() < 0.04);
    let noise = measured(&heights(SIDE, |r, c| dome(r, c) + 0.2 * normal(r * SIDE + c)));
    assert_near(noise.typical(), 0.2, 0.15);
    // Grass, but for a path.
    let blade = |c: usize| if c < 6 * TILE { 1.0 } else { 0.1 };
    let noise = measured(&heights(SIDE, |r, c| blade(c) * normal(r * SIDE + c)));
    assert_near(noise.typical(), 0.1, 0.15);
}

#[test]
fn errors_that_depend_on_each_other_count_in_full() {
    const WIDE: usize = 2 * SIDE;
    let mean = |r: usize, c: usize| {
        let pixels = (0..4).map(|i| (r + i / 2) * (WIDE + 1) + c + i % 2);
        0.5 * pixels.map(normal).sum::<f64>()
    };
    let noise = measured(&heights(WIDE, |r, c| 0.3 * r as f64 + mean(r, c)));
    assert_near(noise.typical(), 1.0, 0.15);
    assert_eq!(noise.correlation(), 2.0);
}

#[test]
fn whole_numbers_are_off_by_rounding() {
    let hills = |r: usize, c: usize| 20.0 * (r as f64 / 25.0).sin() * (c as f64 / 30.0).cos();
    let noise = measured(&heights(SIDE, |r, c| hills(r, c).round()));
    assert_eq!(noise.step(0.0), 1.0);
    assert_near(noise.typical(), 12f64.sqrt().recip(), 0.05);
    let noise = measured(&heights(SIDE, |r, c| (hills(r, c) + normal(r * SIDE + c)).round()));
    assert_near(noise.typical(), (1.0 + 1.0 / 12.0_f64).sqrt(), 0.15);
    let steep = measured(&heights(SIDE, |r, c| (10.0 * hills(r, c)).round()));
    assert_eq!(steep.step(0.0), 1.0);
    assert!(steep.typical() < 0.5);
    assert_eq!(measured(&heights(SIDE, hills)).step(0.0), 0.0);
}

#[test]
fn steps_are_found_in_depth_its_inverse_and_along_the_ray() {
    for projection in projections(SIDE, SIDE).into_iter().filter(|p| matches!(p, Projection::Pinhole { .. })) {
        let [_, sphere] = surfaces(projection);
        let Samples::Values(values) = sphere.samples() else { panic!("no values") };
        let step = 0.02;
        let stepped = |round: &dyn Fn(f64, f64) -> f64| {
            let lengths = (0..sphere.len()).map(|i| sphere.point_in_sensor(i).length() / values[i]);
            let values = values.iter().zip(lengths).map(|(value, length)| round(*value, length)).collect();
            measured(&RangeImage::from_values(SIDE, SIDE, values, projection).unwrap())
        };
        let by_value = stepped(&|value, _| (value / step).round() * step);
        let along_ray = stepped(&|value, length| (value * length / step).round() * step / length);
        let inverse = stepped(&|value, _| 1.0 / ((4.0 / value / step).round() * step / 4.0));
        assert_near(by_value.step(1.8), step, 0.25);
        assert_near(along_ray.step(1.8), step, 0.25);
        assert_near(inverse.step(1.8), 0.25 * step * 1.8 * 1.8, 0.5);
    }
}

#[test]
fn images_that_say_nothing_have_no_noise() {
    let lone = |r: usize, c: usize| if (r + c).is_multiple_of(2) { normal(r * SIDE + c) } else { f64::NAN };
    let images = [heights(0, |_, _| 0.0), heights(1, |_, _| 7.0), heights(SIDE, |_, _| f64::NAN), heights(SIDE, lone)];
    for image in images {
        let noise = measured(&image);
        assert_eq!([noise.typical(), noise.deviation(1.0, 0.3), noise.step(1.0)], [0.0; 3]);
        assert_eq!(noise.correlation(), 1.0);
    }
    for (rows, cols) in [(1, 300), (300, 1), (2, 40), (17, 5)] {
        let values = (0..rows * cols).map(normal).collect();
        let projection = Projection::Spherical { first: [0.0; 2], step: [0.01, -0.01] };
        let noise = measured(&RangeImage::from_values(rows, cols, values, projection).unwrap());
        assert!(noise.typical().is_finite());
    }
}

#[test]
fn measuring_can_be_cancelled() {
    let image = heights(SIDE, |r, c| normal(r * SIDE + c));
    let grid = SampleGrid::new(&image, &Progress::none()).unwrap();
    let noise = measured(&image);
    assert!(Noise::measure(&image, &Progress::cancel_after(0)).is_err());
    assert!(noise.of_samples(&image, &grid, &Progress::cancel_after(0)).is_err());
}
