//! Crossings fused line by line and nodes labelled by them, as the paper has it: what the merge is compared with in tests and
//! benchmarks. \[MI04, sec. 3.2 and 3.3\]
//!
//! It agrees with the merge wherever one clean scan covers. It does not average noise: crossings of different lines are
//! fused by themselves, and folds of a noisy scan stay.

mod classify;
mod fuse;

use std::sync::Arc;

use rayon::prelude::*;

use crate::crossings::bundles::RawBundle;
use crate::crossings::crossing::Crossing;
use crate::crossings::lattice::{ACROSS, BRICK, BRICK_BITS};
use crate::driver::{Built, Graph, Stage};
use crate::field::{BrickVertices, Labels};
use crate::field::{Bundles, Vertex, Vertices};
use crate::intake::setup::Setup;
use crate::params::MergeParams;
use crate::report::Merged;
use crate::run::memory::Memory;
use crate::run::started::{started, surface};
use crate::surface::tile::Tile;
use base::error::Result;
use base::progress::Progress;
use classify::Classifier;
use image::source::ScanSource;

pub use fuse::Rule;

/// Merges as [`crate::merge`] does, by the paper's rule of fusing.
///
/// # Errors
/// As [`crate::merge`].
pub fn run(sources: &[&dyn ScanSource], params: &MergeParams, progress: &Progress<'_>) -> Result<Merged> {
    let setup = Setup { kept: u64::MAX, ..Setup::default() };
    started(sources, params, progress, || surface(&mut ByLines(Memory::new(sources, params, &setup)), params, progress))
}

/// A merge whose crossings become labels at once.
struct ByLines<'a>(Memory<'a>);

impl Graph for ByLines<'_> {
    type Tiles = Vec<Tile>;

    fn run(&mut self, stage: Stage, progress: &Progress<'_>) -> Result<()> {
        let Self(memory) = self;
        match stage {
            Stage::Fuse | Stage::Look | Stage::Drop | Stage::Colours => Ok(()),
            Stage::Label => {
                let full_trust = f64::from(memory.found().full_trust);
                let rule = Rule { merge_distance: memory.reaches().reach, full_trust };
                (memory.labels, memory.vertices) = label_nodes(std::mem::take(&mut memory.raw), rule, progress)?;
                memory.labelled(progress)
            }
            _ => memory.run(stage, progress),
        }
    }

    fn finished(&mut self) -> Result<Built<'_, Vec<Tile>>> {
        self.0.finished()
    }
}

/// Fuses the crossings of each line, and labels the nodes by them.
fn label_nodes(raw: Vec<RawBundle>, rule: Rule, progress: &Progress<'_>) -> Result<(Labels, BrickVertices)> {
    let fuse = |raw| {
        progress.advance(1)?;
        Ok(Arc::new(fuse::fuse(raw, rule)))
    };
    let bundles = Bundles::new(raw.into_par_iter().map(fuse).collect::<Result<_>>()?);
    let bricks = bundles.labelled_bricks();
    progress.stage(crate::stages::LABELLING, bricks.len() as u64);
    let found = bricks
        .into_par_iter()
        .map_init(Classifier::default, |classifier, brick| {
            progress.advance(1)?;
            let labels = classifier.label(&bundles, brick);
            Ok(labels.map(|labels| ((brick, labels), (brick, vertices(&bundles, brick)))))
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.into_iter().flatten().unzip())
}

/// A vertex for every crossing of a brick's edges.
fn vertices(bundles: &Bundles<Crossing>, brick: [i32; 3]) -> Vertices {
    [0, 1, 2].map(|axis| {
        let [u, v] = ACROSS[axis];
        let crossings = bundles.through(axis, brick).map_or(&[][..], |bundle| bundle.in_brick(brick[axis]));
        let vertex = |crossing: &Crossing| {
            let line = crossing.line() as i32;
            let mut at = [0; 3];
            (at[axis], at[u], at[v]) = (crossing.cell & (BRICK - 1), line & (BRICK - 1), line >> BRICK_BITS);
            Vertex {
                node: (at[0] | at[1] << BRICK_BITS | at[2] << (2 * BRICK_BITS)) as u16,
                enters: crossing.enters(),
                fraction: crossing.fraction,
                weight: crossing.weight,
                noise: crossing.deviation() as f32,
                colour: crossing.colour,
                scan: crossing.scan() as i32,
            }
        };
        crossings.iter().map(vertex).collect()
    })
}
