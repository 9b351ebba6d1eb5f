//! Stage 8: connected parts that are no evidence of a surface of their own.
//!
//! Where scans of a place lie further apart than they are merged, or their noise leaves single crossings behind, blobs
//! float between the layers. Only one of their sides is what a scan saw: many of their vertices lie on no scan. A part
//! goes if that is so, or if all of it is noise, and if it is as small as what surrounds a node of the grid, or lies
//! everywhere near a larger part; noise that faces away from that is the other side of a sheet and stays. What scans saw
//! and what is apart from other surfaces is kept, however small.

use glam::Vec3;
use rustc_hash::FxHashMap;

use super::components::{Dropped, compact, faces, parts};
use super::extract::Surface;
use super::passes;
use base::error::Result;
use base::progress::Progress;

/// Parts with at most this many triangles, about as many as the cells around a node hold, surround it.
const STRAY: u32 = 24;
/// Largest share of the vertices of a part that lie on no scan, where scans saw it: along borders.
const UNSEEN: f64 = 0.25;
/// Near a larger part is what lies within the distance of merging, so many cells ...
const NEAR: f64 = 2.0;
/// ... and so many standard deviations of the samples.
const DEVIATIONS: f64 = 3.0;
/// Noise counts up to so many cells, which bounds the search.
const MOST_CELLS: f64 = 4.0;

/// What is known of a part, by its lowest vertex.
#[derive(Clone, Copy, Default)]
struct Part {
    faces: u32,
    vertices: u32,
    /// Vertices on no scan, and noisy ones.
    unseen: u32,
    noisy: u32,
    /// Whether a vertex of it is known that is near no larger part.
    is_apart: bool,
    /// Sum of the cosines between its normals and those of the nearest vertices of larger parts.
    facing: f64,
}

impl Part {
    fn is_unseen(&self) -> bool {
        f64::from(self.unseen) > UNSEEN * f64::from(self.vertices)
    }

    fn is_doubtful(&self) -> bool {
        self.faces > 0 && (self.noisy == self.vertices || self.is_unseen())
    }
}

/// Drops them; the largest part always stays. `reach` is the distance of merging in cells. O(vertices).
pub fn drop_stray(surface: &mut Surface, voxel: f64, reach: f64, progress: &Progress<'_>) -> Result<Dropped> {
    let vertices = surface.positions.len();
    let part_of = parts(vertices, &surface.triangles, progress)?;
    let faces = faces(&part_of, &surface.triangles, progress)?;
    let largest = faces.iter().copied().max().unwrap_or(0);
    let mut known = passes::made(vertices, progress, |v| Part { faces: faces[v], ..Part::default() })?;
    drop(faces);
    passes::each(vertices, progress, |v| {
        let part = &mut known[part_of[v] as usize];
        part.vertices += 1;
        part.unseen += u32::from(surface.scan[v] < 0);
        part.noisy += u32::from(surface.noise[v] > 0.0);
    })?;
    // Buckets as large as the search reaches, of the surroundings of doubtful parts.
    let most = |noise: f64| (reach + NEAR + DEVIATIONS * noise.min(MOST_CELLS)) * voxel;
    let within = |v: usize| most(f64::from(surface.noise[v]) / voxel);
    let bucket = most(MOST_CELLS);
    let key = |v: usize| (surface.positions[v] / bucket).floor().to_array().map(|x| x as i64);
    let is_searched = |part: &Part| part.is_doubtful() && part.faces > STRAY && part.faces < largest;
    let mut near: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
    passes::each(vertices, progress, |v| {
        if is_searched(&known[part_of[v] as usize]) {
            for key in around(key(v)) {
                near.entry(key).or_default();
            }
        }
    })?;
    passes::each(vertices, progress, |v| {
        if let Some(list) = near.get_mut(&key(v)) {
            list.push(v as u32);
        }
    })?;
    let normals = if near.is_empty() { Vec::new() } else { normals(surface, progress)? };
    passes::each(vertices, progress, |v| {
        let part = &known[part_of[v] as usize];
        if !is_searched(part) || part.is_apart {
            return;
        }
        let own = (part.faces, part_of[v]);
        let is_larger = |other: &u32| (known[part_of[*other as usize] as usize].faces, part_of[*other as usize]) > own;
        let off = |other: u32| surface.positions[v].distance_squared(surface.positions[other as usize]);
        let others = around(key(v)).filter_map(|key| near.get(&key)).flatten().copied();
        let nearest = others.filter(is_larger).map(|other| (off(other), other)).min_by(|a, b| a.0.total_cmp(&b.0));
        let part = &mut known[part_of[v] as usize];
        match nearest.filter(|nearest| nearest.0 <= within(v).powi(2)) {
            Some((_, other)) => part.facing += f64::from(normals[v].dot(normals[other as usize])),
            None => part.is_apart = true,
        }
    })?;
    let is_double = |part: &Part| !part.is_apart && (part.is_unseen() || part.facing > 0.0);
    let goes = |part: &Part| part.is_doubtful() && part.faces < largest && (part.faces <= STRAY || is_double(part));
    let mut dropped = Dropped { components: 0, faces: 0 };
    passes::each(vertices, progress, |v| {
        if goes(&known[v]) {
            dropped.components += 1;
            dropped.faces += u64::from(known[v].faces);
        }
    })?;
    if dropped.components > 0 {
        let keep = passes::made(vertices, progress, |v| !goes(&known[part_of[v] as usize]))?;
        compact(surface, &keep, progress)?;
    }
    Ok(dropped)
}

/// Unit normals of the vertices.
fn normals(surface: &Surface, progress: &Progress<'_>) -> Result<Vec<Vec3>> {
    let mut normals = passes::filled(Vec3::ZERO, surface.positions.len(), progress)?;
    passes::each(surface.triangles.len(), progress, |t| {
        let [a, b, c] = surface.triangles[t].map(|v| surface.positions[v as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        surface.triangles[t].iter().for_each(|&v| normals[v as usize] += normal);
    })?;
    passes::each(normals.len(), progress, |v| normals[v] = normals[v].normalize_or_zero())?;
    Ok(normals)
}

/// A bucket and its neighbours.
fn around([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1])
}
