//! The stages of a merge of which something is kept.

use super::{Kept, Versioned};
use crate::colour::gains;
use crate::crossings::edge_colours;
use crate::crossings::scan_order::Roll;
use crate::field::fuse::Reaches;
use crate::intake::Discretized;
use crate::intake::defaults;
use crate::intake::setup::Setup;
use crate::pipeline::{Built, Graph, Stage};
use crate::run::memory;
use crate::surface::tile::Tile;
use crate::surface::tiles;
use crate::{BUILDING, MergeParams, MergeReport, dump, field};
use base::error::Result;
use base::progress::Progress;

/// A merge at work, with what is kept.
pub struct Again<'a> {
    kept: &'a mut Kept,
    /// The scans as they were given.
    scans: Vec<Versioned<'a>>,
    /// They in order, from the first stage on.
    roll: Roll<'a>,
    params: &'a MergeParams,
    setup: &'a Setup,
    report: MergeReport,
    /// What was found in the scans, but for their crossings.
    found: Option<Discretized>,
    reaches: Option<Reaches>,
    /// What is left of what scans come to.
    bundles: field::Bundles,
    tiles: Vec<Tile>,
}

impl<'a> Again<'a> {
    /// Of scans, by what is kept of them.
    pub fn new(kept: &'a mut Kept, scans: &[Versioned<'a>], params: &'a MergeParams, setup: &'a Setup) -> Self {
        if kept.triangulation != params.triangulation {
            *kept = Kept { triangulation: params.triangulation, ..Kept::default() };
        }
        Again {
            kept,
            scans: scans.to_vec(),
            roll: Roll::default(),
            params,
            setup,
            report: MergeReport { scans: scans.len(), ..MergeReport::default() },
            found: None,
            reaches: None,
            bundles: field::Bundles::new(Vec::new()),
            tiles: Vec::new(),
        }
    }

    fn found(&self) -> &Discretized {
        self.found.as_ref().expect("scans are collected")
    }

    fn reaches(&self) -> Reaches {
        self.reaches.expect("scans are compared")
    }

    fn plan(&mut self, progress: &Progress<'_>) -> Result<()> {
        self.roll = self.kept.roll(&self.scans, progress)?;
        self.report.scan_names = self.roll.names();
        defaults::choose_cell(&self.roll, self.params, &mut self.kept.known, &mut self.report, progress)
    }

    fn collect(&mut self, progress: &Progress<'_>) -> Result<()> {
        let Again { kept, roll, params, setup, report, .. } = self;
        self.found = Some(kept.scans.take(roll, params, setup, report, progress)?);
        progress.lap("discretize");
        Ok(())
    }

    /// How far scans lie from each other is kept bundle by bundle, as what they come to is.
    fn overlap(&mut self, progress: &Progress<'_>) -> Result<()> {
        let lattice = self.found().lattice;
        let Again { kept, roll, params, setup, report, .. } = self;
        kept.bundles.renew(&kept.scans, roll, &lattice, setup, report, progress)?;
        self.reaches = Some(kept.bundles.reaches(params, report));
        progress.lap("sort");
        Ok(())
    }

    fn look(&mut self, progress: &Progress<'_>) -> Result<()> {
        let tolerance = self.reaches().tolerance(self.report.voxel);
        let Kept { looks, bundles, bricks, .. } = &mut *self.kept;
        let found = self.found.as_ref().expect("scans are collected");
        bricks.note(looks.look(bundles, &self.roll, found, tolerance, progress)?);
        Ok(())
    }

    fn drop(&mut self, progress: &Progress<'_>) {
        self.bundles = self.kept.bundles.shown(&mut self.report);
        progress.lap("sight");
    }

    fn colours(&mut self, progress: &Progress<'_>) -> Result<()> {
        let coloured = self.found().coloured;
        gains::tell(&self.bundles, &self.roll, coloured, self.params, &mut self.report, progress)
    }

    fn label(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (rule, lattice) = (self.reaches().rule(), self.found().lattice);
        let Again { kept, roll, report, bundles, .. } = self;
        let gains = edge_colours::Gains::new(&report.colour_gains, roll);
        kept.bricks.label(bundles, rule, gains, &lattice, progress)?;
        report.count_fused(&kept.bricks.vertices);
        dump::labels(&kept.bricks.labels, &lattice)?;
        progress.lap("label");
        kept.forget_others(&roll.versions);
        Ok(())
    }

    fn build(&mut self, progress: &Progress<'_>) -> Result<()> {
        let lattice = self.found().lattice;
        let bricks = &mut self.kept.bricks;
        let mut cells = bricks.analyse(progress)?;
        progress.stage(BUILDING, cells.len() as u64);
        progress.lap("analyse");
        let tile = tiles::build_one(&mut cells, &bricks.vertices, &lattice, progress);
        bricks.put_back(cells);
        self.tiles = vec![tile?];
        Ok(())
    }
}

impl Graph for Again<'_> {
    type Tiles = Vec<Tile>;

    fn run(&mut self, stage: Stage, progress: &Progress<'_>) -> Result<()> {
        match stage {
            Stage::Plan => self.plan(progress),
            Stage::Collect => self.collect(progress),
            Stage::Overlap => self.overlap(progress),
            // Done where they were compared.
            Stage::Fuse => Ok(()),
            Stage::Look => self.look(progress),
            Stage::Drop => {
                self.drop(progress);
                Ok(())
            }
            Stage::Colours => self.colours(progress),
            Stage::Label => self.label(progress),
            Stage::Build => self.build(progress),
        }
    }

    fn finished(&mut self) -> Result<Built<Vec<Tile>>> {
        let (tiles, report) = (std::mem::take(&mut self.tiles), std::mem::take(&mut self.report));
        memory::built(tiles, &self.roll, self.found(), self.reaches(), report)
    }
}
