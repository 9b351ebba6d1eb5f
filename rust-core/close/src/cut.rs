//! The part of the level set that fills: what lies beyond the borders of the measured surface.

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};

use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::TriMesh;

use super::surface::Surface;

/// Vertices of the level set this near to a border, in cells, go: the gap has room for triangles of some shape.
const GAP: f64 = 0.35;
/// Vertices whose nearest point lies inside the measured surface go if they are this near to it, in cells.
const NEAR: f64 = 1.75;
/// Pieces of fewer triangles go: the border around them is closed directly.
const FEWEST: usize = 8;

/// Keeps the triangles all of whose vertices lie beyond a border. The result is a manifold with boundary. No part of it is closed.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn beyond_borders(level: &TriMesh, surface: &Surface<'_>, cell: f64, progress: &Progress<'_>) -> Result<TriMesh> {
    let is_beyond = |place: &DVec3, hint: &mut Option<u32>| {
        surface.beside_from(*place, hint).is_some_and(|beside| match beside.is_at_border {
            true => beside.distance.abs() > GAP * cell,
            false => beside.distance.abs() > NEAR * cell,
        })
    };
    let stays: Vec<Vec<bool>> = level
        .positions
        .par_chunks(1024)
        .map(|places| {
            progress.check()?;
            let mut hint = None;
            Ok(places.iter().map(|place| is_beyond(place, &mut hint)).collect())
        })
        .collect::<Result<_>>()?;
    let stays = stays.concat();
    let kept = level.triangles.iter().copied().filter(|t| t.iter().all(|&v| stays[v as usize])).collect();
    let kept = pieces_with_border(single_fans(kept, progress)?, progress)?;
    Ok(compact(&level.positions, kept))
}

/// Drops the triangles around vertices that have several fans, until there are none: then each border vertex lies on one loop, once.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn single_fans(mut triangles: Vec<[u32; 3]>, progress: &Progress<'_>) -> Result<Vec<[u32; 3]>> {
    loop {
        progress.check()?;
        let mut leaving: FxHashMap<u32, u32> = FxHashMap::default();
        for [from, _] in border(&triangles, progress)? {
            *leaving.entry(from).or_default() += 1;
        }
        let before = triangles.len();
        triangles.retain(|t| t.iter().all(|v| leaving.get(v).is_none_or(|&count| count < 2)));
        if triangles.len() == before {
            return Ok(triangles);
        }
    }
}

/// Edges of one triangle, in its direction, in the order of the triangles.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn border(triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<[u32; 2]>> {
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * triangles.len());
    for block in progress.blocks(triangles) {
        edges.extend(block?.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]));
    }
    unpaired(edges, progress)
}

/// Edges whose reverse is not among them, in their order.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn unpaired(edges: Vec<[u32; 2]>, progress: &Progress<'_>) -> Result<Vec<[u32; 2]>> {
    let mut all: FxHashSet<[u32; 2]> = FxHashSet::with_capacity_and_hasher(edges.len(), FxBuildHasher);
    for block in progress.blocks(&edges) {
        all.extend(block?);
    }
    let mut open = Vec::new();
    for block in progress.blocks(&edges) {
        open.extend(block?.iter().filter(|[from, to]| !all.contains(&[*to, *from])));
    }
    Ok(open)
}

/// The piece of each triangle, joined over edges, numbered in the order of their first triangles. Also how many there are.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn pieces(triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<(Vec<u32>, usize)> {
    let mut pace = Pace::new(progress);
    let mut sides: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    let directed = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
    for (t, &corners) in triangles.iter().enumerate() {
        pace.after(16)?;
        sides.extend(directed(corners).map(|side| (side, t as u32)));
    }
    let mut piece = vec![u32::MAX; triangles.len()];
    let mut count = 0;
    for first in 0..triangles.len() {
        if piece[first] != u32::MAX {
            continue;
        }
        piece[first] = count;
        let mut stack = vec![first];
        while let Some(t) = stack.pop() {
            pace.after(16)?;
            for [a, b] in directed(triangles[t]) {
                if let Some(&other) = sides.get(&[b, a])
                    && piece[other as usize] == u32::MAX
                {
                    piece[other as usize] = count;
                    stack.push(other as usize);
                }
            }
        }
        count += 1;
    }
    Ok((piece, count as usize))
}

fn pieces_with_border(triangles: Vec<[u32; 3]>, progress: &Progress<'_>) -> Result<Vec<[u32; 3]>> {
    let (piece, count) = pieces(&triangles, progress)?;
    let on_border: FxHashSet<[u32; 2]> = border(&triangles, progress)?.into_iter().collect();
    let (mut size, mut has_border) = (vec![0_usize; count], vec![false; count]);
    for (t, &[a, b, c]) in triangles.iter().enumerate() {
        size[piece[t] as usize] += 1;
        has_border[piece[t] as usize] |= [[a, b], [b, c], [c, a]].iter().any(|edge| on_border.contains(edge));
    }
    let stays = |t: usize| size[piece[t] as usize] >= FEWEST && has_border[piece[t] as usize];
    Ok(triangles.iter().enumerate().filter(|(t, _)| stays(*t)).map(|(_, &corners)| corners).collect())
}

/// With the vertices in use alone, in their order.
fn compact(positions: &[DVec3], triangles: Vec<[u32; 3]>) -> TriMesh {
    let mut number = vec![u32::MAX; positions.len()];
    triangles.iter().flatten().for_each(|&v| number[v as usize] = 0);
    let mut used = Vec::new();
    for (v, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
        *number = used.len() as u32;
        used.push(positions[v]);
    }
    TriMesh::new(used, triangles.into_iter().map(|t| t.map(|v| number[v as usize])).collect())
}
