//! Boxes that meet, whatever their sizes and however they lie.

use rustc_hash::FxHashMap;

use super::near::Bounds;
use base::error::Result;
use base::progress::Progress;
use base::work;

/// A cell of a grid, the grids' cells twice as wide from level to level: the level, and the places along the axes.
type Cell = (i32, [i64; 3]);

/// All pairs of boxes that meet, each as the larger number and the smaller one, rising.
///
/// A box lies in the cell of its centre in the grid whose cells are two to four times as wide as it is long. So a box that meets it lies in
/// a cell beside its own, in the grid of its own level or, if larger, in one of the others that are in use.
///
/// Cost: O(n) for n boxes of which few meet, for each of the levels in use.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn meeting(boxes: &[(usize, Bounds)], progress: &Progress<'_>) -> Result<Vec<(usize, usize)>> {
    let cells: Vec<Cell> = boxes.iter().map(|(_, bounds)| cell(bounds, level(bounds))).collect();
    let mut levels: Vec<i32> = cells.iter().map(|cell| cell.0).collect();
    levels.sort_unstable();
    levels.dedup();
    let mut grid: FxHashMap<Cell, Vec<usize>> = FxHashMap::default();
    for (k, &cell) in cells.iter().enumerate() {
        grid.entry(cell).or_default().push(k);
    }
    let mut pairs = Vec::new();
    for (k, (i, bounds)) in boxes.iter().enumerate() {
        progress.check()?;
        let own = cells[k].0;
        for &level in levels.iter().filter(|&&level| level >= own) {
            let (_, [x, y, z]) = cell(bounds, level);
            for beside in 0..27 {
                let step = |by: i64| beside / by % 3 - 1;
                let place = [x.saturating_add(step(1)), y.saturating_add(step(3)), z.saturating_add(step(9))];
                for &other in grid.get(&(level, place)).into_iter().flatten() {
                    work::step();
                    let (j, other_bounds) = &boxes[other];
                    // Those of one level find each other both ways.
                    if (level > own || other > k) && bounds.meets(other_bounds) {
                        pairs.push((*i.max(j), *i.min(j)));
                    }
                }
            }
        }
    }
    pairs.sort_unstable();
    // At the end of what numbers hold a cell can be beside itself.
    pairs.dedup();
    Ok(pairs)
}

/// The exponent of two that is the width of the cells for a box.
fn level(bounds: &Bounds) -> i32 {
    // From 1 to 2 times the longest side, and as much again: rounding must not part what touches.
    (bounds.max - bounds.min).max_element().log2().ceil().clamp(-1000.0, 1000.0) as i32 + 1
}

fn cell(bounds: &Bounds, level: i32) -> Cell {
    let centre = (bounds.min * 0.5 + bounds.max * 0.5) * (-f64::from(level)).exp2();
    (level, centre.floor().to_array().map(|place| place as i64))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    fn all_pairs(boxes: &[(usize, Bounds)]) -> Vec<(usize, usize)> {
        let pair = |i: usize, j: usize| (boxes[i].1.meets(&boxes[j].1)).then_some((boxes[i].0, boxes[j].0));
        (0..boxes.len()).flat_map(|i| (0..i).filter_map(move |j| pair(i, j))).collect()
    }

    proptest! {
        #[test]
        fn finds_what_comparing_all_with_all_finds(
            corners in prop::collection::vec([-8..8_i32, -8..8, -8..8], 0..40),
            sizes in prop::collection::vec([0..4_i32, 0..4, 0..12], 40),
            scale in prop_oneof![Just(1.0), Just(0.3), Just(1e-300), Just(1e280)],
        ) {
            let boxes: Vec<(usize, Bounds)> = corners.iter().zip(&sizes).enumerate().map(|(i, (&p, &size))| {
                let min = DVec3::from(p.map(f64::from)) * scale;
                (2 * i, Bounds { min, max: min + DVec3::from(size.map(f64::from)) * scale })
            }).collect();
            prop_assert_eq!(meeting(&boxes, &Progress::none()).unwrap(), all_pairs(&boxes));
        }
    }

    #[test]
    fn work_grows_with_the_number_of_boxes_in_a_wall() {
        let work = |side: usize, axis: usize| {
            let box_at = |i: usize| {
                let mut min = [0.0, (i % side) as f64, (i / side) as f64];
                min.rotate_left(axis);
                let min = DVec3::from(min);
                (i, Bounds { min, max: min + DVec3::splat(0.5 + 0.4 * (i % 7) as f64 / 7.0) })
            };
            let boxes: Vec<_> = (0..side * 150).map(box_at).collect();
            let (pairs, steps) = work::counted(|| meeting(&boxes, &Progress::none()).unwrap());
            assert!(pairs.is_empty());
            steps
        };
        for axis in 0..3 {
            let (one, two) = (work(100, axis), work(200, axis));
            assert!(one > 10_000 && 10 * two <= 23 * one, "{one} {two}");
        }
    }
}
