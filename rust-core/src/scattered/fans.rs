//! The triangles around each vertex, and where they do not form a single fan.

use std::ops::Range;

use rayon::prelude::*;

/// The triangles at each vertex of a list of triangles, for a range of vertices.
struct Corners {
    vertices: Range<u32>,
    first: Vec<u32>,
    /// Three times the triangle plus the place of the vertex in it.
    corners: Vec<u32>,
}

impl Corners {
    fn new(triangles: &[[u32; 3]], vertices: Range<u32>) -> Self {
        let mut first = vec![0_u32; vertices.len() + 2];
        for vertex in triangles.as_flattened().iter().filter(|vertex| vertices.contains(vertex)) {
            first[(vertex - vertices.start) as usize + 2] += 1;
        }
        for v in 2..first.len() {
            first[v] += first[v - 1];
        }
        let mut corners = vec![0; first[first.len() - 1] as usize];
        for (corner, vertex) in triangles.as_flattened().iter().enumerate() {
            if vertices.contains(vertex) {
                let place = &mut first[(vertex - vertices.start) as usize + 1];
                corners[*place as usize] = corner as u32;
                *place += 1;
            }
        }
        Corners { vertices, first, corners }
    }

    fn of(&self, vertex: u32) -> &[u32] {
        let place = (vertex - self.vertices.start) as usize;
        &self.corners[self.first[place] as usize..self.first[place + 1] as usize]
    }
}

/// Parts that the vertices are looked at in, which bounds the memory for their corners; each takes a look at all triangles.
const RANGES: usize = 2;

/// The vertices at which the triangles are not one fan, in ascending order.
pub(super) fn pinched(triangles: &[[u32; 3]], vertices: usize) -> Vec<u32> {
    let together = vertices.div_ceil(RANGES) as u32;
    let mut found = Vec::new();
    for range in 0..RANGES as u32 {
        let range = (range * together).min(vertices as u32)..((range + 1) * together).min(vertices as u32);
        let corners = Corners::new(triangles, range.clone());
        found.par_extend(range.into_par_iter().filter(|&vertex| !is_one_fan(triangles, corners.of(vertex))));
    }
    found
}

/// The two other vertices of a corner's triangle, in its turn.
fn ends(triangles: &[[u32; 3]], corner: u32) -> [u32; 2] {
    let triangle = triangles[corner as usize / 3];
    let place = corner as usize % 3;
    [triangle[(place + 1) % 3], triangle[(place + 2) % 3]]
}

/// Triangles at a vertex that fit beside each other without an allocation; there are six on average.
const USUAL: usize = 16;

/// Whether the triangles at a vertex are one fan, open or closed, turning one way. Without triangles they are.
fn is_one_fan(triangles: &[[u32; 3]], corners: &[u32]) -> bool {
    if corners.len() > USUAL {
        return turn_once(&corners.iter().map(|&corner| ends(triangles, corner)).collect::<Vec<_>>());
    }
    let mut around = [[0; 2]; USUAL];
    for (to, &corner) in around.iter_mut().zip(corners) {
        *to = ends(triangles, corner);
    }
    turn_once(&around[..corners.len()])
}

/// Whether directed edges are one path, open or closed.
fn turn_once(edges: &[[u32; 2]]) -> bool {
    let Some(&first) = edges.first() else { return true };
    for (i, one) in edges.iter().enumerate() {
        if edges[..i].iter().any(|other| one[0] == other[0] || one[1] == other[1]) {
            return false;
        }
    }
    let mut count = 1;
    let mut end = first[1];
    while let Some(next) = edges.iter().find(|edge| edge[0] == end) {
        if *next == first {
            return count == edges.len();
        }
        end = next[1];
        count += 1;
    }
    let mut start = first[0];
    while let Some(previous) = edges.iter().find(|edge| edge[1] == start) {
        start = previous[0];
        count += 1;
    }
    count == edges.len()
}

/// The fans at a vertex: over an edge of more than two triangles nothing is joined. Each as places in `corners`, the
/// largest first.
fn fans(triangles: &[[u32; 3]], corners: &[u32]) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let at = |place: usize| ends(triangles, corners[place]);
    let joins = |edge: u32, a: usize, b: usize| {
        let at_edge = (0..corners.len()).filter(|&p| at(p).contains(&edge)).count();
        at_edge == 2 && ((at(a)[0] == edge && at(b)[1] == edge) || (at(a)[1] == edge && at(b)[0] == edge))
    };
    let mut fans: Vec<Vec<usize>> = Vec::new();
    while !left.is_empty() {
        let mut fan = vec![left.remove(0)];
        let mut next = 0;
        while next < fan.len() {
            let here = fan[next];
            next += 1;
            left.retain(|&other| {
                let joined = at(here).into_iter().any(|edge| joins(edge, here, other));
                if joined {
                    fan.push(other);
                }
                !joined
            });
        }
        fans.push(fan);
    }
    fans.sort_by_key(|fan| std::cmp::Reverse(fan.len()));
    fans
}

/// Removes triangles until those at each vertex are one fan; `key` orders triangles where fans are equally large, the
/// smaller stays. Returns how many were removed.
pub(super) fn keep_largest(triangles: &mut Vec<[u32; 3]>, vertices: usize, key: impl Fn([u32; 3]) -> f64) -> usize {
    let before = triangles.len();
    loop {
        let pinched = pinched(triangles, vertices);
        if pinched.is_empty() {
            return before - triangles.len();
        }
        let corners = Corners::new(triangles, 0..vertices as u32);
        let mut removed = vec![false; triangles.len()];
        for vertex in pinched {
            let around = corners.of(vertex);
            let mut fans = fans(triangles, around);
            let worth = |fan: &Vec<usize>| {
                let mut keys: Vec<f64> = fan.iter().map(|&p| key(triangles[around[p] as usize / 3])).collect();
                keys.sort_unstable_by(f64::total_cmp);
                keys
            };
            fans.sort_by(|a, b| {
                let (x, y) = (worth(a), worth(b));
                b.len().cmp(&a.len()).then_with(|| x.partial_cmp(&y).unwrap_or(std::cmp::Ordering::Equal))
            });
            for place in fans.iter().skip(1).flatten() {
                removed[around[*place] as usize / 3] = true;
            }
        }
        let mut index = 0;
        triangles.retain(|_| {
            index += 1;
            !removed[index - 1]
        });
    }
}
