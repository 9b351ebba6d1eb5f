//! Whether a tetrahedralization is Delaunay, by code that shares nothing with its making but the exact signs.

use glam::DVec3;

use super::cells::FACETS;
use super::tetrahedra::{Delaunay3, INFINITE};
use crate::predicates::{Arithmetic, sphere_sign, volume_sign};

impl Delaunay3 {
    /// Verifies that this is the Delaunay tetrahedralization of `points`. Checks: cells positively oriented, neighbours mutual and sharing
    /// a facet, the hull convex, no vertex of a neighbour inside of a cell's sphere (which makes every sphere empty, Delaunay 1934), and
    /// every point a vertex or listed as the copy of one.
    ///
    /// Cost: O(cells), about one exact sign each facet.
    ///
    /// # Errors
    /// Returns the first fault, in words.
    pub fn check(&self, points: &[DVec3]) -> Result<(), String> {
        let (arithmetic, factor) = Arithmetic::of(points.iter().copied());
        let at = |v: u32| points[v as usize] * factor;
        let mut is_vertex = vec![false; points.len()];
        let mut facets = 0_usize;
        for (i, cell) in self.cells.iter().enumerate() {
            let is_ghost = cell.vertices[3] == INFINITE;
            if is_ghost != (i >= self.finite) {
                return Err(format!("cell {i} is on the wrong side of the border between finite cells and ghosts"));
            }
            for &v in &cell.vertices[..if is_ghost { 3 } else { 4 }] {
                *is_vertex.get_mut(v as usize).ok_or_else(|| format!("cell {i} has vertex {v}"))? = true;
            }
            if !is_ghost && volume_sign(cell.vertices.map(at), arithmetic) <= 0 {
                return Err(format!("cell {i} {:?} is flat or turned inside out", cell.vertices));
            }
            for slot in 0..4 {
                let other = cell.neighbours[slot] as usize;
                let neighbour = self.cells.get(other).ok_or_else(|| format!("cell {i} has neighbour {other}"))?;
                let mut own = FACETS[slot].map(|k| cell.vertices[k]);
                let back = neighbour.neighbours.iter().position(|&n| n as usize == i);
                let is_shared = (0..4).filter(|&k| neighbour.neighbours[k] as usize == i).any(|k| {
                    let mut theirs = FACETS[k].map(|j| neighbour.vertices[j]);
                    // The same facet seen from the other side, from any corner on.
                    theirs.swap(1, 2);
                    (0..3).any(|_| {
                        own.rotate_left(1);
                        own == theirs
                    })
                });
                if back.is_none() || !is_shared {
                    return Err(format!("cells {i} and {other} do not share facet {slot} of the first"));
                }
                facets += 1;
                self.check_pair(i, slot, &at, arithmetic)?;
            }
        }
        if facets != 4 * self.cells.len() {
            return Err("facets are missing".into());
        }
        for &[copy, vertex] in &self.duplicates {
            if points[copy as usize] != points[vertex as usize] {
                return Err(format!("point {copy} is listed as a copy of {vertex}, which is elsewhere"));
            }
            if !is_vertex[vertex as usize] || std::mem::replace(&mut is_vertex[copy as usize], true) {
                return Err(format!("point {copy}, listed as a copy of {vertex}, is a vertex, or the other is none"));
            }
        }
        match is_vertex.iter().position(|v| !v) {
            Some(lost) => Err(format!("point {lost} is no vertex")),
            None => Ok(()),
        }
    }

    /// A cell and its neighbour across the facet opposite to `slot`.
    fn check_pair(
        &self,
        i: usize,
        slot: usize,
        at: &impl Fn(u32) -> DVec3,
        arithmetic: Arithmetic,
    ) -> Result<(), String> {
        let cell = self.cells[i].vertices;
        let other = &self.cells[self.cells[i].neighbours[slot] as usize];
        let apex = *other.vertices.iter().find(|v| !cell.contains(v)).ok_or("two cells with the same vertices")?;
        match (cell[3] == INFINITE, apex == INFINITE) {
            // Two facets of the hull: the one's third corner is not beyond the other.
            (true, false) if slot != 3 && volume_sign([cell[0], cell[1], cell[2], apex].map(at), arithmetic) > 0 => {
                Err(format!("the hull is not convex at vertex {apex}, seen from cell {i}"))
            }
            (false, false)
                if sphere_sign([0, 1, 2, 3, 4].map(|k| at(*cell.get(k).unwrap_or(&apex))), arithmetic) > 0 =>
            {
                Err(format!("vertex {apex} is inside of the sphere of cell {i} {cell:?}"))
            }
            _ => Ok(()),
        }
    }
}
