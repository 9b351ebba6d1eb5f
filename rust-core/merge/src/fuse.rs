//! Stages 3 and 4: the crossings of all scans become one surface: nodes inside or outside, and vertices on the edges between.

use base::error::Result;
use base::progress::Progress;
use rayon::prelude::*;

use super::bundles::{self, Buckets, RawBundle};
use super::field::{Bundles, Field, Rule};
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

/// What the scans have become.
pub struct Fused {
    /// Which nodes lie inside.
    pub labels: Labels,
    /// Vertices on the edges from inside to outside.
    pub vertices: BrickVertices,
    /// The merge distance, in cells.
    pub reach: f64,
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
    report.overlap_residual = distances.quantile(0.5).map(|d| d * report.voxel);
    let reach = match params.merge_distance {
        Some(distance) => distance / report.voxel,
        None => distances.quantile(0.95).map_or(1.0, |d| OVERLAP * d).max(1.0),
    };
    report.merge_distance = params.merge_distance.unwrap_or(reach * report.voxel);
    progress.lap("overlap");
    let (labels, vertices) = match setup.fusing {
        Fusing::ByVotes => Votes { sources, scans, params, distances, reach }.label(raw, report, progress)?,
        #[cfg(any(test, feature = "reference"))]
        Fusing::ByLines => {
            let full_trust = f64::from(scans.full_trust);
            reference::label_nodes(raw, reference::Rule { merge_distance: reach, full_trust }, progress)?
        }
    };
    report.fused_intersections = vertices.values().flatten().map(|of_axis| of_axis.len() as u64).sum();
    dump::labels(&labels, &scans.lattice)?;
    progress.lap("label");
    Ok(Fused { labels, vertices, reach })
}

/// Fusing by what the scans have on each edge, added up.
struct Votes<'a> {
    sources: &'a [&'a dyn ScanSource],
    scans: &'a Discretized,
    params: &'a MergeParams,
    distances: OverlapDistances,
    /// The merge distance, in cells.
    reach: f64,
}

impl Votes<'_> {
    fn label(
        &self,
        raw: Vec<RawBundle>,
        report: &mut MergeReport,
        progress: &Progress<'_>,
    ) -> Result<(Labels, BrickVertices)> {
        let reach = self.reach.max(1.0);
        let bundles = sort_lines(raw, progress)?;
        let tallies: usize = bundles.list.iter().map(|bundle| bundle.list.len()).sum();
        report.working_bytes = report.working_bytes.max((tallies * size_of::<Tally>()) as u64);
        progress.lap("sort");
        progress.stage(LOOKING, self.scans.images.len() as u64);
        let aside = self.distances.largest_quarter().map_or(0.0, |d| OVERLAP * Q95_BY_QUARTER * d);
        let tolerance = reach.max(aside) * report.voxel;
        let (images, lattice) = (&self.scans.images, &self.scans.lattice);
        let (bundles, seen_through) =
            sight::drop_seen_through(bundles, self.sources, images, lattice, tolerance, progress)?;
        report.seen_through = seen_through;
        progress.lap("sight");
        if self.params.match_exposure && self.scans.coloured {
            report.colour_gains = gains::measure(&bundles, self.sources.len(), progress)?;
            progress.lap("colours");
        }
        let rule = Rule { reach, spread: self.distances.quantile(0.5).map_or(0.0, |d| SPREAD * d) };
        label_nodes(&bundles, &rule, &colour::Gains::new(&report.colour_gains), progress)
    }
}

fn sort_lines(raw: Vec<RawBundle>, progress: &Progress<'_>) -> Result<Bundles> {
    let sort = |raw: RawBundle| {
        progress.advance(1)?;
        Ok(lines::sort(raw.key, raw.found.added.tallies, raw.found.chunks))
    };
    Ok(Bundles::new(raw.into_par_iter().map(sort).collect::<Result<_>>()?))
}

fn label_nodes(
    bundles: &Bundles,
    rule: &Rule,
    gains: &colour::Gains,
    progress: &Progress<'_>,
) -> Result<(Labels, BrickVertices)> {
    let bricks = bundles.labelled_bricks();
    progress.stage(LABELLING, bricks.len() as u64);
    let found = bricks
        .into_par_iter()
        .map_init(Field::default, |field, brick| {
            progress.advance(1)?;
            Ok(field.label(bundles, brick, rule, gains).map(|(labels, vertices)| ((brick, labels), (brick, vertices))))
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.into_iter().flatten().unzip())
}
