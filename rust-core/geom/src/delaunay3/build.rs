//! A tetrahedralization that grows by one point after the other.

use super::cells::{Cells, FACETS, GHOST};
use super::insert::{Inserter, Outcome};
use super::region::Everywhere;
use super::signs::Signs;
use base::error::Result;
use base::progress::Progress;

/// Points that may be inserted between two looks at whether to go on.
pub(super) const TICK: usize = 256;

/// A tetrahedralization that grows.
pub(super) struct Build<'a, 'p> {
    pub(super) signs: &'a Signs<'a>,
    pub(super) progress: &'a Progress<'p>,
    pub(super) cells: Cells,
    pub(super) inserter: Inserter,
    pub(super) duplicates: Vec<[u32; 2]>,
}

impl<'a, 'p> Build<'a, 'p> {
    /// The tetrahedron of the first four points.
    pub(super) fn start(signs: &'a Signs<'a>, progress: &'a Progress<'p>) -> Result<Self> {
        let cells = Cells::with_room(signs.points.len() * 7 + 4096)?;
        let mut inserter = Inserter::new(0);
        assert!(cells.supply(&mut inserter.free, 5), "room for thousands");
        let numbers: Vec<u32> = (0..5).map(|_| inserter.free.pop().expect("supplied")).collect();
        let mut first = [0, 1, 2, 3];
        if signs.orientation(first) < 0 {
            first.swap(0, 1);
        }
        cells.set(numbers[0], first, [0; 4]);
        for slot in 0..4 {
            let [a, b, c] = FACETS[slot].map(|k| first[k]);
            let ghost = numbers[slot + 1];
            cells.set(ghost, [a, b, c, GHOST], [0; 4]);
            cells.set_neighbour(ghost << 2 | 3, numbers[0] << 2 | slot as u32);
            cells.set_neighbour(numbers[0] << 2 | slot as u32, ghost << 2 | 3);
        }
        for slot in 0..4 {
            let ghost = numbers[slot + 1];
            for side in 0..3 {
                // Across the edge without vertex v lies the ghost of the facet opposite to v, where the place of this
                // ghost's own apex is opposite to the shared edge.
                let v = cells.vertices(ghost)[side];
                let other = numbers[1 + first.iter().position(|&f| f == v).expect("a corner of the first cell")];
                let place = cells.vertices(other).iter().position(|&f| f == first[slot]);
                let place = place.expect("the facets of a tetrahedron share all other corners") as u32;
                cells.set_neighbour(ghost << 2 | side as u32, other << 2 | place);
            }
        }
        inserter.hint = numbers[0];
        Ok(Build { signs, progress, cells, inserter, duplicates: Vec::new() })
    }

    pub(super) fn insert_in_turn(&mut self, ids: impl Iterator<Item = u32>) -> Result<()> {
        let mut since = 0;
        for p in ids {
            self.insert(p)?;
            since += 1;
            if since == TICK {
                self.progress.advance(since as u64)?;
                since = 0;
            }
        }
        self.progress.advance(since as u64)
    }

    pub(super) fn insert(&mut self, p: u32) -> Result<()> {
        loop {
            match self.inserter.insert(&self.cells, self.signs, &Everywhere, p) {
                Outcome::Inserted => return Ok(()),
                Outcome::Duplicate(twin) => {
                    self.duplicates.push([p, twin]);
                    return Ok(());
                }
                Outcome::Full => self.cells.grow(4096)?,
                Outcome::Foreign | Outcome::Unreached => unreachable!("all cells are our own"),
            }
        }
    }
}
