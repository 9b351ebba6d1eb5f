//! Stage 5: rows, by inverse distribution sampling of each vertical curve. \[GSB97, sec. 2.2\]
//!
//! The paper reads the curvature at the very pixels of a curve. With smoothing it is averaged over the pixels of each row that
//! are nearer to the curve than to its neighbours.

use rayon::prelude::*;

use super::curves::{Curves, inverse};
use super::tiles::Layout;
use base::error::Result;
use base::progress::Progress;

/// Vertices in pixels, row by row of the grid: [row, column], not yet rounded.
pub(super) struct Placed {
    pub places: Vec<[f64; 2]>,
}

/// Curves sampled at a time: a cache line of `f32`.
const BLOCK: usize = 16;

/// Samples the curves. O(pixels).
pub(super) fn sample(
    density: &[u8],
    cols: usize,
    layout: &Layout,
    curves: &Curves,
    smooth: bool,
    floor: f64,
    progress: &Progress<'_>,
) -> Result<Placed> {
    let along = if smooth {
        around_curves(density, cols, curves, progress)?
    } else {
        on_curves(density, cols, curves, progress)?
    };
    let (count, steps) = (curves.count, layout.steps_down);
    let grid_rows = layout.rows();
    // Row places of each block of curves: curve by curve.
    let blocks: Vec<Vec<f64>> = (0..count.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let mut places = vec![0.0; BLOCK.min(count - block * BLOCK) * grid_rows];
            for (k, places) in places.chunks_exact_mut(grid_rows).enumerate() {
                let curve = block * BLOCK + k;
                for (tile, lines) in layout.row_lines.windows(2).enumerate() {
                    let inside = (lines[0]..=lines[1]).map(|row| f64::from(along[row * count + curve]));
                    let places = &mut places[tile * steps..=(tile + 1) * steps];
                    inverse(ExactRange(inside, lines[1] - lines[0] + 1), floor, places);
                    for place in places {
                        *place += lines[0] as f64;
                    }
                }
                progress.check()?;
            }
            Ok(places)
        })
        .collect::<Result<_>>()?;
    let mut places = vec![[0.0; 2]; grid_rows * count];
    places.par_chunks_mut(count).enumerate().for_each(|(i, places)| {
        for (curve, place) in places.iter_mut().enumerate() {
            let row = blocks[curve / BLOCK][curve % BLOCK * grid_rows + i];
            *place = [row, curves.place(row, curve)];
        }
    });
    Ok(Placed { places })
}

/// An iterator with its length: ranges with both ends have none of their own.
#[derive(Clone)]
struct ExactRange<I>(I, usize);

impl<I: Iterator> Iterator for ExactRange<I> {
    type Item = I::Item;

    fn next(&mut self) -> Option<I::Item> {
        self.0.next()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.1, Some(self.1))
    }
}

impl<I: Iterator> ExactSizeIterator for ExactRange<I> {}

/// Density at the pixel of each row that a curve passes: row by row.
fn on_curves(density: &[u8], cols: usize, curves: &Curves, progress: &Progress<'_>) -> Result<Vec<f32>> {
    per_row(density, cols, curves, progress, |places, density, _, out| {
        for (out, &place) in out.iter_mut().zip(places) {
            *out = f32::from(density[(place.round() as usize).min(cols - 1)]);
        }
    })
}

/// Mean density of the pixels of each row that are nearest to a curve.
fn around_curves(density: &[u8], cols: usize, curves: &Curves, progress: &Progress<'_>) -> Result<Vec<f32>> {
    per_row(density, cols, curves, progress, |places, density, until, out| {
        let mut sum = 0;
        for (until, &d) in until[1..].iter_mut().zip(density) {
            sum += u32::from(d);
            *until = sum;
        }
        let mut start = 0;
        for (k, out) in out.iter_mut().enumerate() {
            let end = match places.get(k + 1) {
                Some(&next) => ((0.5 * (places[k] + next)) as usize + 1).min(cols),
                None => cols,
            };
            // Curves nearer to each other than pixels share the last one.
            start = start.min(end - 1);
            *out = (until[end] - until[start]) as f32 / (end - start) as f32;
            start = end;
        }
    })
}

/// Calls `visit(places of the curves, densities, room for a number per pixel and one more, result)` on each row.
fn per_row(
    density: &[u8],
    cols: usize,
    curves: &Curves,
    progress: &Progress<'_>,
    visit: impl Fn(&[f64], &[u8], &mut [u32], &mut [f32]) + Sync,
) -> Result<Vec<f32>> {
    let rows = density.len() / cols;
    let count = curves.count;
    let mut along = vec![0.0_f32; rows * count];
    along.par_chunks_mut(count).enumerate().try_for_each_init(
        || (vec![0.0; count], vec![0_u32; cols + 1]),
        |(places, sums), (row, out)| {
            curves.cross(row, places);
            visit(places, &density[row * cols..(row + 1) * cols], sums, out);
            progress.advance(1)
        },
    )?;
    Ok(along)
}
