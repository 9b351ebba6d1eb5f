//! The stages of a merge of which something is kept.

use super::findings::Findings;
use crate::crossings::edge_colours;
use crate::driver::{Built, Graph, Stage};
use crate::intake::defaults;
use crate::intake::setup::Setup;
use crate::params::MergeParams;
use crate::run::memory::{self, Memory};
use crate::stages::BUILDING;
use crate::surface::tile::Tile;
use crate::surface::tiles;
use base::error::Result;
use base::progress::Progress;
use image::source::ScanSource;

/// A merge at work, with what is kept.
pub struct Incremental<'a> {
    kept: &'a mut Findings,
    /// Versions of the scans, as they were given.
    versions: Vec<u64>,
    /// All that a merge has of which nothing is kept.
    at_work: Memory<'a>,
}

impl<'a> Incremental<'a> {
    /// Of scans of so many versions, by what is kept of them.
    pub fn new(
        kept: &'a mut Findings,
        (scans, versions): (&[&'a dyn ScanSource], &[u64]),
        params: &'a MergeParams,
        setup: &'a Setup,
    ) -> Self {
        if kept.triangulation != params.triangulation {
            *kept = Findings { triangulation: params.triangulation, ..Findings::default() };
        }
        Incremental { kept, versions: versions.to_vec(), at_work: Memory::new(scans, params, setup) }
    }

    fn plan(&mut self, progress: &Progress<'_>) -> Result<()> {
        let Memory { sources, scan_order, params, report, .. } = &mut self.at_work;
        *scan_order = self.kept.scan_order(sources, &self.versions, progress)?;
        report.scan_names = scan_order.names();
        defaults::choose_cell(scan_order, params, &mut self.kept.known, report, progress)
    }

    fn collect(&mut self, progress: &Progress<'_>) -> Result<()> {
        let Memory { scan_order, params, setup, report, found, .. } = &mut self.at_work;
        *found = Some(self.kept.scans.take(scan_order, params, setup, report, progress)?);
        progress.lap("discretize");
        Ok(())
    }

    /// Distances between scans are kept bundle by bundle, as their sums are.
    fn overlap(&mut self, progress: &Progress<'_>) -> Result<()> {
        let lattice = self.at_work.found().lattice;
        let Memory { scan_order, params, setup, report, reaches, .. } = &mut self.at_work;
        self.kept.bundles.renew(&self.kept.scans, scan_order, &lattice, setup, report, progress)?;
        *reaches = Some(self.kept.bundles.reaches(params, report));
        progress.lap("sort");
        Ok(())
    }

    fn look(&mut self, progress: &Progress<'_>) -> Result<()> {
        let tolerance = self.at_work.reaches().tolerance(self.at_work.report.voxel);
        let Findings { visibility, bundles, bricks, .. } = &mut *self.kept;
        bricks.note(visibility.look(bundles, &self.at_work.scan_order, self.at_work.found(), tolerance, progress)?);
        Ok(())
    }

    fn drop(&mut self, progress: &Progress<'_>) {
        self.at_work.bundles = self.kept.bundles.shown(&mut self.at_work.report);
        progress.lap("visibility");
    }

    fn label(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (rule, lattice) = (self.at_work.reaches().rule(), self.at_work.found().lattice);
        let Memory { scan_order, report, bundles, .. } = &mut self.at_work;
        let gains = edge_colours::Gains::new(&report.colour_gains, scan_order);
        let bricks = &mut self.kept.bricks;
        bricks.label(bundles, rule, gains, &lattice, progress)?;
        memory::tell_labels(&bricks.labels, &bricks.vertices, &lattice, report, progress)?;
        self.kept.forget_others(&scan_order.versions);
        Ok(())
    }

    fn build(&mut self, progress: &Progress<'_>) -> Result<()> {
        let lattice = self.at_work.found().lattice;
        let bricks = &mut self.kept.bricks;
        let mut cells = bricks.analyse(progress)?;
        progress.stage(BUILDING, cells.len() as u64);
        progress.lap("analyse");
        let tile = tiles::build_one(&mut cells, &bricks.vertices, &lattice, progress);
        bricks.put_back(cells);
        self.at_work.tiles = vec![tile?];
        Ok(())
    }
}

impl Graph for Incremental<'_> {
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
            Stage::Colours => self.at_work.run(stage, progress),
            Stage::Label => self.label(progress),
            Stage::Build => self.build(progress),
        }
    }

    fn finished(&mut self) -> Result<Built<'_, Vec<Tile>>> {
        let built = self.at_work.finished()?;
        let eyes = built.eyes.knowing(self.kept.visibility.sights());
        Ok(Built { eyes, ..built })
    }
}
