//! The driver: the stages in their order.

use std::borrow::Cow;

use rayon::prelude::*;

use super::candidate::Source;
use super::grid::QuadGrid;
use super::measure::Judge;
use super::params::{QuadParams, Target};
use super::stages::{CURVATURE, FILLING, PLAN, SAMPLING};
use super::{choose, density, gaps};
use base::error::{Error, Result};
use base::magnitude::LARGEST;
use base::memory;
use base::progress::Progress;
use image::range_image::{RangeImage, Samples};
use mesh::Crs;

/// At the peak. Measured.
const BYTES_A_PIXEL: f64 = 3.0;
/// Images of fewer pixels, about a millisecond of work, are left to one thread.
const PIXELS_FOR_THREADS: usize = 1 << 15;

/// Makes a quad grid of an image.
///
/// # Guarantees
/// * The grid is regular: every vertex has its own pixel, and seen on the pixels no quad folds over. See [`QuadGrid`]. Without a target it
///   has `(rows - 1) * tiles_down + 1` rows and `(columns - 1) * tiles_across + 1` columns.
/// * Its mean error (with a target, the error that the target names) is at most that of the uniform grid of the same size, if
///   a pixel that is missed counts as far off as the depth extent.
/// * With a target, that error is at most the one asked for, as measured. Up to one vertex per pixel may be needed. Only pixels that are
///   missed even then have none.
/// * The same image gives the same grid for any number of threads, and in any unit that is a power of two times another.
///
/// # Cost
/// O(pixels). 2 bytes per pixel beside the image, 12 more with many columns, and a copy of the image if it has gaps to fill. With a target
/// about 10 times the time.
///
/// # Errors
/// Parameters out of range. Fewer pixels than vertices along a side, fewer than 2 x 2 pixels, none valid, attributes of the wrong length, a
/// world in degrees. [`Error::Cancelled`].
///
/// Source: \[GSB97\], with the differences listed at the module.
pub fn run(image: &RangeImage, params: &QuadParams, progress: &Progress<'_>) -> Result<QuadGrid> {
    params.validate()?;
    image.validate()?;
    Crs::lengths(image.crs.as_ref())?;
    let size = [image.rows(), image.cols()];
    if size[0] < 2 || size[1] < 2 {
        return Err(Error::input(format!(
            "a quad grid needs at least 2 x 2 pixels, the image has {} x {}",
            size[0], size[1]
        )));
    }
    if size[0].max(size[1]) > 1 << 26 {
        return Err(Error::input(format!("{} x {} pixels: a side may have at most {}", size[0], size[1], 1 << 26)));
    }
    let pixels = BYTES_A_PIXEL * image.len() as f64;
    memory::expect(pixels, || format!("a grid over {} pixels", image.len()), "use fewer")?;
    progress.plan(PLAN);
    // Waking threads would take longer than they save.
    let threads = if image.len() < PIXELS_FOR_THREADS { 1 } else { params.threads };
    let pool = base::threads::pool(threads)?;
    progress.run(&pool, || stages(image, params, progress))
}

fn stages(image: &RangeImage, params: &QuadParams, progress: &Progress<'_>) -> Result<QuadGrid> {
    progress.stage(FILLING, 1);
    let (filled, gaps_filled) = gaps::fill(image, params.gap_passes, params.gap_neighbours, progress)?;
    let ranges = ranges(&filled);
    let extent = depth_extent(image, &ranges)?;
    progress.lap("filling gaps");

    progress.stage(CURVATURE, image.len() as u64);
    let density = density::image(&ranges, image.cols(), extent, params, progress)?;
    drop(ranges);
    progress.lap("curvature");

    let judge = match params.target {
        Target::AsGiven => Judge::Mean,
        Target::Rms(_) => Judge::Rms,
        Target::Max(_) => Judge::Max,
    };
    let first_range = || (0..image.len()).find_map(|i| image.is_valid(i).then(|| image.range(i).abs()));
    let missed = if extent > 0.0 { extent } else { first_range().unwrap_or(0.0) };
    let source = Source { image, filled: &filled, params, density, extent, missed, judge };
    progress.stage(SAMPLING, 1);
    let mut chosen = match params.target {
        Target::AsGiven => source.candidate(source.layout([params.rows, params.columns])?, progress)?,
        Target::Rms(error) | Target::Max(error) => choose::smallest(&source, error, progress)?,
    };
    progress.lap("measuring the error");
    source.finish(&mut chosen, gaps_filled, progress)
}

/// The ranges of an image, computed only where they aren't stored.
fn ranges(image: &RangeImage) -> Cow<'_, [f64]> {
    match image.samples() {
        Samples::Values(values) => Cow::Borrowed(values),
        Samples::Points(_) => Cow::Owned((0..image.len()).into_par_iter().map(|i| image.range(i)).collect()),
    }
}

/// Difference between the farthest and the nearest valid range.
fn depth_extent(image: &RangeImage, ranges: &[f64]) -> Result<f64> {
    let limits = ranges
        .par_chunks(1 << 16)
        .map(|ranges| {
            let mut lanes = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
            for chunk in ranges.chunks(8) {
                for (l, &z) in chunk.iter().enumerate() {
                    lanes.0[l] = if z < lanes.0[l] { z } else { lanes.0[l] };
                    lanes.1[l] = if z > lanes.1[l] { z } else { lanes.1[l] };
                }
            }
            (lanes.0.into_iter().fold(f64::INFINITY, f64::min), lanes.1.into_iter().fold(f64::NEG_INFINITY, f64::max))
        })
        .reduce(|| (f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let name = image.called();
    if limits.0 > limits.1 {
        return Err(Error::input(format!("{name}: no pixel is valid, but a grid needs some")));
    }
    let extent = limits.1 - limits.0;
    // Errors are squared.
    if limits.0.abs().max(limits.1.abs()) > LARGEST * LARGEST {
        return Err(Error::input(format!(
            "{name}: ranges from {:e} to {:e} are farther than can be computed with: use a larger unit",
            limits.0, limits.1
        )));
    }
    Ok(extent)
}
