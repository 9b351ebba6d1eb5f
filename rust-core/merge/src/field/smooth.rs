//! Stage 4, where it is needed. The mean distance of a node is made that of the node and its neighbours if too few samples vote for it to
//! be better than a tenth of a cell.
//!
//! Votes of a place have errors in common: errors of a scan's pose, and errors of pixels that depend on their neighbours. These do not go
//! when the votes of a node are averaged, but differ from node to node. Neighbours say where the surface passes the node by their distance
//! and the mean normal \[KW93\]. That is half way between their own normal and that of the surroundings, so that a surface that bends
//! evenly stays where it is. The further scans lie from each other, the less a node knows of its normal.

use super::nodes::{BEFORE, MIXED, Node, SIDE, STEPS, place};
use crate::crossings::lattice::BRICK;

/// Noise of a node's mean, in cells, from which on the first pass smooths it. Twice this, and the second does.
const FROM: f64 = 0.1;

/// The nodes around one and itself: the weight of each, and the way to it.
const AROUND: [(f64, [f64; 3]); 27] = {
    let of_step = [1.0, 2.0, 1.0];
    let mut around = [(0.0, [0.0; 3]); 27];
    let mut n = 0;
    while n < 27 {
        let [i, j, k] = [n % 3, n / 3 % 3, n / 9];
        around[n] = (of_step[i] * of_step[j] * of_step[k], [i as f64 - 1.0, j as f64 - 1.0, k as f64 - 1.0]);
        n += 1;
    }
    around
};

/// The values of a node that are smoothed.
#[derive(Clone, Copy, Default)]
struct Mean {
    /// Distance to the surface, positive outside.
    distance: f64,
    weight: f64,
    /// Growth of it along the axes: the mean normal.
    slope: [f64; 3],
}

/// Passes that smooth anything where the distance between a scan and the surface has this standard deviation, in cells: each
/// needs the nodes around what it smooths.
pub fn passes(spread: f64) -> i32 {
    ((spread / FROM).ceil() as i32 - 1).clamp(0, BEFORE)
}

/// Smooths window after window, keeping its buffers.
pub struct Smoother {
    /// Of all nodes. If no vote is heard the weight is 0.
    means: Vec<Mean>,
    changed: Vec<(u32, f64)>,
}

impl Default for Smoother {
    fn default() -> Self {
        Smoother { means: vec![Mean::default(); SIDE * SIDE * SIDE], changed: Vec::new() }
    }
}

impl Smoother {
    /// Smooths the means of the nodes of a brick. `touched` are those of its window with votes. Votes are complete in as many nodes around
    /// the brick as there are passes.
    pub fn smooth(&mut self, nodes: &mut [Node], touched: &[u32], spread: f64) {
        let passes = passes(spread);
        if passes == 0 {
            return;
        }
        for &index in touched {
            let node = &nodes[index as usize];
            let slope = [0, 1, 2].map(|a| f64::from(node.along[a] / node.along_weight[a].max(f32::MIN_POSITIVE)));
            self.means[index as usize] = Mean { distance: node.mean(), weight: node.weight, slope };
        }
        let own = 0.5 * (1.0 - spread).max(0.0);
        for pass in 1..=passes {
            let reach = passes - pass;
            for &index in touched {
                let node = &nodes[index as usize];
                let noise = spread / f64::from(node.samples).max(1.0).sqrt();
                let share = (noise / FROM - f64::from(pass)).clamp(0.0, 1.0);
                let is_inside = || place(index).iter().all(|x| (-reach..=BRICK + reach).contains(x));
                if share > 0.0 && node.voter == MIXED && is_inside() {
                    let before = self.means[index as usize].distance;
                    let smoothed = before + share * (self.around(index, own) - before);
                    self.changed.push((index, smoothed));
                }
            }
            for (index, distance) in self.changed.drain(..) {
                self.means[index as usize].distance = distance;
            }
        }
        for &index in touched {
            let mean = std::mem::take(&mut self.means[index as usize]);
            let node = &mut nodes[index as usize];
            node.distance = mean.distance * node.weight;
        }
    }

    /// The distance of a node, by itself and those around it. `own` is the share of their own normals in that.
    fn around(&self, index: u32, own: f64) -> f64 {
        let first = index as usize - STEPS[0] - STEPS[1] - STEPS[2];
        let (mut sum, mut total, mut centroid, mut slope) = (0.0, 0.0, [0.0; 3], [0.0; 3]);
        for (n, (kernel, step)) in AROUND.iter().enumerate() {
            let beside = &self.means[first + n % 3 * STEPS[0] + n / 3 % 3 * STEPS[1] + n / 9 * STEPS[2]];
            let weight = kernel * beside.weight;
            let rise = step[0] * beside.slope[0] + step[1] * beside.slope[1] + step[2] * beside.slope[2];
            sum += weight * (beside.distance - own * rise);
            total += weight;
            for axis in 0..3 {
                centroid[axis] += weight * step[axis];
                slope[axis] += weight * beside.slope[axis];
            }
        }
        if total == 0.0 {
            return 0.0;
        }
        let rise = (centroid[0] * slope[0] + centroid[1] * slope[1] + centroid[2] * slope[2]) / total;
        (sum - (1.0 - own) * rise) / total
    }
}
