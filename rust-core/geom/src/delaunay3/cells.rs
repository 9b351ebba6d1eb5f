//! The tetrahedra: four vertices and four neighbours each, 32 bytes, no coordinates.
//!
//! Threads share the array. Each changes only cells whose vertices lie in its own region (see `parallel`), so relaxed loads and stores,
//! which cost no more than plain ones, are all it takes.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use rayon::prelude::*;

use super::tetrahedra::{self, INFINITE};
use base::error::{Error, Result};
use base::progress::{Pace, Progress};

/// The vertex at infinity, always in slot 3 of its cells, which are outside the convex hull.
pub(super) const GHOST: u32 = (1 << 30) - 1;
/// Largest number of cells: a facet's number, 4 cell + slot, has 32 bits.
const LIMIT: usize = 1 << 30;
/// In the first vertex of a cell: in conflict with the point being inserted.
pub(super) const CONFLICT: u32 = 1 << 31;
/// In place of the first vertex: the cell is not in use.
const UNUSED: u32 = u32::MAX;
/// Cells that a thread takes at a time.
const CHUNK: usize = 1024;

/// Slots of the vertices of the facet opposite to each slot, counter-clockwise seen from outside of a positively
/// oriented cell.
pub(super) const FACETS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Vertices, then neighbours as facets of theirs: 4 cell + slot of the vertex opposite to the shared facet.
type Cell = [AtomicU32; 8];

pub(super) struct Cells {
    data: Vec<Cell>,
    /// Cells handed out, as chunks.
    taken: AtomicU32,
}

impl Cells {
    /// Room for `count` cells. Memory is touched only as cells are used.
    pub(super) fn with_room(count: usize) -> Result<Self> {
        let count = count.next_multiple_of(CHUNK).min(LIMIT);
        let data = bytemuck::try_zeroed_vec(count).map_err(|()| out_of_memory(count))?;
        Ok(Cells { data, taken: AtomicU32::new(0) })
    }

    /// Cells for which there is room.
    #[cfg(test)]
    pub(super) fn room(&self) -> usize {
        self.data.len()
    }

    /// Makes room for at least `more` cells.
    pub(super) fn grow(&mut self, more: usize) -> Result<()> {
        let more = more.max(self.data.len() / 8).next_multiple_of(CHUNK);
        let count = self.data.len() + more;
        if count > LIMIT {
            return Err(out_of_memory(count));
        }
        self.data.try_reserve_exact(more).map_err(|_| out_of_memory(count))?;
        self.data.resize_with(count, Default::default);
        Ok(())
    }

    /// Puts the numbers of unused cells into `free` until it holds `wanted`. Returns false if there is no room.
    #[inline]
    pub(super) fn supply(&self, free: &mut Vec<u32>, wanted: usize) -> bool {
        while free.len() < wanted {
            let taken = self.taken.fetch_add(CHUNK as u32, Relaxed);
            if taken as usize + CHUNK > self.data.len() {
                self.taken.fetch_sub(CHUNK as u32, Relaxed);
                return false;
            }
            for cell in (taken..taken + CHUNK as u32).rev() {
                free.push(cell);
            }
        }
        true
    }

    /// The vertices. The first with its mark.
    #[inline(always)]
    pub(super) fn marked_vertices(&self, cell: u32) -> [u32; 4] {
        let c = &self.data[cell as usize];
        [c[0].load(Relaxed), c[1].load(Relaxed), c[2].load(Relaxed), c[3].load(Relaxed)]
    }

    #[inline(always)]
    pub(super) fn vertices(&self, cell: u32) -> [u32; 4] {
        let mut vertices = self.marked_vertices(cell);
        vertices[0] &= GHOST;
        vertices
    }

    #[inline(always)]
    pub(super) fn neighbours(&self, cell: u32) -> [u32; 4] {
        let c = &self.data[cell as usize];
        [c[4].load(Relaxed), c[5].load(Relaxed), c[6].load(Relaxed), c[7].load(Relaxed)]
    }

    #[inline(always)]
    pub(super) fn neighbour(&self, cell: u32, slot: usize) -> u32 {
        self.data[cell as usize][4 + (slot & 3)].load(Relaxed)
    }

    #[inline(always)]
    pub(super) fn set(&self, cell: u32, vertices: [u32; 4], neighbours: [u32; 4]) {
        let c = &self.data[cell as usize];
        for slot in 0..4 {
            c[slot].store(vertices[slot], Relaxed);
            c[4 + slot].store(neighbours[slot], Relaxed);
        }
    }

    /// Says that facet `facet` borders on facet `other`, not the reverse.
    #[inline(always)]
    pub(super) fn set_neighbour(&self, facet: u32, other: u32) {
        self.data[(facet >> 2) as usize][4 + (facet & 3) as usize].store(other, Relaxed);
    }

    /// Sets the first vertex with its mark.
    #[inline(always)]
    pub(super) fn mark(&self, cell: u32, first: u32) {
        self.data[cell as usize][0].store(first, Relaxed);
    }

    #[inline(always)]
    pub(super) fn unmark(&self, cell: u32) {
        let first = &self.data[cell as usize][0];
        first.store(first.load(Relaxed) & GHOST, Relaxed);
    }

    pub(super) fn is_used(&self, cell: u32) -> bool {
        self.marked_vertices(cell)[0] != UNUSED
    }

    /// Number of numbers that were handed out: all cells have lower ones.
    pub(super) fn taken(&self) -> u32 {
        self.taken.load(Relaxed)
    }

    pub(super) fn release(&self, cell: u32) {
        self.data[cell as usize][0].store(UNUSED, Relaxed);
    }

    /// Closes the gaps that the cells in `free` leave, and hands out the rest: finite cells first, ghosts after them,
    /// neighbours as cell numbers, vertices as numbered by `ids`.
    pub(super) fn compact(
        mut self,
        free: &[u32],
        ids: &[u32],
        progress: &Progress<'_>,
    ) -> Result<(Vec<tetrahedra::Cell>, usize)> {
        let mut pace = Pace::new(progress);
        for &cell in free {
            self.release(cell);
        }
        let taken = *self.taken.get_mut() as usize;
        let ranks: Vec<[u8; 2]> = self.data[..taken]
            .par_chunks(CHUNK)
            .map(|cells| progress.check().map(|()| hand_out(cells, ids)))
            .collect::<Result<_>>()?;
        let mut start = 0;
        let mut ends = [0; 2];
        // Two pointers close in on each other for each border; at first past chunks at a time.
        for (border, end) in ends.iter_mut().enumerate() {
            let mut stop = taken;
            let is_chunk = |at: usize| border == 0 && at.is_multiple_of(CHUNK);
            loop {
                pace.after(16)?;
                while start < stop {
                    if is_chunk(start) && start + CHUNK <= stop && ranks[start / CHUNK][1] == 0 {
                        start += CHUNK;
                    } else if usize::from(rank(&self.data[start])) <= border {
                        start += 1;
                    } else {
                        break;
                    }
                }
                while start < stop {
                    if is_chunk(stop) && start + CHUNK <= stop && ranks[stop / CHUNK - 1][0] > 0 {
                        stop -= CHUNK;
                    } else if usize::from(rank(&self.data[stop - 1])) > border {
                        stop -= 1;
                    } else {
                        break;
                    }
                }
                if start == stop {
                    break;
                }
                self.exchange(start as u32, stop as u32 - 1);
                // Before a chunk is passed by its ranks, which say nothing of a cell that was exchanged.
                (start, stop) = (start + 1, stop - 1);
            }
            *end = stop;
        }
        self.data.truncate(ends[1]);
        // Same size and alignment: the standard library converts in place.
        let cells = self.data.into_iter().map(|c| {
            let [a, b, c, d, e, f, g, h] = c.map(AtomicU32::into_inner);
            tetrahedra::Cell { vertices: [a, b, c, d], neighbours: [e, f, g, h] }
        });
        Ok((cells.collect(), ends[0]))
    }

    /// Exchanges two cells that are handed out already.
    fn exchange(&mut self, a: u32, b: u32) {
        self.data.swap(a as usize, b as usize);
        let renumber = |neighbour: &mut AtomicU32| match neighbour.get_mut() {
            cell if *cell == a => *cell = b,
            cell if *cell == b => *cell = a,
            _ => {}
        };
        let mut done = [u32::MAX; 4];
        for cell in [a, b] {
            if rank(&self.data[cell as usize]) == UNUSED_RANK {
                continue;
            }
            self.data[cell as usize][4..].iter_mut().for_each(renumber);
            let beside = self.neighbours(cell);
            for other in beside.into_iter().filter(|&other| other != a && other != b && !done.contains(&other)) {
                self.data[other as usize][4..].iter_mut().for_each(renumber);
            }
            done = beside;
        }
    }
}

/// Rank of a cell that is not in use.
const UNUSED_RANK: u8 = 2;

/// Place of a cell handed out among others: 0 finite, 1 at infinity, 2 unused.
fn rank(cell: &Cell) -> u8 {
    if cell[0].load(Relaxed) == UNUSED {
        return UNUSED_RANK;
    }
    u8::from(cell[3].load(Relaxed) == INFINITE)
}

/// Gives the vertices their numbers before sorting, and takes the slots from the neighbours. Returns the least and the
/// greatest rank.
fn hand_out(cells: &[Cell], ids: &[u32]) -> [u8; 2] {
    let mut ranks = [UNUSED_RANK, 0];
    for cell in cells {
        if cell[0].load(Relaxed) != UNUSED {
            for vertex in &cell[..4] {
                let v = vertex.load(Relaxed);
                vertex.store(if v == GHOST { INFINITE } else { ids[v as usize] }, Relaxed);
            }
            for neighbour in &cell[4..] {
                neighbour.store(neighbour.load(Relaxed) >> 2, Relaxed);
            }
        }
        let rank = rank(cell);
        ranks = [ranks[0].min(rank), ranks[1].max(rank)];
    }
    ranks
}

fn out_of_memory(cells: usize) -> Error {
    Error::OutOfMemory(format!(
        "a tetrahedralization of about {cells} cells would take {:.1} GB: reduce the number of points",
        cells as f64 * 32.0 / 1e9
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing stays of a few cells that are not in use, also beside the borders of chunks that are passed at once.
    #[test]
    fn what_is_not_in_use_is_gone() {
        let edges = [0, 1, 1022, 1023, 1024, 1025, 2046, 2047, 2048, 3070, 3071];
        let sets = edges.iter().flat_map(|&a| edges.iter().map(move |&b| [a, b]));
        for unused in sets {
            for ghost in [None, Some(3071), Some(1024)] {
                let cells = Cells::with_room(3 * CHUNK).unwrap();
                let mut free = Vec::new();
                assert!(cells.supply(&mut free, 3 * CHUNK));
                for cell in 0..3 * CHUNK as u32 {
                    let last = if ghost == Some(cell) { GHOST } else { 3 };
                    cells.set(cell, [0, 1, 2, last], [cell << 2; 4]);
                }
                let mut free = unused.to_vec();
                free.dedup();
                let ghosts = usize::from(ghost.is_some_and(|ghost| !free.contains(&ghost)));
                let used = 3 * CHUNK - free.len();
                let (compact, finite) = cells.compact(&free, &[0, 1, 2, 3], &Progress::none()).unwrap();
                assert_eq!((compact.len(), finite), (used, used - ghosts), "{unused:?}, ghost {ghost:?}");
                for (number, cell) in compact.iter().enumerate() {
                    let last = if number < finite { 3 } else { INFINITE };
                    assert_eq!((cell.vertices, cell.neighbours), ([0, 1, 2, last], [number as u32; 4]));
                }
            }
        }
    }
}
