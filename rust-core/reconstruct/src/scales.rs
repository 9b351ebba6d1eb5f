//! Scales of a cloud whose samples carry noise: spacing and noise differ over it, so lengths are multiplied by a factor from place to
//! place.
//!
//! If both differ by little, nothing is multiplied by anything. Samples that are far from any surface say nothing. They are taken to be
//! sampled as the surface next to them is.

use glam::DVec3;
use rayon::prelude::*;

use super::noise::{self, INTERPOLATED, Look, Measured};
use super::seen::Fronts;
use base::error::Result;
use base::progress::Progress;
use geom::neighbours::{Few, KdTree};

/// Factors up to which the spacing is the usual, and from which on it is what is measured.
const SPACING: [f64; 2] = [1.5, 2.0];
/// The same of the noise in spacings, which is measured less well.
const NOISE: [f64; 2] = [2.0, 2.5];
/// No length is multiplied by more, nor divided.
const MOST: f64 = 32.0;

/// Share of the samples around which the spacing is not the usual, at least: of fewer, outliers near each other may be what is seen.
const SHARE: f64 = 0.005;

/// Samples a place is looked at for.
const EACH: usize = 16;

/// Neighbours that it is looked at with, in those that the noise of all is seen from: one place has to tell by itself.
const WIDER: usize = 2;

/// Places whose median counts, if most of them tell.
const PLACES: usize = 9;

/// Samples between two looks at the progress.
const BLOCK: usize = 64;

/// Factors of lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Those that go with the spacing.
    pub(super) spacing: f64,
    /// Those that go with the deviation of the noise.
    pub(super) deviation: f64,
}

impl Scale {
    pub(super) const USUAL: Scale = Scale { spacing: 1.0, deviation: 1.0 };
}

/// The scale of each sample. None if all are usual.
#[derive(Clone, Debug, Default)]
pub(super) struct Scales(Vec<Scale>);

impl Scales {
    /// The noise `measured` at seeds says whether there is anything to look for. `tree`: over the samples. Cost: if there is, that of a
    /// small fit for every few samples.
    pub(super) fn of(
        samples: &[DVec3],
        fronts: &Fronts,
        measured: &Measured,
        tree: &KdTree,
        progress: &Progress<'_>,
    ) -> Result<Self> {
        let Measured { noise: usual, looks, count, rounding, .. } = measured;
        if !(usual.spacing > 0.0) {
            return Ok(Scales::default());
        }
        // Noise so small that it is left alone is none.
        let noise = |spacings: f64| spacings.max(INTERPOLATED);
        let ratios = |look: Look| [look.spacing / usual.spacing, noise(look.spacings) / noise(usual.spacings())];
        let telling = || looks.iter().flatten().filter(|look| look.is_telling());
        let unusual = telling().filter(|look| factor(ratios(**look)[0], SPACING) != 1.0).count();
        if (unusual as f64) < SHARE * telling().count() as f64 {
            return Ok(Scales::default());
        }
        let places: Vec<usize> = (0..samples.len()).step_by(EACH).collect();
        let looks = noise::around(samples, &places, tree, WIDER * count, (fronts, rounding), progress)?;
        let at: Vec<DVec3> = places.iter().map(|&place| samples[place]).collect();
        let seen: Vec<Option<[f64; 2]>> =
            looks.into_iter().map(|look| look.filter(Look::is_telling).map(ratios)).collect();
        let tree = KdTree::try_new(&at, progress)?;
        let mut scales = vec![Scale::USUAL; samples.len()];
        scales.par_iter_mut().zip(samples).enumerate().with_min_len(BLOCK).try_for_each_init(
            || (Few::default(), Vec::new()),
            |(few, values), (i, (scale, sample))| {
                tree.nearest_few(*sample, PLACES, f64::INFINITY, few);
                let mut median = |which: usize| {
                    values.clear();
                    values.extend(few.iter().filter_map(|(place, _)| seen[place as usize]).map(|seen| seen[which]));
                    values.sort_unstable_by(f64::total_cmp);
                    // Most of what is around an outlier is no surface.
                    if 2 * values.len() > few.len() { values[values.len() / 2] } else { 1.0 }
                };
                let spacing = factor(median(0), SPACING);
                *scale = Scale { spacing, deviation: spacing * factor(median(1), NOISE) };
                if i.is_multiple_of(BLOCK) { progress.check() } else { Ok(()) }
            },
        )?;
        let unusual = scales.iter().filter(|scale| scale.spacing != 1.0).count();
        if (unusual as f64) < SHARE * samples.len() as f64 {
            return Ok(Scales::default());
        }
        Ok(Scales(scales))
    }

    pub(super) fn at(&self, sample: usize) -> Scale {
        self.0.get(sample).copied().unwrap_or(Scale::USUAL)
    }

    #[cfg(test)]
    pub(super) fn are_usual(&self) -> bool {
        self.0.is_empty()
    }

    /// Those of the samples that are kept.
    pub(super) fn kept(&self, is_kept: impl Fn(usize) -> bool) -> Scales {
        let all = self.0.iter().enumerate();
        Scales(all.filter(|(sample, _)| is_kept(*sample)).map(|(_, scale)| *scale).collect())
    }
}

/// Factor for a ratio to the usual: 1 up to the first limit, itself from the second on.
fn factor(ratio: f64, [usual, all]: [f64; 2]) -> f64 {
    let size = ratio.max(1.0 / ratio).min(MOST);
    if !(size > usual) {
        return 1.0;
    }
    let share = ((size - usual) / (all - usual)).min(1.0);
    let counted = 1.0 + (size - 1.0) * share;
    if ratio > 1.0 { counted } else { 1.0 / counted }
}
