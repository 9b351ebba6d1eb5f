//! Stages 5 to 7 in blocks: the surface is made block by block, and what each block has of it is the same however space is cut.
//!
//! Labels of nodes depend on votes of nodes around them, valid cells on labels, vertices on vertices around them. All of that ends within a
//! brick. So a block is made with the bricks around it, and what it has made of these is left to others. Bricks are numbered in the order
//! of their places, whatever block they are in.

use rayon::prelude::*;

use super::anomalies::{self, Analyser, BrickSurface};
use super::artificial;
use super::extract::{self, Extracted, Surface};
use super::parts;
use super::pinches;
use super::tile::{Share, Tile, first_vertices};
use crate::crossings::lattice::{self, BRICK, BRICK_BITS, Lattice};
use crate::field::BrickLabels;
use crate::field::{BrickVertices, Labels};
use crate::stages::BUILDING;
use base::error::Result;
use base::progress::Progress;

/// A box of bricks. Its upper corner is the first that is outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    low: [i32; 3],
    high: [i32; 3],
}

/// Distance beyond its block, in cells, to which the surface has to be known. A vertex of a triangle of the block may lie a cell away, the
/// triangles at it two, their vertices three. The place of a vertex depends on those up to six further on.
const HALO: i32 = 12;

impl Block {
    /// All there is.
    const ALL: Block = Block { low: [i32::MIN >> 1; 3], high: [i32::MAX >> 1; 3] };

    /// The block that a brick is in where blocks are cubes of so many bricks.
    pub fn around(brick: [i32; 3], side: i32) -> Block {
        let low = brick.map(|at| at.div_euclid(side) * side);
        Block { low, high: low.map(|at| at + side) }
    }

    fn contains(&self, brick: [i32; 3]) -> bool {
        (0..3).all(|i| (self.low[i]..self.high[i]).contains(&brick[i]))
    }

    /// Whether a brick is in the block or beside it.
    fn is_near(&self, brick: [i32; 3]) -> bool {
        (0..3).all(|i| (self.low[i] - 1..=self.high[i]).contains(&brick[i]))
    }
}

/// The blocks that have any of the bricks, which are in order, each with its bricks and those beside it, in order.
fn blocks(bricks: &[[i32; 3]], side: Option<i32>) -> Vec<(Block, Vec<[i32; 3]>)> {
    let Some(side) = side else {
        return if bricks.is_empty() { Vec::new() } else { vec![(Block::ALL, bricks.to_vec())] };
    };
    let mut all: Vec<Block> = bricks.iter().map(|&brick| Block::around(brick, side)).collect();
    all.sort_unstable_by_key(|block| block.low);
    all.dedup();
    let near = |block: Block| bricks.iter().copied().filter(|&brick| block.is_near(brick)).collect();
    all.into_iter().map(|block| (block, near(block))).collect()
}

/// The bricks that may hold a cell or a vertex, in order: around labelled nodes others get labels too.
pub fn bricks(labels: &Labels) -> Vec<[i32; 3]> {
    let mut bricks: Vec<[i32; 3]> = Vec::new();
    for (brick, labels) in labels {
        let reach = labels.bounds.map(|[low, high]| {
            [(low - anomalies::LABEL_REACH) >> BRICK_BITS, (high + anomalies::LABEL_REACH) >> BRICK_BITS]
        });
        for z in reach[2][0]..=reach[2][1] {
            for y in reach[1][0]..=reach[1][1] {
                bricks.extend((reach[0][0]..=reach[0][1]).map(|x| [brick[0] + x, brick[1] + y, brick[2] + z]));
            }
        }
    }
    bricks.sort_unstable();
    bricks.dedup();
    bricks
}

/// Stages 5 to 7: the surface, in a tile for each block of `side` bricks. Else it is one.
///
/// # Errors
/// As [`build`].
pub fn build_all(
    (labels, vertices): (&Labels, &BrickVertices),
    lattice: &Lattice,
    side: Option<i32>,
    progress: &Progress<'_>,
) -> Result<Vec<Tile>> {
    let blocks = blocks(&bricks(labels), side);
    progress.stage(BUILDING, blocks.iter().map(|(_, near)| 2 * near.len() as u64).sum());
    let build = |(block, near)| build_of(block, near, labels, vertices, lattice, progress);
    blocks.into_iter().map(build).collect()
}

/// The tile of a block, of labels up to two bricks around it and vertices up to one.
///
/// # Errors
/// As [`build`].
pub fn build_block(
    block: Block,
    labels: &Labels,
    vertices: &BrickVertices,
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<Tile> {
    let mut near = bricks(labels);
    near.retain(|&brick| block.is_near(brick));
    build_of(block, near, labels, vertices, lattice, progress)
}

fn build_of(
    block: Block,
    near: Vec<[i32; 3]>,
    labels: &Labels,
    vertices: &BrickVertices,
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<Tile> {
    let mut bricks: Vec<_> = analyse(near, labels, progress)?.into_iter().flatten().collect();
    bricks.iter_mut().for_each(|surface| clip(surface, block));
    progress.lap("analyse");
    build(block, &mut bricks, vertices, lattice, progress)
}

/// The whole surface as one tile, of all bricks that have a part of it, in order.
///
/// # Errors
/// As [`build`].
pub fn build_one(
    bricks: &mut [Box<BrickSurface>],
    vertices: &BrickVertices,
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<Tile> {
    build(Block::ALL, bricks, vertices, lattice, progress)
}

/// Makes the tile of a block of its bricks and those beside it, in order.
///
/// # Errors
/// Cancelled. More vertices than there are numbers for.
fn build(
    block: Block,
    bricks: &mut [Box<BrickSurface>],
    vertices: &BrickVertices,
    lattice: &Lattice,
    progress: &Progress<'_>,
) -> Result<Tile> {
    let Extracted { mut surface, artificial, at_nodes, sides } = extract::extract(bricks, vertices, lattice, progress)?;
    progress.lap("reconstruct");
    artificial::place(&mut surface, &artificial, lattice, progress)?;
    artificial::separate_at_nodes(&mut surface, at_nodes, lattice);
    progress.lap("artificial");
    let copied = pinches::split(&mut surface, lattice, progress)?;
    let window = Window { surface, copied, sides, bricks };
    let artificial = artificial.iter().filter(|a| block.contains(a.node.map(|x| x >> BRICK_BITS))).count() as u64;
    let mut tile = window.cut(block, artificial);
    progress.lap("pinches");
    (tile.part_of, tile.parts) = parts::within(&tile, progress)?;
    progress.lap("components");
    Ok(tile)
}

/// Facts on bricks that reconstruction needs. Nothing of those without a vertex or cell.
///
/// # Errors
/// Cancelled.
pub fn analyse(
    bricks: Vec<[i32; 3]>,
    labels: &Labels,
    progress: &Progress<'_>,
) -> Result<Vec<Option<Box<BrickSurface>>>> {
    bricks
        .into_par_iter()
        .map_init(Analyser::default, |analyser, brick| {
            progress.advance(1)?;
            Ok(analyser.analyse(brick, |at| {
                let label: &BrickLabels = labels.get(&[brick[0] + at[0], brick[1] + at[1], brick[2] + at[2]])?;
                Some([&label.inside, &label.outside])
            }))
        })
        .collect()
}

/// Leaves of a brick beside a block the cells that matter to it.
fn clip(surface: &mut BrickSurface, block: Block) {
    if block.contains(surface.brick) {
        return;
    }
    let range = |i: usize| {
        let first = surface.brick[i] << BRICK_BITS;
        let low = (block.low[i] << BRICK_BITS) - HALO - first;
        let high = (block.high[i] << BRICK_BITS) + HALO - first;
        low.clamp(0, BRICK)..high.clamp(0, BRICK)
    };
    let [x, y, z] = [0, 1, 2].map(range);
    let bits = (((1_u64 << x.end) - 1) & !((1_u64 << x.start) - 1)) as u32;
    for at_z in 0..BRICK {
        for at_y in 0..BRICK {
            let row = &mut surface.valid[lattice::row(at_y, at_z)];
            *row &= if y.contains(&at_y) && z.contains(&at_z) { bits } else { 0 };
        }
    }
}

/// The surface of a block and of what is around it.
struct Window<'a> {
    surface: Surface,
    copied: Vec<u32>,
    sides: Vec<u32>,
    bricks: &'a [Box<BrickSurface>],
}

impl Window<'_> {
    /// The block's part of it.
    fn cut(self, block: Block, artificial: u64) -> Tile {
        let mut shares: Vec<Share> = (self.bricks.iter())
            .map(|of| Share { brick: of.brick, vertices: of.vertices, copies: 0, triangles: of.triangles })
            .collect();
        let first = first_vertices(&shares);
        for &vertex in &self.copied {
            shares[first.partition_point(|&first| first <= vertex) - 1].copies += 1;
        }
        let own = self.surface.positions.len();
        let Window { surface, copied, sides, .. } = self;
        let whole = Tile {
            surface,
            shares,
            first,
            copied,
            own,
            foreign: Vec::new(),
            shared: Vec::new(),
            artificial,
            parts: Vec::new(),
            part_of: Vec::new(),
        };
        let is_own: Vec<bool> = whole.shares.iter().map(|share| block.contains(share.brick)).collect();
        if is_own.iter().all(|&own| own) { whole } else { whole.cut(&is_own, &sides) }
    }
}

impl Tile {
    /// The parts of those of its bricks that are `is_own`. `sides` of the boundary belong to each.
    fn cut(self, is_own: &[bool], sides: &[u32]) -> Tile {
        let of = |vertex: u32| match (vertex as usize).checked_sub(self.own - self.copied.len()) {
            None => vertex,
            Some(at) => self.copied[at],
        };
        let is_own_vertex = |&vertex: &u32| is_own[self.first.partition_point(|&first| first <= of(vertex)) - 1];
        let surface = &self.surface;
        let (mut triangles, mut cases, mut boundary, mut beside) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut triangle, mut side) = (0, 0);
        for (i, share) in self.shares.iter().enumerate() {
            let (triangles_end, sides_end) = (triangle + share.triangles as usize, side + sides[i] as usize);
            if is_own[i] {
                triangles.extend_from_slice(&surface.triangles[triangle..triangles_end]);
                cases.extend_from_slice(&surface.cases[triangle..triangles_end]);
                boundary.extend_from_slice(&surface.boundary[side..sides_end]);
            } else {
                let corners = surface.triangles[triangle..triangles_end].as_flattened();
                beside.extend(corners.iter().copied().filter(is_own_vertex));
            }
            (triangle, side) = (triangles_end, sides_end);
        }
        let mut foreign: Vec<u32> =
            triangles.as_flattened().iter().copied().filter(|vertex| !is_own_vertex(vertex)).collect();
        for list in [&mut foreign, &mut beside] {
            list.sort_unstable();
            list.dedup();
        }
        let mut order: Vec<u32> = (0..self.own as u32).filter(is_own_vertex).collect();
        let own = order.len();
        order.extend(&foreign);
        let mut number = vec![u32::MAX; self.own];
        order.iter().enumerate().for_each(|(new, &old)| number[old as usize] = new as u32);
        let renamed = |vertex: u32| number[vertex as usize];
        let at = |v: &u32| *v as usize;
        let shares: Vec<Share> =
            self.shares.iter().zip(is_own).filter(|share| *share.1).map(|share| *share.0).collect();
        Tile {
            surface: Surface {
                positions: order.iter().map(|v| surface.positions[at(v)]).collect(),
                confidence: order.iter().map(|v| surface.confidence[at(v)]).collect(),
                noise: order.iter().map(|v| surface.noise[at(v)]).collect(),
                colour: order.iter().map(|v| surface.colour[at(v)]).collect(),
                scan: order.iter().map(|v| surface.scan[at(v)]).collect(),
                triangles: triangles.into_iter().map(|t| t.map(renamed)).collect(),
                cases,
                boundary: boundary.into_iter().map(|side| side.map(renamed)).collect(),
            },
            first: first_vertices(&shares),
            shares,
            copied: self.copied.iter().copied().filter(is_own_vertex).map(renamed).collect(),
            own,
            foreign: foreign.into_iter().map(|vertex| self.key(vertex)).collect(),
            shared: beside.into_iter().map(renamed).collect(),
            artificial: self.artificial,
            parts: Vec::new(),
            part_of: Vec::new(),
        }
    }
}
