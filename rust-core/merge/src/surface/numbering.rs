//! Numbers of vertices and triangles of tiles in the whole surface: bricks in order, then the vertices that were split off.

use std::borrow::Cow;

use rustc_hash::FxHashMap;

use super::parts::Chosen;
use super::tile::{Tile, Tiles, VertexKey};
use base::error::Result;
use base::progress::Progress;

/// No part, or no place.
pub const NONE: u32 = u32::MAX;
/// The number of a vertex or triangle that goes.
pub const GONE: u64 = u64::MAX;

/// The numbers of all that is kept.
pub struct Numbers {
    /// Nothing where there is one tile, of which all is kept.
    of: Option<FxHashMap<[i32; 3], Brick>>,
    /// Vertices.
    pub vertices: u64,
    /// Triangles.
    pub triangles: u64,
}

/// Numbers of a brick.
#[derive(Default)]
struct Brick {
    vertices: u32,
    /// Its vertices that go, rising.
    gone: Vec<u32>,
    first_vertex: u64,
    /// Those split off that are kept: from which, and which of these.
    copies: Vec<[u32; 2]>,
    first_copy: u64,
    triangles: u32,
    first_triangle: u64,
}

/// A tile with the numbers of its vertices and triangles.
pub struct Numbered<'a> {
    /// The tile.
    pub tile: Cow<'a, Tile>,
    /// Of each vertex and each triangle. Nothing where they have those of the tile.
    numbers: Option<[Vec<u64>; 2]>,
}

impl Numbered<'_> {
    /// The number of a vertex. [`GONE`] of one that goes.
    pub fn vertex(&self, v: usize) -> u64 {
        self.numbers.as_ref().map_or(v as u64, |[vertices, _]| vertices[v])
    }

    /// The number of a triangle. `None` of one that goes.
    pub fn triangle(&self, t: usize) -> Option<u64> {
        let Some([_, triangles]) = &self.numbers else { return Some(t as u64) };
        Some(triangles[t]).filter(|&number| number != GONE)
    }
}

impl Numbers {
    /// Numbers what is chosen.
    ///
    /// # Errors
    /// A tile can't be read. Cancelled.
    pub fn new(tiles: &impl Tiles, chosen: &Chosen, progress: &Progress<'_>) -> Result<Self> {
        if tiles.count() == 1 && !chosen.kept.contains(&false) {
            let tile = tiles.get(0)?;
            let triangles = tile.surface.triangles.len() as u64;
            return Ok(Numbers { of: None, vertices: tile.own as u64, triangles });
        }
        Self::by_bricks(tiles, chosen, progress)
    }

    fn by_bricks(tiles: &impl Tiles, chosen: &Chosen, progress: &Progress<'_>) -> Result<Self> {
        let mut of: FxHashMap<[i32; 3], Brick> = FxHashMap::default();
        for i in 0..tiles.count() {
            progress.check()?;
            let tile = tiles.get(i)?;
            let is_kept = |v: usize| chosen.is_kept(i, tile.part_of[v]);
            let (mut triangle, mut copy) = (0, tile.own - tile.copied.len());
            for (share, &first) in tile.shares.iter().zip(&tile.first) {
                let gone = (0..share.vertices).filter(|&v| !is_kept((first + v) as usize)).collect();
                let of_share = triangle..triangle + share.triangles as usize;
                triangle = of_share.end;
                let triangles = of_share.filter(|&t| is_kept(tile.surface.triangles[t][0] as usize)).count() as u32;
                let mut copies = Vec::new();
                for v in copy..copy + share.copies as usize {
                    let key = tile.key(v as u32);
                    if is_kept(v) {
                        copies.push([key.number, key.copy]);
                    }
                }
                copy += share.copies as usize;
                of.insert(share.brick, Brick { vertices: share.vertices, gone, copies, triangles, ..Brick::default() });
            }
        }
        let mut order: Vec<[i32; 3]> = of.keys().copied().collect();
        order.sort_unstable();
        let (mut vertices, mut triangles) = (0_u64, 0_u64);
        for brick in &order {
            let brick = of.get_mut(brick).expect("its key is from there");
            (brick.first_vertex, brick.first_triangle) = (vertices, triangles);
            vertices += u64::from(brick.vertices) - brick.gone.len() as u64;
            triangles += u64::from(brick.triangles);
        }
        for brick in &order {
            let brick = of.get_mut(brick).expect("its key is from there");
            brick.first_copy = vertices;
            vertices += brick.copies.len() as u64;
        }
        Ok(Numbers { of: Some(of), vertices, triangles })
    }

    /// Numbers a tile.
    pub fn of_tile<'a>(&self, i: usize, tile: Cow<'a, Tile>, chosen: &Chosen) -> Numbered<'a> {
        let numbers = self.of.as_ref().map(|of| by_bricks(of, &tile, |v| chosen.is_kept(i, tile.part_of[v])));
        Numbered { tile, numbers }
    }
}

#[cfg(test)]
impl Numbers {
    /// As if bricks with so many vertices and triangles came before all others.
    pub fn after(others: u64, tiles: &impl Tiles, chosen: &Chosen) -> Self {
        let mut numbers = Self::by_bricks(tiles, chosen, &Progress::none()).unwrap();
        for brick in numbers.of.as_mut().unwrap().values_mut() {
            brick.first_vertex += others;
            brick.first_copy += others;
            brick.first_triangle += others;
        }
        Numbers { vertices: numbers.vertices + others, triangles: numbers.triangles + others, ..numbers }
    }
}

impl Brick {
    /// The number of a vertex of it that is kept.
    fn vertex(&self, key: &VertexKey) -> u64 {
        if key.is_copy {
            return self.first_copy + self.copies.partition_point(|copy| *copy < [key.number, key.copy]) as u64;
        }
        self.first_vertex + u64::from(key.number) - self.gone.partition_point(|&gone| gone < key.number) as u64
    }
}

/// Numbers of a tile's vertices and triangles. [`GONE`] of those that go.
fn by_bricks(of: &FxHashMap<[i32; 3], Brick>, tile: &Tile, is_kept: impl Fn(usize) -> bool) -> [Vec<u64>; 2] {
    let split_off = tile.own - tile.copied.len();
    let mut vertices = vec![GONE; tile.surface.positions.len()];
    let mut triangles = vec![GONE; tile.surface.triangles.len()];
    let mut triangle = 0;
    for (share, &first) in tile.shares.iter().zip(&tile.first) {
        let brick = &of[&share.brick];
        let own = (first..first + share.vertices).map(|v| v as usize).filter(|&v| is_kept(v));
        own.zip(brick.first_vertex..).for_each(|(v, number)| vertices[v] = number);
        let of_share = triangle..triangle + share.triangles as usize;
        triangle = of_share.end;
        let kept = of_share.filter(|&t| is_kept(tile.surface.triangles[t][0] as usize));
        kept.zip(brick.first_triangle..).for_each(|(t, number)| triangles[t] = number);
    }
    // Split off, then of other tiles.
    for v in (split_off..vertices.len()).filter(|&v| is_kept(v)) {
        let key = tile.key(v as u32);
        vertices[v] = of[&key.brick].vertex(&key);
    }
    [vertices, triangles]
}
