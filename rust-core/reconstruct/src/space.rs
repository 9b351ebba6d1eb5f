//! Samples that span space: stages 1 to 5.

use glam::DVec3;

use super::balls::Balls;
use super::closed::{ENCLOSED, Enclosing, close};
use super::complex::Complex;
use super::found::Found;
use super::manifold::{Separated, Solid};
use super::one_sided::is_one_sided;
use super::opened::open;
use super::params::{Closure, ReconstructParams, Threshold, Topology};
use super::report::ReconstructReport;
use super::seen::{Fronts, Sighted};
use super::{basins, carve, cut, separate, spacing};
use base::error::Result;
use base::memory;
use base::progress::Progress;
use geom::delaunay3::Delaunay3;

/// In all, a finite cell of the tetrahedralization or, where that is more, a point: for closed surfaces and for open ones.
/// Measured.
const BYTES_CLOSED: [f64; 2] = [75.0, 360.0];
/// Of samples that lie on a sphere to the last bits, whose tetrahedra have few cells a point.
const BYTES_DEGENERATE: [f64; 2] = [75.0, 670.0];
const FEW_CELLS: f64 = 4.0;
const BYTES_OPEN: [f64; 2] = [122.0, 690.0];
/// Of samples that carry noise, whose sides a cut finds.
const BYTES_CUT: [f64; 2] = [105.0, 600.0];

/// Part of all samples that what was enclosed at first meets at least, for a closed surface to be tried. The walls of vessels
/// meet 10 to 50 % of theirs, a scan from one side less than 0.1 %, whose lid would go through all in the end.
const MET: f64 = 0.05;

/// Share of the area of a closed surface through samples with noise that is in facets larger than the sampling allows, from which it is
/// open. Of closed shapes it is 0.11 at most, of trees seen from above, which are filled with samples as noise is, 0.15 to 0.36. Measured.
const LIDS: f64 = 0.15;

/// State that depends on the samples only.
pub(super) struct Space {
    delaunay: Delaunay3,
    /// Whether samples carry noise, or did before they were smoothed.
    is_noisy: bool,
    separated: Option<Separated>,
}

impl Space {
    pub(super) fn new(samples: &mut [DVec3], is_noisy: bool, threads: usize, progress: &Progress<'_>) -> Result<Self> {
        let delaunay = Delaunay3::in_place(samples, threads, progress)?;
        Ok(Space { delaunay, is_noisy, separated: None })
    }

    /// `stages`: numbers of those that find the sides and the surface. `is_kept`: whether there will be another surface.
    pub(super) fn surface(
        &mut self,
        sighted: Sighted<'_>,
        params: &ReconstructParams,
        stages: [usize; 2],
        is_kept: bool,
        report: &mut ReconstructReport,
        progress: &Progress<'_>,
    ) -> Result<Found> {
        let samples = &sighted.samples.points;
        let complex = Complex { points: samples, cells: self.delaunay.cells(), finite: self.delaunay.finite_count() };
        report.tetrahedra = complex.finite;
        let is_degenerate = (complex.finite as f64) < FEW_CELLS * samples.len() as f64;
        foresee(complex, if is_degenerate { BYTES_DEGENERATE } else { BYTES_CLOSED })?;
        progress.stage(stages[0], 6 * complex.len() as u64);
        // Facets of what divides inside from outside look outwards.
        let mut is_outward = true;
        let (triangles, solid) = if params.topology == Topology::Free {
            carve_freely(complex, params, report, progress)?
        } else {
            let (separated, mut balls) = match self.separated.take() {
                Some(separated) => (separated, None),
                None => {
                    if self.is_noisy {
                        foresee(complex, BYTES_CUT)?;
                    }
                    let fronts = if self.is_noisy { Fronts::of(sighted, progress)? } else { Fronts::default() };
                    separated(complex, self.is_noisy, &fronts, progress)?
                }
            };
            self.separated = is_kept.then(|| separated.clone());
            separated.dump(complex, "reconstruct-1-cells")?;
            progress.lap("separate");
            report.repaired[0] = separated.repaired;
            progress.stage(stages[1], 1);
            let mut solid = Solid::again(complex, separated);
            let closed = enclose(&mut solid, sighted, &mut balls, self.is_noisy, params, report, progress)?;
            // If nothing is enclosed at first, a surface that grows may still close: of few samples, or between bars.
            let is_to_close = closed.as_ref().is_some_and(Vec::is_empty);
            let mut triangles = closed.unwrap_or_default();
            if triangles.is_empty() {
                is_outward = false;
                foresee(complex, BYTES_OPEN)?;
                let params = match params.closure {
                    Closure::Closed => &ReconstructParams { closure: Closure::Auto, ..*params },
                    Closure::Auto | Closure::Open => params,
                };
                let grown = open(complex, sighted, &solid.incident, balls, params, report, progress)?;
                if report.closed || !is_to_close {
                    triangles = grown;
                }
            }
            (triangles, solid)
        };
        let enclosed = solid.enclosed(&triangles, progress)?;
        progress.check()?;
        Ok(Found { triangles, enclosed, is_outward })
    }
}

/// Refuses what would take more memory than there is.
fn foresee(complex: Complex<'_>, [each_cell, each_point]: [f64; 2]) -> Result<()> {
    let (cells, points) = (complex.finite as f64, complex.points.len());
    let bytes = (each_cell * cells).max(each_point * points as f64);
    memory::expect_in_all(bytes, || format!("a surface through {points} points"), "use fewer")
}

/// The closed surface, if the samples are of one or it is asked for. Else `solid` and `report` are left as they were. If it is tried,
/// `balls`, which only an open one needs, are given back.
fn enclose<'a>(
    solid: &mut Solid<'a>,
    sighted: Sighted<'_>,
    balls: &mut Option<Balls>,
    is_noisy: bool,
    params: &ReconstructParams,
    report: &mut ReconstructReport,
    progress: &Progress<'_>,
) -> Result<Option<Vec<[u32; 3]>>> {
    let samples = solid.complex.points.len();
    let on_surface = solid.on_surface(progress)?;
    let missed = on_surface.iter().filter(|is_on| !**is_on).count();
    let is_mostly_met = 2 * missed < samples;
    let is_certain = params.closure == Closure::Closed || is_mostly_met;
    let is_possible = params.closure == Closure::Auto && (samples - missed) as f64 >= MET * samples as f64;
    if !is_certain && !is_possible {
        return Ok(None);
    }
    *balls = None;
    let may_be_one_sided = params.closure == Closure::Auto && !sighted.seen.sensors.is_empty();
    let may_be_lids = params.closure == Closure::Auto && is_noisy && sighted.seen.is_nothing();
    let before = (!is_certain || may_be_one_sided || may_be_lids).then(|| (solid.clone(), report.clone()));
    let Enclosing { triangles, lids } =
        close(solid, on_surface, [is_mostly_met, may_be_lids], params, report, progress)?;
    if let Some(before) = before
        && (!is_certain && used(&triangles, samples) < ENCLOSED * samples as f64
            || may_be_one_sided && is_one_sided(solid.complex, &triangles, sighted, progress)?
            || lids > LIDS)
    {
        (*solid, *report) = before;
        return Ok(None);
    }
    Ok(Some(triangles))
}

/// Number of vertices that triangles have, of `count`.
fn used(triangles: &[[u32; 3]], count: usize) -> f64 {
    let mut is_used = vec![false; count];
    triangles.as_flattened().iter().for_each(|&vertex| is_used[vertex as usize] = true);
    is_used.into_iter().filter(|is| *is).count() as f64
}

/// Stages 2 to 4 up to the repair: the side of each cell, and the cells' balls if these were asked for. `fronts`: of samples that
/// carry noise.
pub(super) fn separated(
    complex: Complex<'_>,
    is_noisy: bool,
    fronts: &Fronts,
    progress: &Progress<'_>,
) -> Result<(Separated, Option<Balls>)> {
    let by_cut = if is_noisy { cut::sides(complex, fronts, progress)? } else { None };
    let (sides, balls) = match by_cut {
        Some(sides) => (sides, None),
        None => {
            let balls = Balls::of(complex, progress)?;
            (separate::sides(basins::Basins::find(complex, &balls, progress)?, progress)?, Some(balls))
        }
    };
    let mut solid = Solid::new(complex, sides);
    let repaired = solid.repair(progress)?;
    Ok((solid.into_separated(repaired), balls))
}

/// The paper's carving, and its sides.
fn carve_freely<'a>(
    complex: Complex<'a>,
    params: &ReconstructParams,
    report: &mut ReconstructReport,
    progress: &Progress<'_>,
) -> Result<(Vec<[u32; 3]>, Solid<'a>)> {
    let carved = match params.threshold {
        Threshold::Global => carve::carve(complex, params.factor, |facet| complex.perimeter(facet), progress)?,
        Threshold::Local => {
            let spacings = spacing::all(complex, progress)?;
            let size = |mut facet: [u32; 3]| {
                facet.sort_unstable();
                3.0 * complex.perimeter(facet) / facet.map(|v| spacings[v as usize]).into_iter().sum::<f64>()
            };
            carve::carve(complex, params.factor, size, progress)?
        }
    };
    // The border of a solid has none itself.
    report.closed = true;
    report.threshold = carved.threshold;
    report.rounds = carved.rounds;
    let solid = Solid::new(complex, carved.sides);
    Ok((solid.surface(progress)?, solid))
}
