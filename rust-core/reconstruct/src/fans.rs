//! The triangles around each vertex, and where they do not form a single fan.

use std::cmp::Ordering;
use std::ops::Range;

use rayon::prelude::*;

use base::error::Result;
use base::progress::{Pace, Progress};
use base::work;

/// The triangles at each vertex of a list of triangles, for a range of vertices.
pub(super) struct Corners {
    vertices: Range<u32>,
    first: Vec<u32>,
    /// Three times the triangle plus the place of the vertex in it.
    corners: Vec<u32>,
}

impl Corners {
    pub(super) fn new(triangles: &[[u32; 3]], vertices: Range<u32>, progress: &Progress<'_>) -> Result<Self> {
        let mut first = vec![0_u32; vertices.len() + 2];
        for block in progress.blocks(triangles.as_flattened()) {
            for vertex in block?.iter().filter(|vertex| vertices.contains(vertex)) {
                first[(vertex - vertices.start) as usize + 2] += 1;
            }
        }
        for v in 2..first.len() {
            first[v] += first[v - 1];
        }
        let mut corners = vec![0; first[first.len() - 1] as usize];
        for range in progress.ranges(3 * triangles.len()) {
            for corner in range? {
                let vertex = triangles.as_flattened()[corner];
                if vertices.contains(&vertex) {
                    let place = &mut first[(vertex - vertices.start) as usize + 1];
                    corners[*place as usize] = corner as u32;
                    *place += 1;
                }
            }
        }
        Ok(Corners { vertices, first, corners })
    }

    pub(super) fn of(&self, vertex: u32) -> &[u32] {
        let place = (vertex - self.vertices.start) as usize;
        &self.corners[self.first[place] as usize..self.first[place + 1] as usize]
    }
}

/// Parts that the vertices are looked at in, which bounds the memory for their corners. Each takes a look at all triangles.
const RANGES: usize = 2;

/// The vertices at which the triangles are not one fan, in ascending order.
pub(super) fn pinched(triangles: &[[u32; 3]], vertices: usize, progress: &Progress<'_>) -> Result<Vec<u32>> {
    let together = vertices.div_ceil(RANGES) as u32;
    let mut found = Vec::new();
    for range in 0..RANGES as u32 {
        let range = (range * together).min(vertices as u32)..((range + 1) * together).min(vertices as u32);
        let corners = Corners::new(triangles, range.clone(), progress)?;
        let pinched = |&vertex: &u32| !is_one_fan(triangles, corners.of(vertex));
        for part in progress.ranges(range.len()) {
            let part = part?;
            let part = range.start + part.start as u32..range.start + part.end as u32;
            found.par_extend(part.into_par_iter().filter(pinched));
        }
    }
    Ok(found)
}

/// The two other vertices of a corner's triangle, in its turn.
pub(super) fn ends(triangles: &[[u32; 3]], corner: u32) -> [u32; 2] {
    let triangle = triangles[corner as usize / 3];
    let place = corner as usize % 3;
    [triangle[(place + 1) % 3], triangle[(place + 2) % 3]]
}

/// Triangles at a vertex that fit beside each other without an allocation. There are six on average.
const USUAL: usize = 16;

/// Whether the triangles at a vertex are one fan, open or closed, turning one way. Without triangles they are.
fn is_one_fan(triangles: &[[u32; 3]], corners: &[u32]) -> bool {
    let (mut few, mut many) = ([[0; 2]; 2 * USUAL], Vec::new());
    let edges = if corners.len() <= USUAL {
        &mut few[..2 * corners.len()]
    } else {
        many.resize(2 * corners.len(), [0; 2]);
        &mut many[..]
    };
    let (edges, turned) = edges.split_at_mut(corners.len());
    for ((edge, turned), &corner) in edges.iter_mut().zip(turned.iter_mut()).zip(corners) {
        let [from, to] = ends(triangles, corner);
        (*edge, *turned) = ([from, to], [to, from]);
    }
    turn_once(edges, turned)
}

/// Whether directed edges are one path, open or closed. `turned`: the same the other way. Sorts both.
fn turn_once(edges: &mut [[u32; 2]], turned: &mut [[u32; 2]]) -> bool {
    for edges in [&mut *edges, &mut *turned] {
        edges.sort_unstable_by(|a, b| {
            work::step();
            a.cmp(b)
        });
        if edges.windows(2).any(|pair| pair[0][0] == pair[1][0]) {
            return false;
        }
    }
    // Paths and circles, then: from where a path begins, or anywhere on a circle.
    let begins = |edge: &&[u32; 2]| turned.binary_search_by_key(&edge[0], |turned| turned[0]).is_err();
    let Some(&first) = edges.iter().find(begins).or(edges.first()) else { return true };
    let (mut count, mut end) = (1, first[1]);
    while let Ok(next) = edges.binary_search_by_key(&end, |edge| edge[0]) {
        work::step();
        if edges[next] == first {
            break;
        }
        (count, end) = (count + 1, edges[next][1]);
    }
    count == edges.len()
}

/// The fans at a vertex: over an edge of more than two triangles nothing is joined. Each as places in `corners`, in the
/// order of their first ones.
fn fans(triangles: &[[u32; 3]], corners: &[u32]) -> Vec<Vec<usize>> {
    // Each edge at the vertex with the places of its triangles, and whether it is where they begin or end.
    let mut edges: Vec<(u32, usize, usize)> = Vec::with_capacity(2 * corners.len());
    for (place, &corner) in corners.iter().enumerate() {
        let [from, to] = ends(triangles, corner);
        edges.extend([(from, place, 0), (to, place, 1)]);
    }
    edges.sort_unstable_by(|a, b| {
        work::step();
        a.cmp(b)
    });
    let mut beside = vec![[None; 2]; corners.len()];
    for edge in edges.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, a, side), (_, b, other)] = *edge
            && side != other
        {
            (beside[a][side], beside[b][other]) = (Some(b), Some(a));
        }
    }
    let mut fans = Vec::new();
    let mut is_taken = vec![false; corners.len()];
    for first in 0..corners.len() {
        if std::mem::replace(&mut is_taken[first], true) {
            continue;
        }
        let mut fan = vec![first];
        let mut next = 0;
        while next < fan.len() {
            work::step();
            for other in beside[fan[next]].into_iter().flatten() {
                if !std::mem::replace(&mut is_taken[other], true) {
                    fan.push(other);
                }
            }
            next += 1;
        }
        fans.push(fan);
    }
    fans
}

/// Removes triangles until those at each vertex are one fan. The largest fan stays. `key` orders triangles: of equally large fans the
/// smaller one stays, and of equal ones that with the first triangle. Returns how many were removed.
///
/// Cost: O(k log k) for a vertex of k triangles, again after each round in which it lost some.
pub(super) fn keep_largest(
    triangles: &mut Vec<[u32; 3]>,
    vertices: usize,
    key: impl Fn([u32; 3]) -> f64,
    progress: &Progress<'_>,
) -> Result<usize> {
    let mut suspects = pinched(triangles, vertices, progress)?;
    if suspects.is_empty() {
        return Ok(0);
    }
    let corners = Corners::new(triangles, 0..vertices as u32, progress)?;
    let mut pace = Pace::new(progress);
    let mut is_gone = vec![false; triangles.len()];
    let mut around = Vec::new();
    while !suspects.is_empty() {
        // The triangles that go in one round are decided by those that the one before left.
        let mut going = Vec::new();
        for vertex in suspects {
            around.clear();
            around.extend(corners.of(vertex).iter().filter(|&&corner| !is_gone[corner as usize / 3]));
            pace.after(around.len())?;
            if is_one_fan(triangles, &around) {
                continue;
            }
            let worth = |fan: Vec<usize>| {
                let mut keys: Vec<f64> = fan.iter().map(|&p| key(triangles[around[p] as usize / 3])).collect();
                keys.sort_unstable_by(f64::total_cmp);
                (keys, fan)
            };
            let mut fans: Vec<(Vec<f64>, Vec<usize>)> = fans(triangles, &around).into_iter().map(worth).collect();
            fans.sort_by(|(x, a), (y, b)| {
                b.len().cmp(&a.len()).then_with(|| x.partial_cmp(y).unwrap_or(Ordering::Equal))
            });
            going.extend(fans.iter().skip(1).flat_map(|(_, fan)| fan).map(|&place| around[place] as usize / 3));
        }
        going.iter().for_each(|&triangle| is_gone[triangle] = true);
        suspects = going.into_iter().flat_map(|triangle| triangles[triangle]).collect();
        suspects.sort_unstable();
        suspects.dedup();
    }
    let before = triangles.len();
    let mut is_gone = is_gone.into_iter();
    triangles.retain(|_| !is_gone.next().unwrap_or(false));
    Ok(before - triangles.len())
}

/// Whether triangles that form one fan at each vertex have no border. O(n).
pub(super) fn are_closed(triangles: &[[u32; 3]], vertices: usize) -> bool {
    // Around a vertex each edge cancels the next one; what an open fan begins and ends with is left.
    let mut left = vec![0_u32; vertices];
    for &[a, b, c] in triangles {
        for [vertex, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
            left[vertex as usize] = left[vertex as usize].wrapping_add(from).wrapping_sub(to);
        }
    }
    left.into_iter().all(|left| left == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two apexes over a ring of `around` vertices and, if there is a gap, without the triangles at one edge of it.
    fn double_cone(around: u32, has_gap: bool) -> Vec<[u32; 3]> {
        (0..around - u32::from(has_gap))
            .map(|i| [i, (i + 1) % around])
            .flat_map(|[a, b]| [[a, b, around], [b, a, around + 1]])
            .collect()
    }

    /// Parts found by comparing all triangles at a vertex with each other.
    fn parts(triangles: &[[u32; 3]], vertex: u32) -> Vec<Vec<usize>> {
        let at: Vec<usize> = (0..triangles.len()).filter(|&t| triangles[t].contains(&vertex)).collect();
        let edge = |t: usize, k: usize| {
            let place = triangles[t].iter().position(|&v| v == vertex).unwrap();
            triangles[t][(place + 1 + k) % 3]
        };
        let uses = |v: u32| at.iter().filter(|&&t| triangles[t].contains(&v)).count();
        let joined = |a: usize, b: usize| (0..2).any(|k| edge(a, k) == edge(b, 1 - k) && uses(edge(a, k)) == 2);
        let mut parts: Vec<Vec<usize>> = Vec::new();
        for &t in &at {
            let (with, without): (Vec<_>, Vec<_>) =
                parts.into_iter().partition(|part| part.iter().any(|&other| joined(t, other)));
            parts = without;
            parts.push(with.into_iter().flatten().chain([t]).collect());
        }
        parts.iter_mut().for_each(|part| part.sort_unstable());
        parts.sort_unstable();
        parts
    }

    proptest::proptest! {
        #[test]
        fn fans_are_what_comparing_all_triangles_finds(
            edges in proptest::collection::vec([0..24_u32, 1..24_u32], 0..30),
        ) {
            let triangles: Vec<[u32; 3]> = edges.iter().map(|&[a, step]| [a, (a + step) % 24, 24]).collect();
            let corners = Corners::new(&triangles, 24..25, &Progress::none()).unwrap();
            let mut found: Vec<Vec<usize>> = fans(&triangles, corners.of(24));
            found.iter_mut().for_each(|fan| fan.sort_unstable());
            found.sort_unstable();
            let parts = parts(&triangles, 24);
            // A fan goes through each of its ends once.
            let ends = |k: usize| triangles.iter().map(|t| t[k]).collect::<std::collections::BTreeSet<_>>().len();
            let is_one = parts.len() <= 1 && ends(0) == triangles.len() && ends(1) == triangles.len();
            proptest::prop_assert_eq!(found, parts);
            proptest::prop_assert_eq!(is_one_fan(&triangles, corners.of(24)), is_one);
        }
    }

    #[test]
    fn a_vertex_of_many_triangles_takes_little_more_work_than_as_many_vertices() {
        let work = |around: u32| {
            // Two double cones with a gap share an apex: two fans of many triangles.
            let mut triangles = double_cone(around, true);
            triangles.extend(
                double_cone(around, true).iter().map(|t| t.map(|v| if v == around { v } else { v + around + 2 })),
            );
            let (left, steps) = work::counted(|| {
                let vertices = 2 * around as usize + 4;
                keep_largest(&mut triangles, vertices, |t| f64::from(t[0].min(t[1])), &Progress::none()).unwrap();
                triangles.len()
            });
            assert!(left >= 3 * (around as usize - 1), "{left}");
            steps
        };
        let (one, two) = (work(2_000), work(4_000));
        assert!(one > 2_000 && 10 * two <= 23 * one, "{one} {two}");
    }

    #[test]
    fn closed_is_what_has_no_border() {
        assert!(are_closed(&double_cone(9, false), 11) && !are_closed(&double_cone(9, true), 11));
        assert!(are_closed(&[], 3) && !are_closed(&[[0, 1, 2]], 3));
    }
}
