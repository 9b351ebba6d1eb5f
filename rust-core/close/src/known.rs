//! Signed distances at the nodes beside the measured surface.

use rayon::prelude::*;

use base::error::Result;
use base::progress::{Pace, Progress};

use super::grid::Grid;
use super::surface::Surface;

/// Layers of nodes on each side whose distance is known: a value and a slope.
const LAYERS: f64 = 2.0;

/// Nodes whose nearest point of the surface lies within two cells and not on its border, with their signed distances, rising.
/// The surface says nothing of nodes whose nearest point lies on its border. Only nodes that are `asked` for are looked at.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn near(surface: &Surface<'_>, grid: &Grid, asked: &[bool], progress: &Progress<'_>) -> Result<Vec<(u32, f64)>> {
    let reach = LAYERS * grid.cell;
    let mut pace = Pace::new(progress);
    let mut is_near = vec![false; grid.len()];
    for t in 0..surface.mesh.triangles.len() {
        let corners = surface.mesh.corners(t).map(|p| (p - grid.origin) / grid.cell);
        let lo = corners[0].min(corners[1]).min(corners[2]) - LAYERS;
        let hi = corners[0].max(corners[1]).max(corners[2]) + LAYERS;
        let range = |axis: usize| {
            let last = (grid.counts[axis] - 1) as f64;
            (lo[axis].ceil().clamp(0.0, last) as usize, hi[axis].floor().clamp(-1.0, last) + 1.0)
        };
        let [x, y, z] = [0, 1, 2].map(range);
        for k in z.0..z.1 as usize {
            for j in y.0..y.1 as usize {
                let row = grid.index([0, j, k]);
                is_near[row + x.0..(row + x.1 as usize).max(row + x.0)].fill(true);
                pace.after(8)?;
            }
        }
    }
    let nodes: Vec<u32> =
        (0..grid.len() as u32).filter(|&node| is_near[node as usize] && asked[node as usize]).collect();
    let known: Vec<Vec<(u32, f64)>> = nodes
        .par_chunks(1024)
        .map(|nodes| {
            progress.check()?;
            let mut hint = None;
            let known = |&node: &u32| {
                let beside = surface.beside_from(grid.place(node as usize), &mut hint)?;
                (!beside.is_at_border && beside.distance.abs() <= reach).then_some((node, beside.distance))
            };
            Ok(nodes.iter().filter_map(known).collect())
        })
        .collect::<Result<_>>()?;
    Ok(known.concat())
}
