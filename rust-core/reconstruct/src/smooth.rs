//! Samples moved to the surface that those around them tell, where they carry noise. Those far from any are outliers.
//!
//! Some of the samples go across the plane of their neighbourhood to the height field of second order fitted there, again from where they
//! came to (moving least squares \[Lev04\]). It is of second order, so that the surface does not shrink where it bends. All fits read the
//! measured places, so that no sample waits for another. The weight in a fit falls off with the distance along the surface and, so that the
//! other side of a thin wall says nothing, with the height. All samples then go to where these fields (`patches`) lie between them. If it
//! is known from which side samples were seen, those that were seen from different sides don't count for each other. So the sides of a wall
//! are told apart that is thinner than its noise.

mod kept;
mod patches;
mod strays;

use glam::DVec3;
use rayon::prelude::*;

use super::isolated;
use super::noise::{self, INTERPOLATED, Noise};
use super::params::{NoisyPoints, ReconstructParams};
use super::prepare::{Samples, keep, prepare};
use super::report::{Dropped, Reason};
use super::scales::Scales;
use super::seen::{Fronts, Seen, Sighted};
use base::error::{Error, Result};
use base::progress::Progress;
use geom::neighbours::{Few, KdTree};
use kept::{BLOCK, FEW, Kept, Lengths};
use patches::Patches;

/// The smoothing that is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Smooth {
    noisy_points: NoisyPoints,
    /// In the unit of the points. `None` as noise asks.
    radius: Option<f64>,
}

impl Smooth {
    pub(super) fn of(params: &ReconstructParams) -> Self {
        let ReconstructParams { noisy_points, smooth, .. } = *params;
        Smooth { noisy_points, radius: smooth.filter(|_| noisy_points != NoisyPoints::AsClean) }
    }
}

/// Measures of samples, and the smoothing of them. Lengths in their unit.
#[derive(Clone, Debug, Default)]
pub(super) struct Smoothing {
    pub(super) noise: Noise,
    /// 0 if they are where they were.
    pub(super) radius: f64,
    /// Distance that each came. Empty if they are where they were, or go back there.
    pub(super) moved: Vec<f64>,
    /// Measured place of each, if it is to go back there once the surface is found \[DMSL11\].
    pub(super) measured: Vec<DVec3>,
}

/// An outlier's neighbours are so many times as far as its neighbours' own.
const LONELY: f64 = 2.5;

/// ... and as usual: about a tenth as many samples are around it.
const ALONE: f64 = 3.0;

/// The diagonal of the box around points.
fn extent(points: &[DVec3]) -> f64 {
    let grow = |(low, high): (DVec3, DVec3), &point: &DVec3| (low.min(point), high.max(point));
    let (low, high) = points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), grow);
    if points.is_empty() { 0.0 } else { low.distance(high) }
}

/// The samples with which a surface is made.
pub(super) fn smoothed(
    mut samples: Samples,
    seen: Seen<'_>,
    smooth: Smooth,
    progress: &Progress<'_>,
) -> Result<(Samples, Smoothing)> {
    let fronts = Fronts::of(Sighted { samples: &samples, seen }, progress)?;
    let mut measured = noise::measure(&samples.points, &fronts, progress)?;
    let noise = measured.noise;
    // Farther than the points reach there is nothing that tells.
    let radius = smooth.radius.map(|radius| (radius * samples.factor).min(extent(&samples.points)));
    let mut tree = measured.tree.take();
    let is_clean = radius.is_none() && noise.spacings() <= INTERPOLATED;
    let is_left = smooth.noisy_points == NoisyPoints::AsClean
        || samples.points.len() < 4
        || is_clean && !isolated::are_around(&samples.points, noise.spacing, &mut tree, progress)?;
    if is_left {
        return Ok((samples, Smoothing { noise, ..Smoothing::default() }));
    }
    let tree = match tree {
        Some(tree) => tree,
        None => KdTree::try_new(&samples.points, progress)?,
    };
    let scales = Scales::of(&samples.points, &fronts, &measured, &tree, progress)?;
    let (mut is_outlier, few) = lonely(&samples.points, &scales, &tree, progress)?;
    drop(tree);
    // Of clean points the smallest neighbourhoods say which lie off the surface.
    let given = if is_clean { Some(few) } else { radius };
    let lengths = Lengths { noise, few, given };
    let mut kept = Kept::new(&samples.points, &fronts, &scales, &is_outlier, lengths, progress)?;
    let radius = match given {
        Some(radius) => radius.max(few),
        None => kept.best_radius(progress)?,
    };
    if is_clean {
        let mut strays = kept.strays(radius, progress)?.into_iter();
        is_outlier.iter_mut().filter(|is| !**is).for_each(|is| *is = strays.next().expect("one for each that is kept"));
        samples.leave_out(&is_outlier, Reason::Outlier);
        return Ok((samples, Smoothing { noise, ..Smoothing::default() }));
    }
    let patches = Patches::fit(&kept, radius, progress)?;
    drop(kept);
    let mut places = patches.moved_all(&samples.points, &fronts, &scales, &mut is_outlier, progress)?;
    drop((patches, scales));
    let given = samples.factor;
    if is_outlier.iter().filter(|is| !**is).count() < 3 {
        return Err(nothing_left(radius / given, places.len()));
    }
    samples.leave_out(&is_outlier, Reason::Outlier);
    keep(&mut places, &is_outlier);
    let sorted = prepare(&places, progress)?;
    drop(places);
    let input = |i: u32| samples.input[i as usize];
    samples.dropped.extend(sorted.dropped.iter().map(|d| Dropped { point: input(d.point), reason: d.reason }));
    let measured: Vec<DVec3> = sorted.input.iter().map(|&i| samples.points[i as usize] * sorted.factor).collect();
    let input = sorted.input.iter().map(|&i| input(i)).collect();
    let points = Samples { points: sorted.points, factor: given * sorted.factor, input, dropped: samples.dropped };
    let (deviation, spacing) = (noise.deviation * sorted.factor, noise.spacing * sorted.factor);
    let noise = Noise { deviation, spacing };
    let smoothing = if smooth.noisy_points == NoisyPoints::PutBack {
        Smoothing { noise, measured, ..Smoothing::default() }
    } else {
        let moved = points.points.iter().zip(&measured).map(|(place, from)| place.distance(*from)).collect();
        Smoothing { noise, radius: radius * sorted.factor, moved, measured: Vec::new() }
    };
    Ok((points, smoothing))
}

fn nothing_left(radius: f64, count: usize) -> Error {
    Error::input(format!(
        "smoothing within {radius} leaves none of {count} points, which tell no surface there: give a larger smoothing, or take the points as clean"
    ))
}

/// Of each sample, whether it is much further from its neighbours than they are from theirs. Also how far these usually are.
fn lonely(samples: &[DVec3], scales: &Scales, tree: &KdTree, progress: &Progress<'_>) -> Result<(Vec<bool>, f64)> {
    let mut reaches = vec![0.0; samples.len()];
    let with_itself = FEW + 1;
    reaches.par_iter_mut().zip(samples).with_min_len(BLOCK).enumerate().try_for_each_init(
        Few::default,
        |few, (i, (reach, sample))| {
            tree.nearest_few(*sample, with_itself, f64::INFINITY, few);
            *reach = few.furthest().unwrap_or(0.0).sqrt() / scales.at(i).spacing;
            if i.is_multiple_of(BLOCK) { progress.advance(BLOCK as u64) } else { Ok(()) }
        },
    )?;
    let mut sorted = reaches.clone();
    let usual = *sorted.select_nth_unstable_by(samples.len() / 2, f64::total_cmp).1;
    // No neighbours are nearer to theirs, so that most samples need not be looked at again.
    let nearest = reaches.iter().copied().fold(f64::INFINITY, f64::min);
    let mut is_lonely = vec![false; samples.len()];
    is_lonely.par_iter_mut().enumerate().with_min_len(BLOCK).try_for_each_init(
        || (Few::default(), Vec::new()),
        |(few, around), (i, is_lonely)| {
            if i.is_multiple_of(BLOCK) {
                progress.check()?;
            }
            if reaches[i] <= (LONELY * nearest).min(ALONE * usual) {
                return Ok(());
            }
            tree.nearest_few(samples[i], with_itself, f64::INFINITY, few);
            around.clear();
            around.extend(few.iter().map(|(neighbour, _)| reaches[neighbour as usize]));
            around.sort_unstable_by(f64::total_cmp);
            *is_lonely = reaches[i] > LONELY * around[around.len() / 4] || reaches[i] > ALONE * usual;
            Ok(())
        },
    )?;
    Ok((is_lonely, usual))
}

#[cfg(test)]
mod tests;
