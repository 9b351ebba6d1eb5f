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

use std::fs::{File, TryLockError};
use std::hash::{Hash as _, Hasher as _};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use rustc_hash::FxHasher;

use super::{BUILDING, FUSING, MergeParams, MergeReport, colour, components, defaults, fuse, refuse_nothing, started};
use crate::lattice::Lattice;
use crate::overlap::OverlapDistances;
use crate::tiles::Block;
use base::error::{Error, Result};
use base::memory::size;
use base::progress::Progress;
use blocks::Blocks;
use collect::About;
use files::{Columns, Place, Stored, damaged};
use image::source::{ScanSource, common_crs};
use labels::BlockLabels;
use mesh::sink::MeshSink;

/// Bytes of memory that a worker needs.
pub const LEAST: u64 = 12_000_000;

/// Where a merge keeps what memory does not hold, and how much it may hold.
#[derive(Clone, Copy, Debug)]
pub struct Workspace<'a> {
    /// A folder that exists: what is kept there, in a folder of its own, is removed at the end.
    pub folder: &'a Path,
    /// Bytes of memory.
    pub memory: u64,
    /// What the scans are, in a number that is another where any of them is another: then what is complete of a merge that was stopped is
    /// kept, and the next of the same scans with the same parameters goes on from there.
    pub scans: Option<u64>,
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
/// As [`super::run`]; a file can't be written; another merge of the same scans is at work in the folder; the sink's.
pub fn run(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    workspace: Workspace<'_>,
    sink: &mut dyn MeshSink,
    progress: &Progress<'_>,
) -> Result<MergeReport> {
    started(sources, params, progress, || {
        let Some(scans) = workspace.scans else {
            let folder = tempfile::Builder::new().prefix("surfrecon-merge-").tempdir_in(workspace.folder);
            let folder = folder.map_err(|error| Error::io(workspace.folder, error))?;
            return merge(sources, params, &Setting::of(folder.path(), workspace.memory), sink, progress);
        };
        let (folder, _lock) = kept_folder(workspace.folder, scans, params)?;
        let mut setting = Setting::of(&folder, workspace.memory);
        setting.cut = Cut { side: setting.recall("cut", || Ok(vec![setting.cut.side.into()]))?[0] as i32 };
        let report = merge(sources, params, &setting, sink, progress)?;
        std::fs::remove_dir_all(&folder).map_err(|error| Error::io(&folder, error))?;
        Ok(report)
    })
    .map(|(report, _)| report)
}

/// The folder of a merge that is kept where it is stopped, and what nobody else has as long as it is held.
fn kept_folder(folder: &Path, scans: u64, params: &MergeParams) -> Result<(PathBuf, File)> {
    let mut hasher = FxHasher::default();
    // Of the threads nothing depends.
    let params = MergeParams { threads: 0, ..*params };
    (scans, format!("{params:?}"), env!("CARGO_PKG_VERSION"), cfg!(target_endian = "big")).hash(&mut hasher);
    let folder = folder.join(format!("surfrecon-merge-{:016x}", hasher.finish()));
    let failed = |error| Error::io(&folder, error);
    if let Err(error) = std::fs::create_dir(&folder)
        && error.kind() != ErrorKind::AlreadyExists
    {
        return Err(failed(error));
    }
    let lock = File::create(folder.join("lock")).map_err(failed)?;
    match lock.try_lock() {
        Ok(()) => Ok((folder, lock)),
        Err(TryLockError::WouldBlock) => Err(Error::input(format!(
            "{}: another merge of the same scans is at work here: wait for it, or choose another workspace",
            folder.display()
        ))),
        Err(TryLockError::Error(error)) => Err(failed(error)),
    }
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

    /// The files of a kind that are complete, with their numbers, in order.
    fn files(&self, kind: &str) -> Result<Vec<(u32, PathBuf)>> {
        let failed = |error| Error::io(self.folder, error);
        let mut files = Vec::new();
        for file in self.folder.read_dir().map_err(failed)? {
            let path = file.map_err(failed)?.path();
            let name = path.file_name().and_then(|name| name.to_str());
            if let Some(number) = name.and_then(|name| name.strip_prefix(kind)?.strip_prefix('-')?.parse().ok()) {
                files.push((number, path));
            }
        }
        files.sort_unstable();
        Ok(files)
    }

    /// Removes the files of a kind.
    fn remove(&self, kind: &str) -> Result<()> {
        let remove = |(_, path): (u32, PathBuf)| std::fs::remove_file(&path).map_err(|error| Error::io(&path, error));
        self.files(kind)?.into_iter().try_for_each(remove)
    }

    /// The numbers that a stage has left, which is complete then; else those that `find` finds are kept.
    fn recall(&self, stage: &str, find: impl FnOnce() -> Result<Vec<f64>>) -> Result<Vec<f64>> {
        let path = self.folder.join(stage);
        if path.exists() {
            let (stored, table) = Stored::open::<Place>(&path)?;
            return stored.get(table.first().ok_or_else(|| damaged(&path))?);
        }
        let numbers = find()?;
        let mut file = Columns::new(&path)?;
        let place = file.put(&numbers)?;
        file.finish(&[place])?;
        Ok(numbers)
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
    let Fused { about, distances, mut blocks } = fused(&sources, params, report.voxel, setting, progress)?;
    let found = &about.found;
    found.tell(&mut report);
    report.intersections = about.intersections;
    let reaches = fuse::Reaches::of(&distances, params, &mut report);
    let seen = setting.recall("seen", || {
        let tolerance = reaches.tolerance * report.voxel;
        let mut seen = vec![looks::drop_seen_through(&blocks, &sources, found, tolerance, setting, progress)? as f64];
        progress.lap("sight");
        blocks.show(setting)?;
        if params.match_exposure && found.coloured {
            seen.extend(blocks.gains(sources.len(), progress)?.as_flattened());
            progress.lap("colours");
        }
        Ok(seen)
    })?;
    report.seen_through = seen[0] as u64;
    report.colour_gains = seen[1..].chunks_exact(3).map(|of| [of[0], of[1], of[2]]).collect();
    blocks.show(setting)?;
    let gains = colour::Gains::new(&report.colour_gains);
    let labelled = setting.recall("labelled", || {
        BlockLabels::label(&blocks, &reaches.rule(), &gains, setting, progress)?;
        Ok(vec![BlockLabels::open(setting)?.vertices() as f64])
    })?;
    report.fused_intersections = labelled[0] as u64;
    ["block", "left"].into_iter().try_for_each(|kind| setting.remove(kind))?;
    let labels = BlockLabels::open(setting)?;
    progress.lap("label");
    progress.stage(BUILDING, 2 * labels.bricks());
    setting.recall("built", || tiles::build(&labels, &found.lattice, setting, progress).map(|_| Vec::new()))?;
    setting.remove("labels")?;
    let tiles = tiles::open(setting)?;
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

/// What the crossings of all scans come to.
struct Fused {
    about: About,
    distances: OverlapDistances,
    blocks: Blocks,
}

/// Stages 1 and 3.
fn fused(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    voxel: f64,
    setting: &Setting<'_>,
    progress: &Progress<'_>,
) -> Result<Fused> {
    let numbers = setting.recall("fused", || {
        let collected = collect::collect(sources, params, voxel, setting, progress)?;
        progress.lap("discretize");
        progress.stage(FUSING, collected.steps());
        let distances = collected.distances(sources.len(), setting.kept, progress)?.to_numbers();
        progress.lap("overlap");
        Blocks::fuse(&collected, setting, progress)?;
        let mut numbers: Vec<f64> = collected.about.found.lattice.base.map(|at| at as f64).to_vec();
        numbers.push(distances.len() as f64);
        numbers.extend(distances);
        numbers.extend(collected.about.to_numbers());
        Ok(numbers)
    })?;
    setting.remove("segment")?;
    let told = |numbers: &[f64]| {
        let (&[x, y, z, count], rest) = numbers.split_first_chunk()?;
        let (distances, about) = rest.split_at_checked(count as usize)?;
        let lattice = Lattice { voxel, base: [x, y, z].map(|at| at as i64) };
        Some((About::from_numbers(lattice, about)?, OverlapDistances::from_numbers(distances)?))
    };
    let (about, distances) = told(&numbers).ok_or_else(|| damaged(&setting.folder.join("fused")))?;
    let blocks = Blocks::open(setting)?;
    progress.lap("sort");
    Ok(Fused { about, distances, blocks })
}

#[cfg(test)]
mod tests;
