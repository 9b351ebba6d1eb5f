//! Stage 6: the mesh as a net of springs finds its equilibrium on the surface. \[KMT, sec. 5\]
//!
//! An edge's natural length is the mean, over its triangles, of the side of the equilateral triangle of the same area, but no
//! less than a share of its surroundings'. The
//! force on a node is projected onto its tangent plane, and its new position onto the surface, or along the border.

use glam::DVec3;
use rayon::prelude::*;

use super::net::{Net, Spot, Stars, area_vector};
use super::surface::{NONE, Surface};
use base::error::Result;
use base::progress::Progress;

/// Nodes and triangles handled between two looks at the progress.
const CHUNK: usize = 1024;
/// Damping as a share of the critical one.
const DAMPING: f64 = 0.9;
/// Ends when the mean step is below this share of the mean edge.
const STILL: f64 = 1e-4;
/// Least length of a spring beside its surroundings'.
const GRADING: f64 = 0.6;
/// Rings of triangles that count as surroundings.
const SPREADS: usize = 4;
/// Times a step that turns a triangle over is halved before it is given up.
const HALVINGS: usize = 2;

/// Moves the nodes for at most `steps` steps.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn relax(surface: &Surface, net: &mut Net, steps: usize, progress: &Progress<'_>) -> Result<()> {
    let stars = Stars::of(&net.triangles, net.points.len());
    let most = (0..net.points.len()).map(|v| stars.around(v).len()).max().unwrap_or(0).max(1);
    // Half of the springs' stiffness pulls along each of two directions across; the stiffest node sets the step.
    let dt = 0.6 / (0.5 * most as f64).sqrt();
    let mut speeds = vec![DVec3::ZERO; net.points.len()];
    let floors = floors(net, &stars);
    for _ in 0..steps {
        progress.check()?;
        let moved = step(surface, net, &stars, &floors, &mut speeds, dt, progress)?;
        progress.advance(1)?;
        if moved < STILL {
            break;
        }
    }
    Ok(())
}

/// Side of the equilateral triangle with the area of which this is twice the vector.
fn side(area: DVec3) -> f64 {
    (area.length() * 0.5).sqrt() * 2.0 / 3f64.sqrt().sqrt()
}

/// Least natural length for each triangle: its springs alone would let any part of the net shrink to a point.
fn floors(net: &Net, stars: &Stars) -> Vec<f64> {
    let mut sides: Vec<f64> = (0..net.triangles.len()).map(|t| side(net.area_vector(t))).collect();
    for _ in 0..SPREADS {
        let around: Vec<f64> = (0..net.points.len())
            .map(|v| stars.around(v).iter().map(|c| sides[*c as usize / 3]).sum::<f64>() / stars.around(v).len() as f64)
            .collect();
        for (side, t) in sides.iter_mut().zip(&net.triangles) {
            *side = side.max(GRADING * t.iter().map(|&v| around[v as usize]).sum::<f64>() / 3.0);
        }
    }
    sides.iter().map(|side| GRADING * side).collect()
}

/// One step. Returns the mean displacement as a share of the mean edge.
fn step(
    surface: &Surface,
    net: &mut Net,
    stars: &Stars,
    floors: &[f64],
    speeds: &mut [DVec3],
    dt: f64,
    progress: &Progress<'_>,
) -> Result<f64> {
    let areas: Vec<DVec3> =
        (0..net.triangles.len()).into_par_iter().with_min_len(CHUNK).map(|t| net.area_vector(t)).collect();
    let side = |t: usize| side(areas[t]).max(floors[t]);
    let sides: Vec<f64> = (0..areas.len()).map(side).collect();
    let mut targets = vec![Spot { point: DVec3::ZERO, place: 0, rail: NONE, way: NONE }; net.points.len()];
    let moving: &Net = net;
    targets.par_chunks_mut(CHUNK).zip(speeds.par_chunks_mut(CHUNK)).enumerate().try_for_each(
        |(chunk, (targets, speeds))| {
            for (i, (target, speed)) in targets.iter_mut().zip(speeds).enumerate() {
                let v = chunk * CHUNK + i;
                let (force, normal) = force(moving, stars, &areas, &sides, v);
                let stiffness = 0.5 * stars.around(v).len() as f64;
                let damping = DAMPING * 2.0 * stiffness.sqrt();
                let tangential = |d: DVec3| d - normal * d.dot(normal);
                let slides = moving.on_rail(v as u32) || moving.on_crease(v as u32);
                let pull = if slides { force } else { tangential(force) };
                *speed = tangential(*speed) * (1.0 - dt * damping) + pull * dt;
                *target = moving.project(surface, v, moving.points[v] + *speed * dt);
                *speed = (target.point - moving.points[v]) / dt;
            }
            progress.check()
        },
    )?;
    settle(surface, net, stars, &areas, &mut targets, speeds);
    let mut sum = 0.0;
    for (v, &target) in targets.iter().enumerate() {
        sum += target.point.distance(net.points[v]);
        net.put(v, target);
    }
    let edge = sides.iter().sum::<f64>() / sides.len() as f64;
    Ok(if edge > 0.0 { sum / targets.len() as f64 / edge } else { 0.0 })
}

/// Force on a node and its unit normal.
fn force(net: &Net, stars: &Stars, areas: &[DVec3], sides: &[f64], v: usize) -> (DVec3, DVec3) {
    let here = net.points[v];
    let (mut force, mut normal) = (DVec3::ZERO, DVec3::ZERO);
    for &corner in stars.around(v) {
        let (t, k) = (corner as usize / 3, corner as usize % 3);
        normal += areas[t];
        for other in [1, 2] {
            // Each of an edge's two triangles brings half of its spring.
            let along = net.points[net.triangles[t][(k + other) % 3] as usize] - here;
            let length = along.length();
            if length > 0.0 {
                force += along * (0.5 * (length - sides[t]) / length);
            }
        }
    }
    (force, normal.normalize_or_zero())
}

/// Halves, and in the end gives up, steps that turn a triangle over or take its area.
fn settle(surface: &Surface, net: &Net, stars: &Stars, areas: &[DVec3], targets: &mut [Spot], speeds: &mut [DVec3]) {
    let turned = |targets: &[Spot], t: usize| {
        let after = area_vector(net.triangles[t].map(|v| targets[v as usize].point));
        let before = areas[t];
        !(after.dot(before) > 0.1 * before.length() * after.length()) && before != DVec3::ZERO
    };
    let mut check: Vec<u32> =
        (0..areas.len() as u32).into_par_iter().with_min_len(CHUNK).filter(|&t| turned(targets, t as usize)).collect();
    let mut round = 0;
    while !check.is_empty() {
        let mut nodes: Vec<u32> = check.iter().flat_map(|&t| net.triangles[t as usize]).collect();
        nodes.sort_unstable();
        nodes.dedup();
        for &v in &nodes {
            let v = v as usize;
            let here = net.points[v];
            targets[v] = if round < HALVINGS {
                net.project(surface, v, here + (targets[v].point - here) * 0.5)
            } else {
                net.spot(v as u32)
            };
            speeds[v] = targets[v].point - here;
        }
        check = nodes.iter().flat_map(|&v| stars.around(v as usize).iter().map(|c| c / 3)).collect();
        check.sort_unstable();
        check.dedup();
        check.retain(|&t| {
            // With all three nodes where they were there is nothing more to give up.
            let still = net.triangles[t as usize].iter().all(|&v| targets[v as usize].point == net.points[v as usize]);
            !still && turned(targets, t as usize)
        });
        round += 1;
    }
}
