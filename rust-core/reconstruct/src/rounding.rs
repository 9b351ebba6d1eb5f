//! The steps to which coordinates were rounded, where they are coarse enough to hide noise.
//!
//! Noise of less than a step puts samples onto a few layers. Each of these is smooth, so that the half of the samples that fits a
//! surface best carries no noise. So samples are spread over what was rounded to the same place before noise is measured, and what that
//! adds is taken off again: exact lattices have none left.

use glam::DVec3;

use super::seeds::seeds;
use base::error::Result;
use base::progress::Progress;

/// Steps, in spacings, from which on they hide noise that is smoothed out ...
const FINEST: f64 = 0.2;
/// ... and up to which they may.
const COARSEST: f64 = 2.0;

/// Each so many-th seed is looked at, with so many samples after it on the curve.
const EACH: usize = 8;
const WINDOW: usize = 64;

/// Gaps between coordinates, in spacings, of which the lower quartile is a step if they have one.
const GAP: f64 = 0.75 * FINEST;
/// Share of a step by which gaps may differ from whole steps, and the share of the gaps that may differ by more.
const FUZZ: f64 = 0.1;
const ASTRAY: f64 = 0.02;
/// Steps that coordinates reach over, at least: two sides of a plate are no steps.
const LAYERS: f64 = 3.0;

/// The bits of a number that are not its sign or its power of two.
const FRACTION: u64 = (1 << 52) - 1;

/// Spacings of noise up to which a surface goes through all points.
pub(super) const INTERPOLATED: f64 = 0.2;

/// Hidden noise is so many times the seen one, at least. By chance both differ by less.
const HIDDEN: f64 = 1.2;

/// Amount that rounding to a step of 1 adds to the square of a deviation.
const VARIANCE: f64 = 1.0 / 12.0;

/// The steps along the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rounding {
    /// 0 along those that were not rounded.
    steps: DVec3,
    /// Noise in spacings from which on it is told from what rounding alone leaves.
    least: f64,
}

impl Rounding {
    /// Of samples in the order of the curve with the spacing as measured. `None` if rounding hides nothing. Cost: that of sorting a few
    /// thousand numbers.
    pub(super) fn of(samples: &[DVec3], spacing: f64, progress: &Progress<'_>) -> Result<Option<Rounding>> {
        if !(spacing > 0.0) {
            return Ok(None);
        }
        progress.check()?;
        let steps = [0, 1, 2].map(|axis| step(samples, axis, spacing).unwrap_or(0.0));
        // From there on rounding alone is as much as noise that is smoothed out.
        let lattice = INTERPOLATED / VARIANCE.sqrt() * spacing;
        let fine = steps.map(|step| if step >= FINEST * spacing && step < lattice { step } else { 0.0 });
        if fine != [0.0; 3] {
            return Ok(Some(Rounding { steps: DVec3::from(fine), least: INTERPOLATED }));
        }
        let coarsest = steps.into_iter().fold(0.0, f64::max);
        let is_lattice = steps.iter().all(|&step| step >= lattice) && coarsest <= COARSEST * spacing;
        let least = (INTERPOLATED.powi(2) + VARIANCE * (coarsest / spacing).powi(2)).sqrt();
        Ok(is_lattice.then(|| Rounding { steps: DVec3::from(steps), least }))
    }

    /// A place among those that were rounded to a sample, the same one each time.
    pub(super) fn spread(&self, sample: DVec3) -> DVec3 {
        if self.steps == DVec3::ZERO {
            return sample;
        }
        // The same at any power of two that coordinates are multiplied by.
        let place = |axis: usize| match self.steps[axis] {
            0.0 => sample[axis].to_bits() & FRACTION,
            step => (sample[axis] / step).round() as i64 as u64,
        };
        let mut state = (0..3).fold(0, |state, axis| mix(state ^ place(axis)));
        let by = [0, 1, 2].map(|axis| {
            state = mix(state);
            // Four numbers of 16 bits: their sum is nearly normal, with a variance of a third.
            let sum = (0..4).map(|k| (state >> (16 * k) & 0xFFFF) as f64).sum::<f64>() / f64::from(1 << 16);
            self.steps[axis] * (sum - 2.0) * (3.0 * VARIANCE).sqrt()
        });
        sample + DVec3::from(by)
    }

    /// Amount that [`Rounding::spread`] adds to the square of the deviation along a direction.
    pub(super) fn variance(&self, along: DVec3) -> f64 {
        VARIANCE * (along * self.steps).length_squared()
    }

    /// Whether the noise of samples spread, in spacings and in their unit, is there, and hidden from who measures its deviation without.
    pub(super) fn hides(&self, [spacings, deviation]: [f64; 2], without: f64) -> bool {
        spacings > self.least && deviation > HIDDEN * without
    }
}

/// The step of the coordinates along an axis, if they have one that is not much finer than the spacing.
fn step(samples: &[DVec3], axis: usize, spacing: f64) -> Option<f64> {
    let mut gaps = Vec::new();
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for seed in seeds(samples.len()).step_by(EACH) {
        let mut values: Vec<f64> = samples[seed..].iter().take(WINDOW).map(|sample| sample[axis]).collect();
        values.sort_unstable_by(f64::total_cmp);
        (low, high) = (low.min(values[0]), high.max(values[values.len() - 1]));
        gaps.extend(values.windows(2).map(|pair| pair[1] - pair[0]));
    }
    gaps.sort_unstable_by(f64::total_cmp);
    let steps = &gaps[gaps.partition_point(|&gap| gap < GAP * spacing)..];
    let step = *steps.get(steps.len() / 4)?;
    let is_astray = |&&gap: &&f64| (gap / step - (gap / step).round()).abs() > FUZZ;
    let astray = gaps.iter().filter(is_astray).count();
    // Most gaps are none, and say as little as those of no step at all.
    (astray as f64 <= ASTRAY * steps.len() as f64 && high - low >= (LAYERS - FUZZ) * step).then_some(step)
}

/// Bits that depend on all those given.
fn mix(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}
