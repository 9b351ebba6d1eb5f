//! Stages 3 and 4: the crossings of all scans become one surface: nodes inside or outside, and vertices on the edges between.

use std::sync::Arc;

use base::error::Result;
use base::progress::Progress;
use rayon::prelude::*;

use super::votes::{BrickLabels, BrickVertices, Bundles, Field, Vertices, VoteRule};
use crate::crossings::bundles::RawBundle;
use crate::crossings::edge_sums::EdgeSums;
use crate::crossings::{edge_colours, lines};
use crate::intake::overlap::OverlapDistances;
use crate::params::MergeParams;
use crate::report::MergeReport;

/// By default the distance of merging is so many times what 95 in 100 distances between overlapping scans are within, and at
/// least a cell: of normally distributed ones 3.5 deviations.
const OVERLAP: f64 = 1.8;
/// Bound of 95 in 100 normally distributed distances, by the bound of a quarter of them.
const Q95_BY_QUARTER: f64 = 6.15;
/// Of normally distributed errors the standard deviation, by the median distance of two that have it.
const SPREAD: f64 = 1.048_4;

/// Distances that are measured are rounded to so many cells: so one scan more or less seldom changes what is far from it.
const STEP: f64 = 0.25;
/// The same of the spread.
const STEP_OF_SPREAD: f64 = 1.0 / 16.0;

/// Distances, in cells, within which findings on the scans are heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reaches {
    /// The merge distance.
    pub reach: f64,
    /// Standard deviation of the distance between a scan and the surface.
    pub spread: f64,
    /// Error of surfaces where scans look.
    tolerance: f64,
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

    /// Error of surfaces where scans look, in world units.
    pub fn tolerance(&self, voxel: f64) -> f64 {
        self.tolerance * voxel
    }

    /// Rule for how far votes are heard.
    pub fn rule(&self) -> VoteRule {
        VoteRule { reach: self.reach.max(1.0), spread: self.spread }
    }
}

impl MergeReport {
    /// Notes what the sums take.
    pub(crate) fn count_sums(&mut self, bundles: &Bundles) {
        let sums: usize = bundles.list.iter().map(|bundle| bundle.list.len()).sum();
        self.working_bytes = self.working_bytes.max((sums * size_of::<EdgeSums>()) as u64);
    }

    /// Notes the vertices.
    pub(crate) fn count_fused(&mut self, vertices: &BrickVertices) {
        self.fused_intersections = vertices.values().flatten().map(|of_axis| of_axis.len() as u64).sum();
    }
}

/// Adds crossings up by edge, in order along their lines.
///
/// # Errors
/// Cancelled.
pub fn sort_lines(raw: Vec<RawBundle>, progress: &Progress<'_>) -> Result<Bundles> {
    let sort = |raw: RawBundle| {
        progress.advance(1)?;
        Ok(Arc::new(lines::sort(raw.key, raw.found.added.sums, raw.found.chunks)))
    };
    Ok(Bundles::new(raw.into_par_iter().map(sort).collect::<Result<_>>()?))
}

/// The labels and vertices that a brick's crossings make. Nothing if none says anything of any of its nodes.
pub type Labelled = Option<(Box<BrickLabels>, Vertices)>;

/// The labels and vertices of bricks.
///
/// # Errors
/// Cancelled.
pub fn label_nodes(
    bundles: &Bundles,
    bricks: Vec<[i32; 3]>,
    rule: &VoteRule,
    gains: &edge_colours::Gains,
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
