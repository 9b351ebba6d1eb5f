//! Sample spacing of an image, and the edge limit that comes from it.

use glam::DVec3;

use super::samples::SampleGrid;
use super::steps::Steps;
use super::{RangeImage, pitch};
use base::error::Result;
use base::progress::Progress;

/// An edge longer than this many times the median spacing is a jump, unless the caller says otherwise. With 3.4 the ten
/// scans of the Stanford bunny give 690,821 triangles, against 690,534 in the paper's Table 1 \[MI04\].
pub const JUMP_FACTOR: f64 = 3.4;

/// Distances of neighbouring samples along rows and along columns. One number where pixels are square: on a slanted surface
/// both differ, but a jump is the same in either direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spacing {
    /// Median distance of neighbours in a row.
    pub along_rows: f64,
    /// Median distance of neighbours in a column.
    pub along_columns: f64,
    /// Whether both are one number.
    is_one: bool,
}

impl Spacing {
    /// Measures it. Pairs at the same place don't count. 0 if there is no pair.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn of(image: &RangeImage, grid: &SampleGrid, progress: &Progress<'_>) -> Result<Self> {
        Self::median(pitch::is_square(image, grid), &grid.right_squared, &grid.down_squared, progress)
    }

    /// The median of the square roots of both, or of each.
    fn median(is_one: bool, rows: &[f64], columns: &[f64], progress: &Progress<'_>) -> Result<Self> {
        let [along_rows, along_columns] = if is_one {
            [median_root(rows, columns, progress)?; 2]
        } else {
            [median_root(rows, &[], progress)?, median_root(columns, &[], progress)?]
        };
        Ok(Spacing { along_rows, along_columns, is_one })
    }

    /// The larger of both: within it each sample has neighbours on all sides.
    pub fn larger(&self) -> f64 {
        self.along_rows.max(self.along_columns)
    }
}

/// Direction in the grid from one end of an edge to the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// From column to column.
    Row,
    /// From row to row.
    Column,
    /// Across a cell of 2 x 2 pixels.
    Diagonal,
}

/// Steps that an edge may be longer by. One, and half of one for what the measured step may be off by.
const BY_STEPS: f64 = 1.5;

/// Longest edges that still belong to the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct EdgeLimit {
    /// The point that rays fan out from, if edges are measured by their range: the distance between `eye` and the nearer end of the edge.
    /// Samples are the further apart the further away they are, and one length for all would tear far surfaces or bridge near jumps.
    /// `None`: lengths count. So it is for parallel rays, whose samples are equally dense at any range, and for a length given by the
    /// caller.
    eye: Option<DVec3>,
    /// By [`Along`].
    limits: [f64; 3],
    /// Steps that values are multiples of, if any are seen. Rounding moves neighbours apart by up to a step, which says nothing of a jump.
    steps: Option<Steps>,
}

impl EdgeLimit {
    /// One length for all edges.
    pub fn length(length: f64) -> Self {
        EdgeLimit { eye: None, limits: [length; 3], steps: None }
    }

    /// [`JUMP_FACTOR`] times the median distance of neighbouring samples. Times the median of distance by range if the rays fan out from a
    /// point. If pixels are not square, edges along the longer side and diagonals are compared with the median along that side, edges along
    /// the other one with the geometric mean of both medians. If values are multiples of a step longer than the spacing, edges may be
    /// longer by one and a half of it.
    ///
    /// # Errors
    /// [`base::Error::Cancelled`].
    pub fn from_data(image: &RangeImage, grid: &SampleGrid, spacing: Spacing, progress: &Progress<'_>) -> Result<Self> {
        let steps = Steps::longer_than(spacing.larger(), image, grid);
        let Some(eye) = image.projection().eye() else { return Ok(Self::times(None, spacing, steps)) };
        let by_range = |squared: f64, a: usize, b: usize| {
            let range = grid.positions[a].distance_squared(eye).min(grid.positions[b].distance_squared(eye));
            if range > 0.0 { squared / range } else { f64::INFINITY }
        };
        let mut rows = Vec::new();
        for block in progress.ranges(grid.len()) {
            let block = block?;
            rows.extend(block.filter(|&k| grid.has_right(k)).map(|k| by_range(grid.right_squared[k], k, k + 1)));
        }
        let mut columns = Vec::new();
        for block in progress.ranges(grid.len()) {
            let down = block?.filter(|&k| grid.down_squared[k] < f64::INFINITY);
            columns.extend(down.map(|k| by_range(grid.down_squared[k], k, grid.down[k] as usize)));
        }
        Ok(Self::times(Some(eye), Spacing::median(spacing.is_one, &rows, &columns, progress)?, steps))
    }

    fn times(eye: Option<DVec3>, spacing: Spacing, steps: Option<Steps>) -> Self {
        let larger = spacing.larger();
        let limits = if spacing.is_one {
            [larger; 3]
        } else {
            // A surface that is seen at a grazing angle along the finer direction is not torn where nothing tells, between
            // two of the coarser steps, that it should be.
            let mean = (spacing.along_rows * spacing.along_columns).sqrt();
            [mean.max(spacing.along_rows), mean.max(spacing.along_columns), larger]
        };
        EdgeLimit { eye, limits: limits.map(|spacing| JUMP_FACTOR * spacing), steps }
    }

    /// The point that rays fan out from, if edges are measured by their range.
    pub(crate) fn eye(&self) -> Option<DVec3> {
        self.eye
    }

    /// Squares of the limits, by [`Along`].
    pub(crate) fn squares(&self) -> [f64; 3] {
        self.limits.map(|limit| limit * limit)
    }

    /// Whether edges may be longer where values lie on steps.
    pub(crate) fn has_steps(&self) -> bool {
        self.steps.is_some()
    }

    /// Length by which edges at a range may be longer, because values lie on steps.
    pub(crate) fn by_steps(&self, range: f64) -> f64 {
        self.steps.as_ref().map_or(0.0, |steps| BY_STEPS * steps.at(range))
    }

    /// Whether the edge between points `a` and `b` is short enough.
    pub fn allows(&self, along: Along, a: DVec3, b: DVec3) -> bool {
        let (squared, limit) = (a.distance_squared(b), self.limits[along as usize]);
        let range = self.eye.map_or(1.0, |eye| a.distance_squared(eye).min(b.distance_squared(eye)));
        squared <= limit * limit * range
            || self.has_steps() && squared.sqrt() <= limit * range.sqrt() + self.by_steps(range.sqrt())
    }

    /// The neighbours of a sample that are no jump away: left, right, upper, lower.
    pub fn allowed(&self, grid: &SampleGrid, sample: usize) -> [Option<usize>; 4] {
        let mut neighbours = grid.neighbours(sample);
        for (along, neighbour) in
            [Along::Row, Along::Row, Along::Column, Along::Column].into_iter().zip(&mut neighbours)
        {
            *neighbour = neighbour.filter(|&n| self.allows(along, grid.positions[sample], grid.positions[n]));
        }
        neighbours
    }
}

/// Size of the sample that brackets the median, a power of two. With 512 the bracket of +- 8 % of the ranks misses once in 10^3 images or
/// so, which costs a full selection.
const SAMPLE: usize = 512;

/// Median of the square roots of the finite positive values of both slices, 0 without any.
fn median_root(first: &[f64], second: &[f64], progress: &Progress<'_>) -> Result<f64> {
    let usable = |v: &&f64| **v > 0.0 && **v < f64::INFINITY;
    let all = || first.iter().chain(second);
    let mut count = 0;
    for slice in [first, second] {
        for block in progress.blocks(slice) {
            count += block?.iter().filter(usable).count();
        }
    }
    if count == 0 {
        return Ok(0.0);
    }
    let (lower, upper) = ((count - 1) / 2, count / 2);
    // Most values can be set aside by comparing them with a bracket found in a small sample.
    let stride = (first.len() + second.len()) / SAMPLE + 1;
    let mut sample: Vec<f64> = all().step_by(stride).filter(usable).copied().collect();
    sample.sort_unstable_by(f64::total_cmp);
    let (low, high) = if stride == 1 || sample.is_empty() {
        (0.0, f64::MAX)
    } else {
        let n = sample.len();
        (sample[n * 42 / 100], sample[n * 58 / 100])
    };
    let mut below = 0;
    let mut between = Vec::with_capacity(count / 4);
    for slice in [first, second] {
        for block in progress.blocks(slice) {
            for &v in block? {
                below += usize::from(v > 0.0 && v < low);
                if v >= low && v <= high && v > 0.0 {
                    between.push(v);
                }
            }
        }
    }
    if below > lower || below + between.len() <= upper {
        between.clear();
        between.extend(all().filter(usable));
        below = 0;
    }
    let (_, &mut low_middle, rest) = between.select_nth_unstable_by(lower - below, f64::total_cmp);
    let high_middle =
        if upper == lower { low_middle } else { rest.iter().copied().min_by(f64::total_cmp).unwrap_or(low_middle) };
    Ok(0.5 * (low_middle.sqrt() + high_middle.sqrt()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn plain_median(mut values: Vec<f64>) -> f64 {
        values.retain(|v| *v > 0.0 && v.is_finite());
        values.iter_mut().for_each(|v| *v = v.sqrt());
        values.sort_by(f64::total_cmp);
        let n = values.len();
        if n == 0 { 0.0 } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
    }

    proptest! {
        #[test]
        fn median_is_that_of_a_full_sort(
            first in prop::collection::vec(prop_oneof![Just(f64::INFINITY), Just(0.0), Just(0.25), 0.0..1.0_f64], 0..3000),
            second in prop::collection::vec(prop_oneof![Just(f64::INFINITY), Just(2.0), 0.0..9.0_f64], 0..3000),
        ) {
            let whole = first.iter().chain(&second).copied().collect();
            prop_assert_eq!(median_root(&first, &second, &Progress::none()).unwrap(), plain_median(whole));
        }
    }

    #[test]
    fn a_bracket_that_misses_is_mended() {
        // The strided sample sees only the small values, the median is a large one.
        let values: Vec<f64> = (0..4096).map(|i| if i % 9 == 0 { 1.0 } else { 100.0 + f64::from(i) }).collect();
        assert_eq!(median_root(&values, &[], &Progress::none()).unwrap(), plain_median(values));
    }
}
