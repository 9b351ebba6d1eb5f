//! The nodes of a brick and those around it, with what votes say of them.

use crate::crossings::lattice::BRICK;

/// Nodes before the brick that are in its window: as many as there may be passes of smoothing.
pub const BEFORE: i32 = 2;
/// Nodes along each side of a window. After the brick's there is one more, where its last edges end.
pub const SIDE: usize = (BRICK + 2 * BEFORE + 1) as usize;
/// Places from node to node along the axes.
pub const STEPS: [usize; 3] = [1, SIDE, SIDE * SIDE];

/// Place of a node of a window in its brick.
pub fn place(index: u32) -> [i32; 3] {
    let index = index as usize;
    [index % SIDE, index / SIDE % SIDE, index / (SIDE * SIDE)].map(|x| x as i32 - BEFORE)
}

/// Sums of the votes of a node.
#[derive(Clone, Copy, Default)]
pub struct Node {
    /// Sum of distances, positive outside, by weight.
    pub distance: f64,
    /// Sum of the weights.
    pub weight: f64,
    /// Samples that vote: a mean over the axes.
    pub samples: f32,
    /// Sums of the normals' components along each axis, by weight.
    pub along: [f32; 3],
    /// Sums of the weights of each axis.
    pub along_weight: [f32; 3],
    /// The scan that votes, plus 1. [`MIXED`] where several do, or noisy ones, and 0 where none does.
    pub voter: u32,
    /// Labels by crossings of its edges: 1 outside, 2 inside.
    pub near: u8,
}

/// Several scans vote on a node, or noisy ones.
pub const MIXED: u32 = u32::MAX;

impl Node {
    /// Its label.
    pub fn is_inside(&self) -> bool {
        match self.near {
            1 if self.voter != MIXED => false,
            2 if self.voter != MIXED => true,
            _ => self.distance < 0.0,
        }
    }

    /// Whether there is a vote.
    pub fn is_known(&self) -> bool {
        self.voter != 0
    }

    /// Mean distance. 0 if votes have no weight, of lines that graze what they meet.
    pub fn mean(&self) -> f64 {
        if self.weight > 0.0 { self.distance / self.weight } else { 0.0 }
    }
}
