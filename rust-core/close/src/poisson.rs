//! The start: a screened Poisson surface, closed at the outer bound. \[KH13\]
//!
//! The indicator is 1 inside, 0 on and beyond the outer bound. Its gradient follows the normals of the surface. At the surface it is drawn
//! to one half. Differences from the paper: (1) There is one grid, whose cells are coarser than the surface's triangles, instead of an
//! octree. (2) Values are linear in a cell.

use glam::DVec3;

use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::TriMesh;

use super::conjugate::{Goal, System};
use super::grid::Grid;
use super::multigrid::Multigrid;

/// Weight of the samples beside the gradient: the paper's.
const SCREENING: f64 = 4.0;
/// The residual falls to this share: a start needs no more.
const RESIDUAL: f64 = 1e-2;
const MOST_STEPS: usize = 60;

/// The indicator less its mean at the surface: positive inside.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn start(mesh: &TriMesh, grid: &Grid, progress: &Progress<'_>) -> Result<Vec<f64>> {
    let samples = samples(mesh, grid, progress)?;
    let all = (0..grid.len()).map(|node| grid.node(node).map(|i| i as u32));
    let weight = |sample: &Sample| SCREENING * sample.area / (grid.cell * grid.cell);
    let mut mass = vec![0.0; grid.len()];
    for sample in &samples {
        for (node, share) in grid.corners(sample.cell, sample.fraction) {
            mass[node] += weight(sample) * share;
        }
    }
    let multigrid = Multigrid::new(grid.counts, all, mass, progress)?;
    let mut right = divergence(&samples, grid);
    for sample in &samples {
        for (node, share) in grid.corners(sample.cell, sample.fraction) {
            right[node] += 0.5 * weight(sample) * share;
        }
    }
    let matrix = |x: &[f64], y: &mut [f64]| {
        for (i, neighbours) in multigrid.neighbours().iter().enumerate() {
            let sum: f64 = neighbours.iter().map(|&n| x.get(n as usize).copied().unwrap_or(0.0)).sum();
            y[i] = 6.0 * x[i] - sum;
        }
        for sample in &samples {
            let corners = grid.corners(sample.cell, sample.fraction);
            let value: f64 = corners.iter().map(|&(node, share)| share * x[node]).sum();
            for (node, share) in corners {
                y[node] += weight(sample) * value * share;
            }
        }
    };
    let mut scratch = multigrid.scratch();
    let mut x = vec![0.0; grid.len()];
    let precondition = |residual: &[f64], z: &mut [f64]| multigrid.cycle(residual, z, &mut scratch, progress);
    let mut system = System { matrix, precondition };
    let goal = Goal { energy: RESIDUAL * RESIDUAL * system.norm(&right)?, most_steps: MOST_STEPS };
    system.solve(&mut x, &right, goal, progress)?;
    let area: f64 = samples.iter().map(|sample| sample.area).sum();
    let sum: f64 = samples
        .iter()
        .map(|s| s.area * grid.corners(s.cell, s.fraction).iter().map(|&(node, share)| share * x[node]).sum::<f64>())
        .sum();
    let level = sum / area;
    x.iter_mut().for_each(|x| *x -= level);
    Ok(x)
}

/// The surface in one cell.
struct Sample {
    cell: usize,
    fraction: [f64; 3],
    area: f64,
    /// Normals times areas.
    vector: DVec3,
}

/// Triangles by the cell of their centres, summed up.
fn samples(mesh: &TriMesh, grid: &Grid, progress: &Progress<'_>) -> Result<Vec<Sample>> {
    let mut pace = Pace::new(progress);
    let mut by_cell: Vec<(usize, u32)> = Vec::with_capacity(mesh.triangles.len());
    for t in 0..mesh.triangles.len() {
        pace.after(4)?;
        let [a, b, c] = mesh.corners(t);
        by_cell.push((grid.cell_of((a + b + c) / 3.0).0, t as u32));
    }
    progress.sort(&mut by_cell, &|a, b| a.cmp(b))?;
    let mut samples = Vec::new();
    for group in by_cell.chunk_by(|a, b| a.0 == b.0) {
        pace.after(4 * group.len())?;
        let (mut area, mut vector, mut place) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for &(_, t) in group {
            let [a, b, c] = mesh.corners(t as usize);
            let doubled = (b - a).cross(c - a);
            area += 0.5 * doubled.length();
            vector += 0.5 * doubled;
            place += 0.5 * doubled.length() * (a + b + c) / 3.0;
        }
        if area > 0.0 {
            let (cell, fraction) = grid.cell_of(place / area);
            samples.push(Sample { cell, fraction, area, vector });
        }
    }
    Ok(samples)
}

/// Minus the divergence of the gradient that the normals ask for, times the cell: what the Laplacian shall give.
fn divergence(samples: &[Sample], grid: &Grid) -> Vec<f64> {
    let mut right = vec![0.0; grid.len()];
    let strides = grid.strides();
    let share = |far: i32, fraction: f64| if far == 1 { fraction } else { 1.0 - fraction };
    for sample in samples {
        for axis in 0..3 {
            // The gradient points inwards. Along its axis it lives half-way between nodes.
            let gradient = -sample.vector[axis] / (grid.cell * grid.cell);
            let shifted = sample.fraction[axis] - 0.5;
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let near = if shifted < 0.0 { -1 } else { 0 };
            let along = shifted - near as f64;
            for corner in 0..8 {
                let step = near + i64::from(corner & 1);
                let [far_u, far_v] = [corner >> 1 & 1, corner >> 2 & 1];
                let weight =
                    share(corner & 1, along) * share(far_u, sample.fraction[u]) * share(far_v, sample.fraction[v]);
                let first = sample.cell as i64
                    + step * strides[axis] as i64
                    + i64::from(far_u) * strides[u] as i64
                    + i64::from(far_v) * strides[v] as i64;
                let first = first as usize;
                right[first] -= gradient * weight;
                right[first + strides[axis]] += gradient * weight;
            }
        }
    }
    right
}
