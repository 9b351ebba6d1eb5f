//! Bridges over the gap between the measured border and the fill: quadrilaterals from an edge of one to an edge of the other.
//!
//! Between two bridges a gap is a short simple loop, which hole filling closes. A bridge between two loops makes them one. A bridge within
//! a loop makes two of it. Loops are joined once only: a second bridge between loops that were joined would add a handle. A bridge has no
//! edge that the surface has already: that edge would have three faces.

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use base::error::Result;
use base::progress::{Pace, Progress};

use super::rows::NONE;
use super::surface::normal;

/// Longest distance between the middles of bridged edges, in cells: the gap is about one wide.
const REACH: f64 = 2.5;
/// Two measured borders that face each other over nothing wider than this, in cells, are bridged directly.
const SLIT: f64 = 1.25;
/// Least cosine between the normals on both sides.
const SAME_SIDE: f64 = 0.2;
/// Least cosine between an edge reversed and the other one.
const PARALLEL: f64 = 0.4;
/// Least cosine between the way over the gap and the way out of a triangle over its edge.
const FACING: f64 = 0.2;

/// A border edge.
#[derive(Clone, Copy, Debug)]
struct Edge {
    from: u32,
    to: u32,
    middle: DVec3,
    along: DVec3,
    normal: DVec3,
    is_measured: bool,
}

impl Edge {
    /// Away from its triangle.
    fn out(&self) -> DVec3 {
        self.along.cross(self.normal)
    }
}

/// Edges that may be bridged.
struct Candidate {
    length: f64,
    edges: [u32; 2],
}

/// Returns triangles that bridge the gaps between `triangles`. `border` are their border's edges, each with its triangle. Vertices below
/// `measured` are those of the measured surface. Every border vertex has to lie on one loop, once.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn gaps(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    border: &[([u32; 2], [u32; 3])],
    measured: u32,
    cell: f64,
    progress: &Progress<'_>,
) -> Result<Vec<[u32; 3]>> {
    let edges: Vec<Edge> = border.iter().map(|&(ends, triangle)| edge(positions, ends, triangle, measured)).collect();
    let mut loops = Loops::new(positions.len(), &edges);
    let taken = between(triangles, |v| loops.is_on_border(v), progress)?;
    let mut bridges = Vec::new();
    let mut is_used = vec![false; positions.len()];
    let mut pace = Pace::new(progress);
    for candidate in candidates(&edges, &loops, cell, progress)? {
        pace.after(16)?;
        let [e, g] = candidate.edges.map(|i| edges[i as usize]);
        let ends = [e.from, e.to, g.from, g.to];
        if ends.iter().any(|&v| is_used[v as usize]) || !loops.may_join(e.from, g.from) {
            continue;
        }
        let Some(quad) = span(positions, &e, &g, &taken) else { continue };
        ends.iter().for_each(|&v| is_used[v as usize] = true);
        pace.after(loops.bridge(&e, &g))?;
        bridges.extend(quad);
    }
    Ok(bridges)
}

fn edge(positions: &[DVec3], [from, to]: [u32; 2], triangle: [u32; 3], measured: u32) -> Edge {
    let (a, b) = (positions[from as usize], positions[to as usize]);
    Edge {
        from,
        to,
        middle: 0.5 * (a + b),
        along: (b - a).normalize_or_zero(),
        normal: normal(triangle.map(|v| positions[v as usize])),
        is_measured: from < measured,
    }
}

/// Pairs of edges that face each other, the nearest first.
fn candidates(edges: &[Edge], loops: &Loops, cell: f64, progress: &Progress<'_>) -> Result<Vec<Candidate>> {
    let reach = REACH * cell;
    let bin = |p: DVec3| (p / reach).floor().to_array().map(|x| x as i64);
    let mut bins: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
    for (i, edge) in edges.iter().enumerate() {
        bins.entry(bin(edge.middle)).or_default().push(i as u32);
    }
    let mut pace = Pace::new(progress);
    let mut found = Vec::new();
    for (i, e) in edges.iter().enumerate() {
        let at = bin(e.middle);
        for beside in 0..27 {
            let place = [at[0] + beside % 3 - 1, at[1] + beside / 3 % 3 - 1, at[2] + beside / 9 - 1];
            for &j in bins.get(&place).into_iter().flatten() {
                pace.after(4)?;
                let g = &edges[j as usize];
                let is_slit = e.is_measured && g.is_measured && loops.first(e.from) != loops.first(g.from);
                if j as usize <= i || !(e.is_measured != g.is_measured || is_slit) {
                    continue;
                }
                let way = g.middle - e.middle;
                let distance = way.length();
                let is_facing = e.out().dot(way) > FACING * distance && g.out().dot(-way) > FACING * distance;
                let is_near = distance < if is_slit { SLIT * cell } else { reach };
                if is_near && is_facing && e.normal.dot(g.normal) > SAME_SIDE && -e.along.dot(g.along) > PARALLEL {
                    found.push(Candidate { length: distance, edges: [i as u32, j] });
                }
            }
        }
    }
    progress.sort(&mut found, &|a, b| a.length.total_cmp(&b.length).then(a.edges.cmp(&b.edges)))?;
    Ok(found)
}

/// Edges both of whose ends are asked for, the smaller number first.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn between(
    triangles: &[[u32; 3]],
    is_asked: impl Fn(u32) -> bool,
    progress: &Progress<'_>,
) -> Result<FxHashSet<[u32; 2]>> {
    let mut pace = Pace::new(progress);
    let mut found = FxHashSet::default();
    for &[a, b, c] in triangles {
        pace.after(4)?;
        let both = |&[from, to]: &[u32; 2]| is_asked(from) && is_asked(to);
        found.extend([[a, b], [b, c], [c, a]].iter().filter(|edge| both(edge)).map(|&[a, b]| [a.min(b), a.max(b)]));
    }
    Ok(found)
}

/// The two triangles of a bridge, over the diagonal that bends it less. `None` if it would fold, or had an edge that is taken.
fn span(positions: &[DVec3], e: &Edge, g: &Edge, taken: &FxHashSet<[u32; 2]>) -> Option<[[u32; 3]; 2]> {
    let [a, b, c, d] = [e.from, e.to, g.from, g.to];
    let is_taken = |a: u32, b: u32| taken.contains(&[a.min(b), a.max(b)]);
    if is_taken(a, d) || is_taken(b, c) {
        return None;
    }
    let up = e.normal + g.normal;
    let straight = |t: [u32; 3]| normal(t.map(|v| positions[v as usize])).dot(up) / up.length();
    let ways = [[[b, a, d], [b, d, c]], [[b, a, c], [a, d, c]]];
    let diagonals = [is_taken(b, d), is_taken(a, c)];
    let [first, second] = [0, 1].map(|i| match diagonals[i] {
        true => f64::NEG_INFINITY,
        false => straight(ways[i][0]).min(straight(ways[i][1])),
    });
    let (way, least) = if first >= second { (ways[0], first) } else { (ways[1], second) };
    (least > SAME_SIDE).then_some(way)
}

/// The loops of the border, while bridges change them.
struct Loops {
    /// Vertex after each border vertex, [`NONE`] for others.
    next: Vec<u32>,
    /// A number for the loop that each vertex lies on now.
    now: Vec<u32>,
    /// The loop it lay on at first.
    first: Vec<u32>,
    /// Loops that were joined, as a forest.
    joined: Vec<u32>,
    count: u32,
}

impl Loops {
    fn new(vertices: usize, edges: &[Edge]) -> Self {
        let mut next = vec![NONE; vertices];
        edges.iter().for_each(|edge| next[edge.from as usize] = edge.to);
        let mut loops = Loops { next, now: vec![NONE; vertices], first: Vec::new(), joined: Vec::new(), count: 0 };
        for edge in edges {
            if loops.now[edge.from as usize] == NONE {
                loops.number(edge.from);
            }
        }
        loops.first = loops.now.clone();
        loops.joined = (0..loops.count).collect();
        loops
    }

    /// Gives the loop through a vertex a new number. Returns its length.
    fn number(&mut self, vertex: u32) -> usize {
        let (mut at, mut length) = (vertex, 0);
        while at != NONE && self.now[at as usize] != self.count {
            self.now[at as usize] = self.count;
            at = self.next[at as usize];
            length += 1;
        }
        self.count += 1;
        length
    }

    fn is_on_border(&self, vertex: u32) -> bool {
        self.next[vertex as usize] != NONE
    }

    fn first(&self, vertex: u32) -> u32 {
        self.first[vertex as usize]
    }

    fn root(&self, mut number: u32) -> u32 {
        while self.joined[number as usize] != number {
            number = self.joined[number as usize];
        }
        number
    }

    fn may_join(&self, a: u32, b: u32) -> bool {
        self.now[a as usize] == self.now[b as usize] || self.root(self.first(a)) != self.root(self.first(b))
    }

    /// Returns the vertices walked over.
    fn bridge(&mut self, e: &Edge, g: &Edge) -> usize {
        let [a, b] = [self.root(self.first(e.from)), self.root(self.first(g.from))];
        self.joined[a.max(b) as usize] = a.min(b);
        self.next[e.from as usize] = g.to;
        self.next[g.from as usize] = e.to;
        let length = self.number(e.from);
        if self.now[g.from as usize] + 1 == self.count { length } else { length + self.number(g.from) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet with two triangular holes above each other. Between them a strip dips, whose left end is the edge from 0 to 5. The lower
    /// side of the one and the upper side of the other face each other over the dip, as over a slit.
    fn dip() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let places = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 0.4, -1.0],
            [1.0, 0.6, -1.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [-1.0, -1.0, 0.0],
            [2.0, -1.0, 0.0],
            [2.0, 2.0, 0.0],
            [-1.0, 2.0, 0.0],
        ];
        let strip = [[0, 2, 3], [0, 3, 5]];
        let around = [[0, 5, 9], [0, 9, 6], [1, 0, 6], [1, 6, 7], [2, 1, 7], [3, 2, 7]];
        let beyond = [[3, 7, 8], [4, 3, 8], [5, 4, 8], [5, 8, 9]];
        (places.map(DVec3::from).to_vec(), [&strip[..], &around, &beyond].concat())
    }

    /// An edge and the triangle that it is a side of.
    type Side = ([u32; 2], [u32; 3]);

    /// The border with its triangles, and the most faces of an edge, counted over all pairs of corners.
    fn sides(triangles: &[[u32; 3]]) -> (Vec<Side>, usize) {
        let all: Vec<Side> = triangles.iter().flat_map(|&t| (0..3).map(move |k| ([t[k], t[(k + 1) % 3]], t))).collect();
        let faces = |edge: [u32; 2]| triangles.iter().filter(|t| edge.iter().all(|v| t.contains(v))).count();
        let most = all.iter().map(|side| faces(side.0)).max().unwrap_or(0);
        (all.into_iter().filter(|side| faces(side.0) == 1).collect(), most)
    }

    #[test]
    fn a_bridge_has_no_edge_that_the_surface_has() {
        let (positions, triangles) = dip();
        let (border, most) = sides(&triangles);
        assert_eq!((border.len(), most), (10, 2));
        let with_bridges = |triangles: &[[u32; 3]]| {
            let (border, _) = sides(triangles);
            let bridges = gaps(&positions, triangles, &border, 10, 1.0, &Progress::none()).unwrap();
            (bridges.len(), sides(&[triangles, &bridges].concat()).1)
        };
        assert_eq!(with_bridges(&triangles), (0, 2));
        // Without the strip and the left side the two face each other over an open gap of two parts.
        let apart: Vec<[u32; 3]> = vec![[1, 0, 6], [5, 4, 8]];
        assert_eq!(with_bridges(&apart), (2, 2));
    }
}
