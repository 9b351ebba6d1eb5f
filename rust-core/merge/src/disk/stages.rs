//! The stages of a merge in files as tasks, which any process may do that has the folder and the scans.
//!
//! A task leaves its files and last a mark with a few numbers. It may be done twice, at once too: what it leaves is the same, and the first
//! mark stays. So one that was stopped is done again, and one that is done is not.

use super::blocks::Blocks;
use super::collect::{self, Grid};
use super::files::damaged;
use super::labels::BlockLabels;
use super::looks;
use super::segments::{self, About, Collected};
use super::setting::{Cut, Portion, Setting};
use super::tiles;
use crate::fuse::Reaches;
use crate::lattice::Lattice;
use crate::overlap::OverlapDistances;
use crate::{FUSING, MergeParams, MergeReport, VoxelReason, colour, defaults, numbers};
use base::error::{Error, Result};
use base::progress::Progress;
use image::source::{Loading, ScanSource};

base::choices! {
    /// The stages of a merge in files. Tasks of a stage need nothing of each other, and all of the stages before.
    pub enum Stage {
        /// The order of the scans, the size of the cells, where they lie.
        Plan = "plan" "Plan",
        /// Crossings of some scans with the grid.
        Collect = "collect" "Collect",
        /// How far scans lie from each other.
        Overlap = "overlap" "Overlap",
        /// What all scans come to in some blocks of the grid.
        Fuse = "fuse" "Fuse",
        /// What some scans see through.
        Look = "look" "Look",
        /// What most see through goes, in some blocks.
        Drop = "drop" "Drop",
        /// How bright scans are beside each other.
        Colours = "colours" "Colours",
        /// Inside and outside, in some blocks.
        Label = "label" "Label",
        /// The surface in some blocks.
        Build = "build" "Build",
    }
}

impl Stage {
    /// Of how many tasks it is where stages are cut into so many; some are one task.
    pub fn tasks(self, portions: u32) -> u32 {
        match self {
            Stage::Plan | Stage::Overlap | Stage::Colours => 1,
            _ => portions,
        }
    }
}

/// A merge in a folder, whose stages are done task by task.
pub struct Tasks<'a> {
    pub sources: &'a [&'a dyn ScanSource],
    pub params: &'a MergeParams,
    pub setting: Setting<'a>,
    /// Into how many tasks a stage is cut.
    pub portions: u32,
}

/// What was found out before scans are collected.
struct Planned {
    grid: Grid,
    reason: VoxelReason,
    cut: Cut,
    /// Places of the scans in the list, by number.
    order: Vec<usize>,
}

/// What scans come to, but for their crossings.
pub struct Known<'a> {
    /// The scans by number.
    pub sources: Vec<&'a dyn ScanSource>,
    pub about: About,
    pub reaches: Reaches,
    pub report: MergeReport,
}

impl<'a> Tasks<'a> {
    /// Does a task, unless that is done.
    ///
    /// # Errors
    /// Tasks before it are not done; a scan can't be loaded; a file can't be read or written; cancelled.
    pub fn run(&mut self, stage: Stage, number: u32, progress: &Progress<'_>) -> Result<()> {
        if self.is_done(stage, number) {
            return Ok(());
        }
        match self.done_by(stage, number, progress).and_then(|found| self.setting.keep(&mark(stage), number, &found)) {
            // Somebody else was at it, has done it, and taken away what it needs.
            Err(_) if self.is_done(stage, number) => Ok(()),
            done => done,
        }
    }

    fn is_done(&self, stage: Stage, number: u32) -> bool {
        self.setting.path(&mark(stage), number).exists()
    }

    fn done_by(&mut self, stage: Stage, number: u32, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let portion = Portion { number, of: stage.tasks(self.portions) };
        if stage == Stage::Plan {
            return self.plan(progress);
        }
        let planned = self.planned()?;
        self.setting.cut = planned.cut;
        match stage {
            Stage::Plan => unreachable!("it is not planned"),
            Stage::Collect => self.collect(&planned, portion, progress),
            Stage::Overlap => self.overlap(&planned, progress),
            Stage::Fuse => self.fuse(&planned, portion, progress),
            Stage::Look => self.look(planned, portion, progress),
            Stage::Drop => self.drop(portion, progress),
            Stage::Colours => self.colours(planned, progress),
            Stage::Label => self.label(planned, portion, progress),
            Stage::Build => self.build(&planned, portion, progress),
        }
    }

    /// The numbers that the tasks of a stage have left.
    fn all(&self, stage: Stage) -> Result<Vec<Vec<f64>>> {
        let of = |number| {
            self.setting.recall(&mark(stage), number)?.ok_or_else(|| {
                let of = stage.tasks(self.portions);
                let folder = self.setting.folder.display();
                Error::input(format!("{folder}: {} {number} of {of} tasks is not done: do it first", stage.name()))
            })
        };
        (0..stage.tasks(self.portions)).map(of).collect()
    }

    /// The numbers of a stage of one task.
    fn of_one(&self, stage: Stage) -> Result<Vec<f64>> {
        Ok(self.all(stage)?.concat())
    }

    fn plan(&self, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let Tasks { sources, params, setting, .. } = self;
        let content = |place: usize| sources[place].content(&params.triangulation, progress);
        let order = numbers::in_order(sources, content, progress)?;
        let sources: Vec<&dyn ScanSource> = order.iter().map(|&place| sources[place]).collect();
        let versions: Vec<u64> = order.iter().map(|&place| place as u64).collect();
        let mut report = MergeReport::default();
        defaults::choose_cell(&sources, &versions, params, &mut defaults::Known::default(), &mut report, progress)?;
        let loading = Loading { triangulation: params.triangulation, cell: report.voxel };
        let grid = Grid::of_first(&sources, &loading, setting.corner, progress)?;
        setting.workers(grid.samples)?;
        let planned = Planned { grid, reason: report.voxel_reason, cut: setting.cut, order };
        Ok(planned.to_numbers())
    }

    fn planned(&self) -> Result<Planned> {
        let numbers = self.of_one(Stage::Plan)?;
        let path = self.setting.path(&mark(Stage::Plan), 0);
        let planned = Planned::from_numbers(&numbers).ok_or_else(|| damaged(&path))?;
        let (before, now) = (planned.order.len(), self.sources.len());
        if before != now {
            let folder = self.setting.folder.display();
            return Err(Error::input(format!("{folder}: this merge was planned for {before} scans, not for {now}")));
        }
        Ok(planned)
    }

    fn in_order(&self, planned: &Planned) -> Vec<&'a dyn ScanSource> {
        planned.order.iter().map(|&place| self.sources[place]).collect()
    }

    fn collect(&self, planned: &Planned, portion: Portion, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let sources = self.in_order(planned);
        let triangulation = &self.params.triangulation;
        let found = collect::collect(&sources, triangulation, &planned.grid, portion, &self.setting, progress)?;
        progress.lap("discretize");
        Ok(found.into_iter().map(f64::from).collect())
    }

    fn collected(&self, planned: &Planned) -> Result<Collected> {
        let whole = |numbers: Vec<f64>| numbers.into_iter().map(|number| number as u32).collect();
        let segments: Vec<Vec<u32>> = self.all(Stage::Collect)?.into_iter().map(whole).collect();
        Collected::open(&segments, planned.grid.lattice, &self.setting)
    }

    fn overlap(&self, planned: &Planned, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let collected = self.collected(planned)?;
        if collected.about.found.triangles == 0 {
            return Err(crate::nothing_to_merge());
        }
        progress.stage(FUSING, collected.rows() as u64);
        let distances = collected.distances(self.sources.len(), self.setting.kept, progress)?.to_numbers();
        progress.lap("overlap");
        let mut numbers = vec![distances.len() as f64];
        numbers.extend(distances);
        numbers.extend(collected.about.to_numbers());
        Ok(numbers)
    }

    fn fuse(&self, planned: &Planned, portion: Portion, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let collected = self.collected(planned)?;
        Blocks::fuse(&collected, portion, &self.setting, progress)?;
        progress.lap("sort");
        Ok(Vec::new())
    }

    /// What is known once scans have been compared.
    ///
    /// # Errors
    /// A task before is not done; a file can't be read.
    pub fn known(&self) -> Result<Known<'a>> {
        self.compared(self.planned()?)
    }

    fn compared(&self, planned: Planned) -> Result<Known<'a>> {
        let numbers = self.of_one(Stage::Overlap)?;
        let told = |numbers: &[f64]| {
            let (&count, rest) = numbers.split_first()?;
            let (distances, about) = rest.split_at_checked(count as usize)?;
            let about = About::from_numbers(planned.grid.lattice, about)?;
            Some((OverlapDistances::from_numbers(distances)?, about))
        };
        let told = told(&numbers).ok_or_else(|| damaged(&self.setting.path(&mark(Stage::Overlap), 0)));
        let (distances, about) = told?;
        let sources = self.in_order(&planned);
        let mut report = MergeReport {
            scans: sources.len(),
            scan_names: sources.iter().map(|scan| scan.name().to_owned()).collect(),
            voxel: planned.grid.lattice.voxel,
            voxel_reason: planned.reason,
            intersections: about.intersections,
            ..MergeReport::default()
        };
        about.found.tell(&mut report);
        let reaches = Reaches::of(&distances, self.params, &mut report);
        Ok(Known { sources, about, reaches, report })
    }

    fn look(&self, planned: Planned, portion: Portion, progress: &Progress<'_>) -> Result<Vec<f64>> {
        self.all(Stage::Fuse)?;
        if portion.number == 0 {
            segments::remove(self.portions, &self.setting)?;
        }
        let Known { sources, about, reaches, report } = self.compared(planned)?;
        let tolerance = reaches.tolerance * report.voxel;
        let blocks = Blocks::open(&self.setting)?;
        looks::look(&blocks, &sources, &about.found, tolerance, portion, &self.setting, progress)?;
        progress.lap("sight");
        Ok(Vec::new())
    }

    fn drop(&self, portion: Portion, progress: &Progress<'_>) -> Result<Vec<f64>> {
        self.all(Stage::Look)?;
        let blocks = Blocks::open(&self.setting)?;
        let dropped = looks::drop_seen_through(&blocks, self.portions, portion, &self.setting, progress)?;
        progress.lap("sight");
        Ok(vec![dropped as f64])
    }

    /// What is left of the blocks.
    fn left(&self) -> Result<Blocks> {
        let mut blocks = Blocks::open(&self.setting)?;
        blocks.show(&self.setting)?;
        Ok(blocks)
    }

    fn colours(&self, planned: Planned, progress: &Progress<'_>) -> Result<Vec<f64>> {
        self.all(Stage::Drop)?;
        looks::remove(self.portions, &self.setting)?;
        if !self.params.match_exposure || !self.compared(planned)?.about.found.coloured {
            return Ok(Vec::new());
        }
        let gains = self.left()?.gains(self.sources.len(), progress)?;
        progress.lap("colours");
        Ok(gains.into_flattened())
    }

    fn gains(&self) -> Result<Vec<[f64; 3]>> {
        Ok(self.of_one(Stage::Colours)?.as_chunks().0.to_vec())
    }

    fn label(&self, planned: Planned, portion: Portion, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let gains = colour::Gains::new(&self.gains()?);
        let rule = self.compared(planned)?.reaches.rule();
        BlockLabels::label(&self.left()?, &rule, &gains, portion, &self.setting, progress)?;
        progress.lap("label");
        Ok(Vec::new())
    }

    fn build(&self, planned: &Planned, portion: Portion, progress: &Progress<'_>) -> Result<Vec<f64>> {
        self.all(Stage::Label)?;
        if portion.number == 0 {
            ["block", "left"].into_iter().try_for_each(|kind| self.setting.remove(kind))?;
        }
        let labels = BlockLabels::open(&self.setting)?;
        tiles::build(&labels, &planned.grid.lattice, portion, &self.setting, progress)?;
        progress.lap("reconstruct");
        Ok(vec![labels.vertices() as f64])
    }

    /// What the tasks have found out, with the figures of the merge so far; nothing but tiles is needed any more.
    ///
    /// # Errors
    /// A task is not done; a file can't be read or removed.
    pub fn finished(&self) -> Result<Known<'a>> {
        let mut known = self.known()?;
        let report = &mut known.report;
        report.seen_through = self.all(Stage::Drop)?.concat().iter().sum::<f64>() as u64;
        report.colour_gains = self.gains()?;
        report.fused_intersections = self.all(Stage::Build)?[0].first().map_or(0, |&vertices| vertices as u64);
        self.setting.remove("labels")?;
        Ok(known)
    }
}

/// What the marks of a stage's tasks are called.
fn mark(stage: Stage) -> String {
    format!("done-{}", stage.name())
}

impl Planned {
    fn to_numbers(&self) -> Vec<f64> {
        let Planned { grid: Grid { lattice: Lattice { voxel, base }, samples }, reason, cut, order } = self;
        let [x, y, z] = base.map(|at| at as f64);
        let mut numbers = vec![*voxel, x, y, z, *samples as f64, *reason as usize as f64, cut.side.into()];
        numbers.extend(order.iter().map(|&place| place as f64));
        numbers
    }

    fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (&[voxel, x, y, z, samples, reason, side], order) = numbers.split_first_chunk()?;
        Some(Planned {
            grid: Grid { lattice: Lattice { voxel, base: [x, y, z].map(|at| at as i64) }, samples: samples as usize },
            reason: *VoxelReason::ALL.get(reason as usize)?,
            cut: Cut { side: side as i32 },
            order: order.iter().map(|&place| place as usize).collect(),
        })
    }
}
