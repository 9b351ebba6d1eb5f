//! Vertices that are connected by triangles.

use super::passes;
use base::error::Result;
use base::progress::Progress;

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
