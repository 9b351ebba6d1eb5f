//! How dense patches are to be: more of them where the surface bends. Ours; the paper's patches are alike everywhere.
//!
//! A triangle of size h lies about h^2 K / 8 off a surface of curvature K. The least mean distance at a given number of
//! triangles has h^4 in inverse proportion to K, so their density goes with the root of K; and that of k-means' patches with the
//! root of the weights' density, which so is K itself. K is measured at the size of the patches: detail smaller than these
//! is beyond them. 1 - |mean normal|^2 of a patch is K^2 A / (4 pi) for a disk of area A.

use glam::DVec3;

use super::surface::Surface;

/// Bounds of a patch's density beside the mean.
const RANGE: f64 = 12.0;

/// Weights of the points: areas times the density. Patches are those of `labels`.
pub fn weights(surface: &Surface, areas: &[f64], labels: &[u32], patches: usize, adaptivity: f64) -> Vec<f64> {
    let mut sums = vec![(DVec3::ZERO, 0.0); patches];
    for t in &surface.triangles {
        let [a, b, c] = t.map(|v| surface.points[v as usize]);
        let normal = (b - a).cross(c - a) / 6.0;
        for &v in t {
            let sum = &mut sums[labels[v as usize] as usize];
            sum.0 += normal;
            sum.1 += normal.length();
        }
    }
    let curvature: Vec<f64> = sums
        .iter()
        .map(
            |&(normal, area)| {
                if area > 0.0 { ((1.0 - (normal / area).length_squared()).max(0.0) / area).sqrt() } else { 0.0 }
            },
        )
        .collect();
    let mut smooth = curvature.clone();
    for _ in 0..SMOOTHINGS {
        smooth = smoothed(surface, labels, &smooth);
    }
    let (sum, area) = smooth.iter().zip(&sums).fold((0.0, 0.0), |(s, a), (k, p)| (s + k * p.1, a + p.1));
    let mean = sum / area;
    if !(mean > 0.0) {
        return areas.to_vec();
    }
    let density: Vec<f64> = smooth.iter().map(|k| (k / mean).clamp(1.0 / RANGE, RANGE).powf(adaptivity)).collect();
    areas.iter().zip(labels).map(|(a, &label)| a * density[label as usize]).collect()
}

const SMOOTHINGS: usize = 2;

/// Each patch's value averaged with those of its neighbours, by the edges they share.
fn smoothed(surface: &Surface, labels: &[u32], values: &[f64]) -> Vec<f64> {
    let mut sums: Vec<(f64, f64)> = vec![(0.0, 0.0); values.len()];
    for t in &surface.triangles {
        for k in 0..3 {
            let (a, b) = (labels[t[k] as usize] as usize, labels[t[(k + 1) % 3] as usize] as usize);
            if a != b {
                for (here, there) in [(a, b), (b, a)] {
                    sums[here].0 += values[there];
                    sums[here].1 += 1.0;
                }
            }
        }
    }
    sums.iter().zip(values).map(|(&(sum, n), &own)| if n > 0.0 { 0.5 * own + 0.5 * sum / n } else { own }).collect()
}
