//! Findings that a run leaves for the next.

use rustc_hash::{FxHashMap, FxHashSet};

use super::{bricks, bundles, scans, visibility};
use crate::crossings::scan_order;
use crate::crossings::scan_order::ScanOrder;
use crate::intake::defaults;
use base::error::Result;
use base::progress::Progress;
use image::source::ScanSource;
use image::triangulate::TriangulateParams;

/// Findings that a run leaves for the next.
#[derive(Default)]
pub struct Findings {
    pub triangulation: TriangulateParams,
    /// The hashes that break ties between scans of one name, by their versions.
    pub contents: FxHashMap<u64, u64>,
    pub known: defaults::Known,
    pub scans: scans::Scans,
    pub bundles: bundles::KeptBundles,
    pub visibility: visibility::VisibilityCache,
    pub bricks: bricks::Bricks,
}

impl Findings {
    /// The order of scans of so many versions.
    pub fn scan_order<'a>(
        &mut self,
        sources: &[&'a dyn ScanSource],
        versions: &[u64],
        progress: &Progress<'_>,
    ) -> Result<ScanOrder<'a>> {
        let found = std::sync::Mutex::new(std::mem::take(&mut self.contents));
        let known = || found.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let content = |place: usize| {
            let (scan, version) = (sources[place], versions[place]);
            let before = known().get(&version).copied();
            let content = before.map_or_else(|| scan.content(&self.triangulation, progress), Ok)?;
            known().insert(version, content);
            Ok(content)
        };
        let order = scan_order::in_order(sources, content, progress);
        self.contents = std::mem::take(&mut *known());
        Ok(ScanOrder::new(sources, versions, &order?))
    }

    /// Forgets the scans of other versions.
    pub fn forget_others(&mut self, versions: &[u64]) {
        let versions: FxHashSet<u64> = versions.iter().copied().collect();
        self.contents.retain(|version, _| versions.contains(version));
        self.known.keep(&versions);
        self.scans.keep(&versions);
    }
}
