//! Points of known surfaces.

use glam::{DVec2, DVec3};

use super::random;

pub(super) fn sphere(count: usize, centre: DVec3, radius: f64) -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0);
    (0..count)
        .map(|i| {
            let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
            let (r, a) = ((1.0 - z * z).sqrt(), golden * i as f64);
            centre + DVec3::new(r * a.cos(), r * a.sin(), z) * radius
        })
        .collect()
}

/// Random samples of a torus, uniform over its area.
pub(super) fn torus(count: usize, large: f64, small: f64, seed: u64) -> Vec<DVec3> {
    let mut random = random(seed);
    let mut points = Vec::new();
    while points.len() < count {
        let [u, v] = [random(), random()].map(|x| x * std::f64::consts::TAU);
        if random() * (large + small) <= large + small * v.cos() {
            let r = large + small * v.cos();
            points.push(DVec3::new(r * u.cos(), r * u.sin(), small * v.sin()));
        }
    }
    points
}

/// Samples of the level set (f = 0) by projecting random points along the gradient.
pub(super) fn level_set(count: usize, size: f64, f: impl Fn(DVec3) -> f64, seed: u64) -> Vec<DVec3> {
    let mut random = random(seed);
    let gradient = |p: DVec3| {
        let h = 1e-5;
        DVec3::new(
            f(p + DVec3::X * h) - f(p - DVec3::X * h),
            f(p + DVec3::Y * h) - f(p - DVec3::Y * h),
            f(p + DVec3::Z * h) - f(p - DVec3::Z * h),
        ) / (2.0 * h)
    };
    let mut points = Vec::new();
    while points.len() < count {
        let mut p = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * 2.0 * size;
        if f(p).abs() > 0.3 {
            continue;
        }
        for _ in 0..20 {
            let g = gradient(p);
            p -= g * (f(p) / g.length_squared().max(1e-12));
        }
        if f(p).abs() < 1e-9 {
            points.push(p);
        }
    }
    points
}

pub(super) fn plate(count: usize, thickness: f64) -> Vec<DVec3> {
    let mut random = random(5);
    let sides = 32.0 / (32.0 + 16.0 * thickness);
    (0..count)
        .map(|_| {
            let (x, y) = (random() * 4.0, random() * 4.0);
            let (which, along) = (random(), random());
            if which < sides {
                return DVec3::new(x, y, if along < 0.5 { 0.0 } else { thickness });
            }
            let z = along * thickness;
            [DVec3::new(x, 0.0, z), DVec3::new(x, 4.0, z), DVec3::new(0.0, y, z), DVec3::new(4.0, y, z)]
                [(4.0 * (which - sides) / (1.0 - sides)) as usize % 4]
        })
        .collect()
}

pub(super) fn beaker(wall: f64, around: usize, spacing: f64) -> Vec<DVec3> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let bottom = (quarter / spacing) as usize;
    let side = (1.0 / spacing) as usize;
    let mut points = vec![-DVec3::Z, DVec3::Z * (wall - 1.0)];
    for radius in [1.0, 1.0 - wall] {
        let round = (1..=bottom).map(|i| quarter * i as f64 / bottom as f64).map(|a| (a.sin(), -a.cos()));
        let profile = round.map(|(x, z)| DVec2::new(x, z) * radius);
        let profile = profile.chain((1..=side).map(|i| DVec2::new(radius, i as f64 * spacing)));
        for (ring, at) in profile.enumerate() {
            points.extend((0..around).map(|i| {
                let angle = std::f64::consts::TAU * (i as f64 + 0.5 * (ring % 2) as f64) / around as f64;
                DVec2::from_angle(angle).extend(0.0) * at.x + DVec3::Z * at.y
            }));
        }
    }
    points
}

pub(super) fn waves(count: usize) -> Vec<DVec3> {
    let mut random = random(7);
    (0..count)
        .map(|_| {
            let p = DVec2::new(random(), random()) * 6.0;
            p.extend(0.3 * (2.0 * p.x).sin() * (1.5 * p.y).cos())
        })
        .collect()
}

pub(super) fn double_cone(around: usize, heights: [f64; 2]) -> Vec<DVec3> {
    let at = |i: usize| DVec2::from_angle(std::f64::consts::TAU * i as f64 / around as f64).extend(0.0);
    (0..around).map(at).chain(heights.map(|height| DVec3::Z * height)).collect()
}
