//! Stages 5 to 7 in blocks: the tile of each, in a file.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::files::{Columns, Place, Stored};
use super::labels::BlockLabels;
use super::setting::{Key, Named, Portion, Setting};
use crate::crossings::lattice::Lattice;
use crate::stages::BUILDING;
use crate::surface::extract::{Case, Surface};
use crate::surface::tile::Part;
use crate::surface::tile::{Share, Tile, Tiles, VertexKey, first_vertices};
use crate::surface::tiles::build_block;
use base::error::Result;
use base::progress::Progress;
use glam::DVec3;

/// A tile in a file.
pub struct TileFile {
    path: PathBuf,
    table: Table,
    /// The shares of its bricks, in order.
    pub shares: Vec<Share>,
    /// Its parts, as far as its own triangles tell.
    parts: Vec<Part>,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Table {
    own: u64,
    artificial: u64,
    positions: Place,
    confidence: Place,
    noise: Place,
    colour: Place,
    scan: Place,
    triangles: Place,
    cases: Place,
    boundary: Place,
    copied: Place,
    foreign: Place,
    shared: Place,
    part_of: Place,
    shares: Place,
    parts: Place,
}

/// A [`VertexKey`] as it is kept: those that were split off have a number from 1 on.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Corner {
    brick: [i32; 3],
    number: u32,
    copy: u32,
}

/// A [`Part`] as it is kept.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct KeptPart {
    counts: [u64; 4],
    low: DVec3,
    high: DVec3,
    first: Corner,
    unused: u32,
}

impl From<&VertexKey> for Corner {
    fn from(key: &VertexKey) -> Self {
        Corner { brick: key.brick, number: key.number, copy: key.copy }
    }
}

impl From<Corner> for VertexKey {
    fn from(key: Corner) -> Self {
        VertexKey { is_copy: key.copy > 0, brick: key.brick, number: key.number, copy: key.copy }
    }
}

impl From<&Part> for KeptPart {
    fn from(part: &Part) -> Self {
        let &Part { faces, vertices, unseen, noisy, low, high, first } = part;
        KeptPart { counts: [faces, vertices, unseen, noisy], low, high, first: (&first).into(), unused: 0 }
    }
}

impl From<KeptPart> for Part {
    fn from(kept: KeptPart) -> Self {
        let KeptPart { counts: [faces, vertices, unseen, noisy], low, high, first, .. } = kept;
        Part { faces, vertices, unseen, noisy, low, high, first: first.into() }
    }
}

/// Kind of files of tiles.
pub const KIND: &str = "tile";

/// Those of these files.
///
/// # Errors
/// A file can't be read.
pub fn open(files: &[Named], setting: &Setting<'_>) -> Result<Vec<TileFile>> {
    files.iter().filter_map(|named| TileFile::open(setting.path(KIND, named.key)).transpose()).collect()
}

/// Makes the tiles of a portion of the blocks that have a part of the surface, as far as that is not done. Gives their files.
///
/// # Errors
/// A file can't be read or written. Cancelled.
pub fn build(
    labels: &BlockLabels,
    lattice: &Lattice,
    portion: Portion,
    setting: &Setting<'_>,
    progress: &Progress<'_>,
) -> Result<Vec<Named>> {
    progress.stage(BUILDING, 2 * labels.bricks() / u64::from(portion.of));
    let Lattice { voxel, base } = lattice;
    let basis = Key::of(&(voxel.to_bits(), base));
    let build = |block: [i32; 3]| {
        progress.check()?;
        let key = Key::of(&(basis, block, labels.key_around(block)));
        let path = setting.path(KIND, key);
        if !path.exists() {
            let (labels, vertices) = labels.around(block)?;
            let tile = match labels.is_empty() {
                true => None,
                false => Some(build_block(setting.cut.block(block), &labels, &vertices, lattice, progress)?),
            };
            TileFile::write(&path, tile.filter(|tile| tile.own > 0 || !tile.surface.triangles.is_empty()))?;
        }
        Ok(Named { block, note: 0, key })
    };
    portion.every(labels.blocks()).into_par_iter().with_max_len(1).map(build).collect()
}

impl Tiles for Vec<TileFile> {
    fn count(&self) -> usize {
        self.len()
    }

    fn get(&self, tile: usize) -> Result<Cow<'_, Tile>> {
        self[tile].read().map(Cow::Owned)
    }

    fn positions(&self, tile: usize) -> Result<Cow<'_, [DVec3]>> {
        let TileFile { path, table, .. } = &self[tile];
        Stored::again(path)?.get(&table.positions).map(Cow::Owned)
    }

    fn noise(&self, tile: usize) -> Result<Cow<'_, [f32]>> {
        let TileFile { path, table, .. } = &self[tile];
        let mut noise: Vec<f32> = Stored::again(path)?.get(&table.noise)?;
        noise.truncate(table.own as usize);
        Ok(Cow::Owned(noise))
    }

    fn artificial(&self) -> u64 {
        self.iter().map(|tile| tile.table.artificial).sum()
    }

    fn take_only(&mut self) -> Option<Tile> {
        None
    }
}

impl TileFile {
    fn open(path: PathBuf) -> Result<Option<Self>> {
        let (stored, table) = Stored::open::<Table>(&path)?;
        let Some(&table) = table.first() else { return Ok(None) };
        let parts = stored.get::<KeptPart>(&table.parts)?.into_iter().map(Part::from).collect();
        Ok(Some(TileFile { shares: stored.get(&table.shares)?, parts, table, path }))
    }

    /// Writes a tile, or that there is none.
    fn write(path: &Path, tile: Option<Tile>) -> Result<()> {
        let mut file = Columns::new(path)?;
        let Some(tile) = tile else { return file.finish::<Table>(&[]) };
        let Tile { surface, shares, copied, foreign, own, shared, artificial, parts, part_of, .. } = tile;
        let keys: Vec<Corner> = foreign.iter().map(Corner::from).collect();
        let cases: Vec<u8> = surface.cases.iter().map(|&case| case as u8).collect();
        let table = Table {
            own: own as u64,
            artificial,
            positions: file.put(&surface.positions)?,
            confidence: file.put(&surface.confidence)?,
            noise: file.put(&surface.noise)?,
            colour: file.put(&surface.colour)?,
            scan: file.put(&surface.scan)?,
            triangles: file.put(&surface.triangles)?,
            cases: file.put(&cases)?,
            boundary: file.put(&surface.boundary)?,
            copied: file.put(&copied)?,
            foreign: file.put(&keys)?,
            shared: file.put(&shared)?,
            part_of: file.put(&part_of)?,
            shares: file.put(&shares)?,
            parts: file.put(&parts.iter().map(KeptPart::from).collect::<Vec<_>>())?,
        };
        file.finish(&[table])
    }

    /// The tile.
    ///
    /// # Errors
    /// The file can't be read.
    fn read(&self) -> Result<Tile> {
        let (table, file) = (&self.table, Stored::again(&self.path)?);
        let surface = Surface {
            positions: file.get(&table.positions)?,
            confidence: file.get(&table.confidence)?,
            noise: file.get(&table.noise)?,
            colour: file.get(&table.colour)?,
            scan: file.get(&table.scan)?,
            triangles: file.get(&table.triangles)?,
            cases: file.get::<u8>(&table.cases)?.into_iter().map(|case| Case::ALL[usize::from(case)]).collect(),
            boundary: file.get(&table.boundary)?,
        };
        Ok(Tile {
            surface,
            first: first_vertices(&self.shares),
            shares: self.shares.clone(),
            copied: file.get(&table.copied)?,
            own: table.own as usize,
            foreign: file.get::<Corner>(&table.foreign)?.into_iter().map(VertexKey::from).collect(),
            shared: file.get(&table.shared)?,
            artificial: table.artificial,
            parts: self.parts.clone(),
            part_of: file.get(&table.part_of)?,
        })
    }
}
