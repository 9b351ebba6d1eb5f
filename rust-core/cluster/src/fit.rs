//! Stage 6, on request: nodes leave the surface for where it lies nearest in the mean square. Ours: the paper's vertices are samples.
//!
//! A mesh whose vertices lie on a curved surface lies on one side of it, everywhere off by more than it has to be. So each node moves along
//! its normal, by the least squares of the distances of points all over the surface to the planes of the triangles they are nearest to.
//! Conjugate gradients solve it, in a few rounds as the nearest triangles change. Triangles keep their side and, as far as they have them,
//! angles of 30 degrees. Nodes on the border stay.

use glam::DVec3;
use rayon::prelude::*;

use super::net::{Net, area_vector, smallest_angle};
use super::surface::{Surface, looking};
use base::error::Result;
use base::progress::Progress;
use geom::bvh::{Bvh, Closest};

/// Points handled between two looks at the progress.
const CHUNK: usize = 1024;
/// Steps of the conjugate gradients.
const STEPS: usize = 12;
/// Share of the mean stiffness that pulls every node back: it decides where no point is near.
const RIDGE: f64 = 0.01;
/// Cosine of the largest angle between a point's normal and that of a triangle it counts for: the other side of a thin sheet
/// does not.
const FACING: f64 = 0.3;
/// Farthest move of a node in one round, as a share of its shortest edge.
const FARTHEST: f64 = 0.25;
/// Times that moves which spoil a triangle are halved before they are given up.
const HALVINGS: usize = 3;
/// An angle, in radians, below which no move makes one that was above: 30 degrees.
const SHARP: f64 = std::f64::consts::FRAC_PI_6;

/// A point all over the surface: its place, unit normal and share of the area.
pub struct Sample {
    pub point: DVec3,
    pub normal: DVec3,
    pub weight: f64,
}

/// Distance of a point before its triangle's plane, and how much that changes with the moves of the corners.
#[derive(Clone, Copy, Default)]
struct Term {
    triangle: u32,
    slopes: [f64; 3],
    offset: f64,
    weight: f64,
}

/// Fits the nodes in at most `rounds` rounds.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn fit(surface: &Surface, net: &mut Net, rounds: usize, progress: &Progress<'_>) -> Result<()> {
    if rounds == 0 {
        return Ok(());
    }
    let samples = samples(surface, progress)?;
    for _ in 0..rounds {
        let normals = normals(net);
        let terms = terms(net, &normals, &samples, progress)?;
        let shifts = solve(net, &terms, progress)?;
        if !apply(net, &normals, shifts, progress)? {
            break;
        }
        progress.advance(1)?;
    }
    Ok(())
}

/// Vertices and middles of triangles. Together they weigh each triangle's area nearly as an integral over it does.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn samples(surface: &Surface, progress: &Progress<'_>) -> Result<Vec<Sample>> {
    let mut towards = vec![DVec3::ZERO; surface.points.len()];
    let mut samples = Vec::with_capacity(surface.points.len() + surface.triangles.len());
    for (t, corners) in surface.triangles.iter().enumerate() {
        looking(t as u32, progress)?;
        let [a, b, c] = surface.corners(t as u32);
        let vector = area_vector([a, b, c]);
        corners.iter().for_each(|&v| towards[v as usize] += vector);
        let (point, weight) = (a + ((b - a) + (c - a)) / 3.0, 0.375 * vector.length());
        samples.push(Sample { point, normal: vector.normalize_or_zero(), weight });
    }
    let vertices = surface.points.iter().zip(&surface.areas).zip(&towards);
    samples.extend(vertices.map(|((&point, area), normal)| Sample {
        point,
        normal: normal.normalize_or_zero(),
        weight: 0.25 * area,
    }));
    Ok(samples)
}

/// The place of the net nearest to each point, unless it faces elsewhere.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn beside(net: &Net, samples: &[Sample], progress: &Progress<'_>) -> Result<Vec<Option<Closest>>> {
    let bvh = Bvh::build_with(&net.points, &net.triangles, rayon::current_num_threads(), progress)?;
    let mut found = vec![None; samples.len()];
    found.par_chunks_mut(CHUNK).zip(samples.par_chunks(CHUNK)).try_for_each(|(found, samples)| {
        for (found, sample) in found.iter_mut().zip(samples) {
            let faces =
                |c: &Closest| net.area_vector(c.triangle as usize).normalize_or_zero().dot(sample.normal) >= FACING;
            *found = bvh.closest_point(sample.point).filter(faces);
        }
        progress.check()
    })?;
    Ok(found)
}

/// Unit normals of the nodes. None at the border, whose nodes stay.
fn normals(net: &Net) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; net.points.len()];
    for (t, corners) in net.triangles.iter().enumerate() {
        let vector = net.area_vector(t);
        corners.iter().for_each(|&v| normals[v as usize] += vector);
    }
    let unit = |(v, normal): (usize, &DVec3)| {
        if net.on_rail(v as u32) { DVec3::ZERO } else { normal.normalize_or_zero() }
    };
    normals.iter().enumerate().map(unit).collect()
}

fn terms(net: &Net, normals: &[DVec3], samples: &[Sample], progress: &Progress<'_>) -> Result<Vec<Term>> {
    let places = beside(net, samples, progress)?;
    let mut terms = vec![Term::default(); samples.len()];
    for (i, ((term, sample), place)) in terms.iter_mut().zip(samples).zip(places).enumerate() {
        looking(i as u32, progress)?;
        let Some(closest) = place else { continue };
        let normal = net.area_vector(closest.triangle as usize).normalize_or_zero();
        let corners = net.triangles[closest.triangle as usize];
        *term = Term {
            triangle: closest.triangle,
            slopes: std::array::from_fn(|k| closest.barycentric[k] * normals[corners[k] as usize].dot(normal)),
            offset: (sample.point - closest.point).dot(normal),
            weight: sample.weight,
        };
    }
    Ok(terms)
}

/// The move of each node along its normal: least squares of the terms. Sums run in the order of the terms, so they are the same
/// for any number of threads.
fn solve(net: &Net, terms: &[Term], progress: &Progress<'_>) -> Result<Vec<f64>> {
    let nodes = net.points.len();
    let corners = |term: &Term| net.triangles[term.triangle as usize].map(|v| v as usize);
    let (mut stiffness, mut residual) = (vec![0.0; nodes], vec![0.0; nodes]);
    for (i, term) in terms.iter().enumerate() {
        looking(i as u32, progress)?;
        for (v, slope) in corners(term).into_iter().zip(term.slopes) {
            stiffness[v] += term.weight * slope * slope;
            residual[v] += term.weight * slope * term.offset;
        }
    }
    let ridge = RIDGE * stiffness.iter().sum::<f64>() / nodes as f64;
    let mut shifts = vec![0.0; nodes];
    if !(ridge > 0.0) {
        return Ok(shifts);
    }
    stiffness.iter_mut().for_each(|s| *s += ridge);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let scaled = |r: &[f64]| r.iter().zip(&stiffness).map(|(r, s)| r / s).collect::<Vec<f64>>();
    let mut direction = scaled(&residual);
    let mut energy = dot(&residual, &direction);
    let first = energy;
    for _ in 0..STEPS {
        if !(energy > 1e-6 * first) {
            break;
        }
        let mut image: Vec<f64> = direction.iter().map(|d| ridge * d).collect();
        for (i, term) in terms.iter().enumerate() {
            looking(i as u32, progress)?;
            let at = corners(term);
            let along: f64 = at.iter().zip(term.slopes).map(|(&v, slope)| slope * direction[v]).sum();
            for (v, slope) in at.into_iter().zip(term.slopes) {
                image[v] += term.weight * slope * along;
            }
        }
        let step = energy / dot(&direction, &image);
        for v in 0..nodes {
            shifts[v] += step * direction[v];
            residual[v] -= step * image[v];
        }
        let next = scaled(&residual);
        let lower = dot(&residual, &next);
        let turn = lower / energy;
        direction.iter_mut().zip(next).for_each(|(d, n)| *d = n + turn * *d);
        energy = lower;
    }
    Ok(shifts)
}

/// Moves the nodes as far as their triangles stand it. Returns whether any moved.
fn apply(net: &mut Net, normals: &[DVec3], mut shifts: Vec<f64>, progress: &Progress<'_>) -> Result<bool> {
    let mut shortest = vec![f64::INFINITY; net.points.len()];
    for t in &net.triangles {
        for k in 0..3 {
            let (a, b) = (t[k] as usize, t[(k + 1) % 3] as usize);
            let length = net.points[a].distance(net.points[b]);
            shortest[a] = shortest[a].min(length);
            shortest[b] = shortest[b].min(length);
        }
    }
    for (shift, shortest) in shifts.iter_mut().zip(shortest) {
        let most = FARTHEST * shortest;
        *shift = if shift.is_finite() { shift.clamp(-most, most) } else { 0.0 };
    }
    let before: Vec<(DVec3, f64)> = net
        .triangles
        .iter()
        .enumerate()
        .map(|(t, corners)| (net.area_vector(t), smallest_angle(corners.map(|v| net.points[v as usize]))))
        .collect();
    for round in 0.. {
        progress.check()?;
        let moved = |v: u32| net.points[v as usize] + normals[v as usize] * shifts[v as usize];
        let spoilt: Vec<u32> = (0..net.triangles.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .filter(|&t| {
                let corners = net.triangles[t as usize];
                if corners.iter().all(|&v| shifts[v as usize] == 0.0) {
                    return false;
                }
                let (vector, angle) = before[t as usize];
                let after = corners.map(moved);
                let turned = area_vector(after);
                !(turned.dot(vector) > 0.5 * turned.length() * vector.length())
                    || smallest_angle(after) < angle.min(SHARP)
            })
            .collect();
        if spoilt.is_empty() {
            break;
        }
        for t in spoilt {
            for v in net.triangles[t as usize] {
                shifts[v as usize] *= if round < HALVINGS { 0.5 } else { 0.0 };
            }
        }
    }
    for (point, (normal, shift)) in net.points.iter_mut().zip(normals.iter().zip(&shifts)) {
        *point += *normal * *shift;
    }
    Ok(shifts.iter().any(|&s| s != 0.0))
}
