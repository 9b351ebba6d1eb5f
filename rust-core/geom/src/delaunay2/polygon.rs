//! The inside of a polygon: constrained by its edges, and what lies outside of them left out.

use glam::DVec3;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::flip;
use super::insert::Seen;
use super::triangulation::{Delaunay2, OUTSIDE};
use super::view::View;
use base::error::Result;
use base::progress::Progress;

/// The constrained Delaunay triangulation of the inside of a polygon. The polygon lies in the plane of those of its `points` at the three
/// places `corners` ([`crate::span::of`]). No point that can be seen from inside of a triangle is inside of the circle around it, in the
/// plane itself. The triangles run through the polygon's edges forward. There are two fewer than points. `None` if the polygon crosses or
/// touches itself, or its coordinates differ so much in size that no product of them can be had in doubles.
///
/// Cost: O(n log n) in practice. Source: \[Law77\] for turning edges, which keep to the polygon's inside.
///
/// # Errors
/// [`base::error::Error::Cancelled`].
pub fn polygon(points: &[DVec3], corners: [usize; 3], progress: &Progress<'_>) -> Result<Option<Vec<[u32; 3]>>> {
    let Ok(view) = View::of(points, corners) else { return Ok(None) };
    let Some(mut made) = inside(points, &view, progress)? else { return Ok(None) };
    if view.is_sheared {
        flip::make_delaunay(&mut made, points, &view, progress)?;
    }
    let is_first = |triangle: &[u32; 3]| [0, 1, 2].iter().any(|&i| [triangle[i], triangle[(i + 1) % 3]] == [0, 1]);
    if !made.triangles.iter().any(is_first) {
        made.turn_over();
    }
    Ok(Some(made.triangles))
}

/// The triangulation of the inside, Delaunay as it is seen.
fn inside(points: &[DVec3], view: &View, progress: &Progress<'_>) -> Result<Option<Delaunay2>> {
    let mut seen = ConstrainedDelaunayTriangulation::<Seen>::new();
    let mut handles = Vec::with_capacity(points.len());
    for (id, &point) in points.iter().enumerate() {
        progress.check()?;
        let at = view.seen(point);
        let Ok(handle) = seen.insert(Seen { at: Point2::new(at.x, at.y), id: id as u32 }) else { return Ok(None) };
        handles.push(handle);
    }
    // One at the place of another takes it over; so an edge can't run back along another, either.
    if seen.num_vertices() < points.len() {
        return Ok(None);
    }
    for (i, &from) in handles.iter().enumerate() {
        progress.check()?;
        // None across another edge; more than one over a point.
        if seen.try_add_constraint(from, handles[(i + 1) % handles.len()]).len() != 1 {
            return Ok(None);
        }
    }
    let is_outside = reached_from_outside(&seen);
    let mut numbers = vec![OUTSIDE; is_outside.len()];
    let is_inside = |face: usize| !is_outside[face];
    (0..is_outside.len()).filter(|&face| is_inside(face)).zip(0..).for_each(|(face, number)| numbers[face] = number);
    let id = |vertex: FixedVertexHandle| seen.vertex(vertex).data().id;
    let mut made = Delaunay2::default();
    for face in seen.inner_faces().filter(|face| is_inside(face.index())) {
        let edges = face.adjacent_edges();
        made.triangles.push(edges.map(|edge| id(edge.from().fix())));
        // Opposite to a corner lies the edge after the next.
        let beyond = edges.map(|edge| numbers[edge.rev().face().index()]);
        made.neighbours.push([beyond[1], beyond[2], beyond[0]]);
    }
    debug_assert_eq!(made.triangles.len(), points.len() - 2);
    Ok(Some(made))
}

/// Of each face, the outer one first, whether it can be reached from there without crossing the polygon.
fn reached_from_outside(seen: &ConstrainedDelaunayTriangulation<Seen>) -> Vec<bool> {
    let mut is_reached = vec![false; seen.num_all_faces()];
    is_reached[seen.outer_face().index()] = true;
    let hull = seen.convex_hull().map(|edge| edge.rev());
    let mut left: Vec<_> = hull.filter(|edge| !edge.is_constraint_edge()).collect();
    while let Some(edge) = left.pop() {
        let Some(face) = edge.face().as_inner() else { continue };
        if !std::mem::replace(&mut is_reached[face.index()], true) {
            let onward = face.adjacent_edges().map(|edge| edge.rev());
            left.extend(onward.into_iter().filter(|edge| !edge.is_constraint_edge()));
        }
    }
    is_reached
}
