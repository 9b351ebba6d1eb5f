//! The inside of several loops in a coordinate plane, with holes, islands in them, and loops that meet in points or edges.

use glam::{DVec2, DVec3};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::insert::{Seen, in_rounds};
use super::view::is_in_range;
use crate::predicates::Arithmetic;
use base::error::Result;
use base::progress::{Pace, Progress};

/// Work of one insertion, in entries of a [`Pace`].
const INSERTION: usize = 64;

/// The constrained Delaunay triangulation of what lies left of `segments`, which go from point to point. Triangles turn counter-clockwise.
/// Segments that go both ways between two points are kept as edges, and both of their sides are inside or both outside. Points that no
/// segment uses become corners where they lie inside. `None` if two points lie at one place, if a segment crosses another or passes over a
/// point, if the segments bound no region, or if coordinates differ so much in size that no product of them can be had in doubles.
///
/// Signs are exact, so that no rounding decides what lies inside.
///
/// Cost: O(n log n) in practice, about 300 bytes per point. Fastest if neighbours in the list are neighbours in the plane.
///
/// # Errors
/// [`base::error::Error::Cancelled`].
pub fn region(points: &[DVec2], segments: &[[u32; 2]], progress: &Progress<'_>) -> Result<Option<Vec<[u32; 3]>>> {
    let (_, factor) = Arithmetic::of(points.iter().map(|p| DVec3::new(p.x, p.y, 0.0)));
    let mut pace = Pace::new(progress);
    let mut plane = ConstrainedDelaunayTriangulation::<Seen>::new();
    let mut handles = vec![None; points.len()];
    for id in in_rounds(points.len()) {
        pace.after(INSERTION)?;
        let at = points[id] * factor;
        if !at.to_array().into_iter().all(is_in_range) {
            return Ok(None);
        }
        let Ok(handle) = plane.insert(Seen { at: Point2::new(at.x, at.y), id: id as u32 }) else { return Ok(None) };
        handles[id] = Some(handle);
    }
    // One at the place of another takes it over.
    if plane.num_vertices() < points.len() {
        return Ok(None);
    }
    let Some(bounds) = Bounds::of(segments, progress)? else { return Ok(None) };
    for (ends, _) in &bounds.edges {
        pace.after(INSERTION)?;
        let [Some(from), Some(to)] = ends.map(|id| handles[id as usize]) else { return Ok(None) };
        // None across another segment. More than one over a point.
        if plane.try_add_constraint(from, to).len() != 1 {
            return Ok(None);
        }
    }
    let Some(is_inside) = insides(&plane, &bounds, &mut pace)? else { return Ok(None) };
    let id = |vertex: FixedVertexHandle| plane.vertex(vertex).data().id;
    let inner = plane.inner_faces().filter(|face| is_inside[face.index()]);
    Ok(Some(inner.map(|face| face.adjacent_edges().map(|edge| id(edge.from().fix()))).collect()))
}

/// Segments between the same points as one.
struct Bounds {
    /// The smaller number first, rising, with the segments that go this way less those that go back.
    edges: Vec<([u32; 2], i32)>,
}

impl Bounds {
    /// `None` if a segment has no length.
    fn of(segments: &[[u32; 2]], progress: &Progress<'_>) -> Result<Option<Self>> {
        let forward = |&[a, b]: &[u32; 2]| if a < b { ([a, b], 1) } else { ([b, a], -1) };
        let mut all: Vec<([u32; 2], i32)> = segments.iter().map(forward).collect();
        progress.sort(&mut all, &|a, b| a.cmp(b))?;
        all.dedup_by(|next, kept| {
            let is_same = next.0 == kept.0;
            kept.1 += if is_same { next.1 } else { 0 };
            is_same
        });
        let is_point = all.iter().any(|(ends, _)| ends[0] == ends[1]);
        Ok((!is_point).then_some(Bounds { edges: all }))
    }

    /// Segments from a point to another, less those back.
    fn net(&self, from: u32, to: u32) -> i32 {
        let found = self.edges.binary_search_by(|edge| edge.0.cmp(&[from.min(to), from.max(to)]));
        found.map_or(0, |at| if from < to { self.edges[at].1 } else { -self.edges[at].1 })
    }
}

/// Of each face whether it lies inside, by how often the segments go around it. `None` unless that is once or never.
fn insides(
    plane: &ConstrainedDelaunayTriangulation<Seen>,
    bounds: &Bounds,
    pace: &mut Pace<'_>,
) -> Result<Option<Vec<bool>>> {
    let mut turns: Vec<Option<i32>> = vec![None; plane.num_all_faces()];
    turns[plane.outer_face().index()] = Some(0);
    // Edges whose face is known, and whose other side may not be.
    let mut left: Vec<_> = plane.convex_hull().collect();
    while let Some(edge) = left.pop() {
        pace.after(4)?;
        let known = turns[edge.face().index()].expect("it was reached");
        let net = match edge.is_constraint_edge() {
            true => bounds.net(edge.from().data().id, edge.to().data().id),
            false => 0,
        };
        let beyond = known - net;
        match turns[edge.rev().face().index()] {
            Some(before) if before != beyond => return Ok(None),
            Some(_) => {}
            None => {
                turns[edge.rev().face().index()] = Some(beyond);
                if let Some(face) = edge.rev().face().as_inner() {
                    left.extend(face.adjacent_edges());
                }
            }
        }
    }
    if turns.iter().any(|turns| !matches!(turns, Some(0 | 1))) {
        return Ok(None);
    }
    Ok(Some(turns.iter().map(|turns| *turns == Some(1)).collect()))
}
