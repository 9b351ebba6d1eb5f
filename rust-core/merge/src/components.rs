//! Stage 8: connected parts of the surface; small ones are dropped where that is asked for.

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
    let faces = faces(&part_of, &surface.triangles, progress)?;
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

/// Keeps the vertices that are to be kept, and the triangles between them.
pub fn compact(surface: &mut Surface, keep: &[bool], progress: &Progress<'_>) -> Result<()> {
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

/// The number of triangles of each part, by its lowest vertex.
pub fn faces(part_of: &[u32], triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<u32>> {
    let mut faces = passes::filled(0, part_of.len(), progress)?;
    passes::each(triangles.len(), progress, |t| faces[part_of[triangles[t][0] as usize] as usize] += 1)?;
    Ok(faces)
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
