//! Walking to the cell that holds a point.

use super::cells::{Cells, GHOST};
use super::region::Region;
use super::signs::{Seen, Signs, volumes};

/// End of a walk.
pub(super) enum Place {
    /// In this cell, or beyond the facet of this ghost. With the number of planes of the cell's facets the point lies in.
    Cell { cell: u32, planes: u32 },
    /// Before a cell that belongs to another thread.
    Foreign,
}

/// Walks from `start` through cells of `region`, each time across a facet that has the point on its other side. In a
/// Delaunay tetrahedralization no such walk comes back to a cell it has left, whichever of these facets it takes.
pub(super) fn locate<R: Region>(cells: &Cells, signs: &Signs<'_>, region: &R, start: u32, p: u32) -> Place {
    let point = signs.points[p as usize];
    let bound = signs.plane_bound();
    let mut cell = start;
    if cells.marked_vertices(cell)[3] == GHOST {
        cell = cells.neighbour(cell, 3) >> 2;
    }
    let is_own = |cell: u32| region.owns(cells.vertices(cell), signs.points);
    if !is_own(cell) {
        return Place::Foreign;
    }
    loop {
        let vertices = cells.vertices(cell);
        if vertices[3] == GHOST {
            return Place::Cell { cell, planes: 0 };
        }
        let at = |k: usize| Seen::new(signs.points[vertices[k] as usize], point);
        let seen = [at(0), at(1), at(2), at(3)];
        let volumes = volumes([&seen[0], &seen[1], &seen[2], &seen[3]]);
        let mut lowest = 0;
        for slot in 1..4 {
            if volumes[slot] < volumes[lowest] {
                lowest = slot;
            }
        }
        if volumes[lowest] > bound {
            return Place::Cell { cell, planes: 0 };
        }
        if !(volumes[lowest] < -bound) {
            let mut planes = 0;
            let mut behind = None;
            for slot in 0..4 {
                if volumes[slot] > bound {
                    continue;
                }
                match signs.side(volumes[slot], [&seen[0], &seen[1], &seen[2], &seen[3]], vertices, slot, p) {
                    -1 => behind = Some(slot),
                    0 => planes += 1,
                    _ => {}
                }
            }
            match behind {
                None => return Place::Cell { cell, planes },
                Some(slot) => lowest = slot,
            }
        }
        let beyond = |slot: usize| cells.neighbour(cell, slot) >> 2;
        let mut next = beyond(lowest);
        if !is_own(next) {
            let other = (0..4).filter(|&slot| volumes[slot] < -bound).map(beyond).find(|&next| is_own(next));
            match other {
                Some(other) => next = other,
                None => return Place::Foreign,
            }
        }
        cell = next;
    }
}
