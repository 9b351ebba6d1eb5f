//! Scattered points -> surface, over their 3D Delaunay tetrahedralization. \[RELP00\]
//!
//! | stage | file | in -> out |
//! |---|---|---|
//! | 0 | `prepare` | points -> samples in an order of their own, equal ones once |
//! |   | `seen` | from which side they were seen, where sensors or normals say |
//! |   | `noise`, `smooth` | how much noise they carry; where that is much, samples on the surface they tell, without outliers |
//! |   | `rounding` | the steps of their coordinates, which hide noise |
//! |   | `isolated` | whether samples without noise have outliers, which are left out then |
//! | 1 | `geom::delaunay3` | samples -> tetrahedra |
//! |   | `balls`, `slivers` | the circumscribed balls of these, however flat |
//! | 2 | `basins` | tetrahedra -> basins of empty space, the gates between them (the paper's erosion included) |
//! | 3 | `separate` | basins -> inside and outside |
//! |   | `cut` | or, of samples that carry noise, cells -> inside and outside |
//! | 4 | `manifold`, `dig` | a surface between the two that is manifold and meets the samples |
//! |   | `one_sided` | if sensors are known, whether they saw it from one side only: then it is open |
//! | 5 | `certain`, `grow`, `hinge`, `best`, `border`, `fans` | open surfaces, which divide nothing: from what is certain over the rest |
//! |   | `lines` | lines of sight and facets: if sensors are known, jumps and places that were seen through stay open |
//! |   | `gaps` | large facets that bound no gap |
//! |   | `handles`, `join`, `gather`, `lids` | handles that samples force; parts joined; through samples passed by; small loops closed |
//! | 6 | `orient` | outward, or as normals or sensors say |
//!
//! With `topology = free` stages 2 to 5 give way to `carve`, the paper's own. `space` has them in their order. Samples that
//! lie in one plane have no tetrahedra: `plane` triangulates them in it.
//!
//! *Differences from the paper.* (1) No sample is lost to numerical errors. (2) It is not one threshold on perimeters that decides which
//! cells are outside, but how empty space hangs together: through gates that are wide beside the rooms they join. So sparse places stay
//! closed and dense gaps open, and a threshold that is too small can not eat the object. (3) The surface is manifold, after Boissonnat's
//! rules \[Boi84\]. (4) Open surfaces are found, too. (5) The threshold, global or local, says which facets are too large to be trusted.
//! These are those that would tie a stray point to the surface, those over the border of an open one, and on request those that close a
//! gap.
//!
//! Cost: O(n log n) in practice. The tetrahedralization takes more than half of the time.

#![cfg_attr(test, allow(clippy::print_stdout))]

// what goes in and out
mod operation;
mod params;
mod report;

// 0. samples
mod isolated;
mod noise;
mod patch;
mod prepare;
mod rounding;
mod scales;
mod seeds;
mod seen;
mod smooth;

mod balls;
mod complex;
mod slivers;

// 2. basins and gates
mod basins;

// 3. sides
mod cut;
mod separate;

// 4. manifold, and through all samples
mod dig;
mod manifold;

// 5. open surfaces
mod best;
mod border;
mod certain;
mod fans;
mod gaps;
mod gather;
mod grow;
mod handles;
mod hinge;
mod join;
mod lids;
mod lines;

// the paper's own carving
mod carve;

mod spacing;

// 6. orientation
mod orient;

// what the samples span: the stages above, or fewer
mod one_sided;
mod plane;
mod space;

// all of it, and again with other parameters
mod reconstructor;

use balls::Balls;
use complex::{Complex, Star};
use dig::Through;
use manifold::{Separated, Solid};
use rayon::prelude::*;
use seen::{Fronts, Sighted};

pub use operation::OPERATION;
pub use reconstructor::PLAN;
pub use reconstructor::Reconstructor;

pub use params::{Closure, NoisyPoints, ReconstructParams, SCHEMA, Threshold, Topology};
pub use report::{Dropped, Reason, ReconstructReport, Reconstructed};

use base::error::Result;
use base::progress::{Pace, Progress};
use mesh::point_cloud::PointCloud;

/// Spacings that the mean side of a trusted facet may have, before the factor. Samples at random over a plane leave
/// triangles with a perimeter of up to three times the mean.
const TRUSTED: f64 = 2.5;

/// Size of facets across the gaps of an open surface, beside that of others, from which on they have to be smooth.
const BRIDGED: u32 = 4;

/// Part of all samples that a closed surface goes through at least, if what was enclosed at first met less than half. The walls of a vessel
/// may be thinner than its samples are apart. Of an open surface next to nothing is enclosed.
const ENCLOSED: f64 = 0.99;

/// Reconstructs a surface from a cloud. To try several parameters use a [`Reconstructor`].
///
/// # Errors
/// See [`Reconstructor::surface`].
pub fn run(cloud: &PointCloud, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Reconstructed> {
    Reconstructor::new(cloud)?.into_surface(params, progress)
}

/// Like [`run`] in less memory: the places of the cloud's points are given back as soon as they are sorted, 24 bytes each.
///
/// # Errors
/// See [`Reconstructor::surface`].
pub fn run_owned(cloud: PointCloud, params: &ReconstructParams, progress: &Progress<'_>) -> Result<Reconstructed> {
    Reconstructor::new(cloud)?.into_surface_of_its_own(params, progress)
}

/// Stages 2 to 4 up to the repair: the side of each cell, and the cells' balls if these were asked for. `fronts`: of samples that
/// carry noise.
fn separate(
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

/// The surface that was found.
struct Found {
    triangles: Vec<[u32; 3]>,
    /// Of each sample, whether the surface is around it.
    enclosed: Vec<bool>,
    /// Whether triangles look where they should without normals or sensors.
    is_outward: bool,
}

/// Measure of the perimeter of a facet, and how much of it is trusted.
struct Scale<'a> {
    complex: Complex<'a>,
    incident: &'a [u32],
    star: Star,
    /// Of each sample, 0 where not yet asked for.
    spacings: Vec<f64>,
    /// Perimeter trusted everywhere. `None`: in spacings of the facet's samples.
    global: Option<f64>,
    trusted: f64,
}

impl Scale<'_> {
    /// Largest perimeter a facet may have.
    fn allowed(&mut self, mut facet: [u32; 3]) -> f64 {
        // Sums depend on the order, and that on how a cell lists its vertices.
        facet.sort_unstable();
        match self.global {
            Some(perimeter) => perimeter,
            None => {
                let spacing = |v: u32| {
                    let known = &mut self.spacings[v as usize];
                    if *known == 0.0 {
                        *known = spacing::spacing(self.complex, v, self.incident[v as usize], &mut self.star);
                    }
                    *known
                };
                self.trusted * facet.map(spacing).into_iter().sum::<f64>()
            }
        }
    }
}

/// The mean perimeter, the same for any order of the triangles.
fn mean_perimeter(complex: Complex<'_>, triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<f64> {
    let mut perimeters: Vec<f64> = triangles.par_iter().map(|&t| complex.perimeter(t)).collect();
    progress.sort(&mut perimeters, &f64::total_cmp)?;
    Ok(perimeters.iter().sum::<f64>() / perimeters.len().max(1) as f64)
}

fn scale<'a>(
    complex: Complex<'a>,
    incident: &'a [u32],
    params: &ReconstructParams,
    typical: impl FnOnce() -> Result<f64>,
    report: &mut ReconstructReport,
) -> Result<Scale<'a>> {
    let trusted = TRUSTED * params.factor;
    let global = match params.threshold {
        Threshold::Global => Some(trusted * typical()?),
        Threshold::Local => None,
    };
    report.threshold = global.unwrap_or(3.0 * trusted);
    let spacings = vec![0.0; if global.is_none() { complex.points.len() } else { 0 }];
    Ok(Scale { complex, incident, star: Star::default(), spacings, global, trusted })
}

/// The closed surface, through all samples in its reach. `is_mostly_met`: whether what is enclosed at first meets most of them.
/// `may_be_lids`: whether to look for these.
fn close(
    solid: &mut Solid<'_>,
    mut on_surface: Vec<bool>,
    [is_mostly_met, may_be_lids]: [bool; 2],
    params: &ReconstructParams,
    report: &mut ReconstructReport,
    progress: &Progress<'_>,
) -> Result<Enclosing> {
    let (complex, incident) = (solid.complex, solid.incident.clone());
    let typical = || mean_perimeter(complex, &solid.surface(progress)?, progress);
    let mut scale = scale(complex, &incident, params, typical, report)?;
    let mut gathered = solid.gather(&mut on_surface, |facet| scale.allowed(facet), progress)?;
    for through in [Through::Small, Through::Anything] {
        gathered += solid.dig(&mut on_surface, |facet| scale.allowed(facet), through, progress)?;
        gathered += solid.gather(&mut on_surface, |facet| scale.allowed(facet), progress)?;
        // To reach a few samples no opening is closed.
        if is_mostly_met || share(&on_surface) >= ENCLOSED {
            break;
        }
    }
    report.repaired[1] = gathered;
    let mut triangles = solid.surface(progress)?;
    // So that what is cut does not depend on the numbers of the cells.
    canonical(&mut triangles, progress)?;
    let before = triangles.len();
    if params.closure == Closure::Open {
        let mut left_out = Vec::new();
        triangles.retain(|&triangle| {
            let is_allowed = complex.perimeter(triangle) <= scale.allowed(triangle);
            if !is_allowed {
                left_out.push(triangle);
            }
            is_allowed
        });
        let sizes = |triangle| [complex.perimeter(triangle), scale.allowed(triangle)];
        gaps::close_small(&mut triangles, &left_out, sizes, params.closure, progress)?;
    }
    // Triangles that the repair could not mend, and vertices where gaps meet.
    fans::keep_largest(&mut triangles, complex.points.len(), |triangle| complex.perimeter(triangle), progress)?;
    report.cut_facets = before - triangles.len();
    report.closed = report.cut_facets == 0 || fans::are_closed(&triangles, complex.points.len());
    let lids =
        if may_be_lids { lids_over_gaps(complex, &triangles, |facet| scale.allowed(facet), progress)? } else { 0.0 };
    Ok(Enclosing { triangles, lids })
}

/// A closed surface.
struct Enclosing {
    triangles: Vec<[u32; 3]>,
    /// The share of its area that is in facets larger than the sampling allows. 0 if these are not looked for.
    lids: f64,
}

/// Triangles that are looked at for that share.
const LOOKED_AT: usize = 4096;

/// The share of the area of triangles, in an order of their own, that is in facets larger than allowed.
fn lids_over_gaps(
    complex: Complex<'_>,
    triangles: &[[u32; 3]],
    mut allowed: impl FnMut([u32; 3]) -> f64,
    progress: &Progress<'_>,
) -> Result<f64> {
    let (mut lids, mut all) = (0.0, 0.0);
    let mut pace = Pace::new(progress);
    for &facet in triangles.iter().step_by(triangles.len().div_ceil(LOOKED_AT).max(1)) {
        pace.after(1)?;
        let area = complex.area(facet);
        all += area;
        if complex.perimeter(facet) > allowed(facet) {
            lids += area;
        }
    }
    Ok(if all > 0.0 { lids / all } else { 0.0 })
}

/// Of samples, the part that is on the surface.
fn share(on_surface: &[bool]) -> f64 {
    on_surface.iter().filter(|is_on| **is_on).count() as f64 / on_surface.len() as f64
}

/// The open surface, grown from what is certain. `balls` if they are at hand.
fn open(
    complex: Complex<'_>,
    sighted: Sighted<'_>,
    incident: &[u32],
    balls: Option<Balls>,
    params: &ReconstructParams,
    report: &mut ReconstructReport,
    progress: &Progress<'_>,
) -> Result<Vec<[u32; 3]>> {
    let balls = match balls {
        Some(balls) => balls,
        None => Balls::of(complex, progress)?,
    };
    let typical = || {
        let mut certain = certain::certain(complex, &balls, basins::TANGENT, 1, |_| true, progress)?;
        if certain.is_empty() {
            certain = certain::certain(complex, &balls, 0.0, 1, |_| true, progress)?;
        }
        mean_perimeter(complex, &certain.iter().map(|c| c.facet).collect::<Vec<_>>(), progress)
    };
    let mut scale = scale(complex, incident, params, typical, report)?;
    if scale.global.is_none() {
        scale.spacings = spacing::all(complex, progress)?;
    }
    let is_joined = params.closure == Closure::Auto;
    let times = if is_joined { BRIDGED } else { 1 };
    let lines = lines::Lines::of(sighted, |sample| scale.allowed([sample; 3]), progress)?;
    let mut front = grow::Front::grow(complex, &balls, &lines, |facet| scale.allowed(facet), progress)?;
    front.join_loops(progress)?;
    if is_joined {
        front.join_parts(times, progress)?;
        front.join_loops(progress)?;
    }
    front.gather(incident, times, progress)?;
    let mut triangles = front.close_loops(times, is_joined, progress)?;
    report.cut_facets =
        fans::keep_largest(&mut triangles, complex.points.len(), |triangle| complex.perimeter(triangle), progress)?;
    report.closed = fans::are_closed(&triangles, complex.points.len());
    Ok(triangles)
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

/// Each triangle from its lowest vertex, and all in order: the same for any numbers of the cells.
fn canonical(triangles: &mut [[u32; 3]], progress: &Progress<'_>) -> Result<()> {
    for range in progress.ranges(triangles.len()) {
        for triangle in &mut triangles[range?] {
            let lowest = (0..3).min_by_key(|&i| triangle[i]).expect("three vertices");
            triangle.rotate_left(lowest);
        }
    }
    progress.sort(triangles, &Ord::cmp)
}

#[cfg(any(test, fuzzing))]
pub mod fuzzing;
#[cfg(test)]
mod tests;
