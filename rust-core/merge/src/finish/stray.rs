//! Stage 8: connected parts that are no evidence of a surface of their own.
//!
//! Blobs float between the layers if scans of a place lie further apart than they are merged, or if their noise leaves single crossings
//! behind. A scan saw only one of their sides: many of their vertices lie on no scan. A part goes if that is so, or if all of it is noise.
//! It also has to be as small as the surroundings of a node of the grid, or to lie everywhere near a larger part. Noise that faces away
//! from that is the other side of a sheet and stays. A part that scans saw and that is apart from other surfaces is kept, however small.

use std::cmp::Ordering;

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::surface::parts::Parts;
use crate::surface::passes;
use crate::surface::tile::Part;
use crate::surface::tile::{Tile, Tiles, VertexKey};
use base::error::Result;
use base::progress::Progress;
use mesh::holes::Bounds;

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

/// Surroundings of a part.
#[derive(Clone, Copy, Default)]
struct Surroundings {
    /// Whether a vertex of it is known that is near no larger part.
    is_apart: bool,
    /// Sum of the cosines between its normals and those of the nearest vertices of larger parts.
    facing: i64,
}

/// Parts that go. The largest always stays. `reach` is the distance of merging in cells. O(vertices).
///
/// # Errors
/// A tile can't be read. Cancelled.
pub fn stray<T: Tiles>(tiles: &T, parts: &Parts, voxel: f64, reach: f64, progress: &Progress<'_>) -> Result<Vec<bool>> {
    let largest = parts.list.iter().map(|part| part.faces).max().unwrap_or(0);
    let searched: Vec<bool> =
        (parts.list.iter()).map(|part| part.is_doubtful() && part.faces > STRAY && part.faces < largest).collect();
    let found = Search { tiles, parts, searched: &searched, voxel, reach }.surroundings(progress)?;
    let is_double = |part: &Part, around: &Surroundings| !around.is_apart && (part.is_unseen() || around.facing > 0);
    let goes = |(part, around): (&Part, &Surroundings)| {
        part.is_doubtful() && part.faces < largest && (part.faces <= STRAY || is_double(part, around))
    };
    Ok(parts.list.iter().zip(&found).map(goes).collect())
}

/// A search for what lies around some parts.
struct Search<'a, T> {
    tiles: &'a T,
    parts: &'a Parts,
    searched: &'a [bool],
    voxel: f64,
    reach: f64,
}

/// A vertex that others are near to.
struct Near {
    place: DVec3,
    normal: Vec3,
    part: usize,
}

impl<T: Tiles> Search<'_, T> {
    /// Surroundings of the parts that are searched.
    fn surroundings(&self, progress: &Progress<'_>) -> Result<Vec<Surroundings>> {
        let mut found = vec![Surroundings::default(); self.parts.list.len()];
        if !self.searched.contains(&true) {
            return Ok(found);
        }
        let sums = self.sums_of_others(progress)?;
        let boxes: Vec<Bounds> =
            (0..self.tiles.count()).map(|i| Ok(bounds(&*self.tiles.get(i)?))).collect::<Result<_>>()?;
        for i in 0..self.tiles.count() {
            progress.check()?;
            if self.parts.of[i].iter().any(|&part| self.searched[part as usize]) {
                self.around_tile(i, &boxes, &sums, &mut found, progress)?;
            }
        }
        Ok(found)
    }

    /// Distance from a vertex of this noise, in world units, within which a larger part is near.
    fn within(&self, noise: f64) -> f64 {
        (self.reach + NEAR + DEVIATIONS * noise.min(MOST_CELLS)) * self.voxel
    }

    /// Buckets are as large as the search reaches.
    fn bucket(&self, place: DVec3) -> [i64; 3] {
        (place / self.within(MOST_CELLS)).floor().to_array().map(|x| x as i64)
    }

    fn part(&self, tile: usize, part: u32) -> usize {
        self.parts.of[tile][part as usize] as usize
    }

    /// Surroundings of the vertices of a tile.
    fn around_tile(
        &self,
        own: usize,
        boxes: &[Bounds],
        sums: &FxHashMap<VertexKey, [i32; 3]>,
        found: &mut [Surroundings],
        progress: &Progress<'_>,
    ) -> Result<()> {
        let tile = self.tiles.get(own)?;
        let surface = &tile.surface;
        let mut near: FxHashMap<[i64; 3], Vec<Near>> = FxHashMap::default();
        let mut reached = Bounds::of([]);
        passes::each(tile.own, progress, |v| {
            if self.searched[self.part(own, tile.part_of[v])] {
                near.extend(around(self.bucket(surface.positions[v])).map(|key| (key, Vec::new())));
                reached.add(surface.positions[v]);
            }
        })?;
        if near.is_empty() {
            return Ok(());
        }
        let reached = reached.grown(2.0 * self.within(MOST_CELLS));
        for other in (0..boxes.len()).filter(|&other| boxes[other].meets(&reached)) {
            let tile = self.tiles.get(other)?;
            let normals = normals(&tile, sums, progress)?;
            passes::each(tile.own, progress, |v| {
                let place = tile.surface.positions[v];
                if let Some(list) = near.get_mut(&self.bucket(place)) {
                    list.push(Near { place, normal: normals[v], part: self.part(other, tile.part_of[v]) });
                }
            })?;
        }
        let own_normals = normals(&tile, sums, progress)?;
        passes::each(tile.own, progress, |v| {
            let (part, place) = (self.part(own, tile.part_of[v]), surface.positions[v]);
            if !self.searched[part] || found[part].is_apart {
                return;
            }
            // Of equally large ones the one that begins later.
            let size = |part: usize| (self.parts.list[part].faces, part);
            let others = around(self.bucket(place)).filter_map(|key| near.get(&key)).flatten();
            let larger = others.filter(|other| size(other.part) > size(part));
            let distances = larger.map(|other| (place.distance_squared(other.place), other));
            // Of equally near ones, too, the place decides.
            let by_place = |a: &Near, b: &Near| {
                let [a, b] = [a, b].map(|of| of.place.to_array());
                (0..3).map(|i| a[i].total_cmp(&b[i])).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
            };
            let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0).then_with(|| by_place(a.1, b.1)));
            let within = self.within(f64::from(surface.noise[v]) / self.voxel);
            match nearest.filter(|nearest| nearest.0 <= within.powi(2)) {
                Some((_, other)) => found[part].facing += (own_normals[v].dot(other.normal) / UNIT) as i64,
                None => found[part].is_apart = true,
            }
        })
    }

    /// Of vertices that tiles share, the sums of the normals of triangles of other tiles.
    fn sums_of_others(&self, progress: &Progress<'_>) -> Result<FxHashMap<VertexKey, [i32; 3]>> {
        let mut all: FxHashMap<VertexKey, [i32; 3]> = FxHashMap::default();
        for i in 0..self.tiles.count() {
            let tile = self.tiles.get(i)?;
            if tile.foreign.is_empty() {
                continue;
            }
            let sums = sums(&tile, progress)?;
            for (key, more) in tile.foreign.iter().zip(&sums[tile.own..]) {
                let sum = all.entry(*key).or_default();
                (0..3).for_each(|axis| sum[axis] += more[axis]);
            }
        }
        Ok(all)
    }
}

/// The box of a tile's own vertices.
fn bounds(tile: &Tile) -> Bounds {
    Bounds::of(tile.surface.positions[..tile.own].iter().copied())
}

/// Sums of the unit normals of a tile's triangles at each vertex.
fn sums(tile: &Tile, progress: &Progress<'_>) -> Result<Vec<[i32; 3]>> {
    let surface = &tile.surface;
    let mut sums = passes::filled([0_i32; 3], surface.positions.len(), progress)?;
    passes::each(surface.triangles.len(), progress, |t| {
        let [a, b, c] = surface.triangles[t].map(|v| surface.positions[v as usize]);
        let normal = ((b - a).cross(c - a).normalize_or_zero().as_vec3() / UNIT).to_array().map(|x| x as i32);
        for &v in &surface.triangles[t] {
            (0..3).for_each(|i| sums[v as usize][i] += normal[i]);
        }
    })?;
    Ok(sums)
}

/// Unit normals of a tile's own vertices. `others` are sums of the normals of triangles of other tiles.
fn normals(tile: &Tile, others: &FxHashMap<VertexKey, [i32; 3]>, progress: &Progress<'_>) -> Result<Vec<Vec3>> {
    let mut sums = sums(tile, progress)?;
    for &v in &tile.shared {
        if let Some(more) = others.get(&tile.key(v)) {
            (0..3).for_each(|axis| sums[v as usize][axis] += more[axis]);
        }
    }
    passes::made(tile.own, progress, |v| Vec3::from_array(sums[v].map(|x| x as f32)).normalize_or_zero())
}

/// A bucket and its neighbours.
fn around([x, y, z]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (0..27).map(move |i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1])
}
