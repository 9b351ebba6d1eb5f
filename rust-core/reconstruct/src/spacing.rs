//! Spacing: how densely the surface is sampled around a sample.

use glam::DVec3;
use rayon::prelude::*;

use super::balls::CHUNK;
use super::complex::{Complex, Star};
use super::fans::{Corners, ends};
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::INFINITE;

/// Neighbours the spacing is taken from: in a plane, a sample has six.
const NEIGHBOURS: usize = 6;

/// The nearest samples found so far.
struct Nearest {
    /// Squared.
    distances: [f64; NEIGHBOURS],
    /// `u32::MAX` where there is none yet.
    names: [u32; NEIGHBOURS],
}

impl Nearest {
    fn none() -> Self {
        Nearest { distances: [f64::INFINITY; NEIGHBOURS], names: [u32::MAX; NEIGHBOURS] }
    }

    /// `distance`: squared.
    fn enter(&mut self, other: u32, distance: f64) {
        // All of the names, and all places: which it is is not foreseen.
        let is_known = self.names.iter().fold(false, |is, &name| is | (name == other));
        if distance >= self.distances[NEIGHBOURS - 1] || is_known {
            return;
        }
        for place in (1..NEIGHBOURS).rev() {
            let before = (self.distances[place - 1], self.names[place - 1]);
            let here = (self.distances[place], self.names[place]);
            let least = if distance < here.0 { (distance, other) } else { here };
            (self.distances[place], self.names[place]) = if distance < before.0 { before } else { least };
        }
        if distance < self.distances[0] {
            (self.distances[0], self.names[0]) = (distance, other);
        }
    }

    fn mean(&self) -> f64 {
        let known = self.names.iter().take_while(|&&name| name != u32::MAX).count();
        self.distances[..known].iter().map(|d| d.sqrt()).sum::<f64>() / known.max(1) as f64
    }
}

/// Mean distance of a sample to its six nearest Delaunay neighbours. The nearest of all samples always is one.
pub(super) fn spacing(complex: Complex<'_>, vertex: u32, cell: u32, star: &mut Star) -> f64 {
    complex.star(vertex, cell, star);
    let here = complex.points[vertex as usize];
    let mut nearest = Nearest::none();
    for &(cell, _) in &star.cells {
        for other in complex.vertices(cell) {
            if other != vertex && other != INFINITE {
                nearest.enter(other, here.distance_squared(complex.points[other as usize]));
            }
        }
    }
    nearest.mean()
}

/// The edges of a cell that lie at two of its neighbours, by which of these count (bits).
const EDGES: [&[[usize; 2]]; 16] = [
    &[],
    &[],
    &[],
    &[[2, 3]],
    &[],
    &[[1, 3]],
    &[[0, 3]],
    &[[2, 3], [1, 3], [0, 3]],
    &[],
    &[[1, 2]],
    &[[0, 2]],
    &[[2, 3], [1, 2], [0, 2]],
    &[[0, 1]],
    &[[1, 3], [1, 2], [0, 1]],
    &[[0, 3], [0, 2], [0, 1]],
    &[[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]],
];

/// The spacing at every sample: like [`spacing`], from all cells one after the other.
pub(super) fn all(complex: Complex<'_>, progress: &Progress<'_>) -> Result<Vec<f64>> {
    let mut nearest: Vec<Nearest> = (0..complex.points.len()).map(|_| Nearest::none()).collect();
    // Beside them, how near a sample must be to count: most are not.
    let mut within = vec![f64::INFINITY; complex.points.len()];
    for cells in progress.ranges(complex.finite) {
        for number in cells? {
            let cell = &complex.cells[number];
            let points = cell.vertices.map(|v| complex.points[v as usize]);
            // An edge counts in cells whose two neighbours at it have higher numbers: of those around it in one at least, in a third of
            // them on average.
            let higher =
                (0..4).fold(0, |bits, slot| bits | usize::from(cell.neighbours[slot] as usize > number) << slot);
            for &[i, j] in EDGES[higher] {
                let distance = points[i].distance_squared(points[j]);
                let [a, b] = [cell.vertices[i], cell.vertices[j]];
                for (at, other) in [(a as usize, b), (b as usize, a)] {
                    if distance < within[at] {
                        nearest[at].enter(other, distance);
                        within[at] = nearest[at].distances[NEIGHBOURS - 1];
                    }
                }
            }
        }
    }
    Ok(nearest.iter().map(Nearest::mean).collect())
}

/// The same at every sample of a plane: to the six nearest samples of all. In space a sample has more than twice as many Delaunay
/// neighbours as count. In a plane those at a border would be counted over the gap beside it.
///
/// The next nearest sample always is a neighbour of one that is nearer \[DDS92\].
pub(super) fn in_plane(points: &[DVec3], triangles: &[[u32; 3]], progress: &Progress<'_>) -> Result<Vec<f64>> {
    let corners = Corners::new(triangles, 0..points.len() as u32, progress)?;
    let spacing = |vertex: u32| {
        let here = points[vertex as usize];
        let mut nearest = Nearest::none();
        let enter_around = |nearest: &mut Nearest, sample: u32| {
            for other in corners.of(sample).iter().flat_map(|&corner| ends(triangles, corner)) {
                if other != vertex {
                    nearest.enter(other, here.distance_squared(points[other as usize]));
                }
            }
        };
        enter_around(&mut nearest, vertex);
        for place in 0..NEIGHBOURS {
            if nearest.names[place] != u32::MAX {
                let sample = nearest.names[place];
                enter_around(&mut nearest, sample);
            }
        }
        nearest.mean()
    };
    let mut spacings = vec![0.0; points.len()];
    spacings.par_chunks_mut(CHUNK / 8).enumerate().try_for_each(|(chunk, spacings)| {
        for (i, to) in spacings.iter_mut().enumerate() {
            *to = spacing((chunk * (CHUNK / 8) + i) as u32);
        }
        progress.check()
    })?;
    Ok(spacings)
}
