//! Marching Intersections: registered scans -> one surface. \[MI04\]

// the list of steps, and what they leave for each other in memory
mod graph;
mod memory;

mod lattice;

mod crossing;
mod damage;

mod bundles;

// 0. which scan is which
mod numbers;

// 1. intersections of the scans with the lines of the grid
mod discretize;
mod intake;

mod defaults;
mod overlap;
mod placing;

mod budget;

mod passes;

// 2. initial removal
mod remove;

// 3. crossings in order along their lines, and added up by edge
mod lines;
mod tally;

// what scans see through
mod sight;

// colours: of edges, made equally bright over the scans, where no scan has any
mod colour;
mod gains;
mod near_colours;

// 3. and 4.: crossings -> labels of the nodes, and vertices
mod fuse;

mod field;
mod nodes;
mod smooth;

// 3. and 4. as the paper has them
#[cfg(any(test, feature = "reference"))]
pub mod reference;

// 5. to 7. block by block
mod tile;
mod tiles;

// 5. valid cells
mod anomalies;

// 6. the mesh
mod extract;

mod table;

// 7. vertices without a crossing; vertices where two fans meet
mod artificial;
mod pinches;

// 8. parts that are no evidence of a surface; small parts
mod components;
mod connected;
mod parts;
mod stray;

// the surface as it is put together of its tiles
mod noise;
mod numbering;
mod whole;

// 9. holes
mod close;
mod peel;

// and handed over
mod bare_colours;
mod in_place;
mod write;

// afterwards: how far the surface lies from the scans
mod deviation;

// what stages leave to look at
mod dump;

// what is asked for, and given
mod types;

// once more, where scans have changed
pub mod again;

// more than memory holds
pub mod disk;

use std::sync::atomic::{AtomicBool, Ordering};

use field::{BrickLabels, Vertices};
use rustc_hash::FxHashMap;

pub use deviation::deviation;
pub use image::source::{Loading, OrientedSurface, PlacedMesh, ScanSource, common_crs};
pub use types::{MergeParams, MergeReport, Merged, SCHEMA, VoxelReason, Warning, WarningKind};

use base::error::{Error, Result, Shown};
use base::progress::Progress;
use base::{fewer_threads, threads};
use close::Room;
use graph::{Graph, Out};
use memory::Memory;
use mesh::TriMesh;

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

/// As [`run`], with at most so many bytes of memory.
///
/// # Errors
/// As [`run`].
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
/// As [`run`]; [`Error::OutOfMemory`] where not even the surface would fit.
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
    let report = graph::merge(graph, params, Out { sink: &mut mesh, room: Room::ALL }, progress)?;
    Ok(Merged { mesh, report })
}

fn nothing_to_merge() -> Error {
    Error::input(
        "no scan has a triangle, so there is nothing to merge: check the scans, check what was kept of them, or raise edge_limit",
    )
}

fn refuse_nothing(triangles: u64, voxel: f64, min_share: f64) -> Result<()> {
    if triangles > 0 {
        return Ok(());
    }
    let or_share = if min_share > 0.0 { ", or a smaller min_component_share" } else { "" };
    Err(Error::input(format!(
        "nothing is left of the surface: choose a voxel smaller than {} (in the unit of the scans){or_share}",
        Shown::digits(voxel, 4)
    )))
}

/// What no parameter says.
struct Setup {
    /// Where bricks are counted from.
    corner: [i64; 3],
    /// Crossings of a worker that are kept one by one; where there are more they are added up.
    kept: u64,
    /// Bricks along each side of a block; else all is one.
    block: Option<i32>,
    fit: Fit,
}

/// What follows where cells do not fit into memory.
struct Fit {
    /// Bytes that there are at most.
    memory: f64,
    /// Whether cells are never larger than given or measured.
    keeps_to_cells: bool,
    /// Answered: whether it was foreseen that these cells do not fit ...
    is_refused: AtomicBool,
    /// ... and the surface alone may.
    surface_may_fit: AtomicBool,
}

impl Fit {
    fn within(memory: Option<u64>) -> Self {
        let memory = memory.map_or(f64::INFINITY, |bytes| bytes as f64);
        Fit {
            memory,
            keeps_to_cells: false,
            is_refused: AtomicBool::new(false),
            surface_may_fit: AtomicBool::new(false),
        }
    }

    /// Nothing is foreseen yet.
    fn begin(&self) {
        self.is_refused.store(false, Ordering::Relaxed);
        self.surface_may_fit.store(false, Ordering::Relaxed);
    }

    /// Whether a merge in files may fit where this one did not.
    fn leaves_hope(&self) -> bool {
        self.surface_may_fit.load(Ordering::Relaxed) || !self.is_refused.load(Ordering::Relaxed)
    }
}

impl Default for Setup {
    fn default() -> Self {
        Setup { corner: [0; 3], kept: bundles::MANY, block: None, fit: Fit::within(None) }
    }
}

type Labels = FxHashMap<[i32; 3], Box<BrickLabels>>;
type BrickVertices = FxHashMap<[i32; 3], Vertices>;

#[cfg(test)]
mod tests;
