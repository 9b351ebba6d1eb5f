//! A merge in memory: all there is is one block, and what a stage leaves for the next one is taken by it.

use std::sync::atomic::Ordering;

use crate::colour::gains;
use crate::crossings::bundles::{self, Buckets, RawBundle};
use crate::crossings::lattice::Lattice;
use crate::crossings::scan_order::ScanOrder;
use crate::crossings::{edge_colours, scan_order};
use crate::driver::{Built, Graph, Stage};
use crate::dump;
use crate::field::Bundles;
use crate::field::fuse::{self, Labelled, Reaches};
use crate::field::{BrickVertices, Labels};
use crate::intake::overlap::OverlapDistances;
use crate::intake::setup::Setup;
use crate::intake::{self, Discretized};
use crate::intake::{damage, defaults};
use crate::params::MergeParams;
use crate::report::{MergeReport, Merged};
use crate::run::started::{started, surface};
use crate::stages::{FUSING, LABELLING, LOOKING};
use crate::surface::tile::Tile;
use crate::surface::tiles;
use crate::visibility::eyes::Eyes;
use crate::visibility::{self, Votes};
use base::error::Result;
use base::fewer_threads;
use base::progress::Progress;
use image::source::{ScanSource, common_crs};

/// Merges in memory, of which nothing is kept.
///
/// # Errors
/// As [`merge`](crate::merge).
pub fn run_by(
    scans: &[&dyn ScanSource],
    params: &MergeParams,
    setup: &Setup,
    progress: &Progress<'_>,
) -> Result<Merged> {
    let merge = |threads| {
        setup.fit.begin();
        let params = &MergeParams { threads, ..*params };
        started(scans, params, progress, || surface(&mut Memory::new(scans, params, setup), params, progress))
    };
    // A merge that was foreseen not to fit does not with one either.
    fewer_threads::where_memory_is_short(params.threads, || !setup.fit.is_refused.load(Ordering::Relaxed), merge)
}

/// A merge at work.
pub struct Memory<'a> {
    /// The scans as they were given.
    pub sources: Vec<&'a dyn ScanSource>,
    /// They in order, from the first stage on.
    pub scan_order: ScanOrder<'a>,
    pub params: &'a MergeParams,
    pub setup: &'a Setup,
    pub report: MergeReport,
    /// Findings in the scans, but for their crossings.
    pub found: Option<Discretized>,
    /// Their crossings.
    pub raw: Vec<RawBundle>,
    pub reaches: Option<Reaches>,
    pub bundles: Bundles,
    votes: Vec<Vec<Votes>>,
    pub labels: Labels,
    pub vertices: BrickVertices,
    pub tiles: Vec<Tile>,
}

impl<'a> Memory<'a> {
    /// Of scans of which nothing is known.
    pub fn new(sources: &[&'a dyn ScanSource], params: &'a MergeParams, setup: &'a Setup) -> Self {
        Memory {
            sources: sources.to_vec(),
            scan_order: ScanOrder::default(),
            params,
            setup,
            report: MergeReport { scans: sources.len(), ..MergeReport::default() },
            found: None,
            raw: Vec::new(),
            reaches: None,
            bundles: Bundles::new(Vec::new()),
            votes: Vec::new(),
            labels: Labels::default(),
            vertices: BrickVertices::default(),
            tiles: Vec::new(),
        }
    }

    /// Findings in the scans.
    pub fn found(&self) -> &Discretized {
        self.found.as_ref().expect("scans are collected")
    }

    /// Distances within which findings on the scans are heard.
    pub fn reaches(&self) -> Reaches {
        self.reaches.expect("scans are compared")
    }

    fn plan(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (sources, params) = (&self.sources, self.params);
        let order = scan_order::in_order(sources, |at| sources[at].content(&params.triangulation, progress), progress)?;
        let versions: Vec<u64> = (0..sources.len() as u64).collect();
        self.scan_order = ScanOrder::new(sources, &versions, &order);
        self.report.scan_names = self.scan_order.names();
        let nothing = &mut defaults::Known::default();
        defaults::choose_cell(&self.scan_order, params, nothing, &mut self.report, progress)
    }

    fn collect(&mut self, progress: &Progress<'_>) -> Result<()> {
        let Memory { scan_order, params, setup, report, .. } = self;
        let mut found = intake::find_crossings(scan_order, params, setup, report, progress)?;
        report.intersections = found.buckets.iter().map(|buckets| buckets.len).sum();
        report.working_bytes = found.buckets.iter().map(Buckets::bytes).sum();
        self.raw = bundles::gather(std::mem::take(&mut found.buckets));
        dump::crossings(&self.raw, &found.lattice)?;
        self.found = Some(found);
        progress.lap("discretize");
        Ok(())
    }

    fn overlap(&mut self, progress: &Progress<'_>) -> Result<()> {
        progress.stage(FUSING, self.raw.len() as u64);
        let are_sampled = self.report.intersections > self.setup.kept;
        let distances = OverlapDistances::measure(&self.raw, &self.scan_order, are_sampled, progress)?;
        self.reaches = Some(Reaches::of(&distances, self.params, &mut self.report));
        progress.lap("overlap");
        Ok(())
    }

    fn fuse(&mut self, progress: &Progress<'_>) -> Result<()> {
        self.bundles = fuse::sort_lines(std::mem::take(&mut self.raw), progress)?;
        self.report.count_sums(&self.bundles);
        progress.lap("sort");
        Ok(())
    }

    fn look(&mut self, progress: &Progress<'_>) -> Result<()> {
        let Discretized { images, lattice, .. } = self.found();
        progress.stage(LOOKING, images.len() as u64);
        let tolerance = self.reaches().tolerance(self.report.voxel);
        self.votes = visibility::ask(&self.bundles, &self.scan_order, images, lattice, tolerance, progress)?;
        Ok(())
    }

    fn drop(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (bundles, votes) = (self.take_bundles(), std::mem::take(&mut self.votes));
        (self.bundles, self.report.seen_through) = visibility::drop_seen_through(bundles, votes, progress)?;
        progress.lap("visibility");
        Ok(())
    }

    fn colours(&mut self, progress: &Progress<'_>) -> Result<()> {
        let coloured = self.found().coloured;
        gains::tell(&self.bundles, &self.scan_order, coloured, self.params, &mut self.report, progress)
    }

    fn label(&mut self, progress: &Progress<'_>) -> Result<()> {
        let bundles = self.take_bundles();
        let bricks = bundles.labelled_bricks();
        progress.stage(LABELLING, bricks.len() as u64);
        let gains = edge_colours::Gains::new(&self.report.colour_gains, &self.scan_order);
        let found = fuse::label_nodes(&bundles, bricks, &self.reaches().rule(), &gains, progress)?;
        let split =
            |(brick, found): ([i32; 3], Labelled)| found.map(|(labels, vertices)| ((brick, labels), (brick, vertices)));
        (self.labels, self.vertices) = found.into_iter().filter_map(split).unzip();
        self.labelled(progress)
    }

    /// Tells of labels and vertices, which are there now.
    pub fn labelled(&mut self, progress: &Progress<'_>) -> Result<()> {
        let lattice = self.found().lattice;
        tell_labels(&self.labels, &self.vertices, &lattice, &mut self.report, progress)
    }

    fn build(&mut self, progress: &Progress<'_>) -> Result<()> {
        let (labels, vertices) = (std::mem::take(&mut self.labels), std::mem::take(&mut self.vertices));
        let lattice = &self.found().lattice;
        self.tiles = tiles::build_all((&labels, &vertices), lattice, self.setup.block, progress)?;
        Ok(())
    }

    fn take_bundles(&mut self) -> Bundles {
        std::mem::replace(&mut self.bundles, Bundles::new(Vec::new()))
    }
}

impl Graph for Memory<'_> {
    type Tiles = Vec<Tile>;

    fn run(&mut self, stage: Stage, progress: &Progress<'_>) -> Result<()> {
        match stage {
            Stage::Plan => self.plan(progress),
            Stage::Collect => self.collect(progress),
            Stage::Overlap => self.overlap(progress),
            Stage::Fuse => self.fuse(progress),
            Stage::Look => self.look(progress),
            Stage::Drop => self.drop(progress),
            Stage::Colours => self.colours(progress),
            Stage::Label => self.label(progress),
            Stage::Build => self.build(progress),
        }
    }

    fn finished(&mut self) -> Result<Built<'_, Vec<Tile>>> {
        let (tiles, mut report) = (std::mem::take(&mut self.tiles), std::mem::take(&mut self.report));
        report.working_bytes = report.working_bytes.max(tiles.iter().map(|tile| tile.surface.bytes()).sum());
        let scan_order = std::mem::take(&mut self.scan_order);
        let Discretized { lattice, coloured, placing, images, .. } = self.found();
        report.warnings.extend(damage::warning(&scan_order.sources));
        let (crs, places) = (common_crs(&scan_order.sources)?, scan_order.places());
        let (lattice, coloured, placing, reach) = (*lattice, *coloured, *placing, self.reaches().reach);
        let eyes = Eyes::new(scan_order, images);
        Ok(Built { tiles, lattice, reach, coloured, placing, crs, places, eyes, report })
    }
}

/// Tells of labels and vertices.
///
/// # Errors
/// What is dumped can't be written.
pub fn tell_labels(
    labels: &Labels,
    vertices: &BrickVertices,
    lattice: &Lattice,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<()> {
    report.count_fused(vertices);
    dump::labels(labels, lattice)?;
    progress.lap("label");
    Ok(())
}
