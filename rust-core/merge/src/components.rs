//! Stage 8: connected parts of the surface; small ones are dropped where that is asked for.

use glam::DVec3;

use super::extract::Surface;
use super::parts::{self, Parts};
use super::tile::Part;
use super::tile::{Tile, Tiles};
use super::{MergeReport, dump, join, passes, refuse_nothing, stray};
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
    mut tiles: Vec<Tile>,
    reach: f64,
    min_share: f64,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<Kept> {
    let Chosen { parts, kept, size } = choose(&tiles[..], reach, min_share, report, progress)?;
    let mut of_vertex: Vec<Vec<u32>> = tiles.iter_mut().map(|tile| std::mem::take(&mut tile.part_of)).collect();
    for (part_of, of) in of_vertex.iter_mut().zip(&parts.of) {
        passes::each(part_of.len(), progress, |v| part_of[v] = of[part_of[v] as usize])?;
    }
    let (mut surface, mut part_of) = join::join(tiles, of_vertex, progress)?;
    if kept.contains(&false) {
        let keep = passes::made(part_of.len(), progress, |v| kept[part_of[v] as usize])?;
        compact(&mut surface, &keep, progress)?;
        passes::retain(&mut part_of, progress, |v, _| keep[v])?;
    }
    progress.lap("components");
    refuse_nothing(surface.triangles.len() as u64, report.voxel, min_share)?;
    report.working_bytes = report.working_bytes.max(surface.bytes());
    dump::parts(&surface, &part_of)?;
    Ok(Kept { surface, parts: parts.list, part_of, size })
}

/// The parts of the surface, and which of them are kept.
pub struct Chosen {
    /// All parts.
    pub parts: Parts,
    /// Whether each is kept.
    pub kept: Vec<bool>,
    /// Size of the bounding box of these.
    pub size: DVec3,
}

impl Chosen {
    /// Which of all parts a part of a tile is.
    pub fn part(&self, tile: usize, part: u32) -> u32 {
        self.parts.of[tile][part as usize]
    }

    /// Whether a part of a tile is kept.
    pub fn is_kept(&self, tile: usize, part: u32) -> bool {
        self.kept[self.part(tile, part) as usize]
    }
}

/// Decides which parts are kept, and says of the others in the report.
///
/// # Errors
/// A tile can't be read; cancelled.
pub fn choose<T: Tiles + ?Sized>(
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

/// Drops vertices without a triangle.
///
/// # Errors
/// Cancelled.
pub fn drop_vertices(surface: &mut Surface, bare: &[u32], progress: &Progress<'_>) -> Result<()> {
    let mut keep = passes::filled(true, surface.positions.len(), progress)?;
    bare.iter().for_each(|&v| keep[v as usize] = false);
    compact(surface, &keep, progress)
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
