//! The beginning and the end that all ways to run the steps have in common: scans that can be merged, the pool, the surface.

use rustc_hash::FxHashSet;

use crate::crossings::crossing::MAX_SCANS;
use crate::driver::{self, Graph, Out};
use crate::finish::close_holes::Room;
use crate::finish::close_openings;
use crate::intake::setup::{Fit, Setup};
use crate::params::MergeParams;
use crate::report::Merged;
use crate::stages::{CLOSED_PLAN, PLAN};
use base::error::{Error, Result};
use base::progress::Progress;
use base::threads;
use image::source::{ScanSource, common_crs};
use mesh::TriMesh;

/// Gives what `run` gives that keeps to cells as they are. `None` if these do not fit into memory, and the surface alone may.
///
/// # Errors
/// Those of `run`.
pub fn if_it_fits(memory: Option<u64>, run: impl FnOnce(&Setup) -> Result<Merged>) -> Result<Option<Merged>> {
    let setup = Setup { fit: Fit { keeps_to_cells: true, ..Fit::within(memory) }, ..Setup::default() };
    match run(&setup) {
        Err(Error::OutOfMemory(_)) if setup.fit.leaves_hope() => Ok(None),
        other => other.map(Some),
    }
}

/// Does the work of merging scans, if they can be merged.
///
/// # Errors
/// They can't. Also those of `work`.
pub fn started<T: Send>(
    scans: &[&dyn ScanSource],
    params: &MergeParams,
    progress: &Progress<'_>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    params.validate()?;
    params.go_together()?;
    if scans.is_empty() {
        return Err(Error::input("no scan to merge: give at least one"));
    }
    if scans.len() > MAX_SCANS {
        return Err(Error::input(format!("{} scans are more than the {MAX_SCANS} that fit", scans.len())));
    }
    common_crs(scans)?;
    progress.plan(if close_openings::is_asked(params) { CLOSED_PLAN } else { PLAN });
    let pool = threads::pool(params.threads)?;
    let merged = progress.run(&pool, work);
    // The caller asked for an end, whatever else went wrong meanwhile.
    if merged.is_err() {
        progress.check()?
    }
    merged
}

/// The surface of a graph, in memory.
///
/// # Errors
/// Those of the stages.
pub fn surface(graph: &mut impl Graph, params: &MergeParams, progress: &Progress<'_>) -> Result<Merged> {
    let mut mesh = TriMesh::default();
    let report = driver::merge(graph, params, Out { sink: &mut mesh, room: Room::ALL }, progress)?;
    Ok(Merged { mesh, report })
}

/// Refuses versions that are not one per scan.
///
/// # Errors
/// There are more or fewer, or two are the same.
pub fn refuse_twins(scans: usize, versions: &[u64]) -> Result<()> {
    if versions.len() != scans {
        return Err(Error::input(format!("{} versions for {scans} scans: give one per scan", versions.len())));
    }
    let mut seen = FxHashSet::default();
    match versions.iter().find(|&&version| !seen.insert(version)) {
        Some(twice) => Err(Error::input(format!("two scans have the version {twice}: give each its own"))),
        None => Ok(()),
    }
}
