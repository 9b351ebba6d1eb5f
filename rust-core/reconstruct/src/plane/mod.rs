//! Samples that lie in one plane, exactly or but for their noise (`flat`): stages 1 to 5, which are few there. Nothing is enclosed and
//! nothing folds, so the surface is what the threshold leaves of their triangulation.

mod flat;

use glam::DVec3;
use rayon::prelude::*;

use super::facet_scale::TRUSTED;
use super::found::Found;
use super::params::{Closure, ReconstructParams, Threshold, Topology};
use super::prepare::Samples;
use super::report::ReconstructReport;
use super::smooth::Smoothing;
use super::{fans, gaps, spacing};
use base::error::{Error, Result};
use base::progress::Progress;
use geom::delaunay2::Delaunay2;

/// Change of the mean perimeter, as a part of it, at which it is taken for the last time: that of the paper.
const SETTLED: f64 = 0.01;

/// State that depends on the samples only.
pub(super) struct Plane {
    /// Of the whole convex hull.
    triangles: Vec<[u32; 3]>,
    spacings: Option<Vec<f64>>,
}

impl Plane {
    /// `corners`: places of three samples that are not on one line.
    pub(super) fn new(samples: &[DVec3], corners: [usize; 3], progress: &Progress<'_>) -> Result<Self> {
        let triangles = Delaunay2::new(samples, corners, progress)?.into_triangles();
        Ok(Plane { triangles, spacings: None })
    }

    /// The plane of samples which lie along one. `None` if they are thicker than their noise. Of samples above each other the first one
    /// stays.
    pub(super) fn along(
        samples: &mut Samples,
        smoothing: &mut Smoothing,
        progress: &Progress<'_>,
    ) -> Result<Option<Self>> {
        let triangles = flat::triangulated(samples, smoothing, progress)?;
        Ok(triangles.map(|triangles| Plane { triangles, spacings: None }))
    }

    pub(super) fn surface(
        &mut self,
        samples: &[DVec3],
        params: &ReconstructParams,
        report: &mut ReconstructReport,
        progress: &Progress<'_>,
    ) -> Result<Found> {
        if (params.topology, params.closure) == (Topology::Manifold, Closure::Closed) {
            return Err(Error::input(
                "the points lie in one plane, which encloses nothing: let the closure be auto or open",
            ));
        }
        let perimeters: Vec<f64> = self.triangles.par_iter().map(|&t| perimeter(samples, t)).collect();
        progress.check()?;
        let trusted = TRUSTED * params.factor;
        let mut triangles = match params.threshold {
            Threshold::Global => {
                (report.threshold, report.rounds) = global_threshold(&perimeters, trusted, progress)?;
                self.kept(samples, &perimeters, |_| report.threshold, params, progress)?
            }
            Threshold::Local => {
                report.threshold = 3.0 * trusted;
                if self.spacings.is_none() {
                    self.spacings = Some(spacing::in_plane(samples, &self.triangles, progress)?);
                }
                let spacings = self.spacings.as_ref().expect("just made");
                let allowed = |t: [u32; 3]| trusted * t.map(|v| spacings[v as usize]).into_iter().sum::<f64>();
                self.kept(samples, &perimeters, allowed, params, progress)?
            }
        };
        if params.topology == Topology::Manifold {
            fans::keep_largest(&mut triangles, samples.len(), |t| perimeter(samples, t), progress)?;
        }
        report.cut_facets = self.triangles.len() - triangles.len();
        Ok(Found { triangles, enclosed: vec![false; samples.len()], is_outward: true })
    }

    /// The triangles whose perimeters are allowed, and with a manifold topology those that bound no gap.
    fn kept(
        &self,
        samples: &[DVec3],
        perimeters: &[f64],
        allowed: impl Fn([u32; 3]) -> f64,
        params: &ReconstructParams,
        progress: &Progress<'_>,
    ) -> Result<Vec<[u32; 3]>> {
        let (mut kept, mut left_out) = (Vec::new(), Vec::new());
        for range in progress.ranges(self.triangles.len()) {
            for t in range? {
                let triangle = self.triangles[t];
                if perimeters[t] <= allowed(triangle) { kept.push(triangle) } else { left_out.push(triangle) }
            }
        }
        if params.topology == Topology::Manifold {
            let sizes = |triangle| [perimeter(samples, triangle), allowed(triangle)];
            gaps::close_small(&mut kept, &left_out, sizes, params.closure, progress)?;
        }
        Ok(kept)
    }
}

fn perimeter(samples: &[DVec3], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|v| samples[v as usize]);
    a.distance(b) + b.distance(c) + c.distance(a)
}

/// So many times the mean perimeter of those below it, and how often that was taken. \[RELP00\] Without taking it again,
/// triangles between parts, which are few and huge, would make up a threshold that keeps them.
fn global_threshold(perimeters: &[f64], trusted: f64, progress: &Progress<'_>) -> Result<(f64, usize)> {
    let mut sorted = perimeters.to_vec();
    progress.sort(&mut sorted, &f64::total_cmp)?;
    let (mut threshold, mut rounds) = (f64::INFINITY, 0);
    loop {
        let below = sorted.partition_point(|&perimeter| perimeter <= threshold);
        let next = trusted * sorted[..below].iter().sum::<f64>() / below as f64;
        rounds += 1;
        progress.check()?;
        if !(next < (1.0 - SETTLED) * threshold) {
            return Ok((next, rounds));
        }
        threshold = next;
    }
}

#[cfg(test)]
mod tests;
