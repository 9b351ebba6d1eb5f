//! How densely the surface is sampled around a sample.

use rayon::prelude::*;

use super::balls::CHUNK;
use super::complex::{Complex, Star};
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::INFINITE;

/// Neighbours the spacing is taken from: in a plane, a sample has six.
const NEIGHBOURS: usize = 6;

/// Mean distance of a sample to its six nearest Delaunay neighbours; the nearest of all samples always is one.
pub(super) fn spacing(complex: Complex<'_>, vertex: u32, cell: u32, star: &mut Star) -> f64 {
    complex.star(vertex, cell, star);
    let here = complex.points[vertex as usize];
    let mut near = [f64::INFINITY; NEIGHBOURS];
    let mut names = [u32::MAX; NEIGHBOURS];
    for &(cell, _) in &star.cells {
        for other in complex.vertices(cell) {
            if other == vertex || other == INFINITE || names.contains(&other) {
                continue;
            }
            let distance = here.distance(complex.points[other as usize]);
            let place = near.partition_point(|&d| d <= distance);
            if place < NEIGHBOURS {
                near[place..].rotate_right(1);
                names[place..].rotate_right(1);
                (near[place], names[place]) = (distance, other);
            }
        }
    }
    let known = near.iter().take_while(|d| d.is_finite()).count();
    near[..known].iter().sum::<f64>() / known.max(1) as f64
}

/// The spacing at every sample.
pub(super) fn all(complex: Complex<'_>, incident: &[u32], progress: &Progress<'_>) -> Result<Vec<f64>> {
    let mut spacings = vec![0.0; incident.len()];
    spacings.par_chunks_mut(CHUNK / 8).enumerate().try_for_each_init(Star::default, |star, (chunk, spacings)| {
        for (i, to) in spacings.iter_mut().enumerate() {
            let vertex = chunk * (CHUNK / 8) + i;
            if incident[vertex] != u32::MAX {
                *to = spacing(complex, vertex as u32, incident[vertex], star);
            }
        }
        progress.check()
    })?;
    Ok(spacings)
}
