//! Stage 8: connected parts of the surface; small ones are dropped where that is asked for.

use glam::DVec3;

use super::connected::{faces, parts};
use super::extract::Surface;
use super::parts::Part;
use super::passes;
use base::error::Result;
use base::progress::Progress;

/// Parts and faces that were dropped.
pub struct Dropped {
    /// Number of parts.
    pub components: u64,
    /// Number of faces they had.
    pub faces: u64,
}

/// Which of the parts that are kept have fewer than `min_share` of the triangles of the largest of them.
pub fn small(parts: &[Part], is_kept: &[bool], min_share: f64) -> Vec<bool> {
    let kept = || parts.iter().zip(is_kept).filter(|part| *part.1).map(|part| part.0.faces);
    let least = min_share * kept().max().unwrap_or(0) as f64;
    parts.iter().zip(is_kept).map(|(part, &is_kept)| is_kept && (part.faces as f64) < least).collect()
}

/// Size of the bounding box of the parts that are kept.
pub fn extent(parts: &[Part], is_kept: &[bool]) -> DVec3 {
    let kept = parts.iter().zip(is_kept).filter(|part| *part.1).map(|part| part.0);
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = kept.fold(none, |(low, high), part| (low.min(part.low), high.max(part.high)));
    (high - low).max(DVec3::ZERO)
}

/// Drops connected parts with fewer than `min_share` of the triangles of the largest part, and vertices without a triangle.
pub fn drop_small(surface: &mut Surface, min_share: f64, progress: &Progress<'_>) -> Result<Dropped> {
    let part_of = parts(surface.positions.len(), &surface.triangles, progress)?;
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
pub fn compact(surface: &mut Surface, keep: &[bool], progress: &Progress<'_>) -> Result<()> {
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
