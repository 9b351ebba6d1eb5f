//! A merge of more scans than memory holds: the same stages with the same results, to the bit, but what they leave for each other is in
//! files of a workspace, and of the grid a few blocks are in memory at a time.
//!
//! | stage | file | leaves |
//! |---|---|---|
//! | 1 | `collect` | segments: crossings of some scans, added up, by block |
//! | 3 | `blocks` | what all scans come to, by block |
//! | | `looks` | of these what scans do not see through |
//! | 4 | `labels` | labels and vertices, by block |
//! | 5 to 7 | `tiles` | the surface, by block |

mod blocks;
mod collect;
mod colours;
mod files;
mod holes;
mod labels;
mod looks;
mod noise;
mod numbers;
mod tiles;
mod whole;
mod write;

use std::path::{Path, PathBuf};

use super::{BUILDING, FUSING, MergeParams, MergeReport, colour, components, defaults, fuse, refuse_nothing, started};
use crate::tiles::Block;
use base::error::{Error, Result};
use base::memory::size;
use base::progress::Progress;
use image::source::{ScanSource, common_crs};
use mesh::sink::MeshSink;

/// Where a merge keeps what memory does not hold, and how much it may hold.
#[derive(Clone, Copy, Debug)]
pub struct Workspace<'a> {
    /// A folder that exists: what is kept there is removed at the end.
    pub folder: &'a Path,
    /// Bytes of memory.
    pub memory: u64,
}

/// Bytes that loading a scan takes, for each of its samples and beside. Measured.
const BYTES_A_SAMPLE: u64 = 160;
const SCAN: u64 = 1 << 20;
/// Bytes that a brick takes, with those around a block and what is made of it: a block has some twice as many with a part of the surface as
/// it has along two sides. Measured.
const BYTES_A_BRICK: f64 = 0.75e6;

/// Merges scans, of which there may be more than memory holds, into one surface, which is handed to `sink`: the same as [`super::run`] gives.
///
/// # Errors
/// As [`super::run`]; a file can't be written; the sink's.
pub fn run(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    workspace: Workspace<'_>,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    started(sources, params, progress, || {
        let folder = tempfile::Builder::new().prefix("surfrecon-").tempdir_in(workspace.folder);
        let folder = folder.map_err(|error| Error::io(workspace.folder, error))?;
        merge(sources, params, &Setting::of(folder.path(), workspace.memory), sink, progress)
    })
    .map(|(report, _)| report)
}

/// The folder, and what follows from the memory there is.
struct Setting<'a> {
    folder: &'a Path,
    cut: Cut,
    /// Bytes that all may take.
    memory: u64,
    /// Bytes of crossings that a worker holds.
    held: u64,
    /// Crossings of all scans up to which overlaps are measured by all of them.
    kept: u64,
    corner: [i64; 3],
}

impl<'a> Setting<'a> {
    fn of(folder: &'a Path, memory: u64) -> Self {
        let workers = rayon::current_num_threads() as u64;
        let each = memory / workers;
        let side = (each as f64 / (2.0 * BYTES_A_BRICK)).sqrt() as i32;
        Setting {
            folder,
            cut: Cut { side: side.clamp(2, 64) },
            memory,
            held: (each / 6).max(1 << 20),
            kept: crate::bundles::MANY,
            corner: [0; 3],
        }
    }

    /// How many scans of so many samples may be loaded at a time.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]: not one.
    fn workers(&self, samples: usize) -> Result<usize> {
        let each = SCAN + BYTES_A_SAMPLE * samples as u64 + self.held;
        match self.memory / each {
            0 => Err(Error::OutOfMemory(format!(
                "scans of {samples} samples need {} or more even in files, {} are allowed",
                size(each as f64),
                size(self.memory as f64)
            ))),
            workers => Ok((workers as usize).min(rayon::current_num_threads())),
        }
    }

    fn path(&self, kind: &str, number: u32) -> PathBuf {
        self.folder.join(format!("{kind}-{number:06}"))
    }
}

/// How space is cut into blocks: cubes of so many bricks a side.
#[derive(Clone, Copy, Debug)]
struct Cut {
    side: i32,
}

impl Cut {
    /// The block that a brick is in, along an axis.
    fn of(&self, brick: i32) -> i32 {
        brick.div_euclid(self.side)
    }

    fn block(&self, block: [i32; 3]) -> Block {
        Block::around(block.map(|at| at * self.side), self.side)
    }

    /// Blocks that have bricks within so many of a block, itself among them.
    fn around(&self, block: [i32; 3], bricks: i32) -> impl Iterator<Item = [i32; 3]> + use<> {
        let reach = (bricks + self.side - 1).div_euclid(self.side);
        let wide = 2 * reach + 1;
        (0..wide * wide * wide).map(move |i| {
            let by = [i / (wide * wide), i / wide % wide, i % wide];
            [0, 1, 2].map(|axis| block[axis] + by[axis] - reach)
        })
    }

    /// Whether a brick is in a block or at most so many bricks beside it.
    fn is_near(&self, brick: [i32; 3], block: [i32; 3], bricks: i32) -> bool {
        (0..3).all(|i| {
            let low = block[i] * self.side;
            (low - bricks..low + self.side + bricks).contains(&brick[i])
        })
    }
}

/// The paper's list of steps.
fn merge(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    setting: &Setting<'_>,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    let mut report = MergeReport { scans: sources.len(), ..MergeReport::default() };
    let content = |place: usize| sources[place].content(&params.triangulation, progress);
    let order = crate::numbers::in_order(sources, content, progress)?;
    let sources: Vec<&dyn ScanSource> = order.iter().map(|&place| sources[place]).collect();
    let versions: Vec<u64> = order.iter().map(|&place| place as u64).collect();
    report.scan_names = sources.iter().map(|s| s.name().to_owned()).collect();
    defaults::choose_cell(&sources, &versions, params, &mut defaults::Known::default(), &mut report, progress)?;
    let collected = collect::collect(&sources, params, report.voxel, setting, progress)?;
    let found = &collected.found;
    found.tell(&mut report);
    report.intersections = collected.intersections;
    progress.lap("discretize");
    progress.stage(FUSING, collected.steps());
    let distances = collected.distances(sources.len(), setting.kept, progress)?;
    let reaches = fuse::Reaches::of(&distances, params, &mut report);
    progress.lap("overlap");
    let mut blocks = blocks::Blocks::fuse(&collected, setting, progress)?;
    collected.remove();
    progress.lap("sort");
    let tolerance = reaches.tolerance * report.voxel;
    report.seen_through = looks::drop_seen_through(&mut blocks, &sources, found, tolerance, setting, progress)?;
    progress.lap("sight");
    if params.match_exposure && found.coloured {
        report.colour_gains = blocks.gains(sources.len(), progress)?;
        progress.lap("colours");
    }
    let gains = colour::Gains::new(&report.colour_gains);
    let labels = labels::BlockLabels::label(&blocks, &reaches.rule(), &gains, setting, progress)?;
    blocks.remove();
    report.fused_intersections = labels.vertices;
    progress.lap("label");
    progress.stage(BUILDING, 2 * labels.bricks());
    let tiles = tiles::build(&labels, &found.lattice, setting, progress)?;
    labels.remove();
    progress.lap("reconstruct");
    report.artificial_intersections = tiles.iter().map(tiles::TileFile::artificial).sum();
    report.noise = noise::typical(&tiles, progress)?;
    let chosen = components::choose(&tiles[..], reaches.reach, params.min_component_share, &mut report, progress)?;
    let mut whole = whole::Whole::new(tiles, chosen, progress)?;
    progress.lap("components");
    refuse_nothing(whole.triangles(), report.voxel, params.min_component_share)?;
    holes::close(&mut whole, &found.lattice, params, setting, &mut report, progress)?;
    let colours = if found.coloured { Some(colours::fill_in(&whole, progress)?) } else { None };
    progress.lap("holes");
    report.faces = write::write(&whole, colours.as_ref(), common_crs(&sources)?, sink, progress)?;
    progress.lap("write");
    report.seconds = progress.seconds();
    Ok(report)
}

#[cfg(test)]
mod tests;
