//! Stage 6, with a least angle: nodes are taken away where that costs least by the quadrics of their patches, and no angle falls below it.
//! \[GH97\]
//!
//! Each node keeps the sum of the squared distances to the planes of the surface's points beside it, as a quadric. An edge goes into the
//! place where the sum of both quadrics is least, drawn a little to the edge's middle, where planes leave it open. Differences: quadrics
//! are those of points all over the dense surface, shared by barycentric weights, so in each pass they are those of the surface anew. A
//! collapse that makes an angle below the least, or turns a triangle over, is none.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DMat3, DVec3};

use super::fit::{Sample, beside};
use super::net::{Net, Size, Spot, area_vector, smallest_angle};
use super::surface::{NONE, Surface};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Share of a quadric's size that draws its least place to the middle of the edge.
const RIDGE: f64 = 3e-3;
/// Cosine of the most that a triangle may turn by a collapse: 73 degrees.
const TURN: f64 = 0.3;
/// Triangles around a node that is collapsed or moved, at most: what has more has sharp angles anyway, and would take the square
/// of its number.
pub const MOST_AROUND: usize = 64;

/// Sum of weighted squared distances to planes: x A x - 2 b x + c.
#[derive(Clone, Copy)]
struct Quadric {
    a: DMat3,
    b: DVec3,
    c: f64,
}

impl Quadric {
    const ZERO: Self = Quadric { a: DMat3::ZERO, b: DVec3::ZERO, c: 0.0 };

    fn add_plane(&mut self, point: DVec3, normal: DVec3, weight: f64) {
        let (weighted, offset) = (normal * weight, normal.dot(point));
        self.a += DMat3::from_cols(weighted * normal.x, weighted * normal.y, weighted * normal.z);
        self.b += weighted * offset;
        self.c += weight * offset * offset;
    }

    fn plus(&self, other: &Self) -> Self {
        Quadric { a: self.a + other.a, b: self.b + other.b, c: self.c + other.c }
    }

    fn at(&self, x: DVec3) -> f64 {
        (x.dot(self.a * x) - 2.0 * self.b.dot(x) + self.c).max(0.0)
    }

    /// The place of its least value, drawn to `near`.
    fn least(&self, near: DVec3) -> Option<DVec3> {
        let trace = self.a.x_axis.x + self.a.y_axis.y + self.a.z_axis.z;
        let drawn = self.a + DMat3::from_diagonal(DVec3::splat(RIDGE * trace));
        let least = near + drawn.inverse() * (self.b - self.a * near);
        least.is_finite().then_some(least)
    }
}

/// An edge in the queue, the cheapest first. It is void once a stamp of its ends has changed.
struct Candidate {
    cost: f64,
    ends: [u32; 2],
    stamps: [u32; 2],
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then((other.ends, other.stamps).cmp(&(self.ends, self.stamps)))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// A net whose edges are collapsed.
struct Collapse<'a> {
    surface: &'a Surface,
    net: &'a mut Net,
    /// Triangles at each node. None once it has gone into another.
    stars: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    /// Number of times that a node's surroundings have changed.
    stamps: Vec<u32>,
    queue: BinaryHeap<Candidate>,
    least: f64,
}

/// Collapses edges until no more than `wanted` is left, or none can be without an angle below `least`, in radians, that was not there.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn reduce(
    surface: &Surface,
    net: &mut Net,
    samples: &[Sample],
    wanted: Size,
    least: f64,
    progress: &Progress<'_>,
) -> Result<()> {
    let quadrics = quadrics(net, samples, progress)?;
    let nodes = net.points.len();
    let mut stars = vec![Vec::new(); nodes];
    for (t, corners) in net.triangles.iter().enumerate() {
        corners.iter().for_each(|&v| stars[v as usize].push(t as u32));
    }
    let mut edges = edges(net);
    edges.dedup_by_key(|e| e.0);
    let stamps = vec![0; nodes];
    let mut work = Collapse { surface, net, stars, quadrics, stamps, queue: BinaryHeap::new(), least };
    let mut pace = Pace::new(progress);
    for ([a, b], _) in edges {
        pace.after(16)?;
        work.offer(a, b);
    }
    let (mut nodes_left, mut triangles_left) = (nodes, work.net.triangles.len());
    while wanted.choose(nodes_left, triangles_left) > wanted.count()
        && let Some(next) = work.queue.pop()
    {
        pace.after(64)?;
        let gone = work.take(next);
        nodes_left -= usize::from(gone > 0);
        triangles_left -= gone;
    }
    let gone: Vec<bool> = work.stars.iter().map(Vec::is_empty).collect();
    close_ranks(net, &gone);
    Ok(())
}

/// Edges by their ends, the smaller first, with a triangle of each. Those inside come twice.
fn edges(net: &Net) -> Vec<([u32; 2], u32)> {
    let of = |(t, c): (usize, &[u32; 3])| {
        [[c[0], c[1]], [c[1], c[2]], [c[2], c[0]]].map(|[a, b]| ([a.min(b), a.max(b)], t as u32))
    };
    let mut edges: Vec<([u32; 2], u32)> = net.triangles.iter().enumerate().flat_map(of).collect();
    edges.sort_unstable();
    edges
}

/// The quadric of each node. Planes across the triangles at the border hold this in its place.
fn quadrics(net: &Net, samples: &[Sample], progress: &Progress<'_>) -> Result<Vec<Quadric>> {
    let mut quadrics = vec![Quadric::ZERO; net.points.len()];
    let mut pace = Pace::new(progress);
    for (sample, closest) in samples.iter().zip(beside(net, samples, progress)?) {
        pace.after(1)?;
        let Some(closest) = closest else { continue };
        for (v, share) in net.triangles[closest.triangle as usize].into_iter().zip(closest.barycentric) {
            quadrics[v as usize].add_plane(sample.point, sample.normal, sample.weight * share);
        }
    }
    for edge in edges(net).chunk_by(|x, y| x.0 == y.0).filter(|e| e.len() == 1) {
        let (ends, t) = edge[0];
        let [p, q] = ends.map(|v| net.points[v as usize]);
        let across = net.area_vector(t as usize).cross(q - p).normalize_or_zero();
        for v in ends {
            quadrics[v as usize].add_plane(p, across, p.distance_squared(q));
        }
    }
    Ok(quadrics)
}

impl Collapse<'_> {
    /// Nodes that share an edge with `v`, in order.
    fn ring(&self, v: u32) -> Vec<u32> {
        let corners = self.stars[v as usize].iter().flat_map(|&t| self.net.triangles[t as usize]);
        let mut ring: Vec<u32> = corners.filter(|&w| w != v).collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// The cost of an edge. The error that its nodes have already does not count.
    fn cost(&self, a: u32, b: u32, at: DVec3) -> f64 {
        let [p, q] = [a, b].map(|v| &self.quadrics[v as usize]);
        p.plus(q).at(at) - p.at(self.net.points[a as usize]) - q.at(self.net.points[b as usize])
    }

    /// Places that the ends of an edge may go to, with the cost, the cheapest first.
    fn spots(&self, a: u32, b: u32) -> Vec<(f64, Spot)> {
        let net = &*self.net;
        let stay = |v: u32| net.spot(v);
        let [p, q] = [a, b].map(|v| net.points[v as usize]);
        let middle = (p + q) * 0.5;
        let free = |point: DVec3| Spot { point, ..stay(a) };
        let spots = match (net.on_rail(a), net.on_rail(b)) {
            (true, true) => vec![net.project(self.surface, a as usize, middle), stay(a), stay(b)],
            (true, false) => vec![stay(a)],
            (false, true) => vec![stay(b)],
            (false, false) => {
                let least = self.quadrics[a as usize].plus(&self.quadrics[b as usize]).least(middle);
                let near = least.filter(|x| x.distance(middle) < p.distance(q)).map(free);
                near.into_iter().chain([free(middle), stay(a), stay(b)]).collect()
            }
        };
        let mut spots: Vec<(f64, Spot)> = spots.into_iter().map(|s| (self.cost(a, b, s.point), s)).collect();
        spots.sort_by(|x, y| x.0.total_cmp(&y.0));
        spots
    }

    fn offer(&mut self, a: u32, b: u32) {
        if [a, b].iter().any(|&v| self.stars[v as usize].len() > MOST_AROUND) {
            return;
        }
        let ends = [a.min(b), a.max(b)];
        let cost = self.spots(ends[0], ends[1])[0].0;
        self.queue.push(Candidate { cost, ends, stamps: ends.map(|v| self.stamps[v as usize]) });
    }

    /// Collapses an edge if it may be and nothing is cheaper. Returns how many triangles went with it.
    fn take(&mut self, next: Candidate) -> usize {
        let [a, b] = next.ends;
        let large = |v: u32| self.stars[v as usize].len() > MOST_AROUND;
        if next.ends.map(|v| self.stamps[v as usize]) != next.stamps
            || large(a)
            || large(b)
            || !self.keeps_topology(a, b)
        {
            return 0;
        }
        let Some((cost, spot)) = self.spots(a, b).into_iter().find(|s| self.fits(a, b, &s.1)) else { return 0 };
        // Its cheapest place did not fit.
        if cost > next.cost && self.queue.peek().is_some_and(|other| other.cost < cost) {
            self.queue.push(Candidate { cost, ..next });
            return 0;
        }
        let at_edge = |t: &&u32| self.net.triangles[**t as usize].contains(&b);
        let gone = self.stars[a as usize].iter().filter(at_edge).count();
        self.join(a, b, spot);
        gone
    }

    /// Whether both ends have no neighbours in common but those that the edge's triangles name, and leave enough around them.
    fn keeps_topology(&self, a: u32, b: u32) -> bool {
        let net = &*self.net;
        let shared = self.stars[a as usize].iter().filter(|&&t| net.triangles[t as usize].contains(&b)).count();
        let at_border = shared == 1;
        if net.on_rail(a) && net.on_rail(b) && !at_border {
            return false;
        }
        let (ring_a, ring_b) = (self.ring(a), self.ring(b));
        let common: Vec<u32> = ring_a.iter().copied().filter(|v| ring_b.binary_search(v).is_ok()).collect();
        // A node inside keeps three neighbours, one at the border two.
        let least = if at_border { 6 } else { 9 };
        if common.len() != shared || ring_a.len() + ring_b.len() < least {
            return false;
        }
        let spare = |&v: &u32| self.stars[v as usize].len() > if net.on_rail(v) { 1 } else { 3 };
        if !common.iter().all(spare) {
            return false;
        }
        // On a border of three edges nothing may go.
        let along = |v: u32| self.along_border(v);
        !at_border || !along(a).iter().any(|v| along(b).contains(v))
    }

    /// The neighbours along the border.
    fn along_border(&self, v: u32) -> Vec<u32> {
        let star = &self.stars[v as usize];
        let count = |w: u32| star.iter().filter(|&&t| self.net.triangles[t as usize].contains(&w)).count();
        self.ring(v).into_iter().filter(|&w| count(w) == 1).collect()
    }

    /// Whether both ends at `spot` turn no triangle over and make no angle below the least, unless there is a smaller one.
    fn fits(&self, a: u32, b: u32, spot: &Spot) -> bool {
        let net = &*self.net;
        let (mut before, mut after) = (f64::INFINITY, f64::INFINITY);
        for (v, other) in [(a, b), (b, a)] {
            for &t in &self.stars[v as usize] {
                let corners = net.triangles[t as usize];
                let old = corners.map(|w| net.points[w as usize]);
                before = before.min(smallest_angle(old));
                if corners.contains(&other) {
                    continue;
                }
                let new = corners.map(|w| if w == v { spot.point } else { net.points[w as usize] });
                let (old, turned) = (area_vector(old), area_vector(new));
                if !(turned.dot(old) > TURN * turned.length() * old.length() || old == DVec3::ZERO) {
                    return false;
                }
                after = after.min(smallest_angle(new));
            }
        }
        after >= before.min(self.least)
    }

    /// Lets `b` go into `a`.
    fn join(&mut self, a: u32, b: u32, spot: Spot) {
        self.net.put(a as usize, spot);
        self.quadrics[a as usize] = self.quadrics[a as usize].plus(&self.quadrics[b as usize]);
        for t in std::mem::take(&mut self.stars[b as usize]) {
            let corners = self.net.triangles[t as usize];
            if corners.contains(&a) {
                corners.iter().for_each(|&v| self.stars[v as usize].retain(|&u| u != t));
            } else {
                self.stars[a as usize].push(t);
            }
            self.net.triangles[t as usize] = corners.map(|v| if v == b { a } else { v });
        }
        self.stamps[b as usize] += 1;
        // Edges all around may fit now, or no longer.
        let mut around = self.ring(a);
        around.push(a);
        let mut edges = Vec::new();
        for &v in around.iter().filter(|&&v| self.stars[v as usize].len() <= MOST_AROUND) {
            self.stamps[v as usize] += 1;
            edges.extend(self.ring(v).into_iter().map(|w| [v.min(w), v.max(w)]));
        }
        edges.sort_unstable();
        edges.dedup();
        for [v, w] in edges {
            self.offer(v, w);
        }
    }
}

/// Drops the nodes that have gone, and the triangles that name one twice.
fn close_ranks(net: &mut Net, gone: &[bool]) {
    let mut number = vec![NONE; gone.len()];
    for (count, v) in (0..).zip((0..gone.len()).filter(|&v| !gone[v])) {
        number[v] = count;
    }
    net.renumber(&number);
    net.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
    for triangle in &mut net.triangles {
        *triangle = triangle.map(|v| number[v as usize]);
    }
}
