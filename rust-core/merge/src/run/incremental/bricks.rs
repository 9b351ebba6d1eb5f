//! Stages 4 and 5 where what bundles come to has changed: labels and vertices, and which cells can be reconstructed.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::crossings::edge_colours::Gains;
use crate::crossings::lattice::Lattice;
use crate::field::{BrickVertices, Labels, fuse};
use crate::field::{Bundles, VoteRule};
use crate::stages::LABELLING;
use crate::surface::anomalies::BrickSurface;
use crate::surface::tiles;
use base::error::Result;
use base::progress::Progress;

/// Amount that a run had to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Renewed {
    /// Bricks that were labelled anew.
    pub bricks: usize,
    /// All bricks.
    pub of: usize,
}

/// State of bricks.
#[derive(Default)]
pub struct Bricks {
    /// Nodes that lie inside.
    pub labels: Labels,
    /// Vertices on the edges from inside to outside.
    pub vertices: BrickVertices,
    /// The basis that they were found by.
    basis: Option<(Lattice, VoteRule, Gains)>,
    /// Bricks where what is left of bundles has changed since then.
    changed: FxHashSet<[i32; 3]>,
    /// The surface that the labels make of each brick. Nothing of some.
    cells: FxHashMap<[i32; 3], Option<Box<BrickSurface>>>,
    /// Bricks whose labels have changed since then.
    relabelled: FxHashSet<[i32; 3]>,
    /// Amount that was labelled last.
    pub renewed: Renewed,
}

impl Bricks {
    /// Notes the bricks in which bundles have changed.
    pub fn note(&mut self, changed: FxHashSet<[i32; 3]>) {
        self.changed.extend(changed);
    }

    /// Labels the bricks whose votes have changed, or all.
    ///
    /// # Errors
    /// Cancelled: nothing has changed then.
    pub fn label(
        &mut self,
        bundles: &Bundles,
        rule: VoteRule,
        gains: Gains,
        lattice: &Lattice,
        progress: &Progress<'_>,
    ) -> Result<()> {
        let bricks = bundles.labelled_bricks();
        // If a scan is new or gone, the bundles have changed; votes come from bricks beside a brick, at most.
        let is_known = self.basis.as_ref().is_some_and(|(of_lattice, of_rule, of_gains)| {
            (of_lattice, of_rule) == (lattice, &rule) && of_gains.agree_with(&gains)
        });
        let todo: Vec<[i32; 3]> = match is_known {
            true => {
                bricks.par_iter().copied().filter(|&brick| around(brick).any(|at| self.changed.contains(&at))).collect()
            }
            false => bricks.clone(),
        };
        self.renewed = Renewed { bricks: todo.len(), of: bricks.len() };
        progress.stage(LABELLING, todo.len() as u64);
        let found = fuse::label_nodes(bundles, todo, &rule, &gains, progress)?;
        let gone: Vec<[i32; 3]> =
            self.labels.keys().filter(|brick| bricks.binary_search(brick).is_err()).copied().collect();
        for (brick, labelled) in found.into_iter().chain(gone.into_iter().map(|brick| (brick, None))) {
            let (labels, vertices) = labelled.unzip();
            let is_same = match (&labels, self.labels.get(&brick)) {
                (Some(new), Some(old)) => new == old,
                (None, None) => true,
                _ => false,
            };
            if !is_same {
                self.relabelled.insert(brick);
            }
            set(&mut self.labels, brick, labels);
            set(&mut self.vertices, brick, vertices);
        }
        self.basis = Some((*lattice, rule, gains));
        self.changed.clear();
        Ok(())
    }

    /// The surface that the labels make of each brick, in order, taken out, to be put back.
    ///
    /// # Errors
    /// Cancelled: nothing has changed then.
    pub fn analyse(&mut self, progress: &Progress<'_>) -> Result<Vec<Box<BrickSurface>>> {
        let bricks = tiles::bricks(&self.labels);
        let is_new = |brick: &[i32; 3]| {
            !self.cells.contains_key(brick) || around(*brick).any(|at| self.relabelled.contains(&at))
        };
        let todo: Vec<[i32; 3]> = bricks.par_iter().copied().filter(is_new).collect();
        let found = tiles::analyse(todo.clone(), &self.labels, progress)?;
        self.cells.retain(|brick, _| bricks.binary_search(brick).is_ok());
        self.cells.extend(todo.into_iter().zip(found));
        self.relabelled.clear();
        Ok(bricks.iter().filter_map(|brick| self.cells.get_mut(brick)?.take()).collect())
    }

    /// Puts back what was taken out.
    pub fn put_back(&mut self, cells: Vec<Box<BrickSurface>>) {
        self.cells.extend(cells.into_iter().map(|cells| (cells.brick, Some(cells))));
    }
}

fn set<T>(all: &mut FxHashMap<[i32; 3], T>, brick: [i32; 3], value: Option<T>) {
    match value {
        Some(value) => all.insert(brick, value),
        None => all.remove(&brick),
    };
}

/// A brick and those beside it.
fn around([x, y, z]: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    (0..27).map(move |i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1])
}
