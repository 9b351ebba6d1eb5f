//! Crossings that scans see through, if sums of crossings are new or scans are.

use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::bundles::{KeptBundle, KeptBundles};
use crate::crossings::crossing::BundleKey;
use crate::crossings::lattice::{ACROSS, Lattice};
use crate::crossings::lines::SortedBundle;
use crate::crossings::scan_order::ScanOrder;
use crate::intake::Discretized;
use crate::stages::LOOKING;
use crate::visibility::eyes::{KnownSights, lines_of_sight, looking};
use crate::visibility::{is_through, look, voters, without};
use base::error::Result;
use base::progress::Progress;
use image::visibility::{LinesOfSight, Seen};

/// Scans that have looked.
#[derive(Default)]
pub struct VisibilityCache {
    /// Those that were asked about all bundles that are not new, by version. Of some nothing is to be known.
    asked: KnownSights,
    /// Lines of sight of all scans that have some.
    sights: KnownSights,
    /// Possible error of surfaces, in world units.
    tolerance: f64,
}

/// Votes on an edge: nothing, a surface, seen through.
const BITS: usize = 2;
const SURFACE: u8 = 1;
const THROUGH: u8 = 2;

/// Result for a bundle.
struct Looked {
    key: BundleKey,
    votes: FxHashMap<u64, Box<[u8]>>,
    shown: Arc<SortedBundle>,
    dropped: u64,
}

impl VisibilityCache {
    /// Asks all scans that have lines of sight about bundles that are new, and those that are new about all. The bricks in which
    /// anything that is left of the bundles has changed.
    ///
    /// # Errors
    /// A scan can't be loaded any more. Cancelled: nothing has changed then.
    pub fn look(
        &mut self,
        bundles: &mut KeptBundles,
        scan_order: &ScanOrder<'_>,
        found: &Discretized,
        tolerance: f64,
        progress: &Progress<'_>,
    ) -> Result<FxHashSet<[i32; 3]>> {
        let looking = looking(&found.images);
        progress.stage(LOOKING, looking.len() as u64);
        let sights = looking.par_iter().with_max_len(1).map(|&(scan, noise)| {
            progress.advance(1)?;
            let version = scan_order.version(scan);
            let sight = match self.sights.get(&version) {
                Some(known) => known.clone(),
                None => lines_of_sight(scan_order, scan, noise, progress)?.map(Arc::new),
            };
            Ok((version, sight))
        });
        let sights: KnownSights = sights.collect::<Result<_>>()?;
        let is_asked_anew = self.tolerance != tolerance;
        // Of too few none votes.
        let voters = if voters(&found.images).is_empty() { KnownSights::default() } else { sights.clone() };
        let looking = Looking { voters: &voters, asked: &self.asked, lattice: &found.lattice, tolerance };
        let look = |(key, bundle): (&BundleKey, &KeptBundle)| {
            progress.check()?;
            Ok(looking.at(*key, bundle, is_asked_anew))
        };
        let looked = bundles.all.par_iter().map(look).collect::<Result<Vec<_>>>()?;
        let mut changed = FxHashSet::default();
        for Looked { key, votes, shown, dropped } in looked.into_iter().flatten() {
            if let Some(bundle) = bundles.all.get_mut(&key) {
                note_changes(&bundle.shown, &shown, &mut changed);
                (bundle.votes, bundle.shown, bundle.dropped, bundle.is_new) = (votes, shown, dropped, false);
            }
        }
        bundles.all.retain(|_, bundle| !bundle.is_empty());
        *self = VisibilityCache { asked: voters, sights, tolerance };
        Ok(changed)
    }

    /// The lines of sight of all scans that have some, at most as many as vote.
    pub fn sights(&self) -> KnownSights {
        self.sights.clone()
    }
}

/// Scans that are asked, and the place in question.
struct Looking<'a> {
    voters: &'a KnownSights,
    asked: &'a KnownSights,
    lattice: &'a Lattice,
    tolerance: f64,
}

impl Looking<'_> {
    /// The result for a bundle, if there is any.
    fn at(&self, key: BundleKey, bundle: &KeptBundle, is_asked_anew: bool) -> Option<Looked> {
        let is_new = bundle.is_new || is_asked_anew;
        let is_known = |version: &u64| !is_new && self.asked.contains_key(version);
        let mut votes: FxHashMap<u64, Box<[u8]>> = FxHashMap::default();
        let mut is_changed = is_new;
        for (version, of_scan) in &bundle.votes {
            let stays = self.voters.contains_key(version) && is_known(version);
            is_changed |= !stays;
            if stays {
                votes.insert(*version, of_scan.clone());
            }
        }
        for (version, sight) in self.voters.iter().filter(|(version, _)| !is_known(version)) {
            if let Some(sight) = sight
                && let Some(of_scan) = self.votes(sight, &bundle.all)
            {
                is_changed = true;
                votes.insert(*version, of_scan);
            }
        }
        is_changed.then(|| {
            let (shown, dropped) = left(&bundle.all, &votes);
            Looked { key, votes, shown, dropped }
        })
    }

    /// A scan's votes on a bundle. Nothing if it sees nothing of it.
    fn votes(&self, sight: &LinesOfSight, bundle: &SortedBundle) -> Option<Box<[u8]>> {
        let mut votes: Vec<u8> = Vec::new();
        look(sight, bundle, self.lattice, self.tolerance, |edge, seen| {
            if votes.is_empty() {
                votes.resize((bundle.list.len() * BITS).div_ceil(8), 0);
            }
            let vote = if seen == Seen::Through { THROUGH } else { SURFACE };
            votes[edge * BITS / 8] |= vote << (edge * BITS % 8);
        });
        (!votes.is_empty()).then(|| votes.into())
    }
}

/// The rest of a bundle, and how much is gone.
fn left(bundle: &Arc<SortedBundle>, votes: &FxHashMap<u64, Box<[u8]>>) -> (Arc<SortedBundle>, u64) {
    let goes = |edge: usize| {
        let of = |kind: u8| move |votes: &&[u8]| votes[edge * BITS / 8] >> (edge * BITS % 8) & 3 == kind;
        let count = |kind: u8| votes.values().map(|votes| &**votes).filter(of(kind)).count() as u16;
        is_through(count(THROUGH), count(SURFACE))
    };
    let goes: Vec<bool> = if votes.is_empty() { Vec::new() } else { (0..bundle.list.len()).map(goes).collect() };
    if !goes.contains(&true) {
        return (bundle.clone(), 0);
    }
    let (shown, dropped) = without(SortedBundle::clone(bundle), goes.into_iter());
    (Arc::new(shown), dropped)
}

/// Adds the bricks in which two states of a bundle differ.
fn note_changes(before: &Arc<SortedBundle>, after: &Arc<SortedBundle>, changed: &mut FxHashSet<[i32; 3]>) {
    if Arc::ptr_eq(before, after) {
        return;
    }
    let axis = before.key.axis as usize;
    let [u, v] = ACROSS[axis];
    let mut brick = [0; 3];
    [brick[u], brick[v]] = before.key.across;
    for &(along, _) in before.bricks.iter().chain(&after.bricks) {
        if before.in_brick(along) != after.in_brick(along) {
            brick[axis] = along;
            changed.insert(brick);
        }
    }
}
