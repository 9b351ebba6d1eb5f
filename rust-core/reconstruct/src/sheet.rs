//! Open surfaces: each sample chooses its own umbrella, and the facets on which all their samples agree stay.
//! \[ACDL00\], \[AGJ02\]
//!
//! Around a sample of an open surface, too, empty space lies on two sides; only, far away they are one. So the question
//! is asked in the star of each sample alone: between its pole, the largest ball, and the largest ball on the other
//! side, the facets at the sample are merged over from the widest gate down as long as the two stay apart. What
//! remains between them is a closed umbrella, the one whose facets, sorted by size, are smallest. Where the surface is
//! sampled well the three samples of a facet agree on it; at a border and in a gap the umbrella is closed by facets that the
//! others do not choose.

use glam::DVec3;
use rayon::prelude::*;

use super::balls::CHUNK;
use super::complex::{Complex, Star};
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::INFINITE;

/// A facet with the number of its vertices that chose it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice {
    /// In the order of their numbers.
    pub(super) vertices: [u32; 3],
    pub(super) votes: u8,
    /// One that has it.
    pub(super) cell: u32,
}

impl Choice {
    /// Whether all its vertices chose it.
    pub(super) fn is_agreed(self) -> bool {
        self.votes == 3 && self.vertices[2] != INFINITE
    }
}

/// Every facet that a vertex chose.
pub(super) fn choices(complex: Complex<'_>, incident: &[u32], progress: &Progress<'_>) -> Result<Vec<Choice>> {
    let parts: Vec<Vec<([u32; 3], u32)>> = incident
        .par_chunks(CHUNK / 8)
        .enumerate()
        .map_init(Chooser::default, |chooser, (chunk, incident)| {
            let mut chosen = Vec::new();
            for (i, &cell) in incident.iter().enumerate().filter(|(_, cell)| **cell != u32::MAX) {
                chooser.choose(complex, (chunk * (CHUNK / 8) + i) as u32, cell, &mut chosen);
                progress.check()?;
            }
            progress.advance(incident.len() as u64)?;
            Ok(chosen)
        })
        .collect::<Result<_>>()?;
    let mut chosen = parts.concat();
    progress.sort(&mut chosen, &Ord::cmp)?;
    Ok(chosen
        .chunk_by(|a, b| a.0 == b.0)
        .map(|same| Choice { vertices: same[0].0, votes: same.len().min(3) as u8, cell: same[0].1 })
        .collect())
}

/// What choosing an umbrella needs, kept for the next one.
#[derive(Default)]
struct Chooser {
    star: Star,
    balls: Vec<Ball>,
    facets: Vec<Facet>,
    /// Of each cell of the star, the representative of its part.
    part: Vec<u32>,
}

/// A cell's ball seen from the sample.
struct Ball {
    radius: f32,
    sides: u8,
    towards: DVec3,
}

/// Directions to the outside at a sample of the convex hull that add up to less than this cancel out.
const OUTWARDS: f64 = 0.1;

/// A facet at the sample, between two cells of the star.
struct Facet {
    clearance: f32,
    vertices: [u32; 3],
    between: [u32; 2],
}

impl Chooser {
    fn choose(&mut self, complex: Complex<'_>, vertex: u32, start: u32, chosen: &mut Vec<([u32; 3], u32)>) {
        complex.star(vertex, start, &mut self.star);
        self.measure(complex, vertex);
        let Some([up, down]) = self.poles(complex) else { return };
        self.collect_facets(complex);
        self.part.clear();
        self.part.extend(0..self.star.cells.len() as u32);
        for facet in &self.facets {
            let [a, b] = facet.between.map(|cell| root(&mut self.part, cell));
            let [above, below] = [up, down].map(|cell| root(&mut self.part, cell));
            if a != b && [a.min(b), a.max(b)] != [above.min(below), above.max(below)] {
                self.part[b as usize] = a;
            }
        }
        for facet in &self.facets {
            if root(&mut self.part, facet.between[0]) != root(&mut self.part, facet.between[1]) {
                chosen.push((facet.vertices, self.star.cells[facet.between[0] as usize].0));
            }
        }
    }

    fn measure(&mut self, complex: Complex<'_>, vertex: u32) {
        let here = complex.points[vertex as usize];
        self.balls.clear();
        for &(cell, _) in &self.star.cells {
            let vertices = complex.vertices(cell);
            self.balls.push(if complex.is_outer(cell) {
                let slot = (0..4).find(|&i| vertices[i] == INFINITE).expect("an outer cell");
                let hull = complex.neighbour(cell, slot);
                let mut facet = complex.facet(hull, complex.mirror(cell, slot));
                // Rounding depends on where the turn around the facet begins.
                let lowest = (0..3).min_by_key(|&i| facet[i]).expect("three vertices");
                facet.rotate_left(lowest);
                let [a, b, c] = facet.map(|v| complex.points[v as usize]);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                Ball { radius: f32::INFINITY, sides: 0b1111, towards: normal }
            } else {
                let lowest = vertices.into_iter().min().expect("four vertices");
                let (centre, radius, sides) = complex.centred_ball(cell);
                let towards = centre + (complex.points[lowest as usize] - here);
                Ball { radius, sides, towards: towards.normalize_or_zero() }
            });
        }
    }

    /// The cells of the two poles.
    fn poles(&self, complex: Complex<'_>) -> Option<[u32; 2]> {
        let name = |i: usize| complex.name(self.star.cells[i].0);
        let mut outer: Vec<usize> = (0..self.balls.len()).filter(|&i| self.balls[i].radius.is_infinite()).collect();
        outer.sort_unstable_by_key(|&i| name(i));
        let outwards: DVec3 = outer.iter().map(|&i| self.balls[i].towards).sum();
        // Of equal ones the one of the least name.
        let best = |places: &mut dyn Iterator<Item = usize>, worth: &dyn Fn(usize) -> f64| {
            places.max_by(|&a, &b| worth(a).total_cmp(&worth(b)).then_with(|| name(b).cmp(&name(a))))
        };
        let radius = |i: usize| f64::from(self.balls[i].radius);
        let up = if outwards.length() > OUTWARDS {
            best(&mut outer.into_iter(), &|i| self.balls[i].towards.dot(outwards))?
        } else {
            best(&mut (0..self.balls.len()), &radius)?
        };
        let axis = self.balls[up].towards;
        let down = best(&mut (0..self.balls.len()).filter(|&i| self.balls[i].towards.dot(axis) < -0.5), &radius)?;
        Some([up as u32, down as u32])
    }

    /// The facets at the sample, from the widest gate down.
    fn collect_facets(&mut self, complex: Complex<'_>) {
        self.facets.clear();
        for (place, &(cell, own)) in self.star.cells.iter().enumerate() {
            for slot in (0..4).filter(|&slot| slot != usize::from(own)) {
                let beyond = complex.neighbour(cell, slot);
                if beyond < cell {
                    continue;
                }
                let other = self.star.find(beyond).expect("the star is closed");
                let mirror = complex.mirror(cell, slot);
                let mut vertices = complex.facet(cell, slot);
                vertices.sort_unstable();
                let [a, b] = [&self.balls[place], &self.balls[other]];
                let smaller = a.radius.min(b.radius);
                let between = a.sides >> slot & 1 == 1 && b.sides >> mirror & 1 == 1;
                let is_finite = vertices[2] != INFINITE;
                let clearance =
                    if between && is_finite { smaller.min(complex.circle(vertices) as f32) } else { smaller };
                self.facets.push(Facet { clearance, vertices, between: [place as u32, other as u32] });
            }
        }
        self.facets
            .sort_unstable_by(|a, b| b.clearance.total_cmp(&a.clearance).then_with(|| a.vertices.cmp(&b.vertices)));
    }
}

fn root(parts: &mut [u32], mut cell: u32) -> u32 {
    while parts[cell as usize] != cell {
        let up = parts[parts[cell as usize] as usize];
        parts[cell as usize] = up;
        cell = up;
    }
    cell
}
