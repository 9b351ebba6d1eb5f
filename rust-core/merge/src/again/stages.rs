//! The stages of a merge of which something is kept.

use super::{Kept, Versioned};
use crate::fuse::Reaches;
use crate::graph::{Built, Graph, Stage};
use crate::intake::Discretized;
use crate::tile::Tile;
use crate::{BUILDING, MergeParams, MergeReport, ScanSource, Setup, defaults, dump, field, gains, memory, tiles};
use base::error::Result;
use base::progress::Progress;

/// A merge at work, with what is kept.
pub struct Again<'a> {
    kept: &'a mut Kept,
    /// The scans, from the first stage on by number.
    scans: Vec<Versioned<'a>>,
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

    fn sources(&self) -> Vec<&'a dyn ScanSource> {
        self.scans.iter().map(|scan| scan.scan).collect()
    }

    fn versions(&self) -> Vec<u64> {
        self.scans.iter().map(|scan| scan.version).collect()
    }

    fn plan(&mut self, progress: &Progress<'_>) -> Result<()> {
        self.scans = self.kept.in_order(&self.scans, progress)?;
        let (sources, versions) = (self.sources(), self.versions());
        self.report.scan_names = sources.iter().map(|scan| scan.name().to_owned()).collect();
        let known = &mut self.kept.known;
        defaults::choose_cell(&sources, &versions, self.params, known, &mut self.report, progress)
    }

    fn collect(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (sources, versions) = (self.sources(), self.versions());
        let Again { kept, params, setup, report, .. } = self;
        self.found = Some(kept.scans.take(&sources, &versions, params, setup, report, progress)?);
        progress.lap("discretize");
        Ok(())
    }

    /// How far scans lie from each other is kept bundle by bundle, as what they come to is.
    fn overlap(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (versions, lattice) = (self.versions(), self.found().lattice);
        let Again { kept, params, setup, report, .. } = self;
        kept.bundles.renew(&kept.scans, &versions, &lattice, setup, report, progress)?;
        self.reaches = Some(kept.bundles.reaches(params, report));
        progress.lap("sort");
        Ok(())
    }

    fn look(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (sources, versions) = (self.sources(), self.versions());
        let tolerance = self.reaches().tolerance(self.report.voxel);
        let Kept { looks, bundles, bricks, .. } = &mut *self.kept;
        let found = self.found.as_ref().expect("scans are collected");
        bricks.note(looks.look(bundles, &sources, &versions, found, tolerance, progress)?);
        Ok(())
    }

    fn drop(&mut self, progress: &Progress<'_>) {
        self.bundles = self.kept.bundles.shown(&mut self.report);
        progress.lap("sight");
    }

    fn colours(&mut self, progress: &Progress<'_>) -> Result<()> {
        let coloured = self.found().coloured;
        gains::tell(&self.bundles, coloured, self.params, &mut self.report, progress)
    }

    fn label(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (rule, lattice, versions) = (self.reaches().rule(), self.found().lattice, self.versions());
        let Again { kept, report, bundles, .. } = self;
        kept.bricks.label(bundles, rule, &report.colour_gains, &lattice, progress)?;
        report.count_fused(&kept.bricks.vertices);
        dump::labels(&kept.bricks.labels, &lattice)?;
        progress.lap("label");
        kept.forget_others(&versions);
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
        memory::built(tiles, &self.sources(), self.found(), self.reaches(), report)
    }
}
