//! The exterior mesh of the tetrahedra, dug until every triangle of it is valid (sections 3.2 and 3.3).
//!
//! A facet of the mesh is named by the tetrahedron behind it, which is what may be dug, and the corner of that which lies
//! opposite. At the lower hull this is a cell at infinity, which can't be dug.

use rayon::prelude::*;

use super::validation::{Judge, Verdict};
use base::error::Result;
use base::progress::Progress;
use geom::delaunay3::{Cell, Delaunay3, INFINITE};

const NONE: u32 = u32::MAX;

/// The dug mesh.
pub(super) struct Dug {
    /// Over pixels, seen from outside like columns toward rows where they face the sensor.
    pub triangles: Vec<[u32; 3]>,
    /// Rounds of digging.
    pub iterations: usize,
    /// Triangles with nothing behind that are farther from a sample than the tolerance.
    pub invalid: usize,
    /// Triangles with nothing behind that are within it, but unreliable.
    pub unreliable: usize,
}

/// A triangle of the exterior mesh.
#[derive(Clone, Copy)]
struct Facet {
    cell: u32,
    corner: u8,
    /// Pixels.
    triangle: [u32; 3],
    verdict: Verdict,
}

struct Exterior<'a> {
    cells: &'a [Cell],
    pixels: &'a [u32],
    facets: Vec<Facet>,
    /// The facet of each corner of each cell, [`NONE`] where it is none of the mesh.
    slots: Vec<u32>,
}

/// Digs until the mesh is valid.
///
/// # Errors
/// [`base::Error::Cancelled`].
pub(super) fn dig(delaunay: &Delaunay3, pixels: &[u32], judge: &Judge<'_>, progress: &Progress<'_>) -> Result<Dug> {
    let cells = delaunay.cells();
    let mut exterior = Exterior { cells, pixels, facets: Vec::new(), slots: vec![NONE; 4 * cells.len()] };
    for cell in 0..delaunay.finite_count() as u32 {
        for corner in 0..4 {
            if cells[cells[cell as usize].neighbours[corner] as usize].vertices[3] == INFINITE {
                let triangle = exterior.outward(cell, corner);
                if judge.turn(triangle) > 0 {
                    exterior.add(cell, corner as u8, triangle);
                }
            }
        }
    }
    let (mut iterations, mut invalid_left, mut unreliable_left) = (0, 0, 0);
    loop {
        progress.check()?;
        let fresh: Vec<usize> =
            (0..exterior.facets.len()).filter(|&i| exterior.facets[i].verdict == Verdict::Unknown).collect();
        let verdicts: Vec<Verdict> = fresh.par_iter().map(|&i| judge.validate(exterior.facets[i].triangle)).collect();
        for (&i, verdict) in fresh.iter().zip(verdicts) {
            exterior.facets[i].verdict = verdict;
        }
        let mut invalid = exterior.invalid();
        if invalid.is_empty() {
            exterior.judge_unreliable(judge);
            invalid = exterior.invalid();
        }
        if invalid.is_empty() {
            break;
        }
        iterations += 1;
        for (cell, corner) in invalid {
            if exterior.slots[4 * cell as usize + corner as usize] == NONE {
                // Its tetrahedron was dug for another of its triangles.
                continue;
            }
            if cells[cell as usize].vertices[3] == INFINITE {
                let facet = exterior.facet_mut(cell, corner);
                facet.verdict = Verdict::Reliable;
                match judge.validate(facet.triangle) {
                    Verdict::Invalid => invalid_left += 1,
                    _ => unreliable_left += 1,
                }
            } else {
                exterior.dig(cell);
            }
        }
        exterior.compact();
    }
    let triangles = exterior.facets.iter().map(|f| f.triangle).collect();
    Ok(Dug { triangles, iterations, invalid: invalid_left, unreliable: unreliable_left })
}

impl Exterior<'_> {
    /// The triangle of a tetrahedron opposite to a corner, counter-clockwise seen from outside of the tetrahedron.
    fn outward(&self, cell: u32, corner: usize) -> [u32; 3] {
        let [a, b, c, d] = self.cells[cell as usize].vertices;
        let triangle = [[b, c, d], [a, d, c], [a, b, d], [a, c, b]][corner];
        triangle.map(|v| self.pixels[v as usize])
    }

    fn add(&mut self, cell: u32, corner: u8, triangle: [u32; 3]) {
        self.slots[4 * cell as usize + corner as usize] = self.facets.len() as u32;
        self.facets.push(Facet { cell, corner, triangle, verdict: Verdict::Unknown });
    }

    fn facet_mut(&mut self, cell: u32, corner: u8) -> &mut Facet {
        &mut self.facets[self.slots[4 * cell as usize + corner as usize] as usize]
    }

    fn invalid(&self) -> Vec<(u32, u8)> {
        self.facets.iter().filter(|f| f.verdict == Verdict::Invalid).map(|f| (f.cell, f.corner)).collect()
    }

    /// Takes a tetrahedron away: those of its triangles that are in the mesh leave it, the others enter.
    fn dig(&mut self, cell: u32) {
        for corner in 0..4 {
            let slot = std::mem::replace(&mut self.slots[4 * cell as usize + corner], NONE);
            if slot != NONE {
                self.facets[slot as usize].verdict = Verdict::Gone;
                continue;
            }
            let behind = self.cells[cell as usize].neighbours[corner];
            let opposite = self.cells[behind as usize].neighbours.iter().position(|&n| n == cell);
            let opposite = opposite.expect("neighbours know each other") as u8;
            let [a, b, c] = self.outward(cell, corner);
            self.add(behind, opposite, [a, c, b]);
        }
    }

    /// Drops the facets that are gone.
    fn compact(&mut self) {
        self.facets.retain(|f| f.verdict != Verdict::Gone);
        for (i, f) in self.facets.iter().enumerate() {
            self.slots[4 * f.cell as usize + f.corner as usize] = i as u32;
        }
    }

    /// Decides on the unreliable triangles by the angles to their neighbours (section 3.4).
    fn judge_unreliable(&mut self, judge: &Judge<'_>) {
        if !self.facets.iter().any(|f| f.verdict == Verdict::Unreliable) {
            return;
        }
        let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * self.facets.len());
        for (i, facet) in self.facets.iter().enumerate() {
            let [a, b, c] = facet.triangle;
            edges.extend([(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), i as u32)));
        }
        edges.par_sort_unstable();
        let beside = |i: u32, a: u32, b: u32| {
            let (a, b) = (a.min(b), a.max(b));
            let start = edges.partition_point(|e| (e.0, e.1) < (a, b));
            edges[start..].iter().take_while(move |e| (e.0, e.1) == (a, b)).map(|e| e.2).filter(move |&j| j != i)
        };
        let verdicts: Vec<(usize, Verdict)> = self
            .facets
            .par_iter()
            .enumerate()
            .filter(|(_, f)| f.verdict == Verdict::Unreliable)
            .map(|(i, facet)| {
                let [a, b, c] = facet.triangle;
                let sharp = [(a, b), (b, c), (c, a)].into_iter().any(|(a, b)| {
                    beside(i as u32, a, b).any(|j| judge.is_sharp(facet.triangle, self.facets[j as usize].triangle))
                });
                let holds = !sharp || judge.holds_along_edges(facet.triangle);
                (i, if holds { Verdict::Reliable } else { Verdict::Invalid })
            })
            .collect();
        for (i, verdict) in verdicts {
            self.facets[i].verdict = verdict;
        }
    }
}
