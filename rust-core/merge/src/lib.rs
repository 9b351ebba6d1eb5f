//! Marching Intersections: registered scans -> one surface. \[MI04\]

mod holes;

mod lattice;

mod crossing;

mod bundles;

// 0. which scan is which
mod numbers;

// 1. intersections of the scans with the lines of the grid
mod discretize;
mod intake;

mod defaults;
mod overlap;

mod budget;

mod passes;

// 2. initial removal
mod remove;

// 3. crossings in order along their lines, and added up by edge
mod lines;
mod tally;

// what scans see through
mod sight;

// colours: of edges, made equally bright over the scans, where no scan has any
mod colour;
mod gains;
mod near_colours;

// 4. labels of the nodes, and vertices
mod field;
mod nodes;
mod smooth;

// 3. and 4. as the paper has them
#[cfg(any(test, feature = "reference"))]
pub mod reference;

// 5. to 7. block by block
mod tiles;

// 5. valid cells
mod anomalies;

// 6. the mesh
mod extract;

mod table;

// 7. vertices without a crossing; vertices where two fans meet
mod artificial;
mod pinches;

// 8. parts that are no evidence of a surface; small parts
mod components;
mod connected;
mod parts;
mod stray;

// 9. holes
mod close;
mod peel;

// afterwards: how far the surface lies from the scans
mod deviation;

use std::time::Instant;

use field::{BrickLabels, Bundles, Field, Vertices};
use lattice::Lattice;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

pub use deviation::deviation;
pub use image::source::{Loading, OrientedSurface, PlacedMesh, ScanSource};

use base::error::{Error, Result, Shown};
use base::params::{flag, length, ratio};
use base::progress::Progress;
use image::range_image::noise::Noise;
use image::triangulate::TriangulateParams;
use mesh::TriMesh;

base::params! {
    /// How registered scans are merged into one surface. Lengths are in the unit of the scans.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct MergeParams of "merge" with threads {
        /// Size of a cell of the grid. Smaller keeps more detail and costs time and memory with its inverse square.
        voxel: Option<f64> = length("Voxel")
            .from_data("1.5 times the mean distance of neighbouring samples; more where noise, the distance between overlapping scans or the memory there is ask for it").above(0.0),
        /// Surfaces of different scans closer than this, facing the same way, become one. At least a voxel; choose it above the residual of the registration and below the thinnest wall.
        merge_distance: Option<f64> = length("Merge distance")
            .from_data("from the voxel and the measured distance between overlapping scans"),
        /// Holes whose boundary is at most this long are closed.
        max_hole_length: Option<f64> = length("Max hole length")
            .from_data("100 voxels, but at most a fifth of the diagonal of the connected part the hole is in")
            .off("all are left open"),
        /// Connected parts with fewer triangles than this share of the largest part's are dropped. What no scan saw, between layers of badly placed scans or out of their noise, is dropped in any case.
        min_component_share: f64 = ratio("Smallest part (share)").default(0.0).at_most(1.0).off("all are kept that scans are evidence of"),
        /// Colours of scans that overlap are made equally bright before they are averaged: exposure and white balance differ from scan to scan. By up to a factor of eight: what differs more is of different things.
        match_exposure: bool = flag("Match exposure").on().off("colours are averaged as they are").since("0.2"),
        /// How range images are triangulated.
        triangulation: TriangulateParams,
    }
}

base::choices! {
    /// What decided the size of a cell.
    pub enum VoxelReason {
        /// The caller gave it.
        Given = "given" "as given",
        /// 1.5 times the mean distance of neighbouring samples.
        Spacing = "spacing" "1.5 times the spacing of the samples",
        /// Half the median standard deviation of the samples.
        Noise = "noise" "half the noise of the samples",
        /// 1.5 times the median distance between scans that overlap.
        Distance = "distance" "1.5 times the distance between overlapping scans",
        /// Coarser than that, so that it fits into the memory there is.
        Memory = "memory" "coarser, to fit into memory",
    }
}

impl VoxelReason {
    /// It in words.
    pub const fn words(self) -> &'static str {
        Self::CHOICES[self as usize].label
    }
}

/// The figures of a run, among them those of the paper's Tables 1 and 2.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MergeReport {
    /// Scans merged.
    pub scans: usize,
    /// Names of the scans, in the order of their numbers in the attribute `source_scan`.
    pub scan_names: Vec<String>,
    /// Triangles of all scans.
    pub input_triangles: u64,
    /// Cell size used, world units.
    pub voxel: f64,
    /// What decided that.
    pub voxel_reason: VoxelReason,
    /// Merge distance used, world units.
    pub merge_distance: f64,
    /// Longest boundary that was closed, world units.
    pub max_hole_length: f64,
    /// Median distance between overlapping scans along grid lines, as measured; `None` where none overlap.
    pub overlap_residual: Option<f64>,
    /// Median standard deviation of the samples along their rays, as measured; 0 where scans are clean.
    pub noise: f64,
    /// Of the range images, the median standard deviation of their samples across the rays, that follows from how noise grows on
    /// surfaces seen at an angle; world units.
    pub noise_across: f64,
    /// Of the range images, the median step that values along the ray are multiples of, world units; 0 for none.
    pub noise_step: f64,
    /// Of the range images, the median number of pixels over which errors depend on each other: 1 for white noise.
    pub noise_correlation: f64,
    /// Cells spanned by the scans along x, y and z.
    pub grid: [u64; 3],
    /// Intersections of scans with grid lines.
    pub intersections: u64,
    /// Edges of the grid whose intersections were dropped: more scans see through there than have a surface there.
    pub seen_through: u64,
    /// Intersections left after fusing.
    pub fused_intersections: u64,
    /// Artificial intersections that became vertices.
    pub artificial_intersections: u64,
    /// Faces made directly (case a), after analysis of the neighbouring cells (case b), by hole filling (case c).
    pub faces: [u64; 3],
    /// Holes closed, and boundary loops left open.
    pub holes: [u64; 2],
    /// Components dropped, those that no scan saw and those of less than `min_component_share`, and the faces they had.
    pub dropped_components: [u64; 2],
    /// What the red, green and blue light of each scan, in the order of `scan_names`, was multiplied by to make all equally bright;
    /// empty where they are, or do not overlap, or differ by more than a factor of eight, or that was not asked for.
    pub colour_gains: Vec<[f64; 3]>,
    /// Largest number of bytes held by intersections and the surface at once.
    pub working_bytes: u64,
    /// Names of the stages with their wall-clock seconds.
    pub seconds: Vec<(&'static str, f64)>,
}

/// Result of a merge.
///
/// Vertex attributes: `confidence` (f32, summed over the scans at the vertex), `noise` (f32, standard deviation of the samples
/// along their rays, as measured, 0 where they are clean), `interpolated` (bool: on no scan exactly,
/// artificial or filling a hole), `source_scan` (i32, the scan of largest weight, -1 where interpolated), `colour` if any scan
/// has colours: averaged in linear light; alpha 0 where no scan has one, with the nearest colour of the surface there. Face
/// attribute: `hole_fill` (bool).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// The surface, in the world.
    pub mesh: TriMesh,
    /// Figures of the run.
    pub report: MergeReport,
}

/// Stages of the merge with their shares of its time.
const PLAN: base::progress::Plan = &[
    ("measuring the scans", 0.05),
    ("reading scans, finding intersections", 0.5),
    ("fusing intersections", 0.1),
    ("looking through", 0.05),
    ("labelling nodes", 0.05),
    ("building the surface", 0.2),
    ("closing holes", 0.05),
];

/// Merges the scans into one surface.
///
/// # Errors
/// Parameters out of range; whatever loading a scan can meet; [`Error::Cancelled`].
pub fn run(sources: &[&dyn ScanSource], params: &MergeParams, progress: &Progress<'_>) -> Result<Merged> {
    run_by(sources, params, &Setup::default(), progress)
}

fn run_by(sources: &[&dyn ScanSource], params: &MergeParams, setup: &Setup, progress: &Progress<'_>) -> Result<Merged> {
    params.validate()?;
    if sources.is_empty() {
        return Err(Error::input("no scan to merge: give at least one"));
    }
    if sources.len() > crossing::MAX_SCANS {
        return Err(Error::input(format!(
            "{} scans are more than the {} that fit",
            sources.len(),
            crossing::MAX_SCANS
        )));
    }
    progress.plan(PLAN);
    let pool = base::threads::pool(params.threads)?;
    let merged = progress.run(&pool, || merge(sources, params, setup, progress));
    // Whatever else went wrong meanwhile, the caller asked for an end.
    if merged.is_err() {
        progress.check()?
    }
    merged
}

/// The paper's list of steps.
fn merge(sources: &[&dyn ScanSource], params: &MergeParams, setup: &Setup, progress: &Progress<'_>) -> Result<Merged> {
    let mut clock = Clock::start();
    let mut report = MergeReport { scans: sources.len(), ..MergeReport::default() };
    let sources = numbers::in_order(sources, &params.triangulation, progress)?;
    report.scan_names = sources.iter().map(|s| s.name().to_owned()).collect();

    progress.stage(0, 1);
    (report.voxel, report.voxel_reason) = match params.voxel {
        Some(voxel) => (voxel, VoxelReason::Given),
        None => defaults::voxel(&sources, &params.triangulation, progress)?,
    };
    clock.lap("measure");

    progress.stage(1, sources.len() as u64);
    let mut scans = loop {
        let budget = budget::Budget::new(report.voxel, sources.len());
        let lattice_near = |near| Lattice::new(report.voxel, near, setup.corner);
        match intake::discretize_all(&sources, params, &budget, setup.kept, lattice_near, progress) {
            Err(Error::OutOfMemory(_)) if params.voxel.is_none() && budget.fits().is_some_and(|v| v > report.voxel) => {
                report.voxel = budget.fits().unwrap_or(report.voxel);
                report.voxel_reason = VoxelReason::Memory;
                progress.stage(1, sources.len() as u64);
            }
            found => break found?,
        }
    };
    let lattice = scans.lattice;
    report.input_triangles = scans.triangles;
    let over_images = |of_image: fn(&Noise) -> f64| {
        let mut all: Vec<f64> = scans.images.iter().map(|(_, measured)| of_image(&measured.noise)).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    };
    report.noise_across = over_images(Noise::across).unwrap_or(0.0);
    report.noise_step = over_images(Noise::typical_step).unwrap_or(0.0);
    report.noise_correlation = over_images(Noise::correlation).unwrap_or(1.0);
    report.intersections = scans.buckets.iter().map(|b| b.len).sum();
    report.working_bytes = scans.buckets.iter().map(bundles::Buckets::bytes).sum();
    let raw = bundles::gather(std::mem::take(&mut scans.buckets));
    clock.lap("discretize");

    progress.stage(2, raw.len() as u64);
    let are_sampled = report.intersections > setup.kept;
    let distances = overlap::OverlapDistances::measure(&raw, are_sampled.then_some(sources.len()), progress)?;
    let median = distances.quantile(0.5);
    report.overlap_residual = median.map(|d| d * report.voxel);
    let reach = match params.merge_distance {
        Some(distance) => distance / report.voxel,
        None => distances.quantile(0.95).map_or(1.0, |d| OVERLAP * d).max(1.0),
    };
    clock.lap("overlap");
    report.merge_distance = params.merge_distance.unwrap_or(reach * report.voxel);
    let (labels, vertices) = match setup.fusing {
        Fusing::ByVotes => {
            let rule = field::Rule { reach: reach.max(1.0), spread: median.map_or(0.0, |d| SPREAD * d) };
            let bundles = sort_lines(raw, progress)?;
            let tallies: usize = bundles.list.iter().map(|bundle| bundle.list.len()).sum();
            report.working_bytes = report.working_bytes.max((tallies * size_of::<tally::Tally>()) as u64);
            clock.lap("sort");
            progress.stage(3, scans.images.len() as u64);
            let aside = distances.largest_quarter().map_or(0.0, |d| OVERLAP * Q95_BY_QUARTER * d);
            let tolerance = reach.max(1.0).max(aside) * report.voxel;
            let (bundles, seen_through) =
                sight::drop_seen_through(bundles, &sources, &scans.images, &lattice, tolerance, progress)?;
            report.seen_through = seen_through;
            clock.lap("sight");
            if params.match_exposure && scans.coloured {
                report.colour_gains = gains::measure(&bundles, sources.len(), progress)?;
                clock.lap("colours");
            }
            label_nodes(&bundles, &rule, &colour::Gains::new(&report.colour_gains), progress)?
        }
        #[cfg(any(test, feature = "reference"))]
        Fusing::ByLines => {
            let full_trust = f64::from(scans.full_trust);
            reference::label_nodes(raw, reference::Rule { merge_distance: reach, full_trust }, progress)?
        }
    };
    report.fused_intersections = vertices.values().flatten().map(|of_axis| of_axis.len() as u64).sum();
    clock.lap("label");
    let bricks = tiles::bricks(&labels);
    let blocks = tiles::blocks(&bricks, setup.block);
    progress.stage(5, blocks.iter().map(|(_, near)| 2 * near.len() as u64).sum());
    let build = |(block, near)| tiles::build(block, near, &labels, &vertices, &lattice, &mut clock, progress);
    let tiles = blocks.into_iter().map(build).collect::<Result<Vec<_>>>()?;
    drop((labels, vertices));
    report.artificial_intersections = tiles.iter().map(|tile| tile.artificial).sum();
    report.noise = tiles::typical_noise(&tiles);
    let parts = parts::find(&tiles, progress)?;
    let stray = stray::stray(&tiles, &parts, report.voxel, reach, progress)?;
    let kept: Vec<bool> = stray.iter().map(|&goes| !goes).collect();
    let small = components::small(&parts.list, &kept, params.min_component_share);
    let kept: Vec<bool> = kept.iter().zip(&small).map(|(&is_kept, &goes)| is_kept && !goes).collect();
    let gone = || parts.list.iter().zip(&kept).filter(|part| !part.1).map(|part| part.0.faces);
    report.dropped_components = [gone().count() as u64, gone().sum()];
    let size = components::extent(&parts.list, &kept);
    let (mut surface, mut part_of) = tiles::join(tiles, parts.of, progress)?;
    if kept.contains(&false) {
        let keep = passes::made(part_of.len(), progress, |v| kept[part_of[v] as usize])?;
        components::compact(&mut surface, &keep, progress)?;
        passes::retain(&mut part_of, progress, |v, _| keep[v])?;
    }
    clock.lap("components");
    refuse_nothing(&surface, report.voxel, params.min_component_share)?;
    report.grid = (size / report.voxel).ceil().to_array().map(|cells| cells as u64);
    report.working_bytes = report.working_bytes.max(surface.bytes());

    progress.stage(6, 1);
    report.max_hole_length = match params.max_hole_length {
        Some(length) => length,
        None => (HOLE_VOXELS * report.voxel).min(HOLE_SHARE * size.length()),
    };
    let limit = match params.max_hole_length {
        Some(length) => close::Limit::Length(length),
        None => close::Limit::OfPart(report.max_hole_length, HOLE_SHARE),
    };
    let holes = close::close_holes(&mut surface, &parts.list, &part_of, limit, &lattice, progress)?;
    report.holes = [holes.closed, holes.open];
    if holes.peeled {
        let dropped = components::drop_small(&mut surface, params.min_component_share, progress)?;
        report.dropped_components[0] += dropped.components;
        report.dropped_components[1] += dropped.faces;
        refuse_nothing(&surface, report.voxel, params.min_component_share)?;
    }
    report.faces = surface.count_cases(progress)?;
    if scans.coloured {
        near_colours::fill_in(&mut surface, progress)?;
    }
    let mesh = surface.into_mesh(scans.coloured, progress)?;
    clock.lap("holes");
    report.seconds = clock.laps;
    Ok(Merged { mesh, report })
}

/// By default the distance of merging is so many times what 95 in 100 distances between overlapping scans are within, and at
/// least a cell: of normally distributed ones 3.5 deviations.
const OVERLAP: f64 = 1.8;
/// What 95 in 100 normally distributed distances are within, by what a quarter of them is.
const Q95_BY_QUARTER: f64 = 6.15;
/// Of normally distributed errors the standard deviation, by the median distance of two that have it.
const SPREAD: f64 = 1.048_4;
/// By default holes are closed up to a boundary of this many voxels ...
const HOLE_VOXELS: f64 = 100.0;
/// ... and of at most this share of the diagonal of the bounding box of the part they are in.
const HOLE_SHARE: f64 = 0.2;

fn nothing_to_merge() -> Error {
    Error::input(
        "no scan has a triangle, so there is nothing to merge: check the scans, check what was kept of them, or raise edge_limit",
    )
}

fn refuse_nothing(surface: &extract::Surface, voxel: f64, min_share: f64) -> Result<()> {
    if !surface.is_empty() {
        return Ok(());
    }
    let or_share = if min_share > 0.0 { ", or a smaller min_component_share" } else { "" };
    Err(Error::input(format!(
        "nothing is left of the surface: choose a voxel smaller than {} (in the unit of the scans){or_share}",
        Shown::digits(voxel, 4)
    )))
}

/// What no parameter says.
struct Setup {
    /// Where bricks are counted from.
    corner: [i64; 3],
    fusing: Fusing,
    /// Crossings of a worker that are kept one by one; where there are more they are added up.
    kept: u64,
    /// Bricks along each side of a block; else all is one.
    block: Option<i32>,
}

impl Default for Setup {
    fn default() -> Self {
        Setup { corner: [0; 3], fusing: Fusing::ByVotes, kept: bundles::MANY, block: None }
    }
}

/// How crossings of several scans become one surface.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fusing {
    ByVotes,
    /// As in the paper.
    #[cfg(any(test, feature = "reference"))]
    ByLines,
}

type Labels = FxHashMap<[i32; 3], Box<BrickLabels>>;
type BrickVertices = FxHashMap<[i32; 3], Vertices>;

fn sort_lines(raw: Vec<bundles::RawBundle>, progress: &Progress<'_>) -> Result<Bundles> {
    let sort = |raw: bundles::RawBundle| {
        progress.advance(1)?;
        Ok(lines::sort(raw.key, raw.found.added.tallies, raw.found.chunks))
    };
    Ok(Bundles::new(raw.into_par_iter().map(sort).collect::<Result<_>>()?))
}

fn label_nodes(
    bundles: &Bundles,
    rule: &field::Rule,
    gains: &colour::Gains,
    progress: &Progress<'_>,
) -> Result<(Labels, BrickVertices)> {
    let bricks = bundles.labelled_bricks();
    progress.stage(4, bricks.len() as u64);
    let found = bricks
        .into_par_iter()
        .map_init(Field::default, |field, brick| {
            progress.advance(1)?;
            Ok(field.label(bundles, brick, rule, gains).map(|(labels, vertices)| ((brick, labels), (brick, vertices))))
        })
        .collect::<Result<Vec<_>>>()?;
    Ok(found.into_iter().flatten().unzip())
}

struct Clock {
    last: Instant,
    laps: Vec<(&'static str, f64)>,
}

impl Clock {
    fn start() -> Self {
        Clock { last: Instant::now(), laps: Vec::new() }
    }

    /// Ends a lap, or a part of one.
    fn lap(&mut self, name: &'static str) {
        let now = Instant::now();
        let seconds = (now - std::mem::replace(&mut self.last, now)).as_secs_f64();
        match self.laps.iter_mut().find(|lap| lap.0 == name) {
            Some(lap) => lap.1 += seconds,
            None => self.laps.push((name, seconds)),
        }
    }
}

#[cfg(test)]
mod tests;
