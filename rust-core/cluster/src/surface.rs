//! The input as a manifold to walk on: half-edges, areas, borders, closest points nearby.
//!
//! Half-edge `3 t + k` runs from corner k of triangle t to corner k + 1. Its *twin* runs the other way in the neighbour. An input that is
//! no oriented manifold is cut open. An edge joins triangles only if exactly two share it, run through it in opposite directions and have
//! not all corners in common. A vertex whose triangles fall into several fans becomes one vertex per fan. Of triangles with the same
//! corners, whichever way they turn, the first is the only one: each copy would be cut free.

use glam::{DMat3, DVec3};

use base::error::{Error, Result};
use base::progress::Progress;
use geom::bvh::{Closest, Feature};
use mesh::{TriMesh, measure};

/// Instead of the half-edge that a node on a crease slides along: one at its corner stays.
pub const CORNER: u32 = NONE - 1;

/// Twice the area of a triangle times its normal.
#[inline]
pub fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// No half-edge, no triangle, no vertex.
pub const NONE: u32 = u32::MAX;

/// Steps of a walk to a closest point. Far more than one relaxation step crosses.
const WALK: usize = 256;

/// Leaves the first of all triangles with the same corners. Returns whether there were more.
fn drop_copies(triangles: &mut Vec<[u32; 3]>) -> bool {
    let mut order: Vec<([u32; 3], u32)> = triangles
        .iter()
        .zip(0..)
        .map(|(&corners, t)| {
            let mut corners = corners;
            corners.sort_unstable();
            (corners, t)
        })
        .collect();
    order.sort_unstable();
    let mut copies = vec![false; triangles.len()];
    for pair in order.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        copies[pair[1].1 as usize] = true;
    }
    let before = triangles.len();
    let mut copies = copies.into_iter();
    triangles.retain(|_| !copies.next().unwrap_or(false));
    triangles.len() < before
}

/// Moves points into [-1, 1] and back, so that squares of any input's lengths stay ordinary numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    centre: DVec3,
    scale: f64,
}

impl Frame {
    fn around(positions: &[DVec3]) -> Self {
        let (low, high) = measure::bounds(positions).unwrap_or_default();
        let centre = low * 0.5 + high * 0.5;
        let half = (high * 0.5 - low * 0.5).max_element();
        // A power of two rounds nothing.
        let exponent = if half > 0.0 { half.log2().ceil().clamp(-1000.0, 1000.0) } else { 0.0 };
        Frame { centre, scale: (-exponent).exp2() }
    }

    fn inward(&self, p: DVec3) -> DVec3 {
        p * self.scale - self.centre * self.scale
    }

    /// Back into the caller's coordinates.
    pub fn outward(&self, p: DVec3) -> DVec3 {
        p / self.scale + self.centre
    }

    /// A length of the caller's in this frame.
    pub fn length_inward(&self, length: f64) -> f64 {
        length * self.scale
    }
}

/// A place on the surface: a point of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    pub point: DVec3,
    pub triangle: u32,
}

/// The input, cut to an oriented manifold with boundary, in its own frame.
pub struct Surface {
    pub frame: Frame,
    pub points: Vec<DVec3>,
    /// Vertex of the input that each is.
    pub origins: Vec<u32>,
    pub triangles: Vec<[u32; 3]>,
    pub twins: Vec<u32>,
    /// A half-edge that leaves each vertex. At the border it is the one without a twin, so that turning counter-clockwise from it meets the
    /// whole fan.
    pub first: Vec<u32>,
    /// The half-edge without a twin that ends in each border vertex, else `NONE`.
    pub border_in: Vec<u32>,
    /// A third of the area of each vertex's triangles.
    pub areas: Vec<f64>,
    /// Edges of the input that had to be cut.
    pub cut_edges: usize,
}

impl Surface {
    /// Cuts and links the triangles of `mesh`. Those that name a vertex twice are left out.
    ///
    /// # Errors
    /// Bad indices or coordinates. No triangle. More than 2^30 triangles.
    pub fn new(mesh: &TriMesh, progress: &Progress<'_>) -> Result<Self> {
        mesh.validate()?;
        if mesh.triangles.len() > 1 << 30 {
            return Err(Error::input(format!("{} triangles are more than the supported 2^30", mesh.triangles.len())));
        }
        let frame = Frame::around(&mesh.positions);
        let sound = |&t: &u32| {
            let [a, b, c] = mesh.triangles[t as usize];
            a != b && b != c && c != a
        };
        let kept: Vec<u32> = (0..mesh.triangles.len() as u32).filter(sound).collect();
        if kept.is_empty() {
            return Err(Error::input("the mesh has no triangle to cluster: give one with triangles"));
        }
        let mut triangles: Vec<[u32; 3]> = kept.iter().map(|&t| mesh.triangles[t as usize]).collect();
        progress.check()?;
        let (mut twins, mut cut_edges) = link(&triangles, mesh.positions.len(), progress)?;
        if cut_edges > 0 && drop_copies(&mut triangles) {
            (twins, cut_edges) = link(&triangles, mesh.positions.len(), progress)?;
        }
        let (origins, first) = fans(&mut triangles, &twins, progress)?;
        let points: Vec<DVec3> = origins.iter().map(|&v| frame.inward(mesh.positions[v as usize])).collect();
        let mut border_in = vec![NONE; points.len()];
        for (h, &twin) in twins.iter().enumerate() {
            if twin == NONE {
                border_in[triangles[h / 3][(h + 1) % 3] as usize] = h as u32;
            }
        }
        progress.check()?;
        let mut areas = vec![0.0; points.len()];
        for t in &triangles {
            let third = measure::area(t.map(|v| points[v as usize])) / 3.0;
            t.iter().for_each(|&v| areas[v as usize] += third);
        }
        Ok(Surface { frame, points, origins, triangles, twins, first, border_in, areas, cut_edges })
    }

    /// Vertex from which half-edge `h` runs.
    #[inline]
    pub fn from(&self, h: u32) -> u32 {
        self.triangles[h as usize / 3][h as usize % 3]
    }

    /// Vertex to which half-edge `h` runs.
    #[inline]
    pub fn to(&self, h: u32) -> u32 {
        self.triangles[h as usize / 3][next_corner(h as usize % 3)]
    }

    /// The half-edge after `h` in its triangle.
    #[inline]
    pub fn next(h: u32) -> u32 {
        if h % 3 == 2 { h - 2 } else { h + 1 }
    }

    /// The half-edge before `h` in its triangle.
    #[inline]
    pub fn previous(h: u32) -> u32 {
        if h.is_multiple_of(3) { h + 2 } else { h - 1 }
    }

    /// Half-edges that leave `v`, counter-clockwise.
    pub fn leaving(&self, v: u32) -> impl Iterator<Item = u32> {
        let first = self.first[v as usize];
        let mut at = first;
        std::iter::from_fn(move || {
            let h = at;
            if h == NONE {
                return None;
            }
            at = self.twins[Self::previous(h) as usize];
            if at == first {
                at = NONE;
            }
            Some(h)
        })
    }

    /// Calls `visit` for every vertex that shares an edge with `v`.
    #[inline]
    pub fn neighbours(&self, v: u32, mut visit: impl FnMut(u32)) {
        let first = self.first[v as usize];
        let mut h = first;
        loop {
            visit(self.to(h));
            let before = Self::previous(h);
            h = self.twins[before as usize];
            if h == NONE {
                return visit(self.from(before));
            }
            if h == first {
                return;
            }
        }
    }

    /// Whether `v` lies on the border.
    pub fn on_border(&self, v: u32) -> bool {
        self.border_in[v as usize] != NONE
    }

    /// Corners of a triangle.
    #[inline]
    pub fn corners(&self, t: u32) -> [DVec3; 3] {
        self.triangles[t as usize].map(|v| self.points[v as usize])
    }

    /// The closest point to `p` that a walk finds which only ever comes nearer, from `start`: on this sheet of the
    /// surface, however close another one is.
    pub fn walk(&self, p: DVec3, start: u32) -> Place {
        let mut best = Closest::on_triangle(p, &self.corners(start), start);
        for _ in 0..WALK {
            let from = best.distance_squared;
            match best.feature {
                Feature::Inside => break,
                Feature::Edge(opposite) => {
                    let h = best.triangle * 3 + (u32::from(opposite) + 1) % 3;
                    let twin = self.twins[h as usize];
                    if twin != NONE {
                        self.offer(p, twin / 3, &mut best);
                    }
                }
                Feature::Corner(k) => {
                    let v = self.triangles[best.triangle as usize][k as usize];
                    for h in self.leaving(v) {
                        self.offer(p, h / 3, &mut best);
                    }
                }
            }
            // Nearer by more than rounding, or the walk could go round in circles.
            if best.distance_squared >= from * (1.0 - 1e-12) {
                break;
            }
        }
        Place { point: best.point, triangle: best.triangle }
    }

    #[inline]
    fn offer(&self, p: DVec3, t: u32, best: &mut Closest) {
        if t == best.triangle {
            return;
        }
        let other = Closest::on_triangle(p, &self.corners(t), t);
        if other.distance_squared < best.distance_squared {
            *best = other;
        }
    }

    /// The closest point to `p` along the border, walking from the border half-edge `start`. Also the half-edge it lies on.
    pub fn walk_border(&self, p: DVec3, start: u32) -> (DVec3, u32) {
        let mut best = self.on_half_edge(p, start);
        let mut at = start;
        for _ in 0..WALK {
            let step = match best.1 {
                t if t >= 1.0 => self.first[self.to(at) as usize],
                t if t <= 0.0 => self.border_in[self.from(at) as usize],
                _ => break,
            };
            let other = self.on_half_edge(p, step);
            if other.0.distance_squared(p) >= best.0.distance_squared(p) {
                break;
            }
            (best, at) = (other, step);
        }
        (best.0, at)
    }

    /// The closest point to `p` of a half-edge, and where along it.
    pub fn on_half_edge(&self, p: DVec3, h: u32) -> (DVec3, f64) {
        let (a, b) = (self.points[self.from(h) as usize], self.points[self.to(h) as usize]);
        let along = b - a;
        let t = ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        let t = if t.is_nan() { 0.0 } else { t };
        (if t == 1.0 { b } else { a + along * t }, t)
    }

    /// Weights of the corners of a triangle at the point of it closest to `p`.
    pub fn barycentric(&self, place: Place) -> [f64; 3] {
        Closest::on_triangle(place.point, &self.corners(place.triangle), place.triangle).barycentric
    }
}

#[inline]
fn next_corner(k: usize) -> usize {
    if k == 2 { 0 } else { k + 1 }
}

/// Twins of all half-edges, and how many edges can't join their triangles.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn link(triangles: &[[u32; 3]], vertices: usize, progress: &Progress<'_>) -> Result<(Vec<u32>, usize)> {
    // Half-edges in buckets by their smaller end.
    let ends = |h: u32| {
        let t = triangles[h as usize / 3];
        (t[h as usize % 3], t[next_corner(h as usize % 3)])
    };
    let mut starts = vec![0_u32; vertices + 1];
    let all = 3 * triangles.len() as u32;
    for h in 0..all {
        looking(h, progress)?;
        let (a, b) = ends(h);
        starts[a.min(b) as usize + 1] += 1;
    }
    for v in 0..vertices {
        starts[v + 1] += starts[v];
    }
    // Larger end, then the half-edge with its direction in the lowest bit: 2 * 3 * 2^30 needs 33 bits of 64.
    let mut buckets = vec![(0_u32, 0_u32); all as usize];
    let mut fill = starts.clone();
    for h in 0..all {
        looking(h, progress)?;
        let (a, b) = ends(h);
        let slot = &mut fill[a.min(b) as usize];
        buckets[*slot as usize] = (a.max(b), h);
        *slot += 1;
    }
    let mut twins = vec![NONE; all as usize];
    let mut cut = 0;
    for v in 0..vertices {
        looking(v as u32, progress)?;
        let bucket = &mut buckets[starts[v] as usize..starts[v + 1] as usize];
        bucket.sort_unstable();
        for edge in bucket.chunk_by(|x, y| x.0 == y.0) {
            match *edge {
                [_] => {}
                [(_, g), (_, h)] if ends(g).0 != ends(h).0 && !same_corners(triangles, g, h) => {
                    (twins[g as usize], twins[h as usize]) = (h, g)
                }
                _ => cut += 1,
            }
        }
    }
    Ok((twins, cut))
}

/// Looks at the progress once in many steps.
#[inline]
pub fn looking(step: u32, progress: &Progress<'_>) -> Result<()> {
    if step.is_multiple_of(1 << 16) { progress.check() } else { Ok(()) }
}

/// Whether the triangles of two half-edges have the same corners: two that lie on each other have no inside to join.
fn same_corners(triangles: &[[u32; 3]], g: u32, h: u32) -> bool {
    let (s, t) = (triangles[g as usize / 3], triangles[h as usize / 3]);
    s.iter().all(|v| t.contains(v))
}

/// Gives every fan of triangles its own vertex, counted through in the order of the input's vertices as far as each has one. Returns their
/// vertices of the input and where each fan starts.
fn fans(triangles: &mut [[u32; 3]], twins: &[u32], progress: &Progress<'_>) -> Result<(Vec<u32>, Vec<u32>)> {
    let all = twins.len() as u32;
    let mut fan_of = vec![NONE; all as usize];
    let mut fans = Vec::new();
    for h in 0..all {
        looking(h, progress)?;
        if fan_of[h as usize] != NONE {
            continue;
        }
        // Back, clockwise, to the border or once around.
        let mut first = h;
        while twins[first as usize] != NONE {
            first = Surface::next(twins[first as usize]);
            if first == h {
                break;
            }
        }
        let fan = fans.len() as u32;
        let mut at = first;
        loop {
            fan_of[at as usize] = fan;
            at = twins[Surface::previous(at) as usize];
            if at == NONE || at == first {
                break;
            }
        }
        fans.push((triangles[h as usize / 3][h as usize % 3], first));
    }
    let mut order: Vec<u32> = (0..fans.len() as u32).collect();
    progress.check()?;
    order.sort_by_key(|&f| fans[f as usize].0);
    progress.check()?;
    let mut number = vec![0; fans.len()];
    for (n, &f) in order.iter().enumerate() {
        number[f as usize] = n as u32;
    }
    for (t, triangle) in triangles.iter_mut().enumerate() {
        *triangle = std::array::from_fn(|k| number[fan_of[3 * t + k] as usize]);
    }
    Ok(order.iter().map(|&f| fans[f as usize]).unzip())
}

/// Unit vector along which points with this covariance spread most. It is always the same for the same numbers.
pub fn main_axis(covariance: DMat3) -> DVec3 {
    let columns = [covariance.x_axis, covariance.y_axis, covariance.z_axis];
    let start = columns
        .into_iter()
        .fold(DVec3::ZERO, |best, c| if c.length_squared() > best.length_squared() { c } else { best });
    // Squaring the matrix four times is sixteen steps of the power method.
    let mut power = covariance;
    for _ in 0..4 {
        let largest = power.to_cols_array().iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if !(largest > 0.0) {
            break;
        }
        power *= 1.0 / largest;
        power = power * power;
    }
    let axis = (power * start).normalize_or_zero();
    if axis == DVec3::ZERO { start.try_normalize().unwrap_or(DVec3::X) } else { axis }
}
