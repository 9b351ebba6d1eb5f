//! Stage 8: connected parts of the surface; the small ones, mostly stray borders of scans, are dropped.

use super::reconstruct::Surface;

/// Parts and faces that were dropped.
pub struct Dropped {
    /// Number of parts.
    pub components: u64,
    /// Number of faces they had.
    pub faces: u64,
}

/// Drops connected parts with fewer than `min_share` of the triangles of the largest part, and vertices without a triangle.
pub fn drop_small(surface: &mut Surface, min_share: f64) -> Dropped {
    let part_of = parts(surface.positions.len(), &surface.triangles);
    let mut faces = vec![0_u32; surface.positions.len()];
    for t in &surface.triangles {
        faces[part_of[t[0] as usize] as usize] += 1;
    }
    let largest = faces.iter().copied().max().unwrap_or(0);
    let least = min_share * f64::from(largest);
    let mut dropped = Dropped { components: 0, faces: 0 };
    for &f in &faces {
        if f > 0 && f64::from(f) < least {
            dropped.components += 1;
            dropped.faces += u64::from(f);
        }
    }
    let keep: Vec<bool> = part_of
        .iter()
        .map(|&part| {
            let f = faces[part as usize];
            f > 0 && f64::from(f) >= least
        })
        .collect();
    if keep.iter().any(|&k| !k) {
        compact(surface, &keep);
    }
    dropped
}

fn compact(surface: &mut Surface, keep: &[bool]) {
    let mut number = vec![u32::MAX; keep.len()];
    for (next, (v, _)) in (0..).zip(keep.iter().enumerate().filter(|k| *k.1)) {
        number[v] = next;
    }
    fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
        let mut v = 0;
        list.retain(|_| {
            v += 1;
            keep[v - 1]
        });
    }
    retain(&mut surface.positions, keep);
    retain(&mut surface.confidence, keep);
    retain(&mut surface.colour, keep);
    retain(&mut surface.scan, keep);
    let kept: Vec<bool> = surface.triangles.iter().map(|t| keep[t[0] as usize]).collect();
    retain(&mut surface.cases, &kept);
    surface.triangles.retain(|t| keep[t[0] as usize]);
    surface.triangles.iter_mut().for_each(|t| *t = t.map(|v| number[v as usize]));
    surface.boundary.retain(|side| keep[side[0] as usize]);
    surface.boundary.iter_mut().for_each(|side| *side = side.map(|v| number[v as usize]));
    surface.artificial.retain(|a| keep[a.vertex as usize]);
    surface.artificial.iter_mut().for_each(|a| a.vertex = number[a.vertex as usize]);
}

/// The lowest vertex of each vertex's part: union by lower index with path halving.
pub fn parts(vertices: usize, triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    fn find(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            let up = parent[parent[v as usize] as usize];
            parent[v as usize] = up;
            v = up;
        }
        v
    }
    for &[a, b, c] in triangles {
        let up = [parent[a as usize], parent[b as usize], parent[c as usize]];
        if up[0] == up[1] && up[1] == up[2] {
            continue;
        }
        let roots = [find(&mut parent, a), find(&mut parent, b), find(&mut parent, c)];
        let lowest = roots[0].min(roots[1]).min(roots[2]);
        for root in roots {
            parent[root as usize] = lowest;
        }
    }
    // Parents have lower indices, so one pass upward finds every root.
    for v in 0..vertices {
        parent[v] = parent[parent[v] as usize];
    }
    parent
}
