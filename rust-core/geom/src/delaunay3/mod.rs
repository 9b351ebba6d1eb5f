//! Delaunay tetrahedralization of points in space.
//!
//! | step | file |
//! |---|---|
//! | order of insertion | `order` |
//! | walk to the cell that holds a point | `locate` |
//! | cells in conflict, new cells in their place | `insert` |
//! | signs, exact, ties broken by symbolic perturbation | `signs`, `geom::predicates` |
//! | storage | `cells`, `tetrahedra` |
//! | one point after the other | `build` |
//! | threads | `parallel`, `region`, `starts` |
//! | a check that shares nothing with these | `check` |

mod build;
mod cells;
mod check;
mod insert;
mod locate;
mod order;
mod parallel;
mod region;
mod signs;
mod starts;
#[cfg(test)]
mod tests;
mod tetrahedra;

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use glam::DVec3;
use rayon::prelude::*;

use crate::predicates::Arithmetic;
use crate::span;
use base::error::{Error, Result};
use base::memory;
use base::progress::Progress;
use build::Build;
use cells::{Cells, GHOST};
use parallel::is_worth;
use signs::Signs;

pub use tetrahedra::{Cell, Delaunay3, INFINITE};

/// At the peak, without the copy of the points. Measured.
const BYTES_A_POINT: f64 = 241.0;

/// Points a thread should have to insert for threads to be worth their start, and present before they can. In tests fewer: sets
/// that a naive twin can follow are given to threads, too.
const PARALLEL: usize = if cfg!(test) { 64 } else { 2048 };
/// Times that points are handed to the threads before one thread takes what is left. Points of a surface, whose cells
/// span the space beside it, need most of them.
const PASSES: usize = 8;

/// Passes one after the other in which threads did no better than one alone would have.
const IN_VAIN: usize = 2;

impl Delaunay3 {
    /// Tetrahedralizes `points` on `threads` threads, 0 for one per core.
    ///
    /// Cost: O(n log n) for points that fill a volume or a surface evenly, quadratic at worst (as the number of cells). Memory: 32 bytes
    /// per cell, about 6.8 cells per point, and 48 bytes per point.
    ///
    /// # Errors
    /// [`Error::Input`] for a coordinate that isn't finite, and for points that all lie in one plane. [`Error::OutOfMemory`].
    /// [`Error::Cancelled`].
    pub fn new(points: &[DVec3], threads: usize, progress: &Progress<'_>) -> Result<Self> {
        let pool = base::threads::pool(threads)?;
        pool.install(|| {
            let order = Order::of(points, size_of::<DVec3>() as f64, progress)?;
            let sorted = order.sorted(points)?;
            let build = Build::of_all(&sorted, &order, pool.current_num_threads(), progress)?;
            drop(sorted);
            build.finish(order.ids, progress)
        })
    }

    /// The same without a copy of the points, which takes 24 bytes per point less: they are sorted meanwhile, and again what they were when
    /// this returns, whatever it returns.
    ///
    /// # Errors
    /// As [`Delaunay3::new`].
    pub fn in_place(points: &mut [DVec3], threads: usize, progress: &Progress<'_>) -> Result<Self> {
        let pool = base::threads::pool(threads)?;
        pool.install(|| {
            let order = Order::of(points, 0.0, progress)?;
            let spare: Vec<AtomicU64> =
                bytemuck::try_zeroed_vec(points.len()).map_err(|()| out_of_memory(points.len()))?;
            order.sort(points, &spare);
            let build = Build::of_all(points, &order, pool.current_num_threads(), progress);
            order.restore(points, &spare);
            drop(spare);
            build?.finish(order.ids, progress)
        })
    }
}

/// The order in which points are inserted, and the arithmetic that their signs need.
struct Order {
    /// Index of the point that comes at each place.
    ids: Vec<u32>,
    /// First point of each round of insertions.
    rounds: Vec<usize>,
    arithmetic: Arithmetic,
    /// By which coordinates are multiplied: a power of two, exact both ways.
    factor: f64,
    /// Largest extent along an axis, multiplied.
    extent: f64,
}

impl Order {
    /// Refuses points that can't be tetrahedralized, or not with the memory there is, of which the caller will take `copied` bytes per
    /// point.
    fn of(points: &[DVec3], copied: f64, progress: &Progress<'_>) -> Result<Self> {
        if points.len() >= GHOST as usize {
            return Err(Error::input(format!("{} points are more than {}", points.len(), GHOST - 1)));
        }
        if let Some(i) = points.iter().position(|p| !p.is_finite()) {
            return Err(Error::input(format!("point {i} is {}: coordinates must be finite. Leave it out.", points[i])));
        }
        let bytes = (BYTES_A_POINT + copied) * points.len() as f64;
        memory::expect(bytes, || format!("tetrahedralizing {} points", points.len()), "use fewer")?;
        let (arithmetic, factor) = Arithmetic::of(points.iter().copied());
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for block in progress.blocks(points) {
            block?.iter().for_each(|point| (low, high) = (low.min(*point), high.max(*point)));
        }
        let (low, high) = (low * factor, high * factor);
        let extent = (high - low).max_element();
        let (mut ids, rounds) = order::insertion_order(points, factor, low, extent, progress)?;
        bring_simplex_forward(points, factor, &mut ids, arithmetic, progress)?;
        Ok(Order { ids, rounds, arithmetic, factor, extent })
    }

    /// The points in this order, multiplied.
    fn sorted(&self, points: &[DVec3]) -> Result<Vec<DVec3>> {
        let mut sorted = Vec::new();
        sorted.try_reserve_exact(points.len()).map_err(|_| out_of_memory(points.len()))?;
        self.ids.par_iter().map(|&i| points[i as usize] * self.factor).collect_into_vec(&mut sorted);
        Ok(sorted)
    }

    /// Brings the points, multiplied, into this order: an axis after the other by way of `spare`. Following the cycles of
    /// the permutation would take less memory, but wait for it at each step.
    fn sort(&self, points: &mut [DVec3], spare: &[AtomicU64]) {
        for axis in 0..3 {
            let from = |&i: &u32| (points[i as usize][axis] * self.factor).to_bits();
            self.ids.par_iter().zip(spare).for_each(|(i, to)| to.store(from(i), Relaxed));
            take(points, axis, spare);
        }
    }

    /// Takes back [`Self::sort`].
    fn restore(&self, points: &mut [DVec3], spare: &[AtomicU64]) {
        for axis in 0..3 {
            let back = |(p, &i): (&DVec3, &u32)| spare[i as usize].store((p[axis] / self.factor).to_bits(), Relaxed);
            points.par_iter().zip(&self.ids).for_each(back);
            take(points, axis, spare);
        }
    }
}

/// Sets all coordinates of one axis.
fn take(points: &mut [DVec3], axis: usize, bits: &[AtomicU64]) {
    points.par_iter_mut().zip(bits).for_each(|(p, bits)| p[axis] = f64::from_bits(bits.load(Relaxed)));
}

fn out_of_memory(points: usize) -> Error {
    Error::OutOfMemory(format!(
        "tetrahedralizing {points} points takes about {:.1} GB: reduce their number",
        points as f64 * 250.0 / 1e9
    ))
}

/// Makes the vertex of a set of equal points the first of them, and lists the others with it.
fn first_of_equals(ids: &mut [u32], duplicates: &mut [[u32; 2]]) -> Vec<[u32; 2]> {
    duplicates.sort_unstable_by_key(|d| d[1]);
    let mut stands_for = Vec::with_capacity(duplicates.len());
    for group in duplicates.chunk_by(|a, b| a[1] == b[1]) {
        let vertex = group[0][1] as usize;
        let mut equal: Vec<u32> = group.iter().map(|d| ids[d[0] as usize]).collect();
        equal.push(ids[vertex]);
        equal.sort_unstable();
        ids[vertex] = equal[0];
        stands_for.extend(equal[1..].iter().map(|&i| [i, equal[0]]));
    }
    stands_for.sort_unstable();
    stands_for
}

/// Exchanges points of the order so that its first four are the corners of a tetrahedron.
fn bring_simplex_forward(
    points: &[DVec3],
    factor: f64,
    ids: &mut [u32],
    arithmetic: Arithmetic,
    progress: &Progress<'_>,
) -> Result<()> {
    let at = |place: usize| points[ids[place] as usize] * factor;
    let corners = span::corners(points.len(), at, arithmetic, progress)?;
    let lie = match corners.len() {
        0 => return Err(Error::input("there are no points")),
        1 => "are all equal",
        2 => "lie on one line",
        3 => "lie in one plane",
        _ => {
            corners.into_iter().enumerate().for_each(|(place, corner)| ids.swap(place, corner));
            return Ok(());
        }
    };
    let count = points.len();
    Err(Error::input(format!("the {count} points {lie}, and four must be the corners of a tetrahedron")))
}

/// All cells of a tetrahedralization, the numbers of those not in use, and points that are copies, with their vertices.
struct Built {
    cells: Cells,
    free: Vec<u32>,
    duplicates: Vec<[u32; 2]>,
}

impl Built {
    /// With the vertices' numbers those before sorting.
    fn finish(mut self, mut ids: Vec<u32>, progress: &Progress<'_>) -> Result<Delaunay3> {
        let duplicates = first_of_equals(&mut ids, &mut self.duplicates);
        let (cells, finite) = self.cells.compact(&self.free, &ids, progress)?;
        Ok(Delaunay3 { cells, finite, duplicates })
    }
}

impl Build<'_, '_> {
    /// Of sorted points.
    fn of_all(sorted: &[DVec3], order: &Order, threads: usize, progress: &Progress<'_>) -> Result<Built> {
        let signs = Signs::new(sorted, order.extent, order.arithmetic);
        let mut build = Build::start(&signs, progress)?;
        build.insert_all(&order.rounds, threads)?;
        let Build { cells, inserter, duplicates, .. } = build;
        Ok(Built { cells, free: inserter.free, duplicates })
    }

    /// Inserts all points but the first four, round by round.
    fn insert_all(&mut self, rounds: &[usize], threads: usize) -> Result<()> {
        let count = self.signs.points.len();
        let mut is_for_threads = threads > 1;
        for (i, &start) in rounds.iter().enumerate() {
            let end = rounds.get(i + 1).copied().unwrap_or(count);
            let round = start.max(4) as u32..end.max(4) as u32;
            if !is_for_threads || start.min(round.len()) <= PARALLEL * threads {
                self.insert_in_turn(round)?;
                continue;
            }
            let of_round = round.len();
            let mut ids: Vec<u32> = round.collect();
            let (mut axis, mut in_vain) = (0, 0);
            for _ in 0..PASSES {
                if ids.len() <= PARALLEL * threads {
                    break;
                }
                let before = ids.len();
                ids = self.insert_in_parallel(&ids, threads, axis)?;
                if is_worth(before - ids.len(), before as f64, threads) {
                    in_vain = 0;
                    continue;
                }
                // Cut again like that, as many would be put off again.
                axis += 1;
                in_vain += 1;
                if in_vain == IN_VAIN {
                    break;
                }
            }
            // Cells that span the object will do so in later rounds.
            is_for_threads = is_worth(of_round - ids.len(), of_round as f64, threads);
            self.insert_in_turn(ids.into_iter())?;
        }
        Ok(())
    }
}
