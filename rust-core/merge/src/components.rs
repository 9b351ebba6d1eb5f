//! Stage 8: connected parts of the surface; those that noise made are dropped, and small ones where that is asked for.

use rustc_hash::FxHashMap;

use super::extract::Surface;
use super::passes;
use base::error::Result;
use base::progress::Progress;

/// Parts and faces that were dropped.
pub struct Dropped {
    /// Number of parts.
    pub components: u64,
    /// Number of faces they had.
    pub faces: u64,
}

/// Drops connected parts with fewer than `min_share` of the triangles of the largest part, and vertices without a triangle.
pub fn drop_small(surface: &mut Surface, min_share: f64, progress: &Progress<'_>) -> Result<Dropped> {
    let part_of = parts(surface.positions.len(), &surface.triangles, progress)?;
    let mut faces = passes::filled(0_u32, surface.positions.len(), progress)?;
    passes::each(surface.triangles.len(), progress, |t| {
        faces[part_of[surface.triangles[t][0] as usize] as usize] += 1;
    })?;
    let largest = faces.iter().copied().max().unwrap_or(0);
    let least = min_share * f64::from(largest);
    let mut dropped = Dropped { components: 0, faces: 0 };
    for &f in &faces {
        if f > 0 && f64::from(f) < least {
            dropped.components += 1;
            dropped.faces += u64::from(f);
        }
    }
    let keep = passes::made(part_of.len(), progress, |v| {
        let f = faces[part_of[v] as usize];
        f > 0 && f64::from(f) >= least
    })?;
    if keep.iter().any(|&k| !k) {
        compact(surface, &keep, progress)?;
    }
    Ok(dropped)
}

/// Parts of noisy samples with at most this many triangles, about as many as a cell and its neighbours hold, are stray.
const STRAY: u32 = 24;
/// A part that everywhere lies within this many standard deviations of its samples of a larger one, and a cell, is another
/// measurement of that one.
const SAME: f64 = 3.0;
/// Noise counts up to so many cells, which bounds the search.
const MOST_CELLS: f64 = 4.0;

/// Drops the parts that are no evidence of a surface: all of their samples are noisy, and they are stray or all of them
/// lies within the noise of a larger part. What clean scans measured is kept, however small.
pub fn drop_noise(surface: &mut Surface, voxel: f64, progress: &Progress<'_>) -> Result<Dropped> {
    let nothing = Dropped { components: 0, faces: 0 };
    let vertices = surface.positions.len();
    if surface.noise.iter().all(|&noise| noise == 0.0) {
        return Ok(nothing);
    }
    let part_of = parts(vertices, &surface.triangles, progress)?;
    let mut faces = passes::filled(0_u32, vertices, progress)?;
    passes::each(surface.triangles.len(), progress, |t| {
        faces[part_of[surface.triangles[t][0] as usize] as usize] += 1;
    })?;
    // By part: whether all of its vertices speak against it so far.
    let mut doubtful = passes::made(vertices, progress, |v| faces[v] > 0)?;
    passes::each(vertices, progress, |v| doubtful[part_of[v] as usize] &= surface.noise[v] > 0.0)?;
    // Buckets as large as the search reaches, of those near doubtful parts.
    let within = |v: usize| (1.0 + SAME * (f64::from(surface.noise[v]) / voxel).min(MOST_CELLS)) * voxel;
    let bucket = (1.0 + SAME * MOST_CELLS) * voxel;
    let key = |v: usize| (surface.positions[v] / bucket).floor().to_array().map(|x| x as i64);
    let largest = faces.iter().copied().max().unwrap_or(0);
    let is_searched = |v: usize| {
        let part = part_of[v] as usize;
        doubtful[part] && faces[part] > STRAY && faces[part] < largest
    };
    let mut near: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
    passes::each(vertices, progress, |v| {
        if is_searched(v) {
            for key in around(key(v)) {
                near.entry(key).or_default();
            }
        }
    })?;
    passes::each(vertices, progress, |v| {
        if let Some(list) = near.get_mut(&key(v)) {
            list.push(v as u32);
        }
    })?;
    let larger = |v: usize, other: usize| {
        let (own, its) = (part_of[v] as usize, part_of[other] as usize);
        (faces[its], own) > (faces[own], its)
    };
    let is_same = |v: usize| {
        around(key(v)).filter_map(|key| near.get(&key)).flatten().any(|&other| {
            let apart = surface.positions[v].distance_squared(surface.positions[other as usize]);
            apart <= within(v).powi(2) && larger(v, other as usize)
        })
    };
    let mut apart = passes::filled(false, vertices, progress)?;
    passes::each(vertices, progress, |v| {
        let part = part_of[v] as usize;
        if is_searched(v) && !apart[part] && !is_same(v) {
            apart[part] = true;
        }
    })?;
    let goes = |part: usize| doubtful[part] && faces[part] < largest && (faces[part] <= STRAY || !apart[part]);
    let mut dropped = nothing;
    passes::each(vertices, progress, |part| {
        if goes(part) {
            dropped.components += 1;
            dropped.faces += u64::from(faces[part]);
        }
    })?;
    if dropped.components > 0 {
        let keep = passes::made(vertices, progress, |v| !goes(part_of[v] as usize))?;
        compact(surface, &keep, progress)?;
    }
    Ok(dropped)
}

/// A bucket and its neighbours.
fn around([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1])
}

fn compact(surface: &mut Surface, keep: &[bool], progress: &Progress<'_>) -> Result<()> {
    let mut next = 0;
    let number = passes::made(keep.len(), progress, |v| {
        next += u32::from(keep[v]);
        // Of those that go nobody asks.
        next.wrapping_sub(1)
    })?;
    passes::retain(&mut surface.positions, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.confidence, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.noise, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.colour, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.scan, progress, |v, _| keep[v])?;
    let Surface { triangles, cases, .. } = surface;
    passes::retain(cases, progress, |t, _| keep[triangles[t][0] as usize])?;
    passes::retain(triangles, progress, |_, t| keep[t[0] as usize])?;
    passes::each(triangles.len(), progress, |t| triangles[t] = triangles[t].map(|v| number[v as usize]))?;
    surface.boundary.retain(|side| keep[side[0] as usize]);
    surface.boundary.iter_mut().for_each(|side| *side = side.map(|v| number[v as usize]));
    surface.artificial.retain(|a| keep[a.vertex as usize]);
    surface.artificial.iter_mut().for_each(|a| a.vertex = number[a.vertex as usize]);
    Ok(())
}

/// The lowest vertex of each vertex's part: union by lower index with path halving.
pub fn parts(vertices: usize, triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<u32>> {
    let mut parent = passes::made(vertices, progress, |v| v as u32)?;
    fn find(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            let up = parent[parent[v as usize] as usize];
            parent[v as usize] = up;
            v = up;
        }
        v
    }
    passes::each(triangles.len(), progress, |t| {
        let [a, b, c] = triangles[t];
        let up = [parent[a as usize], parent[b as usize], parent[c as usize]];
        if up[0] == up[1] && up[1] == up[2] {
            return;
        }
        let roots = [find(&mut parent, a), find(&mut parent, b), find(&mut parent, c)];
        let lowest = roots[0].min(roots[1]).min(roots[2]);
        for root in roots {
            parent[root as usize] = lowest;
        }
    })?;
    // Parents have lower indices, so one pass upward finds every root.
    passes::each(vertices, progress, |v| parent[v] = parent[parent[v] as usize])?;
    Ok(parent)
}
