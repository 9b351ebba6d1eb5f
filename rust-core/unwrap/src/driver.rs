//! The driver: the stages in their order.

use base::error::Result;
use base::memory;
use base::progress::Progress;
use mesh::{Crs, TriMesh};

use super::params::UnwrapParams;
use super::report::{UnwrapReport, Unwrapped};
use super::surface::Surface;
use super::{finish, flatten, join, mend, pack};

/// At the peak. Measured.
const BYTES_A_TRIANGLE: f64 = 800.0;

base::stages! {
    /// Stages with their shares of the time.
    pub PLAN:
    FLATTENING = "flattening charts", 0.6;
    JOINING = "joining charts", 0.1;
    PACKING = "packing charts", 0.25;
    MENDING = "checking", 0.05;
}

/// Gives a mesh texture coordinates.
///
/// Any triangles are welcome: open, closed, of many parts, of any genus. Edges that do not join two triangles of the same
/// orientation become seams.
///
/// # Guarantees
/// * No triangle is flipped and no two overlap, by exact signs of the coordinates as they are returned
///   ([`check`](super::check::check)). Triangles that are degenerate, or too thin for single precision, have no area.
/// * Charts lie at least twice `padding` texels from each other and `padding` from the border of their tile.
/// * Coordinates are multiples of 2^-24, so that `1 - v` of a file that counts from the top is exact.
/// * The same input gives the same coordinates for any number of threads.
///
/// # Cost
/// n triangles: about O(n^1.5) for the least squares of large charts. 5 s of CPU time for 20,000 triangles, 45 s for 200,000. About 0.8 kB
/// per triangle and half a byte per texel of a tile.
///
/// # Errors
/// Parameters out of range. A mesh that is not valid or has no triangle. Charts that do not fit their tiles. [`base::Error::OutOfMemory`].
/// [`base::Error::Cancelled`].
pub fn unwrap(mesh: &TriMesh, params: &UnwrapParams, progress: &Progress<'_>) -> Result<Unwrapped> {
    params.validate()?;
    Crs::lengths(mesh.crs.as_ref())?;
    let triangles = mesh.triangles.len();
    // The packer's page, a bit per texel, and the charts' masks in four turns.
    let page = 0.6 * f64::from(params.size).powi(2);
    memory::expect_each(triangles, BYTES_A_TRIANGLE, page, "unwrapping", "triangles")?;
    let surface = Surface::new(mesh)?;
    pack::expect_density(&surface, params)?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    progress.run(&pool, || stages(mesh, &surface, params, progress))
}

fn stages(mesh: &TriMesh, surface: &Surface, params: &UnwrapParams, progress: &Progress<'_>) -> Result<Unwrapped> {
    let triangles = mesh.triangles.len() as u64;
    progress.stage(FLATTENING, triangles);
    let mut charts = flatten::flatten(surface, params, progress)?;
    progress.lap("flattening");
    progress.stage(JOINING, 1);
    let mut report = UnwrapReport { charts_before: charts.renumber(), ..UnwrapReport::default() };
    join::join(&mut charts, surface, progress)?;
    progress.lap("joining");
    progress.stage(PACKING, triangles);
    let packed = pack::pack(&charts, surface, params, progress)?;
    progress.lap("packing");
    progress.stage(MENDING, 1);
    let mut charts = packed.charts;
    report.tiles = packed.tiles as usize;
    report.moved = mend::mend(&mut charts, surface, progress)?;
    let mut unwrapped = finish::finish(mesh, charts, params, report);
    progress.lap("checking");
    unwrapped.report.seconds = progress.seconds();
    Ok(unwrapped)
}
