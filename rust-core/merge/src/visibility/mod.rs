//! Things that scans see through are not there: flying pixels, veils at jumps, things that moved. \[MAW07\] votes so on depths. Here on the
//! intersections.
//!
//! Every scan whose lines of sight are known votes on every edge: it has a surface there, or it sees through. A surface is dropped if more
//! scans see through it than measured it, before anything is made of it. Two at least have to see through it, since a rod thinner than a
//! pixel is missed now and then.

pub mod eyes;

use std::sync::Arc;
use std::sync::atomic::{AtomicU16, Ordering::Relaxed};

use glam::DVec3;
use rayon::prelude::*;

use crate::crossings::crossing::OnLine;
use crate::crossings::edge_sums::EdgeSums;
use crate::crossings::lattice::{ACROSS, BRICK, BRICK_BITS, Lattice};
use crate::crossings::lines::{SortedBundle, sort_sums};
use crate::crossings::scan_order::ScanOrder;
use crate::field::Bundles;
use base::error::Result;
use base::progress::Progress;
use eyes::{lines_of_sight, looking};
use image::range_image::noise::Noise;
use image::source::Measured;
use image::visibility::{LinesOfSight, Seen};

/// Fewest scans that see through a surface that goes: it stays if fewer do.
const LEAST_THROUGH: u16 = 2;

/// The votes on an edge.
#[derive(Default)]
pub struct Votes {
    surface: AtomicU16,
    through: AtomicU16,
}

impl Votes {
    fn is_through(&self) -> bool {
        is_through(self.through.load(Relaxed), self.surface.load(Relaxed))
    }
}

/// Sights of the scans at the sums of each bundle. Nothing if none votes. `images` are the measures of those that are range images, by
/// number. Surfaces may be off by `tolerance`, in world units.
///
/// # Errors
/// A scan can't be loaded any more. Cancelled.
pub fn ask(
    bundles: &Bundles,
    scan_order: &ScanOrder<'_>,
    images: &[(u32, Measured)],
    lattice: &Lattice,
    tolerance: f64,
    progress: &Progress<'_>,
) -> Result<Vec<Vec<Votes>>> {
    let voters = voters(images);
    if voters.is_empty() {
        return Ok(Vec::new());
    }
    let votes: Vec<Vec<Votes>> =
        bundles.list.iter().map(|bundle| bundle.list.iter().map(|_| Votes::default()).collect()).collect();
    voters.par_iter().with_max_len(1).try_for_each(|&(scan, noise)| {
        progress.advance(1)?;
        let Some(sight) = lines_of_sight(scan_order, scan, noise, progress)? else { return Ok(()) };
        (bundles.list.iter().zip(&votes)).try_for_each(|(bundle, votes)| {
            progress.check()?;
            look(&sight, bundle, lattice, tolerance, |edge, seen| {
                let of_kind = if seen == Seen::Through { &votes[edge].through } else { &votes[edge].surface };
                of_kind.fetch_add(1, Relaxed);
            });
            Ok(())
        })
    })?;
    Ok(votes)
}

/// Drops what the scans see through. Gives the rest and the number of sums dropped.
///
/// # Errors
/// Cancelled.
pub fn drop_seen_through(bundles: Bundles, votes: Vec<Vec<Votes>>, progress: &Progress<'_>) -> Result<(Bundles, u64)> {
    if votes.is_empty() {
        return Ok((bundles, 0));
    }
    let mut dropped = 0;
    let list = (bundles.list.into_iter().zip(votes))
        .map(|(bundle, votes)| {
            if !votes.iter().any(Votes::is_through) {
                return Ok(bundle);
            }
            progress.check()?;
            let left = without(Arc::unwrap_or_clone(bundle), votes.iter().map(Votes::is_through));
            dropped += left.1;
            Ok(Arc::new(left.0))
        })
        .filter(|bundle| bundle.as_ref().map_or(true, |bundle| !bundle.list.is_empty()))
        .collect::<Result<_>>()?;
    Ok((Bundles::new(list), dropped))
}

/// The numbers of the scans that vote, with their noise. None if they are too few.
pub fn voters(images: &[(u32, Measured)]) -> Vec<(u32, &Noise)> {
    let looking = looking(images);
    // One has it, others see through.
    if looking.len() > usize::from(LEAST_THROUGH) { looking } else { Vec::new() }
}

/// Whether an edge goes that so many scans see through, and so many have a surface at.
pub fn is_through(through: u16, surface: u16) -> bool {
    through >= LEAST_THROUGH && through > surface
}

/// A bundle without the sums that go, and how many these were.
pub fn without(mut bundle: SortedBundle, mut goes: impl Iterator<Item = bool>) -> (SortedBundle, u64) {
    let before = bundle.list.len();
    bundle.list.retain(|_| !goes.next().is_some_and(|goes| goes));
    let dropped = (before - bundle.list.len()) as u64;
    bundle.list.sort_unstable_by_key(EdgeSums::key);
    (sort_sums(bundle.key, bundle.list), dropped)
}

/// Calls `each` with the place in the list of each edge of a bundle that a scan votes on, and what it sees there.
pub fn look(
    sight: &LinesOfSight,
    bundle: &SortedBundle,
    lattice: &Lattice,
    tolerance: f64,
    mut each: impl FnMut(usize, Seen),
) {
    let axis = bundle.key.axis as usize;
    let [u, v] = ACROSS[axis];
    let mut first_node = [0; 3];
    [first_node[u], first_node[v]] = bundle.key.across.map(|brick| brick << BRICK_BITS);
    let half = 0.5 * lattice.voxel * f64::from(BRICK);
    for (i, &(along, first)) in bundle.bricks.iter().enumerate() {
        first_node[axis] = along << BRICK_BITS;
        let centre = lattice.world(first_node, axis, 0.0) + DVec3::splat(half);
        if !sight.may_see(centre, 3.0_f64.sqrt() * half + tolerance) {
            continue;
        }
        let (from, to) = (first as usize, bundle.bricks.get(i + 1).map_or(bundle.list.len(), |next| next.1 as usize));
        for (place, edge) in (from..to).zip(&bundle.list[from..to]) {
            let line = edge.line() as i32;
            let mut node = first_node;
            node[u] += line & (BRICK - 1);
            node[v] += line >> BRICK_BITS;
            node[axis] = edge.cell;
            let at = lattice.world(node, axis, edge.fraction());
            match sight.see(at, edge.deviation() * lattice.voxel, tolerance) {
                Seen::Nothing => {}
                seen => each(place, seen),
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
