//! Stage 8: connected parts of the surface; the small ones, mostly stray borders of scans, are dropped.

use super::reconstruct::Surface;

/// Parts and faces that were dropped.
pub struct Dropped {
    /// Number of parts.
    pub components: u64,
    /// Number of faces they had.
    pub faces: u64,
}

/// Drops connected parts with less than `min_share` of all triangles, and vertices without a triangle. The largest part
/// always stays.
pub fn drop_small(surface: &mut Surface, min_share: f64) -> Dropped {
    let mut parts = UnionFind::new(surface.positions.len());
    for t in &surface.triangles {
        let root = parts.union(t[0], t[1]);
        parts.union(root, t[2]);
    }
    let mut faces = vec![0_u32; surface.positions.len()];
    for t in &surface.triangles {
        faces[parts.find(t[0]) as usize] += 1;
    }
    let largest = faces.iter().copied().max().unwrap_or(0);
    let least = (min_share * surface.triangles.len() as f64).min(f64::from(largest));
    let mut dropped = Dropped { components: 0, faces: 0 };
    for &f in &faces {
        if f > 0 && f64::from(f) < least {
            dropped.components += 1;
            dropped.faces += u64::from(f);
        }
    }
    let keep: Vec<bool> = (0..surface.positions.len() as u32)
        .map(|v| {
            let f = faces[parts.find(v) as usize];
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
    let mut next = 0;
    for (v, _) in keep.iter().enumerate().filter(|k| *k.1) {
        number[v] = next;
        next += 1;
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
    surface.triangles.retain(|t| keep[t[0] as usize]);
    surface.triangles.iter_mut().for_each(|t| *t = t.map(|v| number[v as usize]));
    surface.boundary.retain(|side| keep[side[0] as usize]);
    surface.boundary.iter_mut().for_each(|side| *side = side.map(|v| number[v as usize]));
    surface.artificial.retain(|a| keep[a.vertex as usize]);
    surface.artificial.iter_mut().for_each(|a| a.vertex = number[a.vertex as usize]);
}

struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    fn new(len: usize) -> Self {
        UnionFind { parent: (0..len as u32).collect() }
    }

    #[inline]
    fn find(&mut self, mut v: u32) -> u32 {
        while self.parent[v as usize] != v {
            let up = self.parent[self.parent[v as usize] as usize];
            self.parent[v as usize] = up;
            v = up;
        }
        v
    }

    /// Joins two sets under the lower root.
    #[inline]
    fn union(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high as usize] = low;
        low
    }
}
