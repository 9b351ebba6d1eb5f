//! Connected parts of the surface, whatever blocks they are in: each tile knows those of its own triangles, and what has a vertex
//! in common is one.

use glam::DVec3;

use super::passes;
use super::tile::{Part, Tile, Tiles, VertexKey};
use base::error::Result;
use base::progress::Progress;
use mesh::connected::parts;

/// The parts of a surface.
pub struct Parts {
    /// In the order of their lowest vertices.
    pub list: Vec<Part>,
    /// Of each tile which of these its parts are.
    pub of: Vec<Vec<u32>>,
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
    /// Number, among all parts, of a part of a tile.
    pub fn part(&self, tile: usize, part: u32) -> u32 {
        self.parts.of[tile][part as usize]
    }

    /// Whether a part of a tile is kept.
    pub fn is_kept(&self, tile: usize, part: u32) -> bool {
        self.kept[self.part(tile, part) as usize]
    }
}

/// The parts of all tiles together. O(parts + vertices that tiles share).
///
/// # Errors
/// A tile can't be read. Cancelled.
pub fn find<T: Tiles>(tiles: &T, progress: &Progress<'_>) -> Result<Parts> {
    let mut list: Vec<Part> = Vec::new();
    let mut joins: Vec<(VertexKey, u32)> = Vec::new();
    let mut of: Vec<Vec<u32>> = Vec::new();
    for i in 0..tiles.count() {
        progress.check()?;
        let tile = tiles.get(i)?;
        let first = list.len() as u32;
        list.extend_from_slice(&tile.parts);
        joins.extend(tile.shared.iter().map(|&v| (tile.key(v), first + tile.part_of[v as usize])));
        joins.extend(tile.foreign.iter().zip(&tile.part_of[tile.own..]).map(|(key, part)| (*key, first + part)));
        of.push((first..list.len() as u32).collect());
    }
    joins.sort_unstable();
    let links: Vec<[u32; 3]> =
        joins.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| [pair[0].1, pair[1].1, pair[1].1]).collect();
    if links.is_empty() && of.len() < 2 {
        return Ok(Parts { list, of });
    }
    let root = parts(list.len(), &links, progress)?;
    for i in (0..list.len()).filter(|&i| root[i] as usize != i) {
        let part = list[i];
        list[root[i] as usize].add(&part);
    }
    let mut roots: Vec<u32> = (0..list.len() as u32).filter(|&i| root[i as usize] == i).collect();
    roots.sort_unstable_by_key(|&i| list[i as usize].first);
    let mut number = vec![0; list.len()];
    roots.iter().enumerate().for_each(|(new, &old)| number[old as usize] = new as u32);
    of.iter_mut().flatten().for_each(|part| *part = number[root[*part as usize] as usize]);
    Ok(Parts { list: roots.into_iter().map(|i| list[i as usize]).collect(), of })
}

/// The part of each vertex of a tile, and the parts of its triangles in the order of their lowest vertices. O(vertices).
///
/// # Errors
/// Cancelled.
pub fn within(tile: &Tile, progress: &Progress<'_>) -> Result<(Vec<u32>, Vec<Part>)> {
    let surface = &tile.surface;
    let mut part_of = parts(surface.positions.len(), &surface.triangles, progress)?;
    let mut list: Vec<Part> = Vec::new();
    // The lowest vertex of a part is met before all others.
    passes::each(part_of.len(), progress, |v| {
        let lowest = part_of[v] as usize;
        if lowest == v {
            part_of[v] = list.len() as u32;
            let (low, high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            list.push(Part { faces: 0, vertices: 0, unseen: 0, noisy: 0, low, high, first: tile.key(v as u32) });
        } else {
            part_of[v] = part_of[lowest];
        }
        if v >= tile.own {
            return;
        }
        let part = &mut list[part_of[v] as usize];
        part.vertices += 1;
        part.unseen += u64::from(surface.scan[v] < 0);
        part.noisy += u64::from(surface.noise[v] > 0.0);
        (part.low, part.high) = (part.low.min(surface.positions[v]), part.high.max(surface.positions[v]));
    })?;
    passes::each(surface.triangles.len(), progress, |t| {
        list[part_of[surface.triangles[t][0] as usize] as usize].faces += 1;
    })?;
    Ok((part_of, list))
}
