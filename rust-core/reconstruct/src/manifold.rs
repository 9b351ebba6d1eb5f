//! Stage 4: the surface between the sides becomes manifold, and samples it passed by come onto it. \[Boi84\]
//!
//! At a vertex the surface is manifold exactly if the cells inside around it hang together over facets, and those outside too. The link of
//! a vertex is a sphere, and one closed curve divides a sphere into two connected parts. If it isn't so, the smaller parts change sides.
//!
//! A sample with only inside cells (or only outside cells) around it lies off the surface. A cell between it and one facet of the surface
//! changes sides: the facet gives way to three that meet in the sample. This is the first of Boissonnat's rules for removing a cell (one
//! facet on the surface, the fourth vertex not on it), and its mirror image. It never makes a vertex or an edge that isn't manifold and
//! keeps the genus.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::complex::{Complex, Star};
use super::fans::pinched;
use super::hinge::Around;
use base::error::Result;
use base::progress::Progress;
use mesh::dump::{self, Stage};

/// In a cell's byte: its side.
const INSIDE: u8 = 1;
/// In a cell's byte: one more change of sides.
const CHANGE: u8 = 2;
/// After so many changes a cell stays where it is, so that the work ends.
const CHANGES: u8 = 4 * CHANGE;

/// Rounds over the vertices that aren't manifold.
const ROUNDS: usize = 32;

/// The cells' sides, apart from the cells.
#[derive(Clone)]
pub(super) struct Separated {
    sides: Vec<u8>,
    incident: Vec<u32>,
    /// Cells that changed sides in the repair.
    pub(super) repaired: usize,
}

impl Separated {
    /// Leaves the middles of the finite cells to look at: 1 inside, -1 outside.
    pub(super) fn dump(&self, complex: Complex<'_>, name: &str) -> Result<()> {
        dump::stage(name, || {
            let middle =
                |cell: u32| complex.vertices(cell).map(|v| complex.points[v as usize]).iter().sum::<DVec3>() / 4.0;
            let side = |cell: u32| if self.sides[cell as usize] & INSIDE != 0 { 1 } else { -1 };
            let cells = 0..complex.finite as u32;
            Stage {
                positions: cells.clone().map(middle).collect(),
                values: cells.map(side).collect(),
                triangles: Vec::new(),
            }
        })
    }
}

/// The cells with their sides.
#[derive(Clone)]
pub(super) struct Solid<'a> {
    pub(super) complex: Complex<'a>,
    sides: Vec<u8>,
    /// A cell of each vertex.
    pub(super) incident: Vec<u32>,
}

impl<'a> Solid<'a> {
    pub(super) fn new(complex: Complex<'a>, sides: Vec<u8>) -> Self {
        Solid { complex, sides, incident: complex.incident() }
    }

    /// As it was given back by [`Solid::into_separated`].
    pub(super) fn again(complex: Complex<'a>, separated: Separated) -> Self {
        Solid { complex, sides: separated.sides, incident: separated.incident }
    }

    pub(super) fn into_separated(self, repaired: usize) -> Separated {
        Separated { sides: self.sides, incident: self.incident, repaired }
    }

    /// Of each sample, whether no triangle uses it and all cells around it are inside.
    pub(super) fn enclosed(&self, triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<bool>> {
        let mut is_used = vec![false; self.complex.points.len()];
        for block in progress.blocks(triangles.as_flattened()) {
            block?.iter().for_each(|&vertex| is_used[vertex as usize] = true);
        }
        let mut star = Star::default();
        let mut enclosed = vec![false; is_used.len()];
        for vertex in (0..is_used.len()).filter(|&vertex| !is_used[vertex] && self.incident[vertex] != u32::MAX) {
            progress.check()?;
            self.complex.star(vertex as u32, self.incident[vertex], &mut star);
            enclosed[vertex] = star.cells.iter().all(|&(cell, _)| self.is_inside(cell));
        }
        Ok(enclosed)
    }

    pub(super) fn is_inside(&self, cell: u32) -> bool {
        self.sides[cell as usize] & INSIDE != 0
    }

    pub(super) fn change(&mut self, cell: u32) {
        self.sides[cell as usize] = (self.sides[cell as usize] ^ INSIDE).saturating_add(CHANGE);
    }

    /// Takes the last change of a cell back.
    pub(super) fn change_back(&mut self, cell: u32) {
        self.sides[cell as usize] = (self.sides[cell as usize] ^ INSIDE).saturating_sub(CHANGE);
    }

    /// Of each sample, whether it is on the surface or no cell knows it.
    pub(super) fn on_surface(&self, progress: &Progress<'_>) -> Result<Vec<bool>> {
        let mut on_surface: Vec<bool> = self.incident.iter().map(|&cell| cell == u32::MAX).collect();
        let mut note = |facet: [u32; 3]| facet.into_iter().for_each(|vertex| on_surface[vertex as usize] = true);
        self.for_each_facet(&mut note, progress)?;
        Ok(on_surface)
    }

    pub(super) fn may_change(&self, cell: u32) -> bool {
        self.sides[cell as usize] < CHANGES && !self.complex.is_outer(cell)
    }

    /// The facets with the inside on one side and the outside on the other, seen from outside.
    pub(super) fn surface(&self, progress: &Progress<'_>) -> Result<Vec<[u32; 3]>> {
        // Euler: about two per sample. Memory that is not written to is not taken.
        let mut triangles = Vec::with_capacity(2 * self.complex.points.len());
        self.for_each_facet(&mut |facet| triangles.push(facet), progress)?;
        Ok(triangles)
    }

    fn for_each_facet(&self, take: &mut impl FnMut([u32; 3]), progress: &Progress<'_>) -> Result<()> {
        for cells in progress.ranges(self.complex.len()) {
            for cell in cells?.map(|cell| cell as u32).filter(|&cell| self.is_inside(cell)) {
                for slot in 0..4 {
                    if !self.is_inside(self.complex.neighbour(cell, slot)) {
                        take(self.complex.facet(cell, slot));
                    }
                }
            }
        }
        Ok(())
    }

    /// Makes the surface manifold at all vertices but a few that resist. Returns the cells that changed sides.
    pub(super) fn repair(&mut self, progress: &Progress<'_>) -> Result<usize> {
        let mut changed = 0;
        let mut suspects = pinched(&self.surface(progress)?, self.complex.points.len(), progress)?;
        let mut star = Star::default();
        for _ in 0..ROUNDS {
            if suspects.is_empty() {
                break;
            }
            let mut touched = Vec::new();
            for vertex in suspects {
                progress.check()?;
                for cell in self.minorities(vertex, &mut star) {
                    self.change(cell);
                    changed += 1;
                    touched.extend(self.complex.vertices(cell));
                }
            }
            touched.sort_unstable();
            touched.dedup();
            suspects = touched;
        }
        Ok(changed)
    }

    /// Whether a cell may change sides: the surface, manifold at the cell's vertices, stays so and keeps all of them. Theorem: it may
    /// exactly where one of its facets is on the surface and the vertex opposite is not, or two are and the edge that neither has is not
    /// \[Boi84\]. In the link of each vertex a triangle then goes from one disc to another that it touches in one piece. `is_on`: whether
    /// the surface has a vertex.
    pub(super) fn gives_way(&self, cell: u32, is_on: impl Fn(u32) -> bool) -> bool {
        let side = self.is_inside(cell);
        let vertices = self.complex.vertices(cell);
        let mut opposite = (0..4).filter(|&slot| self.is_inside(self.complex.neighbour(cell, slot)) != side);
        match [opposite.next(), opposite.next(), opposite.next()] {
            [Some(a), None, _] => !is_on(vertices[a]),
            [Some(a), Some(b), None] => {
                let mut around = Around::new(self.complex, [vertices[a], vertices[b]], cell);
                while around.turn(self.complex) {
                    if self.is_inside(around.cell) != side {
                        return false;
                    }
                }
                true
            }
            _ => false,
        }
    }

    /// The cells around a vertex that have to change sides for it to be manifold. None if it is or can't become so.
    fn minorities(&self, vertex: u32, star: &mut Star) -> Vec<u32> {
        let parts = self.parts(vertex, star);
        // Of the ways to leave one part inside and one outside, the one that changes fewest cells.
        let price = |side: bool| {
            let mut parts: Vec<&Vec<u32>> = parts.iter().filter(|part| self.is_inside(part[0]) == side).collect();
            let rank = |part: &[u32]| (part.iter().any(|&cell| !self.may_change(cell)), part.len());
            let name = |part: &[u32]| part.iter().map(|&cell| self.complex.name(cell)).min();
            parts.sort_by(|a, b| rank(b).cmp(&rank(a)).then_with(|| name(a).cmp(&name(b))));
            let small: Vec<u32> = parts.into_iter().skip(1).flatten().copied().collect();
            let possible = small.iter().all(|&cell| self.may_change(cell));
            (possible && !small.is_empty()).then_some(small)
        };
        match (price(true), price(false)) {
            (Some(a), Some(b)) => {
                if a.len() < b.len() {
                    a
                } else {
                    b
                }
            }
            (a, b) => a.or(b).unwrap_or_default(),
        }
    }

    /// The cells around a vertex in groups of one side that hang together over facets.
    fn parts(&self, vertex: u32, star: &mut Star) -> Vec<Vec<u32>> {
        self.complex.star(vertex, self.incident[vertex as usize], star);
        let mut parts: Vec<Vec<u32>> = Vec::new();
        let mut part_of = vec![usize::MAX; star.cells.len()];
        for first in 0..star.cells.len() {
            if part_of[first] != usize::MAX {
                continue;
            }
            let mut part = vec![first];
            part_of[first] = parts.len();
            let mut next = 0;
            while next < part.len() {
                let (cell, own) = star.cells[part[next]];
                next += 1;
                for slot in (0..4).filter(|&slot| slot != usize::from(own)) {
                    let beyond = self.complex.neighbour(cell, slot);
                    if self.is_inside(beyond) == self.is_inside(cell) {
                        let place = star.find(beyond).expect("the star is closed");
                        if part_of[place] == usize::MAX {
                            part_of[place] = parts.len();
                            part.push(place);
                        }
                    }
                }
            }
            parts.push(part.into_iter().map(|place| star.cells[place].0).collect());
        }
        parts
    }

    /// Brings samples off the surface onto it where the new facets are allowed, and notes it. Returns how many.
    pub(super) fn gather(
        &mut self,
        on_surface: &mut [bool],
        mut allowed: impl FnMut([u32; 3]) -> f64,
        progress: &Progress<'_>,
    ) -> Result<usize> {
        let mut queue = BinaryHeap::new();
        let mut star = Star::default();
        for vertex in 0..on_surface.len() as u32 {
            if !on_surface[vertex as usize] {
                progress.check()?;
                self.complex.star(vertex, self.incident[vertex as usize], &mut star);
                star.cells.iter().for_each(|&(cell, own)| self.enqueue(cell, usize::from(own), &mut queue));
            }
        }
        let mut gathered = 0;
        while let Some(Reverse((size, _, cell, own))) = queue.pop() {
            let vertex = self.complex.vertices(cell)[own];
            let beyond = self.complex.neighbour(cell, own);
            if on_surface[vertex as usize] || self.is_inside(beyond) == self.is_inside(cell) {
                continue;
            }
            if f64::from(f32::from_bits(size)) > allowed(self.complex.facet(cell, own)) {
                continue;
            }
            progress.check()?;
            self.change(cell);
            on_surface[vertex as usize] = true;
            gathered += 1;
            for slot in (0..4).filter(|&slot| slot != own) {
                let next = self.complex.neighbour(cell, slot);
                let apex = self.complex.mirror(cell, slot);
                let candidate = self.complex.vertices(next)[apex];
                if !self.complex.is_outer(next) && !on_surface[candidate as usize] {
                    self.enqueue(next, apex, &mut queue);
                }
            }
        }
        Ok(gathered)
    }

    /// Queues a cell that could carry the vertex in its slot `own` onto the surface.
    fn enqueue(&self, cell: u32, own: usize, queue: &mut Queue) {
        let beyond = self.complex.neighbour(cell, own);
        if self.complex.is_outer(cell) || self.is_inside(beyond) == self.is_inside(cell) {
            return;
        }
        let size = (0..4)
            .filter(|&slot| slot != own)
            .map(|slot| self.complex.perimeter(self.complex.facet(cell, slot)))
            .fold(0.0, f64::max) as f32;
        queue.push(Reverse((size.to_bits(), self.complex.name(cell), cell, own)));
    }
}

/// Cells by the size of the facets they would bring, the smallest first. Equal ones by their vertices.
type Queue = BinaryHeap<Reverse<(u32, [u32; 4], u32, usize)>>;

#[cfg(test)]
mod tests;
