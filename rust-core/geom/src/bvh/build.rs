//! Building the hierarchy: binned surface area heuristic, in parallel. \[Wald07\]
//!
//! The tree depends on the triangles alone: bins are filled and boxes joined with operations that don't depend on their
//! order, and parts are split in place by one thread each.

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::node::{Frame, GROWTH, HEURISTIC_DEPTH, Node, Slot};
use base::error::Result;
use base::progress::Progress;

/// Bins an axis.
const BINS: usize = 16;
/// Triangles a leaf may always have.
const LEAF: usize = 4;
/// Largest leaf the heuristic may ask for.
const MAX_LEAF: usize = 12;
/// Cost of visiting a node over that of testing a triangle.
const NODE_COST: f32 = 1.2;
/// Parts smaller than this are built by one thread.
const PARALLEL: usize = 4096;
/// Parts whose extents and bins are found by several threads.
const LARGE: usize = 16 * PARALLEL;
/// Below 1, so that in single precision what lies at the far end of the middles falls into the last bin and not beyond it.
const WITHIN: f32 = 0.9999;

/// A triangle to place: its grown box in the frame.
#[derive(Clone, Copy)]
struct Item {
    lo: Vec3A,
    hi: Vec3A,
    triangle: u32,
}

#[derive(Clone, Copy)]
struct Box3 {
    lo: Vec3A,
    hi: Vec3A,
}

impl Box3 {
    const EMPTY: Box3 = Box3 { lo: Vec3A::INFINITY, hi: Vec3A::NEG_INFINITY };

    fn join(self, other: Box3) -> Box3 {
        Box3 { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    fn add(self, p: Vec3A) -> Box3 {
        Box3 { lo: self.lo.min(p), hi: self.hi.max(p) }
    }

    fn half_area(self) -> f32 {
        let d = (self.hi - self.lo).max(Vec3A::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

impl Item {
    fn bounds(&self) -> Box3 {
        Box3 { lo: self.lo, hi: self.hi }
    }

    /// Twice the centre of the box.
    fn middle(&self) -> Vec3A {
        self.lo + self.hi
    }
}

pub(super) fn build(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    progress: &Progress<'_>,
) -> Result<(Frame, Vec<Node>, Vec<Slot>)> {
    let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
    let (lo, hi) = triangles
        .par_iter()
        .map(|t| {
            let [a, b, c] = corners(t);
            (a.min(b).min(c), a.max(b).max(c))
        })
        .reduce(|| (DVec3::INFINITY, DVec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    if triangles.is_empty() {
        return Ok((Frame { centre: DVec3::ZERO, scale: 1.0 }, Vec::new(), Vec::new()));
    }
    let frame = Frame::around(lo, hi);
    let mut items: Vec<Item> = triangles
        .par_iter()
        .enumerate()
        .map(|(t, triangle)| {
            let [a, b, c] = corners(triangle).map(|p| frame.to_frame(p));
            Item {
                lo: (a.min(b).min(c) - GROWTH).as_vec3a(),
                hi: (a.max(b).max(c) + GROWTH).as_vec3a(),
                triangle: t as u32,
            }
        })
        .collect();
    progress.check()?;
    let mut nodes = subtree(&mut items, 0, 0, progress)?;
    nodes.shrink_to_fit();
    let slots = items.iter().map(|i| Slot { corners: triangles[i.triangle as usize], triangle: i.triangle }).collect();
    Ok((frame, nodes, slots))
}

/// The nodes over `items`, whose first will be slot `first`. Links to nodes count from the subtree's own root.
fn subtree(items: &mut [Item], first: u32, depth: usize, progress: &Progress<'_>) -> Result<Vec<Node>> {
    let mut nodes = Vec::new();
    if items.len() < PARALLEL {
        sequential(items, first, depth, &mut nodes);
        return Ok(nodes);
    }
    progress.check()?;
    let (bounds, middles) = extents(items);
    let Some(split) = split(items, bounds, middles, depth) else {
        return Ok(vec![leaf(bounds, first, items.len())]);
    };
    let (left, right) = items.split_at_mut(split);
    let right_first = first + split as u32;
    let (left, right) =
        rayon::join(|| subtree(left, first, depth + 1, progress), || subtree(right, right_first, depth + 1, progress));
    let (left, right) = (left?, right?);
    nodes.reserve_exact(1 + left.len() + right.len());
    nodes.push(inner(bounds, 1 + left.len()));
    for (part, shift) in [(&left, 1), (&right, 1 + left.len())] {
        nodes.extend(part.iter().map(|n| Node { link: n.link + if n.count == 0 { shift as u32 } else { 0 }, ..*n }));
    }
    Ok(nodes)
}

fn sequential(items: &mut [Item], first: u32, depth: usize, nodes: &mut Vec<Node>) {
    let (bounds, middles) = extents(items);
    let Some(split) = split(items, bounds, middles, depth) else {
        nodes.push(leaf(bounds, first, items.len()));
        return;
    };
    let place = nodes.len();
    nodes.push(inner(bounds, 0));
    let (left, right) = items.split_at_mut(split);
    sequential(left, first, depth + 1, nodes);
    nodes[place].link = nodes.len() as u32;
    sequential(right, first + split as u32, depth + 1, nodes);
}

fn leaf(bounds: Box3, first: u32, count: usize) -> Node {
    Node { lo: bounds.lo.to_array(), link: first, hi: bounds.hi.to_array(), count: count as u32 }
}

fn inner(bounds: Box3, right: usize) -> Node {
    Node { lo: bounds.lo.to_array(), link: right as u32, hi: bounds.hi.to_array(), count: 0 }
}

/// Box of the items, and of the doubled centres of their boxes.
fn extents(items: &[Item]) -> (Box3, Box3) {
    let of = |items: &[Item]| {
        items.iter().fold((Box3::EMPTY, Box3::EMPTY), |(b, m), i| (b.join(i.bounds()), m.add(i.middle())))
    };
    if items.len() < LARGE {
        return of(items);
    }
    items.par_chunks(PARALLEL).map(of).reduce(|| (Box3::EMPTY, Box3::EMPTY), |a, b| (a.0.join(b.0), a.1.join(b.1)))
}

/// Splits the items in place. Returns the place, or `None` for a leaf.
fn split(items: &mut [Item], bounds: Box3, middles: Box3, depth: usize) -> Option<usize> {
    if items.len() <= 1 {
        return None;
    }
    let size = middles.hi - middles.lo;
    if depth >= HEURISTIC_DEPTH || size.max_element() <= 0.0 {
        // Nothing to tell them apart by, or a tree too deep already: halves.
        return (items.len() > LEAF).then_some(items.len() / 2);
    }
    // A bin for about every item will do, or the bins cost more than the items.
    let count = (items.len().next_power_of_two() / 2).clamp(4, BINS);
    let scale = Vec3A::select(size.cmpgt(Vec3A::ZERO), (count as f32 * WITHIN) / size, Vec3A::ZERO);
    let bin_of = |i: &Item| ((i.middle() - middles.lo) * scale).min(Vec3A::splat((count - 1) as f32));
    let bins = fill(items, count, &bin_of);
    let Some((cost, axis, last)) = best_plane(&bins, count, size) else {
        return (items.len() > LEAF).then_some(items.len() / 2);
    };
    let (split_cost, leaf_cost) = (NODE_COST * bounds.half_area() + cost, items.len() as f32 * bounds.half_area());
    if items.len() <= MAX_LEAF && leaf_cost <= split_cost {
        return None;
    }
    let split = partition(items, |i| bin_of(i)[axis] < (last + 1) as f32);
    assert!(split > 0 && split < items.len(), "both sides of the cheapest plane have items");
    Some(split)
}

/// A box and the number of its triangles.
type Bin = (Box3, u32);
type Bins = [[Bin; BINS]; 3];

fn join(a: Bin, b: Bin) -> Bin {
    (a.0.join(b.0), a.1 + b.1)
}

fn fill(items: &[Item], count: usize, bin_of: &(impl Fn(&Item) -> Vec3A + Sync)) -> Bins {
    let of = |items: &[Item]| {
        let mut bins: Bins = [[(Box3::EMPTY, 0); BINS]; 3];
        for item in items {
            let bin = bin_of(item).as_ivec3().to_array();
            for axis in 0..3 {
                let slot = &mut bins[axis][bin[axis] as usize % BINS];
                *slot = join(*slot, (item.bounds(), 1));
            }
        }
        bins
    };
    if items.len() < LARGE {
        return of(items);
    }
    items.par_chunks(PARALLEL).map(of).reduce(
        || [[(Box3::EMPTY, 0); BINS]; 3],
        |mut a, b| {
            for axis in 0..3 {
                for k in 0..count {
                    a[axis][k] = join(a[axis][k], b[axis][k]);
                }
            }
            a
        },
    )
}

/// Cheapest plane: its cost (half area times triangles, both sides), its axis and the last bin on its left.
fn best_plane(bins: &Bins, count: usize, size: Vec3A) -> Option<(f32, usize, usize)> {
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in 0..3 {
        if size[axis] <= 0.0 {
            continue;
        }
        let mut right_cost = [f32::INFINITY; BINS];
        let mut right = (Box3::EMPTY, 0);
        for k in (1..count).rev() {
            right = join(right, bins[axis][k]);
            if right.1 > 0 {
                right_cost[k] = right.0.half_area() * right.1 as f32;
            }
        }
        let mut left = (Box3::EMPTY, 0);
        for k in 0..count - 1 {
            left = join(left, bins[axis][k]);
            if left.1 == 0 {
                continue;
            }
            let cost = left.0.half_area() * left.1 as f32 + right_cost[k + 1];
            if cost < f32::INFINITY && best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, k));
            }
        }
    }
    best
}

/// Moves the items that go left to the front and tells how many.
fn partition(items: &mut [Item], goes_left: impl Fn(&Item) -> bool) -> usize {
    let mut left = 0;
    for k in 0..items.len() {
        if goes_left(&items[k]) {
            items.swap(left, k);
            left += 1;
        }
    }
    left
}
