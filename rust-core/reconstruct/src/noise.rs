//! Noise that samples carry: how far they lie off the surface around them, beside how far they lie apart.
//!
//! Around some samples a height field is fitted to the half of the nearest ones that fits best, starting from those at the height of the
//! sample itself. Of the two sides of a wall thinner than its samples are apart, that is one. The rest across it is noise, unless it is as
//! large as the neighbourhood: then a larger one is taken.

use glam::DVec3;
use rayon::prelude::*;

use super::patch::{Frame, Quadric};
pub(super) use super::rounding::INTERPOLATED;
use super::rounding::Rounding;
use super::seeds::{FEWEST, WINDOW, seeds};
use super::seen::Fronts;
use base::error::Result;
use base::progress::Progress;
use geom::neighbours::{Few, KdTree};

/// Samples below which noise can't be told from shape, and none is taken to be there.
const LEAST: usize = 1024;

/// Neighbours a height field is fitted to at most. At first [`FEWEST`].
const MOST: usize = 512;

/// Largest noise that a neighbourhood tells, in its radii.
const WITHIN: f64 = 0.3;

/// Times that the half is chosen again.
const ROUNDS: usize = 3;

/// Deviation of normal noise over the root mean square of the half that is smallest, from so many samples that six unknowns
/// were fitted to. Measured.
fn consistency(half: usize) -> f64 {
    2.65 * (1.0 + CORRECTION / half as f64)
}
const CORRECTION: f64 = 6.0;

/// Measured noise, in the unit of the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Noise {
    /// Standard deviation across the surface.
    pub(super) deviation: f64,
    /// Side of a square of the surface that has one sample.
    pub(super) spacing: f64,
}

impl Noise {
    pub(super) fn spacings(&self) -> f64 {
        if self.spacing > 0.0 { self.deviation / self.spacing } else { 0.0 }
    }
}

/// The noise as measured, and how.
#[derive(Default)]
pub(super) struct Measured {
    pub(super) noise: Noise,
    /// Looks at the seeds.
    pub(super) looks: Vec<Option<Look>>,
    /// Neighbours that this was seen from.
    pub(super) count: usize,
    /// ... and by what they were spread for it.
    pub(super) rounding: Rounding,
    /// Over all samples, if there was need for it.
    pub(super) tree: Option<KdTree>,
}

/// The view around a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// Noise, in spacings.
    pub(super) spacings: f64,
    pub(super) spacing: f64,
    radius: f64,
}

impl Look {
    /// Whether what is around the sample looks like a surface with noise, not like a volume.
    pub(super) fn is_telling(&self) -> bool {
        self.spacings * self.spacing <= WITHIN * self.radius
    }
}

/// Measures it on samples in the order of the curve. If there is noise, on each side of them by itself. Cost: that of a few hundred small
/// fits. If there is noise, also a tree over all samples.
pub(super) fn measure(samples: &[DVec3], fronts: &Fronts, progress: &Progress<'_>) -> Result<Measured> {
    if samples.len() < LEAST {
        return Ok(Measured::default());
    }
    let seeds: Vec<usize> = seeds(samples.len()).collect();
    let none = Rounding::default();
    let looks = along(samples, &seeds, &none, progress)?;
    let noise = usual(&looks).0;
    let is_clean = noise.spacings() <= INTERPOLATED;
    let mut rounding = Rounding::of(samples, noise.spacing, progress)?;
    if is_clean && let Some(steps) = rounding {
        let spread = usual(&along(samples, &seeds, &steps, progress)?).0;
        rounding = rounding.filter(|steps| steps.hides([spread.spacings(), spread.deviation], noise.deviation));
    }
    if is_clean && rounding.is_none() {
        return Ok(Measured { noise, looks, count: FEWEST, rounding: none, tree: None });
    }
    let tree = KdTree::try_new(samples, progress)?;
    let seen = if is_clean {
        Measured { noise, looks, count: FEWEST, rounding: none, tree: None }
    } else {
        as_far_as_tells(samples, &seeds, &tree, fronts, none, progress)?
    };
    let spread = match rounding {
        Some(steps) => Some(as_far_as_tells(samples, &seeds, &tree, fronts, steps, progress)?),
        None => None,
    };
    let hidden = spread.filter(|spread| {
        spread.rounding.hides([spread.noise.spacings(), spread.noise.deviation], seen.noise.deviation)
    });
    Ok(Measured { tree: Some(tree), ..hidden.unwrap_or(seen) })
}

/// Views at the seeds among so many neighbours that noise is no larger than their neighbourhood.
fn as_far_as_tells(
    samples: &[DVec3],
    seeds: &[usize],
    tree: &KdTree,
    fronts: &Fronts,
    rounding: Rounding,
    progress: &Progress<'_>,
) -> Result<Measured> {
    let mut count = FEWEST;
    loop {
        let looks = around(samples, seeds, tree, count, (fronts, &rounding), progress)?;
        let (noise, radius) = usual(&looks);
        if noise.deviation <= WITHIN * radius || 2 * count > MOST {
            return Ok(Measured { noise, looks, count, rounding, tree: None });
        }
        count *= 2;
    }
}

/// Views around seeds among the nearest of the samples before and after them on the curve.
fn along(
    samples: &[DVec3],
    seeds: &[usize],
    rounding: &Rounding,
    progress: &Progress<'_>,
) -> Result<Vec<Option<Look>>> {
    over(seeds, progress, |seed, _, nearest| {
        let window = seed.saturating_sub(WINDOW)..(seed + WINDOW).min(samples.len());
        nearest.extend(window.map(|i| (samples[i].distance_squared(samples[seed]), samples[i])));
        let count = FEWEST.min(nearest.len());
        // By place where equally near: the order of the curve is the samples' own.
        nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
        nearest.truncate(count);
        look(samples[seed], nearest, rounding)
    })
}

/// Views around seeds among so many of the nearest samples.
pub(super) fn around(
    samples: &[DVec3],
    seeds: &[usize],
    tree: &KdTree,
    count: usize,
    (fronts, rounding): (&Fronts, &Rounding),
    progress: &Progress<'_>,
) -> Result<Vec<Option<Look>>> {
    over(seeds, progress, |seed, few: &mut Few, nearest| {
        tree.nearest_few(samples[seed], count, f64::INFINITY, few);
        // A sample that was seen from the other side is of another surface, however near.
        let near = few.iter().filter(|&(i, _)| !fronts.is_behind(i as usize, fronts.at(seed)));
        nearest.extend(near.map(|(i, squared)| (squared, samples[i as usize])));
        look(samples[seed], nearest, rounding)
    })
}

fn over(
    seeds: &[usize],
    progress: &Progress<'_>,
    look: impl Fn(usize, &mut Few, &mut Vec<(f64, DVec3)>) -> Option<Look> + Sync,
) -> Result<Vec<Option<Look>>> {
    seeds
        .par_iter()
        .with_min_len(16)
        .map_init(<(Few, Vec<(f64, DVec3)>)>::default, |(few, nearest), &seed| {
            progress.check()?;
            nearest.clear();
            Ok(look(seed, few, nearest))
        })
        .collect()
}

/// Medians of what is seen at the seeds: noise, and the radius it was seen within.
fn usual(looks: &[Option<Look>]) -> (Noise, f64) {
    let median = |which: fn(&Look) -> f64| {
        let mut values: Vec<f64> = looks.iter().flatten().map(which).collect();
        values.sort_unstable_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    };
    // Noise in spacings first: both may differ over the cloud.
    let spacing = median(|look| look.spacing);
    (Noise { deviation: median(|look| look.spacings) * spacing, spacing }, median(|look| look.radius))
}

fn look(seed: DVec3, nearest: &mut [(f64, DVec3)], rounding: &Rounding) -> Option<Look> {
    let seed = rounding.spread(seed);
    nearest.iter_mut().for_each(|(_, sample)| *sample = rounding.spread(*sample));
    let count = nearest.len();
    let half = count.div_ceil(2);
    if half <= 6 {
        return None;
    }
    let weighted: Vec<(DVec3, f64)> = nearest.iter().map(|&(_, sample)| (sample, 1.0)).collect();
    let frame = Frame::new(seed, &weighted)?;
    let radius = frame.radius();
    if !(radius > 0.0 && radius.is_finite()) {
        return None;
    }
    let spacing = radius * (std::f64::consts::PI / count as f64).sqrt();
    let local: Vec<[f64; 3]> = nearest.iter().map(|&(_, sample)| frame.to_local(sample)).collect();
    let mut offsets: Vec<(f64, usize)> = local.iter().enumerate().map(|(i, at)| (at[2].abs(), i)).collect();
    let mut square = 0.0;
    for _ in 0..ROUNDS {
        offsets.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let (quadric, _) = Quadric::fit(offsets[..half].iter().map(|&(_, i)| (local[i], 1.0)), radius)?;
        offsets.iter_mut().for_each(|(offset, i)| *offset = (local[*i][2] - quadric.height(local[*i])).abs());
        let mut sorted: Vec<f64> = offsets.iter().map(|&(offset, _)| offset).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        square = sorted[..half].iter().map(|offset| offset * offset).sum::<f64>() / half as f64;
    }
    let deviation = square.sqrt() * consistency(half);
    let added = rounding.variance(frame.across());
    // The same to the bit if nothing was added.
    let deviation = if added > 0.0 { (deviation * deviation - added).max(0.0).sqrt() } else { deviation };
    Some(Look { spacings: deviation / spacing, spacing, radius })
}
