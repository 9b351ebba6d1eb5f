//! Marching Intersections: registered scans -> one surface. \[MI04\]
//!
//! | folder or file | steps |
//! |---|---|
//! | `stages`, `params`, `report` | names of the stages that progress tells, and their shares of the time; the settings; the figures |
//! | `crossings/` | 1. the grid and the crossings of the scans with its lines; 2. details finer than a cell; 3. crossings in order, and added up by edge |
//! | `intake/` | the size of the cells, memory foreseen, scans loaded one after the other; where scans lie, how far from each other |
//! | `field/` | 3. and 4. crossings to votes, votes to labels of the nodes and vertices between them |
//! | `visibility/` | crossings that scans see through |
//! | `surface/` | 5. valid cells; 6. the mesh; 7. vertices without a crossing, vertices where two fans meet: block by block, and put together |
//! | `colour/` | scans made equally bright; colours where no scan has any |
//! | `finish/` | 8. parts that are kept; 9. holes; the surface handed over; its distance to the scans |
//! | `driver` | the list of the steps, for all ways to run them |
//! | `run/` | keeps what steps leave for each other: `memory`, `incremental` where scans have changed, `out_of_core` in files |
//! | `reference/` | 3. and 4. as the paper has them, to compare with (a feature) |
//! | `dump` | stages as files to look at |
//!
//! A folder knows those above it in this list. Those from `driver` on know all.

mod operation;
mod params;
mod report;
mod stages;

mod colour;
mod crossings;
mod field;
mod finish;
mod intake;
mod surface;
mod visibility;

mod driver;
mod run;

#[cfg(any(test, feature = "reference"))]
pub mod reference;

mod dump;

pub use finish::deviation::deviation;
pub use image::source::{Loading, OrientedSurface, PlacedMesh, ScanSource, common_crs};
pub use operation::OPERATION;
pub use params::{MergeParams, SCHEMA};
pub use report::{MergeReport, Merged, VoxelReason, Warning, WarningKind};
pub use run::{Reuse, Run, Store, incremental, merge, out_of_core};

use base::error::Result;
use base::progress::Progress;

/// The former name of [`merge`] in memory.
///
/// # Errors
/// As [`merge`].
#[deprecated(since = "0.2.0", note = "it is called `merge`")]
pub fn run(scans: &[&dyn ScanSource], params: &MergeParams, progress: &Progress<'_>) -> Result<Merged> {
    merge(scans, params, Run::default(), progress)
}

/// The former name of [`merge`] with at most so many bytes.
///
/// # Errors
/// As [`merge`].
#[deprecated(since = "0.2.0", note = "it is called `merge`, with `Run::memory`")]
pub fn run_within(
    scans: &[&dyn ScanSource],
    params: &MergeParams,
    memory: Option<u64>,
    progress: &Progress<'_>,
) -> Result<Merged> {
    merge(scans, params, Run { memory, ..Run::default() }, progress)
}

/// The former name of [`merge`] with [`Store::MemoryOrFiles`], which gives the surface where this gave `None`.
///
/// # Errors
/// As [`merge`].
#[deprecated(since = "0.2.0", note = "it is called `merge`, with `Store::MemoryOrFiles`")]
pub fn run_if_it_fits(
    scans: &[&dyn ScanSource],
    params: &MergeParams,
    memory: Option<u64>,
    progress: &Progress<'_>,
) -> Result<Option<Merged>> {
    run::started::if_it_fits(memory, |setup| run::memory::run_by(scans, params, setup, progress))
}

/// The former name of [`incremental`].
#[deprecated(since = "0.2.0", note = "it is called `incremental`")]
pub mod again {
    pub use crate::incremental::*;
}

/// The former name of [`out_of_core`].
#[deprecated(since = "0.2.0", note = "it is called `out_of_core`")]
pub mod disk {
    pub use crate::out_of_core::Keep as Kept;
    pub use crate::out_of_core::*;
}

#[cfg(test)]
mod tests;
