//! A merge of scans that were merged before.

use std::sync::Arc;

use surfrecon::Progress;
use surfrecon::merge::incremental::Merger;
use surfrecon::merge::{self, MergeParams, Merged, Reuse, Run, Store};
use surfrecon::threads::Exclusive;

use crate::sources::{Source, as_dyn};

/// The scans of a merger as they were, and what it keeps, free of Python.
pub struct Incremental {
    /// Scans with their numbers.
    pub scans: Vec<(u64, Arc<Source>)>,
    /// The kept state.
    pub kept: Arc<Exclusive<Merger>>,
}

impl Incremental {
    /// The scans.
    pub fn sources(&self) -> Vec<Arc<Source>> {
        self.scans.iter().map(|scan| scan.1.clone()).collect()
    }

    /// Merges, with at most so many bytes.
    ///
    /// # Errors
    /// See [`merge::merge`].
    pub fn run(
        &self,
        params: &MergeParams,
        (store, memory): (Store, Option<u64>),
        progress: &Progress<'_>,
    ) -> surfrecon::Result<Merged> {
        let (sources, versions) = (self.sources(), self.scans.iter().map(|scan| scan.0).collect::<Vec<_>>());
        // If another thread merges, too, this merge neither takes nor leaves anything.
        let mut kept = self.kept.take().ok();
        let reuse = kept.as_mut().map(|kept| Reuse { merger: kept, versions: &versions });
        merge::merge(&as_dyn(&sources), params, Run { store, memory, reuse }, progress)
    }
}
