//! Samples that lie in one plane but for their noise, or for what no facet of theirs could show.

use glam::DVec3;

use crate::noise::Noise;
use crate::patch::Frame;
use crate::prepare::{Samples, keep};
use crate::report::Reason;
use crate::smooth::Smoothing;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay2::Delaunay2;
use geom::span;

/// Thickness of a sheet in deviations of its noise: of a million samples of normal noise none lies further from its middle
/// than five.
const DEVIATIONS: f64 = 10.0;

/// ... and in spacings: rounding, and what is as small beside the facets.
const SPACINGS: f64 = 1e-3;

/// The Delaunay triangles of samples which lie along one plane. `None` if they are thicker than their noise. Of samples above each other
/// the first one stays.
pub(super) fn triangulated(
    samples: &mut Samples,
    smoothing: &mut Smoothing,
    progress: &Progress<'_>,
) -> Result<Option<Vec<[u32; 3]>>> {
    let Some(mut flat) = flattened(&samples.points, smoothing.noise, progress)? else { return Ok(None) };
    let is_hidden = hidden(&flat, progress)?;
    keep(&mut flat, &is_hidden);
    let corners = span::of(&flat, progress)?;
    let [a, b, c] = corners[..] else { return Ok(None) };
    let triangles = Delaunay2::new(&flat, [a, b, c], progress)?.into_triangles();
    if flat.len() < is_hidden.len() {
        samples.leave_out(&is_hidden, Reason::Duplicate);
        keep(&mut smoothing.moved, &is_hidden);
        keep(&mut smoothing.measured, &is_hidden);
    }
    Ok(Some(triangles))
}

/// The samples in the plane that fits them best. `None` if they do not lie along it.
fn flattened(samples: &[DVec3], noise: Noise, progress: &Progress<'_>) -> Result<Option<Vec<DVec3>>> {
    let Some(frame) = Frame::of_all(samples, progress)? else { return Ok(None) };
    let spacing = frame.radius() * (std::f64::consts::PI / samples.len() as f64).sqrt();
    let thickest = (DEVIATIONS * noise.deviation).max(SPACINGS * spacing);
    let mut flat = Vec::with_capacity(samples.len());
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for block in progress.blocks(samples) {
        for &sample in block? {
            let [u, v, height] = frame.to_local(sample);
            (low, high) = (low.min(height), high.max(height));
            if !(high - low <= thickest) {
                return Ok(None);
            }
            flat.push(DVec3::new(u, v, 0.0));
        }
    }
    Ok(Some(flat))
}

/// Of each sample in the plane, whether one before it is at the same place.
fn hidden(flat: &[DVec3], progress: &Progress<'_>) -> Result<Vec<bool>> {
    let mut sorted: Vec<([f64; 2], u32)> = flat.iter().zip(0..).map(|(p, i)| ([p.x, p.y], i)).collect();
    let along = |a: &([f64; 2], u32), b: &([f64; 2], u32)| {
        a.0[0].total_cmp(&b.0[0]).then(a.0[1].total_cmp(&b.0[1])).then(a.1.cmp(&b.1))
    };
    progress.sort(&mut sorted, &along)?;
    let mut is_hidden = vec![false; flat.len()];
    for pair in sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        is_hidden[pair[1].1 as usize] = true;
    }
    Ok(is_hidden)
}
