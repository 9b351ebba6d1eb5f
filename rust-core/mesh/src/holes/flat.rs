//! Loop that lies in one plane, exactly -> its constrained Delaunay triangulation there. \[Law77\]

use super::minimal::Loop;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay2::polygon;
use geom::span;

/// As [`Loop::triangulate`]; `None` also for a loop that lies in no plane, or crosses or touches itself there.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn triangulate(edge_loop: &Loop<'_>, progress: &Progress<'_>) -> Result<Option<Vec<[u32; 3]>>> {
    let n = edge_loop.points.len() as u32;
    // Over three edges there is but one triangle.
    if n == 3 {
        return Ok(None);
    }
    let [a, b, c] = span::of(edge_loop.points, progress)?[..] else { return Ok(None) };
    let triangles = polygon(edge_loop.points, [a, b, c], progress)?;
    let is_edge = |from: u32, to: u32| (from + 1) % n == to || (to + 1) % n == from;
    let may_be = |&[a, b, c]: &[u32; 3]| {
        [[a, b], [b, c], [c, a]].iter().all(|&[from, to]| is_edge(from, to) || edge_loop.may_connect(from, to))
    };
    Ok(triangles.filter(|triangles| triangles.iter().all(may_be)))
}
