//! The triangulation of what is seen of the points: Delaunay there.

use glam::DVec3;
use spade::handles::FixedVertexHandle;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

use super::triangulation::{Delaunay2, OUTSIDE};
use super::view::View;
use base::error::{Error, Result};
use base::progress::Progress;

/// Points that may be inserted between two looks at whether to go on.
const TICK: usize = 256;
/// Each round inserts so many times the points of the one before, spread over the whole plane: so that new points fall into
/// small triangles.
const GROWTH: usize = 4;

/// A point as it is seen, with its place in the list.
pub(super) struct Seen {
    pub(super) at: Point2<f64>,
    pub(super) id: u32,
}

impl HasPosition for Seen {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

pub(super) fn triangulate(points: &[DVec3], view: &View, progress: &Progress<'_>) -> Result<Delaunay2> {
    let count = points.len();
    let mut seen = DelaunayTriangulation::<Seen>::with_capacity(count, 3 * count, 2 * count);
    for (done, id) in in_rounds(count).enumerate() {
        if done % TICK == 0 {
            progress.advance(if done == 0 { 0 } else { TICK as u64 })?;
        }
        let at = view.seen(points[id]);
        let inserted = seen.insert(Seen { at: Point2::new(at.x, at.y), id: id as u32 });
        inserted.map_err(|problem| Error::input(format!("point {id} can't be triangulated: {problem}")))?;
    }
    read(&seen, progress)
}

/// `0..count`, the coarsest round first.
pub(super) fn in_rounds(count: usize) -> impl Iterator<Item = usize> {
    let strides =
        std::iter::successors(Some(1), |&stride| Some(stride * GROWTH)).take_while(move |&s| s < count.max(2));
    let strides: Vec<usize> = strides.collect();
    let coarsest = strides.len() - 1;
    (0..=coarsest).rev().flat_map(move |round| {
        let stride = strides[round];
        let is_new = move |i: &usize| round == coarsest || !(i / stride).is_multiple_of(GROWTH);
        (0..count).step_by(stride).filter(is_new)
    })
}

fn read(seen: &DelaunayTriangulation<Seen>, progress: &Progress<'_>) -> Result<Delaunay2> {
    let id = |vertex: FixedVertexHandle| seen.vertex(vertex).data().id;
    let mut made = Delaunay2 {
        triangles: Vec::with_capacity(seen.num_inner_faces()),
        neighbours: Vec::with_capacity(seen.num_inner_faces()),
    };
    for (i, face) in seen.inner_faces().enumerate() {
        if i % TICK == 0 {
            progress.check()?;
        }
        let edges = face.adjacent_edges();
        made.triangles.push(edges.map(|edge| id(edge.from().fix())));
        // Face 0 is the outer one. Opposite to a corner lies the edge after the next.
        let beyond = edges.map(|edge| (edge.rev().face().fix().index() as u32).wrapping_sub(1));
        made.neighbours.push([beyond[1], beyond[2], beyond[0]]);
    }
    debug_assert_eq!(OUTSIDE, 0_u32.wrapping_sub(1));
    Ok(made)
}
