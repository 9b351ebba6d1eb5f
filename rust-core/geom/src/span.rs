//! Span of points: nothing, a point, a line, a plane or space. By exact signs.

use glam::DVec3;

use crate::predicates::{Arithmetic, are_collinear, volume_sign};
use base::error::Result;
use base::progress::Progress;

/// Points looked at first: most clouds span space by then.
const FIRST: usize = 1024;

/// Places of the first points, at most four, of which none lies in the point, line or plane of those before it: three for
/// points that lie in one plane.
///
/// Cost: an exact sign for each point that adds nothing, until there are four.
///
/// # Errors
/// [`base::error::Error::Cancelled`].
pub fn of(points: &[DVec3], progress: &Progress<'_>) -> Result<Vec<usize>> {
    let of_all = |points: &[DVec3]| {
        let (arithmetic, factor) = Arithmetic::of(points.iter().copied());
        corners(points.len(), |i| points[i] * factor, arithmetic, progress)
    };
    let first = &points[..points.len().min(FIRST)];
    let found = of_all(first)?;
    if found.len() == 4 || first.len() == points.len() { Ok(found) } else { of_all(points) }
}

/// The same for `count` points, multiplied as their arithmetic asks for.
pub(crate) fn corners(
    count: usize,
    at: impl Fn(usize) -> DVec3,
    arithmetic: Arithmetic,
    progress: &Progress<'_>,
) -> Result<Vec<usize>> {
    let mut corners = Vec::with_capacity(4);
    for range in progress.ranges(count) {
        for i in range? {
            let is_beyond = match corners[..] {
                [] => true,
                [a] => at(i) != at(a),
                [a, b] => !are_collinear([at(a), at(b), at(i)], arithmetic),
                [a, b, c] => volume_sign([at(a), at(b), at(c), at(i)], arithmetic) != 0,
                _ => return Ok(corners),
            };
            if is_beyond {
                corners.push(i);
            }
        }
    }
    Ok(corners)
}
