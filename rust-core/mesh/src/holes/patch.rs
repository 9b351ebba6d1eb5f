//! The triangulated hole, refined until it is as fine as its surroundings. \[Lie03, sec. 4. PS96\]

use std::collections::BTreeSet;

use glam::DVec3;

use base::error::Result;
use base::progress::Progress;

/// No triangle on the other side: an edge of the loop.
const OUTSIDE: u32 = u32::MAX;

/// The triangles that fill a hole, as a disk. Vertices `0..loop_len` are those of the loop, the others are new.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
    pub loop_len: usize,
    /// The three vertices each new one was put between.
    pub sources: Vec<[u32; 3]>,
    /// The triangle across the edge from corner i to corner i + 1, or [`OUTSIDE`].
    across: Vec<[u32; 3]>,
    /// Wanted length of the edges at each vertex.
    scale: Vec<f64>,
}

/// Sweeps of edge swaps between two rounds of insertion. Swaps settle in two or three sweeps. In space, unlike in the plane, nothing proves
/// that they settle.
const SWEEPS: usize = 12;

impl Patch {
    /// A patch of triangles over the loop's vertices. `scale` is the length of the edges around each.
    pub fn new(points: Vec<DVec3>, scale: Vec<f64>, triangles: Vec<[u32; 3]>) -> Self {
        let loop_len = points.len();
        let mut sides: Vec<([u32; 2], u32, usize)> = Vec::with_capacity(3 * triangles.len());
        for (t, corners) in triangles.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                sides.push(([a.min(b), a.max(b)], t as u32, i));
            }
        }
        sides.sort_unstable();
        let mut across = vec![[OUTSIDE; 3]; triangles.len()];
        for pair in sides.chunk_by(|a, b| a.0 == b.0) {
            if let [a, b] = pair {
                across[a.1 as usize][a.2] = b.1;
                across[b.1 as usize][b.2] = a.1;
            }
        }
        Patch { points, triangles, loop_len, sources: Vec::new(), across, scale }
    }

    /// A patch of one new vertex in the middle, connected with all of the loop.
    pub fn fan(mut points: Vec<DVec3>, mut scale: Vec<f64>) -> Self {
        let n = points.len();
        let middle = n as u32;
        let triangles = (0..middle).map(|i| [i, (i + 1) % middle, middle]).collect();
        points.push(points.iter().sum::<DVec3>() / n as f64);
        scale.push(scale.iter().sum::<f64>() / n as f64);
        let sources = vec![[0, n as u32 / 3, 2 * n as u32 / 3]];
        Patch { loop_len: n, sources, ..Patch::new(points, scale, triangles) }
    }

    /// Number of new vertices.
    pub fn new_vertices(&self) -> usize {
        self.points.len() - self.loop_len
    }

    /// Length of the shortest edge at a new vertex. Infinite if there is none.
    pub fn shortest_new_edge(&self) -> f64 {
        let sides = self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let new = sides.filter(|side| side.iter().any(|&v| v as usize >= self.loop_len));
        let length = |[a, b]: [u32; 2]| self.points[a as usize].distance(self.points[b as usize]);
        new.map(length).fold(f64::INFINITY, f64::min)
    }

    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.points[v as usize])
    }

    /// Puts vertices into triangles that are large for their surroundings and swaps edges, until none is. Pairs in `taken`
    /// (smaller index first) stay unconnected.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn refine(&mut self, taken: &BTreeSet<[u32; 2]>, progress: &Progress<'_>) -> Result<()> {
        // About the area of a flat disk by that of its triangles is 0.2 n^2; more comes from scales that are off.
        let most = self.loop_len * self.loop_len / 2 + 8;
        self.relax(taken);
        loop {
            progress.check()?;
            let mut split = false;
            for t in 0..self.triangles.len() {
                if self.new_vertices() < most && self.is_large(t) {
                    self.split(t);
                    split = true;
                }
            }
            if !split {
                return Ok(());
            }
            self.relax(taken);
        }
    }

    /// Whether the middle is further from all three corners than edges should be long. \[PS96\]
    fn is_large(&self, t: usize) -> bool {
        let corners = self.triangles[t];
        let middle = self.corners(t).iter().sum::<DVec3>() / 3.0;
        let wanted = corners.iter().map(|&v| self.scale[v as usize]).sum::<f64>() / 3.0;
        corners.iter().all(|&v| {
            let reach = std::f64::consts::SQRT_2 * middle.distance(self.points[v as usize]);
            reach > wanted && reach > self.scale[v as usize]
        })
    }

    /// Puts a vertex into the middle of a triangle.
    fn split(&mut self, t: usize) {
        let ([a, b, c], [_, beyond_bc, beyond_ca]) = (self.triangles[t], self.across[t]);
        let v = self.points.len() as u32;
        self.points.push(self.corners(t).iter().sum::<DVec3>() / 3.0);
        self.scale.push([a, b, c].iter().map(|&v| self.scale[v as usize]).sum::<f64>() / 3.0);
        self.sources.push([a, b, c]);
        let (t, second, third) = (t as u32, self.triangles.len() as u32, self.triangles.len() as u32 + 1);
        self.triangles[t as usize] = [a, b, v];
        self.triangles.extend([[b, c, v], [c, a, v]]);
        self.across[t as usize][1] = second;
        self.across[t as usize][2] = third;
        self.across.extend([[beyond_bc, third, t], [beyond_ca, t, second]]);
        self.relink(beyond_bc, t, second);
        self.relink(beyond_ca, t, third);
    }

    /// Tells triangle `t` that it now has `new` where it had `old`.
    fn relink(&mut self, t: u32, old: u32, new: u32) {
        if t != OUTSIDE
            && let Some(side) = self.across[t as usize].iter_mut().find(|side| **side == old)
        {
            *side = new;
        }
    }

    /// Swaps edges whose two opposite angles add up to more than two right ones.
    fn relax(&mut self, taken: &BTreeSet<[u32; 2]>) {
        for _ in 0..SWEEPS {
            let mut swapped = false;
            for t in 0..self.triangles.len() {
                for i in 0..3 {
                    let u = self.across[t][i];
                    // Each edge once, from its smaller triangle.
                    if u != OUTSIDE && (t as u32) < u && self.wants_swap(t, i, taken) {
                        self.swap(t, i);
                        swapped = true;
                    }
                }
            }
            if !swapped {
                return;
            }
        }
    }

    /// The corners a, b of edge `i` of triangle `t`, the opposite corner c, and that of the triangle beyond, d.
    fn around(&self, t: usize, i: usize) -> ([u32; 4], usize) {
        let u = self.across[t][i] as usize;
        let j =
            (0..3).find(|&j| self.across[u][j] == t as u32 && self.triangles[u][j] == self.triangles[t][(i + 1) % 3]);
        let j = j.expect("neighbours know each other");
        let [a, b, c] = [0, 1, 2].map(|k| self.triangles[t][(i + k) % 3]);
        ([a, b, c, self.triangles[u][(j + 2) % 3]], j)
    }

    fn wants_swap(&self, t: usize, i: usize, taken: &BTreeSet<[u32; 2]>) -> bool {
        let ([a, b, c, d], _) = self.around(t, i);
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| self.points[v as usize]);
        let cotangent = |at: DVec3| {
            let (x, y) = (pa - at, pb - at);
            x.dot(y) / x.cross(y).length()
        };
        let sum = cotangent(pc) + cotangent(pd);
        // The slack keeps four points on a circle from being swapped to and fro by rounding.
        if sum.is_nan() || sum >= -1e-9 {
            return false;
        }
        // The new triangles must look the way the old ones do, or the swap would fold the patch.
        let old = (pb - pa).cross(pc - pa) + (pa - pb).cross(pd - pb);
        let (first, second) = ((pd - pa).cross(pc - pa), (pc - pb).cross(pd - pb));
        first.dot(old) > 0.0
            && second.dot(old) > 0.0
            && !taken.contains(&[c.min(d), c.max(d)])
            && !self.are_connected(c, d, t)
    }

    /// Whether an edge of the patch connects `c`, a corner of triangle `t`, with `d`.
    fn are_connected(&self, c: u32, d: u32, t: usize) -> bool {
        // Around c one way until the start or the border, then, at a border, the other way.
        for backwards in [false, true] {
            let mut at = t;
            loop {
                let Some(i) = self.triangles[at].iter().position(|&v| v == c) else { return true };
                if self.triangles[at].contains(&d) {
                    return true;
                }
                let next = self.across[at][if backwards { i } else { (i + 2) % 3 }];
                if next == OUTSIDE {
                    break;
                }
                at = next as usize;
                if at == t {
                    return false;
                }
            }
        }
        false
    }

    /// Replaces edge `i` of triangle `t`, from a to b, by that from c to d.
    fn swap(&mut self, t: usize, i: usize) {
        let ([a, b, c, d], j) = self.around(t, i);
        let u = self.across[t][i] as usize;
        let (beyond_bc, beyond_ca) = (self.across[t][(i + 1) % 3], self.across[t][(i + 2) % 3]);
        let (beyond_ad, beyond_db) = (self.across[u][(j + 1) % 3], self.across[u][(j + 2) % 3]);
        self.triangles[t] = [a, d, c];
        self.across[t] = [beyond_ad, u as u32, beyond_ca];
        self.triangles[u] = [d, b, c];
        self.across[u] = [beyond_db, beyond_bc, t as u32];
        self.relink(beyond_ad, u as u32, t as u32);
        self.relink(beyond_bc, t as u32, u as u32);
    }
}
