//! Stage 4, continued: ways through several cells to samples that lie deeper. \[Boi84\]
//!
//! From the sample, the shortest way through cells of one side to a cell with a facet on the surface. The cells on it change sides one by
//! one from the surface on, each by one of Boissonnat's rules ([`Solid::gives_way`]). If one may not, all are put back and the next way is
//! tried.

use rustc_hash::FxHashSet;

use super::complex::Star;
use super::fans::pinched;
use super::manifold::Solid;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::INFINITE;

/// Most cells on a way.
const LONGEST: usize = 4;
/// Ways tried for a sample.
const TRIES: usize = 24;

/// Perimeter of a small facet, in the largest one that is allowed.
const SMALL: f64 = 1.5;

/// Cells that a way may lead through.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Through {
    /// Cells whose facets are small: what they show when they change sides closes no opening.
    Small,
    /// Any cells.
    Anything,
}

/// Whether a way may lead through a cell, as far as that does not change: its facets are small and it has no vertex at which
/// the surface is not manifold.
#[derive(Clone, Copy, PartialEq, Eq)]
enum MayOpen {
    Unknown,
    Yes,
    No,
}

/// A cell on the way out, and the place in the list of the one it was reached from.
struct Step {
    cell: u32,
    from: usize,
    length: usize,
}

impl Solid<'_> {
    /// Brings the surface to the samples off it where a way is found, and notes what comes onto it. Returns how many it reached. `allowed`:
    /// largest perimeter of a facet.
    pub(super) fn reach_deep_samples(
        &mut self,
        on_surface: &mut [bool],
        mut allowed: impl FnMut([u32; 3]) -> f64,
        through: Through,
        progress: &Progress<'_>,
    ) -> Result<usize> {
        let (complex, mut star) = (self.complex, Star::default());
        let mut may_open = vec![MayOpen::Unknown; complex.len()];
        for vertex in pinched(&self.surface(progress)?, on_surface.len(), progress)? {
            complex.star(vertex, self.incident[vertex as usize], &mut star);
            star.cells.iter().for_each(|&(cell, _)| may_open[cell as usize] = MayOpen::No);
        }
        let mut reached = 0;
        for sample in (0..on_surface.len() as u32).filter(|&sample| !on_surface[sample as usize]).collect::<Vec<_>>() {
            progress.check()?;
            complex.star(sample, self.incident[sample as usize], &mut star);
            let Some((distance, nearest)) = self.nearest(sample, &star) else { continue };
            // A sample farther away than a facet's side may be long is astray.
            if 3.0 * distance > allowed([nearest; 3]) {
                continue;
            }
            let may_open = |cell: u32| {
                let answer = &mut may_open[cell as usize];
                if *answer == MayOpen::Unknown {
                    let mut is_small = |facet| complex.perimeter(facet) <= SMALL * allowed(facet);
                    let shows = through == Through::Anything || (0..4).all(|slot| is_small(complex.facet(cell, slot)));
                    *answer = if shows { MayOpen::Yes } else { MayOpen::No };
                }
                *answer == MayOpen::Yes
            };
            reached += usize::from(self.reach(&star, on_surface, may_open));
        }
        Ok(reached)
    }

    /// The sample nearest to one, which is one of its Delaunay neighbours.
    fn nearest(&self, sample: u32, star: &Star) -> Option<(f64, u32)> {
        let here = self.complex.points[sample as usize];
        let mut nearest: Option<(f64, u32)> = None;
        for vertex in star.cells.iter().flat_map(|&(cell, _)| self.complex.vertices(cell)) {
            if vertex != sample && vertex != INFINITE {
                let candidate = (here.distance(self.complex.points[vertex as usize]), vertex);
                if nearest.is_none_or(|nearest| candidate < nearest) {
                    nearest = Some(candidate);
                }
            }
        }
        nearest
    }

    /// Brings the surface to one sample. `star`: the sample's.
    fn reach(&mut self, star: &Star, on_surface: &mut [bool], mut may_open: impl FnMut(u32) -> bool) -> bool {
        let side = self.is_inside(star.cells[0].0);
        if star.cells.iter().any(|&(cell, _)| self.is_inside(cell) != side) {
            // An earlier way led here.
            return true;
        }
        let mut may_open = |solid: &Self, cell: u32| solid.may_change(cell) && may_open(cell);
        let mut steps: Vec<Step> =
            star.cells.iter().map(|&(cell, _)| Step { cell, from: usize::MAX, length: 1 }).collect();
        steps.retain(|step| may_open(self, step.cell));
        steps.sort_by_cached_key(|step| self.complex.name(step.cell));
        let mut known: FxHashSet<u32> = steps.iter().map(|step| step.cell).collect();
        let (mut next, mut tries) = (0, 0);
        while next < steps.len() && tries < TRIES {
            let Step { cell, length, .. } = steps[next];
            if (0..4).any(|slot| self.is_inside(self.complex.neighbour(cell, slot)) != side) {
                tries += 1;
                if self.open(&steps, next, on_surface) {
                    return true;
                }
            }
            if length < LONGEST {
                let mut beyond = [0, 1, 2, 3].map(|slot| {
                    let cell = self.complex.neighbour(cell, slot);
                    (self.complex.name(cell), cell)
                });
                beyond.sort_unstable();
                for (_, cell) in beyond {
                    if self.is_inside(cell) == side && !known.contains(&cell) && may_open(self, cell) {
                        known.insert(cell);
                        steps.push(Step { cell, from: next, length: length + 1 });
                    }
                }
            }
            next += 1;
        }
        false
    }

    /// Changes the sides of the cells on a way, from its outer end at `last` to the sample.
    fn open(&mut self, steps: &[Step], last: usize, on_surface: &mut [bool]) -> bool {
        let mut done: Vec<u32> = Vec::new();
        let mut at = last;
        while at != usize::MAX {
            let cell = steps[at].cell;
            at = steps[at].from;
            let is_on = |vertex: u32| {
                on_surface[vertex as usize] || done.iter().any(|&cell| self.complex.vertices(cell).contains(&vertex))
            };
            if !self.gives_way(cell, is_on) {
                done.into_iter().for_each(|cell| self.change_back(cell));
                return false;
            }
            self.change(cell);
            done.push(cell);
        }
        for vertex in done.into_iter().flat_map(|cell| self.complex.vertices(cell)) {
            on_surface[vertex as usize] = true;
        }
        true
    }
}
