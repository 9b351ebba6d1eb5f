//! Stages 3 and 4: the crossings of all scans become one surface: nodes inside or outside, and vertices on the edges between.

use std::sync::Arc;

use base::error::Result;
use base::progress::Progress;
use rayon::prelude::*;

use super::bundles::{self, Buckets, RawBundle};
use super::field::{BrickLabels, Bundles, Field, Rule, Vertices};
use super::intake::Discretized;
use super::overlap::OverlapDistances;
#[cfg(any(test, feature = "reference"))]
use super::reference;
use super::tally::Tally;
use super::{
    BrickVertices, FUSING, Fusing, LABELLING, LOOKING, Labels, MergeParams, MergeReport, ScanSource, Setup, colour,
    dump, gains, lines, sight,
};

/// By default the distance of merging is so many times what 95 in 100 distances between overlapping scans are within, and at
/// least a cell: of normally distributed ones 3.5 deviations.
const OVERLAP: f64 = 1.8;
/// What 95 in 100 normally distributed distances are within, by what a quarter of them is.
const Q95_BY_QUARTER: f64 = 6.15;
/// Of normally distributed errors the standard deviation, by the median distance of two that have it.
const SPREAD: f64 = 1.048_4;

/// Distances that are measured are rounded to so many cells: so one scan more or less seldom changes what is far from it.
const STEP: f64 = 0.25;
/// The same of the spread.
const STEP_OF_SPREAD: f64 = 1.0 / 16.0;

/// What the scans have become.
pub struct Fused {
    /// Which nodes lie inside.
    pub labels: Labels,
    /// Vertices on the edges from inside to outside.
    pub vertices: BrickVertices,
    /// The merge distance, in cells.
    pub reach: f64,
}

/// How far, in cells, what is known of the scans is heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaches {
    /// The merge distance.
    pub reach: f64,
    /// Standard deviation of the distance between a scan and the surface.
    pub spread: f64,
    /// What surfaces may be off by where scans look.
    pub tolerance: f64,
}

impl Reaches {
    /// As asked for or measured, and told in the report.
    pub fn of(distances: &OverlapDistances, params: &MergeParams, report: &mut MergeReport) -> Self {
        let rounded = |cells: f64, step: f64| (cells / step).round() * step;
        let median = distances.quantile(0.5);
        report.overlap_residual = median.map(|d| d * report.voxel);
        let reach = match params.merge_distance {
            Some(distance) => distance / report.voxel,
            None => distances.quantile(0.95).map_or(1.0, |d| rounded(OVERLAP * d, STEP)).max(1.0),
        };
        report.merge_distance = params.merge_distance.unwrap_or(reach * report.voxel);
        let spread = median.map_or(0.0, |d| rounded(SPREAD * d, STEP_OF_SPREAD));
        let aside = distances.largest_quarter().map_or(0.0, |d| rounded(OVERLAP * Q95_BY_QUARTER * d, STEP));
        Reaches { reach, spread, tolerance: reach.max(1.0).max(aside) }
    }

    /// How far votes are heard.
    pub fn rule(&self) -> Rule {
        Rule { reach: self.reach.max(1.0), spread: self.spread }
    }
}

/// Fuses the crossings, which it takes out of `scans`.
///
/// # Errors
/// What loading a scan again can meet, to look along its rays; cancelled.
pub fn fuse(
    sources: &[&dyn ScanSource],
    scans: &mut Discretized,
    params: &MergeParams,
    setup: &Setup,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<Fused> {
    report.intersections = scans.buckets.iter().map(|b| b.len).sum();
    report.working_bytes = scans.buckets.iter().map(Buckets::bytes).sum();
    let raw = bundles::gather(std::mem::take(&mut scans.buckets));
    dump::crossings(&raw, &scans.lattice)?;
    progress.lap("discretize");
    progress.stage(FUSING, raw.len() as u64);
    let are_sampled = report.intersections > setup.kept;
    let distances = OverlapDistances::measure(&raw, are_sampled.then_some(sources.len()), progress)?;
    let reaches = Reaches::of(&distances, params, report);
    progress.lap("overlap");
    let (labels, vertices) = match setup.fusing {
        Fusing::ByVotes => Votes { sources, scans, params, reaches }.label(raw, report, progress)?,
        #[cfg(any(test, feature = "reference"))]
        Fusing::ByLines => {
            let full_trust = f64::from(scans.full_trust);
            reference::label_nodes(raw, reference::Rule { merge_distance: reaches.reach, full_trust }, progress)?
        }
    };
    report.count_fused(&vertices);
    dump::labels(&labels, &scans.lattice)?;
    progress.lap("label");
    Ok(Fused { labels, vertices, reach: reaches.reach })
}

/// Fusing by what the scans have on each edge, added up.
struct Votes<'a> {
    sources: &'a [&'a dyn ScanSource],
    scans: &'a Discretized,
    params: &'a MergeParams,
    reaches: Reaches,
}

impl Votes<'_> {
    fn label(
        &self,
        raw: Vec<RawBundle>,
        report: &mut MergeReport,
        progress: &Progress<'_>,
    ) -> Result<(Labels, BrickVertices)> {
        let bundles = sort_lines(raw, progress)?;
        report.count_tallies(&bundles);
        progress.lap("sort");
        progress.stage(LOOKING, self.scans.images.len() as u64);
        let tolerance = self.reaches.tolerance * report.voxel;
        let (images, lattice) = (&self.scans.images, &self.scans.lattice);
        let (bundles, seen_through) =
            sight::drop_seen_through(bundles, self.sources, images, lattice, tolerance, progress)?;
        report.seen_through = seen_through;
        progress.lap("sight");
        if self.params.match_exposure && self.scans.coloured {
            report.colour_gains = gains::measure(&bundles, self.sources.len(), progress)?;
            progress.lap("colours");
        }
        let bricks = bundles.labelled_bricks();
        progress.stage(LABELLING, bricks.len() as u64);
        let found =
            label_nodes(&bundles, bricks, &self.reaches.rule(), &colour::Gains::new(&report.colour_gains), progress)?;
        let split =
            |(brick, found): ([i32; 3], Labelled)| found.map(|(labels, vertices)| ((brick, labels), (brick, vertices)));
        Ok(found.into_iter().filter_map(split).unzip())
    }
}

impl MergeReport {
    /// Notes what the tallies take.
    pub(super) fn count_tallies(&mut self, bundles: &Bundles) {
        let tallies: usize = bundles.list.iter().map(|bundle| bundle.list.len()).sum();
        self.working_bytes = self.working_bytes.max((tallies * size_of::<Tally>()) as u64);
    }

    /// Notes the vertices.
    pub(super) fn count_fused(&mut self, vertices: &BrickVertices) {
        self.fused_intersections = vertices.values().flatten().map(|of_axis| of_axis.len() as u64).sum();
    }
}

fn sort_lines(raw: Vec<RawBundle>, progress: &Progress<'_>) -> Result<Bundles> {
    let sort = |raw: RawBundle| {
        progress.advance(1)?;
        Ok(Arc::new(lines::sort(raw.key, raw.found.added.tallies, raw.found.chunks)))
    };
    Ok(Bundles::new(raw.into_par_iter().map(sort).collect::<Result<_>>()?))
}

/// What a brick's crossings make of it; nothing where none says anything of any of its nodes.
pub type Labelled = Option<(Box<BrickLabels>, Vertices)>;

/// The labels and vertices of bricks.
///
/// # Errors
/// Cancelled.
pub fn label_nodes(
    bundles: &Bundles,
    bricks: Vec<[i32; 3]>,
    rule: &Rule,
    gains: &colour::Gains,
    progress: &Progress<'_>,
) -> Result<Vec<([i32; 3], Labelled)>> {
    bricks
        .into_par_iter()
        .map_init(Field::default, |field, brick| {
            progress.advance(1)?;
            Ok((brick, field.label(bundles, brick, rule, gains)))
        })
        .collect()
}
