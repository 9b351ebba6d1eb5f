//! A merge of scans that were merged before.

use std::sync::Arc;

use surfrecon::merge::incremental::{Merger, Versioned};
use surfrecon::merge::{self, MergeParams, Merged};
use surfrecon::threads::Exclusive;
use surfrecon::{InFiles, Progress};

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
        match self.kept.take() {
            Ok(mut kept) => kept.run(&self.versioned(), params, progress),
            Err(_) => merge::run(&as_dyn(&self.sources()), params, progress),
        }
    }

    /// Merges, in files where that is needed.
    ///
    /// # Errors
    /// See [`surfrecon::merge_in_files`].
    pub fn run_if_it_fits(
        &self,
        params: &MergeParams,
        files: &InFiles,
        progress: &Progress<'_>,
    ) -> surfrecon::Result<Merged> {
        match self.kept.take() {
            Ok(mut kept) => surfrecon::merge_again_in_files(&mut kept, &self.versioned(), params, files, progress),
            Err(_) => surfrecon::merge_in_files(&as_dyn(&self.sources()), params, files, progress),
        }
    }

    fn versioned(&self) -> Vec<Versioned<'_>> {
        self.scans.iter().map(|(version, source)| Versioned { scan: &**source, version: *version }).collect()
    }
}
