//! Loop that lies in one plane, exactly -> its constrained Delaunay triangulation there. \[Law77\]

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;
use geom::delaunay2::polygon;
use geom::span;

/// Triangles over a loop's vertices, running through its edges forward. `None` if it lies in no plane, crosses or touches itself there, or
/// an edge would connect what must not be connected.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn triangulate(
    points: &[DVec3],
    may_connect: impl Fn(u32, u32) -> bool,
    progress: &Progress<'_>,
) -> Result<Option<Vec<[u32; 3]>>> {
    let n = points.len() as u32;
    // Over three edges there is but one triangle.
    if n == 3 {
        return Ok(None);
    }
    let [a, b, c] = span::of(points, progress)?[..] else { return Ok(None) };
    let triangles = polygon(points, [a, b, c], progress)?;
    let is_edge = |from: u32, to: u32| (from + 1) % n == to || (to + 1) % n == from;
    let may_be = |&[a, b, c]: &[u32; 3]| {
        [[a, b], [b, c], [c, a]].iter().all(|&[from, to]| is_edge(from, to) || may_connect(from, to))
    };
    Ok(triangles.filter(|triangles| triangles.iter().all(may_be)))
}
