//! Threads: each inserts what lies in a region of space of its own.
//!
//! A thread inserts a point only if every cell it would change has all its vertices in the thread's own region. Then no two threads write
//! to one cell. A cell outside of a cavity whose neighbour changes shares three vertices with it, so at most one vertex of it is foreign,
//! and no other thread can reach it. Points that can't be inserted are put off: to passes with other regions, then to one thread. The
//! tetrahedralization of a set of points is unique, so the outcome does not depend on who inserted what when. Most points that were given
//! up once were given up on the way there, not for their own cells: hence `starts`, and walks that turn aside.

use glam::DVec3;
use rayon::prelude::*;

use super::build::{Build, TICK};
use super::cells::Cells;
use super::insert::{Inserter, Outcome};
use super::region::{Block, Region};
use super::signs::Signs;
use super::starts::Starts;
use base::error::Result;
use base::progress::Progress;

/// Least speed of threads beside that of one alone, whose points wait for no memory of others.
const WORTH: f64 = 1.25;
/// Part of its points that a thread tries in spite of that: those it has to put off come in groups.
const PATIENCE: f64 = 1.0 / 16.0;

/// Whether `threads` that tried so many points each gain anything if so many of them were theirs to insert.
pub(super) fn is_worth(inserted: usize, tried: f64, threads: usize) -> bool {
    inserted as f64 * threads as f64 >= WORTH * tried
}

/// Points inserted one after the other in search of a cell that lies in a thread's block.
const TRIES: usize = 64;

/// Cuts space into `count` blocks with about equally many of the points in each, across the axis along which they are spread
/// most (`axis` 0), or second or third most. Points that were put off lie around the last cut, so the next is another one.
fn blocks(points: &[DVec3], ids: &[u32], count: usize, axis: usize) -> Vec<Block> {
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

/// Points that one thread inserts: those of its block, from a place in the order on.
struct Worker {
    block: Block,
    inserter: Inserter,
    begun: usize,
    /// Of all workers.
    threads: usize,
}

/// Points that a thread put off, and points that are copies, with their vertices.
#[derive(Default)]
struct Left {
    points: Vec<u32>,
    duplicates: Vec<[u32; 2]>,
    /// Whether there was no more room for cells.
    is_full: bool,
}

impl Worker {
    /// Whether the cell that it begins at is there, and its own.
    fn can_begin(&self, cells: &Cells, signs: &Signs<'_>) -> bool {
        cells.is_used(self.inserter.hint) && self.block.owns(cells.vertices(self.inserter.hint), signs.points)
    }

    /// Inserts a point, from a cell nearby where the way from the last one leads through cells of other threads.
    fn insert(&mut self, p: u32, starts: &mut Starts, cells: &Cells, signs: &Signs<'_>) -> Outcome {
        let place = signs.points[p as usize];
        let mut outcome = self.inserter.insert(cells, signs, &self.block, p);
        if outcome == Outcome::Unreached
            && let Some(start) = starts.near(place)
            && cells.is_used(start)
        {
            self.inserter.hint = start;
            outcome = self.inserter.insert(cells, signs, &self.block, p);
        }
        if outcome == Outcome::Inserted {
            starts.enter(place, self.inserter.hint);
        }
        outcome
    }

    fn insert_all(
        &mut self,
        ids: &[u32],
        starts: &mut Starts,
        cells: &Cells,
        signs: &Signs<'_>,
        progress: &Progress<'_>,
    ) -> Result<Left> {
        let mut left = Left::default();
        let mut since = 0;
        let block = self.block;
        let (mut inserted, mut tried) = (0, 0);
        let patience = PATIENCE / self.threads as f64 * ids.len() as f64;
        for p in block.of(&ids[self.begun..], signs.points) {
            if left.is_full || !is_worth(inserted, f64::from(tried) - patience, self.threads) {
                left.points.push(p);
                continue;
            }
            tried += 1;
            match self.insert(p, starts, cells, signs) {
                Outcome::Inserted => inserted += 1,
                Outcome::Duplicate(twin) => {
                    inserted += 1;
                    left.duplicates.push([p, twin]);
                }
                Outcome::Foreign | Outcome::Unreached => left.points.push(p),
                Outcome::Full => {
                    left.is_full = true;
                    left.points.push(p);
                }
            }
            since += 1;
            if since == TICK {
                progress.advance(since as u64)?;
                since = 0;
            }
        }
        Ok(left)
    }
}

impl Build<'_, '_> {
    /// Inserts the points that threads can insert each in a block of its own. Returns the rest.
    pub(super) fn insert_in_parallel(&mut self, ids: &[u32], threads: usize, axis: usize) -> Result<Vec<u32>> {
        let mut left = Vec::new();
        let mut workers = Vec::new();
        for block in blocks(self.signs.points, ids, threads, axis) {
            match self.begin(&block, ids)? {
                (begun, Some(inserter)) => workers.push(Worker { block, inserter, begun, threads }),
                (begun, None) => left.extend(block.of(&ids[begun..], self.signs.points)),
            }
        }
        let (cells, signs, progress) = (&self.cells, self.signs, self.progress);
        // The first points of later workers may have replaced the cell where an earlier one was to begin.
        workers.retain(|worker| {
            let can_begin = worker.can_begin(cells, signs);
            if !can_begin {
                left.extend(worker.block.of(&ids[worker.begun..], signs.points));
            }
            can_begin
        });
        // Before any thread begins: cells of other threads are not looked at from then on.
        let starts = |worker: &Worker| Starts::new(cells, &worker.block, signs.points, ids.len());
        let mut starts: Vec<Starts> = workers.par_iter().with_max_len(1).map(starts).collect();
        let insert =
            |(worker, starts): (&mut Worker, &mut Starts)| worker.insert_all(ids, starts, cells, signs, progress);
        let found = workers.par_iter_mut().zip(&mut starts).with_max_len(1).map(insert).collect::<Result<Vec<_>>>()?;
        for worker in workers {
            self.inserter.free.extend(worker.inserter.free);
            self.inserter.hint = worker.inserter.hint;
        }
        let is_full = found.iter().any(|of_worker| of_worker.is_full);
        for mut of_worker in found {
            left.append(&mut of_worker.points);
            self.duplicates.append(&mut of_worker.duplicates);
        }
        // The order of insertion follows the curve.
        left.sort_unstable();
        if is_full {
            // For the points that are left as many cells each as for those that are there.
            let there = (ids[ids.len() - 1] as usize + 1 - left.len()).max(1);
            self.cells.grow((self.cells.taken() as f64 / there as f64 * left.len() as f64) as usize)?;
        }
        Ok(left)
    }

    /// Inserts the first points of a block, here, until one has a cell in it, from which a thread can go on. Returns the place in
    /// the order up to which the block's points are inserted then, and no inserter where that was in vain.
    fn begin(&mut self, block: &Block, ids: &[u32]) -> Result<(usize, Option<Inserter>)> {
        let mut tried = 0;
        for (i, &p) in ids.iter().enumerate() {
            if !block.holds(self.signs.points[p as usize]) {
                continue;
            }
            self.insert(p)?;
            tried += 1;
            let is_own = |&cell: &u32| block.owns(self.cells.vertices(cell), self.signs.points);
            if let Some(hint) = self.inserter.star().iter().copied().find(is_own) {
                return Ok((i + 1, Some(Inserter::new(hint))));
            }
            if tried == TRIES {
                return Ok((i + 1, None));
            }
        }
        Ok((ids.len(), None))
    }
}
