//! Edge flips: better valences and larger angles than the fans come with. Ours: the paper has no such stage.

use glam::DVec3;

use super::net::{Net, area_vector, smallest_angle};
use super::surface::{NONE, Surface, looking};
use base::error::Result;
use base::progress::Progress;
use mesh::measure::angles;

/// The triangles of a net with their neighbours.
pub struct Links {
    pub twins: Vec<u32>,
    /// A half-edge that leaves each node. On the border it is the one without a twin.
    pub first: Vec<u32>,
    /// Edges at each node.
    pub valences: Vec<u32>,
}

impl Links {
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn of(triangles: &[[u32; 3]], nodes: usize, progress: &Progress<'_>) -> Result<Self> {
        let (twins, cut) = super::surface::link(triangles, nodes, progress)?;
        debug_assert_eq!(cut, 0, "fans make a manifold");
        let mut links = Links { first: vec![NONE; nodes], valences: vec![0; nodes], twins };
        for h in 0..links.twins.len() as u32 {
            let v = triangles[h as usize / 3][h as usize % 3] as usize;
            let border = links.twins[h as usize] == NONE;
            if links.first[v] == NONE || border {
                links.first[v] = h;
            }
            links.valences[v] += 1;
            if border {
                links.valences[triangles[h as usize / 3][(h as usize + 1) % 3] as usize] += 1;
            }
        }
        Ok(links)
    }

    /// Calls `visit` for every node that shares an edge with `v`.
    pub fn around(&self, triangles: &[[u32; 3]], v: u32, mut visit: impl FnMut(u32)) {
        let first = self.first[v as usize];
        let mut h = first;
        loop {
            visit(triangles[h as usize / 3][(h as usize + 1) % 3]);
            let before = Surface::previous(h);
            h = self.twins[before as usize];
            if h == NONE {
                return visit(triangles[before as usize / 3][before as usize % 3]);
            }
            if h == first {
                return;
            }
        }
    }

    /// Calls `visit` for every triangle around `v`.
    pub fn triangles_around(&self, v: u32, mut visit: impl FnMut(u32)) {
        let first = self.first[v as usize];
        let mut h = first;
        loop {
            visit(h / 3);
            h = self.twins[Surface::previous(h) as usize];
            if h == NONE || h == first {
                return;
            }
        }
    }
}

/// The figure that a flip is judged by.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Goal {
    /// As many triangles at each node as angles of 60 degrees fit.
    Valence,
    /// The larger smallest angle of both triangles.
    Angle,
}

/// Smallest angle, in radians, that a flip for better valences may make.
const WORST_FOR_VALENCE: f64 = 0.35;
/// Passes over all edges.
const PASSES: usize = 8;

/// Flips edges until none is better for `goal`. Valences cost some angle, which the springs win back: relax in between.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn flips(net: &mut Net, goal: Goal, progress: &Progress<'_>) -> Result<()> {
    let mut links = Links::of(&net.triangles, net.points.len(), progress)?;
    let ideals = if goal == Goal::Valence { ideals(net) } else { Vec::new() };
    for _ in 0..PASSES {
        let mut flips = 0;
        for h in 0..links.twins.len() as u32 {
            looking(h, progress)?;
            let g = links.twins[h as usize];
            if g != NONE && h < g && is_better(net, &links, h, g, &ideals) {
                turn(net, &mut links, h, g);
                flips += 1;
            }
        }
        if flips == 0 {
            break;
        }
    }
    Ok(())
}

/// Edges that each node should have: one for each 60 degrees of its angles, which on a border depend on how this turns.
fn ideals(net: &Net) -> Vec<i64> {
    let mut sums = vec![0.0; net.points.len()];
    for t in &net.triangles {
        for (v, angle) in t.iter().zip(angles(t.map(|v| net.points[v as usize]))) {
            sums[*v as usize] += angle;
        }
    }
    let ideal = |(v, sum): (usize, &f64)| {
        let triangles = (sum / 60_f64.to_radians()).round() as i64;
        if net.on_rail(v as u32) { triangles.clamp(1, 6) + 1 } else { triangles.clamp(4, 8) }
    };
    sums.iter().enumerate().map(ideal).collect()
}

/// Whether the flip of an edge serves the valences in `ideals`, or without any the angles.
fn is_better(net: &Net, links: &Links, h: u32, g: u32, ideals: &[i64]) -> bool {
    let [a, b, c, d] = quad(net, h, g);
    // An edge between them lies on a crease.
    if net.is_held(a) && net.is_held(b) || net.is_ridge(a, b) {
        return false;
    }
    if !ideals.is_empty() {
        let excess = |v: u32, change: i64| (i64::from(links.valences[v as usize]) + change - ideals[v as usize]).pow(2);
        let gain = [a, b].map(|v| excess(v, 0) - excess(v, -1)).iter().sum::<i64>()
            + [c, d].map(|v| excess(v, 0) - excess(v, 1)).iter().sum::<i64>();
        if gain <= 0 {
            return false;
        }
    }
    let [p, q, r, s] = [a, b, c, d].map(|v| net.points[v as usize]);
    let before = smallest_angle([p, q, r]).min(smallest_angle([q, p, s]));
    let after = smallest_angle([r, p, s]).min(smallest_angle([s, q, r]));
    let wanted = if ideals.is_empty() { after > before * (1.0 + 1e-9) } else { after > WORST_FOR_VALENCE.min(before) };
    wanted
        && faces_alike(p, q, r, s)
        && least_edges(links, net, a)
        && least_edges(links, net, b)
        && !joined(net, links, c, d)
}

/// Whether a node may lose an edge.
pub fn least_edges(links: &Links, net: &Net, v: u32) -> bool {
    links.valences[v as usize] > if net.on_rail(v) { 2 } else { 3 }
}

/// Whether both triangles after the flip face where those before did.
pub fn faces_alike(p: DVec3, q: DVec3, r: DVec3, s: DVec3) -> bool {
    let before = area_vector([p, q, r]) + area_vector([q, p, s]);
    let after = [area_vector([r, p, s]), area_vector([s, q, r])];
    after.iter().all(|n| n.dot(before) > 0.3 * n.length() * before.length()) && after[0].dot(after[1]) > 0.0
}

/// The ends of an edge and the corners opposite.
pub fn quad(net: &Net, h: u32, g: u32) -> [u32; 4] {
    let at = |h: u32| net.triangles[h as usize / 3][h as usize % 3];
    [at(h), at(g), at(Surface::previous(h)), at(Surface::previous(g))]
}

/// Whether an edge joins two nodes.
pub fn joined(net: &Net, links: &Links, c: u32, d: u32) -> bool {
    let mut found = false;
    links.around(&net.triangles, c, |v| found |= v == d);
    found
}

/// Replaces the edge of `h` and `g` by the other diagonal of their triangles.
pub fn turn(net: &mut Net, links: &mut Links, h: u32, g: u32) {
    let [a, b, c, d] = quad(net, h, g);
    let outer = [Surface::previous(h), Surface::next(g), Surface::previous(g), Surface::next(h)];
    let [ca, ad, db, bc] = outer.map(|e| links.twins[e as usize]);
    let (t, u) = (h / 3, g / 3);
    net.triangles[t as usize] = [c, a, d];
    net.triangles[u as usize] = [d, b, c];
    for (e, twin) in [(3 * t, ca), (3 * t + 1, ad), (3 * t + 2, 3 * u + 2), (3 * u, db), (3 * u + 1, bc)] {
        links.twins[e as usize] = twin;
        if twin != NONE {
            links.twins[twin as usize] = e;
        }
    }
    // A border node's first half-edge is the one without a twin, wherever it is now.
    for (v, options) in
        [(a, [3 * t + 1, 3 * t + 1]), (b, [3 * u + 1, 3 * u + 1]), (c, [3 * t, 3 * u + 2]), (d, [3 * u, 3 * t + 2])]
    {
        let first = links.first[v as usize];
        if first / 3 == t || first / 3 == u {
            links.first[v as usize] = if links.twins[options[1] as usize] == NONE { options[1] } else { options[0] };
        }
    }
    for (v, up) in [(a, false), (b, false), (c, true), (d, true)] {
        let valence = &mut links.valences[v as usize];
        *valence = if up { *valence + 1 } else { *valence - 1 };
    }
}
