//! Vertices that are connected by triangles.

use base::error::Result;
use base::progress::Progress;

/// The lowest vertex of each vertex's part: union by lower index with path halving. 4 bytes per vertex.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn parts(vertices: usize, triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<u32>> {
    let mut parent: Vec<u32> = (0..vertices as u32).collect();
    fn find(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            let up = parent[parent[v as usize] as usize];
            parent[v as usize] = up;
            v = up;
        }
        v
    }
    for block in progress.blocks(triangles) {
        for &[a, b, c] in block? {
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
    }
    // Parents have lower indices, so one pass upward finds every root.
    for block in progress.ranges(vertices) {
        block?.for_each(|v| parent[v] = parent[parent[v] as usize]);
    }
    Ok(parent)
}
