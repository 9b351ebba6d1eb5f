//! Stage 5: the open surface, from what is certain over the rest.

use super::balls::Balls;
use super::complex::Complex;
use super::params::{Closure, ReconstructParams};
use super::report::ReconstructReport;
use super::seen::Sighted;
use super::{basins, certain, facet_scale, fans, grow, lines, spacing};
use base::error::Result;
use base::progress::Progress;

/// The open surface, grown from what is certain. `balls` if they are at hand.
pub fn open(
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
        facet_scale::mean_perimeter(complex, &certain.iter().map(|c| c.facet).collect::<Vec<_>>(), progress)
    };
    let mut scale = facet_scale::scale(complex, incident, params, typical, report)?;
    if scale.global.is_none() {
        scale.spacings = spacing::all(complex, progress)?;
    }
    let is_joined = params.closure == Closure::Auto;
    let times = if is_joined { facet_scale::BRIDGED } else { 1 };
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
