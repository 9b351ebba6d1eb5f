//! The cell from the data, where the caller gives none.

use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

use super::budget;
use super::overlap::OverlapDistances;
use crate::crossings::bundles::{Buckets, ScanCrossings, join};
use crate::crossings::discretize::discretize;
use crate::crossings::lattice::Lattice;
use crate::crossings::scan_order::ScanOrder;
use crate::params::MergeParams;
use crate::report::{MergeReport, VoxelReason};
use crate::stages::MEASURING;
use base::error::{Error, Result};
use base::progress::Progress;
use image::source::{Loading, OrientedSurface};
use image::triangulate::TriangulateParams;

/// At least so many mean distances of neighbouring samples. Coarser cells lose what clean scans show (docs/decisions/cell.md), finer
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

/// Figures that one scan tells.
#[derive(Clone, Copy, Default)]
struct Told {
    /// Sum of the distances of samples to their nearest neighbour, and their number.
    spacing: (f64, u64),
    /// Median standard deviation of the samples.
    noise: f64,
}

/// A grid to compare scans in.
#[derive(Clone, Copy, PartialEq)]
struct Trial {
    lattice: Lattice,
    /// Of the scan that it was made for.
    spacing: f64,
}

/// Findings about a scan.
struct Tried {
    told: Told,
    /// The grid that it would have others compared in. `None` if it has no triangle or no spacing.
    own: Option<Trial>,
    /// Its crossings with the lines of a grid.
    crossings: Option<(Trial, ScanCrossings)>,
}

/// Findings about scans, by the versions that their owner gives them.
#[derive(Default)]
pub struct Known {
    triangulation: TriangulateParams,
    scans: FxHashMap<u64, Tried>,
}

/// The size of a cell as given or, by default, as measured on the scans. Also what decided it. Whatever is `known` of scans of their
/// versions is not found out again.
///
/// # Errors
/// As [`voxel`].
pub fn choose_cell(
    scan_order: &ScanOrder<'_>,
    params: &MergeParams,
    known: &mut Known,
    report: &mut MergeReport,
    progress: &Progress<'_>,
) -> Result<()> {
    progress.stage(MEASURING, 1);
    (report.voxel, report.voxel_reason) = match params.voxel {
        Some(voxel) => (voxel, VoxelReason::Given),
        None => voxel(scan_order, &params.triangulation, known, progress)?,
    };
    progress.lap("measure");
    Ok(())
}

/// The finest cell that up to eight scans, spread through the order, support, and what decided: the spacing of their samples,
/// their noise, or how far scans that overlap lie from each other.
///
/// # Errors
/// A scan can't be loaded. No scan has a triangle. Cancelled.
pub fn voxel(
    scan_order: &ScanOrder<'_>,
    triangulation: &TriangulateParams,
    known: &mut Known,
    progress: &Progress<'_>,
) -> Result<(f64, VoxelReason)> {
    if known.triangulation != *triangulation {
        *known = Known { triangulation: *triangulation, ..Known::default() };
    }
    let mut places = looked_at(scan_order);
    let versions = &scan_order.versions;
    let scans = Scans { scan_order, triangulation, progress };
    // All before the first with a triangle are empty.
    let mut trial = None;
    for &place in &places {
        scans.find_out(&[place], trial, known)?;
        trial = known.scans[&versions[place]].own;
        if trial.is_some() {
            break;
        }
    }
    scans.find_out(&places, trial, known)?;
    let is_empty = |known: &Known, place: usize| known.scans[&versions[place]].told.spacing.1 == 0;
    // Any other that isn't empty, where all of these are.
    let mut others = (0..scan_order.len()).filter(|place| !places.contains(place)).collect::<Vec<_>>().into_iter();
    while trial.is_none()
        && places.iter().all(|&place| is_empty(known, place))
        && let Some(place) = others.next()
    {
        scans.find_out(&[place], None, known)?;
        places.push(place);
    }
    let found: Vec<&Tried> = places.iter().map(|&place| &known.scans[&versions[place]]).collect();
    let samples: u64 = found.iter().map(|scan| scan.told.spacing.1).sum();
    let mean = |sum: f64| sum / samples as f64;
    let spacing = mean(found.iter().map(|scan| scan.told.spacing.0).sum());
    if samples == 0 {
        return Err(super::nothing::nothing_to_merge(triangulation));
    }
    if spacing <= 0.0 {
        return Err(Error::input(
            "the samples of the scans are so close to each other that their distance counts as 0: use a smaller unit",
        ));
    }
    let noise = mean(found.iter().map(|scan| scan.told.noise * scan.told.spacing.1 as f64).sum());
    let distance = match &trial {
        Some(trial) => {
            let crossings = found.iter().zip(&places).filter_map(|(scan, &place)| {
                let (grid, crossings) = scan.crossings.as_ref()?;
                (grid == trial).then_some((scan_order.numbers()[place], crossings))
            });
            let distances = OverlapDistances::measure(&join(crossings), scan_order, false, progress)?;
            distances.quantile(0.5).map_or(0.0, |cells| cells * trial.lattice.voxel)
        }
        None => 0.0,
    };
    let wanted = [
        (SPACINGS * spacing, VoxelReason::Spacing),
        ((DEVIATIONS * noise).min(MOST_SPACINGS * spacing), VoxelReason::Noise),
        ((DISTANCES * distance).min(MOST_SPACINGS * spacing), VoxelReason::Distance),
    ];
    let (cell, reason) = wanted.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a }).expect("three");
    Ok((rounded(cell), reason))
}

/// The places of the scans that are read. These are all, or of each part of the order the one of the smallest number and the one after it.
/// So a scan that comes or goes seldom changes which these are.
pub fn looked_at(scan_order: &ScanOrder<'_>) -> Vec<usize> {
    if scan_order.len() <= SCANS {
        return (0..scan_order.len()).collect();
    }
    let parts = SCANS / 2;
    let border = |part: usize| part * scan_order.len() / parts;
    let first = |part: usize| (border(part)..border(part + 1) - 1).min_by_key(|&place| scan_order.numbers()[place]);
    (0..parts).filter_map(first).flat_map(|first| [first, first + 1]).collect()
}

/// To three digits. So a scan more or less, or one that is turned, seldom changes the sum of all others. The cell that was reported, given
/// as it is read, gives the same surface.
pub fn rounded(cell: f64) -> f64 {
    format!("{cell:.2e}").parse().expect("a number")
}

impl Known {
    /// Forgets all but the scans of these versions.
    pub fn keep(&mut self, versions: &FxHashSet<u64>) {
        self.scans.retain(|version, _| versions.contains(version));
    }
}

/// A list of scans to find something out of.
struct Scans<'a, 'p> {
    scan_order: &'a ScanOrder<'a>,
    triangulation: &'a TriangulateParams,
    progress: &'a Progress<'p>,
}

impl Scans<'_, '_> {
    /// Finds out what is not known of scans at these places. Their crossings with a grid, or with their own where none is given.
    fn find_out(&self, places: &[usize], trial: Option<Trial>, known: &mut Known) -> Result<()> {
        let version = |place: usize| self.scan_order.versions[place];
        let is_known = |place: &&usize| {
            let scan = known.scans.get(&version(**place));
            let is_in_grid = |scan: &Tried| scan.crossings.as_ref().is_some_and(|of| Some(of.0) == trial);
            scan.is_some_and(|scan| trial.is_none() || scan.own.is_none() || is_in_grid(scan))
        };
        let missing: Vec<usize> = places.iter().filter(|place| !is_known(place)).copied().collect();
        let found = missing.into_par_iter().map(|place| Ok((version(place), self.try_scan(place, trial)?)));
        known.scans.extend(found.collect::<Result<Vec<_>>>()?);
        Ok(())
    }

    fn try_scan(&self, place: usize, trial: Option<Trial>) -> Result<Tried> {
        self.progress.check()?;
        let loading = Loading { triangulation: *self.triangulation, cell: 0.0 };
        let surface = self.scan_order.sources[place].load(&loading, self.progress)?;
        let told = Told::by(&surface);
        let own = Trial::of(&surface, &told);
        let Some(trial) = own.and(trial.or(own)) else { return Ok(Tried { told, own, crossings: None }) };
        let mut found = Buckets::default();
        if told.mean_spacing().is_some_and(|own| own <= COARSER * trial.spacing) {
            count_crossings(&surface, &trial.lattice, &mut found, self.progress)?;
        }
        Ok(Tried { told, own, crossings: Some((trial, found.into())) })
    }
}

impl Trial {
    fn of(surface: &OrientedSurface, told: &Told) -> Option<Self> {
        let &[corner, ..] = surface.triangles.first()?;
        let spacing = told.mean_spacing().filter(|spacing| *spacing > 0.0)?;
        let near = surface.world_from_surface.transform_point3(surface.positions[corner as usize]);
        // A scan that can't be counted in these cells is told when it is counted in smaller ones.
        Lattice::new(TRIAL * spacing, near, [0; 3]).ok().map(|lattice| Trial { lattice, spacing })
    }
}

fn count_crossings(
    surface: &OrientedSurface,
    lattice: &Lattice,
    found: &mut Buckets,
    progress: &Progress<'_>,
) -> Result<()> {
    // Large triangles, to a background or a ground plane, have more crossings than there is memory for.
    if budget::crossings(surface, lattice.voxel) > CROSSINGS_A_SAMPLE * surface.positions.len() as f64 {
        return Ok(());
    }
    match discretize(surface, "", 0, lattice, found, progress) {
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
