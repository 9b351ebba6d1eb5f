//! Open surfaces, continued: samples that the surface passed by come onto it. \[Boi84\]
//!
//! A cell between such a sample and a triangle of the surface: the triangle gives way to the cell's three other facets, which
//! meet in the sample. It changes neither loops nor handles.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rustc_hash::FxHashMap;

use super::complex::{Complex, Star};
use super::grow::Front;
use base::error::Result;
use base::progress::{Pace, Progress};

/// A cell by the size of the facets it would bring, the smallest first. Then by its vertices, with the slot of the sample.
type Offer = Reverse<(u32, [u32; 4], u32, usize)>;

impl<F: FnMut([u32; 3]) -> f64> Front<'_, F> {
    /// Brings samples onto the surface where the new facets are at most `times` as large as the sampling allows.
    pub(super) fn gather(&mut self, incident: &[u32], times: u32, progress: &Progress<'_>) -> Result<()> {
        let is_missed = |vertex: &u32| !self.border.is_used(*vertex) && incident[*vertex as usize] != u32::MAX;
        let missed: Vec<u32> = (0..incident.len() as u32).filter(is_missed).collect();
        if missed.is_empty() {
            return Ok(());
        }
        let mut place_of: FxHashMap<[u32; 3], u32> = FxHashMap::default();
        let mut pace = Pace::new(progress);
        for (place, &triangle) in self.triangles.iter().enumerate() {
            pace.after(1)?;
            place_of.insert(sorted(triangle), place as u32);
        }
        let mut offers: BinaryHeap<Offer> = BinaryHeap::new();
        let mut star = Star::default();
        for vertex in missed {
            progress.check()?;
            self.complex.star(vertex, incident[vertex as usize], &mut star);
            offers.extend(star.cells.iter().filter_map(|&(cell, own)| self.offer(cell, usize::from(own))));
        }
        while let Some(Reverse((size, _, cell, own))) = offers.pop() {
            progress.check()?;
            let facet = self.complex.facet(cell, own);
            let vertex = self.complex.vertices(cell)[own];
            if self.border.is_used(vertex) || f64::from(f32::from_bits(size)) > f64::from(times) * (self.allowed)(facet)
            {
                continue;
            }
            let [a, b, c] = facet;
            if [[a, b, vertex], [b, c, vertex], [c, a, vertex]]
                .iter()
                .any(|&facet| self.lines.is_jump(self.complex.points, facet))
            {
                continue;
            }
            let Some(place) = place_of.remove(&sorted(facet)) else { continue };
            let [a, b, c] = self.triangles[place as usize];
            self.part_of[vertex as usize] = self.part_of[a as usize];
            self.border.enclose(vertex);
            self.triangles[place as usize] = [a, b, vertex];
            place_of.insert(sorted([a, b, vertex]), place);
            for triangle in [[b, c, vertex], [c, a, vertex]] {
                place_of.insert(sorted(triangle), self.triangles.len() as u32);
                self.triangles.push(triangle);
            }
            for slot in (0..4).filter(|&slot| slot != own) {
                let next = self.complex.neighbour(cell, slot);
                offers.extend(self.offer(next, self.complex.mirror(cell, slot)));
            }
        }
        Ok(())
    }

    /// A cell that could bring the sample in its slot `own` onto the surface, if that is not on it.
    fn offer(&self, cell: u32, own: usize) -> Option<Offer> {
        let complex: Complex<'_> = self.complex;
        if complex.is_outer(cell) || self.border.is_used(complex.vertices(cell)[own]) {
            return None;
        }
        let perimeter = |slot: usize| complex.perimeter(complex.facet(cell, slot));
        let size = (0..4).filter(|&slot| slot != own).map(perimeter).fold(0.0, f64::max) as f32;
        Some(Reverse((size.to_bits(), complex.name(cell), cell, own)))
    }
}

fn sorted(mut facet: [u32; 3]) -> [u32; 3] {
    facet.sort_unstable();
    facet
}
