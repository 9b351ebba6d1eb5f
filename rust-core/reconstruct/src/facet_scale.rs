//! How large facets may be: their perimeters beside the spacing of samples.

use rayon::prelude::*;

use super::complex::{Complex, Star};
use super::params::{ReconstructParams, Threshold};
use super::report::ReconstructReport;
use super::spacing;
use base::error::Result;
use base::progress::Progress;

/// Spacings that the mean side of a trusted facet may have, before the factor. Samples at random over a plane leave
/// triangles with a perimeter of up to three times the mean.
pub const TRUSTED: f64 = 2.5;

/// Size of facets across the gaps of an open surface, beside that of others, from which on they have to be smooth.
pub const BRIDGED: u32 = 4;

/// Measure of the perimeter of a facet, and how much of it is trusted.
pub struct FacetScale<'a> {
    pub complex: Complex<'a>,
    pub incident: &'a [u32],
    pub star: Star,
    /// Of each sample, 0 where not yet asked for.
    pub spacings: Vec<f64>,
    /// Perimeter trusted everywhere. `None`: in spacings of the facet's samples.
    pub global: Option<f64>,
    pub trusted: f64,
}

impl FacetScale<'_> {
    /// Largest perimeter a facet may have.
    pub fn allowed(&mut self, mut facet: [u32; 3]) -> f64 {
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
pub fn mean_perimeter(complex: Complex<'_>, triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<f64> {
    let mut perimeters: Vec<f64> = triangles.par_iter().map(|&t| complex.perimeter(t)).collect();
    progress.sort(&mut perimeters, &f64::total_cmp)?;
    Ok(perimeters.iter().sum::<f64>() / perimeters.len().max(1) as f64)
}

pub fn scale<'a>(
    complex: Complex<'a>,
    incident: &'a [u32],
    params: &ReconstructParams,
    typical: impl FnOnce() -> Result<f64>,
    report: &mut ReconstructReport,
) -> Result<FacetScale<'a>> {
    let trusted = TRUSTED * params.factor;
    let global = match params.threshold {
        Threshold::Global => Some(trusted * typical()?),
        Threshold::Local => None,
    };
    report.threshold = global.unwrap_or(3.0 * trusted);
    let spacings = vec![0.0; if global.is_none() { complex.points.len() } else { 0 }];
    Ok(FacetScale { complex, incident, star: Star::default(), spacings, global, trusted })
}
