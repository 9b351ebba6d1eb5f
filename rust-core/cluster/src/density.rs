//! Density of patches: more of them where the surface bends. Ours: the paper's patches are alike everywhere.
//!
//! A triangle of size h lies about h^2 K / 8 off a surface of curvature K. The least mean distance at a given number of triangles has h^4
//! in inverse proportion to K, so their density goes with the root of K. The density of k-means' patches goes with the root of the weights'
//! density, which so is K itself. K is measured at the size of the patches, because detail smaller than these is beyond them. It is the
//! mean distance of a patch's points from its own fan, beside the patch's area. So a patch that wraps the rim of a thin sheet, whose
//! normals tell nothing, counts as much as it errs.

use rayon::prelude::*;

use super::creases::{Creases, Pieces};
use super::fans;
use super::kmeans::members;
use super::polygons::Polygons;
use super::surface::Surface;
use base::error::Result;
use base::progress::Progress;
use geom::bvh::Closest;

/// Bounds of a patch's density beside the mean.
const RANGE: f64 = 12.0;
/// Times each patch's value is averaged with its neighbours'.
const SMOOTHINGS: usize = 2;
/// Points handled between two looks at the progress.
const CHUNK: usize = 1024;

/// Weights of the points: areas times the density. Patches are those of `labels`.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn weights(
    surface: &Surface,
    sharp: &[u32],
    areas: &[f64],
    labels: &[u32],
    patches: usize,
    adaptivity: f64,
    progress: &Progress<'_>,
) -> Result<Vec<f64>> {
    // A patch may have lost all its points to others.
    let (labels, patches) = &used(labels, patches);
    let (bends, sizes) = bends(surface, sharp, areas, labels, *patches, progress)?;
    let mut smooth = bends;
    for _ in 0..SMOOTHINGS {
        progress.check()?;
        smooth = smoothed(surface, labels, &smooth);
    }
    let (sum, area) = smooth.iter().zip(&sizes).fold((0.0, 0.0), |(s, a), (k, size)| (s + k * size, a + size));
    let mean = sum / area;
    if !(mean > 0.0 && mean.is_finite()) {
        return Ok(areas.to_vec());
    }
    let density: Vec<f64> = smooth.iter().map(|k| (k / mean).clamp(1.0 / RANGE, RANGE).powf(adaptivity)).collect();
    Ok(areas.iter().zip(labels).map(|(a, &label)| a * density[label as usize]).collect())
}

/// Labels without the patches that have no point, and how many patches are left.
fn used(labels: &[u32], patches: usize) -> (Vec<u32>, usize) {
    let mut number = vec![0_u32; patches];
    labels.iter().for_each(|&label| number[label as usize] = 1);
    let mut count = 0;
    for slot in &mut number {
        count += std::mem::replace(slot, count);
    }
    (labels.iter().map(|&label| number[label as usize]).collect(), count as usize)
}

/// For each patch the mean distance of its points from its fan as a share of its area, and the area.
fn bends(
    surface: &Surface,
    sharp: &[u32],
    areas: &[f64],
    labels: &[u32],
    patches: usize,
    progress: &Progress<'_>,
) -> Result<(Vec<f64>, Vec<f64>)> {
    let creases = Creases::of(surface, sharp, patches, progress)?;
    let pieces = Pieces::of(&creases, surface, labels, patches);
    let polygons = Polygons::trace(surface, labels, Some(&pieces));
    progress.check()?;
    let net = fans::mesh(surface, areas, labels, patches, &polygons, Some(&pieces));
    progress.check()?;
    let owners: Vec<u32> = net.triangles.iter().map(|t| t[0]).collect();
    let (starts, fans) = members(&owners, patches);
    let mut distances = vec![0.0; labels.len()];
    distances.par_chunks_mut(CHUNK).zip(labels.par_chunks(CHUNK).zip(surface.points.par_chunks(CHUNK))).try_for_each(
        |(distances, (labels, points))| {
            for ((distance, &label), &p) in distances.iter_mut().zip(labels).zip(points) {
                let fan = &fans[starts[label as usize] as usize..starts[label as usize + 1] as usize];
                let squared = fan.iter().fold(f64::INFINITY, |nearest, &t| {
                    let corners = net.triangles[t as usize].map(|v| net.points[v as usize]);
                    nearest.min(Closest::on_triangle(p, &corners, t).distance_squared)
                });
                // A patch without a border, such as a whole sphere, has no fan: it wants more than any other.
                *distance = if squared.is_finite() { squared.sqrt() } else { p.distance(net.points[label as usize]) };
            }
            progress.check()
        },
    )?;
    let mut sums = vec![(0.0, 0.0); patches];
    for ((distance, &label), area) in distances.iter().zip(labels).zip(areas) {
        let sum = &mut sums[label as usize];
        sum.0 += distance * area;
        sum.1 += area;
    }
    let bends = sums.iter().map(|s| if s.1 > 0.0 { s.0 / s.1 / s.1 } else { 0.0 }).collect();
    Ok((bends, sums.iter().map(|s| s.1).collect()))
}

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
