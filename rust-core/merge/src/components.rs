//! Stage 8: connected parts of the surface; small ones are dropped where that is asked for.

use glam::DVec3;

use super::connected::{self, faces};
use super::extract::Surface;
use super::parts::{self, Part};
use super::tiles::{self, Tile};
use super::{MergeReport, dump, passes, refuse_nothing, stray};
use base::error::Result;
use base::progress::Progress;

/// The surface and its connected parts.
pub struct Kept {
    /// Those parts that were kept.
    pub surface: Surface,
    /// All parts there were.
    pub parts: Vec<Part>,
    /// The part of each vertex.
    pub part_of: Vec<u32>,
    /// Size of the bounding box of what was kept.
    pub size: DVec3,
}

/// Stage 8: the parts that are evidence of a surface, and of these the ones with at least `min_share` of the triangles of the
/// largest, in one piece. `reach` is the merge distance in cells.
///
/// # Errors
/// Nothing is left; more vertices than there are numbers for; cancelled.
pub fn keep(
    tiles: Vec<Tile>,
    reach: f64,
    min_share: f64,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<Kept> {
    let parts = parts::find(&tiles, progress)?;
    let stray = stray::stray(&tiles, &parts, report.voxel, reach, progress)?;
    let kept: Vec<bool> = stray.iter().map(|&goes| !goes).collect();
    let small = small(&parts.list, &kept, min_share);
    let kept: Vec<bool> = kept.iter().zip(&small).map(|(&is_kept, &goes)| is_kept && !goes).collect();
    let gone = || parts.list.iter().zip(&kept).filter(|part| !part.1).map(|part| part.0.faces);
    report.dropped_components = [gone().count() as u64, gone().sum()];
    let size = extent(&parts.list, &kept);
    let (mut surface, mut part_of) = tiles::join(tiles, parts.of, progress)?;
    if kept.contains(&false) {
        let keep = passes::made(part_of.len(), progress, |v| kept[part_of[v] as usize])?;
        compact(&mut surface, &keep, progress)?;
        passes::retain(&mut part_of, progress, |v, _| keep[v])?;
    }
    progress.lap("components");
    refuse_nothing(&surface, report.voxel, min_share)?;
    report.grid = (size / report.voxel).ceil().to_array().map(|cells| cells as u64);
    report.working_bytes = report.working_bytes.max(surface.bytes());
    dump::parts(&surface, &part_of)?;
    Ok(Kept { surface, parts: parts.list, part_of, size })
}

/// Parts and faces that were dropped.
pub struct Dropped {
    /// Number of parts.
    pub components: u64,
    /// Number of faces they had.
    pub faces: u64,
}

/// Which of the parts that are kept have fewer than `min_share` of the triangles of the largest of them.
fn small(parts: &[Part], is_kept: &[bool], min_share: f64) -> Vec<bool> {
    let kept = || parts.iter().zip(is_kept).filter(|part| *part.1).map(|part| part.0.faces);
    let least = min_share * kept().max().unwrap_or(0) as f64;
    parts.iter().zip(is_kept).map(|(part, &is_kept)| is_kept && (part.faces as f64) < least).collect()
}

/// Size of the bounding box of the parts that are kept.
fn extent(parts: &[Part], is_kept: &[bool]) -> DVec3 {
    let kept = parts.iter().zip(is_kept).filter(|part| *part.1).map(|part| part.0);
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = kept.fold(none, |(low, high), part| (low.min(part.low), high.max(part.high)));
    (high - low).max(DVec3::ZERO)
}

/// Drops connected parts with fewer than `min_share` of the triangles of the largest part, and vertices without a triangle.
pub fn drop_small(surface: &mut Surface, min_share: f64, progress: &Progress<'_>) -> Result<Dropped> {
    let part_of = connected::parts(surface.positions.len(), &surface.triangles, progress)?;
    let faces = faces(&part_of, &surface.triangles, progress)?;
    let largest = faces.iter().copied().max().unwrap_or(0);
    let least = min_share * f64::from(largest);
    let mut dropped = Dropped { components: 0, faces: 0 };
    for &f in &faces {
        if f > 0 && f64::from(f) < least {
            dropped.components += 1;
            dropped.faces += u64::from(f);
        }
    }
    let keep = passes::made(part_of.len(), progress, |v| {
        let f = faces[part_of[v] as usize];
        f > 0 && f64::from(f) >= least
    })?;
    if keep.iter().any(|&k| !k) {
        compact(surface, &keep, progress)?;
    }
    Ok(dropped)
}

/// Keeps the vertices that are to be kept, and the triangles between them.
fn compact(surface: &mut Surface, keep: &[bool], progress: &Progress<'_>) -> Result<()> {
    let mut next = 0;
    let number = passes::made(keep.len(), progress, |v| {
        next += u32::from(keep[v]);
        // Of those that go nobody asks.
        next.wrapping_sub(1)
    })?;
    passes::retain(&mut surface.positions, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.confidence, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.noise, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.colour, progress, |v, _| keep[v])?;
    passes::retain(&mut surface.scan, progress, |v, _| keep[v])?;
    let Surface { triangles, cases, .. } = surface;
    passes::retain(cases, progress, |t, _| keep[triangles[t][0] as usize])?;
    passes::retain(triangles, progress, |_, t| keep[t[0] as usize])?;
    passes::each(triangles.len(), progress, |t| triangles[t] = triangles[t].map(|v| number[v as usize]))?;
    surface.boundary.retain(|side| keep[side[0] as usize]);
    surface.boundary.iter_mut().for_each(|side| *side = side.map(|v| number[v as usize]));
    Ok(())
}
