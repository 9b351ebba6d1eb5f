//! Stage 4 and what follows it: the closed surface, of which on request large facets are left out.

use super::complex::Complex;
use super::deep_samples::Through;
use super::found::canonical;
use super::manifold::Solid;
use super::params::{Closure, ReconstructParams};
use super::report::ReconstructReport;
use super::{facet_scale, fans, gaps};
use base::error::Result;
use base::progress::{Pace, Progress};

/// Part of all samples that a closed surface goes through at least, if what was enclosed at first met less than half. The walls of a vessel
/// may be thinner than its samples are apart. Of an open surface next to nothing is enclosed.
pub const ENCLOSED: f64 = 0.99;

/// The closed surface, through all samples in its reach. `is_mostly_met`: whether what is enclosed at first meets most of them.
/// `may_be_lids`: whether to look for these.
pub fn close(
    solid: &mut Solid<'_>,
    mut on_surface: Vec<bool>,
    [is_mostly_met, may_be_lids]: [bool; 2],
    params: &ReconstructParams,
    report: &mut ReconstructReport,
    progress: &Progress<'_>,
) -> Result<Enclosing> {
    let (complex, incident) = (solid.complex, solid.incident.clone());
    let typical = || facet_scale::mean_perimeter(complex, &solid.surface(progress)?, progress);
    let mut scale = facet_scale::scale(complex, &incident, params, typical, report)?;
    let mut gathered = solid.gather(&mut on_surface, |facet| scale.allowed(facet), progress)?;
    for through in [Through::Small, Through::Anything] {
        gathered += solid.reach_deep_samples(&mut on_surface, |facet| scale.allowed(facet), through, progress)?;
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
pub struct Enclosing {
    pub triangles: Vec<[u32; 3]>,
    /// The share of its area that is in facets larger than the sampling allows. 0 if these are not looked for.
    pub lids: f64,
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
