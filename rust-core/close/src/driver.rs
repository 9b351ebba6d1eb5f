//! The driver: what is handed in is checked, closed, and looked at once more.

use base::error::{Error, Result, Shown};
use base::memory;
use base::progress::Progress;
use image::source::ScanSource;
use mesh::measure::bounds;
use mesh::{Crs, TriMesh};

use super::attempts::{self, FINENESS, measures};
use super::doubts;
use super::params::CloseParams;
use super::report::Closed;
use super::stages::{PLAN, READING};
use super::visibility::{Scans, Visibility};

/// The smallest cell by the median edge: edges of a surface that was simplified are longer than its cells.
const LEAST_CELL: f64 = 0.01;
/// At the peak. Measured.
const BYTES_A_TRIANGLE: f64 = 400.0;

/// Closes the openings of a surface with a smooth fill that stays out of what its scans saw to be empty.
///
/// `mesh` is an oriented manifold in the world of its scans. Range images whose rays are known say where nothing is. Meshes and points say
/// nothing. Without scans openings are closed by their shape alone.
///
/// # Guarantees
/// * Vertices and triangles of `mesh` come first in the result, to the bit and in their order. What is added is marked.
/// * The result is an oriented manifold. No added face crosses any other.
/// * No place of an added face was seen through by more than the merge distance and half a cell, but of forced faces. Places are looked at
///   every half cell, and farther than that from measured vertices.
/// * Openings that are not closed are in the report, with the reason.
/// * The same result for any number of threads and any order of the scans.
///
/// # Cost
/// Time O(n log n) for n triangles, and O(m) for m nodes of grids: one of at most 3 million with cells four times those of the merge over
/// everything, and one with cells twice as large around openings. About 400 bytes per triangle, 200 and 110 per node, and 11 per pixel of
/// the scans. In things so large that the first grid would have more nodes cells are larger. Openings smaller than two of them are closed by
/// the mesh alone. \[Lie03\]
///
/// # Errors
/// Parameters out of range, or of no use with the others. A mesh that is no oriented manifold: the error says what is wrong. Scans of another
/// coordinate reference system, or that can't be read. Scans none of which meets the surface. [`base::Error::OutOfMemory`].
/// [`base::Error::Cancelled`]. A warning tells of single scans that do not meet it, and of a surface that seems to be inside out.
pub fn close(
    mesh: &TriMesh,
    scans: &[&dyn ScanSource],
    params: &CloseParams,
    progress: &Progress<'_>,
) -> Result<Closed> {
    in_one_world(mesh, scans)?;
    planned(mesh, params, progress, || {
        progress.stage(READING, scans.len() as u64);
        let visibility = Scans::of_sources(scans, progress)?;
        refuse_blind_force(&visibility, params)?;
        let elsewhere = doubts::elsewhere(mesh, &visibility, measures(mesh, true, params).merge_distance)?;
        progress.lap(PLAN[READING].0);
        let mut closed = run(mesh, &visibility, params, progress)?;
        closed.report.warnings.extend(elsewhere);
        Ok(closed)
    })
}

/// The same with lines of sight that are known already. It is [`super::Blind`] for surfaces without sensors.
///
/// # Errors
/// Those of [`close`].
pub fn close_seen_by(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    params: &CloseParams,
    progress: &Progress<'_>,
) -> Result<Closed> {
    planned(mesh, params, progress, || run(mesh, visibility, params, progress))
}

/// The same on the pool that it is called on: as a part of another operation, which has planned its stages. `params` have the threads of
/// that pool.
///
/// # Errors
/// Those of [`close`].
#[doc(hidden)]
pub fn close_on_this_pool(
    mesh: &TriMesh,
    visibility: &dyn Visibility,
    params: &CloseParams,
    progress: &Progress<'_>,
) -> Result<Closed> {
    foreseen(mesh, params)?;
    progress.plan(PLAN);
    run(mesh, visibility, params, progress)
}

fn planned(
    mesh: &TriMesh,
    params: &CloseParams,
    progress: &Progress<'_>,
    run: impl FnOnce() -> Result<Closed> + Send,
) -> Result<Closed> {
    params.go_together()?;
    foreseen(mesh, params)?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, run)
}

/// Refuses parameters out of range, and work that needs more memory than there is.
fn foreseen(mesh: &TriMesh, params: &CloseParams) -> Result<()> {
    params.validate()?;
    mesh.validate()?;
    refuse_deep_base(mesh, params)?;
    refuse_tiny_cell(mesh, params)?;
    memory::expect_each(mesh.triangles.len(), BYTES_A_TRIANGLE, 0.0, "closing", "triangles")
}

/// Refuses scans that lie in another coordinate reference system than the surface.
fn in_one_world(mesh: &TriMesh, scans: &[&dyn ScanSource]) -> Result<()> {
    let mut systems = vec![("the surface", mesh.crs.clone())];
    for scan in scans {
        systems.push((scan.name(), scan.crs()?));
    }
    Crs::common(systems).map(|_| ())
}

fn run(mesh: &TriMesh, visibility: &dyn Visibility, params: &CloseParams, progress: &Progress<'_>) -> Result<Closed> {
    let mut closed = attempts::run(mesh, visibility, params, &FINENESS, progress)?;
    closed.report.warnings.extend(doubts::turned(mesh, visibility, &closed.report, progress)?);
    Ok(closed)
}

/// Refuses force without scans that say where nothing is.
fn refuse_blind_force(scans: &Scans, params: &CloseParams) -> Result<()> {
    if params.force && scans.is_blind() {
        return Err(Error::input(
            "force is given, but has no use without scans that say where nothing is: give range images, too, or leave force out",
        ));
    }
    Ok(())
}

/// Refuses a cell so small that it is of another unit, and takes long for nothing.
fn refuse_tiny_cell(mesh: &TriMesh, params: &CloseParams) -> Result<()> {
    let edge = mesh.median_edge();
    match params.cell {
        Some(cell) if cell < LEAST_CELL * edge => Err(Error::input(format!(
            "cell is {}, but the median edge of the surface is {}: give at least a hundredth of that",
            Shown(cell),
            Shown::digits(edge, 4)
        ))),
        _ => Ok(()),
    }
}

/// Refuses a base so deep that the fill would be longer than all that was measured.
fn refuse_deep_base(mesh: &TriMesh, params: &CloseParams) -> Result<()> {
    let longest = bounds(&mesh.positions).map_or(0.0, |(lo, hi)| (hi - lo).max_element());
    if params.flat_base && params.base_depth > longest {
        return Err(Error::input(format!(
            "base_depth is {}, but the longest side of the surface is {}: give at most that",
            Shown(params.base_depth),
            Shown::digits(longest, 4)
        )));
    }
    Ok(())
}
