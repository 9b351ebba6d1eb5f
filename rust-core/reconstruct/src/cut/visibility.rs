//! Words of samples on the cells along the line on which they were seen: before them is outside, behind them inside. \[LPK09\]

use glam::DVec3;
use rayon::prelude::*;

use super::poles::Poles;
use crate::complex::{Complex, Star};
use crate::seen::Fronts;
use base::error::Result;
use base::progress::Progress;

/// Distance before and behind a sample, in spacings: further off lies a surface that bends away, or the other side of a thin wall.
const REACH: f64 = 1.0;

/// Samples between two checks for cancelling.
const CHUNK: usize = 1 << 11;

/// Of each cell, the number of samples that say that it is outside, and inside. None if nothing is known of them.
pub(super) fn votes(
    complex: Complex<'_>,
    poles: &[Poles],
    fronts: &Fronts,
    progress: &Progress<'_>,
) -> Result<Vec<[u32; 2]>> {
    if fronts.are_unknown() {
        return Ok(Vec::new());
    }
    let incident = complex.incident();
    let found: Vec<[Vec<u32>; 2]> = poles
        .par_chunks(CHUNK)
        .enumerate()
        .map_init(Star::default, |star, (chunk, poles)| {
            progress.check()?;
            let mut found = [Vec::new(), Vec::new()];
            for (vertex, poles) in (chunk * CHUNK..).zip(poles) {
                let front = fronts.at(vertex);
                if front == DVec3::ZERO || incident[vertex] == u32::MAX {
                    continue;
                }
                complex.star(vertex as u32, incident[vertex], star);
                for (found, direction) in found.iter_mut().zip([front, -front]) {
                    let reach = REACH * f64::from(poles.spacing);
                    along(complex, vertex as u32, star, direction, reach, |cell| found.push(cell));
                }
            }
            Ok(found)
        })
        .collect::<Result<_>>()?;
    let mut votes = vec![[0; 2]; complex.len()];
    for found in found {
        progress.check()?;
        for (side, cells) in found.into_iter().enumerate() {
            cells.into_iter().for_each(|cell| votes[cell as usize][side] += 1);
        }
    }
    Ok(votes)
}

/// Looks at the cells along a line from a vertex, those inside the hull, as far as `reach`. If the line meets an edge or a vertex to the
/// last bit, it looks at those of one side of it.
fn along(complex: Complex<'_>, vertex: u32, star: &Star, direction: DVec3, reach: f64, mut look: impl FnMut(u32)) {
    let here = complex.points[vertex as usize];
    // Six times the volume of the line with an edge: rounded the same from either end, so that cells with the edge agree.
    let side = |from: u32, to: u32| {
        let [low, high] = [from.min(to), from.max(to)].map(|v| complex.points[v as usize] - here);
        let volume = direction.dot(low.cross(high));
        if from < to { volume } else { -volume }
    };
    let is_first = |&&(cell, own): &&(u32, u8)| {
        let [a, b, c] = complex.facet(cell, usize::from(own));
        !complex.is_outer(cell) && side(a, b) >= 0.0 && side(b, c) >= 0.0 && side(c, a) >= 0.0
    };
    let first = star.cells.iter().filter(is_first).min_by_key(|(cell, _)| complex.name(*cell));
    let Some((mut cell, mut slot)) = first.map(|&(cell, own)| (cell, usize::from(own))) else { return };
    loop {
        look(cell);
        let mut facet = complex.facet(cell, slot);
        let beyond = complex.neighbour(cell, slot);
        if complex.is_outer(beyond) || !(distance(complex, facet, here, direction) < reach) {
            return;
        }
        let entry = complex.mirror(cell, slot);
        let apex = complex.vertices(beyond)[entry];
        // Counter-clockwise around the line: it leaves between the ends of the edge that are on either side of the apex.
        let Some(turns) = (0..3).find(|&i| side(facet[i], apex) < 0.0 && side(facet[(i + 1) % 3], apex) >= 0.0) else {
            return;
        };
        facet.rotate_left(turns);
        let passed = facet[2];
        slot = complex.vertices(beyond).iter().position(|&v| v == passed).expect("a vertex of the facet between");
        cell = beyond;
    }
}

/// Distance along a line to the plane of a facet.
fn distance(complex: Complex<'_>, mut facet: [u32; 3], from: DVec3, direction: DVec3) -> f64 {
    facet.sort_unstable();
    let [a, b, c] = facet.map(|v| complex.points[v as usize] - from);
    let normal = (b - a).cross(c - a);
    normal.dot(a) / normal.dot(direction)
}
