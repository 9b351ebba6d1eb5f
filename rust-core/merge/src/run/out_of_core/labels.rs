//! Stage 4 in blocks: labels of the nodes and vertices on the edges between them, in a file for each block.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use super::blocks::Blocks;
use super::files::{Columns, Content, Place, Stored};
use super::setting::{Cut, Key, Named, Portion, Setting};
use crate::crossings::edge_colours::Gains;
use crate::crossings::lattice::ROWS;
use crate::field::fuse::{self, Labelled};
use crate::field::{BrickLabels, Vertex, Vertices, VoteRule};
use crate::field::{BrickVertices, Labels};
use crate::stages::LABELLING;
use base::error::Result;
use base::progress::Progress;

/// Kind of files of labels.
pub const KIND: &str = "labels";

/// The labels of all blocks.
pub struct BlockLabels {
    cut: Cut,
    files: BTreeMap<[i32; 3], LabelFile>,
}

struct LabelFile {
    path: PathBuf,
    table: Vec<Entry>,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Entry {
    brick: [i32; 3],
    bounds: [[i32; 2]; 3],
    unused: u32,
    /// Nodes inside, then those outside.
    planes: Place,
    vertices: [Place; 3],
}

/// A [`Vertex`] as it is kept.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Keep {
    node: u16,
    enters: u16,
    fraction: f32,
    weight: f32,
    noise: f32,
    colour: [u8; 4],
    scan: i32,
}

impl From<&Vertex> for Keep {
    fn from(vertex: &Vertex) -> Self {
        let &Vertex { node, enters, fraction, weight, noise, colour, scan } = vertex;
        Keep { node, enters: enters.into(), fraction, weight, noise, colour, scan }
    }
}

impl From<&Keep> for Vertex {
    fn from(kept: &Keep) -> Self {
        let &Keep { node, enters, fraction, weight, noise, colour, scan } = kept;
        Vertex { node, enters: enters != 0, fraction, weight, noise, colour, scan }
    }
}

impl BlockLabels {
    /// Labels a portion of the blocks, as far as that is not done. Gives their files, which note how many vertices they have.
    ///
    /// # Errors
    /// A file can't be read or written. Cancelled.
    pub fn label(
        blocks: &Blocks,
        (rule, gains): (&VoteRule, &Gains),
        portion: Portion,
        setting: &Setting<'_>,
        progress: &Progress<'_>,
    ) -> Result<Vec<Named>> {
        let cut = setting.cut;
        // Crossings that speak of nodes may lie in the brick before, of another block.
        let mut list: Vec<[i32; 3]> = blocks.list().into_iter().flat_map(|block| cut.around(block, 1)).collect();
        list.sort_unstable();
        list.dedup();
        let list = portion.every(list);
        progress.stage(LABELLING, list.len() as u64);
        let basis = Key::of(&format!("{rule:?}"));
        let label = |block: [i32; 3]| {
            let of_gains: Vec<_> = match gains.is_empty() {
                true => Vec::new(),
                false => blocks.scans_around(block)?.into_iter().map(|scan| (scan, gains.of(scan))).collect(),
            };
            let key = Key::of(&(basis, block, blocks.key_around(block), of_gains));
            let path = setting.path(KIND, key);
            if !path.exists() {
                let bundles = blocks.bundles_around(block)?;
                let mut bricks = bundles.labelled_bricks();
                bricks.retain(|&brick| cut.is_near(brick, block, 0));
                let found = fuse::label_nodes(&bundles, bricks, rule, gains, progress)?;
                LabelFile::write(&path, &found)?;
            }
            progress.advance(1)?;
            let (_, table) = Stored::open(&path)?;
            Ok(Named { block, note: vertices(&table) as u32, key })
        };
        list.into_par_iter().with_max_len(1).map(label).collect()
    }

    /// Those of these files.
    ///
    /// # Errors
    /// A file can't be read.
    pub fn open(files: &[Named], setting: &Setting<'_>) -> Result<Self> {
        let mut labels = BlockLabels { cut: setting.cut, files: BTreeMap::new() };
        for &Named { block, key, .. } in files {
            let path = setting.path(KIND, key);
            let (_, table) = Stored::open(&path)?;
            if !table.is_empty() {
                labels.files.insert(block, LabelFile { path, table });
            }
        }
        Ok(labels)
    }

    /// Follows from what [`BlockLabels::around`] gives for a block.
    pub fn key_around(&self, block: [i32; 3]) -> Key {
        let files = self.cut.around(block, 2).filter_map(|beside| self.files.get(&beside));
        let near = files.flat_map(|file| &file.table).filter(|entry| self.cut.is_near(entry.brick, block, 2));
        let contents = |entry: &Entry| {
            let [x, y, z] = match self.cut.is_near(entry.brick, block, 1) {
                true => entry.vertices.map(|list| list.content),
                false => [Content::default(); 3],
            };
            (entry.brick, entry.bounds, [entry.planes.content, x, y, z])
        };
        Key::of(&near.map(contents).collect::<Vec<_>>())
    }

    /// The blocks that may have a part of the surface, in order.
    pub fn blocks(&self) -> Vec<[i32; 3]> {
        // Around labelled nodes others get labels too.
        let mut list: Vec<[i32; 3]> = self.files.keys().flat_map(|&block| self.cut.around(block, 1)).collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    /// Bricks that have labels.
    pub fn bricks(&self) -> u64 {
        self.files.values().map(|file| file.table.len() as u64).sum()
    }

    /// The data that a block is made from: labels of its bricks and of two around it, vertices of one.
    ///
    /// # Errors
    /// A file can't be read.
    pub fn around(&self, block: [i32; 3]) -> Result<(Labels, BrickVertices)> {
        let (mut labels, mut vertices) = (Labels::default(), BrickVertices::default());
        for beside in self.cut.around(block, 2) {
            let Some(file) = self.files.get(&beside) else { continue };
            let wanted: Vec<&Entry> =
                file.table.iter().filter(|entry| self.cut.is_near(entry.brick, block, 2)).collect();
            if wanted.is_empty() {
                continue;
            }
            let stored = Stored::again(&file.path)?;
            for entry in wanted {
                let planes: Vec<u32> = stored.get(&entry.planes)?;
                let mut of_brick =
                    Box::new(BrickLabels { inside: [0; ROWS], outside: [0; ROWS], bounds: entry.bounds });
                of_brick.inside.copy_from_slice(&planes[..ROWS]);
                of_brick.outside.copy_from_slice(&planes[ROWS..]);
                labels.insert(entry.brick, of_brick);
                if self.cut.is_near(entry.brick, block, 1) {
                    let mut of_brick = Vertices::default();
                    for (list, place) in of_brick.iter_mut().zip(&entry.vertices) {
                        *list = stored.get::<Keep>(place)?.iter().map(Vertex::from).collect();
                    }
                    vertices.insert(entry.brick, of_brick);
                }
            }
        }
        Ok((labels, vertices))
    }
}

/// Vertices on edges.
fn vertices(table: &[Entry]) -> usize {
    table.iter().flat_map(|entry| &entry.vertices).map(Place::count::<Keep>).sum()
}

impl LabelFile {
    fn write(path: &Path, found: &[([i32; 3], Labelled)]) -> Result<()> {
        let labelled = found.iter().filter_map(|(brick, labelled)| Some((*brick, labelled.as_ref()?)));
        let mut file = Columns::new(path)?;
        let mut table = Vec::new();
        for (brick, (labels, vertices)) in labelled {
            let planes = file.put(&[labels.inside, labels.outside])?;
            let mut of_axis = [Place::default(); 3];
            for (place, list) in of_axis.iter_mut().zip(vertices) {
                *place = file.put(&list.iter().map(Keep::from).collect::<Vec<_>>())?;
            }
            table.push(Entry { brick, bounds: labels.bounds, unused: 0, planes, vertices: of_axis });
        }
        file.finish(&table)
    }
}
