//! A block's part of the surface, as it is kept, and the names of its vertices everywhere.

use std::borrow::Cow;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::extract::Surface;
use base::error::Result;

/// A vertex, wherever it is kept: its brick, its number among the brick's, and for those that were split from it which of them it
/// is, from 1 on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexKey {
    /// Those that were split off follow all others.
    pub is_copy: bool,
    /// Its brick.
    pub brick: [i32; 3],
    /// Its number in the brick.
    pub number: u32,
    /// Of those split from it, which.
    pub copy: u32,
}

/// A brick's part of the surface.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Share {
    /// The brick.
    pub brick: [i32; 3],
    /// Its vertices.
    pub vertices: u32,
    /// Vertices that were split from them.
    pub copies: u32,
    /// Its triangles.
    pub triangles: u32,
}

/// A block's part of the surface.
#[derive(Clone)]
pub struct Tile {
    /// Its vertices brick by brick, then those split from them, then those of other blocks that its triangles have.
    pub surface: Surface,
    /// The parts of its bricks, in order.
    pub shares: Vec<Share>,
    /// The first vertex of each share.
    pub first: Vec<u32>,
    /// Of the vertices that were split off, which was split. Rising.
    pub copied: Vec<u32>,
    /// The vertices of other blocks, rising.
    pub foreign: Vec<VertexKey>,
    /// Its own vertices: those before the foreign ones.
    pub own: usize,
    /// Own vertices that triangles of other blocks have, rising.
    pub shared: Vec<u32>,
    /// Vertices that no crossing places.
    pub artificial: u64,
    /// Its connected parts, as far as its own triangles tell, in the order of their lowest vertices.
    pub parts: Vec<Part>,
    /// The part of each vertex.
    pub part_of: Vec<u32>,
}

/// The surface, in tiles that are in memory or in files.
pub trait Tiles: Sync {
    /// Number of them.
    fn count(&self) -> usize;

    /// One of them.
    ///
    /// # Errors
    /// It can't be read.
    fn get(&self, tile: usize) -> Result<Cow<'_, Tile>>;

    /// Places of the vertices of one, those of other tiles among them.
    ///
    /// # Errors
    /// It can't be read.
    fn positions(&self, tile: usize) -> Result<Cow<'_, [DVec3]>>;

    /// The noise of the own vertices of one.
    ///
    /// # Errors
    /// It can't be read.
    fn noise(&self, tile: usize) -> Result<Cow<'_, [f32]>>;

    /// Vertices that no crossing places, of all.
    fn artificial(&self) -> u64;

    /// The only one, if it is in memory: taken out.
    fn take_only(&mut self) -> Option<Tile>;
}

impl Tiles for Vec<Tile> {
    fn count(&self) -> usize {
        self.len()
    }

    fn get(&self, tile: usize) -> Result<Cow<'_, Tile>> {
        Ok(Cow::Borrowed(&self[tile]))
    }

    fn positions(&self, tile: usize) -> Result<Cow<'_, [DVec3]>> {
        Ok(Cow::Borrowed(&self[tile].surface.positions))
    }

    fn noise(&self, tile: usize) -> Result<Cow<'_, [f32]>> {
        let tile = &self[tile];
        Ok(Cow::Borrowed(&tile.surface.noise[..tile.own]))
    }

    fn artificial(&self) -> u64 {
        self.iter().map(|tile| tile.artificial).sum()
    }

    fn take_only(&mut self) -> Option<Tile> {
        if self.len() == 1 { self.pop() } else { None }
    }
}

impl Tile {
    /// Name of a vertex everywhere.
    pub fn key(&self, vertex: u32) -> VertexKey {
        let split_off = self.own - self.copied.len();
        let v = vertex as usize;
        if v >= self.own {
            return self.foreign[v - self.own];
        }
        let (original, copy) = match v.checked_sub(split_off) {
            None => (vertex, 0),
            Some(at) => {
                let first = self.copied.partition_point(|&other| other < self.copied[at]);
                (self.copied[at], (at - first + 1) as u32)
            }
        };
        let share = self.first.partition_point(|&first| first <= original) - 1;
        let [brick, number] = [share, (original - self.first[share]) as usize];
        VertexKey { is_copy: copy > 0, brick: self.shares[brick].brick, number: number as u32, copy }
    }
}

/// Figures of a part.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Its triangles.
    pub faces: u64,
    /// Its vertices.
    pub vertices: u64,
    /// Vertices on no scan.
    pub unseen: u64,
    /// Vertices of noisy samples.
    pub noisy: u64,
    /// Its bounding box.
    pub low: DVec3,
    /// Its other corner.
    pub high: DVec3,
    /// The lowest of its vertices: parts are in the order of these.
    pub first: VertexKey,
}

impl Part {
    /// Adds what another tile has of it.
    pub fn add(&mut self, other: &Part) {
        self.faces += other.faces;
        self.vertices += other.vertices;
        self.unseen += other.unseen;
        self.noisy += other.noisy;
        (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
        self.first = self.first.min(other.first);
    }
}

/// The first vertex of each share.
pub fn first_vertices(shares: &[Share]) -> Vec<u32> {
    let mut next = 0;
    let mut first = |share: &Share| {
        next += share.vertices;
        next - share.vertices
    };
    shares.iter().map(&mut first).collect()
}
