//! The paper's labels: which nodes are inside. [MI04, sec. 3.3]
//!
//! A fused crossing says of the nodes beyond it along its line that they are inside, of those before it that they are outside. Each node
//! weighs these words of the crossings around it by their trust and by their distance to the node along the normal. Its label is the sign
//! of the sum. If all agree this is the paper's classification. If fusing has moved a surface past a node, the lines through the node may
//! disagree. One label per node settles it. The artificial crossings follow as the edges whose two labelled nodes differ without a crossing
//! between them.

use crate::crossings::crossing::Crossing;
use crate::crossings::lattice::{ACROSS, BRICK, BRICK_BITS, ROWS};
use crate::field::{BrickLabels, Bundles};

/// A crossing this close to a node, in cells, still has a say about it.
const NEAREST: f32 = 1e-3;

/// Sums of one kind of votes.
#[derive(Clone, Copy, Default)]
struct Votes {
    /// Votes of crossings of the edges at the node, positive for inside.
    near: f32,
    /// Votes of crossings one edge further along a line. They count only if no nearer one speaks.
    far: f32,
    /// Voters: bit 0 edges at the node, bit 1 edges further along.
    said: u8,
}

/// Labels brick after brick, keeping its buffers.
pub struct Classifier {
    votes: Vec<Votes>,
    touched: Vec<u16>,
}

impl Default for Classifier {
    fn default() -> Self {
        Classifier { votes: vec![Votes::default(); ROWS << BRICK_BITS], touched: Vec::new() }
    }
}

impl Classifier {
    /// Labels the nodes of a brick. `None` if no crossing says anything about any of them.
    pub fn label(&mut self, bundles: &Bundles<Crossing>, brick: [i32; 3]) -> Option<Box<BrickLabels>> {
        for axis in 0..3 {
            let Some(bundle) = bundles.through(axis, brick) else { continue };
            // A crossing speaks of two nodes on either side: neighbours along the axis reach in.
            for along in brick[axis] - 1..=brick[axis] + 1 {
                for crossing in bundle.in_brick(along) {
                    self.vote(axis, crossing, brick[axis] << BRICK_BITS);
                }
            }
        }
        if self.touched.is_empty() {
            return None;
        }
        let mut labels = Box::new(BrickLabels { inside: [0; ROWS], outside: [0; ROWS], bounds: [[BRICK, -1]; 3] });
        for &node in &self.touched {
            let votes = std::mem::take(&mut self.votes[node as usize]);
            let (row, bit) = (node as usize >> BRICK_BITS, 1_u32 << (i32::from(node) & (BRICK - 1)));
            let sum = if votes.said & 1 != 0 { votes.near } else { votes.far };
            for (i, bounds) in labels.bounds.iter_mut().enumerate() {
                let along = i32::from(node) >> (BRICK_BITS * i as u32) & (BRICK - 1);
                *bounds = [bounds[0].min(along), bounds[1].max(along)];
            }
            if sum > 0.0 {
                labels.inside[row] |= bit;
            } else {
                labels.outside[row] |= bit;
            }
        }
        self.touched.clear();
        Some(labels)
    }

    #[inline]
    fn vote(&mut self, axis: usize, crossing: &Crossing, first_node: i32) {
        let below = crossing.cell - first_node;
        if !(-2..=BRICK).contains(&below) {
            return;
        }
        let line = crossing.line() as i32;
        let (u, v) = (line & (BRICK - 1), line >> BRICK_BITS);
        // Nodes are numbered x + 32 y + 1024 z.
        let shifts = [0, BRICK_BITS, 2 * BRICK_BITS];
        let [across_u, across_v] = ACROSS[axis];
        let base = u << shifts[across_u] | v << shifts[across_v];
        let trust = (crossing.weight + 1e-6) * crossing.normal.abs();
        let trust = if crossing.enters() { trust } else { -trust };
        let mut say = |along: i32, vote: f32, near: bool| {
            if (0..BRICK).contains(&along) {
                let node = base | along << shifts[axis];
                let votes = &mut self.votes[node as usize];
                if votes.said == 0 {
                    self.touched.push(node as u16);
                }
                if near {
                    votes.said |= 1;
                    votes.near += vote;
                } else {
                    votes.said |= 2;
                    votes.far += vote;
                }
            }
        };
        let t = crossing.fraction;
        say(below, -trust * t.max(NEAREST), true);
        say(below + 1, trust * (1.0 - t).max(NEAREST), true);
        if !crossing.has_neighbour(false) {
            say(below - 1, -trust * (1.0 + t), false);
        }
        if !crossing.has_neighbour(true) {
            say(below + 2, trust * (2.0 - t), false);
        }
    }
}
