//! Stage 4: vertical curves, by inverse distribution sampling of rows of pixels. \[GSB97, sec. 2.2, eq. 3\]
//!
//! The paper samples each row of pixels for itself, so that curves jitter from row to row. Here the density of a row is averaged over the
//! rows around it, as far as `smoothing` says, and only every few rows ("knots") are sampled. The curves run straight in between. Without
//! smoothing every row is a knot, as in the paper.
//!
//! A row on a tile's upper or lower border is sampled once for both tiles, and a tile's left and right border are curves of
//! both: neighbours agree by construction.

use rayon::prelude::*;

use super::tiles::Layout;
use base::error::Result;
use base::progress::Progress;

/// Vertical curves: where each crosses the rows of pixels, strictly rising from curve to curve.
#[derive(Debug)]
pub(super) struct Curves {
    /// Pixel rows that were sampled, rising: all tiles' borders are among them.
    pub knots: Vec<usize>,
    /// The last knot that is not below each row of pixels.
    knot_of_row: Vec<u32>,
    /// A place (pixel column) a knot and curve, knot by knot.
    places: Vec<f64>,
    /// Curves.
    pub count: usize,
}

impl Curves {
    /// The place where a curve crosses row `row`, which need not be whole.
    #[inline]
    pub fn place(&self, row: f64, curve: usize) -> f64 {
        let (knot, share) = self.knot_at(row);
        let here = self.places[knot * self.count + curve];
        match self.places.get((knot + 1) * self.count + curve) {
            Some(next) => here + (next - here) * share,
            None => here,
        }
    }

    /// The places where all curves cross row `row`.
    pub fn cross(&self, row: usize, places: &mut [f64]) {
        let (knot, share) = self.knot_at(row as f64);
        let (here, next) = self.places[knot * self.count..].split_at(self.count);
        if next.is_empty() {
            places.copy_from_slice(here);
            return;
        }
        for ((place, here), next) in places.iter_mut().zip(here).zip(next) {
            *place = here + (next - here) * share;
        }
    }

    /// The last knot that is not below `row`, and which share of the way to the next one `row` lies.
    #[inline]
    fn knot_at(&self, row: f64) -> (usize, f64) {
        let knot = self.knot_of_row[row as usize] as usize;
        let start = self.knots[knot];
        match self.knots.get(knot + 1) {
            Some(&end) => (knot, (row - start as f64) / (end - start) as f64),
            None => (knot, 0.0),
        }
    }
}

/// Rows that are sampled: in each tile evenly spread, `spacing` rows apart or a little less.
fn knots(layout: &Layout, spacing: usize) -> Vec<usize> {
    let mut knots = vec![0];
    for lines in layout.row_lines.windows(2) {
        let height = lines[1] - lines[0];
        let parts = height.div_ceil(spacing.max(1));
        knots.extend((1..=parts).map(|i| lines[0] + super::tiles::evenly(i, parts, height)));
    }
    knots
}

/// Samples the rows. `density` has one entry per pixel. `window` rows around a knot are averaged, and knots lie half that apart. O(pixels).
pub(super) fn sample(
    density: &[u8],
    cols: usize,
    layout: &Layout,
    window: usize,
    floor: f64,
    progress: &Progress<'_>,
) -> Result<Curves> {
    let rows = density.len() / cols;
    let count = layout.cols();
    let reach = window / 2;
    let knots = knots(layout, reach);
    let mut places = vec![0.0; knots.len() * count];
    places.par_chunks_mut(count).zip(&knots).try_for_each_init(
        || vec![0_u32; cols],
        |profile, (places, &row)| {
            profile.fill(0);
            for r in row.saturating_sub(reach)..(row + reach + 1).min(rows) {
                for (sum, &d) in profile.iter_mut().zip(&density[r * cols..(r + 1) * cols]) {
                    *sum += u32::from(d);
                }
                if r % 64 == 0 {
                    progress.check()?;
                }
            }
            sample_row(profile, &layout.col_lines, layout.steps_across, floor, places);
            progress.advance(1)
        },
    )?;
    let mut knot_of_row = Vec::with_capacity(rows);
    for (k, &knot) in knots.iter().enumerate() {
        knot_of_row.resize(*knots.get(k + 1).unwrap_or(&(knot + 1)), k as u32);
    }
    Ok(Curves { knots, knot_of_row, places, count })
}

/// Places of the vertices of all tiles along one row of pixels, given the density there.
fn sample_row(profile: &[u32], lines: &[usize], steps: usize, floor: f64, places: &mut [f64]) {
    for (tile, line) in lines.windows(2).enumerate() {
        let inside = &profile[line[0]..=line[1]];
        let places = &mut places[tile * steps..=(tile + 1) * steps];
        inverse(inside.iter().map(|&p| f64::from(p)), floor, places);
        for place in places {
            *place += line[0] as f64;
        }
    }
}

/// Inverse distribution sampling: places between the first and the last of `weights`, such that the same weight lies between any two
/// neighbours. Both ends are places. The weight between two pixels is the mean of theirs. `floor` times the mean weight is added
/// everywhere. If there is no weight at all places are evenly spread.
pub(super) fn inverse(weights: impl ExactSizeIterator<Item = f64> + Clone, floor: f64, places: &mut [f64]) {
    let (pixels, steps) = (weights.len(), places.len() - 1);
    let sum: f64 = weights.clone().sum();
    // Even where no floor is asked for, places must not coincide.
    let even = (floor * sum / pixels as f64).max(sum * 1e-9);
    let even = if even > 0.0 { even } else { 1.0 };
    let mut ends = weights.clone();
    let (first, last) = (ends.next().unwrap_or(0.0), ends.last().unwrap_or(0.0));
    let total = sum - 0.5 * (first + last) + even * (pixels - 1) as f64;
    places[0] = 0.0;
    places[steps] = (pixels - 1) as f64;
    let mut next = 1;
    let (mut passed, mut previous) = (0.0, first);
    for (i, weight) in weights.skip(1).enumerate() {
        let here = 0.5 * (previous + weight) + even;
        while next < steps && total * next as f64 <= (passed + here) * steps as f64 {
            places[next] = i as f64 + ((total * next as f64 / steps as f64 - passed) / here).clamp(0.0, 1.0);
            next += 1;
        }
        passed += here;
        previous = weight;
    }
    // Rounding may leave the last few unreached.
    for place in &mut places[next..steps] {
        *place = (pixels - 1) as f64;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_same_weight_lies_between_any_two_places(
            weights in prop::collection::vec(prop_oneof![Just(0.0), 0.0..300.0_f64], 2..60), steps in 1..50_usize,
            floor in prop_oneof![Just(0.0), 0.0..3.0_f64],
        ) {
            let mut places = vec![f64::NAN; steps + 1];
            inverse(weights.iter().copied(), floor, &mut places);
            prop_assert_eq!((places[0], places[steps]), (0.0, (weights.len() - 1) as f64));
            prop_assert!(places.windows(2).all(|w| w[0] <= w[1]));
            let sum: f64 = weights.iter().sum();
            let even = if sum > 0.0 { (floor * sum / weights.len() as f64).max(1e-9 * sum) } else { 1.0 };
            // Weight left of a place, by the definition.
            let until = |x: f64| -> f64 {
                (0..weights.len() - 1)
                    .map(|i| (x - i as f64).clamp(0.0, 1.0) * (0.5 * (weights[i] + weights[i + 1]) + even))
                    .sum()
            };
            let total = until((weights.len() - 1) as f64);
            for (k, &place) in places.iter().enumerate() {
                let wanted = total * k as f64 / steps as f64;
                prop_assert!((until(place) - wanted).abs() <= 1e-6 * total, "{} at {}: {}", k, place, until(place));
            }
        }
    }

    #[test]
    fn without_smoothing_each_tile_gives_what_it_gives_alone() {
        let (rows, cols) = (41, 53);
        let density: Vec<u8> = (0..rows * cols).map(|i| ((i * 2_654_435_761) >> 7) as u8 / 3).collect();
        let layout = Layout::new([rows, cols], [3, 2], [5, 7]).unwrap();
        let whole = sample(&density, cols, &layout, 0, 0.3, &Progress::none()).unwrap();
        for v in 0..3 {
            for h in 0..2 {
                let (r, c) = (&layout.row_lines[v..v + 2], &layout.col_lines[h..h + 2]);
                let tile: Vec<u8> =
                    (r[0]..=r[1]).flat_map(|row| density[row * cols + c[0]..=row * cols + c[1]].to_vec()).collect();
                let size = [r[1] - r[0] + 1, c[1] - c[0] + 1];
                let alone = Layout::new(size, [1, 1], [5, 7]).unwrap();
                let alone = sample(&tile, size[1], &alone, 0, 0.3, &Progress::none()).unwrap();
                for row in 0..size[0] {
                    for k in 0..7 {
                        let (there, here) = (whole.place((r[0] + row) as f64, h * 6 + k), alone.place(row as f64, k));
                        assert!((there - c[0] as f64 - here).abs() < 1e-9);
                    }
                }
            }
        }
    }

    #[test]
    fn curves_keep_their_order_on_every_row() {
        let (rows, cols) = (60, 90);
        let density: Vec<u8> = (0..rows * cols).map(|i| if i % 7 == 0 || i / cols > 40 { 200 } else { 0 }).collect();
        let layout = Layout::new([rows, cols], [2, 2], [9, 30]).unwrap();
        for window in [0, 1, 7, 1000] {
            let curves = sample(&density, cols, &layout, window, 0.0, &Progress::none()).unwrap();
            assert!(layout.row_lines.iter().all(|line| curves.knots.contains(line)));
            for row in 0..rows {
                let mut places = vec![0.0; curves.count];
                curves.cross(row, &mut places);
                assert!((0..curves.count).all(|k| curves.place(row as f64, k) == places[k]));
                assert!(places.windows(2).all(|w| w[0] < w[1]), "{places:?}");
                assert_eq!((places[29], places[58]), (layout.col_lines[1] as f64, 89.0));
            }
        }
    }
}
