//! Stage 8: connected parts of the surface. Small ones are dropped if that is asked for.

use glam::DVec3;

use super::stray;
use crate::report::MergeReport;
use crate::surface::parts::{self, Chosen};
use crate::surface::tile::{Part, Tiles};
use base::error::Result;
use base::progress::Progress;

/// Decides which parts are kept, and says of the others in the report.
///
/// # Errors
/// A tile can't be read. Cancelled.
pub fn choose<T: Tiles>(
    tiles: &T,
    reach: f64,
    min_share: f64,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<Chosen> {
    let parts = parts::find(tiles, progress)?;
    let stray = stray::stray(tiles, &parts, report.voxel, reach, progress)?;
    // The largest is not stray.
    let least = least(&parts.list, min_share);
    let kept: Vec<bool> =
        parts.list.iter().zip(&stray).map(|(part, stray)| !stray && part.faces as f64 >= least).collect();
    let gone = || parts.list.iter().zip(&kept).filter(|part| !part.1).map(|part| part.0.faces);
    report.dropped_components = [gone().count() as u64, gone().sum()];
    let size = extent(&parts.list, &kept);
    report.grid = (size / report.voxel).ceil().to_array().map(|cells| cells as u64);
    Ok(Chosen { parts, kept, size })
}

/// Size of the bounding box of the parts that are kept.
fn extent(parts: &[Part], is_kept: &[bool]) -> DVec3 {
    let kept = parts.iter().zip(is_kept).filter(|part| *part.1).map(|part| part.0);
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = kept.fold(none, |(low, high), part| (low.min(part.low), high.max(part.high)));
    (high - low).max(DVec3::ZERO)
}

/// Triangles that a part has at least which is kept.
pub fn least(parts: &[Part], min_share: f64) -> f64 {
    min_share * parts.iter().map(|part| part.faces).max().unwrap_or(0) as f64
}
