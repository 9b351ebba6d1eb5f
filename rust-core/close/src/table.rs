//! The faces of a level set in a cell, by which of its corners are inside: 256 cases, made once.
//!
//! On a face of a cell with two inside corners across from each other the outside is joined, in both cells of the face, so that the surface
//! is closed. No two vertices of a face of a cell are joined by an edge inside it, so that no edge belongs to more than two triangles.

use std::sync::LazyLock;

/// The edges of a cell: its first corner and the axis along which it runs.
pub const EDGES: [(usize, usize); 12] = {
    let mut edges = [(0, 0); 12];
    let (mut axis, mut count) = (0, 0);
    while axis < 3 {
        let mut corner = 0;
        while corner < 8 {
            if corner >> axis & 1 == 0 {
                edges[count] = (corner, axis);
                count += 1;
            }
            corner += 1;
        }
        axis += 1;
    }
    edges
};

/// A corner of a triangle that is no edge of the cell: the mean of the polygon's vertices.
pub const MIDDLE: u8 = 12;

/// One polygon of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Polygon {
    /// Edges of the cell that it has vertices on, counter-clockwise seen from outside.
    pub vertices: Vec<u8>,
    /// Edges of the cell, or [`MIDDLE`].
    pub triangles: Vec<[u8; 3]>,
}

/// Polygons by the case: bit `c` is set if corner `c` is inside.
pub static CASES: LazyLock<Vec<Vec<Polygon>>> = LazyLock::new(|| (0..256).map(polygons).collect());

/// The four corners around a face, counter-clockwise seen from outside of the cell.
fn face(axis: usize, far: usize) -> [usize; 4] {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let base = far << axis;
    let around = [base, base | 1 << u, base | 1 << u | 1 << v, base | 1 << v];
    if far == 1 { around } else { [around[0], around[3], around[2], around[1]] }
}

fn edge_between(a: usize, b: usize) -> u8 {
    let axis = (a ^ b).trailing_zeros() as usize;
    let found = EDGES.iter().position(|&edge| edge == (a & b, axis));
    found.expect("corners beside each other have an edge") as u8
}

fn polygons(case: usize) -> Vec<Polygon> {
    let is_inside = |corner: usize| case >> corner & 1 == 1;
    // On each face a segment leads from where the walk around it last entered the inside to where it leaves: so inside corners
    // across from each other stay apart. Seen from outside of the surface polygons turn counter-clockwise.
    let mut next = [MIDDLE; 12];
    for axis in 0..3 {
        for far in 0..2 {
            let around = face(axis, far);
            for i in 0..4 {
                let (a, b) = (around[i], around[(i + 1) % 4]);
                if is_inside(a) && !is_inside(b) {
                    let entered = (1..4).map(|back| (i + 4 - back) % 4).find(|&j| !is_inside(around[j]));
                    let j = entered.expect("one is outside");
                    next[edge_between(around[j], around[(j + 1) % 4]) as usize] = edge_between(a, b);
                }
            }
        }
    }
    let mut polygons = Vec::new();
    for first in 0..12 {
        let mut vertices = Vec::new();
        let mut at = first;
        while next[at] != MIDDLE {
            vertices.push(at as u8);
            at = std::mem::replace(&mut next[at], MIDDLE) as usize;
        }
        if !vertices.is_empty() {
            polygons.push(Polygon { triangles: triangles(&vertices), vertices });
        }
    }
    polygons
}

/// Faces of the cell on which an edge lies, as bits.
fn faces_of(edge: u8) -> u8 {
    let (corner, along) = EDGES[edge as usize];
    (0..3).filter(|&axis| axis != along).fold(0, |bits, axis| bits | 1 << (2 * axis + (corner >> axis & 1)))
}

/// A fan from the first vertex whose chords leave all faces of the cell, or one around the middle.
fn triangles(vertices: &[u8]) -> Vec<[u8; 3]> {
    let n = vertices.len();
    let is_free = |apex: usize| (2..n - 1).all(|k| faces_of(vertices[apex]) & faces_of(vertices[(apex + k) % n]) == 0);
    match (0..n).find(|&apex| is_free(apex)) {
        Some(apex) => {
            (1..n - 1).map(|k| [vertices[apex], vertices[(apex + k) % n], vertices[(apex + k + 1) % n]]).collect()
        }
        None => (0..n).map(|k| [MIDDLE, vertices[k], vertices[(k + 1) % n]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygons_use_the_crossed_edges_once_each() {
        for (case, polygons) in CASES.iter().enumerate() {
            let mut used: Vec<u8> = polygons.iter().flat_map(|p| p.vertices.clone()).collect();
            used.sort_unstable();
            let inside = |corner: usize| case >> corner & 1 == 1;
            let crossed = (0..12u8).filter(|&e| {
                let (corner, axis) = EDGES[e as usize];
                inside(corner) != inside(corner | 1 << axis)
            });
            assert_eq!(used, crossed.collect::<Vec<u8>>(), "{case}");
            assert!(polygons.iter().all(|p| p.vertices.len() >= 3), "{case}");
        }
    }

    #[test]
    fn chords_leave_the_faces() {
        for polygon in CASES.iter().flatten() {
            let n = polygon.vertices.len();
            let place = |e: u8| polygon.vertices.iter().position(|&v| v == e);
            for triangle in &polygon.triangles {
                for k in 0..3 {
                    let (Some(a), Some(b)) = (place(triangle[k]), place(triangle[(k + 1) % 3])) else { continue };
                    let is_side = (a + 1) % n == b || (b + 1) % n == a;
                    assert!(is_side || faces_of(triangle[k]) & faces_of(triangle[(k + 1) % 3]) == 0, "{polygon:?}");
                }
            }
        }
    }
}
