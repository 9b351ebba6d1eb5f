//! A merge of scans that were merged before.

use std::sync::Arc;

use surfrecon::Progress;
use surfrecon::merge::again::{Merger, Versioned};
use surfrecon::merge::{self, MergeParams, Merged};
use surfrecon::threads::Exclusive;

use crate::sources::{Source, as_dyn};

/// The scans of a merger as they were, and what it keeps; free of Python.
pub struct Again {
    /// Scans with their numbers.
    pub scans: Vec<(u64, Arc<Source>)>,
    /// What is kept.
    pub kept: Arc<Exclusive<Merger>>,
}

impl Again {
    /// The scans.
    pub fn sources(&self) -> Vec<Arc<Source>> {
        self.scans.iter().map(|scan| scan.1.clone()).collect()
    }

    /// Merges.
    ///
    /// # Errors
    /// See [`merge::run`].
    pub fn run(&self, params: &MergeParams, progress: &Progress<'_>) -> surfrecon::Result<Merged> {
        // Where another thread merges, too, this merge neither takes nor leaves anything.
        let Ok(mut kept) = self.kept.take() else {
            return merge::run(&as_dyn(&self.sources()), params, progress);
        };
        let scans: Vec<Versioned<'_>> =
            self.scans.iter().map(|(version, source)| Versioned { scan: &**source, version: *version }).collect();
        kept.run(&scans, params, progress)
    }
}
