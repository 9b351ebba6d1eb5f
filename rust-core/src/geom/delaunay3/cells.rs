//! The tetrahedra: four vertices and four neighbours each, 32 bytes, no coordinates.
//!
//! Threads share the array; each changes only cells whose vertices lie in its own region (see `parallel`), so relaxed
//! loads and stores, which cost no more than plain ones, are all it takes.

use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use crate::error::{Error, Result};

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
    /// Room for `count` cells; memory is touched only as cells are used.
    pub(super) fn with_room(count: usize) -> Result<Self> {
        let count = count.next_multiple_of(CHUNK).min(LIMIT);
        let data = bytemuck::try_zeroed_vec(count).map_err(|()| out_of_memory(count))?;
        Ok(Cells { data, taken: AtomicU32::new(0) })
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

    /// Puts the numbers of unused cells into `free` until it holds `wanted`; false if there is no room.
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

    /// The vertices; the first with its mark.
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

    pub(super) fn release(&self, cell: u32) {
        self.data[cell as usize][0].store(UNUSED, Relaxed);
    }

    /// Closes the gaps that the cells in `free` leave, and hands out the rest: finite cells first, ghosts after them,
    /// neighbours as cell numbers.
    pub(super) fn compact(mut self, free: &[u32]) -> (Vec<super::Cell>, usize) {
        for &cell in free {
            self.release(cell);
        }
        let taken = *self.taken.get_mut() as usize;
        // Rank among cells: 0 finite, 1 ghost, 2 unused. Two pointers close in on each other for each border.
        let rank = |data: &[Cell], cell: usize| match (data[cell][0].load(Relaxed), data[cell][3].load(Relaxed)) {
            (UNUSED, _) => 2,
            (_, GHOST) => 1,
            _ => 0,
        };
        let mut start = 0;
        let mut ends = [0; 2];
        for (border, end) in ends.iter_mut().enumerate() {
            let mut stop = taken;
            loop {
                while start < stop && rank(&self.data, start) <= border {
                    start += 1;
                }
                while start < stop && rank(&self.data, stop - 1) > border {
                    stop -= 1;
                }
                if start == stop {
                    break;
                }
                self.exchange(start, stop - 1);
            }
            *end = stop;
        }
        self.data.truncate(ends[1]);
        // Same size and alignment: the standard library converts in place.
        let cells = self.data.into_iter().map(|c| {
            let [a, b, c, d, e, f, g, h] = c;
            super::Cell {
                vertices: [a.into_inner(), b.into_inner(), c.into_inner(), d.into_inner()],
                neighbours: [e.into_inner() >> 2, f.into_inner() >> 2, g.into_inner() >> 2, h.into_inner() >> 2],
            }
        });
        (cells.collect(), ends[0])
    }

    /// Exchanges two cells, of which the second may be unused.
    fn exchange(&mut self, a: usize, b: usize) {
        let is_used = |data: &[Cell], cell: usize| data[cell][0].load(Relaxed) != UNUSED;
        let (a_used, b_used) = (is_used(&self.data, a), is_used(&self.data, b));
        self.data.swap(a, b);
        let renumber = |facet: u32| match (facet >> 2) as usize {
            cell if cell == a => (b as u32) << 2 | facet & 3,
            cell if cell == b => (a as u32) << 2 | facet & 3,
            _ => facet,
        };
        for (cell, used) in [(b, a_used), (a, b_used)] {
            if used {
                for slot in 0..4 {
                    let facet = self.data[cell][4 + slot].get_mut();
                    *facet = renumber(*facet);
                }
            }
        }
        for (cell, used) in [(b, a_used), (a, b_used)] {
            if used {
                for slot in 0..4 {
                    let across = self.neighbour(cell as u32, slot);
                    self.set_neighbour(across, (cell << 2 | slot) as u32);
                }
            }
        }
    }
}

fn out_of_memory(cells: usize) -> Error {
    Error::OutOfMemory(format!(
        "a tetrahedralization of about {cells} cells would take {:.1} GB; reduce the number of points",
        cells as f64 * 32.0 / 1e9
    ))
}
