//! Stage 3 in blocks: what the crossings of all scans come to, in a file for each block, brick by brick.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::files::{Columns, Place, Stored};
use super::segments::Collected;
use super::setting::{Cut, Key, Named, Portion, Setting};
use crate::colour::gains;
use crate::crossings::crossing::{BundleKey, OnLine};
use crate::crossings::edge_sums::EdgeSums;
use crate::crossings::lattice::{ACROSS, BRICK_BITS, ROWS};
use crate::crossings::lines::{self, SortedBundle};
use crate::crossings::scan_order::ScanOrder;
use crate::field;
use crate::stages::FUSING;
use base::error::Result;
use base::progress::Progress;

/// Content of a brick on lines along each axis, sorted by [`EdgeSums::key`].
pub type BrickSums = [Vec<EdgeSums>; 3];

/// The sums of all blocks.
pub struct Blocks {
    cut: Cut,
    /// By block.
    files: BTreeMap<[i32; 3], BlockFile>,
}

/// A block's file, and where it has what there is in each brick, in order.
struct BlockFile {
    path: PathBuf,
    key: Key,
    table: Vec<Entry>,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Entry {
    brick: [i32; 3],
    unused: u32,
    lists: [Place; 3],
    /// The numbers of the scans that colours are of, rising.
    scans: Place,
}

/// Kind of files of blocks, and of those of the rest of them.
pub const KIND: &str = "block";
pub const LEFT: &str = "left";

impl Blocks {
    /// Adds up what the segments have in a portion of the blocks, as far as that is not done. Gives their files.
    ///
    /// # Errors
    /// A file can't be read or written. Cancelled.
    pub fn fuse(
        collected: &Collected,
        portion: Portion,
        setting: &Setting<'_>,
        progress: &Progress<'_>,
    ) -> Result<Vec<Named>> {
        let blocks = portion.every(collected.blocks());
        progress.stage(FUSING, blocks.len() as u64);
        let fuse = |block: [i32; 3]| {
            let named = Named { block, note: 0, key: collected.key_of(block) };
            let path = setting.path(KIND, named.key);
            if !path.exists() {
                let mut bricks: BTreeMap<[i32; 3], BrickSums> = BTreeMap::new();
                for axis in 0..3 {
                    let [u, v] = ACROSS[axis];
                    for (across, list) in collected.sums(block, axis, progress)? {
                        for edge in list {
                            let mut brick = [edge.cell() >> BRICK_BITS; 3];
                            [brick[u], brick[v]] = across;
                            bricks.entry(brick).or_default()[axis].push(edge);
                        }
                    }
                }
                write(&path, &bricks)?;
            }
            progress.advance(1)?;
            Ok(named)
        };
        blocks.into_par_iter().with_max_len(1).map(fuse).collect()
    }

    /// Those of these files. Of what is left of blocks where some of them is gone, which is noted.
    ///
    /// # Errors
    /// A file can't be read.
    pub fn open(files: &[Named], setting: &Setting<'_>) -> Result<Self> {
        let mut blocks = Blocks { cut: setting.cut, files: BTreeMap::new() };
        for named in files {
            let path = setting.path(if named.note == 0 { KIND } else { LEFT }, named.key);
            let (_, table) = Stored::open(&path)?;
            // Those in which all sums are none have no brick.
            if !table.is_empty() {
                blocks.files.insert(named.block, BlockFile { path, key: named.key, table });
            }
        }
        Ok(blocks)
    }

    /// The blocks there are, in order.
    pub fn list(&self) -> Vec<[i32; 3]> {
        self.files.keys().copied().collect()
    }

    /// The key that the content of a block follows from. Nothing in others.
    pub fn key(&self, block: [i32; 3]) -> Option<Key> {
        self.files.get(&block).map(|file| file.key)
    }

    /// Reads what there is in the bricks of a block, in order.
    ///
    /// # Errors
    /// The file can't be read.
    pub fn read(&self, block: [i32; 3]) -> Result<Vec<([i32; 3], BrickSums)>> {
        self.files.get(&block).map_or(Ok(Vec::new()), |file| file.read(|_| true))
    }

    /// The factors that make the scans equally bright. Empty if they are.
    ///
    /// # Errors
    /// A file can't be read. Cancelled.
    pub fn gains(&self, scan_order: &ScanOrder<'_>, progress: &Progress<'_>) -> Result<Vec<[f64; 3]>> {
        let list = self.list();
        let each = |block: &[i32; 3]| {
            progress.check()?;
            let bricks = self.read(*block)?;
            Ok(bricks.into_iter().flat_map(|brick| brick.1))
        };
        let count = |block: &[i32; 3]| Ok(each(block)?.map(|list| gains::shared(&list).count()).sum::<usize>());
        let count: usize = list.par_iter().with_max_len(1).map(count).sum::<Result<usize>>()?;
        let sample = gains::Sample::of(count, scan_order.len());
        let pairs = |block: &[i32; 3]| Ok(each(block)?.flat_map(|list| sample.pairs(&list)).collect::<Vec<_>>());
        let found = list.par_iter().with_max_len(1).map(pairs).collect::<Result<Vec<_>>>()?;
        gains::solve(found.concat(), scan_order, progress)
    }

    /// Follows from what there is in the bricks of a block and those around it: what [`Blocks::bundles_around`] gives.
    pub fn key_around(&self, block: [i32; 3]) -> Key {
        let files = self.cut.around(block, 1).filter_map(|beside| self.files.get(&beside));
        let near = files.flat_map(|file| &file.table).filter(|entry| self.cut.is_near(entry.brick, block, 1));
        Key::of(&near.map(|entry| (entry.brick, entry.lists.map(|list| list.content))).collect::<Vec<_>>())
    }

    /// The numbers of the scans that colours in these bricks are of, rising.
    ///
    /// # Errors
    /// A file can't be read.
    pub fn scans_around(&self, block: [i32; 3]) -> Result<Vec<u32>> {
        let mut scans = FxHashSet::default();
        for file in self.cut.around(block, 1).filter_map(|beside| self.files.get(&beside)) {
            let mut near = file.table.iter().filter(|entry| self.cut.is_near(entry.brick, block, 1)).peekable();
            if near.peek().is_some() {
                let stored = Stored::again(&file.path)?;
                near.try_for_each(|entry| stored.get(&entry.scans).map(|list: Vec<u32>| scans.extend(list)))?;
            }
        }
        let mut scans: Vec<u32> = scans.into_iter().collect();
        scans.sort_unstable();
        Ok(scans)
    }

    /// Content of lines through a block and the bricks around it, as far as these bricks. With the distance from each edge to the next
    /// surface along its line, as far as that matters in the block.
    ///
    /// # Errors
    /// A file can't be read.
    pub fn bundles_around(&self, block: [i32; 3]) -> Result<field::Bundles> {
        let mut bundles: BTreeMap<BundleKey, Vec<(i32, Vec<EdgeSums>)>> = BTreeMap::new();
        for beside in self.cut.around(block, 1) {
            let Some(file) = self.files.get(&beside) else { continue };
            for (brick, lists) in file.read(|brick| self.cut.is_near(brick, block, 1))? {
                for (axis, list) in lists.into_iter().enumerate().filter(|of_axis| !of_axis.1.is_empty()) {
                    let key = BundleKey { axis: axis as u8, across: ACROSS[axis].map(|i| brick[i]) };
                    bundles.entry(key).or_default().push((brick[axis], list));
                }
            }
        }
        let bundle = |(key, mut parts): (BundleKey, Vec<(i32, Vec<EdgeSums>)>)| {
            parts.sort_unstable_by_key(|part| part.0);
            Arc::new(lines::sort_sums(key, by_line(parts)))
        };
        Ok(field::Bundles::new(bundles.into_iter().map(bundle).collect()))
    }
}

/// Sums of bricks along a line, each sorted, in one list sorted by [`EdgeSums::key`].
fn by_line(mut parts: Vec<(i32, Vec<EdgeSums>)>) -> Vec<EdgeSums> {
    if parts.len() == 1 {
        return parts.swap_remove(0).1;
    }
    let mut starts = [0_u32; ROWS + 1];
    let all = || parts.iter().flat_map(|part| &part.1);
    all().for_each(|edge| starts[edge.line() + 1] += 1);
    (0..ROWS).for_each(|line| starts[line + 1] += starts[line]);
    let mut sorted = vec![EdgeSums::default(); starts[ROWS] as usize];
    for edge in all() {
        let slot = &mut starts[edge.line()];
        sorted[*slot as usize] = *edge;
        *slot += 1;
    }
    sorted
}

/// A brick's sums on lines along an axis, as a bundle that ends there.
pub fn in_bundle(brick: [i32; 3], axis: usize, list: Vec<EdgeSums>) -> SortedBundle {
    let key = BundleKey { axis: axis as u8, across: ACROSS[axis].map(|i| brick[i]) };
    let bricks = if list.is_empty() { Vec::new() } else { vec![(brick[axis], 0)] };
    SortedBundle { key, list, bricks }
}

/// Writes what there is in the bricks of a block.
///
/// # Errors
/// The file can't be written.
pub fn write(path: &Path, bricks: &BTreeMap<[i32; 3], BrickSums>) -> Result<()> {
    let mut file = Columns::new(path)?;
    let mut table = Vec::new();
    for (&brick, [x, y, z]) in bricks {
        let members = [x, y, z].into_iter().flatten().flat_map(|edge| edge.members().iter());
        let mut scans: Vec<u32> = members.map(|member| member.scan).collect::<FxHashSet<_>>().into_iter().collect();
        scans.sort_unstable();
        let lists = [file.put(x)?, file.put(y)?, file.put(z)?];
        table.push(Entry { brick, unused: 0, lists, scans: file.put(&scans)? });
    }
    file.finish(&table)
}

impl BlockFile {
    fn read(&self, is_wanted: impl Fn([i32; 3]) -> bool) -> Result<Vec<([i32; 3], BrickSums)>> {
        let mut wanted = self.table.iter().filter(|entry| is_wanted(entry.brick)).peekable();
        if wanted.peek().is_none() {
            return Ok(Vec::new());
        }
        let stored = Stored::again(&self.path)?;
        let read = |entry: &Entry| {
            let [x, y, z] = &entry.lists;
            Ok((entry.brick, [stored.get(x)?, stored.get(y)?, stored.get(z)?]))
        };
        wanted.map(read).collect()
    }
}
