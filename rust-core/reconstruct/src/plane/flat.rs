//! Samples that lie in one plane but for their noise, or for what no facet of theirs could show.

use glam::DVec3;

use super::Plane;
use crate::noise::Noise;
use crate::patch::Frame;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay2::Delaunay2;
use geom::span;

/// Thickness of a sheet in deviations of its noise: of a million samples of normal noise none lies further from its middle
/// than five.
const DEVIATIONS: f64 = 10.0;

/// ... and in spacings: rounding, and what is as small beside the facets.
const SPACINGS: f64 = 1e-3;

impl Plane {
    /// That of samples which lie along a plane; `None` where they are thicker than their noise.
    pub(crate) fn along(samples: &[DVec3], noise: Noise, progress: &Progress<'_>) -> Result<Option<Plane>> {
        let Some(flat) = flattened(samples, noise, progress)? else { return Ok(None) };
        let corners = span::of(&flat, progress)?;
        let [a, b, c] = corners[..] else { return Ok(None) };
        let triangles = Delaunay2::new(&flat, [a, b, c], progress)?.into_triangles();
        Ok(Some(Plane { triangles, spacings: None }))
    }
}

/// The samples in the plane that fits them best; `None` if they do not lie along it, or two come to lie on each other.
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
    let mut sorted: Vec<[f64; 2]> = flat.iter().map(|p| [p.x, p.y]).collect();
    progress.sort(&mut sorted, &|a: &[f64; 2], b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])))?;
    let is_different = sorted.windows(2).all(|pair| pair[0] != pair[1]);
    Ok(is_different.then_some(flat))
}
