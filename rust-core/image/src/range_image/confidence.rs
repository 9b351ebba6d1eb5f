//! Confidence of samples, how far they can be trusted: less at grazing angles, nothing at jumps and borders. \[CL96\]

use glam::DVec3;

use super::samples::SampleGrid;
use super::{Projection, RangeImage};
use base::error::Result;
use base::progress::Progress;

/// Pixels over which the confidence rises from 0 at a border to its full value. Scanners err most within a footprint of
/// the beam from a jump, and where a scan's weight falls to zero smoothly the merged surface has no step.
pub const RAMP_PIXELS: u8 = 5;

/// Lengths of a step to a side neighbour and to a diagonal one: the 3-4 chamfer, within 8 % of the Euclidean distance.
const SIDE: u8 = 3;
const DIAGONAL: u8 = 4;

/// A factor a sample: 0 where `interior` is false, rising to 1 over [`RAMP_PIXELS`] from there. An interior sample is one
/// with all eight neighbours valid. O(samples).
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn ramp(grid: &SampleGrid, interior: impl Fn(usize) -> bool, progress: &Progress<'_>) -> Result<Vec<f32>> {
    let full = RAMP_PIXELS * SIDE;
    let mut distance = vec![0_u8; grid.len()];
    for block in progress.ranges(grid.len()) {
        for k in block? {
            if interior(k) {
                let up = grid.up[k] as usize;
                let side = distance[k - 1].min(distance[up]) + SIDE;
                let diagonal = distance[up - 1].min(distance[up + 1]) + DIAGONAL;
                distance[k] = side.min(diagonal).min(full);
            }
        }
    }
    for block in progress.ranges(grid.len()) {
        for k in block?.map(|k| grid.len() - 1 - k) {
            if distance[k] > 0 {
                let down = grid.down[k] as usize;
                let side = distance[k + 1].min(distance[down]) + SIDE;
                let diagonal = distance[down - 1].min(distance[down + 1]) + DIAGONAL;
                distance[k] = distance[k].min(side).min(diagonal);
            }
        }
    }
    Ok(distance.iter().map(|&d| f32::from(d) / f32::from(full)).collect())
}

/// Multiplies `weights` by the image's own confidences. If it has none, multiplies by the cosine between normal and ray. Samples of weight
/// 0 keep it. All others must have four neighbours.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn weigh(image: &RangeImage, grid: &SampleGrid, weights: &mut [f32], progress: &Progress<'_>) -> Result<()> {
    if let Some(confidence) = &image.confidence {
        for (weight, &pixel) in weights.iter_mut().zip(&grid.pixels) {
            if *weight > 0.0 {
                *weight *= confidence[pixel as usize];
            }
        }
        return Ok(());
    }
    let projection = image.projection();
    // If all rays are parallel, their direction is computed once.
    match projection {
        Projection::Orthographic { .. } | Projection::PointGrid(super::Viewing::Parallel(_)) => {
            let direction = projection.view_direction(DVec3::ZERO);
            weigh_by_cosine(grid, weights, |_| direction, progress)
        }
        _ => weigh_by_cosine(grid, weights, |point| projection.view_direction(point), progress),
    }
}

fn weigh_by_cosine(
    grid: &SampleGrid,
    weights: &mut [f32],
    direction: impl Fn(DVec3) -> DVec3,
    progress: &Progress<'_>,
) -> Result<()> {
    let p = &grid.positions;
    for block in progress.ranges(grid.len()) {
        for k in block? {
            if weights[k] > 0.0 {
                let normal = (p[k + 1] - p[k - 1]).cross(p[grid.down[k] as usize] - p[grid.up[k] as usize]);
                let length = normal.length();
                let cosine = if length > 0.0 { normal.dot(direction(p[k])).abs() / length } else { 0.0 };
                weights[k] *= cosine as f32;
            }
        }
    }
    Ok(())
}
