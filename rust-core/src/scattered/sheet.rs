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
use crate::error::Result;
use crate::geom::delaunay3::INFINITE;
use crate::progress::Progress;

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
    chosen.par_sort_unstable();
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
    part: Vec<u16>,
}

/// A cell's ball seen from the sample.
struct Ball {
    radius: f32,
    sides: u8,
    towards: DVec3,
}

/// A facet at the sample, between two cells of the star.
struct Facet {
    clearance: f32,
    vertices: [u32; 3],
    between: [u16; 2],
}

impl Chooser {
    fn choose(&mut self, complex: Complex<'_>, vertex: u32, start: u32, chosen: &mut Vec<([u32; 3], u32)>) {
        complex.star(vertex, start, &mut self.star);
        let count = self.star.cells.len();
        if count > usize::from(u16::MAX) {
            return;
        }
        self.measure(complex, vertex);
        let Some([up, down]) = self.poles() else { return };
        self.collect_facets(complex);
        self.part.clear();
        self.part.extend(0..count as u16);
        for facet in &self.facets {
            let [a, b] = facet.between.map(|cell| root(&mut self.part, cell));
            let [above, below] = [up, down].map(|cell| root(&mut self.part, cell));
            if a != b && [a.min(b), a.max(b)] != [above.min(below), above.max(below)] {
                self.part[usize::from(b)] = a;
            }
        }
        for facet in &self.facets {
            if root(&mut self.part, facet.between[0]) != root(&mut self.part, facet.between[1]) {
                chosen.push((facet.vertices, self.star.cells[usize::from(facet.between[0])].0));
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
                let [a, b, c] = complex.facet(hull, complex.mirror(cell, slot)).map(|v| complex.points[v as usize]);
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
    fn poles(&self) -> Option<[u16; 2]> {
        let outwards: DVec3 = self.balls.iter().filter(|ball| ball.radius.is_infinite()).map(|ball| ball.towards).sum();
        let better = |a: &Ball, b: &Ball| a.radius.total_cmp(&b.radius);
        let up = if outwards.length() > 0.1 {
            let along = |ball: &Ball| if ball.radius.is_infinite() { ball.towards.dot(outwards) } else { f64::MIN };
            (0..self.balls.len()).max_by(|&a, &b| along(&self.balls[a]).total_cmp(&along(&self.balls[b])))?
        } else {
            (0..self.balls.len()).max_by(|&a, &b| better(&self.balls[a], &self.balls[b]))?
        };
        let axis = self.balls[up].towards;
        let down = (0..self.balls.len())
            .filter(|&i| self.balls[i].towards.dot(axis) < -0.5)
            .max_by(|&a, &b| better(&self.balls[a], &self.balls[b]))?;
        Some([up as u16, down as u16])
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
                self.facets.push(Facet { clearance, vertices, between: [place as u16, other as u16] });
            }
        }
        self.facets
            .sort_unstable_by(|a, b| b.clearance.total_cmp(&a.clearance).then_with(|| a.vertices.cmp(&b.vertices)));
    }
}

fn root(parts: &mut [u16], mut cell: u16) -> u16 {
    while parts[usize::from(cell)] != cell {
        let up = parts[usize::from(parts[usize::from(cell)])];
        parts[usize::from(cell)] = up;
        cell = up;
    }
    cell
}
