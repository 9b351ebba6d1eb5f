//! Thickness of what was measured from both sides: where only one side was, the fill has a start that is no thicker.

use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use geom::bvh::Ray;

use super::surface::{Surface, normal};

/// Triangles that are asked.
const ASKED: usize = 4096;
/// With fewer backs behind them than this share, nothing is known.
const LEAST_SHARE: f64 = 0.25;
/// Share of the backs that are nearer: a stem or a foot is no wall.
const MOST: f64 = 0.9;

/// Distance from the surface to its back, against the normals. Nine of ten backs are nearer. Infinite where backs were seldom measured.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn of_walls(surface: &Surface<'_>, progress: &Progress<'_>) -> Result<f64> {
    let count = surface.mesh.triangles.len();
    let asked: Vec<usize> = (0..count).step_by(count.div_ceil(ASKED)).collect();
    let distances: Vec<Option<f64>> = asked
        .par_chunks(256)
        .map(|asked| {
            progress.check()?;
            Ok(asked.iter().map(|&t| to_back(surface, t)).collect::<Vec<_>>())
        })
        .collect::<Result<Vec<_>>>()?
        .concat();
    let mut known: Vec<f64> = distances.into_iter().flatten().collect();
    if (known.len() as f64) < LEAST_SHARE * asked.len() as f64 {
        return Ok(f64::INFINITY);
    }
    known.sort_unstable_by(f64::total_cmp);
    Ok(known.get((MOST * known.len() as f64) as usize).copied().unwrap_or(f64::INFINITY))
}

/// Median distance from some triangles to their backs. `None` if most have none.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn at(surface: &Surface<'_>, triangles: &[u32], progress: &Progress<'_>) -> Result<Option<f64>> {
    let mut known = Vec::new();
    for block in progress.blocks(triangles) {
        known.extend(block?.iter().filter_map(|&t| to_back(surface, t as usize)));
    }
    known.sort_unstable_by(f64::total_cmp);
    Ok(known.get(known.len() / 2).copied().filter(|_| 2 * known.len() > triangles.len()))
}

/// Distance from the middle of a triangle to the next one against its normal, if that faces away.
fn to_back(surface: &Surface<'_>, t: usize) -> Option<f64> {
    let corners = surface.mesh.corners(t);
    let own = normal(corners);
    let ray = Ray { origin: (corners[0] + corners[1] + corners[2]) / 3.0, direction: -own };
    // The triangle itself is met at rounding's distance.
    let least = 1e-6 * corners[0].distance(corners[1]);
    let hit = surface.bvh.first_hit(&ray, least, f64::INFINITY)?;
    (normal(surface.mesh.corners(hit.triangle as usize)).dot(own) < 0.0).then_some(hit.t)
}
