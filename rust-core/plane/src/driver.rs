//! The driver: the stages in their order.

use base::error::{Error, Result, Shown};
use base::progress::Progress;
use image::select::Plane;
use image::source::{ScanSource, common_crs};

use crate::fit;
use crate::params::PlaneParams;
use crate::pool::Pool;
use crate::report::DominantPlane;

base::stages! {
    /// Stages with their shares of the time.
    PLAN:
    READING = "reading scans", 0.9;
    FINDING = "finding the plane", 0.1;
}

/// Finds the dominant plane of scans where they lie.
///
/// Of each scan some samples are looked at, a quarter of a million in all. The result is the same for any order of the scans and any number
/// of threads. O(samples) for reading.
///
/// # Errors
/// Parameters out of range. Scans that can't be read. No scans, or fewer than three samples. Samples that lie on a line. No plane that
/// stands out. [`Error::Cancelled`].
pub fn dominant(sources: &[&dyn ScanSource], params: &PlaneParams, progress: &Progress<'_>) -> Result<DominantPlane> {
    params.validate()?;
    common_crs(sources)?;
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    let found = progress.run(&pool, || {
        progress.stage(READING, sources.len() as u64);
        let pool = Pool::of(sources, progress)?;
        progress.stage(FINDING, 1);
        found(&pool, params, progress)
    });
    found.or_else(|error| progress.check().and(Err(error)))
}

/// Least size of the margin in extents of the scans: what single precision and rounding lift off a plane without noise.
const ROUNDING: f64 = 1e-5;
/// Deviations of the samples that the margin takes along.
const MARGIN: f64 = 4.0;
/// A plane stands out where so many times as many samples lie on it as in as much space beside it.
const STANDS_OUT: usize = 2;

fn found(pool: &Pool, params: &PlaneParams, progress: &Progress<'_>) -> Result<DominantPlane> {
    if pool.points.len() < 3 {
        return Err(Error::input(format!(
            "a plane needs at least three samples, but the scans have {}: check what was kept of them",
            pool.points.len()
        )));
    }
    let Some(best) = fit::best(pool, params.tolerance, progress)? else {
        return Err(Error::input(
            "the samples lie on a line or in one place, so that no plane is told from others: give the plane by three points",
        ));
    };
    let count = pool.points.len();
    let share = best.on as f64 / count as f64;
    let remedy = "Crop the scans to where the plane is, or give it by three points";
    if share < params.min_share {
        let [share, least] = [share, params.min_share].map(|share| Shown::digits(100.0 * share, 2));
        return Err(Error::input(format!(
            "no plane stands out: {share} % of the samples lie on the best one, and the least share is {least} %. \
                {remedy}, or lower the least share."
        )));
    }
    if best.on < STANDS_OUT * best.beside {
        return Err(Error::input(format!(
            "no plane stands out: within {} of the best one lie {} samples, in as much space beside it {}. {remedy}, \
                or change the tolerance.",
            Shown::digits(best.width, 3),
            best.on,
            best.beside
        )));
    }
    let margin = params.margin.unwrap_or((MARGIN * best.spread).max(ROUNDING * pool.extent));
    let plane = Plane::new(best.centre + pool.origin, best.normal, margin)?;
    let plane = if best.is_upside_down { plane.flipped() } else { plane };
    Ok(DominantPlane { plane, share, spread: best.spread })
}
