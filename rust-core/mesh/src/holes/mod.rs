//! Closing holes: minimum-area triangulation, refined and faired. \[Lie03\]
//!
//! | stage | file | what |
//! |---|---|---|
//! | 1 | `loops` | boundary half-edges -> loops, and which of them are closed |
//! | 2 | `near` | the triangles around each loop |
//! | 3 | `minimal`, `flat` | loop -> triangulation of least bend, then least area |
//! | 4 | `patch` | as fine as the surroundings |
//! | 5 | `fair` | as smooth as the surroundings |
//! | 6 | `fill`, `boxes` | tries until nothing crosses |
//!
//! Differences from the paper: (1) Loops of more than `minimal::LARGEST` edges are cut along short chords first, because the triangulation
//! is cubic. (2) The fair surface is the one of least squared umbrella with mean value weights. Unlike uniform ones, they leave a flat hole
//! flat however irregular its surroundings. Unlike cotangents, they are never negative. (3) An edge that the mesh already has is never used
//! again. A fill that would cross the mesh or another fill is replaced by a less ambitious one, or the hole is left open. (4) In a plane
//! all triangulations that don't fold are as good by that. The constrained Delaunay one is taken, of loops of any length.

// 1. which loops there are
mod loops;

// 2. what lies around them
mod near;

// 3. first triangulation
mod flat;
mod minimal;

// 4. refined triangulation
mod patch;

// 5. smooth positions
mod fair;

// or over the loop alone, without new vertices
mod over;

// 6. all of it for one hole, with what to do if the result crosses something
mod boxes;
mod fill;

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use fill::Fill;

pub use boxes::meeting;
pub use loops::{HoleReason, OpenLoop, sort_out, successors, walk};
pub use near::{Bounds, region};
pub use over::close_over_loops;

/// The former name of [`HoleReason`].
#[deprecated(since = "0.2.0", note = "it is called `HoleReason`")]
pub type Reason = HoleReason;

/// A loop that was closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filled {
    /// The one of its vertices of the smallest index.
    pub vertex: u32,
    /// Vertices that were appended for it.
    pub points: usize,
    /// Triangles that were.
    pub faces: usize,
}

/// Report of [`close`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HoleReport {
    /// Loops closed.
    pub closed: usize,
    /// Loops left open, in the order of their smallest vertices.
    pub open: Vec<OpenLoop>,
    /// Number of vertices before: the new ones have this index and up.
    pub first_vertex: usize,
    /// Number of triangles before: the new ones have this index and up.
    pub first_triangle: usize,
    /// Those that were closed, in order.
    pub fills: Vec<Filled>,
    /// Three vertices for each new vertex, old ones or earlier new ones: attributes of a new vertex are the mean of
    /// theirs. Going through them in order gives every new vertex a value.
    pub sources: Vec<[u32; 3]>,
}

/// Closes the holes of a mesh whose boundary is at most as long (in the unit of the positions) as `limit` says of its
/// vertices. New vertices have no edge shorter than `shortest`.
///
/// `triangles` form an oriented manifold with boundary. `boundary` are its boundary edges, each in the direction of its triangle, in any
/// order. New vertices and triangles are appended. The old ones are not touched, also not on an error.
///
/// Guarantees: if the mesh was a manifold it stays one. No new edge connects two vertices that were already connected, so there are no
/// duplicate triangles. No new triangle crosses or touches an old or a new one except in shared vertices and edges. The order of `boundary`
/// and the number of threads don't matter. Runs on the current rayon pool.
///
/// Cost: O(v + t) for one pass over the mesh if there is anything to close. For a loop of n edges O(n^3) up to 150 edges, and beyond that
/// O(n^2) to cut it into pieces of that size. O(n log n) if it lies in a plane, exactly.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn close(
    positions: &mut Vec<DVec3>,
    triangles: &mut Vec<[u32; 3]>,
    boundary: &[[u32; 2]],
    limit: impl Fn(&[u32]) -> f64,
    shortest: f64,
    progress: &Progress<'_>,
) -> Result<HoleReport> {
    let (holes, open) = sort_out(boundary, |v| positions[v as usize], limit);
    let mut report = close_loops(positions, triangles, &holes, shortest, progress)?;
    report.open.extend(open);
    report.open.sort_by_key(|open| open.vertex);
    Ok(report)
}

/// Closes loops as [`close`] does, of which [`sort_out`] says that they are to be closed. Of the mesh the triangles have to be known whose
/// boxes meet the [`region`] of any of them.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn close_loops(
    positions: &mut Vec<DVec3>,
    triangles: &mut Vec<[u32; 3]>,
    holes: &[Vec<u32>],
    shortest: f64,
    progress: &Progress<'_>,
) -> Result<HoleReport> {
    let mut report =
        HoleReport { first_vertex: positions.len(), first_triangle: triangles.len(), ..HoleReport::default() };
    if holes.is_empty() {
        return Ok(report);
    }
    let mesh = near::Mesh { positions, triangles };
    let regions: Vec<Bounds> = holes.iter().map(|hole| mesh.region(hole)).collect();
    let surroundings = near::gather(mesh, &regions, progress)?;
    progress.check()?;
    let fills: Vec<Option<Fill>> = holes
        .par_iter()
        .zip(&surroundings)
        .map(|(hole, near)| fill::close(mesh, hole, near, &[], shortest, progress))
        .collect::<Result<_>>()?;
    let fills = settle(mesh, holes, &regions, &surroundings, fills, shortest, progress)?;
    let [points, faces] =
        fills.iter().flatten().map(Fill::size).fold([0; 2], |sum, size| [sum[0] + size[0], sum[1] + size[1]]);
    // Growing by pushing would double what is there.
    positions.reserve_exact(points);
    triangles.reserve_exact(faces);
    for (hole, fill) in holes.iter().zip(fills) {
        match fill {
            Some(fill) => {
                report.closed += 1;
                let [points, faces] = fill.size();
                report.fills.push(Filled { vertex: hole[0], points, faces });
                fill.append(hole, positions, triangles, &mut report.sources);
            }
            None => {
                let edge_loop = loops::EdgeLoop { vertices: hole.clone(), is_simple: true };
                let length = edge_loop.length(|v| positions[v as usize]);
                report.open.push(edge_loop.left_open(length, HoleReason::Crossing));
            }
        }
    }
    Ok(report)
}

/// For each region the triangles whose boxes meet it, rising.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn near(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    regions: &[Bounds],
    progress: &Progress<'_>,
) -> Result<Vec<Vec<u32>>> {
    near::gather(near::Mesh { positions, triangles }, regions, progress)
}

/// Fills were made without knowing each other. In the order of the holes, one that crosses an earlier one is made anew
/// with those in view that it may meet, or dropped.
fn settle(
    mesh: near::Mesh<'_>,
    holes: &[Vec<u32>],
    regions: &[Bounds],
    surroundings: &[Vec<u32>],
    mut fills: Vec<Option<Fill>>,
    shortest: f64,
    progress: &Progress<'_>,
) -> Result<Vec<Option<Fill>>> {
    // Not the fills' own boxes: one that is made anew lies elsewhere in its region.
    let closed = fills.iter().enumerate().filter(|(_, fill)| fill.is_some());
    let boxes: Vec<(usize, Bounds)> = closed.map(|(i, _)| (i, regions[i])).collect();
    for group in meeting(&boxes, progress)?.chunk_by(|a, b| a.0 == b.0) {
        progress.check()?;
        let later = group[0].0;
        let earlier: Vec<&Fill> = group.iter().filter_map(|&(_, i)| fills[i].as_ref()).collect();
        if fills[later].as_ref().is_some_and(|fill| fill.crosses(&earlier)) {
            fills[later] = fill::close(mesh, &holes[later], &surroundings[later], &earlier, shortest, progress)?;
        }
    }
    Ok(fills)
}

#[cfg(test)]
mod tests;
