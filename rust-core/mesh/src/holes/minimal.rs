//! Loop -> triangulation without new vertices: of least bend, then of least area. \[Lie03, sec. 3\]
//!
//! The bend of a triangulation is its largest angle between the normals of neighbouring triangles, those of the mesh around it included. A
//! hole over a ridge gets a ridge, and a fill never folds back over the mesh if it need not. Best triangulations of all sub-chains i..j are
//! built up from shorter ones: O(n^3) time, O(n^2) memory.

use std::collections::BTreeSet;

use glam::DVec3;

use super::flat;
use base::error::Result;
use base::progress::Progress;

/// Loops of more edges are cut along chords into ones of at most as many, which takes 150^3 / 6 steps or a few milliseconds.
pub(super) const LARGEST: usize = 150;

/// Chords are looked for among at most this many vertices of a loop.
const CHORD_ENDS: usize = 1000;

/// A loop to triangulate.
pub(super) struct Loop<'a> {
    /// Its vertices.
    pub points: &'a [DVec3],
    /// Unit normal of the mesh's triangle at the edge from vertex i to the next, if it has one.
    pub outside: &'a [Option<DVec3>],
    /// Pairs of vertices, smaller index first, that must not be connected.
    pub taken: &'a BTreeSet<[u32; 2]>,
}

impl Loop<'_> {
    fn may_connect(&self, a: u32, b: u32) -> bool {
        !self.taken.contains(&[a.min(b), a.max(b)])
    }

    /// Triangles over the loop's vertices, running through its edges forward. `None` if there are none without a taken pair.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn triangulate(&self, progress: &Progress<'_>) -> Result<Option<Vec<[u32; 3]>>> {
        if let Some(triangles) = flat::triangulate(self.points, |a, b| self.may_connect(a, b), progress)? {
            return Ok(Some(triangles));
        }
        let all = Polygon { vertices: (0..self.points.len() as u32).collect(), outside: self.outside.to_vec() };
        let (mut left, mut triangles) = (vec![all], Vec::with_capacity(self.points.len()));
        while let Some(polygon) = left.pop() {
            progress.check()?;
            if polygon.vertices.len() > LARGEST {
                let Some((from, to)) = self.best_chord(&polygon) else { return Ok(None) };
                left.extend(polygon.cut(from, to));
            } else if !Table::new(self, &polygon, progress)?.collect(&polygon, &mut triangles) {
                return Ok(None);
            }
        }
        Ok(Some(triangles))
    }

    /// The chord that is shortest for the way along the loop it cuts off.
    fn best_chord(&self, polygon: &Polygon) -> Option<(usize, usize)> {
        let n = polygon.vertices.len();
        let at = |i: usize| self.points[polygon.vertices[i] as usize];
        let mut along = vec![0.0; n + 1];
        for i in 0..n {
            along[i + 1] = along[i] + at(i).distance(at((i + 1) % n));
        }
        let stride = n / CHORD_ENDS + 1;
        // Pieces of a tenth of the loop or more, so that cutting takes few steps.
        let shortest = n / 10;
        let mut best = (f64::INFINITY, None);
        for i in (0..n).step_by(stride) {
            for j in (i + shortest..n.min(i + n - shortest + 1)).step_by(stride) {
                let way = along[j] - along[i];
                let ratio = at(i).distance(at(j)) / way.min(along[n] - way);
                if ratio < best.0 && self.may_connect(polygon.vertices[i], polygon.vertices[j]) {
                    best = (ratio, Some((i, j)));
                }
            }
        }
        best.1
    }
}

/// A part of the loop, closed by chords.
struct Polygon {
    vertices: Vec<u32>,
    /// Unit normal beyond the edge from vertex i to the next. `None` if unknown, as beyond a chord.
    outside: Vec<Option<DVec3>>,
}

impl Polygon {
    fn cut(self, from: usize, to: usize) -> [Polygon; 2] {
        let inner = Polygon {
            vertices: self.vertices[from..=to].to_vec(),
            outside: self.outside[from..to].iter().copied().chain([None]).collect(),
        };
        let outer = Polygon {
            vertices: self.vertices[to..].iter().chain(&self.vertices[..=from]).copied().collect(),
            outside: self.outside[to..].iter().chain(&self.outside[..from]).copied().chain([None]).collect(),
        };
        [inner, outer]
    }
}

/// Cost of a triangulation: first its bend (one minus the cosine), then its area.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
struct Cost {
    bend: f64,
    area: f64,
}

const IMPOSSIBLE: Cost = Cost { bend: f64::INFINITY, area: f64::INFINITY };

/// Bend at a triangle without area: worse than a fold, which is 2.
const DEGENERATE: f64 = 3.0;

/// Best triangulation of each sub-chain i..=j, closed by the edge j, i.
struct Table {
    n: usize,
    cost: Vec<Cost>,
    /// Third vertex of the triangle at edge j, i.
    apex: Vec<u16>,
}

impl Table {
    fn new(hole: &Loop<'_>, polygon: &Polygon, progress: &Progress<'_>) -> Result<Table> {
        let n = polygon.vertices.len();
        let points: Vec<DVec3> = polygon.vertices.iter().map(|&v| hole.points[v as usize]).collect();
        let mut table = Table { n, cost: vec![IMPOSSIBLE; n * n], apex: vec![0; n * n] };
        // Normal of the triangle on the inner side of edge j, i; beyond an edge of the polygon that of the mesh.
        let mut beyond: Vec<Option<DVec3>> = vec![None; n * n];
        for i in 0..n - 1 {
            table.cost[i * n + i + 1] = Cost { bend: 0.0, area: 0.0 };
            beyond[i * n + i + 1] = polygon.outside[i];
        }
        for span in 2..n {
            progress.check()?;
            for i in 0..n - span {
                let j = i + span;
                let closing = span == n - 1;
                if !closing && !hole.may_connect(polygon.vertices[i], polygon.vertices[j]) {
                    continue;
                }
                let chord = points[j] - points[i];
                let (mut best, mut best_normal) = (IMPOSSIBLE, DVec3::ZERO);
                for m in i + 1..j {
                    let (first, second) = (table.cost[i * n + m], table.cost[m * n + j]);
                    let bend = first.bend.max(second.bend);
                    if bend > best.bend {
                        continue;
                    }
                    let normal = (points[m] - points[i]).cross(chord);
                    let double_area = normal.length();
                    let unit = normal / double_area;
                    let bend = if double_area > 0.0 {
                        let with = |other: Option<DVec3>| other.map_or(0.0, |other| 1.0 - other.dot(unit));
                        let outer = if closing { with(polygon.outside[n - 1]) } else { 0.0 };
                        bend.max(with(beyond[i * n + m])).max(with(beyond[m * n + j])).max(outer)
                    } else {
                        DEGENERATE
                    };
                    let cost = Cost { bend, area: first.area + second.area + 0.5 * double_area };
                    if cost < best {
                        (best, best_normal) = (cost, unit);
                        table.apex[i * n + j] = m as u16;
                    }
                }
                table.cost[i * n + j] = best;
                beyond[i * n + j] = best_normal.is_finite().then_some(best_normal);
            }
        }
        Ok(table)
    }

    /// Adds the triangles of the whole polygon. Returns false if there is no triangulation.
    fn collect(&self, polygon: &Polygon, triangles: &mut Vec<[u32; 3]>) -> bool {
        if self.cost[self.n - 1].bend == f64::INFINITY {
            return false;
        }
        let mut left = vec![(0, self.n - 1)];
        while let Some((i, j)) = left.pop() {
            if j > i + 1 {
                let m = usize::from(self.apex[i * self.n + j]);
                triangles.push([i, m, j].map(|v| polygon.vertices[v]));
                left.extend([(m, j), (i, m)]);
            }
        }
        true
    }
}
