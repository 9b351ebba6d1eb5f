//! The surface as patches that overlap, and what lies near it moved onto it.
//!
//! A place goes to the weighted mean of where the patches around it would put it, again from where it came to. A patch is fitted for
//! several samples at once, since it says next to the same as one fitted for its neighbour. That leaves a fraction of the time, and the
//! mean of patches has less of the noise than each.

use glam::DVec3;
use rayon::prelude::*;

use super::super::scales::{Scale, Scales};
use super::super::seen::Fronts;
use super::kept::{BLOCK, HIGH, Kept, Lengths, Patch, Room, SETTLED, STALE, level};
use base::error::Result;
use base::progress::Progress;
use geom::neighbours::KdTree;

/// Distance between patches, and that at which they say nothing, in the radius within which they were fitted.
const APART: f64 = 0.22;
const WITHIN: f64 = 0.5;

/// Samples that have a patch in common, at least: patches take several times the memory of a sample. In the smallest neighbourhoods each
/// has its own, or there would be none near some.
const LEAST_SHARED: usize = 2;

/// Patches that are asked where a place is to go, at most. There are sixteen on average.
const ASKED: usize = 48;

/// A patch of outliers: so many times fewer samples than usual are around it.
pub(super) const THIN: f64 = 0.15;

/// Times a place is moved at least and at most.
const ROUNDS: usize = 3;
const MOST_ROUNDS: usize = 6;

/// Distances moved, in deviations, from which a sample is an outlier.
pub(super) const FAR: f64 = 4.5;

/// The surface.
pub(super) struct Patches {
    patches: Vec<Patch>,
    /// Over their places.
    tree: KdTree,
    lengths: Lengths,
    /// Within which they were fitted.
    radius: f64,
}

impl Patches {
    /// Fits patches to samples.
    pub(super) fn fit(kept: &Kept, radius: f64, progress: &Progress<'_>) -> Result<Self> {
        let (apart, spacing) = (APART * kept.lengths.radius(radius, Scale::USUAL), kept.lengths.noise.spacing);
        let shared = if spacing > 0.0 { (apart / spacing).powi(2) as usize } else { 1 };
        let least = if kept.lengths.given.is_some() && radius <= kept.lengths.few { 1 } else { LEAST_SHARED };
        // Neighbours on the curve are neighbours in space.
        let seeds: Vec<usize> = (0..kept.samples.len()).step_by(shared.max(least)).collect();
        let mut found = vec![None; seeds.len()];
        found.par_iter_mut().zip(&seeds).with_min_len(16).try_for_each_init(
            Room::default,
            |room, (patch, &seed)| {
                *patch = kept.patch(seed, radius, room);
                progress.check()
            },
        )?;
        let mut patches: Vec<Patch> = found.into_iter().flatten().collect();
        let mut crowds: Vec<f64> = patches.iter().map(|patch| patch.crowd).collect();
        crowds.sort_unstable_by(f64::total_cmp);
        let usual = crowds.get(crowds.len() / 2).copied().unwrap_or(0.0);
        patches.retain(|patch| patch.crowd >= THIN * usual);
        let places: Vec<DVec3> = patches.iter().map(|patch| patch.place).collect();
        let tree = KdTree::try_new(&places, progress)?;
        Ok(Patches { patches, tree, lengths: kept.lengths, radius })
    }

    /// Moves all samples to their places. Those that belong to no surface become outliers. Advances `progress` by their number.
    pub(super) fn moved_all(
        &self,
        samples: &[DVec3],
        fronts: &Fronts,
        scales: &Scales,
        is_outlier: &mut [bool],
        progress: &Progress<'_>,
    ) -> Result<Vec<DVec3>> {
        let mut places = samples.to_vec();
        places.par_iter_mut().zip(is_outlier).enumerate().with_min_len(BLOCK).try_for_each_init(
            Room::default,
            |room, (i, (place, is_outlier))| {
                if i.is_multiple_of(BLOCK) {
                    progress.advance(BLOCK as u64)?;
                }
                if !*is_outlier {
                    match self.moved(*place, fronts.at(i), scales.at(i), room) {
                        Some(to) => *place = to,
                        None => *is_outlier = true,
                    }
                }
                Ok(())
            },
        )?;
        Ok(places)
    }

    /// The place that a sample comes to which was seen from the side of `front`. `None` if that is too far away, or nowhere.
    fn moved(&self, from: DVec3, front: DVec3, scale: Scale, room: &mut Room) -> Option<DVec3> {
        let (deviation, within) = (self.lengths.deviation(scale), WITHIN * self.lengths.radius(self.radius, scale));
        let high = HIGH * deviation;
        let (mut place, mut centre) = (from, None::<DVec3>);
        for round in 0..MOST_ROUNDS {
            if centre.is_none_or(|centre| place.distance(centre) > STALE * within) {
                self.tree.nearest_few(place, ASKED, within, &mut room.few);
                centre = Some(place);
            }
            // The first time the sample's own height is all that is known of its side.
            let high = if round == 0 { 2.0 * high } else { high };
            let (mut step, mut weights) = (DVec3::ZERO, 0.0);
            for (number, _) in room.few.iter() {
                let patch = &self.patches[number as usize];
                let far = 1.0 - patch.place.distance_squared(place) / (within * within);
                if !(far > 0.0) || patch.front.dot(front) < 0.0 {
                    continue;
                }
                let (above, normal) = patch.quadric.above(&patch.frame, place);
                let weight = far * far * level(above / high);
                step -= normal * (above * weight);
                weights += weight;
            }
            if !(weights > 0.0) {
                return None;
            }
            step /= weights;
            place += step;
            if round + 1 >= ROUNDS && step.length() <= SETTLED * high {
                return (from.distance(place) <= FAR * deviation).then_some(place);
            }
        }
        None
    }
}
