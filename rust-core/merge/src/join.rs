//! Tiles in memory put together to one surface.

use std::ops::Range;

use rustc_hash::FxHashMap;

use super::extract::{self, Surface};
use super::tile::{Tile, VertexKey};
use base::error::Result;
use base::progress::Progress;

/// Where vertices are, by what they are called everywhere.
struct Index<'a> {
    tiles: &'a [Tile],
    /// Tile and share of each brick.
    of: FxHashMap<[i32; 3], [u32; 2]>,
}

impl<'a> Index<'a> {
    /// Of all tiles. O(bricks).
    fn new(tiles: &'a [Tile]) -> Self {
        let bricks = |(i, tile): (usize, &'a Tile)| {
            tile.shares.iter().enumerate().map(move |(share, of)| (of.brick, [i as u32, share as u32]))
        };
        Index { tiles, of: tiles.iter().enumerate().flat_map(bricks).collect() }
    }

    /// The tile that a vertex is of, and its number there.
    fn find(&self, key: &VertexKey) -> [usize; 2] {
        let [i, share] = self.of[&key.brick].map(|i| i as usize);
        let tile = &self.tiles[i];
        let vertex = tile.first[share] + key.number;
        if !key.is_copy {
            return [i, vertex as usize];
        }
        let before = tile.copied.partition_point(|&other| other < vertex);
        [i, tile.own - tile.copied.len() + before + key.copy as usize - 1]
    }
}

/// The whole surface: vertices and triangles brick by brick, then the vertices that were split off; and for each vertex what
/// `of_vertex` has of it, a list for each tile.
///
/// # Errors
/// Cancelled; more vertices than there are numbers for.
pub fn join(
    mut tiles: Vec<Tile>,
    mut of_vertex: Vec<Vec<u32>>,
    progress: &Progress<'_>,
) -> Result<(Surface, Vec<u32>)> {
    if tiles.len() == 1 {
        return Ok((tiles.swap_remove(0).surface, of_vertex.swap_remove(0)));
    }
    let vertices: usize = tiles.iter().map(|tile| tile.own).sum();
    extract::refuse_many(vertices as u64)?;
    let mut shares: Vec<([i32; 3], usize, usize)> = (tiles.iter().enumerate())
        .flat_map(|(i, tile)| tile.shares.iter().enumerate().map(move |(share, of)| (of.brick, i, share)))
        .collect();
    shares.sort_unstable();

    let (mut whole, mut of_whole) = (Surface::default(), Vec::new());
    let mut numbers: Vec<Vec<u32>> = tiles.iter().map(|tile| vec![u32::MAX; tile.surface.positions.len()]).collect();
    let mut take = |i: usize, range: Range<usize>| {
        let first = whole.positions.len();
        range.clone().for_each(|v| numbers[i][v] = (first + v - range.start) as u32);
        whole.append_vertices(&tiles[i].surface, range.clone());
        of_whole.extend_from_slice(&of_vertex[i][range]);
        progress.check()
    };
    for &(_, i, share) in &shares {
        let first = tiles[i].first[share] as usize;
        take(i, first..first + tiles[i].shares[share].vertices as usize)?;
    }
    let mut next: Vec<usize> = tiles.iter().map(|tile| tile.own - tile.copied.len()).collect();
    for &(_, i, share) in &shares {
        let copies = tiles[i].shares[share].copies as usize;
        take(i, next[i]..next[i] + copies)?;
        next[i] += copies;
    }
    let index = Index::new(&tiles);
    for (i, tile) in tiles.iter().enumerate() {
        progress.check()?;
        for (at, key) in tile.foreign.iter().enumerate() {
            let [owner, v] = index.find(key);
            numbers[i][tile.own + at] = numbers[owner][v];
        }
    }
    let mut next = vec![0; tiles.len()];
    for &(_, i, share) in &shares {
        progress.check()?;
        let (of, numbers) = (&tiles[i].surface, &numbers[i]);
        let triangles = next[i]..next[i] + tiles[i].shares[share].triangles as usize;
        whole.triangles.extend(of.triangles[triangles.clone()].iter().map(|t| t.map(|v| numbers[v as usize])));
        whole.cases.extend_from_slice(&of.cases[triangles.clone()]);
        next[i] = triangles.end;
    }
    for (tile, numbers) in tiles.iter().zip(&numbers) {
        whole.boundary.extend(tile.surface.boundary.iter().map(|side| side.map(|v| numbers[v as usize])));
    }
    Ok((whole, of_whole))
}
