//! Versions of scans, in numbers, if nobody has given them any.

use std::hash::BuildHasher as _;

use rayon::prelude::*;
use rustc_hash::{FxBuildHasher, FxHashMap};

use crate::params::MergeParams;
use base::error::Result;
use base::progress::Progress;
use image::source::ScanSource;

/// A number for each scan by its name and [`ScanSource::version`]. Of scans that share these the second is another than the first.
///
/// # Errors
/// Those of the scans. Cancelled.
pub fn versions(sources: &[&dyn ScanSource], params: &MergeParams, progress: &Progress<'_>) -> Result<Vec<u64>> {
    let of = |&scan| {
        progress.check()?;
        let scan: &dyn ScanSource = scan;
        Ok((scan.name(), scan.version(&params.triangulation, &progress.unseen())?))
    };
    let pool = base::threads::pool(params.threads)?;
    let known = progress.run(&pool, || sources.par_iter().with_max_len(1).map(of).collect::<Result<Vec<_>>>())?;
    let mut times: FxHashMap<(&str, u64), u64> = FxHashMap::default();
    let numbered = known.into_iter().map(|known| {
        let before = times.entry(known).or_default();
        *before += 1;
        FxBuildHasher.hash_one((known, *before))
    });
    Ok(numbered.collect())
}
