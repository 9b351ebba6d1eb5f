//! Places all over the surface at which photos are compared with each other.

use glam::DVec3;
use rayon::prelude::*;

use base::error::Result;
use base::progress::Progress;

use super::atlas::Texel;
use super::behind::{Detail, Place, places};
use super::target::TextureTarget;

/// Samples. Fewer with many photos.
const COUNT: usize = 60_000;
/// Samples of all photos together.
const OF_ALL: usize = 16_000_000;

/// Samples to compare so many photos at.
pub fn count(photos: usize) -> usize {
    (OF_ALL / photos.max(1)).clamp(1000, COUNT)
}

/// Places evenly spread over the mesh, on the detailed surface behind it. The same for any photos of that number.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub fn spread(
    target: &TextureTarget<'_>,
    normals: &[DVec3],
    detail: &Detail<'_>,
    photos: usize,
    progress: &Progress<'_>,
) -> Result<Vec<Place>> {
    let count = count(photos);
    let mut area = 0.0;
    let sums: Vec<f64> = (0..target.mesh.triangles.len())
        .map(|t| {
            let [a, b, c] = target.mesh.corners(t);
            area += (b - a).cross(c - a).length();
            area
        })
        .collect();
    if !(area > 0.0) {
        return Ok(Vec::new());
    }
    let sample = |i: usize| {
        let at = area * (i as f64 + 0.5) / count as f64;
        let t = sums.partition_point(|&sum| sum < at).min(sums.len() - 1);
        // Evenly within triangles, too: multiples of the plastic number's inverses. [Roberts18]
        let [mut b, mut c] =
            [0.754_877_666_246_692_8, 0.569_840_290_998_053_2].map(|step| (0.5 + step * i as f64).fract());
        if b + c > 1.0 {
            (b, c) = (1.0 - b, 1.0 - c);
        }
        Texel { place: 0, triangle: t as u32, weights: [b as f32, c as f32] }
    };
    let texels: Vec<Texel> = (0..count).into_par_iter().map(sample).collect();
    places(&texels, target, normals, detail, progress)
}
