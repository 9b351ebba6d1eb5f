//! Regions of space, one a thread.
//!
//! A thread inserts a point only if every cell it would change has all its vertices in the thread's own region. Then no
//! two threads write to one cell: a cell outside of a cavity whose neighbour changes shares three vertices with it, so
//! at most one vertex of it is foreign, and no other thread can reach it. What can't be inserted is put off: to passes
//! with other regions, then to one thread. The tetrahedralization of a set of points is unique, so the outcome
//! does not depend on who inserted what when.

use glam::DVec3;

use super::cells::GHOST;

pub(super) trait Region: Sync {
    /// Whether all vertices, but for the one at infinity, lie in the region.
    fn owns(&self, vertices: [u32; 4], points: &[DVec3]) -> bool;
}

/// All of space, for a thread alone.
pub(super) struct Everywhere;

impl Region for Everywhere {
    #[inline(always)]
    fn owns(&self, _: [u32; 4], _: &[DVec3]) -> bool {
        true
    }
}

/// Points p with `low <= p < high` in all coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

impl Block {
    pub(super) fn everywhere() -> Self {
        Block { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY }
    }

    #[inline(always)]
    pub(super) fn holds(&self, p: DVec3) -> bool {
        (p.cmpge(self.low) & p.cmplt(self.high)).all()
    }
}

impl Region for Block {
    #[inline(always)]
    fn owns(&self, vertices: [u32; 4], points: &[DVec3]) -> bool {
        vertices.into_iter().all(|v| v == GHOST || self.holds(points[v as usize]))
    }
}

/// Cuts space into `count` blocks with about equally many of the points in each, across the axis along which they are spread
/// most (`axis` 0), or second or third most. Points that were put off lie around the last cut, so the next is another one.
pub(super) fn blocks(points: &[DVec3], ids: &[u32], count: usize, axis: usize) -> Vec<Block> {
    /// Points looked at to find a median.
    const SAMPLE: usize = 4096;
    let step = (ids.len() / SAMPLE).max(1);
    let mut sample: Vec<DVec3> = ids.iter().step_by(step).map(|&i| points[i as usize]).collect();
    let mut blocks = Vec::with_capacity(count);
    cut(&mut sample, Block::everywhere(), count, axis, &mut blocks);
    blocks
}

fn cut(sample: &mut [DVec3], block: Block, count: usize, axis: usize, blocks: &mut Vec<Block>) {
    if count <= 1 || sample.len() < 2 {
        blocks.push(block);
        return;
    }
    let share = (sample.len() as f64).recip();
    let middle = sample.iter().map(|&p| p * share).sum::<DVec3>();
    let spread = sample.iter().map(|&p| (p - middle).abs() * share).sum::<DVec3>();
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| spread[b].total_cmp(&spread[a]));
    let mut axis = axes[axis % 3];
    if spread[axis] == 0.0 {
        axis = axes[0];
    }
    let half = count / 2;
    let middle = sample.len() * half / count;
    sample.select_nth_unstable_by(middle, |a, b| a[axis].total_cmp(&b[axis]));
    let border = sample[middle][axis];
    let (mut below, mut above) = (block, block);
    below.high[axis] = border;
    above.low[axis] = border;
    let (left, right) = sample.split_at_mut(middle);
    cut(left, below, half, axis, blocks);
    cut(right, above, count - half, axis, blocks);
}
