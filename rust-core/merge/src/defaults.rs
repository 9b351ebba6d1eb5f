//! The cell from the data, where the caller gives none.

use rayon::prelude::*;

use super::budget;
use super::bundles::{Buckets, gather};
use super::discretize::discretize;
use super::lattice::Lattice;
use super::overlap::OverlapDistances;
use super::{MEASURING, MergeParams, MergeReport, VoxelReason};
use base::error::{Error, Result};
use base::progress::Progress;
use image::source::{Loading, OrientedSurface, ScanSource};
use image::triangulate::TriangulateParams;

/// At least so many mean distances of neighbouring samples. Coarser cells lose what clean scans show (docs/decisions.md), finer
/// ones show the facets between samples.
const SPACINGS: f64 = 1.5;
/// At least so many standard deviations of the noise: what is finer can't be told from it, however many scans are averaged.
const DEVIATIONS: f64 = 0.5;
/// At least so many median distances between scans that overlap, by errors of their poses or noise that depends on itself ...
const DISTANCES: f64 = 1.5;
/// ... but for noise and distances no more than so many mean distances of samples: there scans don't fit, and no cell makes
/// them.
const MOST_SPACINGS: f64 = 12.0;

/// At most this many scans are read, in pairs that follow each other.
const SCANS: usize = 8;
/// Distances between them are measured with cells of so many spacings of the first.
const TRIAL: f64 = 3.0;
/// Scans whose samples are so many times further apart are left out of that: they would have too many crossings.
const COARSER: f64 = 4.0;
/// Scans with more crossings by samples are left out of it, too: a third is usual.
const CROSSINGS_A_SAMPLE: f64 = 4.0;
/// Distances of more than this many medians of their scan are mistakes, which must not count.
const OUTLIER: f64 = 10.0;

/// What one scan tells.
#[derive(Default)]
struct Told {
    /// Sum of the distances of samples to their nearest neighbour, and their number.
    spacing: (f64, u64),
    /// Median standard deviation of the samples.
    noise: f64,
}

/// The size of a cell as given or, by default, as measured on the scans; what decided it.
///
/// # Errors
/// As [`voxel`].
pub fn choose_cell(
    sources: &[&dyn ScanSource],
    params: &MergeParams,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<()> {
    progress.stage(MEASURING, 1);
    (report.voxel, report.voxel_reason) = match params.voxel {
        Some(voxel) => (voxel, VoxelReason::Given),
        None => voxel(sources, &params.triangulation, progress)?,
    };
    progress.lap("measure");
    Ok(())
}

/// The finest cell that up to eight scans, spread through the list, support, and what decided: the spacing of their samples,
/// their noise, or how far scans that overlap lie from each other.
///
/// # Errors
/// A scan can't be loaded; no scan has a triangle; cancelled.
pub fn voxel(
    sources: &[&dyn ScanSource],
    triangulation: &TriangulateParams,
    progress: &Progress<'_>,
) -> Result<(f64, VoxelReason)> {
    let count = sources.len().min(SCANS);
    // The first of each pair lies where the list is cut into as many parts as there are pairs.
    let numbers: Vec<usize> = (0..count).map(|i| i / 2 * 2 * sources.len() / count + i % 2).collect();
    let load = |number: usize| {
        progress.check()?;
        sources[number].load(&Loading { triangulation: *triangulation, cell: 0.0 }, progress)
    };
    let mut told: Vec<Told> = Vec::new();
    let mut trial = None;
    // All before the first with a triangle are empty.
    let mut start = 0;
    let mut first = Buckets::default();
    while trial.is_none() && start < count {
        let surface = load(numbers[start])?;
        told.push(Told::by(&surface));
        if let Some((lattice, spacing)) = trial_grid(&surface, &told[start]) {
            count_crossings(&surface, start, &lattice, &mut first, progress)?;
            trial = Some((lattice, spacing));
        }
        start += 1;
    }
    // Any other that isn't empty, where all of these are.
    let mut others = (0..sources.len()).filter(|number| !numbers.contains(number));
    while trial.is_none()
        && told.iter().all(|told| told.spacing.1 == 0)
        && let Some(number) = others.next()
    {
        told.push(Told::by(&load(number)?));
    }
    let rest = (start..count)
        .into_par_iter()
        .map(|i| {
            let surface = load(numbers[i])?;
            let (told, mut found) = (Told::by(&surface), Buckets::default());
            if let Some((lattice, spacing)) = &trial
                && told.mean_spacing().is_some_and(|own| own <= COARSER * spacing)
            {
                count_crossings(&surface, i, lattice, &mut found, progress)?;
            }
            Ok((told, found))
        })
        .collect::<Result<Vec<_>>>()?;
    let mut buckets = vec![first];
    for (of_scan, found) in rest {
        told.push(of_scan);
        buckets.push(found);
    }
    let samples: u64 = told.iter().map(|t| t.spacing.1).sum();
    let mean = |sum: f64| sum / samples as f64;
    let spacing = mean(told.iter().map(|t| t.spacing.0).sum());
    if samples == 0 {
        return Err(super::nothing_to_merge());
    }
    if spacing <= 0.0 {
        return Err(Error::input(
            "the samples of the scans are so close to each other that their distance counts as 0: use a smaller unit",
        ));
    }
    let noise = mean(told.iter().map(|t| t.noise * t.spacing.1 as f64).sum());
    let distance = match &trial {
        Some((lattice, _)) => {
            let distances = OverlapDistances::measure(&gather(buckets), None, progress)?;
            distances.quantile(0.5).map_or(0.0, |cells| cells * lattice.voxel)
        }
        None => 0.0,
    };
    let wanted = [
        (SPACINGS * spacing, VoxelReason::Spacing),
        ((DEVIATIONS * noise).min(MOST_SPACINGS * spacing), VoxelReason::Noise),
        ((DISTANCES * distance).min(MOST_SPACINGS * spacing), VoxelReason::Distance),
    ];
    Ok(wanted.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a }).expect("three"))
}

/// A grid to compare scans in, and the spacing of the first; `None` if that has no triangle or no spacing.
fn trial_grid(surface: &OrientedSurface, told: &Told) -> Option<(Lattice, f64)> {
    let &[corner, ..] = surface.triangles.first()?;
    let spacing = told.mean_spacing().filter(|spacing| *spacing > 0.0)?;
    let near = surface.world_from_surface.transform_point3(surface.positions[corner as usize]);
    // What can't be counted in these cells is said when it is counted in smaller ones.
    Lattice::new(TRIAL * spacing, near, [0; 3]).ok().map(|lattice| (lattice, spacing))
}

fn count_crossings(
    surface: &OrientedSurface,
    number: usize,
    lattice: &Lattice,
    found: &mut Buckets,
    progress: &Progress<'_>,
) -> Result<()> {
    // Large triangles, to a background or a ground plane, have more crossings than there is memory for.
    if budget::crossings(surface, lattice.voxel) > CROSSINGS_A_SAMPLE * surface.positions.len() as f64 {
        return Ok(());
    }
    match discretize(surface, "", number as u32, lattice, found, progress) {
        Err(Error::Input(_)) => Ok(()),
        other => other,
    }
}

impl Told {
    fn by(surface: &OrientedSurface) -> Told {
        let mut deviations = surface.noise.as_ref().map_or_else(Vec::new, |noise| noise.deviation.clone());
        let middle = deviations.len() / 2;
        let noise = if deviations.is_empty() {
            0.0
        } else {
            f64::from(*deviations.select_nth_unstable_by(middle, f32::total_cmp).1)
        };
        Told { spacing: nearest_neighbour_sum(surface), noise }
    }

    fn mean_spacing(&self) -> Option<f64> {
        let (sum, samples) = self.spacing;
        (samples > 0).then(|| sum / samples as f64)
    }
}

/// Sum of the world lengths of each vertex's shortest edge, and the number of vertices with an edge, both without outliers.
fn nearest_neighbour_sum(surface: &OrientedSurface) -> (f64, u64) {
    let world: Vec<_> = surface.positions.iter().map(|&p| surface.world_from_surface.transform_vector3(p)).collect();
    let mut nearest = vec![f64::INFINITY; world.len()];
    for t in &surface.triangles {
        for i in 0..3 {
            let (a, b) = (t[i] as usize, t[(i + 1) % 3] as usize);
            let length = world[a].distance(world[b]);
            nearest[a] = nearest[a].min(length);
            nearest[b] = nearest[b].min(length);
        }
    }
    nearest.retain(|d| d.is_finite());
    if nearest.is_empty() {
        return (0.0, 0);
    }
    let mut sorted = nearest.clone();
    let most = OUTLIER * *sorted.select_nth_unstable_by(nearest.len() / 2, f64::total_cmp).1;
    nearest.iter().filter(|&&d| d <= most).fold((0.0, 0), |(sum, n), d| (sum + d, n + 1))
}
