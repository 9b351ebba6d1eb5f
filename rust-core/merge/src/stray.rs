//! Stage 8: connected parts that are no evidence of a surface of their own.
//!
//! Where scans of a place lie further apart than they are merged, or their noise leaves single crossings behind, blobs
//! float between the layers. Only one of their sides is what a scan saw: many of their vertices lie on no scan. A part
//! goes if that is so, or if all of it is noise, and if it is as small as what surrounds a node of the grid, or lies
//! everywhere near a larger part; noise that faces away from that is the other side of a sheet and stays. What scans saw
//! and what is apart from other surfaces is kept, however small.

use std::cmp::Ordering;

use glam::Vec3;
use rustc_hash::FxHashMap;

use super::parts::{Part, Parts};
use super::passes;
use super::tiles::{Index, Tile};
use base::error::Result;
use base::progress::Progress;

/// Parts with at most this many triangles, about as many as the cells around a node hold, surround it.
const STRAY: u64 = 24;
/// Largest share of the vertices of a part that lie on no scan, where scans saw it: along borders.
const UNSEEN: f64 = 0.25;
/// Near a larger part is what lies within the distance of merging, so many cells ...
const NEAR: f64 = 2.0;
/// ... and so many standard deviations of the samples.
const DEVIATIONS: f64 = 3.0;
/// Noise counts up to so many cells, which bounds the search.
const MOST_CELLS: f64 = 4.0;
/// Normals and cosines are added up in whole numbers of this unit, so that their order can't matter.
const UNIT: f32 = 1.0 / (1 << 20) as f32;

impl Part {
    fn is_unseen(&self) -> bool {
        self.unseen as f64 > UNSEEN * self.vertices as f64
    }

    fn is_doubtful(&self) -> bool {
        self.faces > 0 && (self.noisy == self.vertices || self.is_unseen())
    }
}

/// What lies around a part.
#[derive(Clone, Copy, Default)]
struct Surroundings {
    /// Whether a vertex of it is known that is near no larger part.
    is_apart: bool,
    /// Sum of the cosines between its normals and those of the nearest vertices of larger parts.
    facing: i64,
}

/// Which parts go; the largest always stays. `reach` is the distance of merging in cells. O(vertices).
///
/// # Errors
/// Cancelled.
pub fn stray(tiles: &[Tile], parts: &Parts, voxel: f64, reach: f64, progress: &Progress<'_>) -> Result<Vec<bool>> {
    let largest = parts.list.iter().map(|part| part.faces).max().unwrap_or(0);
    let searched: Vec<bool> =
        (parts.list.iter()).map(|part| part.is_doubtful() && part.faces > STRAY && part.faces < largest).collect();
    let found = surroundings(tiles, parts, &searched, voxel, reach, progress)?;
    let is_double = |part: &Part, around: &Surroundings| !around.is_apart && (part.is_unseen() || around.facing > 0);
    let goes = |(part, around): (&Part, &Surroundings)| {
        part.is_doubtful() && part.faces < largest && (part.faces <= STRAY || is_double(part, around))
    };
    Ok(parts.list.iter().zip(&found).map(goes).collect())
}

/// What lies around those parts that are searched.
fn surroundings(
    tiles: &[Tile],
    parts: &Parts,
    searched: &[bool],
    voxel: f64,
    reach: f64,
    progress: &Progress<'_>,
) -> Result<Vec<Surroundings>> {
    let mut found = vec![Surroundings::default(); parts.list.len()];
    // Buckets as large as the search reaches, of the surroundings of doubtful parts.
    let most = |noise: f64| (reach + NEAR + DEVIATIONS * noise.min(MOST_CELLS)) * voxel;
    let bucket = most(MOST_CELLS);
    let key = |tile: usize, v: usize| (tiles[tile].surface.positions[v] / bucket).floor().to_array().map(|x| x as i64);
    let part_of = |tile: usize, v: usize| parts.of[tile][v] as usize;
    let mut near: FxHashMap<[i64; 3], Vec<[u32; 2]>> = FxHashMap::default();
    each_own(tiles, progress, |tile, v| {
        if searched[part_of(tile, v)] {
            for key in around(key(tile, v)) {
                near.entry(key).or_default();
            }
        }
    })?;
    if near.is_empty() {
        return Ok(found);
    }
    each_own(tiles, progress, |tile, v| {
        if let Some(list) = near.get_mut(&key(tile, v)) {
            list.push([tile as u32, v as u32]);
        }
    })?;
    let normals = normals(tiles, progress)?;
    each_own(tiles, progress, |tile, v| {
        let part = part_of(tile, v);
        if !searched[part] || found[part].is_apart {
            return;
        }
        let surface = &tiles[tile].surface;
        // Of equally large ones the one that begins later.
        let own = (parts.list[part].faces, part);
        let is_larger = |[tile, v]: [usize; 2]| {
            let other = part_of(tile, v);
            (parts.list[other].faces, other) > own
        };
        let place = |[tile, v]: [usize; 2]| tiles[tile].surface.positions[v];
        let others = around(key(tile, v)).filter_map(|key| near.get(&key)).flatten().map(|at| at.map(|i| i as usize));
        let distances =
            others.filter(|at| is_larger(*at)).map(|at| (surface.positions[v].distance_squared(place(at)), at));
        // Of equally near ones, too, the place decides.
        let by_place = |a: [usize; 2], b: [usize; 2]| {
            let [a, b] = [a, b].map(|at| place(at).to_array());
            (0..3).map(|i| a[i].total_cmp(&b[i])).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
        };
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| by_place(a.1, b.1)));
        let within = most(f64::from(surface.noise[v]) / voxel);
        match nearest.filter(|nearest| nearest.0 <= within.powi(2)) {
            Some((_, [other, at])) => found[part].facing += (normals[tile][v].dot(normals[other][at]) / UNIT) as i64,
            None => found[part].is_apart = true,
        }
    })?;
    Ok(found)
}

/// Calls `each` with the tiles' own vertices.
fn each_own(tiles: &[Tile], progress: &Progress<'_>, mut each: impl FnMut(usize, usize)) -> Result<()> {
    tiles.iter().enumerate().try_for_each(|(i, tile)| passes::each(tile.own, progress, |v| each(i, v)))
}

/// Unit normals of the vertices of all tiles.
fn normals(tiles: &[Tile], progress: &Progress<'_>) -> Result<Vec<Vec<Vec3>>> {
    let mut sums = Vec::new();
    for tile in tiles {
        let surface = &tile.surface;
        let mut of_tile = passes::filled([0_i32; 3], surface.positions.len(), progress)?;
        passes::each(surface.triangles.len(), progress, |t| {
            let [a, b, c] = surface.triangles[t].map(|v| surface.positions[v as usize]);
            let normal = ((b - a).cross(c - a).normalize_or_zero().as_vec3() / UNIT).to_array().map(|x| x as i32);
            for &v in &surface.triangles[t] {
                (0..3).for_each(|i| of_tile[v as usize][i] += normal[i]);
            }
        })?;
        sums.push(of_tile);
    }
    // Triangles of a tile at vertices of another.
    let index = Index::new(tiles);
    for (i, tile) in tiles.iter().enumerate() {
        for (at, key) in tile.foreign.iter().enumerate() {
            let [owner, v] = index.find(key);
            let more = sums[i][tile.own + at];
            (0..3).for_each(|axis| sums[owner][v][axis] += more[axis]);
        }
    }
    let unit = |sum: &[i32; 3]| Vec3::from_array(sum.map(|x| x as f32)).normalize_or_zero();
    sums.iter().map(|of_tile| passes::made(of_tile.len(), progress, |v| unit(&of_tile[v]))).collect()
}

/// A bucket and its neighbours.
fn around([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1])
}
