//! The poles of a sample: the largest empty ball that touches it, and the largest on the other side. \[AB99\] Where the surface is
//! sampled well enough they are on different sides of it.

use glam::DVec3;
use rayon::prelude::*;

use crate::balls::{Balls, CHUNK};
use crate::complex::{Complex, Star};
use crate::spacing;
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::INFINITE;

/// No cell.
const NONE: u32 = u32::MAX;

/// Of a sample.
#[derive(Clone, Copy)]
pub(super) struct Poles {
    /// The cells whose balls they are. The one outside the hull counts as infinitely large.
    pub(super) cells: [u32; 2],
    /// The sample's distance to its neighbours.
    pub(super) spacing: f32,
}

impl Poles {
    pub(super) fn has_both(&self) -> bool {
        !self.cells.contains(&NONE)
    }
}

/// Those of all samples.
pub(super) fn poles(complex: Complex<'_>, balls: &Balls, progress: &Progress<'_>) -> Result<Vec<Poles>> {
    let incident = complex.incident();
    let mut poles = vec![Poles { cells: [NONE; 2], spacing: 0.0 }; incident.len()];
    poles.par_chunks_mut(CHUNK / 8).enumerate().try_for_each_init(Star::default, |star, (chunk, poles)| {
        for (i, poles) in poles.iter_mut().enumerate() {
            let vertex = chunk * (CHUNK / 8) + i;
            if incident[vertex] != NONE {
                poles.spacing = spacing::spacing(complex, vertex as u32, incident[vertex], star) as f32;
                poles.cells = of(complex, balls, vertex as u32, star);
            }
        }
        progress.check()
    })?;
    Ok(poles)
}

/// Mean spacing of the samples among vertices, which does not depend on their order.
pub(super) fn spacing(poles: &[Poles], vertices: &[u32]) -> f32 {
    let mut spacings = [0.0; 4];
    let samples = vertices.iter().filter(|&&vertex| vertex != INFINITE);
    let mut count = 0;
    for (to, &vertex) in spacings.iter_mut().zip(samples) {
        *to = poles[vertex as usize].spacing;
        count += 1;
    }
    spacings[..count].sort_unstable_by(f32::total_cmp);
    spacings[..count].iter().sum::<f32>() / count.max(1) as f32
}

/// Those of the sample with this star.
fn of(complex: Complex<'_>, balls: &Balls, vertex: u32, star: &Star) -> [u32; 2] {
    // By name where equally large; nothing depends on the order of the star.
    let mut sorted: Vec<u32> = star.cells.iter().map(|&(cell, _)| cell).collect();
    sorted.sort_unstable_by(|&a, &b| {
        let by_size = balls.radii[b as usize].total_cmp(&balls.radii[a as usize]);
        by_size.then_with(|| complex.name(a).cmp(&complex.name(b)))
    });
    let here = complex.points[vertex as usize];
    let is_outer = |&cell: &u32| complex.is_outer(cell);
    let Some(&first) = sorted.first() else { return [NONE; 2] };
    // Infinitely large ones have one direction together.
    let outwards = sorted.iter().copied().take_while(is_outer).map(|cell| towards(complex, here, cell));
    let direction = if is_outer(&first) { outwards.sum() } else { towards(complex, here, first) };
    let other = sorted.iter().find(|&&cell| towards(complex, here, cell).dot(direction) < 0.0);
    [first, other.copied().unwrap_or(NONE)]
}

/// The direction from a place to the centre of a cell's ball. Away from the hull, of one outside.
pub(super) fn towards(complex: Complex<'_>, here: DVec3, cell: u32) -> DVec3 {
    let vertices = complex.vertices(cell);
    if complex.is_outer(cell) {
        let slot = vertices.iter().position(|&v| v == INFINITE).expect("a cell outside has the vertex at infinity");
        let [a, b, c] = complex.facet(cell, slot).map(|v| complex.points[v as usize]);
        return (c - a).cross(b - a).normalize_or_zero();
    }
    let lowest = vertices.into_iter().min().expect("four vertices");
    complex.points[lowest as usize] + complex.centred_ball(cell).0 - here
}
