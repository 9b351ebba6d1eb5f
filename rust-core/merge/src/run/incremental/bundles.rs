//! Stage 3 where scans have changed: what their crossings come to, bundle by bundle, and how far they lie from each other.

use std::collections::BTreeSet;
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::scans::Scans;
use crate::crossings::bundles::{Found, RawBundle};
use crate::crossings::crossing::BundleKey;
use crate::crossings::lattice::Lattice;
use crate::crossings::lines;
use crate::crossings::lines::SortedBundle;
use crate::crossings::scan_order::ScanOrder;
use crate::field;
use crate::field::fuse::Reaches;
use crate::intake::overlap::{BundleDistances, OverlapDistances};
use crate::intake::setup::Setup;
use crate::params::MergeParams;
use crate::report::MergeReport;
use crate::stages::FUSING;
use base::error::Result;
use base::progress::Progress;

/// Sums of all scans.
#[derive(Default)]
pub struct KeptBundles {
    /// The grid they are counted in.
    lattice: Option<Lattice>,
    /// The scans that they are of.
    members: FxHashSet<Member>,
    /// Whether distances are measured on a sample.
    are_sampled: bool,
    /// By key.
    pub(super) all: FxHashMap<BundleKey, KeptBundle>,
}

/// A scan: its version, its number, and whether distances from it are measured.
type Member = (u64, u32, bool);

/// The kept parts of a bundle.
pub(super) struct KeptBundle {
    /// Sums of its crossings.
    pub all: Arc<SortedBundle>,
    distances: BundleDistances,
    /// Whether that is new to those who look at it.
    pub is_new: bool,
    /// The votes of those scans that see any of it, by version. Two bits per edge.
    pub votes: FxHashMap<u64, Box<[u8]>>,
    /// The rest of it where scans see through.
    pub shown: Arc<SortedBundle>,
    /// Amount that is gone.
    pub dropped: u64,
}

impl KeptBundles {
    /// Brings all bundles up to date that scans have crossings in which have changed since, or their numbers.
    ///
    /// # Errors
    /// Cancelled: nothing has changed then.
    pub fn renew(
        &mut self,
        scans: &Scans,
        scan_order: &ScanOrder<'_>,
        lattice: &Lattice,
        setup: &Setup,
        report: &mut MergeReport,
        progress: &Progress<'_>,
    ) -> Result<()> {
        let are_sampled = report.intersections > setup.kept;
        let is_known = |member: &Member| scans.get(member.0).is_some();
        if self.lattice != Some(*lattice) || !self.members.iter().all(is_known) || self.are_sampled != are_sampled {
            // Others may still show what was there.
            self.all.values_mut().for_each(KeptBundle::clear);
            self.members.clear();
            self.lattice = Some(*lattice);
        }
        let member = |place: usize| {
            (scan_order.versions[place], scan_order.numbers()[place], !are_sampled || scan_order.is_sampled(place))
        };
        let members = (0..scan_order.len()).map(member).collect();
        let keys = self.changed(scans, &members);
        progress.stage(FUSING, keys.len() as u64);
        let renewed = keys.into_par_iter().map(|key| {
            progress.advance(1)?;
            let numbers = scan_order.numbers().iter().zip(&scan_order.versions);
            let chunks =
                numbers.filter_map(|(&number, &version)| scans.get(version)?.crossings.of(&key, number)).collect();
            let raw = RawBundle { key, found: Found { chunks, ..Found::default() } };
            let distances = BundleDistances::measure(&raw, scan_order, are_sampled);
            Ok((key, distances, Arc::new(lines::sort(key, Vec::new(), raw.found.chunks))))
        });
        for (key, distances, sorted) in renewed.collect::<Result<Vec<_>>>()? {
            self.all.entry(key).or_insert_with(|| KeptBundle::none(key)).set(sorted, distances);
        }
        (self.members, self.are_sampled) = (members, are_sampled);
        report.working_bytes = report.intersections * size_of::<crate::crossings::crossing::Crossing>() as u64;
        Ok(())
    }

    /// The bundles in which scans have crossings that have changed, or what they count for.
    fn changed(&self, scans: &Scans, members: &FxHashSet<Member>) -> BTreeSet<BundleKey> {
        let of_scan = |member: &Member| scans.get(member.0).map(|scan| scan.crossings.keys());
        self.members.symmetric_difference(members).filter_map(of_scan).flatten().collect()
    }

    /// Distances within which findings on the scans are heard.
    pub fn reaches(&self, params: &MergeParams, report: &mut MergeReport) -> Reaches {
        let mut distances = OverlapDistances::none();
        self.all.iter().for_each(|(key, bundle)| distances.add(key.axis, &bundle.distances));
        Reaches::of(&distances, params, report)
    }

    /// The rest of all bundles.
    pub fn shown(&self, report: &mut MergeReport) -> field::Bundles {
        let mut list: Vec<_> =
            self.all.values().map(|bundle| &bundle.shown).filter(|of| !of.list.is_empty()).cloned().collect();
        list.sort_unstable_by_key(|bundle| bundle.key);
        let bundles = field::Bundles::new(list);
        report.seen_through = self.all.values().map(|bundle| bundle.dropped).sum();
        report.count_sums(&bundles);
        bundles
    }
}

impl KeptBundle {
    fn none(key: BundleKey) -> Self {
        let empty = Arc::new(lines::sort_sums(key, Vec::new()));
        KeptBundle {
            all: empty.clone(),
            distances: BundleDistances::default(),
            is_new: true,
            votes: FxHashMap::default(),
            shown: empty,
            dropped: 0,
        }
    }

    /// Whether it has no crossing: of those whose sums are none distances count.
    pub(super) fn is_empty(&self) -> bool {
        self.all.list.is_empty() && self.distances.is_none()
    }

    fn set(&mut self, all: Arc<SortedBundle>, distances: BundleDistances) {
        (self.all, self.distances, self.is_new) = (all, distances, true);
        self.votes.clear();
    }

    fn clear(&mut self) {
        self.set(Arc::new(lines::sort_sums(self.all.key, Vec::new())), BundleDistances::default());
    }
}
