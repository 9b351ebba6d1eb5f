//! The stages of a merge in files as tasks, which any process may do that has the folder and the scans.
//!
//! A task leaves its files and last a mark with a few numbers. It may be done twice, at once too: what it leaves is the same, and the first
//! mark stays. So one that was stopped is done again, and one that is done is not.

use std::path::PathBuf;

use bytemuck::{AnyBitPattern, NoUninit};
use rustc_hash::FxHashSet;

use super::blocks::{self, Blocks};
use super::collect::{self, Collecting, Grid};
use super::files::damaged;
use super::labels::{self, BlockLabels};
use super::room;
use super::segments::{self, About, Collected, Segment};
use super::setting::{self, Cut, Key, Named, Portion, Setting};
use super::tiles::{self, TileFile};
use super::visibility::{self, Voters};
use crate::crossings::edge_colours::Gains;
use crate::crossings::lattice::Lattice;
use crate::crossings::scan_order;
use crate::crossings::scan_order::ScanOrder;
use crate::driver::{Built, Graph, Stage};
use crate::field::fuse::Reaches;
use crate::intake::Discretized;
use crate::intake::overlap::OverlapDistances;
use crate::intake::{damage, defaults};
use crate::params::MergeParams;
use crate::report::{MergeReport, VoxelReason};
use crate::stages::FUSING;
use crate::visibility::eyes::Eyes;
use base::error::{Error, Result};
use base::progress::Progress;
use image::source::{Loading, ScanSource, common_crs};

/// A merge in a folder, whose stages are done task by task.
pub struct Tasks<'a> {
    pub sources: &'a [&'a dyn ScanSource],
    /// A number for each scan that no other has.
    pub versions: Vec<u64>,
    pub params: &'a MergeParams,
    pub setting: Setting<'a>,
    /// Into how many tasks a stage is cut.
    pub portions: u32,
}

/// Findings before scans are collected.
struct Planned<'a> {
    grid: Grid,
    reason: VoxelReason,
    cut: Cut,
    /// The scans, as places in the list.
    order: Vec<usize>,
    scan_order: ScanOrder<'a>,
    /// Basis that crossings follow from besides the scans.
    basis: Key,
}

/// Findings about scans, but for their crossings.
struct Known {
    about: About,
    reaches: Reaches,
    report: MergeReport,
}

impl<'a> Tasks<'a> {
    /// Does a task, unless that is done.
    ///
    /// # Errors
    /// Tasks before it are not done. A scan can't be loaded. A file can't be read or written. Cancelled.
    pub fn task(&mut self, stage: Stage, number: u32, progress: &Progress<'_>) -> Result<()> {
        if self.is_done(stage, number) {
            return Ok(());
        }
        match self.done_by(stage, number, progress) {
            // Somebody else was at it, has done it, and taken away what it needs.
            Err(_) if self.is_done(stage, number) => Ok(()),
            done => done,
        }
    }

    /// Begins with what merges before have left: of the marks those are no more true that were of other scans.
    ///
    /// # Errors
    /// Another version has left it. A file can't be read, written or removed.
    pub fn begin(&self) -> Result<()> {
        self.refuse_other_versions()?;
        if self.are_marks_true()? {
            return Ok(());
        }
        self.forget_marks()?;
        self.setting.keep(SCANS, 0, &[self.scans()])
    }

    /// Files may mean another thing to another version.
    fn refuse_other_versions(&self) -> Result<()> {
        let (folder, path) = (self.setting.folder.display(), self.setting.folder.join(VERSION));
        let here =
            format!("{}{}", env!("CARGO_PKG_VERSION"), if cfg!(target_endian = "big") { " (big-endian)" } else { "" });
        let there = match std::fs::read(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Vec::new(),
            there => there.map_err(|error| Error::io(&path, error))?,
        };
        let there: String = String::from_utf8_lossy(&there).trim().chars().take(40).collect();
        if there.is_empty() {
            // One that was stopped at it has left nothing else yet.
            return std::fs::write(&path, &here).map_err(|error| Error::io(&path, error));
        }
        if there != here {
            return Err(Error::input(format!(
                "{folder}: this was kept by surfrecon {there}, which {here} does not go on with: remove the folder, or choose another workspace"
            )));
        }
        Ok(())
    }

    fn scans(&self) -> Key {
        let names: Vec<&str> = self.sources.iter().map(|scan| scan.name()).collect();
        Key::of(&(names, &self.versions, self.portions))
    }

    /// Whether marks, if there are any, are of these scans.
    fn are_marks_true(&self) -> Result<bool> {
        Ok(self.setting.recall::<Key>(SCANS, 0)?.is_some_and(|before| before == [self.scans()]))
    }

    fn forget_marks(&self) -> Result<()> {
        for kind in [SCANS, KNOWN] {
            setting::remove(&self.setting.mark(kind, 0))?;
        }
        let mut marks = Stage::ALL.iter().map(|&stage| self.setting.files(&mark(stage)));
        marks.try_for_each(|files| files?.iter().try_for_each(|path| setting::remove(path)))
    }

    /// Leaves what another merge may find of use, and nothing else.
    ///
    /// # Errors
    /// A file can't be read or removed.
    pub fn end(&self) -> Result<()> {
        if !self.setting.stays {
            return Ok(());
        }
        let planned = self.planned()?;
        let Known { about, reaches, report, .. } = self.compared(&planned)?;
        let voters = Voters::new(&about.found, &planned.scan_order, planned.basis, reaches.tolerance(report.voxel));
        let segments: Vec<Key> = self.all(Stage::Collect)?;
        let left = self.files(Stage::Drop)?.into_iter().filter(|named| named.note > 0).collect();
        let mut used: FxHashSet<PathBuf> = voters.paths(&self.setting).into_iter().collect();
        used.extend(segments.into_iter().map(|key| self.setting.path(segments::KIND, key)));
        for (kind, files) in [
            (blocks::KIND, self.files(Stage::Fuse)?),
            (blocks::LEFT, left),
            (labels::KIND, self.files(Stage::Label)?),
            (tiles::KIND, self.files(Stage::Build)?),
        ] {
            used.extend(files.into_iter().map(|named| self.setting.path(kind, named.key)));
        }
        self.forget_marks()?;
        for kind in
            [segments::KIND, blocks::KIND, blocks::LEFT, visibility::KIND, labels::KIND, tiles::KIND, "unfinished"]
        {
            let others = self.setting.files(kind)?.into_iter().filter(|path| !used.contains(path));
            others.into_iter().try_for_each(|path| setting::remove(&path))?;
        }
        Ok(())
    }

    fn is_done(&self, stage: Stage, number: u32) -> bool {
        self.setting.mark(&mark(stage), number).exists()
    }

    fn done_by(&mut self, stage: Stage, number: u32, progress: &Progress<'_>) -> Result<()> {
        let portion = Portion { number, of: stage.tasks(self.portions) };
        if stage == Stage::Plan {
            let planned = self.plan(progress)?;
            return self.done(stage, number, &planned.to_numbers());
        }
        let planned = self.planned()?;
        self.setting.cut = planned.cut;
        match stage {
            Stage::Plan => unreachable!("it is not planned"),
            Stage::Collect => self.done(stage, number, &self.collect(&planned, portion, progress)?),
            Stage::Overlap => self.done(stage, number, &self.overlap(&planned, progress)?),
            Stage::Fuse => self.done(stage, number, &self.fuse(&planned, portion, progress)?),
            Stage::Look => {
                self.look(&planned, portion, progress)?;
                self.done::<u8>(stage, number, &[])
            }
            Stage::Drop => self.done(stage, number, &self.drop(&planned, portion, progress)?),
            Stage::Colours => self.done(stage, number, &self.colours(&planned, progress)?),
            Stage::Label => self.done(stage, number, &self.label(&planned, portion, progress)?),
            Stage::Build => self.done(stage, number, &self.build(&planned, portion, progress)?),
        }
    }

    /// Marks a task as done, with what it found.
    fn done<T: NoUninit>(&self, stage: Stage, number: u32, found: &[T]) -> Result<()> {
        self.setting.keep(&mark(stage), number, found)
    }

    /// Findings of the tasks of a stage, one after the other.
    fn all<T: AnyBitPattern + NoUninit>(&self, stage: Stage) -> Result<Vec<T>> {
        let of = |number| {
            self.setting.recall(&mark(stage), number)?.ok_or_else(|| {
                let of = stage.tasks(self.portions);
                let folder = self.setting.folder.display();
                Error::input(format!("{folder}: {} {number} of {of} tasks is not done: do it first", stage.name()))
            })
        };
        Ok((0..stage.tasks(self.portions)).map(of).collect::<Result<Vec<Vec<T>>>>()?.concat())
    }

    /// The files that the tasks of a stage have found or made, by block.
    fn files(&self, stage: Stage) -> Result<Vec<Named>> {
        let mut files: Vec<Named> = self.all(stage)?;
        files.sort_unstable();
        Ok(files)
    }

    fn plan(&self, progress: &Progress<'_>) -> Result<Planned<'a>> {
        let Tasks { sources, versions, params, setting, .. } = self;
        let content = |place: usize| sources[place].content(&params.triangulation, progress);
        let order = scan_order::in_order(sources, content, progress)?;
        let scan_order = ScanOrder::new(sources, versions, &order);
        let mut report = MergeReport::default();
        defaults::choose_cell(&scan_order, params, &mut defaults::Known::default(), &mut report, progress)?;
        let loading = Loading { triangulation: params.triangulation, cell: report.voxel };
        let grid = Grid::of_first(&scan_order.sources, &loading, setting.corner, progress)?;
        setting.workers(grid.samples)?;
        room::foresee(&scan_order.sources, &loading, &grid, setting, progress)?;
        // Files that are there are cut as they are.
        let cut = match setting.recall::<i32>(CUT, 0)? {
            Some(side) => Cut { side: side.first().copied().unwrap_or(setting.cut.side) },
            None => setting.cut,
        };
        setting.keep(CUT, 0, &[cut.side])?;
        let basis = self.basis(&grid, cut);
        setting.keep(KNOWN, 0, &collect::usable(&scan_order, basis, grid.lattice, setting)?)?;
        let reason = report.voxel_reason;
        Ok(Planned { grid, reason, cut, order, scan_order, basis })
    }

    fn basis(&self, Grid { lattice: Lattice { voxel, base }, .. }: &Grid, cut: Cut) -> Key {
        let triangulation = format!("{:?}", self.params.triangulation);
        Key::of(&(voxel.to_bits(), base, triangulation, cut.side))
    }

    fn planned(&self) -> Result<Planned<'a>> {
        let numbers: Vec<f64> = self.all(Stage::Plan)?;
        if self.setting.stays && !self.are_marks_true()? {
            let folder = self.setting.folder.display();
            return Err(Error::input(format!(
                "{folder}: a merge of other scans is at work here: plan this one anew after it"
            )));
        }
        let path = self.setting.mark(&mark(Stage::Plan), 0);
        let mut planned = Planned::from_numbers(&numbers).ok_or_else(|| damaged(&path))?;
        let (before, now) = (planned.order.len(), self.sources.len());
        if before != now {
            let folder = self.setting.folder.display();
            return Err(Error::input(format!(
                "{folder}: this merge was planned for {before} scans, not for {now}: plan it anew"
            )));
        }
        planned.scan_order = ScanOrder::new(self.sources, &self.versions, &planned.order);
        planned.basis = self.basis(&planned.grid, planned.cut);
        Ok(planned)
    }

    fn collect(&self, planned: &Planned<'_>, portion: Portion, progress: &Progress<'_>) -> Result<Vec<Key>> {
        let &Planned { grid, basis, ref scan_order, .. } = planned;
        let triangulation = self.params.triangulation;
        let known: Vec<Key> = self.setting.recall(KNOWN, 0)?.unwrap_or_default();
        let collecting = Collecting { scan_order, triangulation, grid, basis, known: &known };
        let found = collect::collect(&collecting, portion, &self.setting, progress)?;
        progress.lap("discretize");
        Ok(found)
    }

    fn collected(&self, planned: &Planned<'_>) -> Result<Collected> {
        Collected::open(&self.all(Stage::Collect)?, planned.basis, planned.grid.lattice, &self.setting)
    }

    fn overlap(&self, planned: &Planned<'_>, progress: &Progress<'_>) -> Result<Vec<f64>> {
        let mut collected = self.collected(planned)?;
        if collected.about.intersections <= self.setting.kept {
            collected = self.collected_whole(collected, planned, progress)?;
        }
        if collected.about.found.triangles == 0 {
            return Err(crate::intake::nothing_to_merge(&self.params.triangulation));
        }
        progress.stage(FUSING, collected.rows() as u64);
        let distances = collected.distances(&planned.scan_order, self.setting.kept, progress)?.to_numbers();
        progress.lap("overlap");
        let mut numbers = vec![distances.len() as f64];
        numbers.extend(distances);
        numbers.extend(collected.about.to_numbers());
        Ok(numbers)
    }

    /// The collected scans, with whole samples of overlaps: those of a merge before, of more scans, may not be whole.
    fn collected_whole(
        &self,
        collected: Collected,
        planned: &Planned<'_>,
        progress: &Progress<'_>,
    ) -> Result<Collected> {
        let mut others = collected.segments.iter().filter(|segment| !segment.is_whole).peekable();
        if others.peek().is_none() {
            return Ok(collected);
        }
        others.try_for_each(Segment::remove)?;
        for number in 0..Stage::Collect.tasks(self.portions) {
            setting::remove(&self.setting.mark(&mark(Stage::Collect), number))?;
            let portion = Portion { number, of: self.portions };
            self.done(Stage::Collect, number, &self.collect(planned, portion, progress)?)?;
        }
        self.collected(planned)
    }

    fn fuse(&self, planned: &Planned<'_>, portion: Portion, progress: &Progress<'_>) -> Result<Vec<Named>> {
        self.all::<f64>(Stage::Overlap)?;
        let collected = self.collected(planned)?;
        let files = Blocks::fuse(&collected, portion, &self.setting, progress)?;
        progress.lap("sort");
        Ok(files)
    }

    /// Facts that are known once scans have been compared.
    fn compared(&self, planned: &Planned<'_>) -> Result<Known> {
        let numbers: Vec<f64> = self.all(Stage::Overlap)?;
        let told = |numbers: &[f64]| {
            let (&count, rest) = numbers.split_first()?;
            let (distances, about) = rest.split_at_checked(count as usize)?;
            let about = About::from_numbers(planned.grid.lattice, about)?;
            Some((OverlapDistances::from_numbers(distances)?, about))
        };
        let told = told(&numbers).ok_or_else(|| damaged(&self.setting.mark(&mark(Stage::Overlap), 0)));
        let (distances, about) = told?;
        let mut report = MergeReport {
            scans: planned.scan_order.len(),
            scan_names: planned.scan_order.names(),
            voxel: planned.grid.lattice.voxel,
            voxel_reason: planned.reason,
            intersections: about.intersections,
            ..MergeReport::default()
        };
        about.found.tell(&mut report);
        let reaches = Reaches::of(&distances, self.params, &mut report);
        Ok(Known { about, reaches, report })
    }

    fn look(&self, planned: &Planned<'_>, portion: Portion, progress: &Progress<'_>) -> Result<()> {
        let blocks = Blocks::open(&self.files(Stage::Fuse)?, &self.setting)?;
        if portion.number == 0 {
            self.setting.spend(&[segments::KIND])?;
        }
        let Known { about, reaches, report } = self.compared(planned)?;
        let tolerance = reaches.tolerance(report.voxel);
        let voters = Voters::new(&about.found, &planned.scan_order, planned.basis, tolerance);
        voters.look(&blocks, portion, &self.setting, progress)?;
        progress.lap("visibility");
        Ok(())
    }

    fn drop(&self, planned: &Planned<'_>, portion: Portion, progress: &Progress<'_>) -> Result<Vec<Named>> {
        self.all::<u8>(Stage::Look)?;
        let blocks = Blocks::open(&self.files(Stage::Fuse)?, &self.setting)?;
        let Known { about, reaches, report, .. } = self.compared(planned)?;
        let tolerance = reaches.tolerance(report.voxel);
        let voters = Voters::new(&about.found, &planned.scan_order, planned.basis, tolerance);
        let files = voters.drop_seen_through(&blocks, portion, &self.setting, progress)?;
        progress.lap("visibility");
        Ok(files)
    }

    /// The rest of the blocks.
    fn left(&self) -> Result<Blocks> {
        Blocks::open(&self.files(Stage::Drop)?, &self.setting)
    }

    fn colours(&self, planned: &Planned<'_>, progress: &Progress<'_>) -> Result<Vec<[f64; 3]>> {
        let blocks = self.left()?;
        self.setting.spend(&[visibility::KIND])?;
        if !self.params.match_exposure || !self.compared(planned)?.about.found.coloured {
            return Ok(Vec::new());
        }
        let gains = blocks.gains(&planned.scan_order, progress)?;
        progress.lap("colours");
        Ok(gains)
    }

    fn label(&self, planned: &Planned<'_>, portion: Portion, progress: &Progress<'_>) -> Result<Vec<Named>> {
        let gains: Vec<[f64; 3]> = self.all(Stage::Colours)?;
        let (rule, gains) = (self.compared(planned)?.reaches.rule(), Gains::new(&gains, &planned.scan_order));
        let files = BlockLabels::label(&self.left()?, (&rule, &gains), portion, &self.setting, progress)?;
        progress.lap("label");
        Ok(files)
    }

    fn build(&self, planned: &Planned<'_>, portion: Portion, progress: &Progress<'_>) -> Result<Vec<Named>> {
        let labels = BlockLabels::open(&self.files(Stage::Label)?, &self.setting)?;
        if portion.number == 0 {
            self.setting.spend(&[blocks::KIND, blocks::LEFT])?;
        }
        let files = tiles::build(&labels, &planned.grid.lattice, portion, &self.setting, progress)?;
        progress.lap("reconstruct");
        Ok(files)
    }
}

impl Graph for Tasks<'_> {
    type Tiles = Vec<TileFile>;

    fn run(&mut self, stage: Stage, progress: &Progress<'_>) -> Result<()> {
        (0..stage.tasks(self.portions)).try_for_each(|number| self.task(stage, number, progress))
    }

    fn finished(&mut self) -> Result<Built<'_, Vec<TileFile>>> {
        let planned = self.planned()?;
        self.setting.cut = planned.cut;
        let Known { about, reaches, mut report } = self.compared(&planned)?;
        report.colour_gains = self.all(Stage::Colours)?;
        let noted = |stage| Ok(self.files(stage)?.iter().map(|named| u64::from(named.note)).sum());
        (report.seen_through, report.fused_intersections) = (noted(Stage::Drop)?, noted(Stage::Label)?);
        let tiles = tiles::open(&self.files(Stage::Build)?, &self.setting)?;
        // Nothing else is needed any more.
        self.setting.spend(&[labels::KIND])?;
        let Discretized { lattice, coloured, placing, images, .. } = about.found;
        report.warnings.extend(damage::warning(&planned.scan_order.sources));
        let (crs, places) = (common_crs(&planned.scan_order.sources)?, planned.scan_order.places());
        let eyes = Eyes::new(planned.scan_order, &images);
        Ok(Built { tiles, lattice, reach: reaches.reach, coloured, placing, crs, places, eyes, report })
    }
}

/// Name of the file that tells which version has made the others.
const VERSION: &str = "version";

/// Name of the file that tells of which scans marks are.
const SCANS: &str = "scans";

/// Name of the file that says which segments of merges before are used.
const KNOWN: &str = "known";

/// Name of the file that has the side of the blocks.
const CUT: &str = "cut";

/// The mark of a merge that is planned.
pub fn plan_mark(setting: &Setting<'_>) -> PathBuf {
    setting.mark(&mark(Stage::Plan), 0)
}

/// Name of the marks of a stage's tasks.
fn mark(stage: Stage) -> String {
    format!("done-{}", stage.name())
}

impl Planned<'_> {
    fn to_numbers(&self) -> Vec<f64> {
        let Planned { grid: Grid { lattice: Lattice { voxel, base }, samples, crossings }, reason, cut, order, .. } =
            self;
        let [x, y, z] = base.map(|at| at as f64);
        let mut numbers = vec![*voxel, x, y, z, *samples as f64, *crossings, *reason as usize as f64, cut.side.into()];
        numbers.extend(order.iter().map(|&place| place as f64));
        numbers
    }

    fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let (&[voxel, x, y, z, samples, crossings, reason, side], order) = numbers.split_first_chunk()?;
        Some(Planned {
            grid: Grid {
                lattice: Lattice { voxel, base: [x, y, z].map(|at| at as i64) },
                samples: samples as usize,
                crossings,
            },
            reason: *VoxelReason::ALL.get(reason as usize)?,
            cut: Cut { side: side as i32 },
            order: order.iter().map(|&place| place as usize).collect(),
            scan_order: ScanOrder::default(),
            basis: Key::default(),
        })
    }
}
