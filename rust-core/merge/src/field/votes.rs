//! Votes of crossings on nodes, labels that these come to, and the vertices between nodes of different labels.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::nodes::{BEFORE, MIXED, Node, SIDE, STEPS, place};
use super::smooth::{self, Smoother};
use crate::crossings::crossing::{BundleKey, OnLine};
use crate::crossings::edge_colours::{Gains, Poll};
use crate::crossings::edge_sums::EdgeSums;
use crate::crossings::lattice::{ACROSS, BRICK, BRICK_BITS, ROWS, row};
use crate::crossings::lines::SortedBundle;

/// Rows of 32 nodes, one bit per node.
pub type Plane = [u32; ROWS];

/// The labels that crossings give the nodes of a brick.
#[derive(PartialEq, Eq)]
pub struct BrickLabels {
    /// Nodes labelled inside.
    pub inside: Plane,
    /// Nodes labelled outside.
    pub outside: Plane,
    /// Lowest and highest labelled node along each axis.
    pub bounds: [[i32; 2]; 3],
}

/// All bundles with their index.
pub struct Bundles<T = EdgeSums> {
    /// Ordered by key.
    pub list: Vec<Arc<SortedBundle<T>>>,
    index: FxHashMap<BundleKey, u32>,
}

impl<T: OnLine> Bundles<T> {
    /// Indexes the bundles.
    pub fn new(list: Vec<Arc<SortedBundle<T>>>) -> Self {
        let index = list.iter().enumerate().map(|(i, b)| (b.key, i as u32)).collect();
        Bundles { list, index }
    }

    /// The bundle along `axis` through a brick.
    pub fn through(&self, axis: usize, brick: [i32; 3]) -> Option<&SortedBundle<T>> {
        let [u, v] = ACROSS[axis];
        let key = BundleKey { axis: axis as u8, across: [brick[u], brick[v]] };
        self.index.get(&key).map(|&i| &*self.list[i as usize])
    }

    /// Every brick in which a crossing labels a node, in order.
    pub fn labelled_bricks(&self) -> Vec<[i32; 3]> {
        let mut bricks = Vec::new();
        for bundle in &self.list {
            let axis = bundle.key.axis as usize;
            let [u, v] = ACROSS[axis];
            let mut brick = [0; 3];
            [brick[u], brick[v]] = bundle.key.across;
            for &(along, _) in &bundle.bricks {
                for along in along - 1..=along + 1 {
                    brick[axis] = along;
                    bricks.push(brick);
                }
            }
        }
        bricks.sort_unstable();
        bricks.dedup();
        bricks
    }
}

/// A vertex: where the surface meets an edge of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Lower node of its edge within the brick: x + 32 y + 1024 z.
    pub node: u16,
    /// Whether the lower node is outside.
    pub enters: bool,
    /// Place on the edge, 0 to 1.
    pub fraction: f32,
    /// Trust, summed over the scans.
    pub weight: f32,
    /// Standard deviation of the samples here along their rays, cells.
    pub noise: f32,
    /// Colour, sRGB with straight alpha: 0 where no scan has one.
    pub colour: [u8; 4],
    /// The scan of largest trust, -1 where no crossing of its line is near.
    pub scan: i32,
}

/// The vertices of a brick, by the axis of their edge.
pub type Vertices = [Vec<Vertex>; 3];

/// Labels by brick.
pub type Labels = FxHashMap<[i32; 3], Box<BrickLabels>>;
/// Vertices by brick.
pub type BrickVertices = FxHashMap<[i32; 3], Vertices>;

/// Rule for how far votes are heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoteRule {
    /// Distance from a crossing, in cells along its normal, within which it speaks of nodes.
    pub reach: f64,
    /// Standard deviation of the distance between a scan and the surface, in cells.
    pub spread: f64,
}

/// Distance sideways of a crossing, in cells, within which it speaks of nodes: beyond, the surface may have bent.
const SIDEWAYS: f64 = 1.2;
/// No crossing speaks of nodes further along its line than this.
const FARTHEST: f64 = 16.0;
/// Half the thickness, in cells, below which what is known of the place of a sheet's sides, without the bias of smoothing, is
/// not used: its noise may turn them inside out.
const HALF_A_SHEET: f64 = 0.75;
/// Distance from nodes, in cells, that vertices of sheets keep which the votes would put beyond.
const INSET: f64 = 0.02;
/// The rest of a vote's weight beyond half way to the next surface.
const BEYOND: f64 = 1e-6;
/// Share of the weight nearby from which on clean crossings of an edge have a say about its vertex. With all of it they decide.
const CERTAIN: f64 = 0.9;

impl VoteRule {
    /// Distance along its line within which crossings of this mean normal are heard.
    fn along(&self, normal: f64) -> f64 {
        let across = (1.0 - normal * normal).max(0.0).sqrt();
        (self.reach / normal.abs()).min(SIDEWAYS / across).clamp(1.0, FARTHEST)
    }
}

/// Labels brick after brick, keeping its buffers.
pub struct Field {
    nodes: Vec<Node>,
    touched: Vec<u32>,
    smoother: Smoother,
    poll: Poll,
}

impl Default for Field {
    fn default() -> Self {
        Field {
            nodes: vec![Node::default(); SIDE * SIDE * SIDE],
            touched: Vec::new(),
            smoother: Smoother::default(),
            poll: Poll::default(),
        }
    }
}

impl Field {
    /// Labels the nodes of a brick and finds its vertices. `None` if no crossing says anything about any of them.
    pub fn label(
        &mut self,
        bundles: &Bundles,
        brick: [i32; 3],
        rule: &VoteRule,
        gains: &Gains,
    ) -> Option<(Box<BrickLabels>, Vertices)> {
        (0..3).for_each(|axis| self.votes_along(axis, bundles, brick, rule));
        if self.touched.is_empty() {
            return None;
        }
        let mut labels = Box::new(BrickLabels { inside: [0; ROWS], outside: [0; ROWS], bounds: [[BRICK, -1]; 3] });
        let mut vertices = Vertices::default();
        self.touched.sort_unstable();
        self.smoother.smooth(&mut self.nodes, &self.touched, rule.spread);
        for &index in &self.touched {
            let at = place(index);
            if !at.iter().all(|x| (0..BRICK).contains(x)) {
                continue;
            }
            let node = &self.nodes[index as usize];
            let is_inside = node.is_inside();
            for (bounds, along) in labels.bounds.iter_mut().zip(at) {
                *bounds = [bounds[0].min(along), bounds[1].max(along)];
            }
            let of_label = if is_inside { &mut labels.inside } else { &mut labels.outside };
            of_label[row(at[1], at[2])] |= 1 << at[0];
            for axis in 0..3 {
                let upper = &self.nodes[index as usize + STEPS[axis]];
                if upper.is_known() && upper.is_inside() != is_inside {
                    let ends = [node.mean(), upper.mean()];
                    // Sure labels may say other than the votes.
                    let zero = if (ends[0] < 0.0) == (ends[1] < 0.0) { 0.5 } else { ends[0] / (ends[0] - ends[1]) };
                    let edge = Edge { axis, brick, at };
                    vertices[axis].push(vertex(bundles, &edge, zero, is_inside, rule, gains, &mut self.poll));
                }
            }
        }
        for &index in &self.touched {
            self.nodes[index as usize] = Node::default();
        }
        self.touched.clear();
        Some((labels, vertices))
    }

    /// The votes on the nodes of a window by the crossings of its lines along an axis.
    fn votes_along(&mut self, axis: usize, bundles: &Bundles, brick: [i32; 3], rule: &VoteRule) {
        let [u, v] = ACROSS[axis];
        let passes = smooth::passes(rule.spread);
        let window = -passes..=BRICK + passes;
        for (du, dv) in (0..9).map(|i| (i % 3 - 1, i / 3 - 1)) {
            let mut beside = brick;
            (beside[u], beside[v]) = (brick[u] + du, brick[v] + dv);
            let Some(bundle) = bundles.through(axis, beside) else { continue };
            for along in brick[axis] - 1..=brick[axis] + 1 {
                for edge in bundle.in_brick(along) {
                    let line = edge.line() as i32;
                    let [at_u, at_v] = [(line & (BRICK - 1)) + du * BRICK, (line >> BRICK_BITS) + dv * BRICK];
                    // Of the bricks beside only the nearest lines are in the window.
                    if window.contains(&at_u) && window.contains(&at_v) {
                        let first = (at_u + BEFORE) as usize * STEPS[u] + (at_v + BEFORE) as usize * STEPS[v];
                        self.vote(axis, first, edge, brick[axis] << BRICK_BITS, rule);
                    }
                }
            }
        }
    }

    #[inline]
    fn vote(&mut self, axis: usize, first: usize, edge: &EdgeSums, first_node: i32, rule: &VoteRule) {
        let (normal, fraction, weight) = (edge.normal(), edge.fraction(), edge.weight());
        // A sheet stays thick enough to have a node inside.
        let spare = (edge.room(false).min(edge.room(true)) * normal.abs() - HALF_A_SHEET).max(0.0);
        let residual = edge.residual().clamp(-spare, spare);
        let below = edge.cell - first_node;
        let place = f64::from(below) + fraction;
        let reach = rule.along(normal);
        // The place of the surface, without the bias of smoothing; on grazing lines that says nothing.
        let middle = place + (residual / normal).clamp(-1.0, 1.0);
        // The nodes of its edge always, others no further than half way to the next surface.
        let passes = smooth::passes(rule.spread);
        let window = [-passes, BRICK + passes].map(f64::from);
        let from = (middle - reach).max(place - edge.room(false)).ceil().min(f64::from(below)).max(window[0]);
        let to = (middle + reach).min(place + edge.room(true)).floor().max(f64::from(below + 1));
        let to = to.min(window[1]);
        let voter = edge.only_scan().filter(|_| edge.is_clean()).map_or(MIXED, |scan| scan + 1);
        // The squares of a normal's components add up to one.
        let samples = (f64::from(edge.count()) * normal * normal) as f32;
        for along in from as i32..=to as i32 {
            let index = first + (along + BEFORE) as usize * STEPS[axis];
            let node = &mut self.nodes[index];
            if !node.is_known() {
                self.touched.push(index as u32);
            }
            // Beyond half way only where nothing else is known: there the next surface speaks.
            let is_beyond = f64::from(along) < place - edge.room(false) || f64::from(along) > place + edge.room(true);
            let weight = if is_beyond { BEYOND * weight } else { weight };
            node.weight += weight;
            node.samples += samples;
            node.along[axis] += (weight * normal) as f32;
            node.along_weight[axis] += weight as f32;
            node.distance += weight * (normal * (f64::from(along) - place) - residual);
            node.voter = if node.voter == 0 || node.voter == voter { voter } else { MIXED };
            if along == below || along == below + 1 {
                node.near |= if (along == below) == edge.enters() { 1 } else { 2 };
            }
        }
    }
}

/// An edge of the grid: its axis, its brick, and its lower node there.
struct Edge {
    axis: usize,
    brick: [i32; 3],
    at: [i32; 3],
}

/// The vertex of an edge whose votes are zero at `zero`: what is known of its line tells the rest.
fn vertex(
    bundles: &Bundles,
    edge: &Edge,
    zero: f64,
    lower_is_inside: bool,
    rule: &VoteRule,
    gains: &Gains,
    poll: &mut Poll,
) -> Vertex {
    let &Edge { axis, brick, at } = edge;
    let [u, v] = ACROSS[axis];
    let line = (at[v] << BRICK_BITS | at[u]) as usize;
    let cell = (brick[axis] << BRICK_BITS) + at[axis];
    let (mut total, mut certain, mut place) = (0.0, 0.0, zero);
    let (mut along_line, mut is_thin) = (0.0, false);
    let (mut trust, mut noise, mut strongest) = (0.0, 0.0, None::<&EdgeSums>);
    let farthest = FARTHEST as i32;
    if let Some(bundle) = bundles.through(axis, brick) {
        for along in (cell - farthest) >> BRICK_BITS..=(cell + farthest) >> BRICK_BITS {
            let list = bundle.in_brick(along);
            let from = list.partition_point(|t| (t.line(), t.cell) < (line, cell - farthest));
            for edge in list[from..].iter().take_while(|t| t.line() == line && t.cell <= cell + farthest) {
                let offset = f64::from(edge.cell - cell) + edge.fraction();
                if edge.enters() == lower_is_inside || (offset - zero).abs() > rule.along(edge.normal()) {
                    continue;
                }
                let weight = edge.weight();
                total += weight;
                along_line += weight * offset;
                let own = edge.fraction();
                is_thin |= edge.cell == cell && (own > edge.room(false) || 1.0 - own > edge.room(true));
                if edge.cell == cell && edge.is_clean() {
                    (certain, place) = (weight, edge.fraction());
                }
                trust += edge.trust();
                noise += weight * edge.deviation();
                poll.add(edge.members(), edge.count(), gains);
                if strongest.is_none_or(|s| {
                    edge.largest_trust() > s.largest_trust()
                        || (edge.largest_trust() == s.largest_trust() && edge.scan < s.scan)
                }) {
                    strongest = Some(edge);
                }
            }
        }
    }
    // If another surface speaks of one of the edge's nodes, their means are of two surfaces.
    let zero = if is_thin && total > 0.0 { (along_line / total).clamp(INSET, 1.0 - INSET) } else { zero };
    let certainty = if total > 0.0 { ((certain / total - CERTAIN) / (1.0 - CERTAIN)).clamp(0.0, 1.0) } else { 0.0 };
    // Of certainty 1 to the bit.
    let place = if certainty == 1.0 { place } else { zero + certainty * (place - zero) };
    Vertex {
        node: (at[0] | at[1] << BRICK_BITS | at[2] << (2 * BRICK_BITS)) as u16,
        enters: !lower_is_inside,
        fraction: place as f32,
        weight: trust as f32,
        noise: if total > 0.0 { (noise / total) as f32 } else { 0.0 },
        colour: poll.decide(),
        scan: strongest.map_or(-1, |edge| edge.scan as i32),
    }
}
