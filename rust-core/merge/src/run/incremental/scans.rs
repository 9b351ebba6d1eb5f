//! Stage 1 of scans that are new: the crossings of each are kept by themselves.

use std::collections::BTreeSet;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::crossings::bundles::ScanCrossings;
use crate::crossings::lattice::Lattice;
use crate::crossings::scan_order::ScanOrder;
use crate::intake::budget::{Budget, Foreseen};
use crate::intake::nothing_to_merge;
use crate::intake::setup::Setup;
use crate::intake::{Discretized, Group, Intake, in_cells_that_fit};
use crate::params::MergeParams;
use crate::report::MergeReport;
use crate::stages::DISCRETIZING;
use base::error::Result;
use base::progress::Progress;
use glam::DVec3;
use image::source::Measured;

/// Scans by their versions.
#[derive(Default)]
pub struct Scans {
    /// Size of the cells they were loaded for.
    voxel: f64,
    all: FxHashMap<u64, Scan>,
}

/// State of a scan.
pub struct Scan {
    /// Its crossings.
    pub crossings: ScanCrossings,
    /// Place of its first triangle, in the world. `None` if it has none.
    near: Option<DVec3>,
    /// Estimate for it.
    foreseen: Option<Arc<Foreseen>>,
    /// Measures of it, if it is a range image.
    measured: Option<Measured>,
    /// Other findings.
    found: Option<Discretized>,
}

impl Scans {
    /// State of scans: the new ones are loaded.
    ///
    /// # Errors
    /// The error of the first scan that can't be loaded, or counted in cells. No scan has a triangle. Cancelled.
    pub fn take(
        &mut self,
        scan_order: &ScanOrder<'_>,
        params: &MergeParams,
        setup: &Setup,
        report: &mut MergeReport,
        progress: &Progress<'_>,
    ) -> Result<Discretized> {
        let list = List { scan_order, params, setup };
        let found =
            in_cells_that_fit(scan_order.len(), params, setup, report, |budget| self.take_in(&list, budget, progress))?;
        found.tell(report);
        report.intersections = scan_order.versions.iter().map(|version| self.all[version].crossings.len()).sum();
        Ok(found)
    }

    fn take_in(&mut self, list: &List<'_>, budget: &mut Budget, progress: &Progress<'_>) -> Result<Discretized> {
        if self.voxel != budget.voxel {
            *self = Scans { voxel: budget.voxel, all: FxHashMap::default() };
        }
        let versions = &list.scan_order.versions;
        loop {
            let held = self.all.values().map(|scan| scan.crossings.len()).sum();
            budget.begin_keeping(held, list.params.voxel.is_none());
            let first = self.first(list)?;
            let is_new = |version: &u64| match self.all.get(version) {
                None => true,
                Some(Scan { found: Some(found), .. }) => first.is_some_and(|(_, lattice)| found.lattice != lattice),
                Some(_) => false,
            };
            let todo: BTreeSet<usize> = (0..versions.len()).filter(|&scan| is_new(&versions[scan])).collect();
            let known = versions.iter().enumerate().filter(|(scan, _)| !todo.contains(scan));
            known.for_each(|(scan, version)| budget.know(scan, self.all[version].foreseen.clone()));
            progress.stage(DISCRETIZING, todo.len() as u64);
            let intake = Intake::new(list.scan_order, list.params, list.setup, budget, progress).of_some(first);
            let (lattice, groups) = intake.take_all(todo.clone())?;
            todo.iter().for_each(|&scan| {
                self.all.insert(versions[scan], Scan::empty());
            });
            for group in groups {
                self.all.insert(versions[group.scans[0]], group.into());
            }
            let lattice = lattice.ok_or_else(|| nothing_to_merge(&list.params.triangulation))?;
            // If a new scan comes before the others, these may have been counted from another base.
            let mut all = Discretized::none(lattice);
            let mut is_one = true;
            for (&number, version) in list.scan_order.numbers().iter().zip(versions) {
                if let Some(found) = &self.all[version].found {
                    is_one &= found.lattice == lattice;
                    all.add(found);
                    all.images.extend(self.all[version].measured.iter().map(|measured| (number, measured.clone())));
                }
            }
            if is_one {
                all.images.sort_unstable_by_key(|image| image.0);
                return Ok(all);
            }
        }
    }

    /// The first scan that is known to have a triangle, and the grid that it would have others counted in.
    fn first(&self, list: &List<'_>) -> Result<Option<(usize, Lattice)>> {
        let near = |(scan, version): (usize, &u64)| Some((scan, self.all.get(version)?.near?));
        let Some((scan, near)) = list.scan_order.versions.iter().enumerate().find_map(near) else { return Ok(None) };
        Ok(Some((scan, Lattice::new(self.voxel, near, list.setup.corner)?)))
    }

    /// A scan, if it is known.
    pub fn get(&self, version: u64) -> Option<&Scan> {
        self.all.get(&version)
    }

    /// Forgets all scans but these.
    pub fn keep(&mut self, versions: &FxHashSet<u64>) {
        self.all.retain(|version, _| versions.contains(version));
    }
}

/// The scans to merge, and how.
struct List<'a> {
    scan_order: &'a ScanOrder<'a>,
    params: &'a MergeParams,
    setup: &'a Setup,
}

impl Scan {
    fn empty() -> Self {
        Scan { crossings: ScanCrossings::default(), near: None, foreseen: None, measured: None, found: None }
    }
}

impl From<Group> for Scan {
    fn from(Group { mut found, foreseen, near, .. }: Group) -> Self {
        let crossings: ScanCrossings = found.buckets.remove(0).into();
        let measured = found.images.pop().map(|image| image.1);
        Scan { crossings, near: Some(near), foreseen, measured, found: Some(found) }
    }
}
