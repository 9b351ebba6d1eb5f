//! Marching Intersections: registered scans -> one surface. \[MI04\]
//!
//! | folder or file | steps |
//! |---|---|
//! | `pipeline` | the list of the steps, for all ways to run them |
//! | `crossings/` | 1. the grid and the crossings of the scans with its lines; 2. details finer than a cell; 3. crossings in order, and added up by edge |
//! | `intake/` | the size of the cells, memory foreseen, scans loaded one after the other; where scans lie, how far from each other |
//! | `visibility/` | crossings that scans see through |
//! | `field/` | 3. and 4. crossings to votes, votes to labels of the nodes and vertices between them |
//! | `surface/` | 5. valid cells; 6. the mesh; 7. vertices without a crossing, vertices where two fans meet: block by block, and put together |
//! | `colour/` | scans made equally bright; colours where no scan has any |
//! | `finish/` | 8. parts that are kept; 9. holes; the surface handed over; its distance to the scans |
//! | `run/` | keeps what steps leave for each other: `memory`, `incremental` where scans have changed, `out_of_core` in files |
//! | `reference/` | 3. and 4. as the paper has them, to compare with (a feature) |
//! | `dump` | stages as files to look at |
//!
//! A folder knows those above it in this list; `pipeline`, `run` and `dump` know all.

mod pipeline;

mod colour;
mod crossings;
mod field;
mod finish;
mod intake;
mod surface;
mod visibility;

mod run;

#[cfg(any(test, feature = "reference"))]
pub mod reference;

mod dump;

mod types;

use std::sync::atomic::Ordering;

pub use finish::deviation::deviation;
pub use image::source::{Loading, OrientedSurface, PlacedMesh, ScanSource, common_crs};
pub use run::{incremental, incremental as again, out_of_core, out_of_core as disk};
pub use types::{MergeParams, MergeReport, Merged, SCHEMA, VoxelReason, Warning, WarningKind};

use base::error::{Error, Result};
use base::progress::Progress;
use base::{fewer_threads, threads};
use crossings::crossing;
use finish::close_holes::Room;
use intake::setup::{Fit, Setup};
use mesh::TriMesh;
use pipeline::{Graph, Out};
use run::memory::Memory;

base::stages! {
    /// Stages of the merge with their shares of its time.
    PLAN:
    MEASURING = "measuring the scans", 0.05;
    DISCRETIZING = "reading scans, finding intersections", 0.5;
    FUSING = "fusing intersections", 0.1;
    LOOKING = "looking through", 0.05;
    LABELLING = "labelling nodes", 0.05;
    BUILDING = "building the surface", 0.17;
    CLOSING = "closing holes", 0.05;
    WRITING = "writing the surface", 0.03;
}

/// Merges the scans into one surface.
///
/// # Errors
/// Parameters out of range; scans of different coordinate reference systems, or in degrees; whatever loading a scan can meet;
/// [`Error::Cancelled`].
pub fn run(sources: &[&dyn ScanSource], params: &MergeParams, progress: &Progress<'_>) -> Result<Merged> {
    run_by(sources, params, &Setup::default(), progress)
}

/// As [`run()`], with at most so many bytes of memory.
///
/// # Errors
/// As [`run()`].
pub fn run_within(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    memory: Option<u64>,
    progress: &Progress<'_>,
) -> Result<Merged> {
    run_by(sources, params, &Setup { fit: Fit::within(memory), ..Setup::default() }, progress)
}

/// As [`run_within`], but in no larger cells than given or measured: `None` where these do not fit into memory, and the surface alone may.
///
/// # Errors
/// As [`run()`]; [`Error::OutOfMemory`] where not even the surface would fit.
pub fn run_if_it_fits(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    memory: Option<u64>,
    progress: &Progress<'_>,
) -> Result<Option<Merged>> {
    if_it_fits(memory, |setup| run_by(sources, params, setup, progress))
}

/// What `run` gives that keeps to cells as they are, if these fit.
fn if_it_fits(memory: Option<u64>, run: impl FnOnce(&Setup) -> Result<Merged>) -> Result<Option<Merged>> {
    let setup = Setup { fit: Fit { keeps_to_cells: true, ..Fit::within(memory) }, ..Setup::default() };
    match run(&setup) {
        Err(Error::OutOfMemory(_)) if setup.fit.leaves_hope() => Ok(None),
        other => other.map(Some),
    }
}

fn run_by(sources: &[&dyn ScanSource], params: &MergeParams, setup: &Setup, progress: &Progress<'_>) -> Result<Merged> {
    let merge = |threads| {
        setup.fit.begin();
        let params = &MergeParams { threads, ..*params };
        started(sources, params, progress, || merge(sources, params, setup, progress))
    };
    // What was foreseen not to fit does not with one either.
    fewer_threads::where_memory_is_short(params.threads, || !setup.fit.is_refused.load(Ordering::Relaxed), merge)
}

/// Does the work of merging scans, if they can be merged.
fn started<T: Send>(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    progress: &Progress<'_>,
    work: impl FnOnce() -> Result<T> + Send,
) -> Result<T> {
    params.validate()?;
    if sources.is_empty() {
        return Err(Error::input("no scan to merge: give at least one"));
    }
    if sources.len() > crossing::MAX_SCANS {
        return Err(Error::input(format!(
            "{} scans are more than the {} that fit",
            sources.len(),
            crossing::MAX_SCANS
        )));
    }
    common_crs(sources)?;
    progress.plan(PLAN);
    let pool = threads::pool(params.threads)?;
    let merged = progress.run(&pool, work);
    // Whatever else went wrong meanwhile, the caller asked for an end.
    if merged.is_err() {
        progress.check()?
    }
    merged
}

fn merge(sources: &[&dyn ScanSource], params: &MergeParams, setup: &Setup, progress: &Progress<'_>) -> Result<Merged> {
    in_memory(&mut Memory::new(sources, params, setup), params, progress)
}

/// The surface of a graph, in memory.
fn in_memory(graph: &mut impl Graph, params: &MergeParams, progress: &Progress<'_>) -> Result<Merged> {
    let mut mesh = TriMesh::default();
    let report = pipeline::merge(graph, params, Out { sink: &mut mesh, room: Room::ALL }, progress)?;
    Ok(Merged { mesh, report })
}

#[cfg(test)]
mod tests;
