//! Stage 6: one grid of pixels, without folds. \[GSB97, sec. 2.2\]
//!
//! The paper stitches what the tiles give and claims no more. Rounded to pixels, vertices may coincide. Where neighbouring curves were
//! sampled differently a quad may fold over. Both are mended here, exactly, in whole numbers.

use rayon::prelude::*;

use super::rows::Placed;
use super::tiles::{Layout, evenly};
use base::error::Result;
use base::progress::Progress;

/// A grid of vertices on pixels, row by row: [row, column].
///
/// Columns rise along each row and rows rise down each column, strictly. Every corner of every quad turns the same way: the quads are
/// convex and tile the rectangle between the image's corners.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Net {
    pub rows: usize,
    pub cols: usize,
    pub sites: Vec<[u32; 2]>,
}

impl Net {
    /// The grid of the same size whose lines are evenly spread over the image.
    pub fn uniform(rows: usize, cols: usize, pixels: [usize; 2]) -> Self {
        let across: Vec<u32> = (0..cols).map(|j| evenly(j, cols - 1, pixels[1] - 1) as u32).collect();
        let sites = (0..rows)
            .flat_map(|i| {
                let row = evenly(i, rows - 1, pixels[0] - 1) as u32;
                across.iter().map(move |&col| [row, col])
            })
            .collect();
        Net { rows, cols, sites }
    }

    /// Corners of quad (`i`, `j`): the upper left one, then right, down, left.
    #[inline]
    pub fn corners(&self, i: usize, j: usize) -> [usize; 4] {
        let a = i * self.cols + j;
        [a, a + 1, a + self.cols + 1, a + self.cols]
    }

    /// Whether quad (`i`, `j`) is convex and its sides rise, given its corners' sites.
    #[inline]
    pub fn is_sound([a, b, c, d]: [[u32; 2]; 4]) -> bool {
        b[1] > a[1] && c[1] > d[1] && d[0] > a[0] && c[0] > b[0] && {
            let turn = |o: [u32; 2], p: [u32; 2], q: [u32; 2]| {
                let [o, p, q] = [o, p, q].map(|v| v.map(i64::from));
                (p[1] - o[1]) * (q[0] - o[0]) - (p[0] - o[0]) * (q[1] - o[1]) > 0
            };
            turn(a, b, c) && turn(b, c, d) && turn(c, d, a) && turn(d, a, b)
        }
    }

    /// Whether the quads around vertex (`i`, `j`) are sound if it lies at `site`.
    pub fn fits(&self, i: usize, j: usize, site: [u32; 2]) -> bool {
        let here = i * self.cols + j;
        (i.saturating_sub(1)..(i + 1).min(self.rows - 1)).all(|qi| {
            (j.saturating_sub(1)..(j + 1).min(self.cols - 1))
                .all(|qj| Self::is_sound(self.corners(qi, qj).map(|v| if v == here { site } else { self.sites[v] })))
        })
    }
}

/// Levels between the uniform grid (0) and the wanted places.
const LEVELS: u32 = 8;
/// Quads or vertices handled between two looks at the progress.
const BLOCK: usize = 4096;

/// Rounds to pixels and mends. Returns the grid and how many of its vertices are not where they were wanted.
/// O(vertices).
pub(super) fn stitch(
    placed: &Placed,
    layout: &Layout,
    pixels: [usize; 2],
    progress: &Progress<'_>,
) -> Result<(Net, usize)> {
    let (rows, cols) = (layout.rows(), layout.cols());
    let mut wanted = Net { rows, cols, sites: vec![[0; 2]; rows * cols] };
    // Rows rise down each column ...
    let mut column = vec![0_u32; rows];
    for j in 0..cols {
        progress.check()?;
        let places = (0..rows).map(|i| placed.places[i * cols + j][0]);
        rising(places, &layout.row_lines, layout.steps_down, &mut column);
        for (i, &row) in column.iter().enumerate() {
            wanted.sites[i * cols + j][0] = row;
        }
    }
    // ... and columns along each row.
    wanted.sites.par_chunks_mut(cols).zip(placed.places.par_chunks(cols)).for_each_init(
        || vec![0_u32; cols],
        |row, (sites, places)| {
            rising(places.iter().map(|p| p[1]), &layout.col_lines, layout.steps_across, row);
            for (site, &col) in sites.iter_mut().zip(row.iter()) {
                site[1] = col;
            }
        },
    );
    progress.check()?;
    unfold(wanted, pixels, progress)
}

/// Rounds places to pixels that rise strictly. Places on tiles' borders are there already.
fn rising(places: impl Iterator<Item = f64>, lines: &[usize], steps: usize, out: &mut [u32]) {
    let mut previous = 0;
    for (k, place) in places.enumerate() {
        let (tile, step) = (k / steps, k % steps);
        out[k] = if step == 0 {
            lines[tile] as u32
        } else {
            let last = lines[tile + 1] - (steps - step);
            (place.round() as usize).max(previous + 1).min(last) as u32
        };
        previous = out[k] as usize;
    }
}

/// Moves the corners of quads that are not sound toward the uniform grid, whose quads are: an eighth of the way at a time, all
/// corners of a quad together. It ends, at the latest with the uniform grid.
fn unfold(wanted: Net, pixels: [usize; 2], progress: &Progress<'_>) -> Result<(Net, usize)> {
    let uniform = Net::uniform(wanted.rows, wanted.cols, pixels);
    progress.check()?;
    let mut levels = vec![LEVELS; wanted.sites.len()];
    let mut net = wanted.clone();
    progress.check()?;
    let quads = (net.rows - 1, net.cols - 1);
    // Quads to look at, and vertices of those that are not sound: each once.
    let mut suspects: Vec<usize> = (0..quads.0 * quads.1).collect();
    let mut moved: Vec<usize> = Vec::new();
    let mut is_suspect = vec![false; quads.0 * quads.1];
    let mut is_moved = vec![false; net.sites.len()];
    while !suspects.is_empty() {
        progress.check()?;
        let unsound = suspects
            .par_chunks(BLOCK)
            .map(|some| {
                progress.check()?;
                let sound = |q: usize| Net::is_sound(net.corners(q / quads.1, q % quads.1).map(|v| net.sites[v]));
                Ok(some.iter().copied().filter(|&q| !sound(q)).collect::<Vec<_>>())
            })
            .collect::<Result<Vec<_>>>()?;
        moved.clear();
        for q in unsound.into_iter().flatten() {
            let corners = net.corners(q / quads.1, q % quads.1);
            moved.extend(corners.into_iter().filter(|&v| !std::mem::replace(&mut is_moved[v], true)));
        }
        suspects.clear();
        for (k, &v) in moved.iter().enumerate() {
            if k % BLOCK == 0 {
                progress.check()?;
            }
            is_moved[v] = false;
            let level = levels[v].saturating_sub(1);
            levels[v] = level;
            let between = |axis: usize| {
                let (from, to) = (u64::from(uniform.sites[v][axis]), u64::from(wanted.sites[v][axis]));
                let (level, whole) = (u64::from(level), u64::from(LEVELS));
                ((from * (whole - level) + to * level + whole / 2) / whole) as u32
            };
            net.sites[v] = [between(0), between(1)];
            let (i, j) = (v / net.cols, v % net.cols);
            for qi in i.saturating_sub(1)..(i + 1).min(quads.0) {
                let around = (j.saturating_sub(1)..(j + 1).min(quads.1)).map(|qj| qi * quads.1 + qj);
                suspects.extend(around.filter(|&q| !std::mem::replace(&mut is_suspect[q], true)));
            }
        }
        suspects.iter().for_each(|&q| is_suspect[q] = false);
    }
    let moved = net.sites.iter().zip(&wanted.sites).filter(|(a, b)| a != b).count();
    Ok((net, moved))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn assert_sound(net: &Net, pixels: [usize; 2]) {
        for i in 0..net.rows - 1 {
            for j in 0..net.cols - 1 {
                assert!(Net::is_sound(net.corners(i, j).map(|v| net.sites[v])), "quad {i} {j}");
            }
        }
        for i in 0..net.rows {
            assert_eq!((net.sites[i * net.cols][1], net.sites[(i + 1) * net.cols - 1][1]), (0, pixels[1] as u32 - 1));
        }
        for j in 0..net.cols {
            assert_eq!((net.sites[j][0], net.sites[(net.rows - 1) * net.cols + j][0]), (0, pixels[0] as u32 - 1));
        }
    }

    proptest! {
        #[test]
        fn any_places_become_a_grid_without_folds(
            pixels in (2..40_usize, 2..40_usize), tiles in (1..4_usize, 1..4_usize), steps in (1..6_usize, 1..6_usize),
            seed in any::<u64>(),
        ) {
            let pixels = [pixels.0, pixels.1];
            let Ok(layout) = Layout::new(pixels, [tiles.0, tiles.1], [steps.0 + 1, steps.1 + 1]) else {
                return Ok(());
            };
            let mut state = seed;
            let mut random = |top: usize| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 33) as f64 / (1_u64 << 31) as f64 * top as f64
            };
            let places = (0..layout.rows() * layout.cols()).map(|_| [random(pixels[0]), random(pixels[1])]).collect();
            let (net, _) = stitch(&Placed { places }, &layout, pixels, &Progress::none()).unwrap();
            assert_sound(&net, pixels);
            prop_assert_eq!((net.rows, net.cols), (layout.rows(), layout.cols()));
        }
    }

    #[test]
    fn a_sound_grid_is_left_alone() {
        let layout = Layout::new([100, 80], [4, 3], [5, 6]).unwrap();
        let uniform = Net::uniform(layout.rows(), layout.cols(), [100, 80]);
        let places = uniform.sites.iter().map(|s| s.map(f64::from)).collect();
        let (net, moved) = stitch(&Placed { places }, &layout, [100, 80], &Progress::none()).unwrap();
        assert_eq!((net, moved), (uniform, 0));
        // Each quad lies on its own side of its diagonals; turned over it doesn't.
        assert!(Net::is_sound([[0, 0], [0, 9], [9, 9], [9, 0]]));
        assert!(!Net::is_sound([[0, 0], [9, 1], [10, 2], [1, 1]]));
        assert!(!Net::is_sound([[0, 0], [0, 0], [9, 9], [9, 0]]));
        // Rising sides alone don't make it convex.
        assert!(!Net::is_sound([[5, 5], [0, 9], [6, 6], [9, 0]]));
    }
}
