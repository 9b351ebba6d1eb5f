//! Boundary half-edges -> loops, and which of them are closed.

use glam::DVec3;
use rustc_hash::FxHashMap;

/// Reasons why a boundary loop was left open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HoleReason {
    /// Longer than the limit.
    TooLong,
    /// Not a simple loop: a vertex lies on it twice or on two loops, or it has only two edges.
    NotSimple,
    /// Any fill would meet the surface or another fill, or have an edge that is too short.
    Crossing,
}

/// A boundary loop that was left open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenLoop {
    /// One of its vertices: the one of the smallest index.
    pub vertex: u32,
    /// Number of edges.
    pub edges: usize,
    /// Sum of the edges' lengths.
    pub length: f64,
    /// Reason why it was left open.
    pub reason: HoleReason,
}

/// A closed chain of boundary edges.
pub(super) struct EdgeLoop {
    /// Its vertices in the direction in which a fill's triangles run through its edges, the smallest first.
    pub vertices: Vec<u32>,
    /// Whether no vertex lies on it twice or on another loop too, and it has at least three edges.
    pub is_simple: bool,
}

impl EdgeLoop {
    /// Sum of the edges' lengths.
    pub fn length(&self, at: impl Fn(u32) -> DVec3) -> f64 {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().zip(next).map(|(&a, &b)| at(a).distance(at(b))).sum()
    }

    pub fn left_open(&self, length: f64, reason: HoleReason) -> OpenLoop {
        OpenLoop { vertex: self.vertices[0], edges: self.vertices.len(), length, reason }
    }
}

/// The loops in the order of their smallest vertices. Chains that don't close (a boundary that isn't one) are left out.
pub(super) fn trace(boundary: &[[u32; 2]]) -> Vec<EdgeLoop> {
    // A fill runs through a boundary edge in the other direction than the mesh.
    let mut edges: Vec<[u32; 2]> = boundary.iter().map(|&[from, to]| [to, from]).collect();
    edges.sort_unstable();
    let leaving = |v: u32| edges.partition_point(|e| e[0] < v);
    let branches = |v: u32| edges.get(leaving(v) + 1).is_some_and(|e| e[0] == v);
    let mut used = vec![false; edges.len()];
    let mut loops = Vec::new();
    for first in 0..edges.len() {
        if used[first] {
            continue;
        }
        let (mut vertices, mut is_simple, mut edge) = (Vec::new(), true, first);
        let closes = loop {
            used[edge] = true;
            let [from, to] = edges[edge];
            vertices.push(from);
            is_simple &= !branches(from);
            if to == edges[first][0] {
                break true;
            }
            let next = (leaving(to)..edges.len()).take_while(|&e| edges[e][0] == to).find(|&e| !used[e]);
            match next {
                Some(next) => edge = next,
                None => break false,
            }
        };
        if closes {
            is_simple &= vertices.len() >= 3;
            loops.push(EdgeLoop { vertices, is_simple });
        }
    }
    loops
}

/// The vertex after each vertex of a boundary.
pub fn successors(boundary: &[[u32; 2]]) -> FxHashMap<u32, u32> {
    boundary.iter().map(|&[a, b]| (a, b)).collect()
}

/// The sides of the loop through a vertex.
pub fn walk(first: u32, next: &FxHashMap<u32, u32>) -> Vec<[u32; 2]> {
    let mut sides = Vec::new();
    let mut at = first;
    while let Some(&to) = next.get(&at) {
        sides.push([at, to]);
        at = to;
        if at == first || sides.len() > next.len() {
            break;
        }
    }
    sides
}

/// The loops of a boundary that are to be closed, by their vertices, and those that stay open. Both in the order of their smallest
/// vertices. As in [`close`](super::close). `place` gives the places of vertices.
pub fn sort_out(
    boundary: &[[u32; 2]],
    place: impl Fn(u32) -> DVec3,
    mut limit: impl FnMut(&[u32]) -> f64,
) -> (Vec<Vec<u32>>, Vec<OpenLoop>) {
    let (mut holes, mut open) = (Vec::new(), Vec::new());
    for edge_loop in trace(boundary) {
        let length = edge_loop.length(&place);
        let reason = if !edge_loop.is_simple {
            HoleReason::NotSimple
        } else if length <= limit(&edge_loop.vertices) {
            holes.push(edge_loop.vertices);
            continue;
        } else {
            HoleReason::TooLong
        };
        open.push(edge_loop.left_open(length, reason));
    }
    (holes, open)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loops_run_against_the_boundary_from_their_smallest_vertex() {
        let loops = trace(&[[7, 3], [3, 9], [1, 2], [9, 7], [2, 5], [5, 1]]);
        let vertices: Vec<_> = loops.iter().map(|l| l.vertices.clone()).collect();
        assert_eq!(vertices, [vec![1, 5, 2], vec![3, 7, 9]]);
        assert!(loops.iter().all(|l| l.is_simple));
    }

    #[test]
    fn branching_two_edged_and_unclosed_chains_are_no_simple_loops() {
        // Two triangles that meet in vertex 2.
        let eight = trace(&[[0, 1], [1, 2], [2, 0], [2, 3], [3, 4], [4, 2]]);
        assert!(!eight.is_empty() && eight.iter().all(|l| !l.is_simple));
        assert!(!trace(&[[0, 1], [1, 0]])[0].is_simple);
        assert!(trace(&[[0, 1], [1, 2]]).is_empty());
        assert!(!trace(&[[4, 4]])[0].is_simple);
        assert!(trace(&[]).is_empty());
    }
}
