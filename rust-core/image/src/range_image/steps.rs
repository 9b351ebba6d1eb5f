//! Steps that depths are multiples of, such as whole centimetres or disparities, where they are longer than the distance of
//! samples: a slanted surface is stairs then, whose risers are no jumps.

use glam::DVec3;

use super::samples::{NO_SAMPLE, SampleGrid};
use super::{DepthKind, Projection, RangeImage};

/// Samples whose neighbours are looked at.
const LOOKED_AT: usize = 1 << 13;

/// Depths lie on steps where at least this share of neighbours is equal, and the image reaches over this many steps: a box
/// has equal neighbours, too.
const EQUAL: f64 = 0.02;
const LEAST: f64 = 8.0;

/// Pairs of a level whose depths differ, at least.
const DIFFERENT: usize = 24;

/// Levels to a doubling of the range: within one the step of disparities grows by half.
const LEVELS: f64 = 4.0;

/// Depths that differ by less than this share of them are equal: rounding errors of single precision.
const ROUNDING: f64 = 5e-7;

/// Steps along the rays, by range.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Steps {
    /// Range and step, by rising range.
    levels: Vec<[f64; 2]>,
}

/// Steps seen at about one range.
#[derive(Default)]
struct Seen {
    range: f64,
    equal: usize,
    different: Vec<f64>,
}

impl Steps {
    /// Those of the samples as they are, if their median is longer than `spacing`. O(1): some samples are looked at.
    pub(super) fn longer_than(spacing: f64, image: &RangeImage, grid: &SampleGrid) -> Option<Steps> {
        let is_down = |k: usize| (grid.down[k] != NO_SAMPLE).then(|| grid.down[k] as usize);
        let levels = Self::along(image, grid, |k| grid.has_right(k).then(|| k + 1))
            .or_else(|| Self::along(image, grid, is_down))?;
        let mut steps: Vec<f64> = levels.iter().map(|level| level[1]).collect();
        let middle = steps.len() / 2;
        let typical = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        (typical > spacing).then_some(Steps { levels })
    }

    /// The step at a range: linear between levels, constant beyond them.
    pub(super) fn at(&self, range: f64) -> f64 {
        let after = self.levels.partition_point(|level| level[0] < range);
        match (after.checked_sub(1).map(|before| self.levels[before]), self.levels.get(after)) {
            (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (range - a[0]) / (b[0] - a[0]),
            (Some(level), None) | (None, Some(&level)) => level[1],
            (None, None) => 0.0,
        }
    }

    /// By pairs of neighbours in one direction. `None` if these show no steps.
    fn along(
        image: &RangeImage,
        grid: &SampleGrid,
        neighbour: impl Fn(usize) -> Option<usize>,
    ) -> Option<Vec<[f64; 2]>> {
        let (projection, eye) = (image.projection(), image.projection().eye());
        // The value that the sensor measures, and its length along the ray.
        let depth = |at: DVec3| match (projection, eye) {
            (Projection::Pinhole { depth: DepthKind::Planar, .. }, _) => at.z,
            (_, Some(eye)) => at.distance(eye),
            (_, None) => at.dot(projection.view_direction(at)),
        };
        let (mut seen, mut least, mut most) =
            (std::collections::BTreeMap::<i64, Seen>::new(), f64::INFINITY, f64::NEG_INFINITY);
        // Odd, so that it is no multiple of an even number of columns.
        for k in (0..grid.len()).step_by((grid.len() / LOOKED_AT) | 1) {
            let Some(other) = neighbour(k) else { continue };
            let (here, there) = (depth(grid.positions[k]), depth(grid.positions[other]));
            let range = eye.map_or(0.0, |eye| grid.positions[k].distance(eye));
            let level = seen.entry((range.max(f64::MIN_POSITIVE).log2() * LEVELS).floor() as i64).or_default();
            level.range += range;
            if (there - here).abs() <= ROUNDING * here.abs() {
                level.equal += 1;
            } else {
                let by_ray = if eye.is_some() { range / here } else { 1.0 };
                level.different.push(((there - here) * by_ray).abs());
            }
            (least, most) = (least.min(here), most.max(here));
        }
        let known: Vec<Seen> = seen.into_values().filter(|level| level.different.len() >= DIFFERENT).collect();
        let count = known.len();
        let mut levels: Vec<[f64; 2]> = Vec::new();
        for mut level in known {
            let pairs = level.equal + level.different.len();
            if level.equal as f64 >= EQUAL * pairs as f64 {
                // Not the least: a few pairs may be off.
                let tenth = level.different.len() / 10;
                let step = *level.different.select_nth_unstable_by(tenth, f64::total_cmp).1;
                if LEAST * step <= most - least {
                    levels.push([level.range / pairs as f64, step]);
                }
            }
        }
        (!levels.is_empty() && 2 * levels.len() >= count).then_some(levels)
    }
}
