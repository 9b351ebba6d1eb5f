//! Ambient occlusion: how much of the sky over a place the detailed surface leaves open.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;
use geom::bvh::Ray;

use super::atlas::Texel;
use super::behind::{Detail, Place};
use super::relief::{across, in_square};

/// Texels a block, along rows and columns: occlusion is soft, and rays take long.
const BLOCK: u32 = 4;
/// Places between two checks.
const PACE: usize = 16;
/// Rays begin this share of the surface's size above it.
const ABOVE: f64 = 1e-4;

/// Ambient occlusion of the places, 255 where all is open. Rays start from one texel in each block of 4 x 4. The others take the mean of
/// what was found within two blocks where normals agree.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn occlusion(
    texels: &[Texel],
    places: &[Place],
    size: u32,
    detail: &Detail<'_>,
    rays: u32,
    progress: &Progress<'_>,
) -> Result<Vec<u8>> {
    let across_blocks = size.div_ceil(BLOCK);
    let block_of = |texel: &Texel| ((texel.place / size) / BLOCK, (texel.place % size) / BLOCK);
    let mut first = vec![u32::MAX; (across_blocks * across_blocks) as usize];
    for (i, texel) in texels.iter().enumerate() {
        let (row, column) = block_of(texel);
        let there = &mut first[(row * across_blocks + column) as usize];
        *there = (*there).min(i as u32);
    }
    let reach = detail.mesh.positions.iter().map(|p| p.distance(detail.origin)).fold(0.0, f64::max);
    let chosen: Vec<u32> = first.iter().copied().filter(|&i| i != u32::MAX).collect();
    let of_chunk = |chunk: &[u32]| {
        progress.check()?;
        Ok(chunk.iter().map(|&i| (i, open(&places[i as usize], i, detail, rays, reach))).collect::<Vec<_>>())
    };
    let found: Vec<Vec<(u32, f32)>> = chosen.par_chunks(PACE).map(of_chunk).collect::<Result<_>>()?;
    let mut share = vec![f32::NAN; first.len()];
    for (i, open) in found.into_iter().flatten() {
        let (row, column) = block_of(&texels[i as usize]);
        share[(row * across_blocks + column) as usize] = open;
    }
    let smooth = |(texel, place): (&Texel, &Place)| {
        let (row, column) = block_of(texel);
        let (mut sum, mut weights) = (0.0, 0.0);
        for r in row.saturating_sub(2)..(row + 3).min(across_blocks) {
            for c in column.saturating_sub(2)..(column + 3).min(across_blocks) {
                let at = (r * across_blocks + c) as usize;
                if first[at] == u32::MAX {
                    continue;
                }
                let other = &places[first[at] as usize];
                let agree = (0..3).map(|k| place.normal[k] * other.normal[k]).sum::<f32>().max(0.0);
                let near = 1.0 / (1.0 + (r.abs_diff(row).pow(2) + c.abs_diff(column).pow(2)) as f32);
                let weight = near * agree.powi(8);
                (sum, weights) = (sum + weight * share[at], weights + weight);
            }
        }
        if weights > 0.0 { (255.0 * sum / weights).round() as u8 } else { 255 }
    };
    Ok(texels.par_iter().zip(places).map(smooth).collect())
}

/// Share of the sky that is open over a place, by rays as dense as the cosine.
fn open(place: &Place, turn: u32, detail: &Detail<'_>, rays: u32, reach: f64) -> f32 {
    let [point, normal] = [place.point, place.normal].map(|of| DVec3::from(of.map(f64::from)));
    if normal == DVec3::ZERO {
        return 1.0;
    }
    let origin = point + detail.origin + normal * (ABOVE * reach);
    let [u, v] = across(normal);
    // Neighbours look in other directions, and are averaged.
    let turned = f64::from(turn.wrapping_mul(0x9e37_79b9)) / f64::from(u32::MAX);
    let blocked = (0..rays).filter(|&i| {
        let at = in_square(i, rays);
        let (sin, cos) = (TAU * (at.y + turned)).sin_cos();
        let radius = at.x.sqrt();
        let direction = u * (radius * cos) + v * (radius * sin) + normal * (1.0 - at.x).max(0.0).sqrt();
        detail.bvh.first_hit(&Ray { origin, direction }, 0.0, 2.0 * reach).is_some()
    });
    1.0 - blocked.count() as f32 / rays as f32
}
