//! Descriptions of the surface around a point: fast point feature histograms \[RBB09\] at two radii.
//!
//! Rusu, Blodow, Beetz, "Fast Point Feature Histograms (FPFH) for 3D Registration", ICRA 2009. Differences: neighbours weigh by the
//! area they stand for, entries fall linearly into two bins, weights of neighbouring histograms fall linearly to the radius, and
//! roots of shares are compared (so that a full bin does not outweigh all others), by the sum of their differences.

use glam::{DVec3, Vec3};

use crate::level::Level;
use crate::neighbours::Neighbours;

/// Radii of the neighbourhoods in cells of the level.
const RADII: [f64; 2] = [3.0, 6.0];
/// Bins of each of the three angles.
const BINS: usize = 11;
/// Three angles at two radii, filled up to whole registers.
pub(crate) const LENGTH: usize = 80;
/// Most points described.
const MOST: usize = 1000;
/// Least distance of described points, in cells.
const APART: f64 = 1.2;

pub(crate) type Descriptor = [u8; LENGTH];

/// Described points of a level.
pub(crate) struct Features {
    /// Their indices in the level.
    pub points: Vec<u32>,
    pub descriptors: Vec<Descriptor>,
}

type Histogram = [f32; 3 * BINS];

impl Features {
    pub fn new(level: &Level) -> Self {
        let far = RADII[1] * level.cell;
        let grid = Neighbours::new(&level.points, far / 2.0);
        let mut near = Vec::new();
        let mut lists: Vec<Vec<(u32, f32)>> = Vec::with_capacity(level.len());
        for &here in &level.points {
            grid.within(here, far, &mut near);
            lists.push(near.iter().map(|&n| (n, here.distance(level.points[n as usize]) as f32)).collect());
        }
        let points: Vec<Vec3> = level.points.iter().map(|p| p.as_vec3()).collect();
        let normals: Vec<Vec3> = level.normals.iter().map(|n| n.as_vec3()).collect();
        let simple: Vec<[Histogram; 2]> =
            (0..level.len()).map(|k| simple(k, &lists[k], &points, &normals, level)).collect();
        let chosen = chosen(level, &lists, &grid);
        let descriptors = chosen.iter().map(|&k| weighted(&lists[k as usize], &simple, level.cell)).collect();
        Features { points: chosen, descriptors }
    }
}

/// Points inside the surface, those where it bends most first, apart from each other.
fn chosen(level: &Level, lists: &[Vec<(u32, f32)>], grid: &Neighbours) -> Vec<u32> {
    let bend = |k: usize| {
        let near = || lists[k].iter().filter(|n| f64::from(n.1) < RADII[0] * level.cell).map(|n| n.0 as usize);
        let sum: DVec3 = near().map(|n| level.areas[n] * level.normals[n]).sum();
        1.0 - sum.length() / near().map(|n| level.areas[n]).sum::<f64>()
    };
    let inside = (0..level.len()).filter(|&k| !level.is_border[k]);
    let mut order: Vec<(f64, u32)> = inside.map(|k| (bend(k), k as u32)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut is_near = vec![false; level.len()];
    let mut found = Vec::new();
    let mut chosen = Vec::new();
    for (_, k) in order {
        if !is_near[k as usize] {
            chosen.push(k);
            grid.within(level.points[k as usize], APART * level.cell, &mut found);
            found.iter().for_each(|&n| is_near[n as usize] = true);
        }
    }
    // Not the most bent alone: what bends most is often least reliable.
    let most = MOST;
    if chosen.len() > most {
        let step = chosen.len() as f64 / most as f64;
        chosen = (0..most).map(|i| chosen[(i as f64 * step) as usize]).collect();
    }
    chosen
}

/// Angles between a point and its neighbours, at both radii.
fn simple(k: usize, list: &[(u32, f32)], points: &[Vec3], normals: &[Vec3], level: &Level) -> [Histogram; 2] {
    let mut histograms = [[0.0; 3 * BINS]; 2];
    let near = (RADII[0] * level.cell) as f32;
    let (here, u) = (points[k], normals[k]);
    for &(n, distance) in list {
        if n as usize == k || distance == 0.0 {
            continue;
        }
        let (to, normal) = ((points[n as usize] - here) / distance, normals[n as usize]);
        let v = to.cross(u);
        let length = v.length();
        if length < 1e-6 {
            continue;
        }
        let v = v / length;
        let w = u.cross(v);
        let angles = [
            0.5 + 0.5 * v.dot(normal),
            0.5 + 0.5 * u.dot(to),
            0.5 + w.dot(normal).atan2(u.dot(normal)) * (0.5 / std::f32::consts::PI),
        ];
        let area = level.areas[n as usize] as f32;
        let scales = if distance < near { &mut histograms[..] } else { &mut histograms[1..] };
        for histogram in scales {
            for (angle, bins) in angles.iter().zip(histogram.chunks_exact_mut(BINS)) {
                let at = angle.clamp(0.0, 1.0) * (BINS - 1) as f32;
                let bin = (at as usize).min(BINS - 2);
                let part = at - bin as f32;
                bins[bin] += area * (1.0 - part);
                bins[bin + 1] += area * part;
            }
        }
    }
    for histogram in &mut histograms {
        let sum: f32 = histogram[..BINS].iter().sum();
        if sum > 0.0 {
            histogram.iter_mut().for_each(|h| *h /= sum);
        }
    }
    histograms
}

/// The histograms of the neighbours, weighted, as roots of shares.
fn weighted(list: &[(u32, f32)], simple: &[[Histogram; 2]], cell: f64) -> Descriptor {
    let mut descriptor = [0; LENGTH];
    for (scale, radius) in RADII.iter().enumerate() {
        let radius = (radius * cell) as f32;
        let mut sum = [0.0_f32; 3 * BINS];
        for &(n, distance) in list.iter().filter(|n| n.1 < radius) {
            let weight = 1.0 - distance / radius;
            sum.iter_mut().zip(&simple[n as usize][scale]).for_each(|(s, h)| *s += weight * h);
        }
        let total: f32 = sum[..BINS].iter().sum();
        for (to, h) in descriptor[scale * 3 * BINS..].iter_mut().zip(&sum) {
            *to = if total > 0.0 { (255.0 * (h / total).sqrt()) as u8 } else { 0 };
        }
    }
    descriptor
}

/// How much two descriptions differ.
#[inline(always)]
pub(crate) fn difference(a: &Descriptor, b: &Descriptor) -> u32 {
    apart(a, b, 0, LENGTH)
}

/// How much two descriptions differ, if by less than `limit`: most differ by more in their first entries.
#[inline(always)]
pub(crate) fn difference_below(a: &Descriptor, b: &Descriptor, limit: u32) -> Option<u32> {
    let first = apart(a, b, 0, FIRST);
    if first >= limit {
        return None;
    }
    let all = first + apart(a, b, FIRST, LENGTH);
    (all < limit).then_some(all)
}

/// Entries that are compared first.
const FIRST: usize = 32;

/// Sum of the differences of some entries. It takes a few instructions where it is known which entries.
#[inline(always)]
fn apart(a: &Descriptor, b: &Descriptor, first: usize, end: usize) -> u32 {
    let mut sum = 0;
    for k in first..end {
        sum += u32::from(a[k].abs_diff(b[k]));
    }
    sum
}
